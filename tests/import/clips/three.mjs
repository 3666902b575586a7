// Prints where three.js (npm) has the vertices of a glTF file at 20 times of a clip:
//   node three.mjs moving.gltf > moving.txt   (a number behind the file: another clip)
import fs from 'node:fs';
import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';

globalThis.self = globalThis;
globalThis.ProgressEvent ??= class {};
const gltf = await new GLTFLoader().parseAsync(fs.readFileSync(process.argv[2], 'utf8'), '');
const mixer = new THREE.AnimationMixer(gltf.scene);
const clip = gltf.animations[Number(process.argv[3] ?? 0)];
mixer.clipAction(clip).play();
for (let step = 0; step < 20; ++step) {
  mixer.setTime(clip.duration * (step + 0.37) / 20);
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse((node) => {
    if (!node.isMesh) return;
    const places = node.geometry.attributes.position;
    for (let i = 0; i < places.count; ++i) {
      const at = new THREE.Vector3();
      node.getVertexPosition(i, at).applyMatrix4(node.matrixWorld);
      console.log(at.toArray().map((part) => part.toFixed(6)).join(' '));
    }
  });
}
