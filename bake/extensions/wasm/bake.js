// @ts-check
// `modar` as a library, in Node and in browsers: bytes in, bytes out. Each call runs in a worker of its own, so that a page stays
// responsive and a call can be stopped.
import {ModarError} from './engine.js';
import {IN_NODE, nodeModule} from './platform.js';

export {ModarError};

/**
 * @typedef {import('./bake.js').Files} Files
 * @typedef {import('./bake.js').Run} Run
 * @typedef {import('./bake.js').Contents} Contents
 * @typedef {Record<string, unknown>} Options
 * @typedef {{status: number, stdout: string, stderr: string, files: Record<string, Uint8Array>}} Outcome
 */

/** @type {Promise<WebAssembly.Module> | undefined} */
let program;

/** The program, compiled once for all calls. */
async function compile() {
  const address = new URL('./bin/baker.wasm', import.meta.url);
  if (IN_NODE) {
    const {readFile} = await nodeModule('fs/promises');
    return WebAssembly.compile(await readFile(address));
  }
  const answer = await fetch(address);
  if (!answer.ok) {
    throw new ModarError({
      code: 'bake.program',
      where: String(address),
      cause: `the server answered ${answer.status}`,
      cure: 'put the file bin/baker.wasm of the package there',
    });
  }
  return WebAssembly.compile(await answer.arrayBuffer());
}

async function openWorker() {
  if (IN_NODE) {
    const {Worker} = await nodeModule('worker_threads');
    const worker = new Worker(new URL('./bake-worker.js', import.meta.url));
    return {
      post: (/** @type {unknown} */ message) => worker.postMessage(message),
      stop: () => worker.terminate(),
      listen: (/** @type {(data: any) => void} */ heard, /** @type {(error: Error) => void} */ failed) => {
        worker.on('message', heard).on('error', failed);
      },
    };
  }
  const worker = new Worker(new URL('./bake-worker.js', import.meta.url), {type: 'module'});
  return {
    post: (/** @type {unknown} */ message) => worker.postMessage(message),
    stop: () => worker.terminate(),
    listen: (/** @type {(data: any) => void} */ heard, /** @type {(error: Error) => void} */ failed) => {
      worker.onmessage = ({data}) => heard(data);
      worker.onerror = (event) => failed(new Error(event.message || 'the worker could not be started'));
    },
  };
}

/** @param {Contents} contents */
async function toBytes(contents) {
  if (contents instanceof Uint8Array) return contents;
  return new Uint8Array(contents instanceof Blob ? await contents.arrayBuffer() : contents);
}

/** @param {Files} files */
async function readFiles(files) {
  /** @type {Record<string, Uint8Array>} */
  const read = {};
  for (const [name, contents] of Object.entries(files)) {
    if (!name || name.startsWith('-') || name.split(/[\\/]/).some((part) => ['', '.', '..'].includes(part))) {
      throw new ModarError({
        code: 'bake.name',
        where: name,
        cause: 'it is no name of a file below the call\'s own folder',
        cure: 'name it as in "vase.glb" or "textures/wood.png"',
      });
    }
    read[name] = await toBytes(contents);
  }
  return read;
}

/**
 * {noLods: true, tier: 'phone'} as ["--no-lods", "--tier", "phone"].
 * @param {Options} options
 */
function optionWords(options) {
  return Object.entries(options).flatMap(([name, value]) => {
    const word = `--${name.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`)}`;
    const values = (Array.isArray(value) ? value : [value]).filter((each) => each !== undefined && each !== false);
    return values.flatMap((each) => (each === true ? [word] : [word, String(each)]));
  });
}

/**
 * The last line of stderr, "modar: error: where: cause; cure [code]".
 * @param {Outcome} outcome
 */
function toError({status, stderr}) {
  const line = stderr.split('\n').filter((each) => each.startsWith('modar: error: ')).pop() ?? stderr.trimEnd();
  const [, text, code] = /^(?:modar: error: )?([^]*?)(?: \[([\w.-]+)\])?$/.exec(line) ?? ['', line, ''];
  const where = text.indexOf(': ');
  const cure = text.lastIndexOf('; ');
  const error = new ModarError({
    code: code ?? 'modar.failed',
    where: where < 0 ? '' : text.slice(0, where),
    cause: text.slice(where < 0 ? 0 : where + 2, cure < 0 ? undefined : cure),
    cure: cure < 0 ? '' : text.slice(cure + 2),
  });
  return Object.assign(error, {status});
}

/**
 * Runs `modar` with these words on these files. Rejects with the signal's reason where it is aborted.
 * @param {string[]} words
 * @param {Record<string, Uint8Array>} files
 * @param {Run} run
 * @returns {Promise<Outcome>}
 */
async function call(words, files, {signal, onProgress} = {}) {
  signal?.throwIfAborted();
  program ??= compile();
  program.catch(() => { program = undefined; });  // the next call tries again
  const [compiled, worker] = await Promise.all([program, openWorker()]);
  /** @type {() => void} */
  let abort = () => {};
  try {
    return await new Promise((resolve, reject) => {
      abort = () => reject(signal?.reason);
      if (signal?.aborted) abort();
      signal?.addEventListener('abort', abort);
      worker.listen((message) => {
        if (message.progress) onProgress?.(message.progress);
        if (message.outcome) resolve(message.outcome);
        if (message.failed) reject(new ModarError({code: 'bake.worker', cause: message.failed}));
      }, (error) => reject(new ModarError({code: 'bake.worker', cause: error.message})));
      worker.post({compiled, words, files});
    });
  } finally {
    signal?.removeEventListener('abort', abort);
    worker.stop();
  }
}

/**
 * @param {Outcome} outcome
 * @returns {any}
 */
function toJson(outcome) {
  if (!/^[{[]/.test(outcome.stdout)) throw toError(outcome);
  return JSON.parse(outcome.stdout);
}

/** Files that a model reads, and that no bake takes by themselves. */
const PART_OF_A_MODEL = /\.(bin|mtl)$/i;

/**
 * @param {Files} files
 * @param {Options} [options]
 * @param {Run} [run]
 */
export async function bake(files, options = {}, run = {}) {
  const read = await readFiles(files);
  const named = options.model !== undefined || options.pattern !== undefined;
  const inputs = named ? [] : Object.keys(read).filter((name) => !PART_OF_A_MODEL.test(name));
  const outcome = await call(
      ['bake', ...inputs, ...optionWords(options), '--json', '--progress-json', '-o', 'bundle.modar'], read, run);
  const bundle = outcome.files['bundle.modar'];
  if (outcome.status !== 0 || !bundle) throw toError(outcome);
  return {bundle, report: toJson(outcome), messages: outcome.stderr};
}

/**
 * @param {Contents} bundle
 * @param {Options & {files?: Files}} [options]
 * @param {Run} [run]
 */
export async function check(bundle, options = {}, run = {}) {
  const {files = {}, ...rest} = options;
  const read = {...await readFiles(files), 'bundle.modar': await toBytes(bundle)};
  return toJson(await call(['check', 'bundle.modar', ...optionWords(rest), '--json'], read, run));
}

/**
 * @param {Contents} bundle
 * @param {Run} [run]
 */
export async function inspect(bundle, run = {}) {
  return toJson(await call(['inspect', 'bundle.modar', '--json'], {'bundle.modar': await toBytes(bundle)}, run));
}

/**
 * @param {Contents} picture
 * @param {Options} [options]
 * @param {Run} [run]
 */
export async function scorePicture(picture, options = {}, run = {}) {
  const words = ['pattern', 'score', 'picture', ...optionWords(options), '--json'];
  return toJson(await call(words, {picture: await toBytes(picture)}, run))[0];
}

/**
 * @param {Contents} photo
 * @param {Options} [options]
 * @param {Run} [run]
 */
export async function rectify(photo, options = {}, run = {}) {
  const words = ['pattern', 'rectify', 'photo', ...optionWords(options), '--json', '-o', 'picture.png'];
  const outcome = await call(words, {photo: await toBytes(photo)}, run);
  const report = toJson(outcome);
  return {picture: outcome.files['picture.png'], corners: outcome.files['picture.png.corners.png'], report};
}
