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

/** Bundles of the release in use, as site.json lists its own; undefined where nothing is installed. */
export async function installedBundles(scope) {
  if (!('caches' in globalThis) || !await caches.has(cacheName(scope))) return undefined;
  const cache = await openStore(scope);
  const installed = await installedRelease(cache, scope);
  const page = installed && await textOf(cache, address(scope, `${installed.slot}/page.json`));
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
