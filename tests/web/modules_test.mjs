// Modules of the page that need no browser.
import assert from 'node:assert/strict';
import test from 'node:test';

import { isPacked } from '../../runtime/extensions/web/arrival.js';
import { textsOf, titleOf } from '../../runtime/extensions/web/bundle.js';
import { hostApp, mainCamera } from '../../runtime/extensions/web/camera.js';
import { isRotten } from '../../runtime/extensions/web/copy.js';
import { toCamera } from '../../runtime/extensions/web/gyroscope.js';
import { isNewer } from '../../runtime/extensions/web/installed-release.js';
import { groundTransform, viewFrom } from '../../runtime/extensions/web/turntable.js';
import { directionOf, fill, labelOf } from '../../runtime/extensions/web/viewer-words.js';

const near = (got, wanted) => got.forEach((value, i) => assert.ok(Math.abs(value - wanted[i]) < 1e-6, `${got} is not ${wanted}`));

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
