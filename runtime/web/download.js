// Downloads that end: none brings more than it may, none goes on where nothing comes.

/** A file's bytes come at least so fast, a second, on average over `stall` seconds: as modar-fetch asks for. */
const LEAST_RATE = 64;
/** Times that a file is asked for in a visit, as a phone's connection breaks now and then: where one request in ten fails, one file in a thousand is missing. */
const TRIES = 3;

async function read(response, skip, room, seen) {
  const parts = [];
  let size = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read().catch(() => ({ done: true, value: null }));
    if (done) return { parts, size, whole: value !== null };
    seen(value.length);
    const part = value.subarray(Math.min(skip, value.length));
    skip -= value.length - part.length;
    parts.push(part);
    size += part.length;
    if (size > room) {  // whoever reads it sees that it is too long
      reader.cancel().catch(() => {});
      return { parts, size, whole: true };
    }
  }
}

/**
 * {status, bytes, whole}: what came of a file from byte `from` on, at most one byte more than `limit`, of the whole file,
 * allows. status: of HTTP, 0 where there was no answer. whole: it ended by itself. stall: seconds.
 */
export async function download(url, { from = 0, limit, fresh = false, stall }) {
  const abort = new AbortController();
  let came = 0, counted = 0;
  const watch = setInterval(() => {
    if (came - counted < LEAST_RATE * stall) abort.abort();
    counted = came;
  }, 1000 * stall);
  const nothing = { status: 0, bytes: new Uint8Array(), whole: false };
  try {
    const response = await fetch(url, {
      signal: abort.signal, cache: fresh ? 'no-store' : 'default', headers: from > 0 ? { Range: `bytes=${from}-` } : {},
    });
    if (response.status !== 200 && response.status !== 206) {
      response.body?.cancel().catch(() => {});
      return { ...nothing, status: response.status, whole: true };
    }
    // A server without ranges begins at the first byte.
    const { parts, size, whole } = await read(response, response.status === 200 ? from : 0, limit - from,
      (length) => { came += length; });
    const bytes = new Uint8Array(size);
    let at = 0;
    for (const part of parts) {
      bytes.set(part, at);
      at += part.length;
    }
    return { status: response.status, bytes, whole };
  } catch {
    return nothing;
  } finally {
    clearInterval(watch);
    abort.abort();  // WebKit goes on reading what is only cancelled
  }
}

/** The files of a release that a visit has brought, each asked for a few times at most. */
export class Brought {
  #url;
  #stall;
  #files = new Map();  // by path: {from, status, bytes, whole}
  #asked = new Map();

  constructor(url, stall) {
    this.#url = url;
    this.#stall = stall;
  }

  /** False where it was asked for too often: then it is as one that did not come. */
  async bring(path, from, limit) {
    const asked = (this.#asked.get(path) ?? 0) + 1;
    this.#asked.set(path, asked);
    const again = asked <= TRIES;
    // Documents may have been mended since, and a piece that is asked for again was no good.
    const fresh = asked > 1 || !path.startsWith('objects/');
    const file = again ? await download(this.#url + path, { from, limit, fresh, stall: this.#stall })
      : { status: 0, bytes: new Uint8Array(), whole: false };
    this.#files.set(path, { from, ...file });
    return again;
  }

  /**
   * What came of a file from that byte on; undefined: nothing yet. A piece, and what broke, is handed out once, so that it is
   * asked for again; but what was asked for too often stays as one that did not come.
   */
  take(path, from) {
    const file = this.#files.get(path);
    if (!file || (file.from !== from && this.#asked.get(path) <= TRIES)) return undefined;
    if ((path.startsWith('objects/') || !file.whole) && this.#asked.get(path) <= TRIES) this.#files.delete(path);
    return file;
  }

  /** A document of the release as text; undefined where the server does not give it. */
  async text(path, limit) {
    if (!this.#files.has(path)) await this.bring(path, 0, limit);
    const file = this.#files.get(path);
    return file?.whole && file.status === 200 && file.bytes.length <= limit ? new TextDecoder().decode(file.bytes) : undefined;
  }
}
