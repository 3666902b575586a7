// A bundle on its way: a raw one comes whole, a packed one (formats/shipping.md) piece by piece, in the order of need.
import { ENTRY_BYTES, HEADER_BYTES } from './bundle.js';
import { ModarError, release } from './engine.js';

/** Times that something is asked for again, and seconds before the second time: a phone's connection breaks now and then. Where one request in ten fails, one piece in a thousand is missing. */
const TRIES = 3;
const WAIT_S = 1;
/** As formats/transport/recipe.hpp has them. */
const MAGIC = [0x89, 0x4d, 0x4f, 0x52, 0x0d, 0x0a, 0x1a, 0x0a];
const RECIPE_BYTES = 64, PIECE_BYTES = 64, MOST_PIECES = 1 << 20;
/** More are refused by the engine, for their bytes. Then types of sections, as formats/sections.hpp has them. */
const MOST_SECTIONS = 1 << 16, MEDIA = 263, FIRST_OF_GPU = 512;
/** Of a raw bundle's bytes, passed on together: as large as pieces are. */
const PASSED = 256 << 10;
/** A form, there: a packed tracker record, most of a first stage, which is unpacked while it comes. */
const PACKED_RECORD = 7;
/**
 * Bytes that are asked for first and alone. On a slow line the engine comes at the same time: the rest of the first stage is asked for
 * when these are there, arrives when the engine runs, and is unpacked as fast as it comes. Set by hand.
 */
const START = 40 << 10;
/**
 * Bytes that are asked for at once after that: a browser's memory takes what comes faster than it is unpacked, on a good line all of it.
 * The next ones take a round trip more. Set by hand.
 */
const MOST_ASKED = 4 << 20;
/** Bytes of a file of which a part came: it says itself how many, soon. */
const UNKNOWN = 1e15;
/** What pieces are needed for: to find patterns, to show each model as coarse as there is, all else. */
export const STAGE = { find: 1, show: 2, refine: 3 };

const pause = (seconds) => new Promise((resolve) => { setTimeout(resolve, 1000 * seconds); });

/** All in one, of its own memory: a blob's is not counted by the browser, which would keep many. */
function joined(parts) {
  const all = new Uint8Array(parts.reduce((size, { length }) => size + length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

/** A reader that reads on by itself, and calls back at the end. */
function eager(reader, onEnd) {
  const reads = [];
  const next = () => {
    const read = reader.read();
    reads.push(read);
    read.then(({ done }) => (done ? onEnd : next)(), () => {});
  };
  next();
  return { read: () => reads.shift(), cancel: () => reader.cancel() };
}

/** A file's bytes from first to last: after a connection that broke, from where it did. */
export class Source {
  #bundle;
  /** Its bytes were given, not its address. */
  #given;
  #abort = new AbortController();
  #copy;
  #reader = null;
  /** Came, and was not taken. */
  #chunk = new Uint8Array();
  #taken = 0;
  /** Bytes before it are not asked for. */
  #first = 0;
  /** Where an address says so (?first=...): ends of bytes that are asked for alone, since the rest can wait until they are there. */
  #stops = [];
  /** Of the second stop's bytes, as soon as those of the first one are there: the promise of #open(). */
  #second = null;
  total = 0;
  /** While it is true, what does not come is waited for. */
  patient = false;
  /** (taken, total) is told what was taken, bytes. */
  onProgress = null;

  /**
   * bundle: an address, or bytes. copy: add(bytes) is given what is taken, in order, and copies it at once; then end(whole) is called
   * once. whole: those bytes are all of a packed bundle, and verified. kept(from): what an earlier copy has from a place on, if anything.
   */
  constructor(bundle, copy = null) {
    this.#given = typeof bundle !== 'string' && !(bundle instanceof URL);
    this.#bundle = this.#given && !(bundle instanceof Uint8Array) ? new Uint8Array(bundle) : bundle;
    const first = this.#given ? 0 : Number(/[?&]first=(\d+)/.exec(bundle)?.[1] ?? 0);
    if (first > 0) this.#stops = [Math.min(START, first), first];
    this.#copy = copy;
  }

  #failed(cause) {
    return new ModarError({ code: 'web.download', where: this.#given ? '' : String(this.#bundle), cause, cure: 'check the network and load the page again' });
  }

  /** A reader of all from a place on. again: past what the browser has kept of it. */
  async #open(from, again) {
    const chunk = this.#given ? this.#bundle.subarray(from) : !again && await this.#copy?.kept(from);
    if (chunk) {
      const end = from + chunk.length;
      this.#stops.push(end);
      this.total ||= this.#given ? end : UNKNOWN;
      return { reader: { read: async () => ({ done: true }), cancel: async () => {} }, chunk };
    }
    const { signal } = this.#abort;
    let end = this.#stops.find((stop) => stop > from);
    if (!end && this.#stops.length > 0) this.#stops.push(end = from + MOST_ASKED);
    const headers = from > 0 || end ? { Range: `bytes=${from}-${end ? end - 1 : ''}` } : {};
    const response = await fetch(this.#bundle, { signal, headers, cache: again ? 'no-store' : 'default' })
      .catch(() => { throw this.#failed('the bundle could not be loaded'); });
    if (!response.ok) throw Object.assign(this.#failed(`the server answered ${response.status}`), { final: response.status < 500 });
    this.total ||= end ? UNKNOWN : from + (Number(response.headers.get('content-length')) || 0);  // of a part, the bundle says it
    let reader = response.body.getReader();
    if (response.status === 206 && end && end === this.#stops[0]) {
      reader = eager(reader, () => {
        this.#second = this.#open(end);
        this.#second.catch(() => {});  // told to #read()
      });
    }
    // A host without ranges begins at the first byte.
    for (let skip = response.status === 206 ? 0 : from; skip > 0;) {
      const { done, value } = await reader.read();
      if (done) throw this.#failed('it ends too early');
      if (value.length > skip) return { reader, chunk: value.subarray(skip) };
      skip -= value.length;
    }
    return { reader, chunk: new Uint8Array() };
  }

  async #read() {
    if (!this.#reader) {
      const again = this.#taken > this.#first && !this.#stops.includes(this.#taken);
      const second = this.#taken === this.#stops[0] && this.#second;
      this.#second = null;
      const { reader, chunk } = await (second || this.#open(this.#taken, again));
      this.#reader = reader;
      if (chunk.length) return chunk;
    }
    const { done, value } = await this.#reader.read();
    return done ? null : value;
  }

  /** Gives up, or waits before the next try. */
  async #breathe(tries, error) {
    this.#reader?.cancel().catch(() => {});
    this.#reader = null;
    if (this.#abort.signal.aborted || error.final || (tries >= TRIES && !this.patient)) throw error;
    await pause(WAIT_S * 2 ** Math.min(tries - 1, 5));
  }

  /**
   * The next bytes, so many or to the end; whole: it is an error where they are fewer. onPart(at, bytes): is told of parts as they
   * come, where they are more than one.
   */
  async take(count, whole = true, onPart = null) {
    const parts = [], spent = [];
    let size = 0;
    for (let tries = 0; size < count;) {
      if (this.#chunk.length === 0) {
        let error = null;
        const chunk = await this.#read().catch((cause) => {
          error = cause instanceof ModarError ? cause : this.#failed(`the network broke off after ${this.#taken} bytes`);
        });
        if (!error && chunk === null && this.#stops.includes(this.#taken) && this.#taken < this.total) {
          this.#reader = null;  // now what follows
          continue;
        }
        if (!error && chunk === null && !whole) break;
        if (!chunk) {
          await this.#breathe(++tries, error ?? this.#failed(`it ends after ${this.#taken} bytes`));
          continue;
        }
        tries = 0;
        this.#chunk = chunk;
      }
      const part = this.#chunk.subarray(0, count - size);
      this.#chunk = this.#chunk.subarray(part.length);
      if (!this.#given && this.#chunk.length === 0) spent.push(part);
      parts.push(part);
      if (onPart && part.length < count) onPart(size, part);
      size += part.length;
      this.#taken += part.length;
      this.#copy?.add(part);
      this.onProgress?.(this.#taken, Math.max(this.total, this.#taken));
    }
    const bytes = joined(parts);
    release(...spent);
    return bytes;
  }

  /** The same file from a place on, once more. */
  from(at) {
    const other = new Source(this.#bundle);
    other.#taken = other.#first = at;
    other.total = this.total;
    other.patient = true;
    return other;
  }

  /** Bytes that came before, once more. */
  async again(from, count) {
    this.#endCopy(false);  // it has what was no good
    const other = new Source(this.#bundle);
    other.#abort = this.#abort;
    other.#taken = from;
    try {
      return await other.take(count);
    } finally {
      other.#reader?.cancel().catch(() => {});
    }
  }

  /** Brings nothing more by itself. @returns {bundle, signal}: for requests of one's own, until close() */
  leave() {
    this.#reader?.cancel().catch(() => {});
    this.#reader = null;
    this.#chunk = new Uint8Array();
    this.#endCopy(false);
    return { bundle: this.#bundle, signal: this.#abort.signal };
  }

  #endCopy(whole) {
    this.#copy?.end(whole);
    this.#copy = null;
  }

  /** whole: what was taken is verified. */
  close(whole = false) {
    this.#abort.abort();
    this.#endCopy(whole && this.#taken === this.total);
  }
}

export const isPacked = (start) => MAGIC.every((byte, i) => start[i] === byte);

/** A raw bundle on its way: what it is opened with and its patterns, then, in the file's order, what is drawn from. */
export class RawArrival {
  #source;
  #at = 0;
  /** Where the last stage begins. */
  #rest = 0;
  inOrder = true;
  found = [];
  size = 0;

  constructor(source) {
    this.#source = source;
  }

  /** Brings all that lies before vertices, indices and blocks. start: of the file. */
  async begin(start) {
    let head = start;
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
    // What is no bundle, or has no models, is refused or opened as it is.
    this.size = end < Infinity && end <= head.length ? Number(view.getBigUint64(16, true)) : head.length;
    this.found = [{ offset: 0, bytes: head }];
    this.#source.total = this.size;
    this.tracked = [{ offset: 0, bytes: head.slice(0, media) }];  // its own memory: it is copied whole
  }

  /** take(offset, bytes) */
  async bring(stage, take) {
    if (stage !== STAGE.refine) return;
    while (this.#at < this.size) {
      const size = Math.min(PASSED, this.size - this.#at);
      take(this.#at, await this.#source.take(size));
      this.#at += size;
    }
    this.close();
  }

  /** In place of bring(), for wanted.js: the last stage in parts that can be had by themselves. first: of those that have not come. */
  parts() {
    const pieces = [];
    for (let at = this.#rest; at < this.size; at += PASSED) {
      const size = Math.min(PASSED, this.size - at);
      pieces.push({ at, stored: size, offset: at, size });
    }
    return { ...this.#source.leave(), pieces, first: 0, decode: async (_, bytes) => bytes };
  }

  /** The same again, for the last stage. */
  async again() {
    const other = new RawArrival(this.#source.from(this.#rest));
    other.#at = other.#rest = this.#rest;
    return Object.assign(other, { size: this.size });
  }

  close() {
    this.#source.close();
  }
}

export class Arrival {
  #source;
  #recipe;
  /** Makes #decoder: calls of a worker that decodes. */
  #openDecoder;
  #decoder;
  /** Of the recipe: {index, at, stored, offset, size, form, stage}. */
  #pieces = [];
  #next = 0;
  /** Raw, of the first stage: [{offset, bytes}], until a view has taken them. */
  found = [];
  /** Of the bundle, bytes. */
  size = 0;

  constructor(source, openDecoder) {
    this.#source = source;
    this.#openDecoder = openDecoder;
    this.#decoder = openDecoder();
  }

  /** Brings the recipe and what patterns are found with. start: of the file. */
  async begin(start) {
    const header = new Uint8Array(RECIPE_BYTES);
    header.set(start);
    header.set(await this.#source.take(RECIPE_BYTES - start.length), start.length);
    const count = Math.min(new DataView(header.buffer).getUint32(12, true), MOST_PIECES);  // more is refused below, for its length
    let recipe = new Uint8Array(RECIPE_BYTES + PIECE_BYTES * count);
    recipe.set(header);
    recipe.set(await this.#source.take(PIECE_BYTES * count), RECIPE_BYTES);
    await this.#tried(() => this.#decoder.ask({ type: 'recipe', bytes: recipe }),
      async () => { recipe = await this.#source.again(0, recipe.length); });
    this.#recipe = recipe;
    this.#read(new DataView(recipe.buffer));
    await this.bring(STAGE.find, (offset, bytes) => this.found.push({ offset, bytes }));
  }

  #read(view) {
    const long = (at) => Number(view.getBigUint64(at, true));
    this.size = long(16);
    let at = view.byteLength;
    for (let record = RECIPE_BYTES; record < view.byteLength; record += PIECE_BYTES) {
      const stored = view.getUint32(record + 44, true);
      this.#pieces.push({
        index: this.#pieces.length, at, stored, offset: long(record + 24), size: view.getUint32(record + 40, true),
        form: view.getUint8(record + 54), stage: view.getUint8(record + 55),
      });
      at += stored;
    }
    this.#source.total = at;
  }

  /** What is refused comes again, a few times. */
  async #tried(decode, bring) {
    for (let tries = 1; ; ++tries) {
      try {
        return await decode();
      } catch (error) {
        if (tries === TRIES || error.code === 'web.worker' || error.code === 'web.memory') throw error;
        await bring();
      }
    }
  }

  async #decode({ index, at, stored, offset, size }, bytes, take) {
    let copy = bytes;
    const answer = await this.#tried(() => this.#decoder.ask({ type: 'piece', index, stored: copy, size }, [copy.buffer]),
      async () => { copy = await this.#source.again(at, stored); });
    take(offset, answer.bytes);
  }

  #begin({ index, stored }, at, part) {
    this.#decoder.ask({ type: 'begin', index, stored, at, bytes: part.slice() }).catch(() => {});  // #decode() is told
  }

  /** Brings the pieces of a stage; one is decoded while the next one comes. take(offset, bytes) */
  async bring(stage, take) {
    let before;
    for (; this.#pieces[this.#next]?.stage <= stage; ++this.#next) {
      const piece = this.#pieces[this.#next];
      const bytes = await this.#source.take(piece.stored, true, piece.form === PACKED_RECORD && ((at, part) => this.#begin(piece, at, part)));
      await before;
      before = this.#decode(piece, bytes, take);
      before.catch(() => {});  // told below
    }
    await before;
    if (stage === STAGE.show) this.#source.patient = true;  // a visitor sees something, and waits for no more
    if (this.#next < this.#pieces.length) return;
    await this.#source.take(1, false).catch(() => {});  // to its end: then the browser keeps it
    this.close(true);
  }

  /** In place of bring(), for wanted.js: parts that can be had by themselves. first: of those that have not come. */
  parts() {
    const decode = async ({ index, size }, stored) => (await this.#decoder.ask({ type: 'piece', index, stored, size }, [stored.buffer])).bytes;
    return { ...this.#source.leave(), pieces: this.#pieces, first: this.#next, decode };
  }

  /** The same again, for the last stage. */
  async again() {
    const next = this.#pieces.findIndex((piece) => piece.stage === STAGE.refine);
    const other = new Arrival(this.#source.from(this.#pieces[next]?.at ?? this.#source.total), this.#openDecoder);
    other.#next = next < 0 ? this.#pieces.length : next;
    Object.assign(other, { size: this.size });
    other.#pieces = this.#pieces;
    other.#recipe = this.#recipe;
    await other.#decoder.ask({ type: 'recipe', bytes: this.#recipe });
    return other;
  }

  close(whole = false) {
    this.#source.close(whole);
    this.#decoder.close();
  }
}
