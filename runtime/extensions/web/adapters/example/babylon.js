import {FreeCamera} from '@babylonjs/core/Cameras/freeCamera.js';
import {Engine} from '@babylonjs/core/Engines/engine.js';
import {Color3} from '@babylonjs/core/Maths/math.color.js';
import {Vector3} from '@babylonjs/core/Maths/math.vector.js';
import {StandardMaterial} from '@babylonjs/core/Materials/standardMaterial.js';
import {CreateBox} from '@babylonjs/core/Meshes/Builders/boxBuilder.js';
import {TransformNode} from '@babylonjs/core/Meshes/transformNode.js';
import {Scene} from '@babylonjs/core/scene.js';
import {follow} from 'modar/babylon';

const engine = new Engine(document.querySelector('canvas'), true);
const scene = new Scene(engine);
const camera = new FreeCamera('camera', Vector3.Zero(), scene);
const cover = new TransformNode('cover', scene);

const following = follow('demo.modar', {scene, camera, prints: {cover}});
// The picture's longer side reaches from -1 to 1 of its print.
const cube = CreateBox('cube', {size: 0.5}, scene);
cube.material = new StandardMaterial('green', scene);
cube.material.emissiveColor = new Color3(0, 1, 0);
cube.position.z = 0.25;
cube.parent = cover;
const {modar} = await following;
modar.addEventListener('lost', ({detail}) => console.log(detail.name, detail.reason));
Object.assign(globalThis, {camera, cover, cube});  // for the console
