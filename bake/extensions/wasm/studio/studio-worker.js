// @ts-check
// The studio of a static page: the program as a module, the project's files in memory and in the browser's private file system, and
// jobs in workers of their own. Messages: {call} from the page, answered by {id, ...}; {event} to it. A job's worker is this one too.
import load from './baker/baker.js';

/** @typedef {{method: string, path: string, query: Record<string, string>, body?: string, upload?: Blob}} Call */

const FOLDER = '/project';
/** Of the page that `modar web` copies. */
const PAGE = '/modar';
/** Requests that start a job. */
const JOBS = new Set(['api/bake', 'api/export']);

/** @type {any} the module */
let modar;
/** @type {WebAssembly.Module} */
let compiled;
/** The last stored state of each file: "bytes time node". */
const stored = new Map();
/** @type {FileSystemDirectoryHandle | null} null: nothing is kept */
let disk = null;
let lastEvent = 0;
/** @typedef {{number: number, kind: string, worker: Worker | null, ended: boolean}} Job */
/** @type {Job | null} */
let job = null;
/** @type {Promise<unknown>} one call after the other */
let queue = Promise.resolve();
let pageLoaded = false;

// ---- the module ----

/** @param {WebAssembly.Module} program */
async function start(program, jobNumber = 0) {
  compiled = program;
  modar = {
    noInitialRun: true,
    print: (/** @type {string} */ line) => modar.ccall('studio_line', null, ['number', 'string'], [1, line]),
    printErr: (/** @type {string} */ line) => {
      modar.ccall('studio_line', null, ['number', 'string'], [2, line]);
      if (jobNumber) sendEvents();
    },
    startJob: (/** @type {number} */ number, /** @type {string} */ kind) => { job = {number, kind, worker: null, ended: false}; },
    endJob,
    instantiateWasm: (/** @type {WebAssembly.Imports} */ imports, /** @type {(instance: WebAssembly.Instance) => void} */ ready) => {
      WebAssembly.instantiate(program, imports).then(ready);
      return {};
    },
  };
  modar = await load(modar);
  modar.FS.mkdirTree(FOLDER);
  modar.FS.mkdirTree(`${PAGE}/bin`);
}

/**
 * All files below a folder of the module, with their nodes.
 * @returns {Generator<[string, any]>}
 */
function* files(folder = FOLDER) {
  for (const name of modar.FS.readdir(folder)) {
    if (name === '.' || name === '..') continue;
    const path = `${folder}/${name}`;
    const {node} = modar.FS.lookupPath(path);
    if (modar.FS.isDir(node.mode)) yield* files(path);
    else yield [path, node];
  }
}

/** @param {any} node of a file */
const bytesOf = (node) => (node.contents ? node.contents.slice(0, node.usedBytes) : new Uint8Array());

/**
 * What has changed since the last time: bytes by path, null for a file that is gone.
 * @returns {Map<string, Uint8Array | null>}
 */
function changes() {
  /** @type {Map<string, Uint8Array | null>} */
  const changed = new Map();
  const there = new Set();
  for (const [path, node] of files()) {
    if (path.includes('/incoming-')) continue;
    there.add(path);
    const state = `${node.usedBytes} ${node.timestamp} ${node.id}`;
    if (stored.get(path) !== state) changed.set(path, bytesOf(node));
    stored.set(path, state);
  }
  for (const path of stored.keys()) {
    if (there.has(path)) continue;
    stored.delete(path);
    changed.set(path, null);
  }
  return changed;
}

/** @param {Iterable<[string, Uint8Array | null]>} list */
function putFiles(list) {
  for (const [path, bytes] of list) {
    if (!bytes) {
      modar.FS.unlink(path);
      continue;
    }
    modar.FS.mkdirTree(path.slice(0, path.lastIndexOf('/')));
    modar.FS.writeFile(path, bytes);
  }
}

// ---- the private file system ----

/**
 * @param {string} path of a file in FOLDER
 * @param {boolean} create
 * @returns {Promise<[FileSystemDirectoryHandle, string]>}
 */
async function place(path, create) {
  const parts = path.slice(FOLDER.length + 1).split('/');
  const name = /** @type {string} */ (parts.pop());
  let folder = /** @type {FileSystemDirectoryHandle} */ (disk);
  for (const part of parts) folder = await folder.getDirectoryHandle(part, {create});
  return [folder, name];
}

/** @param {Map<string, Uint8Array | null>} changed */
async function keep(changed) {
  if (!disk) return;
  for (const [path, bytes] of changed) {
    const [folder, name] = await place(path, bytes !== null);
    if (!bytes) {
      await folder.removeEntry(name).catch(() => {});
      continue;
    }
    const file = /** @type {any} */ (await folder.getFileHandle(name, {create: true}));
    const access = await file.createSyncAccessHandle();
    try {
      access.truncate(bytes.length);
      for (let at = 0; at < bytes.length;) at += access.write(bytes.subarray(at), {at});
      access.flush();
    } finally { access.close(); }
  }
}

/**
 * @param {FileSystemDirectoryHandle} folder
 * @returns {AsyncGenerator<[string, FileSystemFileHandle]>}
 */
async function* kept(folder, path = FOLDER) {
  for await (const [name, handle] of /** @type {any} */ (folder).entries()) {
    if (handle.kind === 'directory') yield* kept(handle, `${path}/${name}`);
    else yield [`${path}/${name}`, handle];
  }
}

async function openDisk() {
  try {
    const root = await navigator.storage.getDirectory();
    disk = await root.getDirectoryHandle('modar-studio', {create: true});
    const probe = /** @type {any} */ (await root.getFileHandle('modar-probe', {create: true}));
    (await probe.createSyncAccessHandle()).close();
  } catch {
    disk = null;
    return;
  }
  for await (const [path, handle] of kept(disk)) {
    putFiles([[path, new Uint8Array(await (await handle.getFile()).arrayBuffer())]]);
  }
  changes();
}

// ---- calls ----

/**
 * @param {Omit<Call, 'upload'> & {upload?: string | Blob}} call upload: a path
 * @returns {{status: number, type: string, headers: Record<string, string>, body: Uint8Array}}
 */
function ask(call) {
  const {status, type, headers, file, at, size} = JSON.parse(modar.ccall('studio_call', 'string', ['string'], [JSON.stringify(call)]));
  const body = file ? modar.FS.readFile(file) : modar.HEAPU8.slice(at, at + size);
  return {status, type, headers, body};
}

const ROOM = {
  error: 'the browser gives this page no more room',
  cure: 'free space on this device, or export the project and remove files from it',
  code: 'studio.room',
};

/** @param {unknown} error */
function failed(error) {
  const full = error instanceof Error && error.name === 'QuotaExceededError';
  const told = full ? ROOM : {error: error instanceof Error ? error.message : String(error), cure: 'try again', code: 'studio.page'};
  const body = new TextEncoder().encode(JSON.stringify(told));
  return {status: full ? 507 : 500, type: 'application/json', headers: {}, body};
}

/** @param {Call} call */
async function answer(call) {
  try {
    if (JOBS.has(call.path) && call.method === 'POST' && call.body?.includes('"kind"')) await loadPage();
    if (call.upload) {
      const path = `${FOLDER}/.modar/studio/incoming-page`;
      modar.FS.writeFile(path, new Uint8Array(await call.upload.arrayBuffer()));
      const done = ask({...call, upload: path});
      if (modar.FS.analyzePath(path).exists) modar.FS.unlink(path);
      await keep(changes());
      return done;
    }
    const done = ask(call);
    await keep(changes());
    if (job && !job.worker) startJob(job, call);
    return done;
  } catch (error) {
    return failed(error);
  } finally { sendEvents(); }
}

/** @returns {{name: string, data: string}[]} those that nobody has had yet */
function newEvents() {
  const events = JSON.parse(modar.ccall('studio_events', 'string', ['number'], [lastEvent]));
  if (events.length) lastEvent = events.at(-1).number;
  return events;
}

function sendEvents() {
  const events = newEvents();
  if (!events.length) return;
  // Whoever hears of a job may ask for what it has made.
  const done = isJob && events.some(({name}) => name !== 'progress');
  self.postMessage({events, files: done ? changes() : undefined});
}

/** What `modar web` copies into a site: the page, fetched once. */
async function loadPage() {
  if (pageLoaded) return;
  const get = async (/** @type {string} */ name) => {
    const response = await fetch(`engine/${name}`);
    if (!response.ok) throw new Error(`engine/${name}: the server answered ${response.status}`);
    return response;
  };
  const list = await (await get('files.json')).json();
  await Promise.all(list.map(async (/** @type {string} */ name) => {
    putFiles([[`${PAGE}/${name}`, new Uint8Array(await (await get(name)).arrayBuffer())]]);
  }));
  pageLoaded = true;
}

// ---- jobs ----

let isJob = false;

/**
 * @param {Job} mine
 * @param {Call} call
 */
function startJob(mine, call) {
  const worker = new Worker(new URL(import.meta.url), {type: 'module'});
  mine.worker = worker;
  const page = pageLoaded ? [...files(PAGE)] : [];
  worker.postMessage({
    job: mine.number,
    call,
    compiled,
    files: [...files(), ...page].map(([path, node]) => [path, bytesOf(node)]),
  });
  worker.onmessage = ({data}) => {
    queue = queue.then(() => jobTold(mine, data)).catch((error) => self.postMessage({error: String(error)}));
  };
  worker.onerror = (event) => {
    event.preventDefault();
    queue = queue.then(() => jobFailed(mine, event.message));
  };
}

/**
 * @param {Job} mine
 * @param {{events: {name: string, data: string}[], files?: Map<string, Uint8Array | null>, ended?: string, broken?: string}} told
 */
async function jobTold(mine, {events, files: made, ended, broken}) {
  if (job !== mine) return;
  if (broken !== undefined) return jobFailed(mine, broken);
  if (made) {
    putFiles(made);
    await keep(changes());
  }
  if (ended !== undefined) {
    mine.ended = true;
    modar.ccall('studio_job_ended', null, ['string'], [ended]);
  }
  for (const {name, data} of events) modar.ccall('studio_publish', null, ['string', 'string'], [name, data]);
  sendEvents();
}

/**
 * @param {Job} mine
 * @param {string} cause
 */
function jobFailed(mine, cause) {
  if (job !== mine) return;
  mine.ended = true;
  const told = {
    job: mine.number,
    kind: mine.kind,
    error: `the work ended: ${cause}`,
    cure: 'a browser has 4 GB at most: use smaller models, or a tier',
    code: 'studio.memory',
    errors: []
  };
  modar.ccall('studio_job_ended', null, ['string'], ['null']);
  modar.ccall('studio_publish', null, ['string', 'string'], ['failed', JSON.stringify(told)]);
  sendEvents();
}

/** Of module.js: the job of this page is over, or a person cancels it. */
function endJob() {
  if (!job) return;
  const {worker, ended, number, kind} = job;
  job = null;
  worker?.terminate();
  if (!ended) modar.ccall('studio_publish', null, ['string', 'string'], ['cancelled', JSON.stringify({job: number, kind})]);
}

// ---- messages ----

/** @param {any} data */
async function beginJob(data) {
  isJob = true;
  await start(data.compiled, data.job);
  putFiles(data.files);
  changes();
  modar.ccall('studio_open', null, ['string', 'number'], [FOLDER, data.job]);
  ask(data.call);
  const ended = modar.ccall('studio_baked_scenes', 'string', [], []);
  self.postMessage({events: newEvents(), files: changes(), ended});
}

/** @param {WebAssembly.Module} program */
async function beginPage(program) {
  await start(program);
  await openDisk();
  modar.ccall('studio_open', null, ['string', 'number'], [FOLDER, 0]);
  await keep(changes());
  self.postMessage({ready: true, kept: disk !== null});
}

self.onmessage = ({data}) => {
  if (data.job) {
    beginJob(data).catch((error) => self.postMessage({events: [], broken: String(error)}));
  } else if (data.program) {
    queue = beginPage(data.program).catch((error) => self.postMessage({error: String(error)}));
  } else {
    queue = queue.then(async () => {
      const done = await answer(data.call);
      self.postMessage({id: data.id, ...done}, {transfer: [done.body.buffer]});
    });
  }
};
