// Levels of detail of a bundle that is larger than what a view may have: brought by ranges when a picture lacks them. Loaded with such.
import { release } from './engine.js';

/**
 * Requests at once. Levels of a chunk have some 10 KB: where an answer takes 0.3 s, so many fill a line of 10 Mbit/s. Over HTTP/1.1, where
 * the browser makes six of them, 6 and 24 show the same (below).
 */
const MOST_REQUESTS = 24;
/** Pieces that are asked for together where they lie side by side. */
const MOST_TOGETHER = 4;
/**
 * Bytes that are open at once, one range at least: what the view needs next comes after them, 3.2 s later on a line of 1.6 Mbit/s, where
 * more show no more. Thousands of triangles in the mean of `huge_page.py --seconds 24 --hold 4` over a scan of 4.5 million, with 80, 160,
 * 320, 640 and 1280 KB: --line 1.6e6 --latency 300: 73, 93, 95, 107, 107; --line 10e6 --latency 100: 228, 231, 234, 266, 314.
 */
const MOST_OPEN = 640e3;
/** Seconds before something is asked for again, as in arrival.js; doubled each time up to 32. */
const WAIT_S = 1;

export class Wanted {
  #engine;
  #parts;
  #onMore;
  /** {pieces: those that are missing, done: what is called when none is}, in the order in which they are needed. */
  #open = new Set();
  /** Pieces that are on their way, and how often each has failed. */
  #coming = new Set();
  #tries = new Map();
  #requests = 0;
  #take;
  /** Numbers of what has come since use(). */
  #came = [];

  /** parts: of an arrival. onMore: is called when there is something for use(). */
  constructor(engine, parts, onMore) {
    this.#engine = engine;
    this.#parts = parts;
    this.#onMore = onMore;
  }

  /** Brings what the engine needs in memory. @returns whether the host has ranges */
  async begin() {
    if (!await this.#request(0, 1)) {
      console.info('The host of this bundle has no ranges: all of it is brought at once.');
      return false;
    }
    this.#take = (offset, bytes) => this.#engine.put(offset, bytes);
    await Promise.all(this.#keep().map(([offset, size]) => new Promise((resolve) => {
      this.#add(this.#piecesOf(offset, size).filter((piece) => piece >= this.#parts.first), resolve);
    })));
    this.#take = (offset, bytes) => {
      this.#engine.frameBuffer(bytes.length).set(bytes);
      this.#engine.module._web_fill(offset, this.#engine.frameAt, bytes.length);
    };
    return true;
  }

  /** What the engine has to have before show(): [[offset, size]]. */
  #keep() {
    this.#engine.check(this.#engine.module._web_keep());
    const kept = [];
    for (let range; (range = this.#numbers(this.#engine.module._web_kept(kept.length), 2));) kept.push(range);
    return kept;
  }

  /** Numbers that a function of the engine points at; null: at nothing. */
  #numbers(at, count) {
    return at === 0 ? null : [...new Uint32Array(this.#engine.module.HEAPU8.buffer, at, count)];
  }

  /** Draws the finest that use() is told of from now on, within so many bytes of the GPU: in a new context, from the beginning. */
  show(gpuBytes, fixedLight) {
    this.#open.clear();
    this.#came = [];
    this.#engine.check(this.#engine.module._web_show_wanted(gpuBytes, fixedLight ? 1 : 0));
  }

  get came() {
    return this.#came.length > 0;
  }

  /** What has come is drawn from now on. */
  use() {
    for (const number of this.#came.splice(0)) this.#engine.module._web_have(number);
  }

  /** After a picture: what it lacked; more of it when something has come, however slow pictures are. */
  ask() {
    for (let next; this.#openBytes() < MOST_OPEN && (next = this.#numbers(this.#engine.module._web_open_wanted(), 3));) {
      const [number, offset, size] = next;
      this.#add(this.#piecesOf(offset, size), () => {
        this.#came.push(number);
        this.ask();
        this.#onMore();
      });
    }
  }

  /** Of what is missing, as it is stored. */
  #openBytes() {
    return [...this.#open].reduce((sum, { pieces }) => [...pieces].reduce((bytes, piece) => bytes + this.#parts.pieces[piece].stored, sum), 0);
  }

  #piecesOf(offset, size) {
    return this.#parts.pieces.flatMap((piece, i) => (piece.offset < offset + size && offset < piece.offset + piece.size ? [i] : []));
  }

  #add(pieces, done) {
    if (pieces.length === 0) return done();
    this.#open.add({ pieces: new Set(pieces), done });
    this.#pump();
  }

  #pump() {
    for (let run; this.#requests < MOST_REQUESTS && (run = this.#next());) {
      ++this.#requests;
      for (const piece of run) this.#coming.add(piece);
      this.#bring(run).then((more) => {
        --this.#requests;
        if (more) this.#pump();
      });
    }
  }

  /** Pieces that lie side by side and are missing; null: none is. */
  #next() {
    for (const { pieces } of this.#open) {
      const missing = (piece) => pieces.has(piece) && !this.#coming.has(piece);
      const first = [...pieces].find(missing);
      if (first === undefined) continue;
      const run = [first];
      while (run.length < MOST_TOGETHER && missing(first + run.length)) run.push(first + run.length);
      return run;
    }
    return null;
  }

  /** @returns false: nothing more is wanted */
  async #bring(run) {
    const { pieces, decode, signal } = this.#parts;
    const from = pieces[run[0]].at;
    const last = pieces[run.at(-1)];
    const bytes = await this.#request(from, last.at + last.stored - from).catch(() => null);
    for (const piece of run) {
      const { at, stored, offset } = pieces[piece];
      const raw = bytes && await decode(pieces[piece], bytes.slice(at - from, at - from + stored)).catch(() => null);
      if (signal.aborted) return false;
      if (raw) this.#have(piece, offset, raw);
      else this.#comeAgain(piece);
    }
    if (bytes) release(bytes);
    return true;
  }

  #have(piece, offset, raw) {
    this.#coming.delete(piece);
    this.#tries.delete(piece);
    this.#take(offset, raw);
    release(raw);
    for (const open of [...this.#open]) {  // what is opened meanwhile does not have it
      if (!open.pieces.delete(piece) || open.pieces.size > 0) continue;
      this.#open.delete(open);
      open.done();
    }
  }

  #comeAgain(piece) {
    const tries = this.#tries.get(piece) ?? 0;
    this.#tries.set(piece, tries + 1);
    setTimeout(() => {
      this.#coming.delete(piece);
      this.#pump();
    }, 1000 * WAIT_S * 2 ** Math.min(tries, 5));
  }

  /** Some bytes of the file; null: the host has no ranges. Past the browser's cache: Chromium's answers one request of an address after the other. */
  async #request(at, size) {
    const { bundle, signal } = this.#parts;
    if (bundle instanceof Uint8Array) return bundle.slice(at, at + size);
    const response = await fetch(bundle, { signal, headers: { Range: `bytes=${at}-${at + size - 1}` }, cache: 'no-store' });
    if (response.status !== 206) {
      response.body?.cancel().catch(() => {});
      return null;
    }
    const bytes = new Uint8Array(await response.arrayBuffer());
    return bytes.length === size ? bytes : null;
  }
}
