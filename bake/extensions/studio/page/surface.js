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

const around = ({top_mm: top, bottom_mm: bottom}) => (Math.PI * (top + (bottom || top))) / 2;
const isRound = ({kind}) => kind === 'cylinder' || kind === 'cone';

/** The width of a pattern's picture along its surface, millimetres; null: not known. */
export const widthOf = (pattern) => pattern.width_mm ??
    (isRound(pattern) && pattern.arc_deg ? (around(pattern) * pattern.arc_deg) / 360 : null);

/** Degrees that a picture covers which is so wide along a surface of these diameters. */
export const arcOf = (pattern, along) => Math.min(360, (360 * along) / around(pattern));
export const alongOf = (pattern, arc) => (around(pattern) * arc) / 360;

/**
 * Sides of a box, as the bake joins their pictures: {side, corner, right, down}, millimetres about
 * the middle of the front.
 */
function boxFaces({box_mm: [w, h, d], sides, file}) {
  const [x, y] = [w / 2, h / 2];
  return [
    [null, [-x, y, 0], [w, 0, 0], [0, -h, 0]],
    ['right', [x, y, 0], [0, 0, -d], [0, -h, 0]],
    ['back', [x, y, -d], [-w, 0, 0], [0, -h, 0]],
    ['left', [-x, y, -d], [0, 0, d], [0, -h, 0]],
    ['top', [-x, y, -d], [w, 0, 0], [0, 0, d]],
    ['bottom', [-x, -y, 0], [w, 0, 0], [0, 0, -d]],
  ].map(([side, corner, right, down]) => ({
          side,
          corner,
          right,
          down,
          picture: side ? sides?.[side] && beside(file, sides[side]) : ''
        }));
}

const beside = (file, other) => file.split('/').slice(0, -1).concat(other).join('/');

function box(pattern) {
  const {box_mm: [w, h, d], sides = {}} = pattern;
  const sum = (...lengths) => lengths.reduce((all, each) => all + (each || 0), 0);
  const below = sum(sides.top && w, sides.bottom && w);
  const unit =
      Math.max(
          sum(w, sides.right && d, sides.back && w, sides.left && d), below, h + (below ? d : 0)) /
      2;
  const faces = boxFaces(pattern).map(
      ({corner, right, down, picture}) => ({
        picture,
        cells: picture === undefined ? [1, 1] : [CELLS[1], CELLS[1]],
        at: (s, t) => corner.map((value, i) => (value + s * right[i] + t * down[i]) / unit)
      }));
  return {
    unit,
    faces,
    caps: [],
    low: [-w / 2 / unit, -h / 2 / unit, -d / unit],
    high: [w / 2 / unit, h / 2 / unit, 0]
  };
}

function round(pattern, {width, height}) {
  const most = Math.max(width, height);
  const [halfWidth, halfHeight] = [width / most, height / most];
  const mm = widthOf(pattern);
  const halfArc = Math.min(
      Math.PI,
      pattern.arc_deg ? (pattern.arc_deg * Math.PI) / 360 : (Math.PI * mm) / around(pattern));
  const radius = halfWidth / halfArc;
  const slope =
      (0.5 * (pattern.top_mm - (pattern.bottom_mm || pattern.top_mm))) / ((mm * height) / width);
  const rise = Math.sqrt(Math.max(0, 1 - slope * slope));
  const point = (angle, y) => {
    const r = radius + slope * y;
    return [r * Math.sin(angle), rise * y, r * Math.cos(angle) - radius];
  };
  const wall = (from, to) => (s, t) => point(from + s * (to - from), halfHeight * (1 - 2 * t));
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
 * The surface of a pattern whose picture has that size: {unit (millimetres in a unit of the
 * picture's space, null: not known), low, high, faces}. A face, which flat ones have none of,
 * is {picture ('': the pattern's own, undefined: plain), cells, at(s, t)}.
 */
export function surfaceOf(pattern, size) {
  if (pattern.kind === 'box' && pattern.box_mm) return box(pattern);
  if (isRound(pattern) && widthOf(pattern)) return round(pattern, size);
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
  #images = new Map();

  /** redraw: called when a picture has arrived. own: the pattern's own picture. */
  constructor(canvas, own, redraw) { Object.assign(this, {canvas, own, redraw}); }

  paint(eye, {faces, caps}) {
    const dense = devicePixelRatio || 1;
    const [width, height] =
        [eye.size.width, eye.size.height].map((side) => Math.round(side * dense));
    this.canvas.hidden = !faces.length;
    if (!faces.length) return;
    if (this.canvas.width !== width || this.canvas.height !== height)
      Object.assign(this.canvas, {width, height});
    const context = this.canvas.getContext('2d');
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    for (const cap of caps)
      this.#fill(context, cap.map((point) => onScreen(eye, point)), dense, BODY.cap);
    for (const face of faces) this.#face(context, eye, face, dense);
  }

  #imageOf(picture) {
    if (picture === '') return this.own;
    if (!this.#images.has(picture))
      this.#images.set(
          picture, Object.assign(new Image(), {src: thumb(picture, 720), onload: this.redraw}));
    return this.#images.get(picture);
  }

  #face(context, eye, {picture, cells: [across, down], at}, dense) {
    const image = picture === undefined ? null : this.#imageOf(picture);
    const ready = image?.complete && image.naturalWidth > 0;
    for (let i = 0; i < across; ++i) {
      for (let j = 0; j < down; ++j) {
        const [left, right, above, below] =
            [i / across, (i + 1) / across, j / down, (j + 1) / down];
        const places = [[left, above], [right, above], [right, below], [left, below]].map(
            ([s, t]) => onScreen(eye, at(s, t)));
        if (!facing(places)) continue;
        if (ready)
          this.#cell(context, image, places, [left, above, right - left, below - above], dense);
        else this.#fill(context, places, dense, BODY.side);
      }
    }
  }

  #fill(context, places, dense, colour) {
    if (!facing(places)) return;
    context.setTransform(dense, 0, 0, dense, 0, 0);
    outline(context, places);
    Object.assign(context, {fillStyle: colour, strokeStyle: colour, lineWidth: 2 * SEAM_PX});
    context.fill();
    context.stroke();
  }

  /** A part of an image, {left, top, width, height} of 1, in two triangles. */
  #cell(context, image, [a, b, c, d], [left, top, width, height], dense) {
    const [w, h] = [image.naturalWidth, image.naturalHeight];
    const [x, y, u, v] = [left * w, top * h, width * w, height * h];
    // More than the cell, or its own blurred edge is a seam.
    const [startX, startY] = [Math.max(0, x - OVERLAP * u), Math.max(0, y - OVERLAP * v)];
    const [acrossX, acrossY] =
        [Math.min(w, x + (1 + OVERLAP) * u) - startX, Math.min(h, y + (1 + OVERLAP) * v) - startY];
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
    const minus = (p, q) => [p[0] - q[0], p[1] - q[1]];
    triangle([a, b, d], minus(b, a), minus(d, a), a);
    triangle([c, d, b], minus(c, d), minus(c, b), [b[0] + d[0] - c[0], b[1] + d[1] - c[1]]);
  }
}

function outline(context, places) {
  context.beginPath();
  for (const [x, y] of places) context.lineTo(x, y);
  context.closePath();
}

/**
 * Whether an outline turns clockwise on the screen, as a side does that faces the eye; false of
 * one that is partly behind it.
 */
function facing(places) {
  if (places.includes(null)) return false;
  return places.reduce((sum, [x, y], i) => {
    const [nextX, nextY] = places[(i + 1) % places.length];
    return sum + x * nextY - nextX * y;
  }, 0) > 0;
}

/** A triangle's corners, pushed outwards. */
function grown(corners) {
  const middle = [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / 3);
  return corners.map(([x, y]) => {
    const [dx, dy] = [x - middle[0], y - middle[1]];
    const far = Math.hypot(dx, dy) || 1;
    return [x + (2 * SEAM_PX * dx) / far, y + (2 * SEAM_PX * dy) / far];
  });
}
