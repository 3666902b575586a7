// @ts-check
// Downloads that end: a Source reads a file from first to last byte, and each of its waits has a
// deadline.
import {ModarError, release} from './engine.js';

/**
 * Attempts of a request, and seconds before the second time: where one request in ten fails, one
 * file in a thousand is missing.
 */
const TRIES = 3;
const WAIT_S = 1;
/**
 * The same where something is shown already: for some 100 seconds, then the visitor sees an error.
 */
const PATIENT_TRIES = 8;
/**
 * Seconds that may pass without an answer, and bytes a second that are too few on average over
 * that time.
 */
const STALL_S = 15;
const LEAST_RATE = 500;
/** Bytes that have to come before a break counts as the first one again. */
const PROGRESS = 4096;
/**
 * Bytes that are requested first and alone: the rest of a first stage comes when the engine
 * runs.
 */
const START = 40 << 10;
/**
 * Bytes that are requested at once after the first stage: a browser's memory takes what comes
 * faster than it is unpacked.
 */
const MOST_ASKED = 4 << 20;
/** Bytes of a file of unknown size, for those who show progress. */
const UNKNOWN = 1e15;
/** Answers that another try may change. */
const PASSING = [408, 425, 429];

const NOTHING = new Uint8Array();

/**
 * @typedef {{from: number, end: number, last: boolean, total: number, ranged?: boolean,
 *     read: () => Promise<Uint8Array | null>}} Answer
 * @typedef {{copy?: any, from?: number, end?: number, tries?: number, stall?: number, rate?:
 * number, cache?: RequestCache, any?: boolean, ranged?: boolean}} Options
 * @typedef {{code?: string, cure?: string, status?: number, final?: boolean, rangeless?: boolean}}
 * More
 */

/** @param {number} seconds */
const pause = (seconds) => new Promise((resolve) => {
  setTimeout(resolve, 1000 * seconds);
});

/**
 * A promise's value, or that of otherwise() after the given seconds.
 * @template T, U
 * @param {number} seconds
 * @param {T | Promise<T>} promise
 * @param {() => U} otherwise
 * @returns {Promise<Awaited<T> | U>}
 */
export function within(seconds, promise, otherwise) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  const late = new Promise((resolve) => {
                 timer = setTimeout(resolve, 1000 * seconds);
               }).then(otherwise);
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

/**
 * All in one, of its own memory: a blob's is not counted by the browser, which would keep many.
 * @param {Uint8Array[]} parts
 */
export function joined(parts) {
  const all = new Uint8Array(parts.reduce((size, {length}) => size + length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

/**
 * What a 206 says it has: [first byte, byte behind the last, bytes of the file], as far as it says
 * so.
 * @param {Response} response
 */
function rangeOf({headers}) {
  const [, first, last, all] =
      /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(headers.get('content-range') ?? '') ?? [];
  return first ? [Number(first), Number(last) + 1, Number(all) || 0] : [];
}

/**
 * Why this is no answer to a request of bytes from `from` to `end`: [cause, more of the error]; or
 * nothing.
 * @param {Response} response
 * @param {number} from
 * @param {number} end
 * @param {Options} options
 * @param {number} total
 * @returns {[string, More] | false | undefined}
 */
function wrongWith(response, from, end, {any, ranged}, total) {
  const {status} = response;
  const type = response.headers.get('content-type') ?? '';
  if (status === 511 || (status < 300 && !any && type.startsWith('text/html'))) {
    return [
      'a page came in place of the file',
      {code: 'web.login', cure: 'log in to this network and try again', final: true}
    ];
  }
  if (status !== 200 && status !== 206)
    return [
      `the server answered ${status}`, {status, final: status < 500 && !PASSING.includes(status)}
    ];
  if (status === 200) return ranged && ['the server has no ranges', {final: true}];
  const [first = from, to = end, all] = rangeOf(response);
  if (type.startsWith('multipart/') || first !== from || to <= from || to > end)
    return ['other bytes came than those asked for', {rangeless: true}];
  return all > 0 && total > 0 && all !== total &&
      ['the file has changed', {code: 'web.changed', final: true}];
}

/**
 * What comes of a request: {from, end: behind the last byte that it says it has, or Infinity; last:
 * the file ends there; total: bytes of the file, or 0; read(): bytes, one at least, or null at the
 * end}.
 * @param {Response} response
 * @param {number} from
 * @param {number} asked
 * @param {{stall: number, rate: number}} options
 * @returns {Answer}
 */
function answerOf(response, from, asked, {stall, rate}) {
  const whole = response.status === 200;
  const [, end = whole ? Infinity : asked, total = 0] = whole ? [] : rangeOf(response);
  const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader();
  let skip = whole ? from : 0;  // a host without ranges begins at the first byte
  let credit = stall;           // seconds that may still pass without more bytes
  const read = async () => {
    for (;;) {
      const began = Date.now();
      const {done, value} = await within(credit, reader.read(), () => {
        throw new Error('too slow');
      });
      if (done) return null;
      credit = Math.min(stall, credit - (Date.now() - began) / 1000 + value.length / rate);
      const part = value.subarray(Math.min(skip, value.length));
      skip -= value.length - part.length;
      if (part.length > 0) return part;
    }
  };
  return {
    from,
    end,
    last: whole || (total > 0 ? end >= total : asked === Infinity),
    total,
    ranged: !whole,
    read
  };
}

/**
 * The same of bytes that are there.
 * @param {Uint8Array} bytes
 * @param {number} from
 * @param {boolean} last
 * @returns {Answer}
 */
function given(bytes, from, last) {
  const parts = [bytes];
  const end = from + bytes.length;
  return {from, end, last, total: last ? end : 0, read: async () => parts.pop() ?? null};
}

/**
 * An answer that reads on by itself, and calls back at its end.
 * @param {Answer} answer
 * @param {() => void} onEnd
 * @returns {Answer}
 */
function eager(answer, onEnd) {
  /** @type {Promise<Uint8Array | null>[]} */
  const reads = [];
  const next = () => {
    const read = answer.read();
    reads.push(read);
    read.then((bytes) => (bytes ? next : onEnd)(), () => {});
  };
  next();
  return {...answer, read: () => /** @type {Promise<Uint8Array | null>} */ (reads.shift())};
}

/**
 * The states of a Source, and what may follow each. `idle`: nothing is requested. `asking`: until
 * an answer begins. `reading`: its bytes come. `waiting`: before another try. `ended`: the last
 * byte came. `failed`, `closed`: take() throws.
 * @type {Record<string, string[]>}
 */
export const NEXT = {
  idle: ['asking'],
  asking: ['reading', 'waiting', 'failed'],
  reading: ['idle', 'waiting', 'ended', 'failed'],
  waiting: ['idle'],
  ended: ['waiting', 'failed'],
  failed: [],
  closed: [],
};

/** A file's bytes from first to last: after a connection that broke, from where it did. */
export class Source {
  state = 'idle';
  /** @type {any} */
  #bundle;
  /** Its bytes were given, not its address. */
  #given;
  #options;
  /** @type {any} */
  #copy;
  /** @type {Answer | null} */
  #answer = null;
  /**
   * Of the second stop's bytes, as soon as those of the first one are there: the promise of an
   * answer.
   * @type {Promise<Answer> | null}
   */
  #ahead = null;
  /**
   * What ends the requests that are open, and the sources of part().
   * @type {Set<AbortController>}
   */
  #requests = new Set();
  /** @type {Set<Source>} */
  #parts = new Set();
  /** Came, and was not taken. */
  #chunk = NOTHING;
  #taken;
  /** Tries without PROGRESS, and what came since the last one. */
  #tries = 0;
  #came = 0;
  /** @type {unknown} */
  #error = null;
  /** Ranges that the server gave were wrong. */
  #rangeless = false;
  /**
   * Where an address says so (?first=...): ends of bytes that are requested alone, since the rest
   * can wait until they are there.
   * @type {number[]}
   */
  #stops = [];
  /**
   * Bytes of the file; 0: unknown. And what one answer says, of what it may have packed for the
   * way.
   */
  total = 0;
  #length = 0;
  /** While it is true, what does not come is waited for longer. */
  patient = false;
  /**
   * (taken, total) receives the taken bytes.
   * @type {((taken: number, total: number) => void) | null}
   */
  onProgress = null;

  /**
   * bundle: an address, or bytes. copy: copy.js. from, end: bytes of the file. any: HTML is no
   * mistake. ranged: a server without ranges has failed.
   * @param {any} bundle
   * @param {Options} options
   */
  constructor(bundle, {
    copy = null,
    from = 0,
    end = Infinity,
    tries = TRIES,
    stall = STALL_S,
    rate = LEAST_RATE,
    cache = 'default',
    any,
    ranged
  } = {}) {
    this.#given = typeof bundle !== 'string' && !(bundle instanceof URL);
    this.#bundle = this.#given && !(bundle instanceof Uint8Array) ? new Uint8Array(bundle) : bundle;
    this.#options = {end, stall, rate, cache, any, ranged, tries: this.#given ? 1 : tries};
    const first =
        this.#given || end < Infinity ? 0 : Number(/[?&]first=(\d+)/.exec(bundle)?.[1] ?? 0);
    if (first > 0) this.#stops = [Math.min(START, first), first];
    this.#copy = copy;
    this.#taken = from;
  }

  /**
   * more: code, cure, status (of HTTP), final (only a try past the browser's cache may help),
   * rangeless.
   * @param {string} cause
   * @param {More} more
   */
  #failed(
      cause,
      {code = 'web.download', cure = 'check the network and load the page again', ...more} = {}) {
    return Object.assign(
        new ModarError({code, where: this.#given ? '' : String(this.#bundle), cause, cure}), more);
  }

  /** @param {string} state */
  #to(state) {
    if (!NEXT[this.state].includes(state)) throw new Error(`${this.state} became ${state}`);
    this.state = state;
  }

  /**
   * The bytes from a place on, up to the next stop.
   * @param {number} from
   * @returns {Promise<Answer>}
   */
  async #ask(from) {
    if (this.#given) return given(this.#bundle.subarray(from), from, true);
    const kept = this.#tries === 0 && await this.#copy?.kept(from);
    if (kept) return given(kept, from, false);
    const {stall, cache} = this.#options;
    const stop = this.#stops.find((each) => each > from) ??
        (this.#stops.length > 0 ? from + MOST_ASKED : Infinity);
    const end = this.#rangeless ? Infinity : Math.min(stop, this.#options.end);
    /** @type {Record<string, string>} */
    const headers = !this.#rangeless && (from > 0 || end < Infinity) ?
        {Range: `bytes=${from}-${end < Infinity ? end - 1 : ''}`} :
        {};
    const abort = new AbortController();
    this.#requests.add(abort);
    const asked = {
      signal: abort.signal,
      headers,
      cache: this.#tries > 0 ? 'reload' : cache
    };  // past an answer that the browser has kept
    const response = await within(stall, fetch(this.#bundle, asked), () => {
      throw new Error(`no answer in ${stall} s`);
    });
    const wrong = wrongWith(response, from, end, this.#options, this.total);
    if (wrong) throw this.#failed(...wrong);
    this.#length = Number(response.headers.get('content-length')) || 0;
    const answer = answerOf(response, from, end, this.#options);
    if (!answer.ranged || answer.end !== this.#stops[0]) return answer;
    return eager(answer, () => {
      this.#ahead = this.#ask(answer.end);
      this.#ahead.catch(() => {});  // told to #step()
    });
  }

  /**
   * What a state does: afterwards there is a chunk, or another state.
   * @type {Record<string, () => Promise<void>>}
   */
  #steps = {
    idle: async () => {
      this.#to('asking');
      this.#answer = await (this.#ahead ?? this.#ask(this.#taken));
      this.#ahead = null;
      this.total ||= this.#answer.total;
      this.#to('reading');
    },
    reading:
        async () => {
          const {from, end, last} = /** @type {Answer} */ (this.#answer);
          this.#chunk = await /** @type {Answer} */ (this.#answer).read() ?? NOTHING;
          this.#came += this.#chunk.length;
          if (this.#came >= PROGRESS) this.#tries = 0;
          if (this.#chunk.length > 0) return;
          if (this.#taken < Math.min(end, this.total || end) && end < Infinity)
            throw new Error('too short');
          else if (last || this.#taken === this.total) this.#to('ended');
          else if (this.#taken > from) this.#to('idle');
          else throw new Error('nothing came');
        },
    waiting:
        async () => {
          await pause(WAIT_S * 2 ** Math.min(this.#tries - 1, 5));
          this.#to('idle');
        },
    ended:
        async () => {
          throw this.#failed(`it ends after ${this.#taken} bytes`);
        },
    failed:
        async () => {
          throw this.#error;
        },
    closed:
        async () => {
          throw this.#failed('it was closed');
        },
  };

  async #step() {
    try {
      await this.#steps[this.state]();
    } catch (cause) {
      this.#drop();
      const error = cause instanceof ModarError ?
          cause :
          this.#failed(`the network broke off after ${this.#taken} bytes: ${
              /** @type {Error} */ (cause).message}`);
      if (this.state === 'failed' || this.state === 'closed') throw error;
      this.#rangeless ||= /** @type {More} */ (error).rangeless === true;
      this.#came = 0;
      const most = Math.min(
          this.patient ? PATIENT_TRIES : this.#options.tries,
          /** @type {More} */ (error).final ? 2 : PATIENT_TRIES);
      if (++this.#tries < most) return this.#to('waiting');
      this.#error = error;
      this.#to('failed');
      throw error;
    }
  }

  /** Ends open requests: WebKit keeps reading merely cancelled ones. */
  #drop() {
    for (const request of this.#requests) request.abort();
    this.#requests.clear();
    this.#answer = this.#ahead = null;
  }

  /**
   * The next bytes, this many or to the end; whole: it is an error where they are fewer.
   * onPart(at, bytes): receives parts as they come, if there are several.
   * @param {number} count
   * @param {boolean} [whole]
   * @param {((at: number, bytes: Uint8Array) => void) | false | null}
   * [onPart]
   */
  async take(count, whole = true, onPart = null) {
    const parts = [], spent = [];
    let size = 0;
    while (size < count && (whole || this.state !== 'ended')) {
      if (this.#chunk.length === 0) {
        await this.#step();
        continue;
      }
      const part = this.#chunk.subarray(0, count - size);
      this.#chunk = this.#chunk.subarray(part.length);
      if (!this.#given && this.#chunk.length === 0) spent.push(part);
      parts.push(part);
      if (onPart && part.length < count) onPart(size, part);
      size += part.length;
      this.#taken += part.length;
      this.#copy?.add(part);
      this.onProgress?.(this.#taken, Math.max(this.total || this.#length || UNKNOWN, this.#taken));
    }
    const bytes = joined(parts);
    release(...spent);
    return bytes;
  }

  /**
   * The same file from a place on, once more.
   * @param {number} at
   */
  from(at) {
    return Object.assign(new Source(this.#bundle, {from: at}), {total: this.total, patient: true});
  }

  /**
   * Some bytes by a request of their own.
   * @param {number} from
   * @param {number} count
   * @param {Options} options of the constructor
   */
  async part(from, count, options) {
    const part = Object.assign(
        new Source(this.#bundle, {...options, from, end: from + count}), {total: this.total});
    this.#parts.add(part);
    try {
      return await part.take(count);
    } finally {
      part.close();
      this.#parts.delete(part);
    }
  }

  /**
   * Bytes that came before and were no good, once more.
   * @param {number} from
   * @param {number} count
   */
  async again(from, count) {
    await this.forget();
    return this.part(from, count, {cache: 'reload'});
  }

  /** The stored part of the file is not used again. */
  async forget() {
    const copy = this.#copy;
    this.#copy = null;
    await copy?.forget();
  }

  /** Downloads nothing more by itself: what lod-stream.js asks for comes by part(). */
  leave() {
    this.close();
    this.state = 'idle';
    return {
      part: (/** @type {Parameters<Source['part']>} */...words) => this.part(...words),
      closed: () => this.state === 'closed'
    };
  }

  /** whole: the taken bytes are verified. */
  close(whole = false) {
    this.state = 'closed';
    this.#drop();
    for (const part of this.#parts) part.close();
    this.#chunk = NOTHING;
    this.#copy?.end(whole && this.#taken === this.total);
    this.#copy = null;
  }
}

/**
 * A small file, whole.
 * @param {string | URL} address
 */
export const fetchBytes = (address) => new Source(address).take(UNKNOWN, false);
