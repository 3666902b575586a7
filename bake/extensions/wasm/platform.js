// @ts-check
// What bake.js and its worker need to know of where they run.

export const IN_NODE = Boolean(/** @type {any} */ (globalThis).process?.versions?.node);
/** @param {string} name of a module of Node, which bundlers for browsers must not look for */
export const nodeModule = (name) => import(/* webpackIgnore: true */ /* @vite-ignore */ `node:${name}`);
