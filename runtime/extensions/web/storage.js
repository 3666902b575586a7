// @ts-check
// What the page keeps on the visitor's device: short texts under keys of its own. Storage that is
// switched off keeps nothing, and fails nothing.
const OWN = 'modar-';

/**
 * @template T
 * @param {() => T} action
 * @param {T} otherwise
 */
function quietly(action, otherwise) {
  try {
    return action();
  } catch { return otherwise; }
}

/**
 * The value stored under "modar-...", or ''.
 * @param {string} key
 */
export const stored = (key) => quietly(() => localStorage.getItem(key) ?? '', '');

/**
 * @param {string} key
 * @param {string} value
 */
export const store = (key, value) => quietly(() => localStorage.setItem(key, value), undefined);

/** Forgets all of them. */
export function forgetStored() {
  quietly(
      () => Object.keys(localStorage)
                .filter((key) => key.startsWith(OWN))
                .forEach((key) => localStorage.removeItem(key)),
      undefined);
}
