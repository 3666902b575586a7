/** Draws what modar.js sees: the frame in one canvas, the bundle's models over it in another. */
import type { Frame, Modar } from './modar.js';

export interface Gesture {
  /** The picture and the models left to right, as a mirror shows them. */
  mirror?: boolean;
}

/** The visitor's view of the scenes. */
export interface ViewStatus {
  /** start: no frame came. looking, seen: the last frame of draw(). around: lookAround(). */
  state: 'start' | 'looking' | 'seen' | 'around';
  /** What helps while nothing is seen: to look for the picture, go closer, have light, move slowly, turn back to it, hold still, avoid glare, show all of it, lay it flat. */
  hint: 'look' | 'far' | 'dark' | 'blurred' | 'outside' | 'hold' | 'bright' | 'whole' | 'flat';
  /** The one whose words are shown, for a second after it went; -1: none. */
  pattern: number;
  /** Videos and sounds are heard: after press(4), and after a tap on what plays. */
  sound: boolean;
  /** They wait: press(5). */
  paused: boolean;
  /** Captions are wanted: press(6). */
  captions: boolean;
}

/** A named part of a pattern's content. */
export interface SceneNode {
  name: string;
  /** Index. */
  pattern: number;
  kind: 'model' | 'picture' | 'label' | 'video' | 'sound';
  /** Of a label: a number or a short word. */
  mark: string;
}

export interface ViewEvents {
  text: CustomEvent<{ node: number }>;
  link: CustomEvent<{ address: string }>;
  caption: CustomEvent<{ node: number; text: string; language: string }>;
  drawn: Event;
  /** A clip that does not loop has ended. */
  clipend: CustomEvent<{ name: string; scene: number }>;
  refined: Event;
  error: CustomEvent<unknown>;
}

/**
 * Scenes may act (nodes and actions of the bundle). Events: `text`, detail {node}: the words of a label are to be shown; `link`,
 * detail {address}: the visitor is to be asked whether to open it; `caption`, detail {node, text, language}: the words that are
 * heard now of a video or sound, '' for none; `drawn`: labels() has changed; `refined`: of a packed bundle, first the coarsest of everything
 * can be drawn, then all; of one that is larger than maxBytes, a finer picture than before.
 */
export class View extends EventTarget {
  /**
   * bundle: bytes of a raw one, or what load() answers, which also takes packed bundles; both may
   * still be on their way. Drawn data goes to the GPU and is not kept: after a lost context it is
   * requested again, if load() was given an address. picture, models: laid over each other by the
   * page, of one size. fixedLight: the models' light does not follow the camera's picture. webgl1:
   * for tests. Errors: ModarError. maxBytes (64 MB): of a bundle that is larger, no more than these
   * are on the GPU at once; levels of detail and of textures come by ranges of the file when a
   * picture needs them, the coarse ones first, and invisible parts make room. Of models, bakes
   * with --no-lods have one level, which is always there. A host without ranges, or a browser
   * without WebGL 2, has all of it at once. 0: no limit.
   */
  static create(bundle: Modar | Uint8Array | Promise<Modar | Uint8Array>, options: {
    picture: HTMLCanvasElement; models: HTMLCanvasElement; simd?: boolean; webgl1?: boolean; fixedLight?: boolean; maxBytes?: number;
  }): Promise<View>;
  /** The picture alone, of a frame that nothing is known of. */
  show(source: VideoFrame | HTMLCanvasElement, gesture?: Gesture): void;
  /** In the handler of the event `frame`, with its detail. */
  draw(frame: Frame, gesture?: Gesture): void;
  /**
   * A picture that Modar.addPattern() has added gets the content of a scene of the bundle, at its place: call it once for each,
   * in their order. @returns false: there are 8 already
   */
  stand(name: string, scene: number): boolean;
  /** Forgets all of stand(). kept: patterns of the bundle. */
  forgetPatterns(kept: number): void;
  /** The box of a pattern's content, in its space; null where nothing does. */
  bounds(pattern: number): { low: number[]; high: number[] } | null;
  /**
   * The models of one pattern alone, as a camera sees them that stands anywhere: for a look without a camera. view: pattern
   * space to GL's eye space, column-major. focal: CSS pixels.
   */
  drawFrom(pattern: number, view: Float32Array, focal: number): void;
  /** The same of several patterns, each with a view of its own. */
  drawEach(views: [pattern: number, view: Float32Array][], focal: number): void;
  /** Resolved when something of every model of a packed bundle is there, and drawn. */
  readonly shown: Promise<void>;
  /** Resolved when all of the bundle is there, and drawn: a packed one comes on after create(), and videos and actions that need it wait. */
  readonly whole: Promise<void>;
  /** Those of the bundle, then those of stand(). */
  readonly patterns: { name: string; widthMm?: number }[];
  readonly nodes: SceneNode[];
  /** Movements of models. */
  readonly clips: { name: string; seconds: number }[];
  /**
   * Models that have a clip of this name play it from its beginning, again and again unless `loop` is false. blend: seconds in
   * which they turn from their present poses (0.3).
   */
  play(name: string, options?: { loop?: boolean; blend?: number }): void;
  /** All models stay in their present poses. */
  stop(): void;
  /** Words of a node in the first of these languages that it has, else in any. */
  wordsOf(node: number, languages?: string[]): { language: string; title: string; text: string; alt: string };
  /** The visitor tapped the canvas of the models, CSS pixels from its top left. Answers the node there, or null. */
  tap(x: number, y: number): number | null;
  /** The visitor tapped a node, as by a label's own button. */
  tapNode(node: number): void;
  /**
   * A pointer on the canvas of the models. kind: 0 down, 1 moved, 2 up, 3 cancelled. x, y: CSS pixels from its top left. One
   * turns and tilts, two resize. Answers whether it tapped: see tap().
   */
  touch(kind: 0 | 1 | 2 | 3, finger: number, x: number, y: number): boolean;
  /**
   * A key or button. button: 0 turns, 1 tilts, 2 resizes, by steps of 10 degrees or a tenth, which may be negative, or parts; 3
   * resets; 4 sound, 5 pause and 6 captions are on or off. Turn sound on in a visitor's click: it is off at first.
   */
  press(button: 0 | 1 | 2 | 3 | 4 | 5 | 6, steps?: number): void;
  readonly status: ViewStatus;
  /** The content of a pattern without a camera, until forgetActs(): touch() and press() move the eye. presents: it goes once around at first. */
  lookAround(pattern: number, presents?: boolean): void;
  /** Draws lookAround() anew, in another size. */
  turned(): void;
  /** Of lookAround(), as drawFrom() takes it. */
  readonly eye: { view: Float32Array; focal: number };
  /** Actions begin anew, models are as baked, and videos and sounds stop. */
  forgetActs(): void;
  /** For captions, of what plays from now on: the first of these that a video or sound has, else any. */
  set languages(languages: string[]);
  /** Of a video or sound: a WebVTT file of captions, and its words alone; null if none. */
  captionsOf(node: number): { language: string; captions: string; transcript: string } | null;
  /** 0 to 1; iPhones know their own alone. */
  set volume(volume: number);
  /** The sound of videos and sounds as a stream, heard or not, for a film; null where the bundle has none. Ask in a click's handler. */
  readonly film: MediaStream | null;
  /** Labels on the screen, CSS pixels of the canvas; covered: something is in front of its point. */
  labels(): { node: number; x: number; y: number; covered: boolean }[];
  /** Both canvases in one picture. */
  photograph(type?: 'image/jpeg' | 'image/png'): Promise<Blob>;
  /** The version of WebGL that draws. */
  readonly webgl: 1 | 2;
  readonly heapBytes: number;
  readonly gpuBytes: number;
  /** For modar-viewer.js: of the bundle, what has come of it, until the next call. */
  readonly bytes: Uint8Array;
  /** Of the last drawing. */
  readonly triangles: number;
  addEventListener<K extends keyof ViewEvents>(
    type: K, listener: (event: ViewEvents[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(
    type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}
