// @ts-check
// A bundle on its way: a raw one comes whole, a packed one (formats/shipping.md) piece by piece, in
// the order of need.
import {ENTRY_BYTES, HEADER_BYTES} from './bundle.js';
import {joined, within} from './download.js';

/** Times that a piece which is refused is decoded. */
const MOST_DECODED = 3;
/** Seconds for a file's end to be told, which makes the browser keep it. */
const END_S = 2;
/** As formats/transport/recipe.hpp has them. */
const MAGIC = [0x89, 0x4d, 0x4f, 0x52, 0x0d, 0x0a, 0x1a, 0x0a];
const RECIPE_BYTES = 64, PIECE_BYTES = 64, MOST_PIECES = 1 << 20;
/**
 * More are refused by the engine, for their bytes. Then types of sections, as formats/sections.hpp
 * has them.
 */
const MOST_SECTIONS = 1 << 16, MEDIA = 263, FIRST_OF_GPU = 512;
/** Of a raw bundle's bytes, passed on together: as large as pieces are. */
const PASSED = 256 << 10;
/**
 * A form, there: a packed tracker record, most of a first stage, which is unpacked while it comes.
 */
const PACKED_RECORD = 7;
/**
 * What pieces are needed for: to find patterns, to show each model as coarse as there is, all
 * else.
 */
export const STAGE = {
  find: 1,
  show: 2,
  refine: 3
};

/**
 * @typedef {{ offset: number, bytes: Uint8Array }} Part of a bundle
 * @typedef {(offset: number, bytes: Uint8Array) => void} Take
 * @typedef {{ offset: number, size: number, second?: number, secondSize?: number }} Place
 * @typedef {Place & { index: number, at: number, stored: number, form: number, stage: number }}
 * Piece
 * @typedef {{ ask: (question: object, transfer?: Transferable[]) => Promise<any>, close: () => void
 * }} Decoder
 * @typedef {import('./download.js').Source} Source
 * @typedef {(Arrival | RawArrival) & {inOrder?: boolean, tracked?: Part[] | null}} AnyArrival
 */

/**
 * Puts the raw bytes of a piece in their places: those of a mesh have two.
 * @param {Place} piece
 * @param {Uint8Array} raw
 * @param {Take} take
 */
export function place({offset, second, secondSize = 0}, raw, take) {
  const end = raw.length - secondSize;
  const rest = raw.slice(end);  // whoever takes bytes may give their memory away
  take(offset, raw.subarray(0, end));
  if (second) take(second, rest);
}

/** @param {Uint8Array} start */
export const isPacked = (start) => MAGIC.every((byte, i) => start[i] === byte);

/**
 * A raw bundle on its way: the parts to open it and its patterns, then, in the file's order, the
 * parts to draw.
 */
export class RawArrival {
  #source;
  #at = 0;
  /** Where the last stage begins. */
  #rest = 0;
  inOrder = true;
  /** @type {Part[]} */
  found = [];
  size = 0;

  /** @param {Source} source */
  constructor(source) { this.#source = source; }

  /**
   * Downloads all before vertices, indices and blocks.
   * @param {Uint8Array} start of the file
   */
  async begin(start) {
    let head = start;
    /** @param {number} to */
    const grow = async (to) => {
      const more = await this.#source.take(to - head.length, false);
      head = joined([head, more]);
      return new DataView(head.buffer);
    };
    let view = await grow(HEADER_BYTES);
    const count = head.length < HEADER_BYTES ? 0 : view.getUint32(12, true);
    const tables = HEADER_BYTES + ENTRY_BYTES * Math.min(count, MOST_SECTIONS);
    view = await grow(tables);
    let end = Infinity, media = Infinity;
    for (let entry = HEADER_BYTES; entry < tables && tables <= head.length; entry += ENTRY_BYTES) {
      const type = view.getUint32(entry, true), at = Number(view.getBigUint64(entry + 16, true));
      if (type >= FIRST_OF_GPU) end = Math.min(end, at);
      else if (type === MEDIA) media = Math.min(media, at);
    }
    if (end > head.length) await grow(end);
    this.#at = this.#rest = head.length;
    // A file that is no bundle is refused; one without models is opened unchanged.
    this.size =
        end < Infinity && end <= head.length ? Number(view.getBigUint64(16, true)) : head.length;
    this.found = [{offset: 0, bytes: head}];
    this.#source.total = this.size;
    this.tracked =
        [{offset: 0, bytes: head.slice(0, media)}];  // its own memory: it is copied whole
  }

  /**
   * @param {number} stage
   * @param {Take} take
   */
  async download(stage, take) {
    if (stage !== STAGE.refine) return;
    while (this.#at < this.size) {
      const size = Math.min(PASSED, this.size - this.#at);
      take(this.#at, await this.#source.take(size));
      this.#at += size;
    }
    this.close();
  }

  /**
   * In place of download(), for lod-stream.js: the last stage in parts that can be had by
   * themselves. first: of those that have not come.
   */
  parts() {
    const pieces = [];
    for (let at = this.#rest; at < this.size; at += PASSED) {
      const size = Math.min(PASSED, this.size - at);
      pieces.push({at, stored: size, offset: at, size});
    }
    return {
      ...this.#source.leave(),
      pieces,
      first: 0,
      decode: async (/** @type {unknown} */ _, /** @type {Uint8Array} */ bytes) => bytes
    };
  }

  /** The same again, for the last stage. */
  async again() {
    const other = new RawArrival(this.#source.from(this.#rest));
    other.#at = other.#rest = this.#rest;
    return Object.assign(other, {size: this.size});
  }

  close() { this.#source.close(); }
}

export class Arrival {
  #source;
  /** @type {Uint8Array | undefined} */
  #recipe;
  /** Makes #decoder: calls of a worker that decodes. */
  #openDecoder;
  #decoder;
  /**
   * Of the recipe.
   * @type {Piece[]}
   */
  #pieces = [];
  #next = 0;
  /**
   * Raw, of the first stage, until a view has taken them.
   * @type {Part[]}
   */
  found = [];
  /** Of the bundle, bytes. */
  size = 0;

  /**
   * @param {Source} source
   * @param {() => Decoder} openDecoder
   */
  constructor(source, openDecoder) {
    this.#source = source;
    this.#openDecoder = openDecoder;
    this.#decoder = openDecoder();
  }

  /**
   * Downloads the recipe and the parts to find patterns.
   * @param {Uint8Array} start of the file
   */
  async begin(start) {
    const header = new Uint8Array(RECIPE_BYTES);
    header.set(start);
    header.set(await this.#source.take(RECIPE_BYTES - start.length), start.length);
    const count = Math.min(
        new DataView(header.buffer).getUint32(12, true),
        MOST_PIECES);  // more is refused below, for its length
    let recipe = new Uint8Array(RECIPE_BYTES + PIECE_BYTES * count);
    recipe.set(header);
    recipe.set(await this.#source.take(PIECE_BYTES * count), RECIPE_BYTES);
    await this.#tried(() => this.#decoder.ask({type: 'recipe', bytes: recipe}), async () => {
      recipe = await this.#source.again(0, recipe.length);
    });
    this.#recipe = recipe;
    this.#read(new DataView(recipe.buffer));
    await this.download(STAGE.find, (offset, bytes) => this.found.push({offset, bytes}));
  }

  /** @param {DataView} view */
  #read(view) {
    /** @param {number} at */
    const long = (at) => Number(view.getBigUint64(at, true));
    this.size = long(16);
    let at = view.byteLength;
    for (let record = RECIPE_BYTES; record < view.byteLength; record += PIECE_BYTES) {
      const stored = view.getUint32(record + 44, true);
      this.#pieces.push({
        index: this.#pieces.length,
        at,
        stored,
        offset: long(record + 24),
        second: long(record + 32),
        size: view.getUint32(record + 40, true),
        secondSize: view.getUint32(record + 48, true),
        form: view.getUint8(record + 54),
        stage: view.getUint8(record + 55),
      });
      at += stored;
    }
    this.#source.total = at;
  }

  /**
   * Refused pieces come again, a few times.
   * @param {() => Promise<any>} decode
   * @param {() => Promise<void>} load
   */
  async #tried(decode, load) {
    for (let tries = 1;; ++tries) {
      try {
        return await decode();
      } catch (error) {
        if (tries === MOST_DECODED ||
            /** @type {{ code: string }} */ (error).code.startsWith('web.'))
          throw error;
        await load();
      }
    }
  }

  /**
   * @param {Piece} piece
   * @param {Uint8Array} bytes
   * @param {Take} take
   */
  async #decode(piece, bytes, take) {
    const {index, at, stored, size} = piece;
    let copy = bytes;
    const answer = await this.#tried(
        () => this.#decoder.ask({type: 'piece', index, stored: copy, size}, [copy.buffer]),
        async () => {
          copy = await this.#source.again(at, stored);
        });
    place(piece, answer.bytes, take);
  }

  /**
   * @param {Piece} piece
   * @param {number} at
   * @param {Uint8Array} part
   */
  #begin({index, stored}, at, part) {
    this.#decoder.ask({type: 'begin', index, stored, at, bytes: part.slice()})
        .catch(() => {});  // #decode() receives
  }

  /**
   * Downloads the pieces of a stage; one is decoded while the next one comes.
   * @param {number} stage
   * @param {Take} take
   */
  async download(stage, take) {
    let before;
    for (; this.#pieces[this.#next]?.stage <= stage; ++this.#next) {
      const piece = this.#pieces[this.#next];
      const bytes = await this.#source.take(
          piece.stored, true,
          piece.form === PACKED_RECORD &&
              ((/** @type {number} */ at, /** @type {Uint8Array} */ part) =>
                   this.#begin(piece, at, part)));
      await before;
      before = this.#decode(piece, bytes, take);
      before.catch(() => {});  // told below
    }
    await before;
    if (stage === STAGE.show)
      this.#source.patient = true;  // a visitor sees something, and waits for no more
    if (this.#next < this.#pieces.length) return;
    await within(END_S, this.#source.take(1, false), () => {}).catch(() => {});
    this.close(true);
  }

  /**
   * In place of download(), for lod-stream.js: parts that can be had by themselves. first: of those
   * that have not come.
   */
  parts() {
    /**
     * @param {Piece} piece
     * @param {Uint8Array} stored
     */
    const decode = async ({index, size}, stored) =>
        (await this.#decoder.ask({type: 'piece', index, stored, size}, [stored.buffer])).bytes;
    return {...this.#source.leave(), pieces: this.#pieces, first: this.#next, decode};
  }

  /** The same again, for the last stage. */
  async again() {
    const next = this.#pieces.findIndex((piece) => piece.stage === STAGE.refine);
    const other = new Arrival(
        this.#source.from(this.#pieces[next]?.at ?? this.#source.total), this.#openDecoder);
    other.#next = next < 0 ? this.#pieces.length : next;
    Object.assign(other, {size: this.size});
    other.#pieces = this.#pieces;
    other.#recipe = this.#recipe;
    await other.#decoder.ask({type: 'recipe', bytes: this.#recipe});
    return other;
  }

  close(whole = false) {
    this.#source.close(whole);
    this.#decoder.close();
  }
}
