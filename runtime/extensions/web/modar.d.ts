/** ModAR in a page: finds the pictures of a bundle in a video and says where they are. */

export class ModarError extends Error {
  /** Stable, like "bundle.truncated". */
  readonly code: string;
  readonly where: string;
  readonly reason: string;
  /** What to do about it. */
  readonly cure: string;
}

export interface Pattern {
  name: string;
  /** The width it is printed in, millimetres; 0: the bundle does not state it. */
  widthMm: number;
}

export interface Scene {
  /** Index into patterns. */
  pattern: number;
  model: string;
}

/** Of the frames: pixels; the focal length is the same both ways. */
export interface Camera {
  width: number;
  height: number;
  focal: number;
  /** Standard deviation of the focal length while it is estimated; 0: it was given. */
  focalSigma: number;
}

/**
 * A pattern's place in a frame. Pattern space: x right, y up, z towards the viewer, the picture's
 * largest side from -1 to 1.
 */
export interface Pose {
  pattern: number;
  /** Of the pattern's copies in view, from 0; kept while it is tracked, and where it is found again. */
  copy: number;
  name: string;
  /** Seconds, of the frame. */
  time: number;
  camera: Camera;
  /** Measured in this frame; else kept from the last frame but one. */
  visible: boolean;
  /** The pattern is hidden or out of the frame: the pose follows from what stands still around it, and inliers is 0. */
  extended: boolean;
  inliers: number;
  /** Share of the examined features that agree with the pose, 0 to 1. */
  fit: number;
  /** Share of the pattern's textured cells in view that match the picture, 0 to 1. */
  agreeing: number;
  /** Mean correlation of these cells, 0 to 1. */
  likeness: number;
  /** Standard deviations of an extended pose: in half of the pattern's longest side, and in radians. */
  positionSigma: number;
  rotationSigma: number;
  /** 3 x 3, row by row, to camera space: x right, y down, z forward. */
  rotation: Float32Array;
  translation: Float32Array;
  /** x, y in pixels: top left, top right, bottom right, bottom left. */
  corners: Float32Array;
  /** Pattern space to GL's eye space, column-major: three.js' Matrix4.fromArray() takes it. */
  view: Float32Array;
  /** GL's projection for a viewport that shows the whole frame; near 0.05, far 100. */
  projection: Float32Array;
}

/** Why no pattern is visible in a frame, as MODAR_REASON_... of modar.h. */
export type Reason = 'visible' | 'no features' | 'few matches' | 'not in view' | 'failed verification' | 'lost by blur'
  | 'out of view' | 'another print' | 'curved' | 'too small' | 'too dark' | 'blurred' | 'overexposed' | 'glare' | 'at the edge';

export interface Frame {
  /** Draw it while the event is handled; afterwards it is closed. */
  source: VideoFrame | HTMLCanvasElement;
  time: number;
  camera: Camera;
  /** 45 numbers a pattern, for View.draw(); then those of second copies, and so on. */
  poses: Float32Array;
  /** Most of a pattern that are tracked at once. */
  copies: number;
  reason: Reason;
  /** Mean of the frame's gray values, 0 to 255. */
  brightness: number;
  /** Set once, when the focal length is known to 3 %: keep it for start(). */
  foundFocal?: number;
  /** Bytes of the engine's heap in the worker. */
  heapBytes: number;
  copyMs: number;
  stepMs: number;
  /** With keepLuma: all tracks. */
  luma?: Uint8Array;
}

export interface ModarEvents {
  found: CustomEvent<Pose>;
  updated: CustomEvent<Pose>;
  lost: CustomEvent<{ pattern: number; copy: number; name: string; time: number; reason: Reason }>;
  /** After the events of this frame's patterns: draw now. */
  frame: CustomEvent<Frame>;
  /** While nothing is known: a frame that came during a search and is not looked at. Draw it as in `frame`. */
  dropped: CustomEvent<{ source: VideoFrame | HTMLCanvasElement; time: number }>;
  error: CustomEvent<ModarError>;
}

export class Modar extends EventTarget {
  readonly patterns: Pattern[];
  readonly scenes: Scene[];
  /** Which build of the engine runs. */
  readonly kind: 'simd' | 'plain';
  /**
   * Tracks in the video, which is to play, until stop(). focal: in pixels where the frame's long side
   * has focalSide of them; 0: unknown, that side is assumed. With findFocal
   * that is where its estimate begins; without, it is taken as given.
   */
  start(video: HTMLVideoElement, options?: {
    focal?: number; focalSide?: number; findFocal?: boolean; keepLuma?: boolean;
    /** Millions of ARM instructions that a frame may take, 12 or more: searches continue over several frames. 0: no limit. */
    budget?: number;
    /**
     * Learns the static surroundings of the largest pattern, and continues from them while the pattern is hidden or out of the
     * frame; the camera has to move before. A phone's gyroscope helps, where the browser gives it and says when its frames
     * were taken; see allowMotion().
     */
    extended?: boolean;
  }): Promise<void>;
  stop(): void;
  /**
   * Tracks a flat picture that is not the bundle's from now on, too: a photo of it that fills the image, taken from the front
   * (8 at most). It stays on the device. Its content is the page's choice, or View.stand()'s. Takes a second in a worker of
   * its own. Errors: "pattern.plain" and "pattern.no-features" where there is too little in it to be
   * recognised, "pattern.loop-size".
   * @returns its index in patterns
   */
  addPattern(image: HTMLImageElement | HTMLCanvasElement | ImageBitmap | VideoFrame, options?: {
    name?: string; widthMm?: number;
  }): Promise<number>;
  /** Forgets all pictures of addPattern(). */
  forgetPatterns(): Promise<void>;
  /** Ends the worker. */
  close(): void;
  /**
   * Tracks one gray frame, a byte a pixel, that comes from elsewhere. turn: for `extended`, how the camera turned since the
   * last frame, as a gyroscope says: a rotation vector, radians, in camera space.
   */
  step(gray: Uint8Array, width: number, height: number, time: number, turn?: [number, number, number]): Promise<Frame>;
  addEventListener<K extends keyof ModarEvents>(
    type: K, listener: (event: ModarEvents[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(
    type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
  removeEventListener<K extends keyof ModarEvents>(
    type: K, listener: (event: ModarEvents[K]) => void, options?: boolean | EventListenerOptions): void;
  removeEventListener(
    type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | EventListenerOptions): void;
}

/**
 * Opens a bundle, raw (.modar) or packed (.packed, of `modar web`): its address, or its bytes. The part to find its patterns is downloaded;
 * View.create() downloads the rest, once. An interrupted download continues at its end, and damaged pieces are downloaded again.
 * Errors: ModarError.
 */
export function load(bundle: string | URL | ArrayBuffer | Uint8Array, options?: {
  /** false: the build without SIMD, which sees the same. */
  simd?: boolean;
  onProgress?: (got: number, total: number) => void;
}): Promise<Modar>;

/**
 * Whether the page may read the gyroscope, for `extended`. Safari on iOS asks the visitor, in a click's handler only: call it
 * there, before start(). A visitor who refuses loses nothing else.
 */
export function allowMotion(): Promise<boolean>;

/** GL's projection for a viewport that the frame fills, cropped where shapes differ; without one, for the whole frame. */
export function projectionOf(
  camera: Camera, near?: number, far?: number, viewport?: { width: number; height: number }): Float32Array;

/**
 * Draws the frame that was tracked so that it fills the canvas, in the handler of `frame`: of a video that plays on under its
 * models, these are where it was. Sets the canvas to its size on the screen. @returns its size in pixels, for projectionOf().
 */
export function drawFrame(
  canvas: HTMLCanvasElement, frame: Pick<Frame, 'source' | 'camera'>, options?: { mirror?: boolean }): { width: number; height: number };

/** For modar-view.js: makes canvases as large as the first of them is shown. @returns their size in pixels */
export function fitCanvases(...canvases: HTMLCanvasElement[]): { width: number; height: number };
