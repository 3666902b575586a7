// The page's downloads without a browser: each request with each fault of a network or a disk, in the same visit, the next one, and
// offline afterwards. Required everywhere: the right bytes or an error that the page has a sentence for, before the deadline.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import vm from 'node:vm';

const WEB = new URL('../../runtime/extensions/web/', import.meta.url);
const SCOPE = 'https://museum.example/';
const ADDRESS = 'bundles/demo.packed?v=1&first=';
/** Virtual seconds in which a visitor has to have something; while the rest comes, something is shown already. */
const DEADLINE_S = 60, REST_S = 300;

// ---- a clock that jumps to the next timer, a network and a disk ----

const real = { setTimeout, setImmediate };
const clock = { now: 0, timers: new Map(), last: 0 };
Date.now = () => clock.now;
globalThis.setTimeout = (call, ms = 0) => {
  clock.timers.set(++clock.last, { at: clock.now + ms, call });
  return clock.last;
};
globalThis.clearTimeout = (timer) => clock.timers.delete(timer);

/** Bytes a second that a page waits for. */
const LEAST_RATE = 500;
let sent = 0;

/** What a promise comes to: {value} or {error}, within this many seconds, more where bytes come. It hangs where nothing is left to wait for. */
async function settle(promise, seconds) {
  const began = clock.now - (1000 * sent) / LEAST_RATE;
  const done = {};
  promise.then((value) => { done.value = value; done.over = true; }, (error) => { done.error = error; done.over = true; });
  for (;;) {
    // Node reads blobs in a thread: the clock jumps only after some turns without a result, and nothing "waits for ever" before 5 s.
    for (let i = 0; i < 8 && !done.over; ++i) await new Promise((resolve) => { real.setImmediate(resolve); });
    for (let i = 0; i < 5000 && !done.over && clock.timers.size === 0; ++i) await new Promise((resolve) => { real.setTimeout(resolve, 1); });
    if (done.over) return done;
    const next = [...clock.timers].sort(([, a], [, b]) => a.at - b.at)[0];
    assert.ok(next, 'it waits for ever');
    clock.timers.delete(next[0]);
    clock.now = Math.max(clock.now, next[1].at);
    assert.ok(clock.now - (1000 * sent) / LEAST_RATE - began <= 1000 * seconds, `nothing within ${seconds} s`);
    next[1].call();
  }
}

class Disk {
  names = new Map();
  /** Writes that still fit, and whether anything is answered. */
  room = Infinity;
  hangs = false;

  #cache(name) {
    const files = this.names.get(name) ?? this.names.set(name, new Map()).get(name);
    const key = (request) => new URL(request.url ?? request, SCOPE).href;
    const plain = (address) => address.split('?')[0];
    const found = (request, ignoreSearch) => [...files.keys()].find((each) => (ignoreSearch ? plain(each) === plain(key(request)) : each === key(request)));
    const answer = async (value) => (this.hangs ? new Promise(() => {}) : value());
    return {
      match: (request, { ignoreSearch } = {}) => answer(() => {
        const kept = files.get(found(request, ignoreSearch));
        return kept && new Response(kept.bytes.slice(), { headers: kept.headers });
      }),
      put: async (request, response) => {
        const bytes = new Uint8Array(await response.arrayBuffer());
        return answer(() => {
          if (this.room-- <= 0) throw new DOMException('no room', 'QuotaExceededError');
          files.set(key(request), { bytes, headers: [...response.headers] });
        });
      },
      delete: (request, { ignoreSearch } = {}) => answer(() => files.delete(found(request, ignoreSearch))),
      keys: () => answer(() => [...files.keys()].map((url) => ({ url }))),
    };
  }

  caches = {
    open: async (name) => (this.hangs ? new Promise(() => {}) : this.#cache(name)),
    keys: async () => [...this.names.keys()],
    has: async (name) => this.names.has(name),
    delete: async (name) => this.names.delete(name),
    match: async (request, { cacheName, ...options } = {}) => {
      for (const name of cacheName ? [cacheName] : this.names.keys()) {
        const found = await this.#cache(name).match(request, options);
        if (found) return found;
      }
      return undefined;
    },
  };
}

/** Answers with bytes up to `at`, then `end`: 'reset', 'stall' or 'drip' (a byte a second). */
function answer(status, headers, bytes, signal, { at = bytes.length, end = '' } = {}) {
  let from = 0;
  const some = (size) => {
    sent += size;
    from += size;
    return Uint8Array.from(bytes.subarray(from - size, from));
  };
  const body = new ReadableStream({
    start(controller) { signal?.addEventListener('abort', () => { try { controller.error(new DOMException('aborted', 'AbortError')); } catch {} }); },
    async pull(controller) {
      if (from < Math.min(at, bytes.length)) return controller.enqueue(some(Math.min(1 << 18, at - from, bytes.length - from)));
      if (end === 'reset') return controller.error(new TypeError('network error'));
      if (end === 'stall') return new Promise(() => {});
      if (from === bytes.length) return controller.close();
      await new Promise((resolve) => { setTimeout(resolve, 1000); });
      return controller.enqueue(some(1));
    },
  }, { highWaterMark: 0 });
  return new Response(body, { status, headers });
}

const HTML = new TextEncoder().encode(`<!doctype html><title>Log in</title>${' '.repeat(5000)}`);

/** As a good server answers, up to cut. */
function good(file, { headers = {}, signal }, { ranges = true, cut } = {}) {
  const [, first, last] = (ranges && /^bytes=(\d+)-(\d*)$/.exec(headers.Range)) || [];
  if (first === undefined) return answer(200, { 'content-length': file.length }, file, signal, cut);
  if (Number(first) >= file.length) return answer(416, {}, new Uint8Array(), signal);
  const end = Math.min(last ? Number(last) + 1 : file.length, file.length);
  const body = file.subarray(Number(first), end);
  return answer(206, { 'content-range': `bytes ${first}-${end - 1}/${file.length}`, 'content-length': body.length }, body, signal, cut);
}

/** The same bytes in another order. */
const turned = (file) => Buffer.concat([file.subarray(9), file.subarray(0, 9)]);

/** name: what a server answers instead: (file, options of fetch) => Response, or throws. */
const FAULTS = {
  404: () => new Response('none', { status: 404 }),
  403: () => new Response('no', { status: 403 }),
  503: () => new Response('later', { status: 503 }),
  204: () => new Response(null, { status: 204 }),
  'no connection': () => { throw new TypeError('Failed to fetch'); },
  'no answer': (_, { signal }) => new Promise((_, reject) => { signal.addEventListener('abort', () => reject(new TypeError('aborted'))); }),
  'the page of a hotel': (_, { signal }) => answer(200, { 'content-type': 'text/html; charset=utf-8' }, HTML, signal),
  'nothing, though all is well': (_, { signal }) => answer(200, { 'content-length': 0 }, new Uint8Array(), signal),
  'all of it instead of a range': (file, options) => good(file, options, { ranges: false }),
  'another range than asked for': (file, options) => good(file, { ...options, headers: { Range: 'bytes=7-5000' } }),
  'other bytes under the right range': (file, options) => good(turned(file), options),
  'a file of another size': (file, options) => good(new Uint8Array(file.length + 5), options),
  ...Object.fromEntries(['reset', 'stall', 'drip'].flatMap((end) => [0, 1, 30000, 1e6].map((at) =>
    [`${end} at byte ${at}`, (file, options) => good(file, options, { cut: { at, end } })]))),
};

/** A world: files, a fault of the requests that `when` names (by their number, from 0), a disk. */
function world(files, fault, when = () => true) {
  const made = { requests: 0, offline: false, healthy: false, disk: new Disk(), asked: [] };
  globalThis.fetch = async (request, options = {}) => {
    const address = request.url ?? String(request);
    const asked = { headers: {}, cache: request.cache, ...options };
    made.asked.push({ address, cache: asked.cache, range: asked.headers.Range });
    assert.ok(made.asked.length < 500, 'a storm of requests');
    if (made.offline) throw new TypeError('Failed to fetch');
    const file = files[new URL(address, SCOPE).pathname.slice(1)];
    const number = made.requests++;
    if (!file) return new Response('none', { status: 404 });
    return fault && !made.healthy && when(number, asked) ? FAULTS[fault](file, asked) : good(file, asked);
  };
  globalThis.caches = made.disk.caches;
  return made;
}

/** No part is empty, and a sum is that of its parts: answers it, or 0 where not all is there. */
function checkStored(disk) {
  const kept = disk.names.get(`modar ${SCOPE} downloads`) ?? new Map();
  let sum = 0;
  for (const [address, { bytes }] of kept) {
    assert.ok(bytes.length > 0, `${address} is empty`);
    if (address.includes('&part=')) sum += bytes.length;
  }
  for (const [address, { bytes }] of kept) {
    if (!address.endsWith('&sum')) continue;
    assert.equal(Number(new TextDecoder().decode(bytes)), sum);
    return sum;
  }
  return 0;
}

// ---- a packed bundle, and a decoder that knows its pieces ----

const { Arrival, isPacked, STAGE } = await import(new URL('arrival.js', WEB));
const { Copy, isRotten } = await import(new URL('copy.js', WEB));
const { fetchBytes, NEXT, Source } = await import(new URL('download.js', WEB));
const { ModarError } = await import(new URL('engine.js', WEB));
const { LodStream } = await import(new URL('lod-stream.js', WEB));

const STAGES = [[1, 60000], [1, 70000], [2, 90000], ...Array.from({ length: 17 }, () => [3, 256 << 10])];
const RECIPE = 64 + 64 * STAGES.length;

function makeBundle() {
  const file = new Uint8Array(RECIPE + STAGES.reduce((sum, [, size]) => sum + size, 0));
  const view = new DataView(file.buffer);
  file.set([0x89, 0x4d, 0x4f, 0x52, 0x0d, 0x0a, 0x1a, 0x0a]);
  view.setUint32(12, STAGES.length, true);
  view.setBigUint64(16, BigInt(file.length - RECIPE), true);
  for (let i = RECIPE; i < file.length; ++i) file[i] = (i * 2654435761) >>> 13;
  let at = 64, offset = 0;
  for (const [stage, size] of STAGES) {
    view.setBigUint64(at + 24, BigInt(offset), true);
    view.setUint32(at + 40, size, true);
    view.setUint32(at + 44, size, true);
    view.setUint8(at + 55, stage);
    offset += size;
    at += 64;
  }
  return file;
}

const BUNDLE = makeBundle();
const FIRST = RECIPE + 220000;
const same = (a, b) => Buffer.compare(a, b) === 0;

/** In place of the worker: pieces that are not the bundle's are refused, as by their hash. */
const decoder = () => {
  const refuse = (code) => { throw new ModarError({ code, cause: 'its hash is wrong' }); };
  return {
    async ask({ type, bytes, index, stored }) {
      const from = RECIPE + STAGES.slice(0, index).reduce((sum, [, size]) => sum + size, 0);
      if (type === 'recipe' && !same(bytes, BUNDLE.subarray(0, RECIPE))) refuse('recipe.hash');
      if (type === 'piece' && !same(stored, BUNDLE.subarray(from, from + STAGES[index][1]))) refuse('piece.hash');
      return { bytes: stored?.slice() };
    },
    close() {},
  };
};

/** What the page does with a bundle: {shown, whole}: promises. Wrong states of the source fail the test. */
function open(copy, cache) {
  const got = new Uint8Array(BUNDLE.length - RECIPE);
  const take = (offset, bytes) => got.set(bytes, offset);
  const source = new Source(ADDRESS + FIRST, { copy, cache });
  let state = source.state;
  Object.defineProperty(source, 'state', {
    get: () => state,
    set(next) {
      assert.ok(next === 'closed' || NEXT[state].includes(next), `${state} became ${next}`);
      state = next;
    },
  });
  let arrival;
  const begun = (async () => {
    const start = await source.take(8);
    if (!isPacked(start)) throw new ModarError({ code: 'bundle.magic', cause: 'this is no bundle' });
    arrival = new Arrival(source, decoder);
    await arrival.begin(start);
    for (const { offset, bytes } of arrival.found) take(offset, bytes);
    await arrival.download(STAGE.show, take);
  })();
  const whole = begun.then(() => arrival.download(STAGE.refine, take)).then(() => got);
  whole.catch(() => {});
  const close = () => source.close();
  return { begun, whole, close };
}

/** A visit: 'whole', 'shown' where the rest failed, or the error; and once more from the network where stored bytes are refused. */
async function visit(cache = 'default') {
  const made = (await settle(Copy.of(SCOPE, ADDRESS + FIRST), 10)).value;
  const { begun, whole, close } = open(made, cache);
  const shown = await settle(begun, DEADLINE_S);
  const all = shown.error ? shown : await settle(whole, REST_S);
  close();
  if (made) await settle(made.written.catch(() => {}), 10);
  if (all.error && isRotten(all.error) && cache === 'default') {
    await settle(made?.forget() ?? Promise.resolve(), 10);
    return visit('reload');
  }
  if (!all.error) assert.ok(same(all.value, BUNDLE.subarray(RECIPE)), 'other bytes');
  return all.error ?? 'whole';
}

/** Codes for which the page has a sentence of its own: BY_CODE of modar-viewer.js, and 'bundle' for damage. */
function assertSentence(error) {
  assert.ok(error instanceof ModarError, String(error?.stack ?? error));
  assert.match(error.code, /^(web\.(download|login|changed)|bundle\.|recipe\.|piece\.)/);
  assert.ok(error.reason.length > 5);
}

const MOMENTS = { always: () => true, first: (n) => n === 0, second: (n) => n === 1, third: (n) => n === 2, 'from the third on': (n) => n >= 2 };

for (const fault of Object.keys(FAULTS)) {
  test(`a bundle, ${fault}`, async () => {
    for (const [name, when] of Object.entries(MOMENTS)) {
      for (const room of ['always', 'first'].includes(name) ? [Infinity, 0, 2] : [Infinity]) {
        for (const offline of [false, true]) {
          const here = `${name}, room for ${room}, ${offline ? 'offline' : 'online'} afterwards`;
          const made = world({ 'bundles/demo.packed': BUNDLE }, fault, when);
          made.disk.room = room;
          const seen = await visit();
          if (seen !== 'whole') assertSentence(seen);
          if (['first', 'second', 'third'].includes(name)) assert.equal(seen, 'whole', `${here}: one fault is repaired`);
          const stored = checkStored(made.disk);
          if (seen === 'whole' && room === Infinity && !/other bytes/.test(fault)) assert.equal(stored, BUNDLE.length, here);
          made.healthy = true;
          made.offline = offline;
          const after = await visit();
          if (after !== 'whole') assertSentence(after);
          if (!offline || stored === BUNDLE.length) assert.equal(after, 'whole', here);
          checkStored(made.disk);
          made.offline = false;
          assert.equal(await visit(), 'whole', here);
        }
      }
    }
  });
}

test('what broken pages have stored is discarded, and what hangs is not waited for', async () => {
  const stored = {
    'an empty part': { '&part=0': '' }, 'a sum of nothing': { '': '0', '&sum': '0', '&part=0': '' }, 'a page': { '&part=0': HTML },
    'an empty part behind a good one': { '&part=0': BUNDLE.slice(0, 1e6), '&part=1000000': '' },
    'another version': { '&part=0': turned(BUNDLE.subarray(0, 1e6)) }, 'a sum without parts': { '': String(BUNDLE.length), '&sum': String(BUNDLE.length) },
    'a bad part behind a good one': { '&part=0': BUNDLE.slice(0, 1e6), '&part=1000000': new Uint8Array(1e6) },
  };
  for (const [what, parts] of Object.entries(stored)) {
    const made = world({ 'bundles/demo.packed': BUNDLE });
    const cache = await made.disk.caches.open(`modar ${SCOPE} downloads`);
    for (const [name, bytes] of Object.entries(parts)) await cache.put(`${ADDRESS}${FIRST}${name}`, new Response(bytes));
    assert.equal(await visit(), 'whole', what);
    assert.equal(await visit(), 'whole', what);
    made.offline = true;
    assert.equal(await visit(), 'whole', `${what}: all of it is stored now`);
    checkStored(made.disk);
  }
  const made = world({ 'bundles/demo.packed': BUNDLE });
  made.disk.hangs = true;
  assert.equal(await visit(), 'whole');
});

test('a bad answer that the browser has kept is not asked for again', async () => {
  for (const fault of ['404', 'the page of a hotel', 'nothing, though all is well', 'other bytes under the right range']) {
    world({ 'bundles/demo.packed': BUNDLE }, fault, (_, { cache }) => cache === 'default');
    assert.equal(await visit(), 'whole', fault);
  }
});

test('small files: bytes or a sentence', async () => {
  const file = new TextEncoder().encode('{"title": "A museum"}');
  for (const fault of Object.keys(FAULTS)) {
    for (const when of [() => true, (n) => n === 0]) {
      const made = world({ 'site.json': file }, fault, when);
      const first = await settle(fetchBytes('site.json'), DEADLINE_S);
      if (first.error) assertSentence(first.error);
      made.healthy = true;
      assert.ok(same((await settle(fetchBytes('site.json'), DEADLINE_S)).value, file), fault);
    }
  }
});

// ---- levels that come when they are seen ----

function engineWith(wanted) {
  const heap = new Uint8Array(256);
  const put = new Map();
  const numbers = (...values) => { new Uint32Array(heap.buffer, 64, values.length).set(values); return 64; };
  const module = {
    HEAPU8: heap, _web_keep: () => 0, _web_kept: (i) => (i === 0 ? numbers(0, 1000) : 0), _web_show_wanted: () => 0,
    _web_open_wanted: () => (wanted.length > 0 ? numbers(...wanted.shift()) : 0), _web_fill() {}, _web_have: (number) => put.set(number, true),
  };
  return { module, check() {}, put: (offset, bytes) => put.set(`kept ${offset}`, bytes.length), frameBuffer: (size) => new Uint8Array(size), put_: put };
}

test('levels: they come, or an error ends it', async () => {
  for (const fault of Object.keys(FAULTS)) {
    for (const [name, when] of Object.entries({ always: () => true, once: (n) => n === 1, 'from the third on': (n) => n >= 2, 'by and by': (n) => n % 2 === 1 })) {
      const made = world({ 'bundles/demo.packed': BUNDLE }, fault, when);
      const pieces = STAGES.map(([, size], i) => {
        const offset = STAGES.slice(0, i).reduce((sum, [, each]) => sum + each, 0);
        return { at: RECIPE + offset, stored: size, offset, size };
      });
      const { part, closed } = new Source(ADDRESS + FIRST).leave();
      const engine = engineWith([[5, pieces[9].offset, 1000], [6, pieces[12].offset, 300000]]);
      const decode = async (piece, stored) => {
        if (!same(stored, BUNDLE.subarray(piece.at, piece.at + piece.stored))) throw new ModarError({ code: 'piece.hash', cause: 'its hash is wrong' });
        return stored.slice();
      };
      let failed;
      const ended = new Promise((resolve) => { failed = resolve; });
      const wanted = new LodStream(engine, { part, closed, pieces, first: 0, decode }, () => {}, failed);
      const begun = await settle(wanted.begin(), 1000);
      if (begun.error) assertSentence(begun.error);
      if (begun.value !== true) continue;  // all of it is downloaded in the ordinary way
      const all = new Promise((resolve) => { const look = () => { wanted.use(); if (engine.put_.has(5) && engine.put_.has(6)) resolve('all'); else setTimeout(look, 1000); }; look(); });
      wanted.ask();
      const end = (await settle(Promise.race([all, ended]), 1000)).value;
      if (end !== 'all') assertSentence(end);
      if (name === 'once') assert.equal(end, 'all', fault);
      assert.ok(made.asked.length < 100, `${made.asked.length} requests`);
      clock.timers.clear();
    }
  }
});

// ---- the service worker ----

const FILES = {
  'index.html': HTML, 'app.js': new TextEncoder().encode('export {};'), 'engine-simd.wasm': BUNDLE.slice(0, 90000), 'patterns/a.jpg': BUNDLE.slice(0, 5000),
  'words/en.json': new TextEncoder().encode('{}'), 'bundles/demo.packed': BUNDLE,
};

/** sw.js as a browser runs it: {fire(type, event): its waitUntil() or respondWith()}. */
function serviceWorker(hash = '1') {
  const listeners = {};
  const registration = { scope: SCOPE, active: null };
  class Request_ {
    constructor(file, { cache = 'default' } = {}) { Object.assign(this, { url: new URL(file, SCOPE).href, cache, method: 'GET', headers: new Headers() }); }
  }
  const files = Object.fromEntries(Object.entries(FILES).map(([name, { length }]) =>
    [name.startsWith('bundles/') ? ADDRESS + FIRST : name, /html|jpg/.test(name) ? 0 : length]));
  const typed = async (request, options) => {
    const response = await fetch(request, options);
    const html = /(\/|html)$/.test(request.url);
    return response.status === 200 && html ? new Response(response.body, { headers: { 'content-type': 'text/html' } }) : response;
  };
  const context = {
    self: { registration, addEventListener: (type, call) => { listeners[type] = call; } }, caches, fetch: typed, WebAssembly, Uint8Array, Response, Blob, Request: Request_,
    AbortController, setTimeout, clearTimeout, Promise, Error,
  };
  vm.runInNewContext(`const SITE = ${JSON.stringify({ hash, files })};\n${readFileSync(new URL('sw.js', WEB), 'utf8')}`, context);
  return {
    registration,
    fire(type, event = {}) {
      let waited;
      const take = (promise) => { waited = Promise.resolve(promise); };
      listeners[type]({ waitUntil: take, respondWith: take, ports: [], ...event });
      return waited;
    },
    ask(file, cache = 'default', range) {
      const request = new Request_(file, { cache });
      if (range) request.headers.set('range', range);
      return this.fire('fetch', { request });
    },
  };
}

/** All that is kept is what the site has. */
function checkKept(disk) {
  for (const [address, { bytes }] of disk.names.get(`modar ${SCOPE} 1`) ?? []) {
    const file = FILES[new URL(address).pathname.slice(1) || 'index.html'];
    assert.ok(same(bytes, file), `${address} is kept as ${bytes.length} bytes of ${file.length}`);
  }
}

test('the service worker keeps whole files or nothing, and the next visit keeps the rest', async () => {
  const site = { ...FILES, '': HTML };
  for (const fault of Object.keys(FAULTS).filter((each) => !/other bytes/.test(each))) {
    for (const which of [...Object.keys(FILES).filter((file) => file !== 'index.html'), null]) {
      for (const room of [Infinity, 3]) {
        const when = (_, asked) => which === null || made.asked.at(-1).address.includes(which);
        const made = world(site, fault, when);
        made.disk.room = room;
        const worker = serviceWorker();
        const kept = await settle(worker.fire('install'), 2000);
        if (room < Infinity) assert.ok(kept.error, 'a page that is kept in part is not used');
        await settle(worker.fire('message'), 2000);
        if (fault !== 'a file of another size') checkKept(made.disk);  // of a picture, no size is stated
        made.healthy = true;
        made.disk.room = Infinity;
        const next = serviceWorker();
        assert.equal((await settle(next.fire('install'), 600)).error, undefined);
        await settle(next.fire('message'), 600);
        checkKept(made.disk);
        made.offline = true;
        for (const file of ['', ...Object.keys(FILES)]) {
          const bytes = new Uint8Array(await (await settle(next.ask(file), 10)).value.arrayBuffer());
          assert.ok(same(bytes, site[file]), `${fault}: ${file} offline`);
        }
      }
    }
  }
});

test('the service worker takes the downloads of a visit, and skips unreadable ones', async () => {
  const made = world({ ...FILES, '': HTML });
  assert.equal(await visit(), 'whole');
  const asked = made.asked.length;
  const worker = serviceWorker();
  await settle(worker.fire('install'), 60);
  await settle(worker.fire('message'), 60);
  assert.equal(made.asked.slice(asked).filter(({ address }) => address.includes('bundles/')).length, 0, 'downloaded once');
  assert.equal(made.disk.names.has(`modar ${SCOPE} downloads`), false);
  checkKept(made.disk);
  // Ranges of stored files.
  for (const [range, status, length] of [['bytes=5-14', 206, 10], ['bytes=9-', 206, BUNDLE.length - 9], [`bytes=${BUNDLE.length}-`, 416, 0], ['bytes=-5', 200, BUNDLE.length]]) {
    const { value } = await settle(worker.ask(ADDRESS + FIRST, 'default', range), 10);
    assert.deepEqual([value.status, (await value.arrayBuffer()).byteLength], [status, length], range);
  }
  // Damaged files are requested again: then the network comes first, then stored files.
  const status = async (cache) => (await settle(worker.ask(ADDRESS + FIRST, cache), 10)).value.headers.get('content-length');
  made.disk.names.get(`modar ${SCOPE} 1`).get(new URL(ADDRESS + FIRST, SCOPE).href).headers.push(['x-kept', 'yes']);
  const isKept = async (cache) => (await settle(worker.ask(ADDRESS + FIRST, cache), 10)).value.headers.get('x-kept');
  assert.deepEqual([await isKept('default'), await isKept('reload')], ['yes', null]);
  made.offline = true;
  assert.equal(await isKept('reload'), 'yes');
  made.offline = false;
  made.disk.caches.match = async () => { throw new Error('the disk is damaged'); };
  assert.equal(await isKept('default'), null);
  assert.ok(await status('default'));
});
