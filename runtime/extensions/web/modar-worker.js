// @ts-check
// What a worker does: one engine that tracks. modar.js sends it one frame at a time.
import {Engine, ModarError, release} from './engine.js';

/** Share of the focal length below which its spread makes it worth keeping for the next start. */
const KNOWN_FOCAL = 0.03;

/**
 * Of start(): focal: pixels, where a frame's longer side has `side` of them.
 * @typedef {{focal: number, side: number, findFocal: boolean, budget: number, extended: boolean}}
 * Options
 * @typedef {{frame?: undefined, width: number, height: number, pixels: ArrayBuffer, kind: 'gray' |
 *     'rgba'}} Pixels
 * @typedef {{time: number, turn?: [number, number, number], keepLuma?: boolean} & (Pixels | {frame:
 *     VideoFrame, shrink: number})} FrameQuestion
 * @typedef {import('./modar.js').Frame} Frame
 *
 * The answer to it.
 * @typedef {Omit<Frame, 'source' | 'camera' | 'time'> & import('./modar.js').Camera &
 *     {type: 'poses'}} Tracked
 *
 * The questions to this worker.
 * @typedef {{
 *   prepare: object,
 *   open: {size: number, found: import('./arrival.js').Part[]},
 *   recipe: {bytes: Uint8Array},
 *   begin: {index: number, stored: number, at: number, bytes: Uint8Array},
 *   piece: {index: number, stored: Uint8Array, size: number},
 *   camera: Options,
 *   add: {record: Uint8Array, pattern: import('./engine.js').Pattern},
 *   forget: {kept: number},
 *   frame: FrameQuestion,
 * }} Questions
 *
 * @typedef {{type: string, bytes?: Uint8Array}} Answer
 */

/** @type {Promise<Engine>} */
let loading;
/** @type {Engine} */
let engine;
/** @type {Options} */
let camera = {focal: 0, side: 0, findFocal: true, budget: 0, extended: false};
let told = false;

/**
 * @param {number} width
 * @param {number} height
 */
function useSize(width, height) {
  if (engine.width === width && engine.height === height) return;
  // A phone that was turned has another camera: the measurement for its other size applies, scaled
  // by the long side.
  const scale = camera.side ? Math.max(width, height) / camera.side : 1;
  engine.setCamera(width, height, camera.focal * scale);
  engine.track(camera.findFocal, camera.budget, camera.extended);
}

/**
 * The frame's luma into the engine's buffer, its sides divided by `shrink`; its stride, or 0 where
 * it cannot be read so.
 * @param {VideoFrame} frame
 * @param {number} shrink
 */
async function takeVideoFrame(frame, shrink) {
  const planar = frame.format === 'I420' || frame.format === 'NV12';
  if (!planar || frame.rotation || frame.flip) return 0;
  const {width, height} = frame.visibleRect;
  const layout = await frame.copyTo(engine.frameBuffer(frame.allocationSize()));
  if (layout[0].offset !== 0) return 0;
  let {stride} = layout[0];
  useSize(Math.floor(width / shrink), Math.floor(height / shrink));
  if (shrink > 1) {
    engine.shrink(stride, shrink);
    stride = engine.width;
  }
  if (frame.colorSpace?.fullRange === false) engine.widenLuma(stride);
  return stride;
}

/** @param {Pixels} message */
function takePixels({width, height, pixels, kind}) {
  engine.frameBuffer(pixels.byteLength).set(new Uint8Array(pixels));
  useSize(width, height);
  if (kind === 'rgba') engine.grayFromRgba();
  return width;
}

/** @param {FrameQuestion} message */
async function track(message) {
  const began = performance.now();
  let stride = 0;
  if (message.frame) {
    stride = await takeVideoFrame(message.frame, message.shrink);
    message.frame.close();
  } else {
    stride = takePixels(message);
  }
  if (stride === 0) return {type: 'unreadable'};
  const copied = performance.now();
  if (message.turn) engine.turn(message.turn);
  const poses = engine.step(stride, message.time).slice();
  const stepped = performance.now();
  /** @type {Tracked} */
  const answer = {
    type: 'poses',
    width: engine.width,
    height: engine.height,
    focal: engine.focal,
    focalSigma: engine.focalSigma,
    poses,
    copies: engine.copies,
    reason: engine.reason,
    brightness: engine.brightness(stride),
    heapBytes: engine.heapBytes,
    copyMs: copied - began,
    stepMs: stepped - copied,
  };
  if (message.keepLuma) answer.luma = lumaOf(stride);
  if (!told && answer.focalSigma > 0 && answer.focalSigma < KNOWN_FOCAL * answer.focal) {
    answer.foundFocal = answer.focal;
    told = true;
  }
  return answer;
}

/** @param {number} stride */
function lumaOf(stride) {
  const {width, height} = engine;
  const from = engine.frameBuffer(stride * height);
  const luma = new Uint8Array(width * height);
  for (let y = 0; y < height; ++y)
    luma.set(from.subarray(y * stride, y * stride + width), y * width);
  return luma;
}

/** @type {{[K in keyof Questions]: (question: Questions[K]) => Answer | Promise<Answer>}} */
const answers = {
  async prepare() {
    engine = await loading;
    return {type: 'prepared'};
  },
  /** As much of a bundle as finds its patterns: arrival.js. */
  open({size, found}) {
    engine.arrive(size, found);
    return {type: 'opened', patterns: engine.patterns, scenes: engine.scenes, kind: engine.kind};
  },
  async recipe({bytes}) {
    engine ??= await loading;
    engine.recipe(bytes);
    return {type: 'ready'};
  },
  begin({index, stored, at, bytes}) {
    engine.begin(index, stored, at, bytes);
    return {type: 'begun'};
  },
  piece({index, stored, size}) {
    const bytes = engine.decode(index, stored, size);
    release(stored);
    return {type: 'decoded', bytes};
  },
  camera(options) {
    camera = options;
    told = false;
    if (engine.width) engine.setCamera(0, 0, 0);  // the next frame starts a new tracker
    return {type: 'ready'};
  },
  /** A record of record-worker.js as a further pattern. */
  add({record, pattern}) {
    engine.addPattern(record, pattern);
    return {type: 'added'};
  },
  forget({kept}) {
    engine.forgetPatterns(kept);
    engine.setCamera(0, 0, 0);  // the next frame starts a new tracker
    return {type: 'forgotten'};
  },
  frame: track,
};

/** @param {MessageEvent} event */
async function answer({data}) {
  try {
    const told = await answers[/** @type {keyof Questions} */ (data.type)](data);
    /** @type {Worker} */ (/** @type {unknown} */ (self))
        .postMessage({...told, call: data.call}, told.bytes ? [told.bytes.buffer] : []);
  } catch (error) {
    data.frame?.close();
    const told = error instanceof ModarError ?
        error.plain() :
        {code: 'web.worker', cause: String(/** @type {Error} */ (error).message ?? error)};
    self.postMessage({type: 'failed', call: data.call, error: told});
  }
}

/**
 * Starts this worker with one of the builds of the engine. @see Engine.of
 * @param {(options: object) => Promise<unknown>} load
 * @param {import('./engine.js').Kind} kind
 */
export function serve(load, kind) {
  loading = Engine.of(load, kind);
  loading.catch(() => {});  // answered to the first message
  self.onmessage = answer;
}
