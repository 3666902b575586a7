// @ts-check
// A look without a camera: the content of a picture, seen from anywhere around it.

/** Across the canvas' smaller side, as from a hand's distance. */
const FIELD = (40 * Math.PI) / 180;
/**
 * The eye's first height and its limits: not under the picture, and not so high that "up" is
 * lost.
 */
const FIRST_TILT = (32 * Math.PI) / 180;
const TILTS = [(8 * Math.PI) / 180, (86 * Math.PI) / 180];
/**
 * Seconds of the turn that it makes by itself, to show that it is a thing in space: moving for
 * longer asks for a pause button.
 */
const SHOW_SECONDS = 4;
const MARGIN = 1.06;

/** @type {(a: number[], b: number[], scale?: number) => number[]} */
const sum = (a, b, scale = 1) => a.map((value, i) => value + scale * b[i]);
/** @type {(a: number[], b: number[]) => number} */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * Pattern space to GL's eye space for an eye that looks at `target`, x to the right; column-major.
 * @param {{ target: number[], turn: number, tilt: number, distance: number }} eye
 */
export function viewFrom({target, turn, tilt, distance}) {
  const right = [Math.cos(turn), Math.sin(turn), 0];
  const back = [Math.sin(turn) * Math.cos(tilt), -Math.cos(turn) * Math.cos(tilt), Math.sin(tilt)];
  const up = [-Math.sin(turn) * Math.sin(tilt), Math.cos(turn) * Math.sin(tilt), Math.cos(tilt)];
  const eye = sum(target, back, distance);
  return Float32Array.of(
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(back, eye), 1);
}

/**
 * CSS' matrix3d() that lays an image of width x height pixels, its origin at its top left, on
 * the pattern as the view shows it in a viewport in CSS pixels.
 * @param {Float32Array} view
 * @param {number} focal in these pixels
 * @param {{ width: number, height: number }} viewport
 * @param {{ width: number, height: number }} image
 */
export function groundTransform(view, focal, viewport, {width, height}) {
  const most = Math.max(width, height);
  // Columns: an image pixel to the right, one down, and the image's top left, in eye space.
  /** @type {(column: number) => number[]} */
  const axis = (column) => [view[4 * column], view[4 * column + 1], view[4 * column + 2]];
  const right = axis(0).map((value) => (2 / most) * value);
  const down = axis(1).map((value) => (-2 / most) * value);
  const origin = sum(sum(axis(3), axis(0), -width / most), axis(1), height / most);
  /** @type {(place: number[]) => number[]} */
  const onScreen = ([
    x, y, z
  ]) => [focal * x - (viewport.width / 2) * z, -focal * y - (viewport.height / 2) * z, 0, -z];
  return [onScreen(right), onScreen(down), [0, 0, 1, 0], onScreen(origin)].flat();
}

export class Turntable {
  #view;
  #image;
  #pattern = 0;
  /**
   * @type {{ low: number[], high: number[], picture: { width: number, height: number } } |
   *     undefined}
   */
  #box;
  #handle = 0;
  /** The visitor's own: {turn, tilt, size}; the eye goes the other way round. */
  gesture = {turn: 0, tilt: FIRST_TILT, size: 1};

  /**
   * view: of modar-view.js. image: an <img> under the models' canvas, of the same place.
   * @param {import('./modar-view.js').View} view
   * @param {HTMLImageElement} image
   */
  constructor(view, image) {
    this.#view = view;
    this.#image = image;
  }

  /**
   * picture: {width, height} of the pattern, and whether it is flat.
   * @param {number} pattern
   * @param {import('./modar-viewer.js').ViewerPattern} picture
   */
  show(pattern, picture) {
    this.#pattern = pattern;
    this.#image.hidden = picture.flat === false;
    const most = Math.max(picture.width, picture.height);
    const half = [picture.width / most, picture.height / most, 0];
    const {low, high} = this.#view.bounds(pattern) ?? {low: half.map((side) => -side), high: half};
    this.#box = {
      low: low.map((value, i) => Math.min(value, -half[i])),
      high: high.map((value, i) => Math.max(value, half[i])),
      picture,
    };
    this.reset();
    if (!matchMedia('(prefers-reduced-motion: reduce)').matches) this.#present();
  }

  reset() {
    Object.assign(this.gesture, {turn: 0, tilt: FIRST_TILT, size: 1});
    this.touched();
  }

  /** Once around, slower towards the end. */
  #present() {
    const began = performance.now();
    /** @param {number} now */
    const step = (now) => {
      const share = Math.min(1, Math.max(0, (now - began) / (1000 * SHOW_SECONDS)));
      this.gesture.turn = 2 * Math.PI * (1 - (1 - share) ** 3);
      this.draw();
      if (share < 1) this.#handle = requestAnimationFrame(step);
    };
    this.#handle = requestAnimationFrame(step);
  }

  /** The visitor has changed `gesture`: nothing moves by itself any more. */
  touched() {
    cancelAnimationFrame(this.#handle);
    this.draw();
  }

  close() {
    cancelAnimationFrame(this.#handle);
    this.#image.hidden = true;
  }

  draw() {
    if (!this.#box) return;
    const {low, high, picture} = this.#box;
    const {gesture} = this;
    gesture.tilt = Math.min(TILTS[1], Math.max(TILTS[0], gesture.tilt));
    const target = low.map((value, i) => (value + high[i]) / 2);
    const radius = Math.hypot(...low.map((value, i) => (high[i] - value) / 2));
    const distance = (MARGIN * radius) / Math.sin(FIELD / 2) / gesture.size;
    const view = viewFrom({target, turn: -gesture.turn, tilt: gesture.tilt, distance});
    const {clientWidth: width, clientHeight: height} =
        /** @type {HTMLElement} */ (this.#image.parentElement);
    const focal = Math.min(width, height) / 2 / Math.tan(FIELD / 2);
    this.#view.drawFrom(this.#pattern, view, focal);
    const numbers = groundTransform(view, focal, {width, height}, picture);
    this.#image.style.transform = `matrix3d(${numbers.join()})`;
  }
}
