// @ts-check
// Updates the bundles of the page from a release folder of `modar ship`, in parallel with the
// page: all is checked before it is used, and the release in use stays until the new is whole and
// stored.
import load from './engine-update.js';
import {textsOf, titleOf} from './bundle.js';
import {joined, Source} from './download.js';
import {address, cacheName, installedRelease, isNewer, openStore} from './installed-release.js';

const STORE = '/store';
/** As modar-fetch reads of them at most. */
const LATEST_BYTES = 32;
const RELEASE_BYTES = 8 << 20;
/** Of pieces that are downloaded before the installer takes them: they are in memory twice. */
const PORTION_BYTES = 16 << 20;

/** Requests of a file in a visit, and bytes a second that are too few: as modar-fetch asks for. */
const MOST_ASKED = 3, LEAST_RATE = 64;

/**
 * Of emscripten.
 * @typedef {{
 *   readdir: (path: string) => string[],
 *   lstat: (path: string) => {mode: number},
 *   stat: (path: string) => {size: number},
 *   isDir: (mode: number) => boolean,
 *   isFile: (mode: number) => boolean,
 *   isLink: (mode: number) => boolean,
 *   readlink: (path: string) => string,
 *   readFile: ((path: string) => Uint8Array) &
 *       ((path: string, options: {encoding: 'utf8'}) => string),
 *   writeFile: (path: string, data: string | Uint8Array) => void,
 *   mkdirTree: (path: string) => void,
 *   unlink: (path: string) => void,
 *   analyzePath: (path: string) => {exists: boolean},
 * }} Files
 *
 * The installer: what emscripten makes of update.cpp.
 * @typedef {Record<`_update_${string}`, (...numbers: number[]) => number> & {
 *   FS: Files,
 *   HEAPU8: Uint8Array,
 *   UTF8ToString: (address: number) => string,
 *   ccall: (name: string, answer: 'number', types: string[], values: (string | number)[]) =>
 *       number,
 * }} Installer
 *
 * A release folder, its key, and the release that came with the page.
 * @typedef {{url: string, stall: number, key: string, epoch: number, version: number, hashes:
 *     string[]}} Site
 *
 * @typedef {{status: number, bytes: Uint8Array, whole: boolean}} Got
 */

/** The files of a release that a visit has downloaded, each requested a few times at most. */
class Downloads {
  #url;
  #stall;
  /** @type {Map<string, Got & {from: number}>} by path */
  #files = new Map();
  /** @type {Map<string, number>} */
  #asked = new Map();

  /**
   * @param {string} url
   * @param {number} stall
   */
  constructor(url, stall) {
    this.#url = url;
    this.#stall = stall;
  }

  /**
   * {status, bytes, whole}: what came of a file, at most one byte more than `limit`, of the whole
   * file, allows. status: of HTTP, 0 where it broke.
   * @param {string} path
   * @param {number} from
   * @param {number} limit
   * @param {RequestCache} cache
   * @returns {Promise<Got>}
   */
  async #download(path, from, limit, cache) {
    const source = new Source(
        this.#url + path, {from, cache, tries: 1, stall: this.#stall, rate: LEAST_RATE, any: true});
    /** @type {Uint8Array[]} */
    const parts = [];
    try {
      const bytes =
          await source.take(limit - from + 1, false, (_, part) => parts.push(part.slice()));
      return {status: 200, bytes, whole: true};
    } catch (error) {
      const {status = 0} = /** @type {{status?: number}} */ (error);
      return {status, bytes: joined(parts), whole: status > 0};
    } finally { source.close(); }
  }

  /**
   * False if it was requested too often: then it is as one that did not come.
   * @param {string} path
   * @param {number} from
   * @param {number} limit
   */
  async bring(path, from, limit) {
    const asked = (this.#asked.get(path) ?? 0) + 1;
    this.#asked.set(path, asked);
    const again = asked <= MOST_ASKED;
    // Documents may have been repaired since, and a piece that is requested again was damaged.
    const cache = asked > 1 || !path.startsWith('objects/') ? 'no-store' : 'default';
    const file = again ? await this.#download(path, from, limit, cache) :
                         {status: 0, bytes: new Uint8Array(), whole: false};
    this.#files.set(path, {from, ...file});
    return again;
  }

  /**
   * What came of a file from that byte on; undefined: nothing yet. A piece, and what broke, is
   * handed out once, so that it is requested again; but a file that was requested too often
   * stays missing.
   * @param {string} path
   * @param {number} from
   */
  take(path, from) {
    const file = this.#files.get(path);
    const asked = /** @type {number} */ (this.#asked.get(path));
    if (!file || (file.from !== from && asked <= MOST_ASKED)) return undefined;
    if ((path.startsWith('objects/') || !file.whole) && asked <= MOST_ASKED)
      this.#files.delete(path);
    return file;
  }

  /**
   * A document of the release as text; undefined where the server does not give it.
   * @param {string} path
   * @param {number} limit
   */
  async text(path, limit) {
    if (!this.#files.has(path)) await this.bring(path, 0, limit);
    const file = this.#files.get(path);
    return file?.whole && file.status === 200 && file.bytes.length <= limit ?
        new TextDecoder().decode(file.bytes) :
        undefined;
  }
}

/**
 * @param {Files} FS
 * @param {string} folder
 * @returns {string[]}
 */
function pathsBelow(FS, folder) {
  return FS.readdir(folder).filter((name) => name !== '.' && name !== '..').flatMap((name) => {
    const path = `${folder}/${name}`;
    const {mode} = FS.lstat(path);
    return FS.isDir(mode) ? pathsBelow(FS, path) : FS.isFile(mode) ? [path] : [];
  });
}

/**
 * @param {Files} FS
 * @param {Cache} cache
 * @param {string} scope
 */
async function restore(FS, cache, scope) {
  FS.mkdirTree(STORE);
  const base = address(scope, '');
  for (const request of await cache.keys()) {
    const path = `${STORE}/${decodeURIComponent(request.url.slice(base.length))}`;
    FS.mkdirTree(path.slice(0, path.lastIndexOf('/')));
    const kept = /** @type {Response} */ (await cache.match(request));
    FS.writeFile(path, new Uint8Array(await kept.arrayBuffer()));
  }
}

/**
 * "slots/a"; empty where nothing is installed.
 * @param {Files} FS
 */
function slotInUse(FS) {
  const current = `${STORE}/current`;
  if (!FS.analyzePath(current).exists) return '';
  const path = FS.isLink(FS.lstat(current).mode) ? FS.readlink(current) :
                                                   FS.readFile(current, {encoding: 'utf8'});
  return path.trim().replace(`${STORE}/`, '');
}

/**
 * Stores all files, `current` last, and drops those that are gone.
 * @param {Files} FS
 * @param {Cache} cache
 * @param {string} scope
 */
async function save(FS, cache, scope) {
  const paths = pathsBelow(FS, STORE)
                    .map((path) => path.slice(STORE.length + 1))
                    .filter((path) => path !== 'lock' && path !== 'current');
  /** @type {(path: string, bytes: BodyInit) => Promise<void>} */
  const put = (path, bytes) => cache.put(address(scope, path), new Response(bytes));
  for (const path of paths) await put(path, FS.readFile(`${STORE}/${path}`));
  const slot = slotInUse(FS);
  if (slot) await put('current', `${slot}\n`);
  const kept = new Set([...paths, 'current'].map((path) => address(scope, path)));
  for (const {url} of await cache.keys()) {
    if (!kept.has(url)) await cache.delete(url);
  }
}

/**
 * The open bundle's patterns, their pictures put next to it.
 * @param {Installer} module
 * @param {string} stem
 */
function describe(module, stem) {
  const {FS} = module;
  const texts = textsOf(JSON.parse(module.UTF8ToString(module._update_meta()) || '{}'));
  const patterns = [];
  for (let i = 0;; ++i) {
    const named = module._update_pattern(i);
    if (named === 0) return patterns;
    const name = module.UTF8ToString(named);
    const pattern = {
      name,
      title: titleOf(name),
      models: titleOf(module.UTF8ToString(module._update_models(i))),
      image: `${stem}-${i}.webp`,
      width: module._update_picture_side(i, 0),
      height: module._update_picture_side(i, 1),
      texts: texts[name],
    };
    if (pattern.width === 0) continue;  // no tracker record
    const at = module._update_picture(i);
    FS.writeFile(
        `${STORE}/${pattern.image}`,
        module.HEAPU8.subarray(at, at + module._update_picture_bytes(i)));
    patterns.push(pattern);
  }
}

/**
 * page.json: what site.json has of bundles, with `installed` set.
 * @param {Installer} module
 */
function writePage(module) {
  const {FS} = module;
  const slot = slotInUse(FS);
  for (const path of pathsBelow(FS, `${STORE}/${slot}`)) {
    if (path.endsWith('.webp')) FS.unlink(path);  // of the release that the slot had before
  }
  const bundles = [];
  for (const path of pathsBelow(FS, `${STORE}/${slot}`)) {
    if (!path.endsWith('.modar') || module.ccall('update_open', 'number', ['string'], [path]) === 0)
      continue;
    const file = path.slice(STORE.length + 1);
    const name = file.slice(slot.length + 1, -'.modar'.length);
    const patterns = describe(module, `${slot}/${name}`);
    if (patterns.length > 0) {
      bundles.push({
        title: titleOf(name),
        file,
        bytes: FS.stat(`${STORE}/${file}`).size,
        patterns,
        installed: true
      });
    }
  }
  FS.writeFile(`${STORE}/${slot}/page.json`, JSON.stringify({bundles}));
}

/**
 * Whether the server's newest release is what the page has: then nothing is to be believed. What
 * cannot be read is not.
 * @param {Downloads} files
 * @param {Cache} cache
 * @param {string} scope
 * @param {Site} site
 */
async function isCurrent(files, cache, scope, {epoch, version, hashes}) {
  const number = (await files.text('latest', LATEST_BYTES))?.trim();
  if (!/^\d{1,16}$/.test(number ?? '')) return false;
  const release = await files.text(`releases/${number}.json`, RELEASE_BYTES);
  const installed = await installedRelease(cache, scope);
  if (!release) return false;
  if (installed && isNewer(installed.release, {epoch, version}))
    return installed.release === release;
  try {
    /** @type {string[]} */
    const wanted = JSON.parse(release).bundles.map((/** @type {{hash: string}} */ {hash}) => hash);
    return wanted.length === hashes.length && wanted.every((hash) => hashes.includes(hash));
  } catch { return false; }
}

/**
 * Downloads the installer's next request, in portions; at least one file, else the update ends.
 * @param {Installer} module
 * @param {Downloads} files
 */
async function bringNext(module, files) {
  let size = 0;
  for (let i = 0; i === 0 || size < PORTION_BYTES; ++i) {
    const named = module._update_need(i);
    if (named === 0 && i === 0) throw new Error('the installer waits for nothing');
    if (named === 0) return;
    const from = module._update_need_from(i);
    const limit = module._update_need_limit(i);
    const path = module.UTF8ToString(named);
    await files.bring(path, from, limit);
    size += path.startsWith('objects/') ? limit - from : 0;
  }
}

/**
 * @param {Installer} module
 * @param {Downloads} files
 * @param {Site} site
 */
async function run(module, files, {url, key, epoch, version}) {
  const words = ['string', 'string', 'string', 'number', 'number', 'number'];
  for (;;) {
    const done = module.ccall(
        'update_run', 'number', words, [url, key, STORE, Date.now() / 1000, epoch, version]);
    if (done !== 2) return done;
    await bringNext(module, files);
  }
}

/** @param {Site & {scope: string}} site */
async function update({scope, ...site}) {
  const cache = await openStore(scope);
  const files = new Downloads(site.url, site.stall);
  if (await isCurrent(files, cache, scope, site)) return {state: 'current'};
  const module = /** @type {Installer} */ (await load({
    brought: (/** @type {string} */ path, /** @type {number} */ from) => files.take(path, from)
  }));
  await restore(module.FS, cache, scope);
  const done = await run(module, files, site);
  const told = (/** @type {number} */ field) => module.UTF8ToString(module._update_error(field));
  if (done > 0) writePage(module);
  // A failed one, too: its knowledge of keys and versions, and its downloaded pieces.
  await save(module.FS, cache, scope);
  if (done < 0) return {state: 'failed', code: told(0), text: `${told(1)}: ${told(2)}; ${told(3)}`};
  return {state: done > 0 ? 'updated' : 'current'};
}

self.onmessage = async ({data}) => {
  try {
    // One tab at a time.
    const locked = () => update(data);
    self.postMessage(await (
        navigator.locks ? navigator.locks.request(cacheName(data.scope), locked) : locked()));
  } catch (error) {
    const {code, name, message} = /** @type {Error & {code?: string}} */ (error);
    self.postMessage({state: 'failed', code: code ?? name, text: String(message ?? error)});
  }
};
