// @ts-check
// What updates have installed, in the browser's storage: the store of modar::fetch
// (formats/shipping.md), a Cache entry a file. `current` names the slot in use and is written last;
// page.json in the slot says what the page shows of it.

/** @param {string} scope */
export function cacheName(scope) { return `modar ${scope} installed`; }

/**
 * @param {string} scope
 * @param {string} path
 */
export function address(scope, path) { return new URL(`installed/${path}`, scope).href; }

/** @param {string} scope */
export async function openStore(scope) { return caches.open(cacheName(scope)); }

/**
 * @param {Cache} cache
 * @param {string} url
 */
async function textOf(cache, url) {
  const kept = await cache.match(url);
  return kept?.text();
}

/**
 * {slot, release}: the release in use and its document; undefined if none.
 * @param {Cache} cache
 * @param {string} scope
 */
export async function installedRelease(cache, scope) {
  const slot = (await textOf(cache, address(scope, 'current')))?.trim();
  const release = slot && await textOf(cache, address(scope, `${slot}/release.json`));
  return slot && release ? {slot, release} : undefined;
}

/**
 * Whether a release document is of a later release.
 * @param {string} document
 * @param {{ epoch?: number, version?: number }} than
 */
export function isNewer(document, {epoch = 0, version = 0}) {
  const release = JSON.parse(document);
  const its = release.epoch ?? 0;
  return its > epoch || (its === epoch && release.version > version);
}

/**
 * Bundles of the release in use, as site.json lists its own; undefined where nothing is installed,
 * or nothing newer than the release {epoch, version} that came with the page.
 * @param {string} scope
 */
export async function installedBundles(scope, least = {}) {
  if (!('caches' in globalThis) || !await caches.has(cacheName(scope))) return undefined;
  const cache = await openStore(scope);
  const installed = await installedRelease(cache, scope);
  if (!installed || !isNewer(installed.release, least)) return undefined;
  const page = await textOf(cache, address(scope, `${installed.slot}/page.json`));
  const bundles = page && JSON.parse(page).bundles;
  return bundles?.length > 0 &&
          bundles.every(
              (/** @type {{ patterns?: object[] }} */ {patterns = []}) => patterns.length > 0) ?
      bundles :
      undefined;
}

/**
 * A file of the store as a Blob.
 * @param {string} scope
 * @param {string} path
 */
export async function installedFile(scope, path) {
  const kept = await (await openStore(scope)).match(address(scope, path));
  return kept?.blob();
}

/**
 * Back to the site's own files, until the next update.
 * @param {string} scope
 */
export async function forgetInstalled(scope) {
  await (await openStore(scope)).delete(address(scope, 'current'));
}
