/**
 * <modar-viewer src="vase.modar">: the models of a bundle before a visitor's camera, and on a turntable without one. Importing this
 * module defines the element; on a server it does nothing.
 *
 * Attributes: src, the bundle's address; poster, a picture to show before the start, and alt, its
 * description; lang, of words and texts (else that of the element around it); max-bytes, see
 * maxBytes in modar-view.d.ts; bare, for pages with a cover of their own: no poster and no buttons
 * before the start. Slots: poster, in place of the picture; tools, for your buttons next to the
 * viewer's (class "tool": as these look). CSS properties: --modar-paper, --modar-card, --modar-ink,
 * --modar-accent (colours), --modar-font.
 */
import type { Frame, Modar, ModarEvents } from './modar.js';

/** The display of a pattern. */
export interface ViewerPattern {
  name: string;
  /** Of the picture, as people write it. */
  title: string;
  /** Names of its content, which the label shows where `texts` has no name. */
  models?: string;
  /** By language; `alt` says what a visitor would see of the models. */
  texts?: Record<string, { name?: string; text: string; alt?: string }>;
  /** The picture that the camera looks for: its address, now or on request. */
  image: string | (() => string | Promise<string>);
  /** Of the picture, pixels. */
  width: number;
  height: number;
  /** Whether a turntable shows the picture below the models; true unless said otherwise. */
  flat?: boolean;
}

export interface ModarViewerEventMap extends Omit<HTMLElementEventMap, 'error'>, Pick<ModarEvents, 'found' | 'updated' | 'lost'> {
  /** While the bundle comes. */
  progress: ProgressEvent;
  /** The bundle's patterns can be found: all of a raw bundle is there, of a packed one the rest comes meanwhile. */
  load: Event;
  /** All of the bundle is there, and drawn; of a larger one than max-bytes, what a view has from the start. */
  whole: Event;
  /** `error` of it is a ModarError, or what getUserMedia() throws. The visitor has been told. */
  error: ErrorEvent;
  /** See ModarViewer.state. */
  statechange: Event;
  /** The camera was opened or closed. */
  camerachange: Event;
  /** Another pattern's models are shown; -1: none. */
  scenechange: CustomEvent<{ pattern: number }>;
  /** A label was tapped, or an action shows its words: `pattern` is an index. preventDefault() if you show them yourself. */
  text: CustomEvent<{ pattern: number; node: string; language: string; title: string; text: string }>;
  /** An action would open another page. The viewer asks the visitor, unless you call preventDefault(). */
  link: CustomEvent<{ address: string }>;
  /** A clip that does not loop has ended; see play(). */
  clipend: CustomEvent<{ name: string; scene: number }>;
  /** After picture and models were drawn, in the same task: copies of `layers` are whole now. */
  frame: CustomEvent<Frame>;
}

export class ModarViewer extends HTMLElement {
  src: string;
  /** The bundle's bytes, or their loader; goes before src. */
  srcObject: ArrayBuffer | Uint8Array | string | (() => Promise<ArrayBuffer | Uint8Array | string>) | null;
  /** Of the bundle's patterns; set it to show other texts and pictures than the bundle's own, null: these. */
  get patterns(): ViewerPattern[];
  set patterns(patterns: ViewerPattern[] | null);
  /** Texts of the viewer in another language: a complete translation of words/en.json. */
  set words(words: Record<string, unknown>);
  /** start: the cover. looking: the camera, without models. seen: models. around: the turntable. error: the visitor sees the reason. */
  readonly state: 'start' | 'looking' | 'seen' | 'around' | 'error';
  /** Resolved when something of every model of a packed bundle is there, and drawn. */
  readonly shown: Promise<void> | undefined;
  /** Resolved when all of the bundle that is loaded is there, and drawn. */
  readonly whole: Promise<void>;
  /** The bundle that is loaded. */
  readonly modar: Modar | null;
  /** The camera that is open. */
  readonly camera: MediaStreamTrack | null;
  /** The camera's picture, and the models over it. */
  readonly layers: [HTMLCanvasElement, HTMLCanvasElement];
  /** The sound of videos and sounds as a stream, heard or not, for a film; null if none. Ask in a click's handler. */
  readonly film: MediaStream | null;
  /** Downloads the bundle before the visitor starts, until its patterns can be found; without it the first start does. */
  load(): Promise<void>;
  /**
   * A flat picture that is not the bundle's gets the content of a scene of it (modar.scenes), from now on until the bundle is
   * loaded anew: see Modar.addPattern(). @returns its index in patterns
   */
  addPattern(image: HTMLImageElement | HTMLCanvasElement | ImageBitmap, options?: {
    name?: string; widthMm?: number; scene?: number;
  }): Promise<number>;
  /** Movements of the models of the bundle that is loaded. */
  readonly clips: { name: string; seconds: number }[];
  /** As View.play(): models that have a clip of this name play it. stop() ends it, too: models are as baked after it. */
  play(name: string, options?: { loop?: boolean; blend?: number }): void;
  /** As the start button: call it in a click's handler. loaded: the promise to await together with the camera, load() unless stated otherwise. */
  start(loaded?: Promise<void>): Promise<void>;
  /** The content of a pattern, without a camera. */
  look(pattern?: number, loaded?: Promise<void>): Promise<void>;
  /** Back to the cover; closes the camera. */
  stop(): void;
  /** Stops, and tells the visitor of an error of yours. */
  fail(error: unknown): void;
  /** Picture and models in one; while one of them is shown. */
  photograph(type?: 'image/jpeg' | 'image/png'): Promise<Blob>;
  addEventListener<K extends keyof ModarViewerEventMap>(
    type: K, listener: (this: ModarViewer, event: ModarViewerEventMap[K]) => unknown, options?: boolean | AddEventListenerOptions): void;
  addEventListener(
    type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
  removeEventListener<K extends keyof ModarViewerEventMap>(
    type: K, listener: (this: ModarViewer, event: ModarViewerEventMap[K]) => unknown, options?: boolean | EventListenerOptions): void;
  removeEventListener(
    type: string, listener: EventListenerOrEventListenerObject, options?: boolean | EventListenerOptions): void;
}

declare global {
  interface HTMLElementTagNameMap {
    'modar-viewer': ModarViewer;
  }
}

/** Attributes of <modar-viewer>, in JSX too. */
export interface ViewerAttributes {
  src?: string;
  poster?: string;
  alt?: string;
  'max-bytes'?: number | string;
  bare?: boolean | '';
}

// In projects with React; in others these lines say nothing, and they report no errors.
// @ts-ignore
declare module 'react' {
  namespace JSX {
    interface IntrinsicElements {
      // @ts-ignore
      'modar-viewer': ViewerAttributes & import('react').DetailedHTMLProps<import('react').HTMLAttributes<ModarViewer>, ModarViewer>;
    }
  }
}
