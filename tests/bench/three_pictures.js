// Draws a model with three.js from the views of modar-play's turntable, and compares with the turntable's pictures.
import * as THREE from 'three';
import { GLTFLoader } from 'jsm/loaders/GLTFLoader.js';
import { MTLLoader } from 'jsm/loaders/MTLLoader.js';
import { OBJLoader } from 'jsm/loaders/OBJLoader.js';
import { PLYLoader } from 'jsm/loaders/PLYLoader.js';
import { STLLoader } from 'jsm/loaders/STLLoader.js';

// neutral_room() of runtime/render/light.cpp: what a white surface of that normal gets from all around, and the key light.
const SKY = [[0.267, 0.27, 0.276], [-0.03, -0.03, -0.03], [0.145, 0.15, 0.158], [-0.04, -0.04, -0.04]];
const KEY = { direction: [-0.55, -0.5, 0.67], colour: [0.88, 0.86, 0.825] };
const GROUND = [219, 219, 217]; // of the turntable
const TILT = 20;

/** The light of the room by direction: a surface sees two thirds of its linear part. */
function environment(renderer) {
  const [width, height] = [256, 128];
  const texels = new Float32Array(4 * width * height);
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      const longitude = ((column + 0.5) / width - 0.5) * 2 * Math.PI;
      const latitude = ((row + 0.5) / height - 0.5) * Math.PI;
      const [x, y, z] = [Math.cos(latitude) * Math.cos(longitude), Math.sin(latitude), Math.cos(latitude) * Math.sin(longitude)];
      for (let c = 0; c < 3; c++) {
        texels[4 * (row * width + column) + c] = SKY[0][c] + 1.5 * (SKY[1][c] * y + SKY[2][c] * z + SKY[3][c] * x);
      }
      texels[4 * (row * width + column) + 3] = 1;
    }
  }
  const picture = new THREE.DataTexture(texels, width, height, THREE.RGBAFormat, THREE.FloatType);
  picture.mapping = THREE.EquirectangularReflectionMapping;
  picture.magFilter = picture.minFilter = THREE.LinearFilter;
  picture.needsUpdate = true;
  return new THREE.PMREMGenerator(renderer).fromEquirectangular(picture).texture;
}

/** The same for materials that no environment lights: irradiance, by three.js' constants of spherical harmonics. */
function probe() {
  const light = new THREE.LightProbe();
  SKY.forEach((rgb, i) => light.sh.coefficients[i].set(...rgb).multiplyScalar(Math.PI / (i === 0 ? 0.886227 : 2 * 0.511664)));
  return light;
}

function surface(geometry) {
  if (!geometry.attributes.normal) geometry.computeVertexNormals();
  const vertexColors = Boolean(geometry.attributes.color);
  return new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ vertexColors, color: vertexColors ? 0xffffff : 0xcccccc }));
}

async function object(url) {
  const text = await (await fetch(url)).text();
  const loader = new OBJLoader();
  const library = /^mtllib\s+(.+?)\s*$/m.exec(text);
  if (library) {
    const materials = await new MTLLoader().loadAsync(new URL(library[1], new URL(url, location.href)).href);
    materials.preload();
    loader.setMaterials(materials);
  }
  const loading = new Promise((resolve) => { THREE.DefaultLoadingManager.onLoad = resolve; });
  THREE.DefaultLoadingManager.itemStart('model');
  const model = loader.parse(text);
  THREE.DefaultLoadingManager.itemEnd('model');
  await loading;
  return model;
}

async function read(url, ending) {
  if (ending === 'ply') return surface(await new PLYLoader().loadAsync(url));
  if (ending === 'stl') return surface(await new STLLoader().loadAsync(url));
  return ending === 'obj' ? object(url) : (await new GLTFLoader().loadAsync(url)).scene;
}

async function picture(url, side) {
  const image = new Image();
  image.src = url;
  await image.decode();
  const canvas = Object.assign(document.createElement('canvas'), { width: side, height: side });
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, side, side).data;
}

function lab(pixels, at) {
  const [r, g, b] = [0, 1, 2].map((c) => {
    const v = pixels[at + c] / 255;
    return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  });
  const f = (t) => (t > 216 / 24389 ? Math.cbrt(t) : (24389 / 27 * t + 16) / 116);
  const x = f((0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047);
  const y = f(0.2126729 * r + 0.7151522 * g + 0.0721750 * b);
  const z = f((0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

/** CIEDE2000 (Sharma, Wu, Dalal 2005), all weights 1. */
function difference(p, q) {
  const degree = Math.PI / 180;
  const mean7 = ((Math.hypot(p[1], p[2]) + Math.hypot(q[1], q[2])) / 2) ** 7;
  const stretch = 1.5 - 0.5 * Math.sqrt(mean7 / (mean7 + 25 ** 7));
  const [a1, a2] = [p[1] * stretch, q[1] * stretch];
  const [c1, c2] = [Math.hypot(a1, p[2]), Math.hypot(a2, q[2])];
  const hue = (a, b) => (a === 0 && b === 0 ? 0 : (Math.atan2(b, a) / degree + 360) % 360);
  const [h1, h2] = [hue(a1, p[2]), hue(a2, q[2])];
  const gray = c1 * c2 === 0;
  let turn = gray ? 0 : h2 - h1;
  if (turn > 180) turn -= 360;
  if (turn < -180) turn += 360;
  let h = gray ? h1 + h2 : (h1 + h2) / 2;
  if (!gray && Math.abs(h1 - h2) > 180) h += h1 + h2 < 360 ? 180 : -180;
  const l = (p[0] + q[0]) / 2 - 50;
  const c = (c1 + c2) / 2;
  const wave = (angle) => Math.cos(angle * degree);
  const t = 1 - 0.17 * wave(h - 30) + 0.24 * wave(2 * h) + 0.32 * wave(3 * h + 6) - 0.2 * wave(4 * h - 63);
  const dl = (q[0] - p[0]) / (1 + 0.015 * l * l / Math.sqrt(20 + l * l));
  const dc = (c2 - c1) / (1 + 0.045 * c);
  const dh = 2 * Math.sqrt(c1 * c2) * Math.sin(turn / 2 * degree) / (1 + 0.015 * c * t);
  const turned = -2 * Math.sqrt(c ** 7 / (c ** 7 + 25 ** 7)) * Math.sin(60 * Math.exp(-(((h - 275) / 25) ** 2)) * degree);
  return Math.sqrt(dl * dl + dc * dc + dh * dh + turned * dc * dh);
}

/** Mean difference over pixels that both show, and the share that one shows alone. */
function compared(ours, theirs) {
  let [sum, both, either] = [0, 0, 0];
  for (let at = 0; at < ours.length; at += 4) {
    const shown = GROUND.some((value, c) => ours[at + c] !== value);
    if (!shown && theirs[at + 3] === 0) continue;
    either++;
    if (!shown || theirs[at + 3] < 255) continue;
    sum += difference(lab(ours, at), lab(theirs, at));
    both++;
  }
  return { mean: both ? sum / both : NaN, both, alone: either ? 1 - both / either : 0 };
}

function beside(pictures, side) {
  const canvas = Object.assign(document.createElement('canvas'), { width: side * pictures.length, height: side });
  const context = canvas.getContext('2d');
  pictures.forEach((pixels, i) => context.putImageData(new ImageData(new Uint8ClampedArray(pixels), side, side), i * side, 0));
  return canvas.toDataURL();
}

let renderer;
globalThis.compare = async ({ url, ending, centre, scale, distance, views, side }) => {
  renderer ??= new THREE.WebGLRenderer({ alpha: true, preserveDrawingBuffer: true });
  renderer.setSize(side, side, false);
  renderer.setClearColor(0, 0);
  const scene = new THREE.Scene();
  const key = new THREE.DirectionalLight(new THREE.Color(...KEY.colour), Math.PI);
  key.position.set(...KEY.direction);
  scene.add(key, key.target);
  if (ending === 'glb' || ending === 'gltf') scene.environment = environment(renderer);
  else scene.add(probe());
  const placed = new THREE.Group();
  placed.matrixAutoUpdate = false;
  placed.matrix.makeRotationX(Math.PI / 2).scale(new THREE.Vector3(1, 1, 1).divideScalar(scale))
    .multiply(new THREE.Matrix4().makeTranslation(...centre.map((v) => -v)));
  placed.add(await read(url, ending));
  scene.add(placed);
  placed.updateMatrixWorld(true);
  const camera = new THREE.PerspectiveCamera(2 * Math.atan(0.5) * 180 / Math.PI, 1, distance / 100, distance * 10);
  camera.matrixAutoUpdate = false;
  let worst = { mean: -1 };
  let [sum, pixels, alone] = [0, 0, 0];
  for (let view = 0; view < views; view++) {
    const ours = await picture(`/ours/frame_${String(view).padStart(6, "0")}.png?${performance.now()}`, side);
    const eye = new THREE.Matrix4().makeTranslation(0, 0, -distance)
      .multiply(new THREE.Matrix4().makeRotationX((TILT - 90) * Math.PI / 180))
      .multiply(new THREE.Matrix4().makeRotationZ(2 * Math.PI * view / views));
    camera.matrix.copy(eye).invert();
    camera.updateMatrixWorld(true);
    renderer.render(scene, camera);
    const gl = renderer.getContext();
    const theirs = new Uint8Array(4 * side * side);
    gl.readPixels(0, 0, side, side, gl.RGBA, gl.UNSIGNED_BYTE, theirs);
    const upright = new Uint8Array(theirs.length);
    for (let row = 0; row < side; row++) upright.set(theirs.subarray(4 * side * row, 4 * side * (row + 1)), 4 * side * (side - 1 - row));
    const result = compared(ours, upright);
    if (result.both === 0) continue;
    sum += result.mean * result.both;
    pixels += result.both;
    alone = Math.max(alone, result.alone);
    if (result.mean > worst.mean) worst = { ...result, view, picture: beside([ours, upright], side) };
  }
  scene.traverse((part) => part.geometry?.dispose());
  if (pixels === 0) throw new Error('no pixel that both show');
  const rounded = (value) => Math.round(value * 100) / 100;
  return { delta_e: rounded(sum / pixels), worst_view: rounded(worst.mean), view: worst.view, alone: rounded(alone), picture: worst.picture };
};
