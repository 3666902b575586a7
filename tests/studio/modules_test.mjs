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
  focus() {}
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
  ResizeObserver: class { observe() {} disconnect() {} }, IntersectionObserver: class { observe() {} }, EventSource: EventTarget, location: { hash: '#/files', search: '' }, navigator: { languages: ['en'] },
  document: { documentElement: {}, body: new Element() }, addEventListener() {}, requestAnimationFrame: () => 1, cancelAnimationFrame() {},
  fetch: async (address, { method = 'GET', body } = {}) => {
    if (address.startsWith('words/')) return new Response('{}');
    asked.push({ call: `${method} ${address}`, body: body && JSON.parse(body) });
    return new Response(JSON.stringify(answers[address] ?? project));
  },
})) define(name, value);

const PATTERN = { name: 'cover', file: 'cover.png', kind: 'flat', sides: {}, corners: null, width_mm: null, height_mm: null };
const project = { revision: '1', patterns: [PATTERN], models: [], scenes: [], problems: [], bundle: {}, languages: ['en'], phone: null };
const BAKED = { baked: true, stale: false };
const module = (name) => import(pathToFileURL(path.join(folder, name)));
const [{ Picture }, placing, { Stage }, { sideName, surfaceOf }, { state }, { Try }] =
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
  const { matrix } = placing.placed(scene, undefined, null);
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

// A unit is 100 pixels at the ground, below an eye 10 above it (x right, y up) or before one that looks along y (z up).
const SIZE = { width: 400, height: 300 };
const ABOVE = { view: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -10, 1], focal: 1000, size: SIZE };
const BEFORE = { view: [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, -10, 1], focal: 1000, size: SIZE };
const near = (got, wanted, within = 1e-6) => {
  assert.equal(got.length, wanted.length);
  got.forEach((value, i) => assert.ok(Math.abs(value - wanted[i]) < within, `${got} is not ${wanted}`));
};

/** A stage with a cube of side 1 whose foot is at x 1, y 0.5; what it changes. */
function staged(eye, foot = [1, 0.5, 0]) {
  const changes = [];
  const scene = { key: 'a', half: [1, 1, 1], matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, foot[0], foot[1], foot[2] + 0.5, 1] };
  const stage = new Stage(new Element(), { change: (_, change) => changes.push(change), select() {}, words: () => '' });
  Object.assign(stage, { scenes: [scene], selected: 'a', eye: () => eye });
  return { stage, changes };
}

/** What a handle dragged from a place on the screen to another changes. */
function dragged(kind, eye, from, to, { free = false, foot = undefined } = {}) {
  const { stage: { dom }, changes } = staged(eye, foot);
  const handle = Object.assign(new Element(), { dataset: { handle: kind } });
  handle.closest = (selector) => (selector === '[data-handle]' ? handle : null);
  const event = (type, [clientX, clientY]) =>
    Object.assign(new Event(type, { cancelable: true }), { pointerId: 1, button: 0, clientX, clientY, pointerType: 'mouse', altKey: free });
  dom.dispatchEvent(Object.defineProperty(event('pointerdown', from), 'target', { value: handle }));
  dom.onpointermove(event('pointermove', to));
  dom.onpointerup(event('pointerup', to));
  assert.equal(changes.length, 1);
  return changes[0];
}

test('the handle moves a model across the picture, and snaps to its middle', () => {
  near(dragged('move', ABOVE, [300, 100], [330, 80]).move, [0.3, 0.2, 0]);
  near(dragged('move', ABOVE, [300, 100], [206, 144]).move, [-1, -0.5, 0]);  // 6 pixels are left
  near(dragged('move', ABOVE, [300, 100], [208, 142]).move, [-0.92, -0.42, 0]);
  near(dragged('move', ABOVE, [300, 100], [206, 144], { free: true }).move, [-0.94, -0.44, 0]);
});

test('the handles lift, size and turn a model', () => {
  // Its middle is 10.5 away: 95 pixels a unit.
  near(dragged('lift', BEFORE, [300, 100], [300, 80]).move, [0, 0, 0.21], 1e-3);
  near(dragged('lift', BEFORE, [300, 100], [300, 80], { foot: [1, 0.5, -0.25] }).move, [0, 0, 0.25]);  // rests on the picture
  near(dragged('lift', BEFORE, [300, 100], [300, 80], { foot: [1, 0.5, -0.25], free: true }).move, [0, 0, 0.21], 1e-3);
  near([dragged('size', ABOVE, [330, 60], [360, 20]).size], [2]);
  near([dragged('size', ABOVE, [330, 60], [300, 100]).size], [0.02]);
  const turned = (degrees, as) => {
    const [cosine, sine] = [Math.cos(degrees * Math.PI / 180), Math.sin(degrees * Math.PI / 180)];
    return dragged('turn', ABOVE, [350, 100], [300 + 50 * cosine, 100 - 50 * sine], as).turn;
  };
  near(turned(52), [2, 52]);
  near(turned(47.4), [2, 45]);
  near(turned(47.6), [2, 47.6]);
  near(turned(-92), [2, -90]);
  near(turned(-92, { free: true }), [2, -92]);
  near(dragged('tilt1', BEFORE, [340, 102], [295, 57]).turn, [1, -90]);  // its middle is at 295, 102
});

test('arrow keys move, turn and size by steps, and commit when they rest', () => {
  const pressed = (kind, keys, unit = null) => {
    const { stage, changes } = staged(ABOVE);
    stage.unit = unit;
    const button = Object.assign(new Element(), { dataset: { handle: kind }, closest: () => button });
    for (const [key, shiftKey = false] of keys) {
      const event = Object.assign(new Event('keydown', { cancelable: true }), { key, shiftKey });
      stage.dom.dispatchEvent(Object.defineProperty(event, 'target', { value: button }));
    }
    assert.equal(changes.length, 0);
    stage.dom.dispatchEvent(new Event('focusout'));
    assert.equal(changes.length, 1);
    return changes[0];
  };
  near(pressed('move', [['ArrowRight'], ['ArrowRight'], ['ArrowDown']]).move, [0.02, -0.01, 0]);
  near(pressed('move', [['ArrowLeft', true]]).move, [-0.05, 0, 0]);
  near(pressed('move', [['ArrowUp'], ['ArrowLeft', true]], 50).move, [-0.2, 0.02, 0]);  // 1 and 10 mm
  near(pressed('lift', [['ArrowUp']]).move, [0, 0, 0.01]);
  near(pressed('turn', [['ArrowRight'], ['ArrowUp', true]]).turn, [2, 16]);
  near(pressed('tilt0', [['ArrowDown']]).turn, [0, -1]);
  near([pressed('size', [['ArrowUp'], ['ArrowUp', true]]).size], [1.01 * 1.1]);
});

test('dragging the ground orbits, within limits as the zoom', () => {
  const { stage } = staged(ABOVE);
  delete stage.eye;
  Object.assign(stage.dom, { clientWidth: 400, clientHeight: 300 });
  stage.orbit(0.32, 0);  // from behind the picture's lower edge, 0.66 up
  const heightOf = () => { const [, y] = placing.onScreen(stage.eye(), [0, 0, 1]); return 150 - y; };
  const tilted = heightOf();
  stage.orbit(0, 10);
  near([heightOf()], [0], 1e-4);  // from straight above
  stage.orbit(0, -10);
  assert.ok(heightOf() > tilted);
  // A ball of radius 1, 40 degrees across with a margin of 1.12: tan 20 of half the height that far away.
  const across = 150 / Math.tan(Math.PI / 9) / (1.12 / Math.sin(Math.PI / 9));
  const width = () => placing.onScreen(stage.eye(), [1, 0, 0])[0] - 200;
  near([width()], [across], 1e-3);
  stage.zoom(100);
  near([width()], [8 * across], 1e-2);
  stage.zoom(1e-4);
  near([width()], [0.4 * across], 1e-3);
});

/** A stage on the screen, the picture from -1 to 1, drawn when `frames` are called. */
const frames = [];
function seen() {
  frames.length = 0;
  define('requestAnimationFrame', (frame) => frames.push(frame));
  define('matchMedia', () => ({ matches: false }));
  const { stage, changes } = staged(ABOVE);
  const drawn = { buttons: ['move', 'lift', 'turn', 'size', 'tilt0', 'tilt1'].map((handle) => Object.assign(new Element(), { dataset: { handle } })),
    lines: Object.fromEntries(['ring', 'stem', 'tilt0', 'tilt1', 'box', 'snap'].map((line) => [line, ''])), ground: new Element(), tip: new Element() };
  const paths = Object.keys(drawn.lines).map((line) => ({ dataset: { line }, setAttribute: (_, d) => { drawn.lines[line] = d; } }));
  Object.assign(stage.dom, { clientWidth: 400, clientHeight: 300, querySelector: (selector) => drawn[selector.slice(1)] ?? new Element(),
    querySelectorAll: (selector) => (selector === '.guides path' ? paths : drawn.buttons) });
  stage.surface = { paint() {} };
  stage.told.words = ({ move }) => `${move}`;
  const show = (as = {}) => stage.show({ pattern: { name: 'cover' }, scenes: stage.scenes, selected: 'a', tilting: true,
    surface: { low: [-1, -1, 0], high: [1, 1, 0], unit: null, faces: [] }, ...as });
  return { stage, drawn, show, changes };
}

test('the eye glides to a look, and stops there', () => {
  const [gliding, half, there] = [seen(), seen(), seen()];
  for (const { stage, show } of [gliding, half, there]) { delete stage.eye; show(); }
  frames.splice(0).forEach((frame) => frame(0));
  there.stage.orbit(0.32, 0.035 - 0.66);
  half.stage.orbit(0.32 * 7 / 8, (0.035 - 0.66) * 7 / 8);  // 1 minus the cube of the rest
  frames.length = 0;
  const { performance: clock } = globalThis;
  define('performance', { now: () => 5000 });
  gliding.stage.zoom(2);
  gliding.stage.look('side');
  define('performance', clock);
  frames.shift()(5130);
  frames.length = 1;
  half.stage.zoom(1 + 1 / 8);
  near([...gliding.stage.eye().view], [...half.stage.eye().view], 1e-4);
  assert.equal(frames.length, 1);
  frames.shift()(5300);
  near([...gliding.stage.eye().view], [...there.stage.eye().view]);
  assert.equal(frames.length, 0);
});

test('handles and guides are where the model is', () => {
  const { stage, drawn, show } = seen();
  stage.eye = () => BEFORE;
  show();
  frames.shift()(0);
  const places = () => Object.fromEntries(drawn.buttons.filter(({ hidden }) => !hidden)
    .map(({ dataset: { handle }, style: { left, top } }) => [handle, [left, top].map((each) => Math.round(parseFloat(each)))]));
  // Its box is from 0.5, 0, 0 to 1.5, 1, 1; half of its side and a quarter more are around it.
  assert.deepEqual(places(), { move: [295, 150], lift: [295, 34], turn: [253, 150], size: [350, 50], tilt0: [301, 87], tilt1: [243, 73] });
  assert.deepEqual(['ring', 'tilt0', 'tilt1'].map((line) => drawn.lines[line].slice(0, 11)), ['M354.8 150.', 'M289.9 105.', 'M295.2 42.9']);
  assert.equal(drawn.lines.stem, 'M295.2 54.8L295.2 33.8');
  assert.ok(drawn.lines.box.startsWith('M250.0 150.0L350.0 150.0L336.4 150.0L245.5 150.0L250.0 150.0ZM'.replace('ZM', 'M')), drawn.lines.box);
  assert.equal(drawn.tip.hidden, true);
  stage.eye = () => ABOVE;
  show({ tilting: false });
  frames.shift()(0);
  assert.deepEqual(places(), { move: [300, 100], turn: [254, 142], size: [367, 150] });  // lifting has no direction
  assert.equal(drawn.lines.tilt0, '');
  show({ selected: null });
  frames.shift()(0);
  assert.deepEqual([places(), drawn.lines.ring], [{}, '']);
});

test('a dragged model shows its change, and a pressed one is selected', () => {
  const { stage, drawn, show, changes } = seen();
  show({ tilting: false });
  stage.eye = () => ABOVE;
  const selected = [];
  stage.told.select = ({ key }) => selected.push(key);
  const event = (type, [clientX, clientY]) =>
    Object.assign(new Event(type, { cancelable: true }), { pointerId: 1, button: 0, clientX, clientY, pointerType: 'mouse', altKey: false });
  const press = (at, button = 0) =>
    stage.dom.dispatchEvent(Object.defineProperty(Object.assign(event('pointerdown', at), { button }), 'target', { value: stage.dom }));
  press([300, 100]);
  stage.dom.onpointermove(event('pointermove', [204, 100]));
  assert.equal(drawn.tip.textContent, '-1,0,0');
  assert.deepEqual([drawn.tip.hidden, drawn.tip.style], [false, { left: '200px', top: '59px' }].map((each, i) => (i ? drawn.tip.style : each)));
  assert.equal(drawn.lines.snap, 'M200.0 250.0L200.0 50.0');
  stage.dom.onpointermove(event('pointermove', [250, 147]));
  assert.equal(drawn.lines.snap, 'M100.0 150.0L300.0 150.0');
  stage.dom.onpointercancel(event('pointercancel', [204, 100]));
  assert.deepEqual([selected, changes], [[], []]);
  stage.selected = null;
  const orbits = [];
  stage.orbit = (...by) => orbits.push(by);
  // Its box is drawn up to 366.7; 8 pixels more still mean it.
  for (const x of [376, 373]) {
    press([x, 95]);
    stage.dom.onpointermove(event('pointermove', [x + 16, 95 + 32]));
    stage.dom.onpointerup(event('pointerup', [x + 16, 95 + 32]));
  }
  assert.deepEqual([selected, orbits], [['a'], [[-0.1, 0.2]]]);
  press([300, 100], 2);
  assert.equal(stage.dom.onpointermove, null);
  for (const [type, at, cursor] of [['mouse', [300, 100], 'move'], ['mouse', [20, 20], 'grab'], ['touch', [300, 100], 'grab']]) {
    stage.dom.dispatchEvent(Object.assign(event('pointermove', at), { pointerType: type }));
    assert.equal(stage.dom.style.cursor, cursor);
  }
});

test('matrices turn about axes, and turns are read from them', () => {
  const { about, boxOf, inverse, multiply, rotation, scaling, transform, translation, turning, turnOf, wrapped } = placing;
  // A quarter about each axis takes the next axis to the one after it.
  for (const axis of [0, 1, 2]) {
    const unit = (at) => [0, 1, 2].map((i) => Number(i === at % 3));
    near(transform(rotation(axis, 90), unit(axis + 1)), unit(axis + 2));
  }
  near(turnOf(multiply(scaling(3), turning([20, -30, 50]))), [20, -30, 50]);
  near(turnOf(turning([0, 90, 25])), [0, 90, 25]);
  near(transform(about([1, 2, 3], rotation(2, 90)), [2, 2, 3]), [1, 3, 3]);
  const matrix = multiply(translation([1, 2, 3]), multiply(turning([20, -30, 50]), scaling(2)));
  near(transform(inverse(matrix), transform(matrix, [4, 5, 6])), [4, 5, 6]);
  assert.deepEqual([180, -180, 181, -541, 360].map(wrapped), [180, 180, -179, 179, 0]);
  const { low, high, foot } = boxOf(multiply(translation([1, 2, 3]), rotation(2, 90)), [0.5, 0.25, 1]);
  near([...low, ...high, ...foot], [0.75, 1.5, 2, 1.25, 2.5, 4, 1, 2, 2]);
});

test('places on the screen, lines of sight, and boxes under a place', () => {
  const { covers, meet, onScreen, sight } = placing;
  near(onScreen(ABOVE, [1, 0.5, 0]), [300, 100]);
  assert.equal(onScreen(ABOVE, [0, 0, 11]), null);
  near(meet(sight(ABOVE, [300, 100]), [0, 0, 0], [0, 0, 1]), [1, 0.5, 0]);
  assert.equal(meet(sight(ABOVE, [300, 100]), [0, 0, 12], [0, 0, 1]), null);  // behind the eye
  assert.equal(meet({ from: [0, 0, 1], along: [1, 0, 0] }, [0, 0, 0], [0, 0, 1]), null);
  const box = { low: [-1, -0.5, 0], high: [1, 0.5, 0] };  // from 100, 100 to 300, 200
  for (const [x, y, margin, inside] of [[299, 101, 0, true], [301, 150, 0, false], [301, 150, 2, true], [303, 150, 2, false], [200, 98.5, 2, true],
    [200, 97, 2, false], [98.5, 150, 2, true], [200, 201.5, 2, true]]) assert.equal(covers(ABOVE, box, [x, y], margin), inside, `${x} ${y} ${margin}`);
});

test('a scene stands as modar.toml says', () => {
  const scene = { pattern: 'cover', offset: [0, 0, 0], offset_unit: 'usual', turn: [0, 0, 0], size: { kind: 'scale', value: 1 }, up: null, centred: false };
  const model = { size: [1, 4, 2], up: 'y' };
  const placed = (as, unit = null, of = model) => placing.placed({ ...scene, ...as }, of, unit);
  const up = (axis, sign) => [0, 1, 2].map((i) => (i === axis ? sign : 0));
  for (const [name, axis, sign] of [['x', 0, 1], ['-x', 0, -1], ['y', 1, 1], ['-y', 1, -1], ['z', 2, 1], ['-z', 2, -1]]) {
    const { matrix } = placed({ up: name });
    near(placing.transform([...matrix.slice(0, 12), 0, 0, 0, 1], up(axis, sign)), [0, 0, 1]);
  }
  near(placed({}).matrix.slice(12, 15), [0, 0, 1]);  // its foot is on the picture
  near(placed({ centred: true, offset: [0.5, 0, 0.25] }).matrix.slice(12, 15), [1, 0, 0.5]);
  near(placed({ offset: [10, 0, 0] }, 50).matrix.slice(12, 15), [0.2, 0, 1]);
  near([placed({ size: { kind: 'height', value: 100 } }, 50).scale, placed({ size: { kind: 'width', value: 100 } }, 50).scale], [1, 4]);
  near(placing.halfOf(model), [0.25, 1, 0.5]);
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

test('numbers are typed, or stepped with keys, within their limits', async () => {
  const { NumberField, LengthField, choice } = await module('parts.js');
  const { settings } = await module('words.js');
  const told = [];
  const field = (attrs) => {
    const vnode = { attrs: { id: 'x', label: 'X', value: 5, onvalue: (value) => told.push(value), ...attrs }, state: {} };
    NumberField.oninit(vnode);
    const input = () => found(NumberField.view(vnode), 'input')[0].rest[0];
    return { input, type: (value) => { input().oninput({ target: { value } }); input().onchange(); },
      key: (key, shiftKey = false) => input().onkeydown({ key, shiftKey, preventDefault() {} }), rest: () => { clearTimeout(vnode.state.timer); input().onchange(); } };
  };
  const plain = field({});
  assert.equal(plain.input().value, '5');
  plain.type('7.256');
  plain.type('7,25');
  plain.type('5');  // as before
  plain.type('x');
  plain.input().oninput({ target: { value: '9' } });
  plain.key('Escape');
  plain.input().onchange();
  assert.deepEqual(told.splice(0), [7.26, 7.25]);
  for (const [key, shift, value] of [['ArrowUp', false, 6], ['ArrowDown', true, -5], ['PageUp', false, 15], ['PageDown', false, -5]]) {
    const stepped = field({});
    stepped.key(key, shift);
    assert.equal(told.length, 0);
    stepped.rest();
    assert.deepEqual(told.splice(0), [value], key);
  }
  const limited = field({ least: 4, most: 6 });
  for (const value of ['3.9', '6.1', '4.5']) limited.type(value);
  assert.deepEqual(told.splice(0), [4, 6, 4.5]);
  field({ empty: true }).type('');
  field({}).type('');
  assert.deepEqual(told.splice(0), [null]);
  settings.unit = 'cm';
  const { rest: [{ value, step, least, most, unit, onvalue }] } = LengthField.view({ attrs: { value: 123.4, least: 10, most: 50, onvalue: (mm) => told.push(mm) } });
  assert.deepEqual([value, step, least, most, unit], [12.34, 0.1, 1, 5, 'cm']);
  onvalue(2);
  assert.deepEqual(told.splice(0), [20]);
  const drawn = choice('kind', 'Kind', [['a', 'A'], ['b', 'B']], 'b', (chosen) => told.push(chosen));
  const radios = found(drawn, 'input').map(({ rest: [attributes] }) => attributes);
  assert.deepEqual(radios.map(({ checked, value: of }) => [of, checked]), [['a', false], ['b', true]]);
  radios[0].onchange();
  assert.deepEqual(told, ['a']);
});

test('what the server refuses is an error with its words', async () => {
  const { ask, askJson, Newest, pathOf, Refused, thumb } = await module('api.js');
  const fetched = globalThis.fetch;
  const calls = [];
  let answer = () => new Response('{"a": 1}');
  globalThis.fetch = async (address, options) => { calls.push([address, options]); return answer(); };
  assert.deepEqual(await askJson('POST', 'edit', { b: 2 }), { a: 1 });
  const [[address, { method, headers, body }]] = calls;
  assert.deepEqual([address, method, headers, body], ['api/edit', 'POST', { 'Content-Type': 'application/json' }, '{"b":2}']);
  await ask('GET', 'project');
  await ask('PUT', 'file', new Blob(['c']));
  assert.deepEqual(calls.slice(1).map(([, options]) => [options.headers, options.body instanceof Blob]), [[{}, false], [{}, true]]);
  const refusal = () => ask('GET', 'project').then(() => null, (error) => error);
  answer = () => new Response('{"error": "no", "cure": "do", "line": 3}', { status: 409 });
  const refused = await refusal();
  assert.ok(refused instanceof Refused);
  assert.deepEqual([refused.message, refused.cure, refused.line, refused.file, refused.code, refused.status], ['no', 'do', 3, '', '', 409]);
  answer = () => new Response('?', { status: 500, statusText: 'Oops' });
  const { message, cure } = await refusal();
  assert.deepEqual([message, cure], ['500 Oops', '']);
  answer = () => { throw new TypeError(); };
  assert.deepEqual((({ message: text, status }) => [text, status])(await refusal()), ['gone', 0]);
  answer = () => { throw Object.assign(new Error(), { name: 'AbortError' }); };
  assert.equal((await refusal()).name, 'AbortError');
  globalThis.fetch = fetched;
  assert.deepEqual([pathOf('a b/c?d'), thumb('a b.png', 96)], ['a%20b/c%3Fd', 'api/thumb/a%20b.png?size=96']);
  // Of three requests during one, the last is done.
  const done = [];
  const newest = new Newest(async (input) => { done.push(input); await settled(); });
  await Promise.all([1, 2, 3].map((input) => newest.ask(input)));
  await newest.ask(4);
  assert.deepEqual(done, [1, 3, 4]);
});

test('a scene\'s words, sides and changes', async () => {
  const { Scene } = await module('scene.js');
  const { settings } = await module('words.js');
  settings.unit = 'cm';
  const scene = { pattern: 'cover', model: 'pot', name: 'pot', offset: [10, 20, 0], offset_unit: 'mm', turn: [0, 0, 30], size: { kind: 'height', value: 50 }, up: null,
    centred: false, texts: {}, alts: {} };
  const pattern = { ...PATTERN, width_mm: 100 };
  state.project = { ...project, bundle: BAKED, patterns: [pattern], models: [{ name: 'pot', size: [1, 2, 1], up: 'y' }], scenes: [scene] };
  answers['api/edit'] = state.project;
  const screen = new Scene({ attrs: { pattern } });
  screen.picture = { width: 200, height: 100 };
  assert.equal(screen.unit, 50);  // the longer side, 100 mm, is two units
  assert.deepEqual([{ move: [0.1, -0.2, 0] }, { move: [0, 0, 0.3] }, { size: 1.5 }, { turn: [2, 44.6] }].map((change) => screen.wordsOf(change)),
    ['0.5 cm · -1 cm', '1.5 cm', '150 %', '45°']);
  assert.equal(screen.wordsOf(null), '');
  const sides = [];
  for (let up = null; sides.length < 6; sides.push(up)) up = screen.nextSide({ up, asset: { up: 'y' } });
  assert.deepEqual([new Set(sides).size, sides.at(-1)], [6, null]);
  const [placed] = screen.scenes();
  asked.length = 0;
  screen.oncreate({ dom: Object.assign(new Element(), { querySelector: () => new Element() }), attrs: { pattern } });
  const change = async (by) => { await screen.stage.told.change(placed, by); await settled(); return edits().map(({ key, value }) => [key, value]); };
  assert.deepEqual(await change({ move: [0.1, -0.2, 0] }), [['offset', [15, 10, 0]]]);
  assert.deepEqual(await change({ turn: [2, 15] }), [['turn', 45]]);
  assert.deepEqual(await change({ size: 1.5 }), [['height', '75mm']]);
  const number = (drawn) => drawn.rest[0];
  await number(screen.turnField(placed, 0)).onvalue(9);
  await settled();
  assert.deepEqual(edits().map(({ key, value }) => [key, value]), [['turn', [9, 0, 30]]]);
  assert.deepEqual([number(screen.sizeField(placed)).value, number(screen.turnField(placed, 2)).value], [50, 30]);
  screen.onremove();
  state.project = project;
});

test('words of a language: plurals, names in quotations, numbers and sizes', async () => {
  const { bytes, firstLanguage, languageName, length, number, numberIn, said, sentence, settings, t, told, typed, useLanguage } = await module('words.js');
  const fetched = globalThis.fetch;
  globalThis.fetch = async () => new Response(JSON.stringify({ files: '{n} files in {where}', files_one: 'a file in {where}', 'error.image.decode': ['{q} is broken', 'save  it'],
    'error.image': ['a picture', 'another'], known: 'bekannt' }));
  const spoken = document.documentElement.lang;
  await useLanguage('de');
  assert.equal(document.documentElement.lang, 'de');
  assert.deepEqual([1, 2, 1234.567].map((n) => t('files', { n, where: 'x' })), ['a file in x', '2 files in x', '1.234,57 files in x']);
  assert.deepEqual([t('nothing'), t('files', { n: 2 })], ['nothing', '2 files in {where}']);
  assert.deepEqual([number(1234.5), typed(1234.5678)], ['1.234,5', '1234,5678']);
  assert.deepEqual(['1.234', '1,234', '1.5', '-2.000', '1.234,5', '1.234.567', '1,234.5', '', 'x', '0.250', '1234.500', '\u22123'].map(numberIn),
    [1234, 1.234, 1.5, -2000, 1234.5, 1234567, 1234.5, null, null, 0.25, 1234.5, -3]);
  assert.deepEqual(said({ code: 'image.decode', error: "'a.png' ends" }), { text: 'a.png is broken', cure: 'save it' });
  assert.deepEqual(said({ code: 'image.size', message: 'too large' }), { text: 'a picture', cure: 'another', detail: 'too large' });
  assert.deepEqual(said({ error: 'odd', cure: 'do' }), { text: 'odd', cure: 'do', lang: 'en' });
  assert.deepEqual([told('known', 'x'), told('other', 'x')], [{ text: 'bekannt' }, { text: 'x', lang: 'en' }]);
  assert.deepEqual(['it is odd', 'a.png is odd', 'Odd'].map(sentence), ['It is odd', 'a.png is odd', 'Odd']);
  assert.deepEqual([999, 1000, 999_999, 1e6, 12_345_678].map(bytes), ['999 B', '1 KB', '1.000 KB', '1 MB', '12,3 MB']);
  assert.deepEqual([languageName('en'), languageName('?')], ['Englisch', '?']);
  settings.unit = 'in';
  assert.equal(length(25.4 * 2.127), '2,13 in');
  settings.unit = 'mm';
  assert.equal(length(12.34), '12,3 mm');
  settings.unit = 'cm';
  for (const [search, languages, first] of [['?lang=de', ['en'], 'de'], ['', ['fr', 'de-AT', 'en'], 'de'], ['?lang=fr', ['pl'], 'en']]) {
    Object.assign(location, { search });
    navigator.languages = languages;
    assert.equal(firstLanguage(), first);
  }
  Object.assign(location, { search: '' });
  globalThis.fetch = async () => new Response('{}');
  await useLanguage('en');
  document.documentElement.lang = spoken;
  globalThis.fetch = fetched;
});

test('changes wait for one another, and are made again where the file has changed', async () => {
  const { addFiles, addScene, deleteScene, loadRivals, loadScore, modelOf, patternOf, scenesOf, setPattern, setScene, undo } = await module('state.js');
  const fetched = globalThis.fetch;
  const calls = [];
  const scene = (index, model, offset = [0, 0, 0]) => ({ index, pattern: 'cover', model, offset });
  let now = { ...project, bundle: BAKED, models: [{ name: 'pot', missing: [] }, { name: 'lid', missing: [] }], scenes: [scene(0, 'pot'), scene(null, 'lid')] };
  state.project = now;
  assert.deepEqual([modelOf('lid').name, modelOf('x'), patternOf('cover').name, scenesOf('cover').length, scenesOf('x').length], ['lid', undefined, 'cover', 2, 0]);
  let refusals = 0;
  globalThis.fetch = async (address, { method = 'GET', body } = {}) => {
    const sent = typeof body === 'string' ? JSON.parse(body) : body;
    calls.push([`${method} ${address}`, ...(sent?.edits ?? [])]);
    if (address === 'api/edit' && refusals-- > 0) return new Response('{"error": "changed"}', { status: 409 });
    if (address.startsWith('api/files')) return new Response('{"added": ["a"]}');
    if (address.startsWith('api/score')) return new Response('{"grade": "B"}');
    if (address.startsWith('api/rivals')) return new Response('{"rivals": [{"name": "map"}]}');
    return new Response(JSON.stringify(now));
  };
  const made = () => calls.splice(0);
  await setScene(now.scenes[0], { offset: [1, 2, 3], up: null });
  assert.deepEqual(made(), [['POST api/edit', { op: 'set', table: 'scene', index: 0, key: 'offset', value: [1, 2, 3] }, { op: 'remove', table: 'scene', index: 0, key: 'up' }]]);
  await setScene(now.scenes[1], () => ({ name: 'top' }));
  assert.deepEqual(made(), [['POST api/edit', { op: 'set', table: 'scene', pattern: 'cover', model: 'lid', key: 'name', value: 'top' }]]);
  await setPattern('cover', { width: '5mm' });
  await addScene('cover', 'lid');
  await deleteScene(now.scenes[0]);
  await undo();
  assert.deepEqual(made(), [['POST api/edit', { op: 'set', table: 'pattern', name: 'cover', key: 'width', value: '5mm' }],
    ['POST api/edit', { op: 'add', table: 'scene', value: { pattern: 'cover', model: 'lid' } }], ['POST api/edit', { op: 'delete', table: 'scene', index: 0 }], ['POST api/undo']]);
  refusals = 1;
  await deleteScene(now.scenes[0]);
  assert.deepEqual(made().map(([call]) => call), ['POST api/edit', 'GET api/project', 'POST api/edit']);
  // Another scene has this index meanwhile.
  refusals = 1;
  now = { ...now, scenes: [scene(0, 'lid')] };
  await deleteScene(scene(0, 'pot'));
  assert.deepEqual([made().map(([call]) => call), state.notice.text, state.notice.bad], [['POST api/edit', 'GET api/project'], 'changed', true]);
  state.notice = null;
  const seenFiles = [];
  const told = await addFiles([{ name: 'a b.png', blob: new Blob(['x']) }, { name: 'big', blob: { size: 2 ** 31 + 1 } }], (...at) => seenFiles.push(at));
  assert.deepEqual(made().map(([call]) => call), ['PUT api/files/a%20b.png', 'GET api/project']);
  assert.deepEqual([told[0], told[1].problems.length, seenFiles], [{ name: 'a b.png', added: ['a'] }, 1, [[0, 2, 'a b.png'], [1, 2, 'big'], [2, 2, '']]]);
  await loadScore('cover');
  assert.deepEqual([state.scores.get('cover'), made()], [{ grade: 'B' }, [['GET api/score?pattern=cover']]]);
  await loadRivals('cover');
  assert.deepEqual([state.rivals.get('cover'), made()], [{ found: [] }, []]);  // it is alone
  state.rivals.clear();
  state.project = { ...now, patterns: [PATTERN, { ...PATTERN, name: 'map' }] };
  await loadRivals('cover');
  assert.deepEqual([state.rivals.get('cover'), made()], [{ found: [{ name: 'map' }] }, [['GET api/rivals?pattern=cover']]]);
  globalThis.fetch = fetched;
  state.project = project;
});

test('events of the server', async () => {
  const { bundleBytes, isBaking, listen } = await module('state.js');
  const fetched = globalThis.fetch;
  const calls = [];
  const baked = { ...project, revision: '2', bundle: BAKED };
  globalThis.fetch = async (address, { method = 'GET' } = {}) => { calls.push(`${method} ${address}`); return new Response(JSON.stringify(baked)); };
  let events;
  define('EventSource', class extends EventTarget { constructor(address) { super(); events = this; this.address = address; } });
  listen();
  assert.equal(events.address, 'api/events');
  const sent = async (type, data) => {
    events.dispatchEvent(Object.assign(new Event(type), { data: data && JSON.stringify(data) }));
    await settled();
    return calls.splice(0);
  };
  state.baked = 0;
  await sent('progress', { kind: 'bake', stage: 'mesh', done: 0.5 });
  assert.deepEqual([state.progress.done, isBaking()], [0.5, true]);
  assert.deepEqual(await sent('baked', {}), ['GET api/project']);
  assert.deepEqual([state.progress, state.failure, state.baked, isBaking()], [null, null, 1, false]);
  assert.deepEqual(await sent('project', { revision: '2' }), []);  // what the page has
  assert.deepEqual(await sent('project', { revision: '3' }), ['GET api/project']);
  assert.deepEqual(await sent('project', { revision: '2', files: true }), ['GET api/project']);
  await sent('baked', { errors: [{ code: 'mesh.open', error: 'open' }] });
  assert.deepEqual([state.failure.kind, state.failure.code, state.failure.errors.length], ['bake', 'mesh.open', 1]);
  await sent('project', { revision: '3' });
  assert.equal(state.failure, null);
  await sent('failed', { kind: 'bake', code: 'project.changing' });
  assert.equal(state.failure, null);  // made again
  assert.deepEqual(await sent('failed', { kind: 'export', code: 'io' }), []);
  assert.equal(state.failure.code, 'io');
  state.failure = null;
  await sent('exported', { kind: 'page', path: 'out', url: 'u' });
  assert.deepEqual(state.exported.get('page'), { path: 'out', url: 'u' });
  await sent('shown');
  assert.equal(state.baked, 3);
  const [one, two] = [bundleBytes(), bundleBytes()];
  assert.equal(one, two);
  ++state.baked;
  assert.notEqual(bundleBytes(), one);
  await settled();
  assert.deepEqual(calls.splice(0), ['GET api/bundle', 'GET api/bundle']);
  events.onerror();
  assert.equal(state.gone, true);
  events.onopen();
  events.onopen();
  await settled();
  assert.deepEqual([state.gone, calls.splice(0)], [false, ['GET api/project']]);
  Object.assign(state, { project, baked: 0 });
  globalThis.fetch = fetched;
});
