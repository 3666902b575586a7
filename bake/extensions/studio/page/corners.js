// @ts-check
// Four corners on a photo, dragged with a magnifier or moved by a pixel with the arrow keys.
import {part} from './parts.js';
import {t} from './words.js';

const m = window.m;
/** The magnifier: CSS pixels across, and how much larger it shows the photo than the stage does. */
const LENS = 132;
const ZOOM = 4;
/** Milliseconds after the last key until the corners count as set. */
const KEYS_REST_MS = 500;
const NAMES = ['cornerTopLeft', 'cornerTopRight', 'cornerBottomRight', 'cornerBottomLeft'];
/** @type {Record<string, Studio.Point>} */
const WAYS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1]
};

/**
 * photo: address. size: width and height of it, pixels, which corners are in. onmove: while they
 * move. onset: when they rest.
 * @typedef {object} CornersAttributes
 * @property {string} photo
 * @property {Studio.Point} size
 * @property {Studio.Point[]} corners
 * @property {(corners: Studio.Point[]) => unknown} onmove
 * @property {(corners: Studio.Point[]) => unknown} onset
 */
/** @typedef {Studio.Vnode<CornersAttributes>} CornersVnode */

export class Corners {
  /** @param {CornersVnode} vnode */
  constructor({attrs}) {
    this.attrs = attrs;
    this.corners = attrs.corners.map((corner) => [...corner]);
    this.held = -1;
    this.timer = 0;
    this.dom = document.body;  // until oncreate()
    this.observer = new ResizeObserver(() => this.paint());
  }

  /** @param {CornersVnode} vnode */
  oncreate({dom}) {
    this.dom = dom;
    this.observer.observe(dom);
    this.paint();
  }

  /** @param {CornersVnode} vnode */
  onupdate({attrs}) {
    this.attrs = attrs;
    if (this.held < 0 && !this.timer) this.corners = attrs.corners.map((corner) => [...corner]);
    this.paint();
  }

  onremove() {
    this.observer.disconnect();
    clearTimeout(this.timer);
  }

  /** The photo as large as it fits, in the middle: {scale, left, top}, CSS pixels. */
  fit() {
    const [width, height] = this.attrs.size;
    const {clientWidth, clientHeight} = this.dom;
    const scale = Math.min(clientWidth / width, clientHeight / height);
    return {
      scale,
      left: (clientWidth - width * scale) / 2,
      top: (clientHeight - height * scale) / 2
    };
  }

  paint() {
    const {scale, left, top} = this.fit();
    const [width, height] = this.attrs.size;
    const sheet = part(this.dom, '.sheet', HTMLElement);
    Object.assign(sheet.style, {
      left: `${left}px`,
      top: `${top}px`,
      width: `${width * scale}px`,
      height: `${height * scale}px`
    });
    const outline = this.corners.map(([x, y]) => `${x},${y}`).join(' ');
    part(this.dom, 'polygon', SVGElement).setAttribute('points', outline);
    const hole = this.corners.map(([x, y]) => `${x} ${y}`).join('L');
    part(this.dom, '.shade', SVGElement).setAttribute('d', `M0 0H${width}V${height}H0Z M${hole}Z`);
    /** @type {NodeListOf<HTMLElement>} */
    const handles = this.dom.querySelectorAll('.corner');
    handles.forEach((handle, i) => {
      const [x, y] = this.corners[i];
      Object.assign(handle.style, {left: `${x * scale}px`, top: `${y * scale}px`});
      handle.setAttribute(
          'aria-label', t('cornerAt', {corner: t(NAMES[i]), x: Math.round(x), y: Math.round(y)}));
    });
    this.paintLens(scale);
  }

  /** @param {number} scale */
  paintLens(scale) {
    const lens = part(this.dom, '.lens', HTMLCanvasElement);
    lens.hidden = this.held < 0;
    if (this.held < 0) return;
    const [x, y] = this.corners[this.held];
    const dense = devicePixelRatio || 1;
    if (lens.width !== Math.round(LENS * dense))
      lens.width = lens.height = Math.round(LENS * dense);
    /** @type {(at: number, most: number) => number} */
    const away = (at, most) =>
        (at > most / 2 ? -LENS - 28 : 28);  // next to the finger, towards the middle
    const [width, height] = this.attrs.size;
    Object.assign(
        lens.style,
        {left: `${x * scale + away(x, width)}px`, top: `${y * scale + away(y, height)}px`});
    const photo = part(this.dom, 'img', HTMLImageElement);
    const context = /** @type {CanvasRenderingContext2D} */ (lens.getContext('2d'));
    const zoom = ZOOM * scale * dense;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = '#777';
    context.fillRect(0, 0, lens.width, lens.height);
    context.setTransform(zoom, 0, 0, zoom, lens.width / 2 - x * zoom, lens.height / 2 - y * zoom);
    context.imageSmoothingEnabled = zoom < 3;
    if (photo.complete && photo.naturalWidth) context.drawImage(photo, 0, 0, width, height);
    /** @type {(colour: string, thickness: number) => void} */
    const draw = (colour, thickness) => {
      context.beginPath();
      this.corners.forEach(([x, y]) => context.lineTo(x, y));
      context.closePath();
      Object.assign(context, {strokeStyle: colour, lineWidth: thickness / zoom});
      context.stroke();
    };
    draw('rgb(0 0 0 / .6)', 4 * dense);
    draw('#fff', 1.5 * dense);
  }

  /**
   * @param {number} corner
   * @param {number} x
   * @param {number} y
   */
  move(corner, x, y) {
    const [width, height] = this.attrs.size;
    this.corners[corner] = [Math.min(width, Math.max(0, x)), Math.min(height, Math.max(0, y))];
    this.paint();
    this.attrs.onmove(this.corners);
  }

  rest() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.attrs.onset(this.corners.map(([x, y]) => [Number(x.toFixed(2)), Number(y.toFixed(2))]));
  }

  /**
   * The pointer need not be in the corner's middle: it keeps its distance.
   * @param {Studio.On<PointerEvent>} event
   * @param {number} corner
   */
  press(event, corner) {
    event.redraw = false;
    if (event.button !== 0) return;
    event.preventDefault();
    const handle = /** @type {HTMLElement} */ (event.currentTarget);
    handle.setPointerCapture(event.pointerId);
    handle.focus({preventScroll: true});
    const {scale} = this.fit();
    const from = {at: [...this.corners[corner]], x: event.clientX, y: event.clientY};
    this.held = corner;
    this.paint();
    handle.onpointermove = (move) => {
      this.move(
          corner, from.at[0] + (move.clientX - from.x) / scale,
          from.at[1] + (move.clientY - from.y) / scale);
    };
    handle.onpointerup = handle.onpointercancel = (up) => {
      handle.onpointermove = handle.onpointerup = handle.onpointercancel = null;
      this.held = -1;
      this.paint();
      if (up.clientX !== from.x || up.clientY !== from.y) this.rest();
    };
  }

  /**
   * @param {Studio.On<KeyboardEvent>} event
   * @param {number} corner
   */
  key(event, corner) {
    event.redraw = false;
    const way = WAYS[event.key];
    if (!way) return;
    event.preventDefault();
    const by = event.shiftKey ? 10 : 1;
    const [x, y] = this.corners[corner];
    this.held = corner;
    this.move(corner, x + by * way[0], y + by * way[1]);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.rest(), KEYS_REST_MS);
  }

  /** @param {Studio.On<FocusEvent>} event */
  leave(event) {
    event.redraw = false;
    this.held = -1;
    this.paint();
    if (this.timer) this.rest();
  }

  /** @param {CornersVnode} vnode */
  view({attrs}) {
    const [width, height] = attrs.size;
    return m(
        'div.corners', {role: 'group', 'aria-label': t('corners')},
        m('div.sheet', m('img', {
            src: attrs.photo,
            alt: t('photo'),
            draggable: false,
            onload: (event) => {
              event.redraw = false;
              this.paint();
            }
          }),
          m('svg',
            {viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: 'none', 'aria-hidden': 'true'},
            m('path.shade', {'fill-rule': 'evenodd'}), m('polygon')),
          NAMES.map((corner, i) => m('button.corner', {
                      key: corner,
                      type: 'button',
                      'aria-describedby': 'corner-help',
                      onpointerdown: (event) => this.press(event, i),
                      onkeydown: (event) => this.key(event, i),
                      onblur: (event) => this.leave(event)
                    })),
          m('canvas.lens', {hidden: true, 'aria-hidden': 'true'})));
  }
}
