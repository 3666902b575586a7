// What updates have installed, in the browser's storage: the store of modar::fetch (formats/shipping.md), a Cache entry
// a file. `current` names the slot in use and is written last; page.json in the slot says what the page shows of it.

export function cacheName(scope) {
  return `modar ${scope} installed`;
}

export function address(scope, path) {
  return new URL(`installed/${path}`, scope).href;
}

export async function openStore(scope) {
  return caches.open(cacheName(scope));
}

async function textOf(cache, url) {
  const kept = await cache.match(url);
  return kept?.text();
}

/** {slot, release}: the release in use and its document; undefined where there is none. */
export async function installedRelease(cache, scope) {
  const slot = (await textOf(cache, address(scope, 'current')))?.trim();
  const release = slot && await textOf(cache, address(scope, `${slot}/release.json`));
  return release && { slot, release };
}

/** Whether a release document is of a later release than {epoch, version}. */
export function isNewer(document, { epoch = 0, version = 0 }) {
  const release = JSON.parse(document);
  const its = release.epoch ?? 0;
  return its > epoch || (its === epoch && release.version > version);
}

/**
 * Bundles of the release in use, as site.json lists its own; undefined where nothing is installed, or nothing newer than
 * the release {epoch, version} that came with the page.
 */
export async function installedBundles(scope, least = {}) {
  if (!('caches' in globalThis) || !await caches.has(cacheName(scope))) return undefined;
  const cache = await openStore(scope);
  const installed = await installedRelease(cache, scope);
  if (!installed || !isNewer(installed.release, least)) return undefined;
  const page = await textOf(cache, address(scope, `${installed.slot}/page.json`));
  return page && JSON.parse(page).bundles;
}

/** A file of the store as a Blob. */
export async function installedFile(scope, path) {
  const kept = await (await openStore(scope)).match(address(scope, path));
  return kept?.blob();
}

/** Back to what the site itself brought, until the next update. */
export async function forgetInstalled(scope) {
  await (await openStore(scope)).delete(address(scope, 'current'));
}
