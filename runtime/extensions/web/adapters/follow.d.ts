import type { load, Modar, ModarEvents } from '../modar.js';

/** Of load() and of Modar.start(), and: */
export type FollowOptions = Parameters<typeof load>[1] & Parameters<Modar['start']>[1] & {
  /** A video of yours that plays, in place of the camera. */
  video?: HTMLVideoElement;
};

/** The running tracker: `modar` has the events and patterns; close() ends it and frees the camera. */
export interface Following {
  modar: Modar;
  video: HTMLVideoElement;
  /** The camera's picture below the engine's canvas. */
  picture: HTMLCanvasElement;
  close(): void;
}

/** An engine as follow() uses it. */
export interface Engine {
  canvas: HTMLCanvasElement;
  near?: number;
  far?: number;
  /** view: pattern space to GL's eye space, column-major; null: the pattern is not shown. */
  place(name: string, view: Float32Array | null, detail: ModarEvents['updated' | 'lost']['detail']): void;
  /** After the frame's picture was drawn. size: of the canvas, pixels. */
  draw(size: { width: number; height: number }, projection: Float32Array): void;
}

/**
 * Opens the camera, draws its frames below the canvas and passes the poses on. Errors: ModarError, and what getUserMedia() throws.
 * For engines without an adapter.
 */
export function follow(bundle: string | URL | ArrayBuffer | Uint8Array, engine: Engine, options?: FollowOptions): Promise<Following>;
