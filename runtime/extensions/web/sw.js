// @ts-check
// Keeps the page for visits without a network. `modar web` writes a line before this one: SITE,
// with the folder's files, how many bytes each has (0: a host may change it), and a hash of them
// all. A new hash is a new site: it is fetched whole, and takes the place of the old one when all
// of it is there and no page of the old one is open.
const OURS = `modar ${self.registration.scope} `;  // other sites may live on the same host
const CACHE = OURS + SITE.hash;
const INSTALLED = `${OURS}installed`;  // by updates, see installed-release.js
const DOWNLOADS = `${OURS}downloads`;  // bundles that a first visit has downloaded, see copy.js
/**
 * Milliseconds that a file may take, and bytes of it for each more: missing parts are for the
 * next visit.
 */
const MOST_MS = 12e4, LEAST_BYTES_A_MS = 8;
/** As in engine.js: of the two builds of the engine, only the one that will run is kept. */
const SIMD = WebAssembly.validate(Uint8Array.of(
    0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 8, 1, 6, 0, 65, 0, 253, 15,
    11));

/**
 * The downloads of an address, if complete: in parts, whose sum was written last.
 * @param {Request} request
 */
async function downloadOf({url}) {
  const match = (/** @type {string} */ address) => caches.match(address, {cacheName: DOWNLOADS});
  const size = Number(await (await match(`${url}&sum`))?.text());
  const parts = [];
  let at = 0;
  while (at < size) {
    const part = await (await match(`${url}&part=${at}`))?.blob();
    if (!part?.size) return undefined;
    parts.push(part);
    at += part.size;
  }
  return at > 0 && at === size ? new Response(new Blob(parts)) : undefined;
}

/**
 * A file of the site: whole, and not the page of a network that wants a login.
 * @param {string} file
 * @param {number} bytes
 * @param {RequestCache} cache
 */
async function fetched(file, bytes, cache) {
  const abort = new AbortController();
  const late = setTimeout(() => abort.abort(), MOST_MS + bytes / LEAST_BYTES_A_MS);
  const response = await fetch(new Request(file, {cache}), {signal: abort.signal});
  const body = await response.blob();
  clearTimeout(late);
  const html = response.headers.get('content-type')?.startsWith('text/html') ?? false;
  const right = response.status === 200 && html === /(\/|html)$/.test(file) && body.size > 0 &&
      (bytes === 0 || body.size === bytes);
  if (right) return new Response(body, response);
  throw new Error(`${file} came as something else`);
}

/**
 * Serves the page or, where that is kept, its bundles: each as far as it comes.
 * @param {boolean} bundles
 */
async function keep(bundles) {
  const other = SIMD ? 'plain.' : 'simd.';
  const files = Object.keys(SITE.files)
                    .filter(
                        (file) => file.startsWith('bundles/') === bundles &&
                            !file.startsWith(`engine-${other}`) &&
                            !file.startsWith(`engine-record-${other}`));
  const cache = await caches.open(CACHE);
  const kept = await Promise.allSettled([...(bundles ? [] : ['./']), ...files].map(async (file) => {
    const request = new Request(file);
    if (bundles && await cache.match(request)) return;
    // Past the browser's own cache, where files of an older site may be; but a file with its hash
    // in its address is the same everywhere, and the page has just loaded it.
    const first = file.includes('?v=') ? 'force-cache' : 'no-cache';
    await cache.put(
        request,
        (bundles && await downloadOf(request)) ||
            await fetched(file, SITE.files[file] ?? 0, first)
                .catch(() => fetched(file, SITE.files[file] ?? 0, 'reload')));
  }));
  for (const {reason} of /** @type {PromiseRejectedResult[]} */ (kept))
    if (reason) throw reason;
}

// A first visit's bundle is still coming; of a new site all is there before it takes the place of
// the old one.
self.addEventListener(
    'install',
    (event) => event.waitUntil(keep(false).then(() => self.registration.active && keep(true))));

// The visit's downloads are there. A visitor may have deleted stored files, and come back.
self.addEventListener(
    'message',
    (event) => /** @type {MessageEvent & ExtendableEvent} */ (event).waitUntil(
        caches.has(CACHE)
            .then((kept) => kept || /** @type {Promise<unknown>} */ (keep(false)))
            .catch((error) => caches.delete(CACHE).then(() => Promise.reject(error)))
            .then(() => keep(true))
            .then(() => caches.delete(DOWNLOADS))
            .catch(() => {})
            .then(() => event.ports[0]?.postMessage('done'))));

self.addEventListener('activate', (event) => {
  event.waitUntil(caches.keys().then(
      (names) => Promise.all(names
                                 .filter(
                                     (name) => name.startsWith(OURS) && name !== CACHE &&
                                         name !== INSTALLED && name !== DOWNLOADS)
                                 .map((name) => caches.delete(name)))));
});

/**
 * The requested part of a stored file.
 * @param {Response} kept
 * @param {string} range
 */
async function part(kept, range) {
  const [, from, last] = /^bytes=(\d+)-(\d*)$/.exec(range) ?? [];
  if (!from) return kept;
  const whole = await kept.blob();
  const body = whole.slice(Number(from), last ? Number(last) + 1 : whole.size);
  if (body.size === 0) return new Response(null, {status: 416});
  const place = `bytes ${from}-${Number(from) + body.size - 1}/${whole.size}`;
  return new Response(
      body, {status: 206, headers: {'Content-Range': place, 'Content-Length': `${body.size}`}});
}

self.addEventListener('fetch', (event) => {
  const {request} = event;
  if (request.method !== 'GET') return;
  const range = request.headers.get('range');
  // undefined: nothing, or what cannot be read any more.
  const kept = () => caches.match(request, {cacheName: CACHE, ignoreSearch: true})
                         .then((found) => (found && range ? part(found, range) : found))
                         .catch(() => {});
  // Asked for again, because what came was no good: that may be the stored file.
  event.respondWith(
      request.cache === 'reload' ?
          fetch(request).catch(async (error) => await kept() ?? Promise.reject(error)) :
          kept().then((found) => found ?? fetch(request)));
});
