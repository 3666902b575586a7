// @ts-check
// One run of `modar` in a worker of bake.js: on files in memory, in a folder of its own.
import {IN_NODE, nodeModule} from './platform.js';

const FOLDER = '/work';

/**
 * All files below a folder, by their names in it.
 * @param {any} fs of emscripten
 * @param {string} folder
 * @param {Record<string, Uint8Array>} found
 */
function readFolder(fs, folder, found, prefix = '') {
  for (const name of fs.readdir(folder)) {
    if (name === '.' || name === '..') continue;
    const path = `${folder}/${name}`;
    if (fs.isDir(fs.stat(path).mode)) readFolder(fs, path, found, `${prefix}${name}/`);
    else found[prefix + name] = fs.readFile(path);
  }
  return found;
}

/**
 * @param {any} fs of emscripten
 * @param {Record<string, Uint8Array>} files
 */
function writeFolder(fs, files) {
  fs.mkdirTree(FOLDER);
  for (const [name, bytes] of Object.entries(files)) {
    const path = `${FOLDER}/${name}`;
    fs.mkdirTree(path.slice(0, path.lastIndexOf('/')));
    fs.writeFile(path, bytes);
  }
  fs.chdir(FOLDER);
}

/**
 * @param {string} line of stderr
 * @returns {{stage: string, done: number} | undefined} what `--progress-json` writes
 */
function toProgress(line) {
  return line.startsWith('{') ? JSON.parse(line) : undefined;
}

/**
 * @param {{compiled: WebAssembly.Module, words: string[], files: Record<string, Uint8Array>}} request
 * @param {(message: object, transfer?: ArrayBuffer[]) => void} answer
 */
async function run({compiled, words, files}, answer) {
  const {default: load} = await import(/* @vite-ignore */ new URL('./bin/module/baker.js', import.meta.url).href);
  /** @type {string[]} */
  const stdout = [];
  /** @type {string[]} */
  const stderr = [];
  let status = 4;
  const module = await load({
    noInitialRun: true,
    print: (/** @type {string} */ line) => stdout.push(line),
    printErr: (/** @type {string} */ line) => {
      const progress = toProgress(line);
      if (progress) answer({progress});
      else stderr.push(line);
    },
    quit: (/** @type {number} */ code, /** @type {unknown} */ thrown) => {
      status = code;
      throw thrown;
    },
    instantiateWasm: (/** @type {WebAssembly.Imports} */ imports, /** @type {(instance: WebAssembly.Instance) => void} */ ready) => {
      WebAssembly.instantiate(compiled, imports).then(ready);
      return {};
    },
  });
  writeFolder(module.FS, files);
  try {
    status = module.callMain(words);
  } catch (error) {
    if (/** @type {any} */ (error)?.name !== 'ExitStatus') throw error;
  }
  const made = readFolder(module.FS, FOLDER, {});
  for (const name of Object.keys(files)) delete made[name];
  answer({outcome: {status, stdout: stdout.join('\n'), stderr: stderr.join('\n'), files: made}},
      Object.values(made).map(({buffer}) => /** @type {ArrayBuffer} */ (buffer)));
}

const port = IN_NODE ? (await nodeModule('worker_threads')).parentPort : self;
if (IN_NODE) {  // what emscripten's code for a browser's worker looks at
  Object.assign(globalThis, {self: globalThis, location: {href: import.meta.url}});
  globalThis.crypto ??= (await nodeModule('crypto')).webcrypto;
}
port.addEventListener('message', async (/** @type {MessageEvent} */ {data}) => {
  const answer = (/** @type {object} */ message, /** @type {ArrayBuffer[]} */ transfer = []) =>
      port.postMessage(message, transfer);
  try {
    await run(data, answer);
  } catch (error) {
    answer({failed: String(error)});
  }
});
port.start?.();
