// Brings what the page shows up to date with a release folder of `modar ship`, beside the page's life: all is checked
// before it is used, and what is in use stays until the new is whole and stored.
import load from './engine-update.js';
import { textsOf, titleOf } from './bundle.js';
import { Brought } from './download.js';
import { address, cacheName, installedRelease, isNewer, openStore } from './installed.js';

const STORE = '/store';
/** As modar-fetch reads of them at most. */
const LATEST_BYTES = 32;
const RELEASE_BYTES = 8 << 20;
/** Of pieces that are brought before the installer takes them: they lie in memory twice. */
const PORTION_BYTES = 16 << 20;

function pathsBelow(FS, folder) {
  return FS.readdir(folder).filter((name) => name !== '.' && name !== '..').flatMap((name) => {
    const path = `${folder}/${name}`;
    const { mode } = FS.lstat(path);
    return FS.isDir(mode) ? pathsBelow(FS, path) : FS.isFile(mode) ? [path] : [];
  });
}

async function restore(FS, cache, scope) {
  FS.mkdirTree(STORE);
  const base = address(scope, '');
  for (const request of await cache.keys()) {
    const path = `${STORE}/${decodeURIComponent(request.url.slice(base.length))}`;
    FS.mkdirTree(path.slice(0, path.lastIndexOf('/')));
    FS.writeFile(path, new Uint8Array(await (await cache.match(request)).arrayBuffer()));
  }
}

/** "slots/a"; empty where nothing is installed. */
function slotInUse(FS) {
  const current = `${STORE}/current`;
  if (!FS.analyzePath(current).exists) return '';
  const path = FS.isLink(FS.lstat(current).mode) ? FS.readlink(current) : FS.readFile(current, { encoding: 'utf8' });
  return path.trim().replace(`${STORE}/`, '');
}

/** Stores all files, `current` last, and drops those that are gone. */
async function save(FS, cache, scope) {
  const paths = pathsBelow(FS, STORE).map((path) => path.slice(STORE.length + 1))
    .filter((path) => path !== 'lock' && path !== 'current');
  const put = (path, bytes) => cache.put(address(scope, path), new Response(bytes));
  for (const path of paths) await put(path, FS.readFile(`${STORE}/${path}`));
  const slot = slotInUse(FS);
  if (slot) await put('current', `${slot}\n`);
  const kept = new Set([...paths, 'current'].map((path) => address(scope, path)));
  for (const { url } of await cache.keys()) {
    if (!kept.has(url)) await cache.delete(url);
  }
}

/** A gray picture as a BMP file, which every browser shows. */
function bmpOf(gray, width, height) {
  const stride = (width + 3) & ~3;
  const start = 54 + 4 * 256;
  const file = new Uint8Array(start + stride * height);
  const view = new DataView(file.buffer);
  file.set([0x42, 0x4d]);
  [[2, file.length], [10, start], [14, 40], [18, width], [22, height], [46, 256]].forEach(([at, value]) => view.setUint32(at, value, true));
  [[26, 1], [28, 8]].forEach(([at, value]) => view.setUint16(at, value, true));
  for (let level = 0; level < 256; ++level) file.fill(level, 54 + 4 * level, 57 + 4 * level);
  for (let y = 0; y < height; ++y) file.set(gray.subarray((height - 1 - y) * width, (height - y) * width), start + y * stride);
  return file;
}

/** The open bundle's patterns, their pictures put beside it. */
function describe(module, stem) {
  const { FS } = module;
  const texts = textsOf(JSON.parse(module.UTF8ToString(module._update_meta()) || '{}'));
  const patterns = [];
  for (let i = 0; ; ++i) {
    const named = module._update_pattern(i);
    if (named === 0) return patterns;
    const name = module.UTF8ToString(named);
    const pattern = { name, title: titleOf(name), image: `${stem}-${i}.bmp`, width: 0, height: 0, texts: texts[name] };
    const at = module._update_picture(i);
    if (at === 0) continue;
    pattern.width = module._update_picture_width();
    pattern.height = module._update_picture_height();
    const gray = module.HEAPU8.subarray(at, at + pattern.width * pattern.height);
    FS.writeFile(`${STORE}/${pattern.image}`, bmpOf(gray, pattern.width, pattern.height));
    patterns.push(pattern);
  }
}

/** page.json: what site.json has of bundles, with `installed` set. */
function writePage(module) {
  const { FS } = module;
  const slot = slotInUse(FS);
  for (const path of pathsBelow(FS, `${STORE}/${slot}`)) {
    if (path.endsWith('.bmp')) FS.unlink(path);  // of the release that the slot had before
  }
  const bundles = [];
  for (const path of pathsBelow(FS, `${STORE}/${slot}`)) {
    if (!path.endsWith('.modar') || module.ccall('update_open', 'number', ['string'], [path]) === 0) continue;
    const file = path.slice(STORE.length + 1);
    const name = file.slice(slot.length + 1, -'.modar'.length);
    const patterns = describe(module, `${slot}/${name}`);
    if (patterns.length > 0) {
      bundles.push({ title: titleOf(name), file, bytes: FS.stat(`${STORE}/${file}`).size, patterns, installed: true });
    }
  }
  FS.writeFile(`${STORE}/${slot}/page.json`, JSON.stringify({ bundles }));
}

/** Whether the server's newest release is what the page has: then nothing is to be believed. What cannot be read is not. */
async function isCurrent(files, cache, scope, { epoch, version, hashes }) {
  const number = (await files.text('latest', LATEST_BYTES))?.trim();
  if (!/^\d{1,16}$/.test(number ?? '')) return false;
  const release = await files.text(`releases/${number}.json`, RELEASE_BYTES);
  const installed = await installedRelease(cache, scope);
  if (!release) return false;
  if (installed && isNewer(installed.release, { epoch, version })) return installed.release === release;
  try {
    const wanted = JSON.parse(release).bundles.map(({ hash }) => hash);
    return wanted.length === hashes.length && wanted.every((hash) => hashes.includes(hash));
  } catch {
    return false;
  }
}

/** Brings what the installer asks for next, in portions; at least one file. */
async function bringNext(module, files) {
  let size = 0;
  for (let i = 0; i === 0 || size < PORTION_BYTES; ++i) {
    const named = module._update_need(i);
    if (named === 0) return;
    const from = module._update_need_from(i);
    const limit = module._update_need_limit(i);
    const path = module.UTF8ToString(named);
    await files.bring(path, from, limit);
    size += path.startsWith('objects/') ? limit - from : 0;
  }
}

async function run(module, files, { url, key, epoch, version }) {
  const words = ['string', 'string', 'string', 'number', 'number', 'number'];
  for (;;) {
    const done = module.ccall('update_run', 'number', words, [url, key, STORE, Date.now() / 1000, epoch, version]);
    if (done !== 2) return done;
    await bringNext(module, files);
  }
}

async function update({ scope, ...site }) {
  const cache = await openStore(scope);
  const files = new Brought(site.url, site.stall);
  if (await isCurrent(files, cache, scope, site)) return { state: 'current' };
  const module = await load({ brought: (path, from) => files.take(path, from) });
  await restore(module.FS, cache, scope);
  const done = await run(module, files, site);
  const told = (field) => module.UTF8ToString(module._update_error(field));
  if (done > 0) writePage(module);
  // A failed one, too: what it learnt of keys and versions, and the pieces that it brought.
  await save(module.FS, cache, scope);
  if (done < 0) return { state: 'failed', code: told(0), text: `${told(1)}: ${told(2)}; ${told(3)}` };
  return { state: done > 0 ? 'updated' : 'current' };
}

self.onmessage = async ({ data }) => {
  try {
    // One tab at a time.
    const locked = () => update(data);
    self.postMessage(await (navigator.locks ? navigator.locks.request(cacheName(data.scope), locked) : locked()));
  } catch (error) {
    self.postMessage({ state: 'failed', code: error.code ?? error.name, text: String(error.message ?? error) });
  }
};
