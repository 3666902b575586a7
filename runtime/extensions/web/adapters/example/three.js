import {follow} from 'modar/three';
import * as THREE from 'three';

const canvas = document.querySelector('canvas');
const renderer = new THREE.WebGLRenderer({canvas, alpha: true, antialias: true});
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera();

// The picture's longer side reaches from -1 to 1 of its print.
const cover = new THREE.Group();
const material = new THREE.MeshBasicMaterial({color: 0x00ff00});
const cube = new THREE.Mesh(new THREE.BoxGeometry(0.5, 0.5, 0.5), material);
cube.position.z = 0.25;
cover.add(cube);
scene.add(cover);

const {modar} = await follow('demo.modar', {renderer, scene, camera, prints: {cover}});
modar.addEventListener('lost', ({detail}) => console.log(detail.name, detail.reason));
Object.assign(globalThis, {camera, cover});  // for the console
