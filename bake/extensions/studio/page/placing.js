// @ts-check
// Places of models on a picture, as numbers: the mathematics of the scene's handles. Matrices are
// column-major lists of 16. Space of the picture: x right, y up the picture, z towards the viewer;
// its longer side is 2.

/** @typedef {ArrayLike<number>} Matrix */
/** @typedef {Studio.Point} Point */

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/**
 * @param {Matrix} a
 * @param {Matrix} b
 * @returns {number[]}
 */
export function multiply(a, b) {
  const product = new Array(16).fill(0);
  for (let column = 0; column < 4; ++column) {
    for (let row = 0; row < 4; ++row) {
      for (let k = 0; k < 4; ++k) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
}

/** @type {(matrix: Matrix, point: Point) => Point} */
export const transform = (matrix, [x, y, z]) => [0, 1, 2].map(
    (row) => matrix[row] * x + matrix[4 + row] * y + matrix[8 + row] * z + matrix[12 + row]);

/**
 * Of what turns, enlarges alike in all directions and moves.
 * @param {Matrix} matrix
 */
export function inverse(matrix) {
  const square = matrix[0] ** 2 + matrix[1] ** 2 + matrix[2] ** 2;
  const turned =
      [0, 1, 2].map((row) => [0, 1, 2].map((column) => matrix[4 * row + column] / square));
  const at =
      turned.map((row) => -(row[0] * matrix[12] + row[1] * matrix[13] + row[2] * matrix[14]));
  return [
    turned[0][0], turned[1][0], turned[2][0], 0, turned[0][1], turned[1][1], turned[2][1], 0,
    turned[0][2], turned[1][2], turned[2][2], 0, ...at, 1
  ];
}

/** @param {Point} by */
export const translation = ([x, y, z]) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1];

/**
 * About an axis (0 x, 1 y, 2 z) by degrees.
 * @param {number} axis
 * @param {number} degrees
 */
export function rotation(axis, degrees) {
  const [cosine, sine] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  const [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
  const matrix = [...IDENTITY];
  matrix[4 * b + b] = matrix[4 * c + c] = cosine;
  matrix[4 * b + c] = sine;
  matrix[4 * c + b] = -sine;
  return matrix;
}

/** @param {number} factor */
export const scaling = (factor) => [factor, 0, 0, 0, 0, factor, 0, 0, 0, 0, factor, 0, 0, 0, 0, 1];

/**
 * What a matrix does, done about a point.
 * @type {(point: Point, matrix: Matrix) => number[]}
 */
export const about = (point, matrix) =>
    multiply(multiply(translation(point), matrix), translation(point.map((value) => -value)));

/**
 * Degrees about x, y and z, in this order, as a scene's `turn` has them, of a turned matrix.
 * @param {Matrix} matrix
 */
export function turnOf(matrix) {
  const scale = Math.hypot(matrix[0], matrix[1], matrix[2]);
  /** @type {(row: number, column: number) => number} */
  const r = (row, column) => matrix[4 * column + row] / scale;
  /** @param {number} radians */
  const degrees = (radians) => Number(((radians * 180) / Math.PI).toFixed(2)) + 0;
  const sine = Math.min(1, Math.max(-1, -r(2, 0)));
  if (Math.abs(sine) > 0.999999)
    return [0, degrees(Math.asin(sine)), degrees(Math.atan2(-r(0, 1), r(1, 1)))];
  return [
    degrees(Math.atan2(r(2, 1), r(2, 2))), degrees(Math.asin(sine)),
    degrees(Math.atan2(r(1, 0), r(0, 0)))
  ];
}

/** @param {Point} turn degrees */
export const turning = ([x, y, z]) =>
    multiply(rotation(2, z), multiply(rotation(1, y), rotation(0, x)));

/**
 * -180 < degrees <= 180
 * @param {number} degrees
 */
export const wrapped = (degrees) => {
  const turned = ((degrees % 360) + 360) % 360;
  return turned > 180 ? turned - 360 : turned;
};

/**
 * The box of a model that stands: {low, high, middle, foot}. half: its sides' halves, the
 * longest 1.
 * @param {Matrix} matrix
 * @param {Point} half
 */
export function boxOf(matrix, half) {
  const reach = [0, 1, 2].map(
      (row) => Math.abs(matrix[row] * half[0]) + Math.abs(matrix[4 + row] * half[1]) +
          Math.abs(matrix[8 + row] * half[2]));
  const middle = [matrix[12], matrix[13], matrix[14]];
  const low = middle.map((value, i) => value - reach[i]);
  return {
    low,
    high: middle.map((value, i) => value + reach[i]),
    middle,
    foot: [middle[0], middle[1], low[2]]
  };
}

// ---- the eye ----

/**
 * Answers the place from the top left, or null behind the eye.
 * @param {Studio.Eye} eye
 * @param {Point} point
 */
export function onScreen({view, focal, size}, point) {
  const [x, y, z] = transform(view, point);
  return z > -1e-6 ? null : [size.width / 2 - (focal * x) / z, size.height / 2 + (focal * y) / z];
}

/** @typedef {{ from: Point, along: Point }} Sight */

/**
 * The line of sight through a place on the screen.
 * @param {Studio.Eye} eye
 * @param {Point} place
 * @returns {Sight}
 */
export function sight({view, focal, size}, [x, y]) {
  const back = inverse([...view]);
  const from = [back[12], back[13], back[14]];
  const to = transform(back, [(x - size.width / 2) / focal, (size.height / 2 - y) / focal, -1]);
  return {from, along: to.map((value, i) => value - from[i])};
}

/** @type {(a: Point, b: Point) => number} */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * Where a line of sight meets the plane through a point; null where it runs parallel or away.
 * @param {Sight} sight
 * @param {Point} point
 * @param {Point} normal
 */
export function meet({from, along}, point, normal) {
  const slope = dot(along, normal);
  if (Math.abs(slope) < 1e-6) return null;
  const far = dot(point.map((value, i) => value - from[i]), normal) / slope;
  return far <= 0 ? null : from.map((value, i) => value + far * along[i]);
}

/**
 * Whether a place on the screen is in the outline of a box, with this margin in pixels.
 * @param {Studio.Eye} eye
 * @param {Studio.Box} box
 * @param {Point} place
 */
export function covers(eye, {low, high}, [x, y], around = 0) {
  const corners = [];
  for (let i = 0; i < 8; ++i) {
    const corner = onScreen(eye, [0, 1, 2].map((axis) => ((i >> axis) & 1 ? high : low)[axis]));
    if (!corner) return false;
    corners.push(corner);
  }
  const hull = hullOf(corners);
  return hull.every(([ax, ay], i) => {
    const [bx, by] = hull[(i + 1) % hull.length];
    return ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / (Math.hypot(bx - ax, by - ay) || 1) >=
        -around;
  });
}

/**
 * Andrew's monotone chain.
 * @param {Point[]} points
 */
function hullOf(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  /** @param {Point[]} list */
  const half = (list) =>
      list.reduce((/** @type {Point[]} */ chain, point) => {
            while (chain.length > 1) {
              const [a, b] = chain.slice(-2);
              if ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0) break;
              chain.pop();
            }
            return [...chain, point];
          }, []).slice(0, -1);
  return [...half(sorted), ...half(sorted.reverse())];
}

// ---- what modar.toml says of a scene ----

const UPRIGHT = {
  x: rotation(1, -90),
  '-x': rotation(1, 90),
  y: rotation(0, 90),
  '-y': rotation(0, -90),
  z: IDENTITY,
  '-z': rotation(0, 180)
};

/**
 * Half the sides of a model's box, the longest 1.
 * @param {Studio.Model | undefined} model
 */
export const halfOf = (model) => {
  const most = Math.max(...(model?.size ?? [1, 1, 1]));
  return (model?.size ?? [1, 1, 1]).map((side) => side / most);
};

/**
 * Model to picture, {matrix, scale}, of a scene before its bake is done. What the bake stores is
 * exact; this takes the model's box for the model, by which one that is turned by an odd angle
 * stands a little too high, and is never drawn but relative to itself.
 * @param {Studio.Scene} scene
 * @param {Studio.Model | undefined} model
 * @param {number | null} unit millimetres
 */
export function placed(scene, model, unit) {
  const turned = multiply(turning(scene.turn), UPRIGHT[scene.up ?? model?.up ?? 'y']);
  const {low, high} = boxOf(turned, halfOf(model));
  const {kind, value} = scene.size;
  const side = kind === 'height' ? high[2] - low[2] : high[0] - low[0];
  const scale = kind === 'scale' ? value : value / (unit ?? 1) / side;
  const inUnits = scene.offset.map((each) => (isInMm(scene, unit) ? each / (unit ?? 1) : 2 * each));
  const lift = scene.centred ? 0 : -scale * low[2];
  return {
    scale,
    matrix: multiply(
        translation([inUnits[0], inUnits[1], inUnits[2] + lift]), multiply(scaling(scale), turned))
  };
}

/**
 * @param {Studio.Scene} scene
 * @param {number | null} unit
 */
export const isInMm = (scene, unit) =>
    scene.offset_unit === 'mm' || (scene.offset_unit === 'usual' && unit !== null);
