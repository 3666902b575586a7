// What the page keeps on the visitor's device: short texts under keys of its own. Storage that is switched off keeps nothing, and
// fails nothing.
const OWN = 'modar-';

function quietly(action, otherwise) {
  try {
    return action();
  } catch {
    return otherwise;
  }
}

/** What is kept under "modar-...", or ''. */
export const stored = (key) => quietly(() => localStorage.getItem(key) ?? '', '');

export const store = (key, value) => quietly(() => localStorage.setItem(key, value));

/** Forgets all of them. */
export function forgetStored() {
  quietly(() => Object.keys(localStorage).filter((key) => key.startsWith(OWN)).forEach((key) => localStorage.removeItem(key)));
}
