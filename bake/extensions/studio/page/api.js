// @ts-check
/// <reference path="types.d.ts" />
// The studio's server, as a page calls it. Addresses are relative: the secret is in the page's own.

/** What the server refused: words for people. */
export class Refused extends Error {
  cure = '';
  file = '';
  line = 0;
  code = '';
  /** @type {string | string[] | undefined} what must be installed */
  package = undefined;

  /**
   * @param {{ error: string }} told
   * @param {number} status of HTTP; 0: there is no server
   */
  constructor({error, ...rest}, status) {
    super(error);
    Object.assign(this, rest);
    this.status = status;
  }
}

/**
 * The path of a file, folders kept.
 * @param {string} name
 */
export const pathOf = (name) => name.split('/').map(encodeURIComponent).join('/');

/**
 * @param {string} file
 * @param {number} size
 */
export const thumb = (file, size) => `api/thumb/${pathOf(file)}?size=${size}`;

/**
 * Answers the response. Errors: Refused; an AbortError.
 * @param {string} method
 * @param {string} path
 * @param {unknown} [body] JSON, or an unchanged Blob
 * @param {{ signal?: AbortSignal }} [options]
 */
export async function ask(method, path, body, options = {}) {
  const raw = body instanceof Blob;
  /** @type {Record<string, string>} */
  const headers = body === undefined || raw ? {} : {'Content-Type': 'application/json'};
  /** @type {Response} */
  let response;
  try {
    response = await fetch(`api/${path}`, {
      method,
      headers,
      body: raw || body === undefined ? body : JSON.stringify(body),
      signal: options.signal
    });
  } catch (error) {
    if (error instanceof Error && error.name === 'AbortError') throw error;
    throw new Refused({error: 'gone'}, 0);
  }
  if (response.ok) return response;
  const told =
      await response.json().catch(() => ({error: `${response.status} ${response.statusText}`}));
  throw new Refused(told, response.status);
}

/** @param {Parameters<typeof ask>} words */
export const askJson = async (...words) => (await ask(...words)).json();

/** A worker of one: a request during another one replaces the waiting one, as a drag needs. */
export class Newest {
  #busy = false;
  /** @type {{ input: unknown } | null} */
  #next = null;

  /** @param {(input: any) => Promise<void>} work */
  constructor(work) { this.work = work; }

  /** @param {unknown} input */
  async ask(input) {
    this.#next = {input};
    if (this.#busy) return;
    this.#busy = true;
    while (this.#next) {
      const {input: now} = this.#next;
      this.#next = null;
      await this.work(now);
    }
    this.#busy = false;
  }
}
