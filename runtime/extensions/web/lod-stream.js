// @ts-check
// Levels of detail of a bundle that is larger than what a view may have: downloaded by
// ranges when a picture lacks them. Loaded with such.
import {place} from './arrival.js';
import {release} from './engine.js';

/**
 * Requests at once. Uncoded levels of a chunk have some 10 KB: where an answer takes 0.3 s, this
 * many fill a line of 10 Mbit/s; of coded ones MOST_OPEN bytes are the limit. Over HTTP/1.1, where
 * the browser makes six of them, 6 and 24 show the same (below).
 */
const MOST_REQUESTS = 24;
/** Adjacent pieces that are requested together. */
const MOST_TOGETHER = 4;
/**
 * Bytes that are open at once, one range at least: what the view needs next comes after them, 3.2 s
 * later on a line of 1.6 Mbit/s, where more show no more. Thousands of triangles in the mean of
 * `huge_page.py --seconds 24 --hold 4` over a scan of 4.5 million, with 80, 160, 320, 640 and 1280
 * KB: --line 1.6e6 --latency 300: 73, 93, 95, 107, 107; --line 10e6 --latency 100: 228, 231, 234,
 * 266, 314.
 */
const MOST_OPEN = 640e3;
/**
 * Seconds before a piece is requested again, doubled each time, and how often: then the visitor
 * sees an error.
 */
const WAIT_S = 1, TRIES = 8;
/** Seconds without an answer: of many requests, some wait in the browser for others. */
const STALL_S = 60;

/**
 * @typedef {import('./arrival.js').Place & { at: number, stored: number }} Piece
 * @typedef {{ pieces: Piece[], first: number, decode: (piece: any, stored: Uint8Array) =>
 * Promise<Uint8Array>, closed: () => boolean, part: (at: number, size: number, options: object) =>
 * Promise<Uint8Array> }} Parts
 */

export class LodStream {
  #engine;
  #parts;
  #onMore;
  /**
   * {pieces: those that are missing, done: callback when none is}, in the order of need.
   * @type
   * {Set<{ pieces: Set<number>, done: () => void }>}
   */
  #open = new Set();
  /**
   * Pieces that are on their way, and how often each has failed.
   * @type {Set<number>}
   */
  #coming = new Set();
  /** @type {Map<number, number>} */
  #tries = new Map();
  #requests = 0;
  /** @type {(offset: number, bytes: Uint8Array) => void} */
  #take = () => {};
  /** Receives the error after which nothing is requested any more. */
  #onFail;
  #failed = false;
  /**
   * Numbers of what has come since use().
   * @type {number[]}
   */
  #came = [];

  /**
   * parts: of an arrival. onMore: is called when there is something for use(); onFail: with an
   * error, when nothing more will come.
   * @param {any} engine
   * @param {Parts} parts
   * @param {() => void} onMore
   * @param {(error: unknown) => void} onFail
   */
  constructor(engine, parts, onMore, onFail) {
    this.#engine = engine;
    this.#parts = parts;
    this.#onMore = onMore;
    this.#onFail = onFail;
  }

  /** Downloads the parts that the engine needs in memory. @returns whether the host has ranges */
  async begin() {
    try {
      await this.#request(0, 1);
    } catch (error) {
      if (!/** @type {{ final?: boolean }} */ (error).final) throw error;
      console.info('The host of this bundle has no ranges: all of it is downloaded at once.');
      return false;
    }
    this.#take = (offset, bytes) => this.#engine.put(offset, bytes);
    const onFail = this.#onFail;
    const failed = new Promise((_, reject) => {
      this.#onFail = reject;
    });
    await Promise.race([
      failed,
      Promise.all(this.#keep().map(
          ([offset, size]) => new Promise((/** @type {(value?: undefined) => void} */ resolve) => {
            this.#add(
                this.#piecesOf(offset, size).filter((piece) => piece >= this.#parts.first),
                resolve);
          })))
    ]);
    this.#onFail = onFail;
    this.#take = (offset, bytes) => {
      this.#engine.frameBuffer(bytes.length).set(bytes);
      this.#engine.check(this.#engine.module._web_fill(offset, this.#engine.frameAt, bytes.length));
    };
    return true;
  }

  /**
   * What the engine has to have before show(): [[offset, size]].
   * @returns {number[][]}
   */
  #keep() {
    this.#engine.check(this.#engine.module._web_keep());
    const kept = [];
    for (let range; (range = this.#numbers(this.#engine.module._web_kept(kept.length), 2));)
      kept.push(range);
    return kept;
  }

  /**
   * Numbers that a function of the engine points at; null: at nothing.
   * @param {number} at
   * @param {number} count
   */
  #numbers(at, count) {
    return at === 0 ? null : [...new Uint32Array(this.#engine.module.HEAPU8.buffer, at, count)];
  }

  /**
   * Draws the finest levels that use() receives from now on, within this many bytes of the GPU:
   * in a new context, from the beginning.
   *
   * @param {number} gpuBytes
   * @param {boolean} fixedLight
   */
  show(gpuBytes, fixedLight) {
    this.#open.clear();
    this.#came = [];
    this.#engine.check(this.#engine.module._web_show_wanted(gpuBytes, fixedLight ? 1 : 0));
  }

  get came() { return this.#came.length > 0; }

  /** What has come is drawn from now on. */
  use() {
    for (const number of this.#came.splice(0)) this.#engine.module._web_have(number);
  }

  /**
   * After a picture: what it lacked; more of it when something has come, however slow pictures
   * are.
   */
  ask() {
    for (let next; this.#openBytes() < MOST_OPEN &&
         (next = this.#numbers(this.#engine.module._web_open_wanted(), 3));) {
      const [number, offset, size] = next;
      this.#add(this.#piecesOf(offset, size), () => {
        this.#came.push(number);
        this.ask();
        this.#onMore();
      });
    }
  }

  /** Of the missing parts, as stored. */
  #openBytes() {
    return [...this.#open].reduce(
        (sum, {pieces}) => [...pieces].reduce(
            (bytes, piece) => bytes + this.#parts.pieces[piece].stored, sum),
        0);
  }

  /**
   * @param {number} offset
   * @param {number} size
   */
  #piecesOf(offset, size) {
    /**
     * @param {number} at
     * @param {number} bytes
     */
    const meets = (at, bytes) => at < offset + size && offset < at + bytes;
    return this.#parts.pieces.flatMap(
        ({offset: at, size: bytes, second = 0, secondSize = 0}, i) =>
            (meets(at, bytes - secondSize) || meets(second, secondSize) ? [i] : []));
  }

  /**
   * @param {number[]} pieces
   * @param {() => void} done
   * @returns {void}
   */
  #add(pieces, done) {
    if (pieces.length === 0) return done();
    this.#open.add({pieces: new Set(pieces), done});
    this.#pump();
  }

  #pump() {
    for (let run; !this.#failed && this.#requests < MOST_REQUESTS && (run = this.#next());) {
      ++this.#requests;
      for (const piece of run) this.#coming.add(piece);
      this.#bring(run).then((more) => {
        --this.#requests;
        if (more) this.#pump();
      });
    }
  }

  /** Adjacent missing pieces; null: none is. */
  #next() {
    for (const {pieces} of this.#open) {
      /** @param {number} piece */
      const missing = (piece) => pieces.has(piece) && !this.#coming.has(piece);
      const first = [...pieces].find(missing);
      if (first === undefined) continue;
      const run = [first];
      while (run.length < MOST_TOGETHER && missing(first + run.length))
        run.push(first + run.length);
      return run;
    }
    return null;
  }

  /**
   * @param {number[]} run
   * @returns {Promise<boolean>} false: nothing more is wanted
   */
  async #bring(run) {
    const {pieces, decode, closed} = this.#parts;
    const from = pieces[run[0]].at;
    const last = pieces[run[run.length - 1]];
    /** @type {unknown} */
    let wrong;
    /** @param {unknown} error */
    const without = (error) => {
      wrong = error;
    };
    const bytes =
        await this.#request(from, last.at + last.stored - from, {tries: 1}).catch(without);
    for (const piece of run) {
      const {at, stored} = pieces[piece];
      const raw = bytes &&
          await decode(pieces[piece], bytes.slice(at - from, at - from + stored)).catch(without);
      if (closed()) return false;
      if (raw) this.#have(piece, raw);
      else this.#comeAgain(piece, wrong);
    }
    if (bytes) release(bytes);
    return true;
  }

  /**
   * @param {number} piece
   * @param {Uint8Array} raw
   */
  #have(piece, raw) {
    this.#coming.delete(piece);
    this.#tries.delete(piece);
    place(this.#parts.pieces[piece], raw, this.#take);
    release(raw);
    for (const open of [...this.#open]) {  // a bundle opened meanwhile does not have it
      if (!open.pieces.delete(piece) || open.pieces.size > 0) continue;
      this.#open.delete(open);
      open.done();
    }
  }

  /**
   * @param {number} piece
   * @param {unknown} wrong
   */
  #comeAgain(piece, wrong) {
    const tries = (this.#tries.get(piece) ?? 0) + 1;
    this.#tries.set(piece, tries);
    if (tries < TRIES) {
      setTimeout(() => {
        this.#coming.delete(piece);
        this.#pump();
      }, 1000 * WAIT_S * 2 ** Math.min(tries - 1, 5));
    } else if (!this.#failed) {
      this.#failed = true;
      this.#onFail(wrong);
    }
  }

  /**
   * Some bytes of the file. Past the browser's cache: Chromium's answers one request of an address
   * after the other.
   * @param {number} at
   * @param {number} size
   * @param {object} [options]
   */
  #request(at, size, options) {
    return this.#parts.part(
        at, size, {ranged: true, cache: 'no-store', stall: STALL_S, ...options});
  }
}
