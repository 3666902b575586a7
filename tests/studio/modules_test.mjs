// Modules of the studio's page, without a browser: what they ask of the server, and what they draw.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import test, { after } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';

const ROOT = fileURLToPath(new URL('../../', import.meta.url));
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'modar-studio-'));
after(() => fs.rmSync(folder, { recursive: true }));
fs.cpSync(path.join(ROOT, 'bake/extensions/studio/page'), folder, { recursive: true });
fs.writeFileSync(path.join(folder, 'package.json'), '{"type": "module"}');
fs.mkdirSync(path.join(folder, 'engine'));
fs.copyFileSync(path.join(ROOT, 'runtime/extensions/web/turntable.js'), path.join(folder, 'engine/turntable.js'));
fs.writeFileSync(path.join(folder, 'engine/modar-view.js'), 'export const View = { create: async () => ({}) };\n');
fs.writeFileSync(path.join(folder, 'engine/modar.js'), 'export const load = async () => globalThis.opened();\n');

// As much of a browser as the modules touch. elements: what querySelector() has found.
class Element extends EventTarget {
  style = {};
  dataset = {};
  videoWidth = 4;
  videoHeight = 3;
  srcObject = null;
  querySelector() { return new Element(); }
  closest() { return null; }
  getContext() { return null; }
  getBoundingClientRect() { return { left: 0, top: 0 }; }
  setPointerCapture() {}
  removeAttribute() {}
  async play() {}
}
class MediaStream {
  stopped = 0;
  getTracks() { return [{ stop: () => { ++this.stopped; } }]; }
}
let shown;
const asked = [];
const answers = {};
const define = (name, value) => Object.defineProperty(globalThis, name, { value, configurable: true, writable: true });
const m = Object.assign((tag, ...rest) => ({ tag, rest }), { redraw() {}, mount: (_, component) => { shown = component; } });
for (const [name, value] of Object.entries({
  m, Element, MediaStream, window: globalThis, HTMLElement: Element, HTMLVideoElement: Element, HTMLCanvasElement: Element, HTMLImageElement: Element,
  ResizeObserver: class { observe() {} }, IntersectionObserver: class { observe() {} }, EventSource: EventTarget, location: { hash: '#/files', search: '' }, navigator: { languages: ['en'] },
  document: { documentElement: {}, body: new Element() }, addEventListener() {}, requestAnimationFrame: () => 1, cancelAnimationFrame() {},
  fetch: async (address, { method = 'GET', body } = {}) => {
    if (address.startsWith('words/')) return new Response('{}');
    asked.push({ call: `${method} ${address}`, body: body && JSON.parse(body) });
    return new Response(JSON.stringify(answers[address] ?? project));
  },
})) define(name, value);

const PATTERN = { name: 'cover', file: 'cover.png', kind: 'flat', sides: {}, corners: null, width_mm: null, height_mm: null };
const project = { revision: '1', patterns: [PATTERN], models: [], scenes: [], problems: [], bundle: {}, languages: ['en'], phone: null };
const module = (name) => import(pathToFileURL(path.join(folder, name)));
const [{ Picture }, { placed }, { Stage }, { sideName, surfaceOf }, { state }, { Try }] =
  await Promise.all(['picture', 'placing', 'stage', 'surface', 'state', 'try'].map((name) => module(`${name}.js`)));
state.project = project;
const settled = () => new Promise((resolve) => { setTimeout(resolve, 20); });
/** All objects in what m() has answered that have this tag. */
const found = (drawn, tag) => (Array.isArray(drawn) ? drawn : [...drawn?.tag === tag ? [drawn] : [], ...drawn?.rest ?? []])
  .flatMap((each) => (each === drawn ? [each] : found(each, tag)));
const edits = () => asked.splice(0).filter(({ call }) => call === 'POST api/edit').flatMap(({ body }) => body.edits);

function picture(pattern) {
  const made = new Picture({ attrs: { pattern } });
  clearTimeout(made.timer);
  return made;
}

test('a box keeps the pictures of its top and bottom when its depth changes', async () => {
  const box = { ...PATTERN, kind: 'box', box_mm: [100, 200, 30], sides: { top: 'lid.png', bottom: 'floor.png' } };
  picture(box).setShape(box, 'box', { depth: 40 });
  await settled();
  assert.deepEqual(edits().map(({ key, value }) => [key, value]), [['shape', 'box,size=100x200x40mm,top=lid.png,bottom=floor.png']]);
});

test('an offset in millimetres on a picture of unknown width is finite', () => {
  const scene = { pattern: 'cover', offset: [10, 0, 5], offset_unit: 'mm', turn: [0, 0, 0], size: { kind: 'scale', value: 1 }, up: null, centred: false };
  const { matrix } = placed(scene, undefined, null);
  assert.ok(matrix.every(Number.isFinite), `${matrix}`);
});

test('addresses that name no screen show the files', async () => {
  await module('app.js');
  await settled();
  for (const hash of ['#/toString', '#/constructor/x', '#/nothing', '']) {
    location.hash = hash;
    const [{ tag, rest }] = found(shown.view(), 'main').flatMap(({ rest: [, view] }) => [view]);
    assert.ok(tag?.prototype?.view || tag?.view, hash);
    assert.equal(rest.length, 1);
  }
});

test('a finger that stays after a pinch moves nothing and fails nothing', () => {
  const dom = new Element();
  const stage = new Stage(dom, {});
  const zooms = [];
  stage.zoom = (factor) => zooms.push(factor);
  const event = (type, pointerId, clientX) =>
    Object.assign(new Event(type, { cancelable: true }), { pointerId, button: 0, clientX, clientY: 0, pointerType: 'touch' });
  const press = (id, x) => dom.dispatchEvent(Object.defineProperty(event('pointerdown', id, x), 'target', { value: dom }));
  stage.eye = () => ({ view: new Float32Array(16), focal: 1, size: { width: 1, height: 1 } });
  press(1, 0);
  press(2, 100);
  dom.onpointermove(event('pointermove', 2, 200));
  assert.deepEqual(zooms, [2]);
  dom.onpointerup(event('pointerup', 2, 200));
  dom.onpointermove(event('pointermove', 1, 50));
  assert.deepEqual(zooms, [2]);
});

test('a side of a box is named from the folder of its front, as the bake reads it', () => {
  for (const [front, file, name] of [['a.png', 'b.png', 'b.png'], ['box/a.png', 'box/b.png', 'b.png'], ['box/a.png', 'b.png', '../b.png'],
    ['a.png', 'box/b.png', 'box/b.png'], ['x/box/a.png', 'x/lid/b.png', '../lid/b.png']]) {
    assert.equal(sideName(front, file), name);
    const { faces } = surfaceOf({ ...PATTERN, file: front, kind: 'box', box_mm: [1, 1, 1], sides: { top: name } }, { width: 1, height: 1 });
    assert.deepEqual(faces.map((face) => face.picture).filter(Boolean), [file]);
  }
  const [front, lid] = ['box/front.png', 'lid.png'].map((file) => ({ ...PATTERN, file, name: file }));
  state.project = { ...project, patterns: [front, lid] };
  const options = found(picture(front).boxSide(front, { sides: { top: '../lid.png' } }, 'top'), 'option');
  assert.deepEqual(options.map(({ rest: [{ value, selected }] }) => [value, selected]), [['', undefined], ['../lid.png', true]]);
  state.project = project;
});

test('corners that nobody found are the photo\'s own, and called unsure', async () => {
  const { unsure } = await module('files.js');
  answers['api/corners'] = { corners: [[-0.5, -0.5], [9.5, -0.5], [9.5, 4.5], [-0.5, 4.5]], sure: false, reason: 'not-found' };
  await picture(PATTERN).cutOut(PATTERN);
  assert.deepEqual(edits().map(({ key, value }) => [key, value]), [['corners', answers['api/corners'].corners]]);
  assert.ok(unsure.has('cover'));
});

test('another bake closes the player before, and its camera with the last one alone', async () => {
  const open = new Set();
  globalThis.opened = () => {
    const tracker = Object.assign(new EventTarget(), { async start() {}, close: () => open.delete(tracker) });
    open.add(tracker);
    return tracker;
  };
  const [screen, camera] = [new Try(), new MediaStream()];
  screen.open(camera);
  for (let bake = 0; bake < 3; ++bake) {
    screen.begin(new Element(), camera);
    await settled();
    assert.deepEqual([open.size, camera.stopped], [1, 0]);
  }
  screen.onremove();
  assert.deepEqual([open.size, camera.stopped], [0, 1]);
});
