import {follow} from 'modar/playcanvas';
import * as pc from 'playcanvas';

const canvas = document.querySelector('canvas');
const app = new pc.Application(canvas, {graphicsDeviceOptions: {alpha: true}});
app.start();
const camera = new pc.Entity('camera');
camera.addComponent('camera');
app.root.addChild(camera);

// The picture's longer side reaches from -1 to 1 of its print.
const cover = new pc.Entity('cover');
const cube = new pc.Entity('cube');
const material = new pc.StandardMaterial();
material.emissive = new pc.Color(0, 1, 0);
material.update();
cube.addComponent('render', {type: 'box', material});
cube.setLocalScale(0.5, 0.5, 0.5);
cube.setLocalPosition(0, 0, 0.25);
cover.addChild(cube);
app.root.addChild(cover);

const {modar} = await follow('demo.modar', {app, camera, prints: {cover}});
modar.addEventListener('lost', ({detail}) => console.log(detail.name, detail.reason));
Object.assign(globalThis, {app, camera, cover, cube});  // for the console
