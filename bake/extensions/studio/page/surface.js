// @ts-check
// The surface of a picture that is not flat: a label, a cup or a box, in the space that the
// bundle's record gives it (formats/bundle.md).
import {thumb} from './api.js';
import {onScreen} from './placing.js';

/**
 * Flat cells that a surface is drawn in, across and down: enough to look bent and in perspective,
 * few enough for a frame.
 */
const CELLS = [20, 6];
/** Cells of the body that no picture covers, all the way round. */
const ROUND = 48;
const BODY = {
  side: '#e2dbcd',
  cap: '#c9c0b0'
};
/** CSS pixels by which cells overlap, so that no seam is seen between them. */
const SEAM_PX = 0.7;
/** Share of a cell's picture that is drawn beyond its edges, for the same. */
const OVERLAP = 0.1;

/** @typedef {Studio.Point} Point */
/** @typedef {{ top_mm?: number | null, bottom_mm?: number | null }} Diameters */
/**
 * picture: '' is the pattern's own, undefined is plain. at: the place of a share of its width and
 * height.
 * @typedef {object} Face
 * @property {string} [picture]
 * @property {number[]} cells
 * @property {(s: number, t: number) => Point} at
 */
/**
 * unit: millimetres in a unit of the picture's space; null: not known. Flat ones have no faces.
 * @typedef {Studio.Box & { unit: number | null, faces: Face[], caps: Point[][] }} Surface
 */

/** @param {Diameters} pattern */
const around = ({top_mm: top, bottom_mm: bottom}) =>
    (Math.PI * ((top ?? 0) + (bottom || (top ?? 0)))) / 2;
/** @param {Studio.Pattern} pattern */
const isRound = ({kind}) => kind === 'cylinder' || kind === 'cone';

/**
 * The width of a pattern's picture along its surface, millimetres; null: not known.
 * @param {Studio.Pattern} pattern
 */
export const widthOf = (pattern) => pattern.width_mm ??
    (isRound(pattern) && pattern.arc_deg ? (around(pattern) * pattern.arc_deg) / 360 : null);

/**
 * Degrees that a picture covers which is so wide along a surface of these diameters.
 * @type {(pattern: Diameters, along: number) => number}
 */
export const arcOf = (pattern, along) => Math.min(360, (360 * along) / around(pattern));
/** @type {(pattern: Diameters, arc: number) => number} */
export const alongOf = (pattern, arc) => (around(pattern) * arc) / 360;

/**
 * Sides of a box, as the bake joins their pictures: {corner, right, down}, millimetres about
 * the middle of the front.
 * @param {Studio.Pattern} pattern
 * @param {Point} size
 */
function boxFaces({sides, file}, [w, h, d]) {
  const [x, y] = [w / 2, h / 2];
  /** @type {[Studio.Side | null, Point, Point, Point][]} */
  const faces = [
    [null, [-x, y, 0], [w, 0, 0], [0, -h, 0]],
    ['right', [x, y, 0], [0, 0, -d], [0, -h, 0]],
    ['back', [x, y, -d], [-w, 0, 0], [0, -h, 0]],
    ['left', [-x, y, -d], [0, 0, d], [0, -h, 0]],
    ['top', [-x, y, -d], [w, 0, 0], [0, 0, d]],
    ['bottom', [-x, -y, 0], [w, 0, 0], [0, 0, -d]],
  ];
  return faces.map(([side, corner, right, down]) => {
    const other = side && sides[side];
    return {corner, right, down, picture: !side ? '' : other ? sideFile(file, other) : undefined};
  });
}

/**
 * What the bake reads for a side of a box: its name is relative to the front's folder.
 * @type {(front: string, side: string) => string}
 */
const sideFile = (front, side) => {
  const path = front.split('/').slice(0, -1);
  for (const part of side.split('/')) part === '..' ? path.pop() : path.push(part);
  return path.join('/');
};

/**
 * Names a file of the project as a side of a box.
 * @type {(front: string, file: string) => string}
 */
export const sideName = (front, file) => {
  const [from, to] = [front, file].map((each) => each.split('/').slice(0, -1));
  const differs = from.findIndex((folder, i) => folder !== to[i]);
  const up = differs < 0 ? 0 : from.length - differs;
  return '../'.repeat(up) + file.split('/').slice(from.length - up).join('/');
};

/**
 * @param {Studio.Pattern} pattern
 * @param {Point} size
 * @returns {Surface}
 */
function box(pattern, [w, h, d]) {
  /** @type {(side: Studio.Side, length: number) => number} */
  const of = (side, length) => (pattern.sides[side] ? length : 0);
  const below = of('top', w) + of('bottom', w);
  const unit =
      Math.max(w + of('right', d) + of('back', w) + of('left', d), below, h + (below ? d : 0)) / 2;
  const faces = boxFaces(pattern, [
                  w, h, d
                ]).map(({corner, right, down, picture}) => ({
                         picture,
                         cells: picture === undefined ? [1, 1] : [CELLS[1], CELLS[1]],
                         at: (/** @type {number} */ s, /** @type {number} */ t) =>
                             corner.map((value, i) => (value + s * right[i] + t * down[i]) / unit)
                       }));
  return {
    unit,
    faces,
    caps: [],
    low: [-w / 2 / unit, -h / 2 / unit, -d / unit],
    high: [w / 2 / unit, h / 2 / unit, 0]
  };
}

/**
 * @param {Studio.Pattern} pattern
 * @param {Studio.Sized} size
 * @param {number} mm its width
 * @returns {Surface}
 */
function round(pattern, {width, height}, mm) {
  const most = Math.max(width, height);
  const [halfWidth, halfHeight] = [width / most, height / most];
  const top = pattern.top_mm ?? 0;
  const halfArc = Math.min(
      Math.PI,
      pattern.arc_deg ? (pattern.arc_deg * Math.PI) / 360 : (Math.PI * mm) / around(pattern));
  const radius = halfWidth / halfArc;
  const slope = (0.5 * (top - (pattern.bottom_mm || top))) / ((mm * height) / width);
  const rise = Math.sqrt(Math.max(0, 1 - slope * slope));
  /** @type {(angle: number, y: number) => Point} */
  const point = (angle, y) => {
    const r = radius + slope * y;
    return [r * Math.sin(angle), rise * y, r * Math.cos(angle) - radius];
  };
  /** @type {(from: number, to: number) => Face['at']} */
  const wall = (from, to) => (s, t) => point(from + s * (to - from), halfHeight * (1 - 2 * t));
  /** @param {number} y */
  const rim = (y) => Array.from({length: ROUND}, (_, i) => point((2 * Math.PI * i) / ROUND, y));
  const widest = radius + Math.abs(slope) * halfHeight;
  return {
    unit: (mm * most) / (2 * width),
    caps: [rim(halfHeight).reverse(), rim(-halfHeight)],
    faces: [
      {picture: undefined, cells: [ROUND, 1], at: wall(halfArc, 2 * Math.PI - halfArc)},
      {picture: '', cells: CELLS, at: wall(-halfArc, halfArc)}
    ],
    low: [-widest, -rise * halfHeight, -radius - widest],
    high: [widest, rise * halfHeight, widest - radius],
  };
}

/**
 * The surface of a pattern whose picture has that size.
 * @param {Studio.Pattern} pattern
 * @param {Studio.Sized} size
 * @returns {Surface}
 */
export function surfaceOf(pattern, size) {
  if (pattern.kind === 'box' && pattern.box_mm) return box(pattern, pattern.box_mm);
  const mm = widthOf(pattern);
  if (isRound(pattern) && mm) return round(pattern, size, mm);
  const most = Math.max(size.width, size.height);
  const half = [size.width / most, size.height / most, 0];
  return {
    unit: pattern.width_mm ? (pattern.width_mm * most) / (2 * size.width) : null,
    faces: [],
    caps: [],
    low: half.map((side) => -side),
    high: half
  };
}

/**
 * Draws surfaces on a canvas as an eye sees them. Their bodies bulge, so that what faces the eye
 * hides nothing else that does.
 */
export class SurfacePainter {
  /** @type {Map<string, HTMLImageElement>} */
  #images = new Map();

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLImageElement} own the pattern's own picture
   * @param {() => void} redraw called when a picture has arrived
   */
  constructor(canvas, own, redraw) {
    this.canvas = canvas;
    this.own = own;
    this.redraw = redraw;
  }

  /**
   * @param {Studio.Eye} eye
   * @param {Surface} surface
   */
  paint(eye, {faces, caps}) {
    const dense = devicePixelRatio || 1;
    const [width, height] =
        [eye.size.width, eye.size.height].map((side) => Math.round(side * dense));
    this.canvas.hidden = !faces.length;
    if (!faces.length) return;
    if (this.canvas.width !== width || this.canvas.height !== height)
      Object.assign(this.canvas, {width, height});
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    for (const cap of caps)
      this.#fill(context, cap.map((point) => onScreen(eye, point)), dense, BODY.cap);
    for (const face of faces) this.#face(context, eye, face, dense);
  }

  /** @param {string} picture */
  #imageOf(picture) {
    if (picture === '') return this.own;
    const known = this.#images.get(picture);
    if (known) return known;
    const image = Object.assign(new Image(), {src: thumb(picture, 720), onload: this.redraw});
    this.#images.set(picture, image);
    return image;
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Studio.Eye} eye
   * @param {Face} face
   * @param {number} dense
   */
  #face(context, eye, {picture, cells: [across, down], at}, dense) {
    const image = picture === undefined ? null : this.#imageOf(picture);
    const ready = image?.complete && image.naturalWidth > 0 ? image : null;
    for (let i = 0; i < across; ++i) {
      for (let j = 0; j < down; ++j) {
        const [left, right, above, below] =
            [i / across, (i + 1) / across, j / down, (j + 1) / down];
        const places = [[left, above], [right, above], [right, below], [left, below]].map(
            ([s, t]) => onScreen(eye, at(s, t)));
        if (!facing(places)) continue;
        if (ready)
          this.#cell(context, ready, places, [left, above, right - left, below - above], dense);
        else this.#fill(context, places, dense, BODY.side);
      }
    }
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {(Point | null)[]} places
   * @param {number} dense
   * @param {string} colour
   */
  #fill(context, places, dense, colour) {
    if (!facing(places)) return;
    context.setTransform(dense, 0, 0, dense, 0, 0);
    outline(context, places);
    Object.assign(context, {fillStyle: colour, strokeStyle: colour, lineWidth: 2 * SEAM_PX});
    context.fill();
    context.stroke();
  }

  /**
   * A part of an image, left, top, width and height of 1, in two triangles.
   * @param {CanvasRenderingContext2D} context
   * @param {HTMLImageElement} image
   * @param {Point[]} places
   * @param {number[]} area
   * @param {number} dense
   */
  #cell(context, image, [a, b, c, d], [left, top, width, height], dense) {
    const [w, h] = [image.naturalWidth, image.naturalHeight];
    const [x, y, u, v] = [left * w, top * h, width * w, height * h];
    // More than the cell, or its own blurred edge is a seam.
    const [startX, startY] = [Math.max(0, x - OVERLAP * u), Math.max(0, y - OVERLAP * v)];
    const [acrossX, acrossY] =
        [Math.min(w, x + (1 + OVERLAP) * u) - startX, Math.min(h, y + (1 + OVERLAP) * v) - startY];
    /** @type {(corners: Point[], right: Point, down: Point, from: Point) => void} */
    const triangle = (corners, right, down, from) => {
      context.save();
      context.setTransform(dense, 0, 0, dense, 0, 0);
      outline(context, grown(corners));
      context.clip();
      context.transform(
          right[0] / u, right[1] / u, down[0] / v, down[1] / v,
          from[0] - (right[0] * x) / u - (down[0] * y) / v,
          from[1] - (right[1] * x) / u - (down[1] * y) / v);
      context.drawImage(image, startX, startY, acrossX, acrossY, startX, startY, acrossX, acrossY);
      context.restore();
    };
    /** @type {(p: Point, q: Point) => Point} */
    const minus = (p, q) => [p[0] - q[0], p[1] - q[1]];
    triangle([a, b, d], minus(b, a), minus(d, a), a);
    triangle([c, d, b], minus(c, d), minus(c, b), [b[0] + d[0] - c[0], b[1] + d[1] - c[1]]);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Point[]} places
 */
function outline(context, places) {
  context.beginPath();
  for (const [x, y] of places) context.lineTo(x, y);
  context.closePath();
}

/**
 * Whether an outline turns clockwise on the screen, as a side does that faces the eye; false of
 * one that is partly behind it.
 * @param {(Point | null)[]} places
 * @returns {places is Point[]}
 */
function facing(places) {
  const seen = places.flatMap((place) => (place ? [place] : []));
  if (seen.length < places.length) return false;
  return seen.reduce((sum, [x, y], i) => {
    const [nextX, nextY] = seen[(i + 1) % seen.length];
    return sum + x * nextY - nextX * y;
  }, 0) > 0;
}

/**
 * A triangle's corners, pushed outwards.
 * @param {Point[]} corners
 */
function grown(corners) {
  const middle = [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / 3);
  return corners.map(([x, y]) => {
    const [dx, dy] = [x - middle[0], y - middle[1]];
    const far = Math.hypot(dx, dy) || 1;
    return [x + (2 * SEAM_PX * dx) / far, y + (2 * SEAM_PX * dy) / far];
  });
}
