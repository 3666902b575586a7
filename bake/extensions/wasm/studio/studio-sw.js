// @ts-check
// The service worker of the static studio: requests to `api/` go to the page's worker, all others to the copies of the page's own
// files, so that the studio opens without a network after the first visit.
const VERSION = 'MODAR_STUDIO_VERSION';
/** @type {any} */
const scope = self;

/**
 * Keeps copies of the page's files, which the page waits for, or of all.
 * @param {boolean} all
 */
async function keep(all) {
  const cache = await caches.open(VERSION);
  const names = ['./', ...await (await fetch('files.json', {cache: 'no-cache'})).json()];
  for (const name of names) {
    if (!all && /^(baker|engine)\//.test(name)) continue;
    if (!await cache.match(name)) await cache.add(name);
  }
}

scope.addEventListener('install', (/** @type {any} */ event) => {
  event.waitUntil(keep(false).then(() => scope.skipWaiting()));
});

scope.addEventListener('message', (/** @type {any} */ event) => {
  if (event.data.keep) event.waitUntil(keep(true));
});

scope.addEventListener('activate', (/** @type {any} */ event) => {
  event.waitUntil((async () => {
    for (const name of await caches.keys()) {
      if (name.startsWith('modar-studio ') && name !== VERSION) await caches.delete(name);
    }
    await scope.clients.claim();
  })());
});

const CLOSED = {
  error: 'no tab of this browser has the studio open',
  cure: 'open the studio, and try again',
  code: 'studio.closed',
};

/** Milliseconds in which the tab that has the project says so. */
const OWNER_MS = 20_000;
/** Of the tab that has the project, while it lives. */
let ownerId = '';

/** @returns {Promise<any>} the tab that has the project */
async function owner() {
  const known = ownerId && await scope.clients.get(ownerId);
  if (known) return known;
  const tabs = await scope.clients.matchAll({type: 'window'});
  const asked = tabs.map((/** @type {any} */ tab) => new Promise((resolve) => {
    const {port1, port2} = new MessageChannel();
    port1.onmessage = () => resolve(tab);
    tab.postMessage({owner: true}, [port2]);
  }));
  const tab = await Promise.race([...asked, new Promise((resolve) => { setTimeout(resolve, OWNER_MS); })]);
  if (tab) ownerId = tab.id;
  return tab;
}

/**
 * @param {Request} request
 * @param {string} path below the page's folder
 * @param {URLSearchParams} query
 */
async function ask(request, path, query) {
  const call = {
    method: request.method,
    path,
    query: Object.fromEntries([...query].reverse()),  // the first of each name
    body: request.method === 'POST' ? await request.text() : '',
    upload: request.method === 'PUT' ? await request.blob() : undefined,
  };
  const tab = await owner();
  if (!tab) return new Response(JSON.stringify(CLOSED), {status: 503, headers: {'Content-Type': 'application/json'}});
  const {status, type, headers, body} = await new Promise((resolve) => {
    const {port1, port2} = new MessageChannel();
    port1.onmessage = ({data}) => resolve(data);
    tab.postMessage({call}, [port2]);
  });
  return new Response(body, {status, headers: {...headers, 'Content-Type': type}});
}

scope.addEventListener('fetch', (/** @type {any} */ event) => {
  const url = new URL(event.request.url);
  const root = new URL('./', scope.location.href).href;
  if (!url.href.startsWith(root)) return;
  const path = decodeURIComponent(url.pathname).slice(new URL(root).pathname.length);
  if (path.startsWith('api/')) return event.respondWith(ask(event.request, path, url.searchParams));
  if (event.request.method !== 'GET') return;
  event.respondWith((async () => await caches.match(event.request, {cacheName: VERSION, ignoreSearch: true}) ?? fetch(event.request))());
});
