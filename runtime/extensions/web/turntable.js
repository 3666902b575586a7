// @ts-check
// An eye that looks at a pattern without a camera, and the picture below its content.

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
