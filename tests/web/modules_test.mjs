// Modules of the page that need no browser.
import assert from 'node:assert/strict';
import test from 'node:test';

import { isPacked, place } from '../../runtime/extensions/web/arrival.js';
import { textsOf, titleOf } from '../../runtime/extensions/web/bundle.js';
import { hostApp, mainCamera } from '../../runtime/extensions/web/camera.js';
import { isRotten } from '../../runtime/extensions/web/copy.js';
import { Engine, engineFailed, shrinkOf } from '../../runtime/extensions/web/engine.js';
import { Gyroscope, toCamera } from '../../runtime/extensions/web/gyroscope.js';
import { isNewer } from '../../runtime/extensions/web/installed-release.js';
import { drawFrame, projectionOf } from '../../runtime/extensions/web/modar.js';
import { susScore, VisitLog } from '../../runtime/extensions/web/survey.js';
import { groundTransform, viewFrom } from '../../runtime/extensions/web/turntable.js';
import { directionOf, fill, labelOf } from '../../runtime/extensions/web/viewer-words.js';

const near = (got, wanted) => got.forEach((value, i) => assert.ok(Math.abs(value - wanted[i]) < 1e-6, `${got} is not ${wanted}`));

test('a mesh has two places, and whoever takes the first may give its memory away', () => {
  const taken = [];
  const take = (offset, bytes) => {
    taken.push([offset, [...bytes]]);
    structuredClone(bytes, { transfer: [bytes.buffer] });
  };
  place({ offset: 7, size: 5, second: 90, secondSize: 2 }, Uint8Array.of(1, 2, 3, 4, 5), take);
  place({ offset: 8, size: 2, second: 0, secondSize: 0 }, Uint8Array.of(6, 7), take);
  place({ offset: 9, size: 1 }, Uint8Array.of(8), take);
  assert.deepEqual(taken, [[7, [1, 2, 3]], [90, [4, 5]], [8, [6, 7]], [9, [8]]]);
});

test('a label has the models\' name, the picture its own', () => {
  const pattern = { name: 'cover', title: 'cover', models: 'spider', image: '', width: 1, height: 1 };
  assert.deepEqual(labelOf(pattern, 'en'), { language: '', name: 'spider', picture: 'cover', text: '', alt: '' });
  const told = { ...pattern, texts: { de: { text: 'Acht Beine.' }, en: { name: 'The spider', text: 'Eight legs.', alt: 'A spider' } } };
  assert.deepEqual(labelOf(told, 'en-GB'), { language: 'en', name: 'The spider', picture: 'The spider', text: 'Eight legs.', alt: 'A spider' });
  assert.deepEqual(labelOf(told, 'de'), { language: 'de', name: 'spider', picture: 'cover', text: 'Acht Beine.', alt: '' });
  assert.equal(labelOf(told, 'pl').language, 'de');  // the first that it has
  assert.equal(labelOf({ ...pattern, models: '' }, 'en').name, 'cover');  // a video is there
});

test('texts of modar.toml are joined by pattern and language', () => {
  const texts = [{ pattern: 'cover', text: { en: 'One.' }, alt: { en: 'A' } }, { pattern: 'cover', text: { en: 'Two.', de: 'Zwei.' } }];
  assert.deepEqual(textsOf({ texts }), { cover: { en: { text: 'One. Two.', alt: 'A' }, de: { text: 'Zwei.' } } });
  assert.deepEqual(textsOf({}), {});
  assert.equal(titleOf('red_old_vase'), 'red old vase');
});

test('words are filled in, and read from their side', () => {
  assert.equal(fill('{a} of {b}{c}', { a: 1, b: 'x' }), '1 of x');
  assert.deepEqual(['ar', 'fa-IR', 'en', 'arn'].map(directionOf), ['rtl', 'rtl', 'ltr', 'ltr']);
});

test('the main one of the cameras that look away', () => {
  const camera = (label, kind = 'videoinput') => ({ kind, label, deviceId: label });
  const android = ['camera2 1, facing front', 'camera2 2, facing back', 'camera2 0, facing back'].map((label) => camera(label));
  assert.equal(mainCamera(android)?.label, 'camera2 0, facing back');
  assert.equal(mainCamera([camera('Back Ultra Wide Camera'), camera('Back Camera')])?.label, 'Back Camera');
  assert.equal(mainCamera([camera('FaceTime HD Camera'), camera('back', 'audioinput')]), undefined);
  assert.equal(hostApp('Mozilla/5.0 (iPhone) Instagram 300'), 'Instagram');
  assert.equal(hostApp('Mozilla/5.0 (X11; Linux x86_64) Chrome/120'), '');
});

test('a turn of the device in its camera\'s axes', () => {
  near(toCamera([1, 2, 3], 0, false), [1, -2, -3]);
  near(toCamera([1, 2, 3], 0, true), [-1, -2, 3]);
  near(toCamera([1, 0, 0], 90, false), [0, -1, 0]);
  near(toCamera([0, 1, 0], 90, false), [-1, 0, 0]);
});

test('an eye on the turntable', () => {
  // From straight above: x right, y up, the target in the middle at its distance.
  const above = viewFrom({ target: [1, 2, 3], turn: 0, tilt: Math.PI / 2, distance: 5 });
  const at = ([x, y, z]) => [0, 1, 2].map((i) => above[i] * x + above[4 + i] * y + above[8 + i] * z + above[12 + i]);
  near(at([1, 2, 3]), [0, 0, -5]);
  near(at([2, 3, 3]), [1, 1, -5]);
  // A picture of 400 x 200 pixels in a window of 600 x 600: its middle is the window's, its top left half its sides away.
  const matrix = groundTransform(viewFrom({ target: [0, 0, 0], turn: 0, tilt: Math.PI / 2, distance: 2 }), 300, { width: 600, height: 600 }, { width: 400, height: 200 });
  const onScreen = (x, y) => [0, 1].map((i) => (matrix[i] * x + matrix[4 + i] * y + matrix[12 + i]) / (matrix[3] * x + matrix[7] * y + matrix[15]));
  near(onScreen(200, 100), [300, 300]);
  near(onScreen(0, 0), [150, 225]);
});

test('newer, rotten and packed bundles', () => {
  const release = (epoch, version) => JSON.stringify({ epoch, version });
  assert.deepEqual([release(0, 2), release(0, 3), release(1, 1)].map((text) => isNewer(text, { epoch: 0, version: 2 })), [false, true, true]);
  assert.deepEqual(['bundle.hash', 'web.changed', 'web.download', 'gl.lost', undefined].map((code) => isRotten({ code })), [true, true, false, false, false]);
  assert.deepEqual([[0x89, 0x4d, 0x4f, 0x52, 13, 10, 26, 10], [0x89, 0x4d, 0x4f, 0x44, 13, 10, 26, 10]].map((bytes) => isPacked(Uint8Array.from(bytes))), [true, false]);
});

test('a frame fills a canvas, and is mirrored on request', () => {
  globalThis.devicePixelRatio = 3;
  const drawn = [];
  const canvas = { clientWidth: 300, clientHeight: 300, getContext: () => ({
    setTransform: (...matrix) => drawn.push(matrix), drawImage: (_, ...place) => drawn.push(place) }) };
  // At two pixels a CSS pixel and 600 x 600, a frame of 400 x 200 is shown three times as large.
  const camera = { width: 400, height: 200, focal: 500 };
  assert.deepEqual(drawFrame(canvas, { source: {}, camera }), { width: 600, height: 600 });
  drawFrame(canvas, { source: {}, camera }, { mirror: true });
  const place = [-200, -100, 400, 200];
  assert.deepEqual(drawn, [[3, 0, 0, 3, 300, 300], place, [-3, 0, 0, 3, 300, 300], place]);
  near(projectionOf(camera, 1, 3), [2.5, 0, 0, 0, 0, 5, 0, 0, 0, 0, -2, -1, 0, 0, -3, 0]);
  near(projectionOf(camera, 1, 3, { width: 600, height: 600 }).filter(Boolean), [5, 5, -2, -1, -3]);
  delete globalThis.devicePixelRatio;
});

/** An engine on a module that answers `answers`, and its calls. */
function engineOn(answers = {}) {
  const calls = [];
  const texts = [];
  const own = { HEAPU8: new Uint8Array(1 << 12), UTF8ToString: (at) => texts[at] ?? '' };
  const module = new Proxy(own, { get: (_, name) => own[name] ?? ((...given) => {
    calls.push([name.slice(5), ...given]);
    const answer = answers[name.slice(5)] ?? 0;
    return typeof answer === 'function' ? answer(...given) : answer;
  }) });
  return { engine: new Engine(module, 'plain'), calls, texts, heap: own.HEAPU8 };
}

test('calls of the page reach the engine', () => {
  const { engine, calls, heap } = engineOn({ reserve: (bytes) => (bytes > 1000 ? 0 : 256 + bytes), pick: 64, label: 80, bounds: 128 });
  new Uint32Array(heap.buffer, 64, 2).set([7, 9]);
  new Float32Array(heap.buffer, 80, 3).set([1.5, 2.5, 1]);
  new Float32Array(heap.buffer, 128, 6).set([1, 2, 3, 4, 5, 6]);
  engine.setCamera(4, 3, 5);
  engine.draw(40, 30, true);
  engine.draw(40, 30);
  assert.deepEqual(engine.pick(40, 30, true, 1, 2), { node: 7, material: 9 });
  engine.pick(40, 30, false, 1, 2);
  assert.deepEqual(engine.label(3, 40, 30, true, false), { x: 1.5, y: 2.5, covered: true });
  engine.label(3, 40, 30, false, true);
  assert.deepEqual(engine.bounds(5), { low: [1, 2, 3], high: [4, 5, 6] });
  engine.track(true, 9, false);
  engine.turn([1, 2, 3]);
  assert.deepEqual(calls, [['camera', 4, 3, 5], ['draw', 40, 30, 1], ['draw', 40, 30, 0], ['pick', 40, 30, 1, 1, 2],
    ['pick', 40, 30, 0, 1, 2], ['label', 3, 40, 30, 1, 0], ['label', 3, 40, 30, 0, 1], ['bounds', 5], ['track', 1, 9, 0], ['turn', 1, 2, 3]]);
  calls.length = 0;
  // A larger buffer takes the place of a smaller one, which serves until then.
  for (const bytes of [12, 12, 5, 13]) engine.frameBuffer(bytes);
  engine.shrink(8, 2);
  engine.widenLuma(8);
  engine.grayFromRgba();
  assert.deepEqual(calls, [['reserve', 12], ['free', 268], ['reserve', 13], ['shrink', 269, 8, 4, 3, 2], ['widen_luma', 269, 24], ['gray_from_rgba', 269, 4, 3]]);
  assert.throws(() => engine.frameBuffer(3_000_001), /no 4 MB of memory/);
  assert.deepEqual([639, 640, 1279, 1280].map((side) => shrinkOf(side, 480)), [1, 1, 1, 2]);
});

test('a bundle arrives in the engine in parts', () => {
  const rows = { node: [[0, 1, 0], [1, 4, 1]], scene: [[0, 5], [1, 6]] };
  const names = [20, 21];
  const { engine, calls, texts, heap } = engineOn({
    arrive: 1000, reserve: 2000, piece: (index) => 300 * index, pattern_count: 2, pattern_name: (i) => names[i], pattern_width_mm: (i) => 10 * i,
    language: (i) => (i < 1 ? 22 : 0), node_count: 2, node: (i, field) => rows.node[i][field], node_text: (i, kind) => 30 + 10 * i + kind,
    scene_count: 2, scene: (i, field) => rows.scene[i][field], model_name: (model) => 20 + model, media: 300, media_size: 2, stand: (scene) => (scene < 2 ? 1 : 0),
    poses: 512, copies: 3 });
  Object.assign(texts, { 20: 'cover', 21: 'map', 22: 'en', 25: 'pot', 26: 'lid', 30: 'text', 31: 'alt', 32: 'title', 33: 'rim', 34: '1', 43: 'film' });
  engine.arrive(16, [{ offset: 2, bytes: Uint8Array.of(1, 2) }, { offset: 8, bytes: Uint8Array.of(3) }]);
  assert.deepEqual([...engine.bytes], [0, 0, 1, 2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0]);
  assert.deepEqual(engine.patterns, [{ name: 'cover', widthMm: 0 }, { name: 'map', widthMm: 10 }]);
  assert.deepEqual(engine.languages, ['en']);
  assert.deepEqual(engine.nodes, [{ name: 'rim', pattern: 0, kind: 'model', mark: '1', loops: false }, { name: 'film', pattern: 1, kind: 'video', mark: '', loops: true }]);
  assert.deepEqual(engine.scenes, [{ pattern: 0, model: 'pot' }, { pattern: 1, model: 'lid' }]);
  assert.deepEqual(engine.wordsOf(0, 'en'), { title: 'title', text: 'text', alt: 'alt' });
  calls.length = 0;
  const bytes = Uint8Array.of(7, 8);
  engine.pass(5, bytes);
  assert.deepEqual([[...heap.subarray(2000, 2002)], bytes.length], [[7, 8], 0]);  // they are with the engine now
  engine.recipe(Uint8Array.of(9));
  engine.begin(3, 6, 2, Uint8Array.of(4, 5));
  assert.deepEqual([...heap.subarray(2002, 2004)], [4, 5]);
  heap.set([6, 7, 8], 300);
  assert.deepEqual([...engine.decode(1, Uint8Array.of(1), 3)], [6, 7, 8]);
  assert.deepEqual([...engine.mediaOf(0)], [6, 7]);
  engine.addPattern(Uint8Array.of(1, 2, 3), { name: 'own' });
  assert.deepEqual([...heap.subarray(2000, 2003)], [1, 2, 3]);
  assert.deepEqual([engine.stand({ name: 'stands' }, 1), engine.stand({ name: 'not' }, 2)], [true, false]);
  assert.deepEqual(engine.patterns.map(({ name }) => name), ['cover', 'map', 'own', 'stands']);
  engine.forgetPatterns(2);
  assert.equal(engine.patterns.length, 2);
  assert.equal(engine.step(64, 0.5).length, 3 * 2 * 45);
  engine.look({ data: Uint8Array.of(1, 2, 3, 4), width: 1, height: 1 });
  assert.deepEqual([...heap.subarray(2000, 2004)], [1, 2, 3, 4]);
  const done = new Set(['pass', 'recipe', 'begin_piece', 'piece', 'add_pattern', 'step', 'look']);
  assert.deepEqual(calls.filter(([name]) => done.has(name)), [['pass', 5, 2000, 2], ['recipe', 2000, 1], ['begin_piece', 3, 2000, 4], ['piece', 1, 2000],
    ['add_pattern', 2000, 3], ['step', 2000, 64, 0.5], ['look', 2000, 1, 1]]);
  calls.length = 0;
  for (const on of [true, false]) { engine.showCoarse(on); engine.showAll(on); engine.beginRest(on); }
  assert.deepEqual(calls, [true, false].flatMap((on) => ['show_coarse', 'show_all', 'begin_rest'].map((name) => [name, Number(on)])));
});

test('commands and errors of the engine', () => {
  const fields = [[1, 4, 0], [2, 5, 0], [6, 6, 0], [7, 0, 3]];
  const { engine, calls, texts } = engineOn({ act: 4, command: (i, field) => fields[i][field], address: (action) => action, error: (field) => 10 + field });
  Object.assign(texts, { 3: 'https://museum.org', 10: 'bundle.hash', 11: 'museum.modar', 12: 'it differs', 13: 'bake it again' });
  assert.deepEqual(engine.act(1, null), [{ play: 4 }, { pause: 5 }, { text: 6 }, { link: 'https://museum.org' }]);
  engine.act(2, { node: 8, material: 3 });
  engine.act(3, { node: 8, ended: true });
  assert.deepEqual(calls.filter(([name]) => name === 'act'), [['act', 1, -1, 0, 0], ['act', 2, 1, 8, 3], ['act', 3, 2, 8, 0]]);
  assert.throws(() => engine.check(1), { code: 'bundle.hash', message: 'museum.modar: it differs; bake it again [bundle.hash]' });
  engine.check(0);
  for (const [message, code] of [['unsafe-eval', 'web.policy'], ['out of memory', 'web.memory'], ['', 'web.download']]) {
    assert.throws(() => engineFailed({ message }), { code });
  }
});

test('a turn between two frames is the mean of the readings', async () => {
  let read;
  Object.assign(globalThis, { addEventListener: (_, listener) => { read = listener; }, removeEventListener() {}, screen: { orientation: { angle: 0 } } });
  const gyroscope = Gyroscope.of({ srcObject: { getVideoTracks: () => [{ getSettings: () => ({ facingMode: 'environment' }) }] } });
  await Promise.resolve().then(() => {}).then(() => {});
  const degree = Math.PI / 180;
  for (const [timeStamp, alpha] of [[1000, 10], [1020, 20], [1040, 20]]) read({ timeStamp, rotationRate: { alpha, beta: 0, gamma: 0 } });
  near(gyroscope.turn(1000, 1020), [0.02 * 15 * degree, 0, 0]);
  near(gyroscope.turn(1010, 1030), [(0.01 * 15 + 0.01 * 20) * degree, 0, 0]);
  assert.equal(gyroscope.turn(990, 1020), undefined);
  assert.equal(gyroscope.turn(1020, 1020), undefined);
  // A reading counts for 100 milliseconds.
  near(gyroscope.turn(1040, 1140), [0.1 * 20 * degree, 0, 0]);
  assert.equal(gyroscope.turn(1040, 1141), undefined);
  read({ timeStamp: 1140, rotationRate: { alpha: 10, beta: 0, gamma: 0 } });
  near(gyroscope.turn(1040, 1140), [0.1 * 15 * degree, 0, 0]);
  read({ timeStamp: 6021, rotationRate: { alpha: 0, beta: 0, gamma: 0 } });  // older than 5 seconds: forgotten
  assert.equal(gyroscope.turn(1020, 1040), undefined);
  near(gyroscope.turn(1040, 1140), [0.1 * 15 * degree, 0, 0]);
  assert.equal(Gyroscope.of({ srcObject: null }), null);
});

test('answers to the System Usability Scale', () => {
  // Brooke's own example of 1996.
  assert.equal(susScore([5, 4, 2, 1, 2, 3, 2, 4, 5, 2]), 55);
  assert.equal(susScore([5, 1, 5, 1, 5, 1, 5, 1, 5, 1]), 100);
  assert.equal(susScore([3, 3, 3, 3, 3, 3, 3, 3, 3, null]), null);
});

test('a visit is logged with the members of modar-play\'s log', () => {
  const log = new VisitLog({ page: 'P' });
  for (let i = 0; i <= 10; ++i) {
    if (i === 4) log.event('found', { name: 'cover', time: 20.4 });
    if (i === 8) log.event('lost', { name: 'cover', time: 20.8, reason: 'out of view' });
    log.frame({ reason: i >= 4 && i < 8 ? 'visible' : 'few matches', time: 20 + i / 10, copyMs: 1, stepMs: i === 4 ? 40 : i });
  }
  const lines = log.text({ sus: [], score: null }).trim().split('\n').map((line) => JSON.parse(line));
  assert.deepEqual(lines[0], { qos: { version: 1, page: 'P', budget_ms: 33.333 } });
  assert.deepEqual(lines[1], { event: 'found', pattern: 'cover', time_s: 20.4, after_s: 0.4 });
  assert.deepEqual(lines[2], { event: 'lost', pattern: 'cover', time_s: 20.8, after_s: 0.4, reason: 'out of view' });
  assert.deepEqual(lines[3], { second: { from_s: 20, frames: 11, visible: 4, late: 1, reasons: { 'few matches': 7, visible: 4 }, ms: { track: { median: 7, p95: 41, max: 41 } } } });
  assert.deepEqual(lines[4], { survey: { sus: [], score: null } });
});
