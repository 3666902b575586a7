// @ts-check
// ModAR in a page: finds the pictures of a bundle in a video and says where they are.
//
//   import { load } from './modar.js';
//   const modar = await load('museum.modar');
//   modar.addEventListener('updated', ({ detail }) => { ... detail.view, detail.projection ... });
//   await modar.start(video);
//
// Types and words: modar.d.ts. The drawing of a bundle's own models is in modar-view.js.
import {Arrival, isPacked, RawArrival} from './arrival.js';
import {Source} from './download.js';
import {ENGINE_S, hasSimd, ModarError, POSE, POSE_FLOATS, shrinkOf, strandedFile} from './engine.js';
import {allowMotion, Gyroscope} from './gyroscope.js';

export {allowMotion, ModarError};

/**
 * @typedef {{width: number, height: number}} Size
 * @typedef {import('./modar.js').Frame} Frame
 * @typedef {import('./modar.js').Camera} Camera
 * @typedef {import('./modar.js').Modar} Types
 * @typedef {{resolve: (answer: unknown) => void, reject: (error: unknown) => void}} Waiting
 *
 * A frame to draw until release(), and the worker's message. captured, grabMs: milliseconds.
 * @typedef {{source: Frame['source'], time: number, message: object, transfer: object[], release:
 *     () => void, captured?: number, grabMs?: number}} Grabbed
 */

/**
 * Bundlers follow an address that is written out in the call.
 * @param {boolean} simd
 */
function openWorker(simd) {
  const stranded = strandedFile(`modar-worker-${simd ? 'simd' : 'plain'}.js`);
  if (stranded) return new Worker(stranded, {type: 'module'});
  return simd ? new Worker(new URL('./modar-worker-simd.js', import.meta.url), {type: 'module'}) :
                new Worker(new URL('./modar-worker-plain.js', import.meta.url), {type: 'module'});
}

/**
 * The same of the worker that makes records.
 * @param {boolean} simd
 */
function openRecordWorker(simd) {
  const stranded = strandedFile(`record-worker-${simd ? 'simd' : 'plain'}.js`);
  if (stranded) return new Worker(stranded, {type: 'module'});
  return simd ? new Worker(new URL('./record-worker-simd.js', import.meta.url), {type: 'module'}) :
                new Worker(new URL('./record-worker-plain.js', import.meta.url), {type: 'module'});
}

/**
 * What open() makes. A browser starts no worker of another site's address, as that of a CDN, but
 * one of its own that imports it.
 * @param {(simd: boolean) => Worker} open
 * @param {boolean} simd
 */
function startWorker(open, simd) {
  const {Worker} = globalThis;
  let address = /** @type {URL} */ (/** @type {unknown} */ (undefined));
  globalThis.Worker = /** @type {typeof Worker} */ (
      /** @type {unknown} */ (function asked(
          /** @type {string | URL} */ url) { address = new URL(url, document.baseURI); }));
  try {
    open(simd);
  } finally { globalThis.Worker = Worker; }
  if (address.origin === globalThis.origin) return open(simd);
  return new Worker(
      URL.createObjectURL(
          new Blob([`import ${JSON.stringify(address)};`], {type: 'text/javascript'})),
      {type: 'module'});
}

/** What a Content-Security-Policy of the page has refused last. */
let refused = '';
globalThis.document?.addEventListener('securitypolicyviolation', ({effectiveDirective}) => {
  refused = effectiveDirective;
});

/** A worker whose answers are promises; frames wait for one another. */
class Calls {
  #worker;
  /** @type {Map<number, Waiting>} */
  #waiting = new Map();
  #calls = 0;
  /**
   * Why nothing is answered any more.
   * @type {ModarError | null}
   */
  #error = null;
  /**
   * Until the first answer: then the engine is there.
   * @type {number | undefined}
   */
  #late;

  /**
   * @param {(simd: boolean) => Worker} open
   * @param {boolean} simd
   */
  constructor(open, simd) {
    this.#worker = startWorker(open, simd);
    this.#worker.onmessage = ({data}) => {
      clearTimeout(this.#late);
      const {resolve, reject} =
          /** @type {Partial<Waiting>} */ (this.#waiting.get(data.call) ?? {});
      this.#waiting.delete(data.call);
      if (data.type === 'failed') reject?.(new ModarError(data.error));
      else resolve?.(data);
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      if (event.message) this.#giveUp(event.message);
      else
        setTimeout(
            () => this.#giveUpLoading());  // it may be refused, which is reported just after this
    };
  }

  /** @param {string} cause */
  #giveUp(cause, code = 'web.worker', cure = 'load the page again') {
    this.#error ??= new ModarError({code, cause, cure});
    for (const {reject} of this.#waiting.values()) reject(this.#error);
    this.#waiting.clear();
  }

  #giveUpLoading() {
    if (refused !== 'worker-src')
      this.#giveUp(
          'the engine did not load', 'web.download',
          'check the network, and what the site\'s Content-Security-Policy allows');
    else
      this.#giveUp(
          'the site\'s Content-Security-Policy refuses the engine', 'web.policy',
          'it has to allow worker-src blob:');
  }

  /**
   * @param {object} message
   * @param {object[]} transfer
   * @returns {Promise<any>} the worker's answer to this message
   */
  ask(message, transfer = []) {
    const call = ++this.#calls;
    this.#late ??= setTimeout(() => this.#giveUpLoading(), 1000 * ENGINE_S);
    return new Promise((resolve, reject) => {
      if (this.#error) reject(this.#error);
      this.#waiting.set(call, {resolve, reject});
      this.#worker.postMessage({...message, call}, /** @type {Transferable[]} */ (transfer));
    });
  }

  close() {
    clearTimeout(this.#late);
    this.#worker.terminate();
    this.#giveUp('it was closed');
  }
}

/**
 * Takes frames from a video: VideoFrame where the browser has it, else canvases, the smaller of
 * which is read back.
 */
class FrameGrabber {
  #video;
  /**
   * Not in use: one is shown, one is tracked and one waits at most.
   * @type {HTMLCanvasElement[]}
   */
  #canvases = [];
  /** @type {CanvasRenderingContext2D | null} */
  #small = null;
  useCanvas = typeof VideoFrame !== 'function';

  /** @param {HTMLVideoElement} video */
  constructor(video) { this.#video = video; }

  /**
   * @param {number} time
   * @returns {Grabbed}
   */
  grab(time) {
    const {videoWidth: width, videoHeight: height} = this.#video;
    const shrink = shrinkOf(width, height);
    if (this.useCanvas) return this.#copy(time, width, height, shrink);
    const source = new VideoFrame(this.#video, {timestamp: Math.round(time * 1e6)});
    const frame = source.clone();
    return {
      source,
      time,
      message: {type: 'frame', time, frame, shrink},
      transfer: [frame],
      release: () => {
        frame.close();
        source.close();
      },
    };
  }

  /**
   * @param {number} time
   * @param {number} width
   * @param {number} height
   * @param {number} shrink
   * @returns {Grabbed}
   */
  #copy(time, width, height, shrink) {
    const source = this.#canvases.pop() ?? document.createElement('canvas');
    if (source.width !== width || source.height !== height) Object.assign(source, {width, height});
    /** @type {CanvasRenderingContext2D} */ (source.getContext('2d', {
      alpha: false
    })).drawImage(this.#video, 0, 0);
    const size = {width: Math.floor(width / shrink), height: Math.floor(height / shrink)};
    this.#small ??=
        /** @type {CanvasRenderingContext2D} */ (document.createElement('canvas').getContext(
            '2d', {willReadFrequently: true, alpha: false}));
    const {canvas} = this.#small;
    if (canvas.width !== size.width || canvas.height !== size.height) Object.assign(canvas, size);
    this.#small.imageSmoothingQuality = 'medium';
    this.#small.drawImage(source, 0, 0, size.width, size.height);
    const pixels = this.#small.getImageData(0, 0, size.width, size.height).data.buffer;
    return {
      source,
      time,
      message: {type: 'frame', kind: 'rgba', time, ...size, pixels},
      transfer: [pixels],
      release: () => this.#canvases.push(source),
    };
  }
}

/**
 * Calls back for each new frame of the video, with its time in seconds, and when it was taken in
 * milliseconds, where the browser says so; answers a function that ends it.
 * @param {HTMLVideoElement} video
 * @param {(time: number, captured?: number) => void} callback
 */
function onFrames(video, callback) {
  let handle = 0;
  const byFrame = 'requestVideoFrameCallback' in video;
  let seen = -1;
  /** @type {(now: number, metadata?: {captureTime?: number}) => void} */
  const next = (now, metadata) => {
    // Without that callback, the screen's pace: a frame counts when the video's time has moved on.
    if (byFrame || video.currentTime !== seen) {
      seen = video.currentTime;
      if (video.videoWidth > 0)
        callback((metadata?.captureTime ?? now) / 1000, metadata?.captureTime);
    }
    handle = byFrame ? video.requestVideoFrameCallback(next) : requestAnimationFrame(next);
  };
  handle = byFrame ? video.requestVideoFrameCallback(next) : requestAnimationFrame(next);
  return () => (byFrame ? video.cancelVideoFrameCallback(handle) : cancelAnimationFrame(handle));
}

/**
 * How much larger a frame is shown where it fills a viewport.
 * @type {(camera: Size, viewport: Size) => number}
 */
const coverScale = (camera, {width, height}) =>
    Math.max(width / camera.width, height / camera.height);

/**
 * @see modar.d.ts
 * @param {Camera} camera
 * @param {Size} viewport
 */
export function projectionOf(camera, near = 0.05, far = 100, viewport = camera) {
  const scale = 2 * camera.focal * coverScale(camera, viewport);
  return Float32Array.of(
      scale / viewport.width, 0, 0, 0, 0, scale / viewport.height, 0, 0, 0, 0,
      -(far + near) / (far - near), -1, 0, 0, (-2 * far * near) / (far - near), 0);
}

/** Screens of phones have more pixels than a camera's picture or a scan's texture fills. */
const MOST_PIXELS_A_CSS_PIXEL = 2;

/**
 * Makes canvases as large as the first of them is shown.
 * @param {HTMLCanvasElement[]} canvases
 * @returns {Size} pixels
 */
export function fitCanvases(...canvases) {
  const scale = Math.min(globalThis.devicePixelRatio || 1, MOST_PIXELS_A_CSS_PIXEL);
  const width = Math.max(1, Math.round(canvases[0].clientWidth * scale));
  const height = Math.max(1, Math.round(canvases[0].clientHeight * scale));
  for (const canvas of canvases) {
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  }
  return {width, height};
}

/**
 * @see modar.d.ts
 * @param {HTMLCanvasElement} canvas
 * @param {Pick<Frame, 'source' | 'camera'>} frame
 */
export function drawFrame(canvas, {source, camera}, {mirror = false} = {}) {
  const viewport = fitCanvases(canvas);
  const context =
      /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', {alpha: false}));
  const scale = coverScale(camera, viewport);
  context.setTransform(
      mirror ? -scale : scale, 0, 0, scale, viewport.width / 2, viewport.height / 2);
  context.drawImage(
      /** @type {HTMLCanvasElement} */ (source), -camera.width / 2, -camera.height / 2,
      camera.width, camera.height);
  return viewport;
}

/**
 * Longer side of a picture that is added, pixels: trades the time until it is tracked, which grows
 * with its area, for how near it may be looked at.
 */
const ADDED_SIDE = 512;
/** As engine.cpp has room for. */
const MOST_ADDED = 8;

/**
 * A picture's pixels, for a pattern.
 * @param {HTMLImageElement & VideoFrame} image or another picture
 */
function pixelsOf(image) {
  const [wide, high] = [
    image.naturalWidth ?? image.displayWidth ?? image.width,
    image.naturalHeight ?? image.displayHeight ?? image.height
  ];
  const scale = Math.min(1, ADDED_SIDE / Math.max(wide, high));
  const [width, height] = [Math.round(wide * scale), Math.round(high * scale)];
  const context = /** @type {CanvasRenderingContext2D} */ (
      Object.assign(document.createElement('canvas'), {width, height}).getContext('2d', {
        willReadFrequently: true
      }));
  context.fillStyle = '#fff';  // paper, where the picture is transparent
  context.fillRect(0, 0, width, height);
  context.imageSmoothingQuality = 'high';
  context.drawImage(image, 0, 0, width, height);
  return {width, height, pixels: context.getImageData(0, 0, width, height).data.buffer};
}

export class Modar extends EventTarget {
  #tracker = /** @type {Calls} */ (/** @type {unknown} */ (null));
  /** @type {(() => void) | null} */
  #stopFrames = null;
  /** @type {Grabbed | null} */
  #waiting = null;
  #busy = false;
  /** @type {boolean[]} */
  #known = [];
  /** false: the plain builds of the engine. */
  #simd = false;
  /**
   * Patterns of the bundle; null: no others were added.
   * @type {number | null}
   */
  #ofBundle = null;
  #grabber = /** @type {FrameGrabber} */ (/** @type {unknown} */ (null));
  #runs = 0;
  /** @type {Gyroscope | null} */
  #gyroscope = null;
  /**
   * When the last frame was taken that was tracked; undefined: unknown.
   * @type {number | undefined}
   */
  #trackedAt;
  /**
   * The loader of the bundle.
   * @type {import('./arrival.js').AnyArrival | null}
   */
  arrival = null;
  /** @type {import('./modar.js').Pattern[]} */
  patterns = [];

  /**
   * @see load
   * @param {Parameters<typeof import('./modar.js').load>[0] | Source} bundle
   * @param {Parameters<typeof import('./modar.js').load>[1]} options
   */
  static async open(bundle, {simd = true, onProgress} = {}) {
    const modar = new Modar();
    modar.#simd = simd && hasSimd();
    modar.#tracker = new Calls(openWorker, modar.#simd);
    // The engine is compiled while the bundle comes.
    const prepared = modar.#tracker.ask({type: 'prepare'});
    prepared.catch(() => {});  // told below
    const source = bundle instanceof Source ? bundle : new Source(bundle);
    source.onProgress = /** @type {Source['onProgress']} */ (onProgress);
    try {
      const start = await source.take(8);
      modar.arrival = isPacked(start) ?
          new Arrival(source, () => new Calls(openWorker, modar.#simd)) :
          new RawArrival(source);
      await modar.arrival.begin(start);
      await prepared;
      const {size, found, tracked = found} = modar.arrival;
      const {patterns, scenes, kind} =
          await modar.#tracker.ask({type: 'open', size, found: tracked});
      /** @type {{tracked: unknown}} */ (modar.arrival).tracked = null;
      Object.assign(modar, {patterns, scenes, kind});
    } catch (error) {
      source.close();
      modar.close();
      throw error;
    }
    return modar;
  }

  /**
   * @see modar.d.ts
   * @param {Parameters<Types['addPattern']>[0]} image
   */
  async addPattern(image, {name = '', widthMm = 0} = {}) {
    this.#ofBundle ??= this.patterns.length;
    if (this.patterns.length - this.#ofBundle >= MOST_ADDED) {
      throw new ModarError({
        code: 'web.patterns',
        cause: `${MOST_ADDED} pictures were added already`,
        cure: 'forget them first'
      });
    }
    const picture = pixelsOf(/** @type {HTMLImageElement & VideoFrame} */ (image));
    const pattern = {name, widthMm};
    const maker = new Calls(openRecordWorker, this.#simd);
    try {
      const {record} = await maker.ask(picture, [picture.pixels]);
      await this.#tracker.ask({type: 'add', record, pattern}, [record.buffer]);
    } finally { maker.close(); }
    this.#known.push(false);
    return this.patterns.push(pattern) - 1;
  }

  /** @see modar.d.ts */
  async forgetPatterns() {
    if (this.#ofBundle === null) return;
    await this.#tracker.ask({type: 'forget', kept: this.#ofBundle});
    this.patterns.length = this.#known.length = this.#ofBundle;
  }

  /**
   * Tracks in the video, which is to play, until stop(). focal: in pixels of its longer side; 0:
   * unknown.
   * @param {HTMLVideoElement} video
   */
  async start(
      video,
      {focal = 0, focalSide = 0, findFocal = true, keepLuma = false, budget = 0, extended = false} =
          {}) {
    this.stop();
    await this.#tracker.ask({type: 'camera', focal, side: focalSide, findFocal, budget, extended});
    this.#known = this.patterns.map(() => false);
    this.#grabber = new FrameGrabber(video);
    this.keepLuma = keepLuma;
    const run = ++this.#runs;
    if (extended) this.#gyroscope = Gyroscope.of(video);
    this.#stopFrames = onFrames(video, (time, captured) => this.#take(time, captured, run));
  }

  stop() {
    this.#stopFrames?.();
    this.#stopFrames = null;
    this.#gyroscope?.close();
    this.#gyroscope = null;
    this.#trackedAt = undefined;
    ++this.#runs;
    this.#waiting?.release();
    this.#waiting = null;
  }

  close() {
    this.stop();
    this.arrival?.close();
    this.#tracker.close();
  }

  /**
   * Tracks one gray frame (width * height bytes): for pictures that come from elsewhere. turn: see
   * modar.d.ts.
   * @param {Uint8Array} gray
   * @param {number} width
   * @param {number} height
   * @param {number} time
   * @param {[number, number, number]} [turn]
   */
  async step(gray, width, height, time, turn) {
    const pixels = gray.slice().buffer;
    return this.#tracker.ask(
        {type: 'frame', kind: 'gray', time, width, height, pixels, turn}, [pixels]);
  }

  /**
   * The newest frame waits while one is tracked; older ones are dropped.
   * @param {number} time
   * @param {number | undefined} captured
   * @param {number} run
   */
  #take(time, captured, run) {
    /** @type {Grabbed} */
    let grabbed;
    try {
      const began = performance.now();
      grabbed = {...this.#grabber.grab(time), captured};
      grabbed.grabMs = performance.now() - began;
    } catch (error) {
      this.#grabber.useCanvas = true;
      return;
    }
    // A search may take longer than a frame: dropped frames can still be shown.
    if (this.#waiting && !this.#known.includes(true)) {
      const {source} = this.#waiting;
      this.dispatchEvent(new CustomEvent('dropped', {detail: {source, time: this.#waiting.time}}));
    }
    this.#waiting?.release();
    this.#waiting = grabbed;
    if (!this.#busy) this.#pump(run);
  }

  /** @param {number} run */
  async #pump(run) {
    this.#busy = true;
    while (this.#waiting) {
      const grabbed = this.#waiting;
      this.#waiting = null;
      try {
        const turn = this.#gyroscope?.turn(
            /** @type {number} */ (this.#trackedAt), /** @type {number} */ (grabbed.captured));
        const answer = await this.#tracker.ask(
            {...grabbed.message, turn, keepLuma: this.keepLuma}, grabbed.transfer);
        if (answer.type === 'unreadable') {
          this.#grabber.useCanvas = true;
        } else if (run === this.#runs) {
          this.#trackedAt = grabbed.captured;
          this.#tell(answer, grabbed);
        }
      } catch (error) {
        if (run === this.#runs) this.dispatchEvent(new CustomEvent('error', {detail: error}));
      }
      grabbed.release();
    }
    this.#busy = false;
  }

  /**
   * @param {import('./modar-worker.js').Tracked} answer
   * @param {Grabbed} grabbed
   */
  #tell(answer, {source, time, grabMs}) {
    const {poses} = answer;
    const camera = {
      width: answer.width,
      height: answer.height,
      focal: answer.focal,
      focalSigma: answer.focalSigma
    };
    let projection = null;
    const row = poses.length / POSE_FLOATS / answer.copies;
    for (let i = 0; i < answer.copies * row; ++i) {
      const pattern = i % row;
      const copy = (i - pattern) / row;
      if (pattern >= this.patterns.length) continue;  // forgotten since the frame was taken
      const pose = poses.subarray(i * POSE_FLOATS, (i + 1) * POSE_FLOATS);
      const shown = pose[POSE.shown] !== 0;
      const {name} = this.patterns[pattern];
      if (shown) {
        projection ??= projectionOf(camera);
        /** @type {(from: number, count: number) => Float32Array} */
        const part = (from, count) => pose.slice(from, from + count);
        const detail = {
          pattern,
          copy,
          name,
          time,
          camera,
          projection,
          visible: pose[POSE.visible] !== 0,
          inliers: pose[POSE.inliers],
          fit: pose[POSE.fit],
          rotation: part(POSE.rotation, 9),
          translation: part(POSE.translation, 3),
          corners: part(POSE.corners, 8),
          view: part(POSE.view, 16),
          extended: pose[POSE.extended] !== 0,
          agreeing: pose[POSE.agreeing],
          likeness: pose[POSE.likeness],
          positionSigma: pose[POSE.positionSigma],
          rotationSigma: pose[POSE.rotationSigma],
        };
        if (!this.#known[i]) this.dispatchEvent(new CustomEvent('found', {detail}));
        this.dispatchEvent(new CustomEvent('updated', {detail}));
      } else if (this.#known[i]) {
        this.dispatchEvent(
            new CustomEvent('lost', {detail: {pattern, copy, name, time, reason: answer.reason}}));
      }
      this.#known[i] = shown;
    }
    this.dispatchEvent(new CustomEvent('frame', {
      detail:
          {...answer, copyMs: /** @type {number} */ (grabMs) + answer.copyMs, camera, source, time}
    }));
  }
}

/**
 * Opens a bundle: its address, or its bytes.
 * @type {(...words: Parameters<typeof import('./modar.js').load>) => Promise<Modar>}
 */
export function load(bundle, options) { return Modar.open(bundle, options); }
