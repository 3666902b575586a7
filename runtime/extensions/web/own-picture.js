// @ts-check
// A picture of the visitor's own: photographed, its corners marked, laid flat, tracked, and kept on
// this device alone.
import {ModarError} from './engine.js';
import {fill} from './viewer-words.js';

/**
 * Longer side of the photo that is worked on, and of the flat picture: as modar.js tracks it.
 * Pixels.
 */
const PHOTO_SIDE = 1024;
const FLAT_SIDE = 512;
/** Where the corners are at first, as shares of the photo's sides: people leave a margin. */
const MARGIN = 0.1;
const STEP = 1;
const LARGE_STEP = 16;

/**
 * @typedef {[number, number]} Point x, y in pixels
 *
 * An element of the dialog.
 * @typedef {HTMLElement & Pick<HTMLDialogElement, 'showModal' | 'close'> &
 *     Pick<HTMLInputElement, 'disabled' | 'value'>} Part
 */

/**
 * The map from the unit square to a quadrangle of four corners, clockwise from the top left: P.
 * Heckbert, 1989.
 * @param {Point[]} corners
 * @returns {(u: number, v: number) => Point}
 */
function squareTo([[x0, y0], [x1, y1], [x2, y2], [x3, y3]]) {
  const [ax, ay, bx, by] = [x1 - x2, y1 - y2, x3 - x2, y3 - y2];
  const [sx, sy] = [x0 - x1 + x2 - x3, y0 - y1 + y2 - y3];
  const determinant = ax * by - ay * bx;
  const g = (sx * by - sy * bx) / determinant;
  const h = (ax * sy - ay * sx) / determinant;
  return (u, v) => {
    const w = 1 / (g * u + h * v + 1);
    return [
      ((x1 - x0 + g * x1) * u + (x3 - x0 + h * x3) * v + x0) * w,
      ((y1 - y0 + g * y1) * u + (y3 - y0 + h * y3) * v + y0) * w
    ];
  };
}

/**
 * Clockwise, without an inner angle of half a turn and more: what a flat rectangle looks like in a
 * photo.
 * @param {Point[]} corners
 */
export function isConvex(corners) {
  return corners.every(([x, y], i) => {
    const [[ax, ay], [bx, by]] = [corners[(i + 1) % 4], corners[(i + 2) % 4]];
    return (ax - x) * (by - ay) - (ay - y) * (bx - ax) > 1;
  });
}

/**
 * Longer side of the copy in which corners are looked for, pixels: a corner of it is three of
 * the photo, which the visitor corrects.
 */
const LOOK_SIDE = 192;
/** Sum of the differences in red, green and blue from which a pixel is not part of the table. */
const OFF_TABLE = 48;

/**
 * 1 where a pixel has none of the colours of the photo's rim.
 * @param {ImageData} photo
 */
function offTable({data, width, height}) {
  /** @type {number[]} */
  const rim = [];
  for (let x = 0; x < width; x += 4) rim.push(x, (height - 1) * width + x);
  for (let y = 0; y < height; y += 4) rim.push(y * width, y * width + width - 1);
  return Uint8Array.from({length: width * height}, (_, i) => {
    const near = rim.some(
        (k) => Math.abs(data[4 * i] - data[4 * k]) + Math.abs(data[4 * i + 1] - data[4 * k + 1]) +
                Math.abs(data[4 * i + 2] - data[4 * k + 2]) <
            OFF_TABLE);
    return near ? 0 : 1;
  });
}

/**
 * The pixels of one value of a mask that hang together with `start`, as [x, y]; they become
 * `mark`.
 * @param {number} start
 * @param {Uint8Array} mask
 * @param {number} width
 * @param {number} value
 * @param {number} mark
 */
function partFrom(start, mask, width, value, mark) {
  /** @type {Point[]} */
  const part = [];
  for (const open = [start]; open.length > 0;) {
    const at = /** @type {number} */ (open.pop());
    if (mask[at] !== value) continue;
    mask[at] = mark;
    const x = at % width;
    part.push([x, (at - x) / width]);
    if (x > 0) open.push(at - 1);
    if (x + 1 < width) open.push(at + 1);
    open.push(at - width, at + width);
  }
  return part;
}

/**
 * The largest thing on the table, with what of it has the table's colour.
 * @param {Uint8Array} mask
 * @param {number} width
 */
function largestThing(mask, width) {
  const [table, seen] = [2, 3];
  for (let i = 0; i < mask.length; ++i) {
    const onRim =
        i < width || i >= mask.length - width || i % width === 0 || i % width === width - 1;
    if (onRim && mask[i] === 0) partFrom(i, mask, width, 0, table);
  }
  const things = mask.map((value) => (value === table ? 0 : 1));
  /** @type {Point[]} */
  let best = [];
  for (let i = 0; i < things.length; ++i) {
    const part = things[i] === 1 ? partFrom(i, things, width, 1, seen) : [];
    if (part.length > best.length) best = part;
  }
  return best;
}

/**
 * The line through the part's rim along a side, as [nx, ny, d]: least squares of the distances.
 * @param {Point} from
 * @param {Point} to
 * @param {Point[]} rim
 * @returns {[number, number, number]}
 */
function lineAlong([ax, ay], [bx, by], rim) {
  const length = Math.hypot(bx - ax, by - ay);
  const [ux, uy] = [(bx - ax) / length, (by - ay) / length];
  const near = rim.filter(([x, y]) => {
    const along = ((x - ax) * ux + (y - ay) * uy) / length;
    return along > 0.1 && along < 0.9 && Math.abs((x - ax) * uy - (y - ay) * ux) < 0.06 * length;
  });
  const mean = (/** @type {0 | 1} */ i) =>
      near.reduce((sum, point) => sum + point[i], 0) / near.length;
  const [mx, my] = [mean(0), mean(1)];
  let [xx, xy, yy] = [0, 0, 0];
  for (const [x, y] of near) {
    xx += (x - mx) ** 2;
    xy += (x - mx) * (y - my);
    yy += (y - my) ** 2;
  }
  const turn = 0.5 * Math.atan2(2 * xy, xx - yy);
  const normal = [-Math.sin(turn), Math.cos(turn)];
  return /** @type {[number, number, number]} */ ([...normal, normal[0] * mx + normal[1] * my]);
}

/** @type {(one: [number, number, number], other: [number, number, number]) => Point} */
const crossing =
    ([a, b, c],
     [d, e, f]) => [(c * e - b * f) / (a * e - b * d), (a * f - c * d) / (a * e - b * d)];

/**
 * The corners of one thing on a plain table, in a photo's pixels; null where there is no such
 * thing.
 * @param {HTMLCanvasElement} photo
 * @returns {Point[] | null}
 */
export function findCorners(photo) {
  const scale = LOOK_SIDE / Math.max(photo.width, photo.height);
  const [width, height] = [Math.round(photo.width * scale), Math.round(photo.height * scale)];
  const context =
      /** @type {CanvasRenderingContext2D} */ (canvasOf(photo, width, height).getContext('2d'));
  const small = context.getImageData(0, 0, width, height);
  const part = largestThing(offTable(small), width);
  if (part.length < 0.05 * width * height) return null;
  const inside = new Set(part.map(([x, y]) => y * width + x));
  const rim = part.filter(
      ([x, y]) => [[1, 0], [-1, 0], [0, 1], [0, -1]].some(
          ([dx, dy]) => !inside.has((y + dy) * width + x + dx)));
  const most = (/** @type {(point: Point) => number} */ value) =>
      rim.reduce((best, point) => (value(point) > value(best) ? point : best));
  const rough = [
    most(([x, y]) => -x - y), most(([x, y]) => x - y), most(([x, y]) => x + y),
    most(([x, y]) => y - x)
  ];
  const lines = rough.map((corner, i) => lineAlong(corner, rough[(i + 1) % 4], rim));
  const corners = lines.map((line, i) => crossing(lines[(i + 3) % 4], line));
  const area = 0.5 * Math.abs(corners.reduce((sum, [x, y], i) => {
    const [nextX, nextY] = corners[(i + 1) % 4];
    return sum + x * nextY - nextX * y;
  }, 0));
  // A thing of another shape fills its corners' quadrangle less, or more.
  const fits = Math.abs(part.length / area - 1) < 0.1 && corners.flat().every(Number.isFinite) &&
      isConvex(corners);
  return fits ? corners.map(([x, y]) => [(x + 0.5) / scale, (y + 0.5) / scale]) : null;
}

/**
 * The picture between four corners of a photo, as from the front: the mean of four places for each
 * pixel.
 * @param {ImageData} photo
 * @param {Point[]} corners
 */
export function flatten(photo, corners) {
  /** @type {(i: number, k: number) => number} */
  const length = (i, k) => Math.hypot(corners[i][0] - corners[k][0], corners[i][1] - corners[k][1]);
  const [wide, high] = [(length(0, 1) + length(3, 2)) / 2, (length(0, 3) + length(1, 2)) / 2];
  const scale = Math.min(1, FLAT_SIDE / Math.max(wide, high));
  const flat =
      new ImageData(Math.max(1, Math.round(wide * scale)), Math.max(1, Math.round(high * scale)));
  const place = squareTo(corners);
  /** @type {(sums: number[], x: number, y: number) => void} */
  const add = (sums, x, y) => {
    const [x0, y0] = [
      Math.min(photo.width - 2, Math.max(0, Math.floor(x))),
      Math.min(photo.height - 2, Math.max(0, Math.floor(y)))
    ];
    const [fx, fy] = [Math.min(1, Math.max(0, x - x0)), Math.min(1, Math.max(0, y - y0))];
    const [at, row] = [4 * (y0 * photo.width + x0), 4 * photo.width];
    for (let c = 0; c < 3; ++c) {
      const top = photo.data[at + c] * (1 - fx) + photo.data[at + 4 + c] * fx;
      const bottom = photo.data[at + row + c] * (1 - fx) + photo.data[at + row + 4 + c] * fx;
      sums[c] += top * (1 - fy) + bottom * fy;
    }
  };
  for (let y = 0, to = 0; y < flat.height; ++y) {
    for (let x = 0; x < flat.width; ++x, to += 4) {
      const sums = [0, 0, 0];
      for (const [dx, dy] of [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]) {
        const [u, v] = place((x + dx) / flat.width, (y + dy) / flat.height);
        add(sums, u - 0.5, v - 0.5);
      }
      flat.data.set([sums[0] / 4, sums[1] / 4, sums[2] / 4, 255], to);
    }
  }
  return flat;
}

/**
 * @param {HTMLCanvasElement | ImageData} image
 * @param {number} width
 * @param {number} height
 */
function canvasOf(image, width, height) {
  const canvas = Object.assign(document.createElement('canvas'), {width, height});
  const context =
      /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', {willReadFrequently: true}));
  if (image instanceof ImageData) context.putImageData(image, 0, 0);
  else context.drawImage(image, 0, 0, width, height);
  return canvas;
}

/** The dialog `own` of index.html, and what it has made. */
export class OwnPictures {
  #$ = (/** @type {string} */ id) => /** @type {Part} */ (document.getElementById(id));
  #viewer;
  #cache;
  /** @type {Record<string, string>} */
  #words = {};
  /** @type {Point[]} */
  #corners = [];
  #photo = /** @type {ImageData} */ (/** @type {unknown} */ (null));

  /**
   * kept: the name of the Cache that they are kept in.
   * @param {import('./modar-viewer.js').ModarViewer} viewer
   * @param {string} kept
   */
  constructor(viewer, kept) {
    this.#viewer = viewer;
    this.#cache = () => caches.open(kept);
    this.#listen();
  }

  /** @param {Record<string, string>} words */
  set words(words) {
    this.#words = words;
    this.#handles.forEach(
        (handle, i) => handle.setAttribute('aria-label', fill(words.ownCorner, {number: i + 1})));
  }

  get #handles() { return /** @type {HTMLElement[]} */ ([...this.#$('own-corners').children]); }

  // ---- storage ----

  /** Pictures of earlier visits, to the bundle that the viewer has just loaded. */
  async restore() {
    if (!globalThis.caches) return;
    const cache = await this.#cache();
    for (const request of await cache.keys()) {
      try {
        const kept = /** @type {Response} */ (await cache.match(request));
        await this.#add(
            await createImageBitmap(await kept.blob()), Number(kept.headers.get('x-scene')) || 0);
      } catch (error) {
        const {code = ''} = /** @type {{code?: string}} */ (error);
        // No picture, or of a bundle with fewer scenes: what the network or the browser lacks, the
        // next visit may have.
        if (!code.startsWith('web.') || code === 'web.scene') await cache.delete(request);
      }
    }
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {number} scene
   */
  async #keep(canvas, scene) {
    if (!globalThis.caches) return;
    const blob = await new Promise((resolve) => {
      canvas.toBlob(resolve, 'image/png');
    });
    const cache = await this.#cache();
    await cache.put(
        `own/${Date.now()}.png`,
        new Response(blob, {headers: {'content-type': 'image/png', 'x-scene': String(scene)}}));
  }

  /**
   * @param {HTMLCanvasElement | ImageBitmap} image
   * @param {number} scene
   */
  #add(image, scene) { return this.#viewer.addPattern(image, {name: this.#words.ownName, scene}); }

  // ---- the dialog ----

  /**
   * Shows a photo in it. The bundle is loaded.
   * @param {Blob} file
   */
  async open(file) {
    let image;
    try {
      image = await createImageBitmap(file, {
        imageOrientation: /** @type {ImageOrientation} */ (/** @type {unknown} */ ('from-image'))
      });
    } catch {
      this.#tell(this.#words.ownUnreadable);
      this.#$('own').showModal();
      return;
    }
    const scale = Math.min(1, PHOTO_SIDE / Math.max(image.width, image.height));
    const [width, height] = [Math.round(image.width * scale), Math.round(image.height * scale)];
    const canvas =
        /** @type {HTMLCanvasElement} */ (/** @type {HTMLElement} */ (this.#$('own-photo')));
    Object.assign(canvas, {width, height});
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    context.drawImage(image, 0, 0, width, height);
    this.#photo = context.getImageData(0, 0, width, height);
    const inset =
        [[MARGIN, MARGIN], [1 - MARGIN, MARGIN], [1 - MARGIN, 1 - MARGIN], [MARGIN, 1 - MARGIN]];
    this.#corners = findCorners(canvas) ?? inset.map(([x, y]) => [x * width, y * height]);
    this.#tell('');
    const {scenes} = /** @type {import('./modar.js').Modar} */ (this.#viewer.modar);
    this.#$('own-scene').replaceChildren(...scenes.map(({model}, i) => new Option(model, `${i}`)));
    this.#$('own-which').hidden = scenes.length < 2;
    this.#$('own').showModal();
    this.#show();
  }

  /** @param {string} problem */
  #tell(problem) {
    this.#$('own-problem').textContent = problem;
    this.#$('own-use').disabled = false;
  }

  #show() {
    const {width, height} = this.#photo;
    this.#$('own-quad').setAttribute('viewBox', `0 0 ${width} ${height}`);
    /** @type {Element} */ (this.#$('own-quad').firstElementChild)
        .setAttribute('points', this.#corners.map((corner) => corner.join()).join(' '));
    this.#handles.forEach((handle, i) => {
      const [x, y] = this.#corners[i];
      handle.style.left = `${(100 * x) / width}%`;
      handle.style.top = `${(100 * y) / height}%`;
    });
    this.#$('own-use').disabled = !isConvex(this.#corners);
  }

  /**
   * @param {number} i
   * @param {number} x
   * @param {number} y
   */
  #move(i, x, y) {
    const {width, height} = this.#photo;
    this.#corners[i] = [Math.min(width, Math.max(0, x)), Math.min(height, Math.max(0, y))];
    this.#show();
  }

  async #use() {
    this.#$('own-use').disabled = true;
    const flat = flatten(this.#photo, this.#corners);
    const canvas = canvasOf(flat, flat.width, flat.height);
    const scene = Number(this.#$('own-scene').value) || 0;
    try {
      await this.#add(canvas, scene);
      await this.#keep(canvas, scene)
          .catch(() => {});  // a full device: it works until the page is closed
      this.#$('own').close('added');
    } catch (error) {
      const plain = error instanceof ModarError && error.code.startsWith('pattern.');
      this.#tell(
          plain ? this.#words.ownPlain : String(/** @type {Error} */ (error).message ?? error));
    }
  }

  /**
   * @param {HTMLElement} handle
   * @param {number} i
   */
  #listenToHandle(handle, i) {
    const at = (/** @type {PointerEvent} */ {clientX, clientY}) => {
      const {left, top, width, height} = this.#$('own-photo').getBoundingClientRect();
      this.#move(
          i, ((clientX - left) / width) * this.#photo.width,
          ((clientY - top) / height) * this.#photo.height);
    };
    handle.addEventListener('pointerdown', (event) => handle.setPointerCapture(event.pointerId));
    handle.addEventListener('pointermove', (event) => {
      if (handle.hasPointerCapture(event.pointerId)) at(event);
    });
    handle.addEventListener('keydown', (event) => {
      const by = event.shiftKey ? LARGE_STEP : STEP;
      const way = {ArrowLeft: [-by, 0], ArrowRight: [by, 0], ArrowUp: [0, -by], ArrowDown: [
                     0, by
                   ]}[event.key];
      if (!way) return;
      event.preventDefault();
      this.#move(i, this.#corners[i][0] + way[0], this.#corners[i][1] + way[1]);
    });
  }

  #listen() {
    this.#$('own-use').addEventListener('click', () => this.#use());
    this.#$('own-close').addEventListener('click', () => this.#$('own').close(''));
    this.#handles.forEach((handle, i) => this.#listenToHandle(handle, i));
  }
}
