// Paths of Windows, by Node's own path.win32: no Windows was at hand.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import path from 'node:path';
import { test } from 'node:test';

const { translation } = createRequire(import.meta.url)('../../bake/extensions/wasm/paths.js');

/** Node's files as they would be called on Windows: notes the calls. */
function noted(calls, answer) {
  return new Proxy({}, { get: (_, name) => (...rest) => { calls.push([name, ...rest]); return answer; } });
}

test('absolute paths of Windows go to the program and come back', () => {
  const { toProgram, toSystem } = translation(path.win32, {});
  for (const folder of ['C:\\', 'C:\\Users\\Zoë Müller\\a b', 'd:\\models\\Ko\u0308ln', '\\\\server\\share\\x']) {
    for (const name of ['vase.glb', 'Va\u0308se 2.glb', 'a\u00e4.png']) {
      const absolute = path.win32.join(folder, name);
      const inside = toProgram(absolute);
      assert.ok(path.posix.isAbsolute(inside), inside);
      assert.equal(path.posix.basename(inside), name);
      assert.equal(path.win32.normalize(toSystem(inside)), path.win32.normalize(absolute));
    }
  }
});

test('arguments with paths in them', () => {
  const { toProgram } = translation(path.win32, {});
  assert.equal(toProgram('models\\a b\\vase.glb'), 'models/a b/vase.glb');
  assert.equal(toProgram('--out=C:\\out\\vase.modar'), '--out=/C:/out/vase.modar');
  assert.equal(toProgram('C:\\poster.png:210mm'), '/C:/poster.png:210mm');
  for (const kept of ['https://a.example/b', 'poster.png:210mm', 'cover=pottery,scale=0.5', '-o', 'a:b']) assert.equal(toProgram(kept), kept);
});

test('other systems keep every byte', () => {
  const { toProgram, toSystem } = translation(path.posix, {});
  for (const kept of ['/C:/a', 'a\\b', '--out=C:\\x', '/tmp/a b']) {
    assert.equal(toProgram(kept), kept);
    assert.equal(toSystem(kept), kept);
  }
});

test('files are opened, renamed and listed by the paths of Windows', () => {
  const calls = [];
  const { files } = translation(path.win32, noted(calls, 'C:\\x'));
  files.openSync('/C:/a b/vase.glb', 'r', 0o600);
  files.renameSync('/C:/a/.new', '/C:/a/vase.modar');
  files.statSync('/D:');
  files.statSync('models/vase.glb');
  assert.equal(files.readlinkSync('/C:/link'), '/C:/x');
  assert.deepEqual(calls, [['openSync', 'C:/a b/vase.glb', 'r', 0o600], ['renameSync', 'C:/a/.new', 'C:/a/vase.modar'],
    ['statSync', 'D:/'], ['statSync', 'models/vase.glb'], ['readlinkSync', 'C:/link']]);
});
