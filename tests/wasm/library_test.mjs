// `modar/bake` in Node against the native program: node --test library_test.mjs, with MODAR_PACKAGE, the folder of
// scripts/wasm/package.sh, MODAR_BIN_DIR and MODAR_SOURCE_DIR in the environment.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, test} from 'node:test';

const {MODAR_PACKAGE: packageFolder, MODAR_BIN_DIR: bin, MODAR_SOURCE_DIR: root} = process.env;
const {ModarError, bake, check, inspect, rectify, scorePicture} = await import(join(packageFolder, 'bake.js'));
const assets = join(root, 'assets');
const folder = mkdtempSync(join(tmpdir(), 'modar-library-'));
after(() => rmSync(folder, {recursive: true}));

const files = Object.fromEntries(['models/pottery.obj', 'models/pottery.mtl', 'models/pottery.png', 'patterns/cover.png']
    .map((name) => [name.split('/')[1], readFileSync(join(assets, name))]));
for (const [name, bytes] of Object.entries(files)) writeFileSync(join(folder, name), bytes);
const native = (...words) => execFileSync(join(bin, 'modar'), words, {cwd: folder, encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore']});

test('a bundle has the bytes and the report of the native program, with progress', async () => {
  const stages = new Set();
  const options = {noScore: true, loopViews: 8, scene: ['cover=pottery,scale=0.5'], pattern: 'cover.png:210mm', model: 'pottery.obj'};
  const {bundle, report, messages} = await bake(files, options, {onProgress: ({stage}) => stages.add(stage)});
  native('bake', '--no-score', '--loop-views', '8', '--scene', 'cover=pottery,scale=0.5', '--pattern', 'cover.png:210mm', '--model',
      'pottery.obj', '-o', 'bundle.modar');
  assert.ok(readFileSync(join(folder, 'bundle.modar')).equals(bundle));
  assert.deepEqual(report.bundle.patterns.map(({name}) => name), ['cover']);
  assert.ok(stages.size > 1, [...stages].join());
  assert.ok(!messages.includes('{"stage'), messages);
  assert.deepEqual(await inspect(bundle), JSON.parse(native('inspect', 'bundle.modar', '--json')));
  assert.deepEqual(await check(bundle), JSON.parse(native('check', 'bundle.modar', '--json')));
  const damaged = Uint8Array.from(bundle, (byte, at) => at === bundle.length - 100 ? byte ^ 255 : byte);
  assert.equal((await check(damaged)).verdict, 'bad');
});

test('files are taken for what they are', async () => {
  const {report} = await bake(files, {noScore: true, loopViews: 8});
  assert.deepEqual([report.bundle.models[0].name, report.bundle.patterns[0].name, report.bundle.patterns.length], ['pottery', 'cover', 1]);
});

test('a picture is scored and made frontal', async () => {
  const {report: made, picture} = await rectify(files['cover.png'], {corners: '0,0,347,0,347,716,0,716', width: '43mm'});
  assert.deepEqual([...picture.subarray(1, 4)], [...Buffer.from('PNG')]);
  assert.equal(made.width, JSON.parse(native('pattern', 'rectify', 'cover.png', '--corners', '0,0,347,0,347,716,0,716', '--width', '43mm',
      '-o', 'frontal.png', '--json')).width);
  assert.ok(readFileSync(join(folder, 'frontal.png')).equals(picture));
  const expected = JSON.parse(native('pattern', 'score', 'cover.png', '--json'))[0];
  const {grade, score} = await scorePicture(new Blob([files['cover.png']]));
  assert.deepEqual({grade, score}, {grade: expected.grade, score: expected.score});
});

test('errors have code, cause and cure', async () => {
  for (const [inputs, options, code, status] of [
    [{'a.obj': Buffer.from('f 1 2 3\n')}, {}, /^obj\./, 3], [{}, {model: 'none.obj'}, /^io\.open$/, 2],
    [files, {tier: 'museum'}, /^cli\./, 1], [{'../a.obj': Buffer.alloc(1)}, {}, /^bake\.name$/, undefined],
  ]) {
    await assert.rejects(bake(inputs, options), (error) => error instanceof ModarError && code.test(error.code) &&
        error.status === status && error.cause !== '' && error.cure !== '', `${code}`);
  }
});

test('a call ends when it is aborted, and the next one runs', async () => {
  const stop = new AbortController();
  const run = bake(files, {}, {signal: stop.signal, onProgress: () => stop.abort()});
  await assert.rejects(run, {name: 'AbortError'});
  await assert.rejects(bake(files, {}, {signal: stop.signal}), {name: 'AbortError'});
  assert.equal((await check(readFileSync(join(root, 'tests/golden/v1_0.modar')))).verdict, 'good');
});
