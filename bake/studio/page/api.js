// The studio's server, as a page calls it. Addresses are relative: the secret is in the page's own.

/** What the server refused: words for people. */
export class Refused extends Error {
  constructor({ error, ...rest }, status) {
    super(error);
    Object.assign(this, { cure: '', file: '', line: 0, ...rest, status });
  }
}

/** The path of a file, folders kept. */
export const pathOf = (name) => name.split('/').map(encodeURIComponent).join('/');

export const thumb = (file, size) => `api/thumb/${pathOf(file)}?size=${size}`;

/** Answers the response. body: JSON, or a Blob as it is. Errors: Refused; an AbortError. */
export async function ask(method, path, body, { signal } = {}) {
  const raw = body instanceof Blob;
  const headers = body === undefined || raw ? {} : { 'Content-Type': 'application/json' };
  let response;
  try {
    response = await fetch(`api/${path}`, { method, headers, body: raw || body === undefined ? body : JSON.stringify(body), signal });
  } catch (error) {
    if (error.name === 'AbortError') throw error;
    throw new Refused({ error: 'gone' }, 0);
  }
  if (response.ok) return response;
  const told = await response.json().catch(() => ({ error: `${response.status} ${response.statusText}` }));
  throw new Refused(told, response.status);
}

export const askJson = async (...words) => (await ask(...words)).json();

/** A worker of one: what is asked for while one is under way replaces what waits, as a drag needs. */
export class Newest {
  #busy = false;
  #next = null;

  constructor(work) {
    this.work = work;
  }

  async ask(input) {
    this.#next = { input };
    if (this.#busy) return;
    this.#busy = true;
    while (this.#next) {
      const { input: now } = this.#next;
      this.#next = null;
      await this.work(now);
    }
    this.#busy = false;
  }
}
