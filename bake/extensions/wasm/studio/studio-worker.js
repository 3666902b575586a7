// @ts-check
// The studio of a static page: the program as a module, the project's files in memory and in the browser's private file system, and
// jobs in workers of their own. Messages: {call} from the page, answered by {id, ...}; {event} to it. A job's worker is this one too.
import load from './baker/baker.js';

/** @typedef {{method: string, path: string, query: Record<string, string>, body?: string, upload?: Blob}} Call */

/** Of the project: its last part is the project's name until modar.toml says another. */
let folder = '';
/** Of the page that `modar web` copies. */
const PAGE = '/modar';
/** A browser's memory is 4 GB at most, and a bake needs as much again. */
const MOST_BYTES = 2e9;
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
  modar.FS.mkdirTree(folder);
  modar.FS.mkdirTree(`${PAGE}/bin`);
  keepStamps();
}

/** Bundles are known again by time and inode, which their copies in jobs and in later visits must share. */
function keepStamps() {
  const probe = `${PAGE}/probe`;
  modar.FS.writeFile(probe, '');
  const {node_ops: operations} = modar.FS.lookupPath(probe).node;
  modar.FS.unlink(probe);
  const {getattr} = operations;
  const time = new Date(0);
  operations.getattr = (/** @type {any} */ node) =>
      (/^(?![0-9a-f]{32}\.).*\.modar$/.test(node.name) ? {...getattr(node), ino: 1, mtime: time, ctime: time} : getattr(node));
}

/**
 * All files below a folder of the module, with their nodes.
 * @returns {Generator<[string, any]>}
 */
function* files(from = folder) {
  for (const name of modar.FS.readdir(from)) {
    if (name === '.' || name === '..') continue;
    const path = `${from}/${name}`;
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
 * @param {string} path of a file of the project
 * @param {boolean} create
 * @returns {Promise<[FileSystemDirectoryHandle, string]>}
 */
async function place(path, create) {
  const parts = path.slice(folder.length + 1).split('/');
  const name = /** @type {string} */ (parts.pop());
  let place = /** @type {FileSystemDirectoryHandle} */ (disk);
  for (const part of parts) place = await place.getDirectoryHandle(part, {create});
  return [place, name];
}

/**
 * The old file stays until the new one is complete.
 * @param {any} file
 * @param {Uint8Array} bytes
 */
async function store(file, bytes) {
  if (file.createWritable) {
    const writing = await file.createWritable();
    try {
      await writing.write(bytes);
      return await writing.close();
    } catch (error) {
      await writing.abort().catch(() => {});
      throw error;
    }
  }
  const access = await file.createSyncAccessHandle();  // older browsers, in their own file system alone
  try {
    access.truncate(bytes.length);
    for (let at = 0; at < bytes.length;) at += access.write(bytes.subarray(at), {at});
    access.flush();
  } finally { access.close(); }
}

/** modar.toml, which names the others, is the last. */
const inOrder = (/** @type {Map<string, Uint8Array | null>} */ changed) =>
    [...changed].sort(([a], [b]) => Number(a.endsWith('/modar.toml')) - Number(b.endsWith('/modar.toml')));

/**
 * What cannot be stored is tried again with the next change.
 * @param {Map<string, Uint8Array | null>} changed
 */
async function keep(changed) {
  if (!disk) return;
  const left = new Map(inOrder(changed));
  try {
    for (const [path, bytes] of [...left]) {
      const [where, name] = await place(path, bytes !== null);
      if (bytes) await store(await where.getFileHandle(name, {create: true}), bytes);
      else await where.removeEntry(name).catch(() => {});
      left.delete(path);
    }
  } catch (error) {
    for (const [path, bytes] of left) {
      if (bytes) stored.delete(path);
      else stored.set(path, '');
    }
    throw error;
  }
}

/**
 * @param {FileSystemDirectoryHandle} from
 * @returns {AsyncGenerator<[string, FileSystemFileHandle]>}
 */
async function* kept(from, path = folder) {
  for await (const [name, handle] of /** @type {any} */ (from).entries()) {
    if (handle.kind === 'file') yield [`${path}/${name}`, handle];
    else if (name === '.modar' || !/^\.|^node_modules$/.test(name)) yield* kept(handle, `${path}/${name}`);
  }
}

/** @param {{name: string, folder?: FileSystemDirectoryHandle}} chosen */
async function openDisk(chosen) {
  try {
    disk = chosen.folder ?? null;
    if (!disk) {
      const root = await navigator.storage.getDirectory();
      disk = await (await root.getDirectoryHandle('modar-projects', {create: true})).getDirectoryHandle(chosen.name, {create: true});
      await store(await root.getFileHandle('modar-probe', {create: true}), new Uint8Array(1));
    }
  } catch (error) {
    if (chosen.folder) throw error;
    disk = null;
    return;
  }
  let bytes = 0;
  for await (const [path, handle] of kept(disk)) {
    const file = await handle.getFile();
    bytes += file.size;
    if (bytes > MOST_BYTES) throw new Error(`${disk.name} has more than 2 GB: open a folder with the project's files alone`);
    putFiles([[path, new Uint8Array(await file.arrayBuffer())]]);
  }
  changes();
}

/** A project that was exported comes as one file. */
function unpack() {
  const archive = `${folder}/import.zip`;
  if (!modar.FS.analyzePath(archive).exists) return;
  const wrong = JSON.parse(modar.ccall('studio_unpack', 'string', ['string', 'string'], [archive, folder]));
  modar.FS.unlink(archive);
  if (wrong) self.postMessage({notice: wrong});
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
  error: 'the browser gives this page no more room: the last change is not kept',
  cure: 'free space on this device, or export the project and remove files from it; the next change is kept with it',
  code: 'studio.room',
};

/** @param {unknown} error */
const isFull = (error) => error instanceof Error && error.name === 'QuotaExceededError';

/**
 * @param {unknown} error
 * @returns {{error: string, cure: string, code: string}}
 */
const wrongOf = (error) =>
    isFull(error) ? ROOM : {error: error instanceof Error ? error.message : String(error), cure: 'try again', code: 'studio.page'};

/** @param {unknown} error */
function failed(error) {
  const body = new TextEncoder().encode(JSON.stringify(wrongOf(error)));
  return {status: isFull(error) ? 507 : 500, type: 'application/json', headers: {}, body};
}

/** @param {Call} call */
async function answer(call) {
  try {
    if (JOBS.has(call.path) && call.method === 'POST' && call.body?.includes('"kind"')) await loadPage();
    if (call.upload) {
      const path = `${folder}/.modar/studio/incoming-page`;
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
  self.postMessage({events, files: done ? changes() : undefined, scenes: isJob ? modar.ccall('studio_scenes', 'string', [], []) : undefined});
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
    folder,
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
 * @param {{events: {name: string, data: string}[], files?: Map<string, Uint8Array | null>, scenes?: string, ended?: boolean, broken?: string}} told
 */
async function jobTold(mine, {events, files: made, scenes, ended, broken}) {
  if (job !== mine) return;
  if (broken !== undefined) return jobFailed(mine, broken);
  if (made) {
    putFiles(made);
    await keep(changes()).catch((error) => self.postMessage({notice: wrongOf(error)}));
  }
  if (scenes) modar.ccall('studio_set_scenes', null, ['string'], [scenes]);
  if (ended) {
    mine.ended = true;
    modar.ccall('studio_job_ended', null, [], []);
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
  modar.ccall('studio_job_ended', null, [], []);
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
  ({folder} = data);
  await start(data.compiled, data.job);
  putFiles(data.files);
  changes();
  modar.ccall('studio_open', null, ['string', 'number'], [folder, data.job]);
  ask(data.call);
  const scenes = modar.ccall('studio_scenes', 'string', [], []);
  self.postMessage({events: newEvents(), files: changes(), scenes, ended: true});
}

/** @param {{program: WebAssembly.Module, chosen: {name: string, folder?: FileSystemDirectoryHandle}}} begin */
async function beginPage({program, chosen}) {
  folder = `/projects/${chosen.name}`;
  await start(program);
  await openDisk(chosen);
  modar.ccall('studio_open', null, ['string', 'number'], [folder, 0]);
  unpack();
  await keep(changes()).catch((error) => self.postMessage({notice: wrongOf(error)}));
  self.postMessage({ready: true, kept: disk !== null});
}

self.onmessage = ({data}) => {
  if (data.job) {
    beginJob(data).catch((error) => self.postMessage({events: [], broken: String(error)}));
  } else if (data.program) {
    queue = beginPage(data).catch((error) => self.postMessage({error: String(error)}));
  } else {
    queue = queue.then(async () => {
      const done = await answer(data.call);
      self.postMessage({id: data.id, ...done}, {transfer: [done.body.buffer]});
    });
  }
};
