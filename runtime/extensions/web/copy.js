// @ts-check
// The parts of a bundle that visits have downloaded, kept for the next one and for the
// service worker (sw.js): its parts in order, and how many bytes they are once all of them are
// there and verified. No part is empty. Nothing here fails or takes longer than STORE_S.
import {within} from './download.js';

/** Bytes of a part: few are in memory, or lost where a visit is broken off. */
const PART_BYTES = 1e6;
/** Seconds that the browser's storage may take: a page works without it. */
export const STORE_S = 5;

/**
 * Whether an error may come from stored files: not of the network, nor of what the browser
 * lacks.
 * @param {{ code?: string }} error
 */
export const isRotten = ({code = 'web.'}) => !/^(web|gl)\./.test(code) || code === 'web.changed';

export class Copy {
  #scope;
  #address;
  /** @type {Cache | undefined} */
  #cache;
  /**
   * Pending writes: null where the service worker has the bundle, or storage failed.
   * @type {Uint8Array | null}
   */
  #bytes = null;
  #size = 0;
  #at = 0;
  /** Until all is written; fails where the device has no room. */
  written = /** @type {Promise<unknown>} */ (Promise.resolve());

  /**
   * @param {string} scope
   * @param {string} address
   */
  constructor(scope, address) {
    this.#scope = scope;
    this.#address = address;
  }

  /**
   * null: this browser stores nothing.
   * @param {string} scope
   * @param {string} address
   */
  static async of(scope, address) {
    const copy = new Copy(scope, address);
    const open = async () => {
      copy.#cache = await caches.open(copy.#name);
      await copy.#cache.delete(address);  // of an older page
      if (!await caches.match(address)) copy.#bytes = new Uint8Array(PART_BYTES);
      return copy;
    };
    return within(STORE_S, open(), () => null).catch(() => null);
  }

  get #name() { return `modar ${this.#scope} downloads`; }

  /** @param {number} at */
  #part(at) { return `${this.#address}&part=${at}`; }

  /**
   * @param {string} name
   * @param {BodyInit} body
   */
  #put(name, body) {
    const response = new Response(
        body);  // has a copy; a blob would stay in the browser's process until it is collected
    this.written = this.written.then(() => this.#bytes && this.#cache?.put(name, response));
    this.written.catch(() => {
      this.#bytes = null;
    });
  }

  #cut() {
    if (this.#bytes && this.#size > 0)
      this.#put(this.#part(this.#at), this.#bytes.subarray(0, this.#size));
    this.#at += this.#size;
    this.#size = 0;
  }

  /**
   * Bytes that follow those before.
   * @param {Uint8Array} more
   */
  add(more) {
    for (let from = 0; this.#bytes && from < more.length;) {
      const some = more.subarray(from, from + PART_BYTES - this.#size);
      this.#bytes.set(some, this.#size);
      this.#size += some.length;
      from += some.length;
      if (this.#size === PART_BYTES) this.#cut();
    }
  }

  /**
   * whole: those bytes are all of a packed bundle, and verified.
   * @param {boolean} whole
   */
  end(whole) {
    if (!this.#bytes) return;
    this.#cut();
    if (whole && this.#at > 0) this.#put(`${this.#address}&sum`, String(this.#at));
  }

  /**
   * The bytes of an earlier visit from a place on; null: nothing.
   * @param {number} from
   */
  kept(from) {
    const read = async () => {
      const found = await this.#cache?.match(this.#part(from));
      const bytes = found && new Uint8Array(await found.arrayBuffer());
      if (bytes?.length === 0)
        await this.forget();  // of an older page, which asked for it without end
      return bytes && bytes.length > 0 ? bytes : null;
    };
    return within(STORE_S, read(), () => null).catch(() => null);
  }

  /** The stored part of the bundle is damaged. */
  forget() {
    this.#bytes = null;
    const remove = async () => {
      await this.written.catch(() => {});
      await caches.delete(this.#name);
      for (const name of await caches.keys()) {
        if (name.startsWith(`modar ${this.#scope} `))
          await (await caches.open(name)).delete(this.#address, {ignoreSearch: true});
      }
    };
    return within(STORE_S, remove(), () => {}).catch(() => {});
  }
}
