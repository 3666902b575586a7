// Keeps the page for visits without a network. `modar web` writes a line before this one: SITE, with
// the folder's files and a hash of them all. A new hash is a new site: it is fetched whole, and takes
// the place of the old one when all of it is there and no page of the old one is open.
const OURS = `modar ${self.registration.scope} `;  // other sites may live on the same host
const CACHE = OURS + SITE.hash;
const INSTALLED = `${OURS}installed`;  // by updates, see installed.js
const BROUGHT = `${OURS}brought`;  // bundles that a first visit has brought, see app.js
/** As in engine.js: of the two builds of the engine, only the one that will run is kept. */
const SIMD = WebAssembly.validate(Uint8Array.of(
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 8, 1, 6, 0, 65, 0, 253, 15, 11));

/** What a first visit has brought of an address: in parts, whose sum was written last. */
async function broughtOf({ url }) {
  const match = (address) => caches.match(address, { cacheName: BROUGHT });
  const size = await (await match(url))?.text();
  const parts = [];
  for (let at = 0; at < size; at += parts.at(-1).size) parts.push(await (await match(`${url}&part=${at}`)).blob());
  return parts.length > 0 && new Response(new Blob(parts));
}

/** Brings the page or, where that is kept, its bundles. */
async function keep(bundles) {
  const other = SIMD ? 'plain.' : 'simd.';
  const files = SITE.files.filter((file) => file.startsWith('bundles/') === bundles && !file.startsWith(`engine-${other}`) &&
    !file.startsWith(`engine-record-${other}`));
  // Past the browser's own cache, where files of an older site may lie; but what has its hash in its address is the
  // same wherever it lies, and the page has just loaded it.
  const cacheOf = (file) => (file.includes('?v=') ? 'force-cache' : 'no-cache');
  const requests = [...(bundles ? [] : ['./']), ...files].map((file) => new Request(file, { cache: cacheOf(file) }));
  const cache = await caches.open(CACHE);
  const missing = [];
  for (const request of requests) {
    if (bundles && await cache.match(request)) continue;
    const there = await broughtOf(request);
    if (there) await cache.put(request, there);
    else missing.push(request);
  }
  await cache.addAll(missing);
}

// A first visit's bundle is still coming; of a new site all is there before it takes the place of the old one.
self.addEventListener('install', (event) => event.waitUntil(keep(false).then(() => self.registration.active && keep(true))));

// What the visit has brought is there. A visitor may have deleted what was stored, and come back.
self.addEventListener('message', (event) => event.waitUntil(
  caches.has(CACHE).then((kept) => kept || keep(false)).catch((error) => caches.delete(CACHE).then(() => Promise.reject(error)))
    .then(() => keep(true)).then(() => caches.delete(BROUGHT)).catch(() => {}).then(() => event.ports[0]?.postMessage('done'))));

self.addEventListener('activate', (event) => {
  event.waitUntil(caches.keys().then((names) => Promise.all(
    names.filter((name) => name.startsWith(OURS) && name !== CACHE && name !== INSTALLED && name !== BROUGHT).map((name) => caches.delete(name)))));
});

/** What is asked for of a file that is kept. */
async function part(kept, range) {
  const [, from, last] = /^bytes=(\d+)-(\d*)$/.exec(range);
  const whole = await kept.blob();
  const body = whole.slice(Number(from), last ? Number(last) + 1 : whole.size);
  const place = `bytes ${from}-${Number(from) + body.size - 1}/${whole.size}`;
  return new Response(body, { status: 206, headers: { 'Content-Range': place, 'Content-Length': body.size } });
}

self.addEventListener('fetch', (event) => {
  if (event.request.method !== 'GET') return;
  const range = event.request.headers.get('range');
  event.respondWith(caches.match(event.request, { cacheName: CACHE, ignoreSearch: true })
    .then((kept) => (kept && range ? part(kept, range) : kept ?? fetch(event.request))));
});
