// @ts-check
// Starts the studio of a static page: its worker in the place of the server, and a service worker that passes the page's requests
// on to it. One tab at a time has the project.
import {chosen, choose, mayWrite, Projects} from './studio-projects.js';
import {said, firstLanguage, t, useLanguage} from './words.js';

/** Of baker.wasm: written in by studio.sh. */
const PROGRAM_BYTES = Number('MODAR_PROGRAM_BYTES');
const LOST = {
  error: 'this browser gives pages no place for files: what you make is lost when the page is closed',
  cure: 'export the project before, or open the studio in a usual window',
  code: 'studio.private',
};
const end = () => /** @type {HTMLElement} */ (document.getElementById('studio'));

/**
 * @param {string} key of the words
 * @param {Record<string, unknown>} [values]
 * @param {Record<string, () => unknown>} [actions] by the keys of their buttons' words
 */
function say(key, values, actions = {}) {
  const main = document.createElement('main');
  main.className = 'end';
  const told = main.appendChild(document.createElement('p'));
  told.textContent = t(`static.${key}`, values);
  for (const [name, action] of Object.entries(actions)) {
    const button = main.appendChild(document.createElement('button'));
    button.textContent = t(`static.${name}`, values);
    button.onclick = action;
  }
  end().replaceChildren(main);
}

/** @type {EventTarget} */
const events = new EventTarget();

/** What app.js opens: the worker's events in the place of a server's. */
class WorkerEvents extends EventTarget {
  onopen = null;
  onerror = null;
  constructor() {
    super();
    events.addEventListener('told', (event) => {
      const {name, data} = /** @type {CustomEvent<{name: string, data: string}>} */ (event).detail;
      this.dispatchEvent(new MessageEvent(name, {data}));
    });
  }
}

/** The tab keeps the lock while it lives. */
const lock = () => new Promise((resolve) => {
  navigator.locks.request('modar-studio', {ifAvailable: true}, (granted) => {
    resolve(granted !== null);
    return granted && new Promise(() => {});
  });
});

async function openServiceWorker() {
  await navigator.serviceWorker.register('studio-sw.js');
  await navigator.serviceWorker.ready;
  if (navigator.serviceWorker.controller) return;
  await new Promise((resolve) => { navigator.serviceWorker.addEventListener('controllerchange', resolve, {once: true}); });
}

/** The program, and on the page how much of it has come. */
async function loadProgram() {
  const response = await fetch('baker/baker.wasm');
  if (!response.ok || !response.body) throw new Error(`baker/baker.wasm: the server answered ${response.status}`);
  const reader = response.body.getReader();
  /** @type {Uint8Array[]} */
  const parts = [];
  let bytes = 0;
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    parts.push(part.value);
    bytes += part.value.length;
    say('loading', {done: (bytes / 1e6).toFixed(1), all: (PROGRAM_BYTES / 1e6).toFixed(1)});
  }
  return new Blob(parts).arrayBuffer();
}

/** Messages of the worker that no request has asked for: the last one waits until the page is there. */
/** @type {any} */
let notice = null;
let tell = (/** @type {any} */ told) => { notice = told; };

/**
 * @param {import('./studio-projects.js').Chosen} project
 * @returns {Promise<boolean>} whether it keeps files
 */
async function openWorker(project) {
  const worker = new Worker(new URL('./studio-worker.js', import.meta.url), {type: 'module'});
  /** @type {Map<number, MessagePort>} requests of the service worker that wait */
  const waiting = new Map();
  let last = 0;
  navigator.serviceWorker.addEventListener('message', ({data, ports}) => {
    if (data.owner) return ports[0].postMessage({});
    if (!data.call) return;
    waiting.set(++last, ports[0]);
    worker.postMessage({id: last, call: data.call});
  });
  navigator.serviceWorker.startMessages();
  worker.postMessage({program: await WebAssembly.compile(await loadProgram()), chosen: project});
  return new Promise((resolve, reject) => {
    worker.onmessage = ({data}) => {
      if (data.ready) resolve(data.kept);
      if (data.notice) tell(data.notice);
      if (data.error) reject(new Error(data.error));
      for (const detail of data.events ?? []) events.dispatchEvent(new CustomEvent('told', {detail}));
      if (data.id === undefined) return;
      waiting.get(data.id)?.postMessage(data, [data.body.buffer]);
      waiting.delete(data.id);
    };
    worker.onerror = (event) => reject(new Error(event.message));
  });
}

/**
 * Of a granted folder, browsers ask the person again in each visit, on a press of a button alone.
 * @param {import('./studio-projects.js').Chosen} project
 */
async function getLeave({folder, name}) {
  if (!folder || await mayWrite(folder, 'queryPermission')) return;
  await new Promise((resolve) => {
    const grant = async () => { if (await mayWrite(folder, 'requestPermission')) resolve(undefined); };
    say('grant', {name}, {open: grant, own: () => choose('project')});
  });
}

/** The page, on what the worker answers. */
async function openPage(/** @type {import('./studio-projects.js').Chosen} */ project, /** @type {boolean} */ kept) {
  Object.assign(globalThis, {EventSource: WorkerEvents, modarStatic: {kept, chosen: project, Projects}});
  await import(new URL('./app.js', import.meta.url).href);
  const state = await import('./state.js');
  tell = (wrong) => { const {text, ...more} = said(wrong); state.tell(text, {...more, bad: true}); };
  if (!kept) tell(LOST);
  if (notice) tell(notice);
}

async function begin() {
  await useLanguage(firstLanguage());
  if (!navigator.serviceWorker || !navigator.locks) return say('browser');
  if (!await lock()) return say('tab');
  try {
    const project = await chosen();
    await getLeave(project);
    await openServiceWorker();
    const kept = await openWorker(project);
    await openPage(project, kept);
    navigator.storage?.persist?.().catch(() => {});  // Firefox asks the person, who need not answer
    navigator.serviceWorker.controller?.postMessage({keep: true});
  } catch (error) {
    if (error instanceof DOMException && error.name === 'SecurityError') say('browser');
    else say('failed', {why: error instanceof Error ? error.message : String(error)}, {again: () => location.reload(), own: () => choose('project')});
  }
}

begin();
