// @ts-check
// Starts the studio of a static page: its worker in the place of the server, and a service worker that passes the page's requests
// on to it. One tab at a time has the project.

/** @param {string} text */
function say(text) {
  const told = document.createElement('p');
  told.textContent = text;
  const main = document.createElement('main');
  main.className = 'end';
  main.append(told);
  document.getElementById('studio')?.replaceChildren(main);
}

const CAUSES = {
  tab: 'The studio is open in another tab of this browser. Close that one, and reload this page.',
  browser: 'This window keeps nothing: it is private, or the page does not come by HTTPS. Open it in a usual window.',
  memory: 'This browser gives pages no place for files: what you make is lost when the page is closed. Export the project before.',
};

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
    say(`The studio is loading, once: ${(bytes / 1e6).toFixed(1)} of 13 MB`);
  }
  return new Blob(parts).arrayBuffer();
}

/** @returns {Promise<boolean>} whether it keeps files */
async function openWorker() {
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
  worker.postMessage({program: await WebAssembly.compile(await loadProgram())});
  return new Promise((resolve, reject) => {
    worker.onmessage = ({data}) => {
      if (data.ready) resolve(data.kept);
      if (data.error) reject(new Error(data.error));
      for (const detail of data.events ?? []) events.dispatchEvent(new CustomEvent('told', {detail}));
      if (data.id === undefined) return;
      waiting.get(data.id)?.postMessage(data, [data.body.buffer]);
      waiting.delete(data.id);
    };
    worker.onerror = (event) => reject(new Error(event.message));
  });
}

async function begin() {
  if (!navigator.serviceWorker || !navigator.locks) return say(CAUSES.browser);
  if (!await lock()) return say(CAUSES.tab);
  try {
    await openServiceWorker();
    const kept = await openWorker();
    await navigator.storage?.persist?.();
    Object.assign(globalThis, {EventSource: WorkerEvents, modarStatic: {kept}});
    await import(new URL('./app.js', import.meta.url).href);
    navigator.serviceWorker.controller?.postMessage({keep: true});
    if (!kept) console.info(CAUSES.memory);
  } catch (error) {
    say(error instanceof DOMException && error.name === 'SecurityError' ? CAUSES.browser : `The studio cannot start: ${error}`);
  }
}

begin();
