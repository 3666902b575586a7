// @ts-check
// The scene as the device draws it, by the engine that `modar web` ships, and the handles that
// move its models.
import {groundTransform, viewFrom} from './engine/turntable.js';
import {View} from './engine/modar-view.js';
import {part} from './parts.js';
import {SurfacePainter} from './surface.js';
import {about, boxOf, covers, IDENTITY, inverse, meet, multiply, onScreen, placed, rotation, scaling, sight, translation, wrapped} from './placing.js';

/** Across the stage's smaller side, degrees to radians: as a phone at arm's length sees. */
const FIELD = (40 * Math.PI) / 180;
/** Where the eye stands: {turn, tilt}, radians. */
export const EYES = {
  phone: {turn: -0.32, tilt: 0.66},
  above: {turn: 0, tilt: Math.PI / 2},
  side: {turn: 0, tilt: 0.035}
};
const TILTS = [0.02, Math.PI / 2];
/** Milliseconds after the last key until a change counts as made. */
const KEYS_REST_MS = 400;
const GLIDE_MS = 260;
const MARGIN = 1.12;
/**
 * Scenes that the engine draws one by one, see kMostOwn of runtime/extensions/web/engine.cpp;
 * further ones are drawn where they were baked.
 */
const MOST_SINGLE = 8;
/** Dragged models snap to the middle, and to whole parts of a turn, within: pixels and degrees. */
const SNAP_PX = 7;
const SNAP_DEGREES = [15, 2.5];
/** How far outside a model's box a finger still means it, pixels. */
const REACH_PX = 8;
/**
 * Where the turning ring has its knob, radians from the right; how far above a model its lifting
 * handle is, in the picture's space.
 */
const KNOB = -2.4;
const LIFTED = 0.22;
/**
 * Seen from above, lifting has no direction: its handle is away when it comes so near to the foot,
 * pixels.
 */
const TOO_NEAR_PX = 34;
/** @typedef {Studio.Point} Point */
/** @typedef {Studio.Placed} Placed */
/** @typedef {ReturnType<typeof boxOf>} StandingBox */
/** @typedef {{ picture: HTMLCanvasElement, models: HTMLCanvasElement }} Layers */
/** @typedef {StandingBox & Record<Handle, Point> & { around: number, ring: number }} Places */
/**
 * What the pointer or the keys hold. apart: of two fingers. delta: what moves the scene meanwhile.
 * @typedef {object} Drag
 * @property {Handle | 'orbit' | 'pinch'} kind
 * @property {Placed | null} scene
 * @property {StandingBox} box
 * @property {Studio.Eye} eye
 * @property {Point} from
 * @property {Point} last
 * @property {number} apart
 * @property {number[]} [delta]
 * @property {Studio.Change | null} [change]
 */
/**
 * change: {move} in the picture's space, {turn} or {size}.
 * @typedef {object} Told
 * @property {(scene: Placed) => void} select
 * @property {(scene: Placed, change: Studio.Change) => unknown} change
 * @property {(change: Studio.Change | null) => string} words
 * @property {(error: Studio.Wrong) => void} failed
 */

const KEY_STEPS = {
  move: [0.01, 0.05],
  turn: [1, 15],
  size: [1.01, 1.1]
};
/** @type {Record<string, Point>} */
const WAYS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1]
};

/** @typedef {'move' | 'lift' | 'turn' | 'size' | 'tilt0' | 'tilt1'} Handle */
/** @type {Handle[]} */
export const HANDLES = ['move', 'lift', 'turn', 'size', 'tilt0', 'tilt1'];

const still = () => matchMedia('(prefers-reduced-motion: reduce)').matches;
/** @type {(a: number[], b: number[]) => boolean} */
const near = (a, b) => a.every((value, i) => Math.abs(value - b[i]) < 1e-6);

function canvases() {
  const made = ['picture', 'models'].map(
      (name) => Object.assign(document.createElement('canvas'), {className: name}));
  return {picture: made[0], models: made[1]};
}

/**
 * dom: a .stage3d with .layers, img.ground, svg.guides and a button[data-handle] a handle.
 */
export class Stage {
  /** @type {View | null} */
  #view = null;
  /** @type {Layers | null} */
  #layers = null;
  #loads = 0;
  /**
   * What draws the next bundle.
   * @type {{ layers: Layers, give: (bytes: Uint8Array) => void, view: Promise<View> } | null}
   */
  #next = null;
  #eye = {...EYES.phone, zoom: 1};
  /** @type {Point} */
  #target = [0, 0, 0];
  #radius = 1;
  #frame = 0;
  /** @type {((now: number) => void) | null} */
  #glide = null;
  /** @type {Map<number, Point>} */
  #pointers = new Map();
  /** @type {Drag | null} */
  #drag = null;
  /** @type {Handle | null} */
  #keyed = null;
  #timer = 0;
  /** @type {Studio.Scene[]} */
  #bakedNow = [];
  /** @type {import('./surface.js').Surface | null} */
  #ground = null;
  /** Numbers of the scenes that the engine draws one by one, as text, and how many they are. */
  #stood = '';
  #own = 0;

  /**
   * @param {HTMLElement} dom
   * @param {Told} told
   */
  constructor(dom, told) {
    this.dom = dom;
    this.told = told;
    /** @type {Studio.Pattern | null} */
    this.pattern = null;
    /** @type {number | null} */
    this.unit = null;
    /** @type {Placed[]} */
    this.scenes = [];
    /** @type {string | null} */
    this.selected = null;
    this.tilting = false;
    this.surface = new SurfacePainter(
        part(dom, '.body', HTMLCanvasElement), part(dom, '.ground', HTMLImageElement),
        () => this.draw());
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(dom);
    dom.addEventListener('pointerdown', (event) => this.#press(event));
    dom.addEventListener('pointermove', (event) => this.#hover(event));
    dom.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 600));
    }, {passive: false});
    dom.addEventListener('keydown', (event) => this.#key(event));
    dom.addEventListener('focusout', () => this.#restKeys());
  }

  close() {
    this.observer.disconnect();
    cancelAnimationFrame(this.#frame);
    ++this.#loads;
    this.#drop(this.#next?.layers);
    this.#drop(this.#layers);
  }

  /**
   * Opens a context and an engine for the next bundle: without a graphics card a context takes 100
   * to 280 ms.
   */
  #prepare() {
    const layers = canvases();
    part(this.dom, '.layers', HTMLElement).append(layers.picture, layers.models);
    layers.models.style.opacity = layers.picture.style.opacity = '0';
    /** @type {(bytes: Uint8Array) => void} */
    let give = () => {};
    const view = View.create(
        new Promise((/** @type {(bytes: Uint8Array) => void} */ done) => {
          give = done;
        }),
        {...layers, fixedLight: true});
    view.catch(() => {});  // told by load()
    return {layers, give, view};
  }

  /**
   * A bundle takes the place of the one that is drawn once it can be drawn itself. baked: scenes
   * as it has them, in its order.
   * @param {Uint8Array} bytes
   * @param {Studio.Scene[]} baked
   */
  async load(bytes, baked) {
    const load = ++this.#loads;
    const {layers, give, view: made} = this.#next ?? this.#prepare();
    this.#next = null;
    try {
      give(bytes);
      const view = await made;
      if (load !== this.#loads) {
        this.#drop(layers);
        return;
      }
      this.#drop(this.#layers);
      this.#view = view;
      this.#layers = layers;
      this.#bakedNow = baked;
      this.#stood = '';
      this.#own = 0;
      layers.models.style.opacity = '1';
      this.draw(true);
      setTimeout(() => {
        if (load === this.#loads) this.#next = this.#prepare();
      });  // once it is seen
    } catch (error) {
      this.#drop(layers);
      if (load === this.#loads) this.told.failed(/** @type {Studio.Wrong} */ (error));
    }
  }

  /**
   * Browsers draw with a few contexts at a time: this one is given back now.
   * @param {Layers | null | undefined} layers
   */
  #drop(layers) {
    if (!layers) return;
    layers.models.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
    for (const canvas of Object.values(layers)) canvas.remove();
  }

  /**
   * scenes: the project's.
   * @param {{ pattern: Studio.Pattern, scenes: Placed[], selected: string | null,
   *     surface: import('./surface.js').Surface, tilting: boolean }} what
   */
  show({pattern, scenes, selected, surface, tilting}) {
    const first = this.pattern !== pattern || !this.#ground;
    Object.assign(this, {pattern, scenes, selected, tilting, unit: surface.unit});
    this.#ground = surface;
    if (first || !this.#pointers.size) this.#frameAll(surface, first);
    this.draw();
  }

  /**
   * What the eye goes round: the picture and its models.
   * @param {Studio.Box} ground
   * @param {boolean} at_once
   */
  #frameAll(ground, at_once) {
    const boxes = [ground, ...this.scenes.map((scene) => boxOf(scene.matrix, scene.half))];
    const low = [0, 1, 2].map((axis) => Math.min(...boxes.map((box) => box.low[axis])));
    const high = [0, 1, 2].map((axis) => Math.max(...boxes.map((box) => box.high[axis])));
    const target = low.map((value, i) => (value + high[i]) / 2);
    const radius = Math.hypot(...low.map((value, i) => (high[i] - value) / 2));
    if (at_once) {
      this.#target = target;
      this.#radius = radius;
    } else if (!near([...target, radius], [...this.#target, this.#radius]))
      this.#glideTo({target, radius});
  }

  /** @param {keyof typeof EYES} name */
  look(name) { this.#glideTo({...EYES[name], zoom: 1}); }

  /** @param {number} factor */
  zoom(factor) {
    this.#eye.zoom = Math.min(8, Math.max(0.4, this.#eye.zoom * factor));
    this.draw();
  }

  /**
   * @param {number} turn
   * @param {number} tilt
   */
  orbit(turn, tilt) {
    this.#eye.turn += turn;
    this.#eye.tilt = Math.min(TILTS[1], Math.max(TILTS[0], this.#eye.tilt + tilt));
    this.draw();
  }

  /**
   * @param {{ turn?: number, tilt?: number, zoom?: number, target?: Point, radius?: number }} aim
   */
  #glideTo(aim) {
    const from = {...this.#eye, target: this.#target, radius: this.#radius};
    const to = {...from, ...aim};
    const began = performance.now();
    this.#glide = (now) => {
      const share = still() ? 1 : Math.min(1, (now - began) / GLIDE_MS);
      const eased = 1 - (1 - share) ** 3;
      /** @type {(a: number, b: number) => number} */
      const between = (a, b) => a + (b - a) * eased;
      this.#eye = {
        turn: between(from.turn, to.turn),
        tilt: between(from.tilt, to.tilt),
        zoom: between(from.zoom, to.zoom)
      };
      this.#target = from.target.map((value, i) => between(value, to.target[i]));
      this.#radius = between(from.radius, to.radius);
      if (share === 1) this.#glide = null;
    };
    this.draw();
  }

  // ---- drawing ----

  eye() {
    const size = {width: this.dom.clientWidth, height: this.dom.clientHeight};
    const focal = Math.min(size.width, size.height) / 2 / Math.tan(FIELD / 2);
    const distance = (MARGIN * this.#radius) / Math.sin(FIELD / 2) / this.#eye.zoom;
    return {
      size,
      focal,
      view: viewFrom({target: this.#target, turn: this.#eye.turn, tilt: this.#eye.tilt, distance})
    };
  }

  draw(now = false) {
    if (now) {
      cancelAnimationFrame(this.#frame);
      this.#paint(performance.now());
    } else this.#frame ||= requestAnimationFrame((time) => this.#paint(time));
  }

  /** @param {number} time */
  #paint(time) {
    this.#frame = 0;
    this.#glide?.(time);
    if (!this.#ground || !this.dom.clientWidth) return;
    const eye = this.eye();
    this.#paintGround(eye, this.#ground);
    this.#paintModels(eye);
    this.#paintHandles(eye);
    this.dom.dataset.drawn = String(Number(this.dom.dataset.drawn ?? 0) + 1);
    if (this.#glide) this.draw();
  }

  /**
   * @param {Studio.Eye} eye
   * @param {import('./surface.js').Surface} ground
   */
  #paintGround(eye, ground) {
    const {view, focal, size} = eye;
    const image = part(this.dom, '.ground', HTMLImageElement);
    image.hidden = ground.faces.length > 0;
    this.surface.paint(eye, ground);
    const {naturalWidth: width, naturalHeight: height} = image;
    if (width)
      image.style.transform =
          `matrix3d(${groundTransform(view, focal, size, {width, height}).join()})`;
  }

  /**
   * Where a scene is drawn: under the hand that drags it before the project says so.
   * @param {Placed} scene
   */
  #matrixOf(scene) {
    return this.#drag?.scene?.key === scene.key && this.#drag.delta ?
        multiply(this.#drag.delta, scene.matrix) :
        scene.matrix;
  }

  /**
   * The bundle's scenes on this picture, each with the project's of the same model: {number, now,
   * was}.
   */
  #pairs() {
    const rest = [...this.scenes];
    return this.#bakedNow.map((was, number) => ({was, number}))
        .filter(({was}) => was.pattern === this.pattern?.name)
        .map(({was, number}) => {
          const at = rest.findIndex((scene) => scene.model === was.model);
          return {number, was, now: at < 0 ? null : rest.splice(at, 1)[0]};
        });
  }

  /** @param {Studio.Eye} eye */
  #paintModels({view, focal}) {
    if (!this.#view || !this.#layers) return;
    const pattern = this.#view.patterns.findIndex(({name}) => name === this.pattern?.name);
    const pairs = this.#pairs();
    this.#layers.models.hidden = pattern < 0 || !pairs.length;
    if (this.#layers.models.hidden) return;
    const moved = pairs.map(
        ({now, was}) => now &&
            multiply(this.#matrixOf(now), inverse(placed(was, now.asset, this.unit).matrix)));
    if (moved.every((matrix) => matrix && near(matrix, IDENTITY))) {
      this.#view.drawFrom(pattern, view, focal);
      return;
    }
    const kept = this.#view.patterns.length;
    const single = pairs.slice(0, MOST_SINGLE);
    const which = JSON.stringify(single.map(({number}) => number));
    if (which !== this.#stood) {
      this.#view.forgetPatterns(kept - this.#own);
      this.#own = 0;
      for (const {number, was} of single)
        if (this.#view.stand(was.model, number)) ++this.#own;
      this.#stood = which;
    }
    const base = this.#view.patterns.length - this.#own;
    /** @type {[number, Float32Array][]} */
    const views = [];
    moved.slice(0, single.length).forEach((matrix, i) => {
      if (matrix) views.push([base + i, Float32Array.from(multiply(view, matrix))]);
    });
    this.#view.drawEach(views, focal);
  }

  // ---- handles ----

  /**
   * Places of the selection's handles, in the picture's space.
   * @param {Placed} scene
   * @returns {Places}
   */
  #places(scene) {
    const {low, high, foot, middle} = boxOf(this.#matrixOf(scene), scene.half);
    const around = Math.max(high[0] - low[0], high[1] - low[1]) / 2 * 1.25;
    const spin =
        this.#drag?.kind === 'turn' ? ((this.#drag.change?.turn?.[1] ?? 0) * Math.PI) / 180 : 0;
    const [c, s] = [Math.cos(spin + KNOB), Math.sin(spin + KNOB)];
    const ring = Math.max(around, (high[2] - low[2]) / 2 * 1.2);
    return {
      low,
      high,
      foot,
      middle,
      around,
      ring,
      move: foot,
      lift: [foot[0], foot[1], high[2] + LIFTED],
      turn: [foot[0] + around * c, foot[1] + around * s, foot[2]],
      size: [high[0], low[1], high[2]],
      tilt0: [middle[0], middle[1] - 0.98 * ring, middle[2] + 0.2 * ring],
      tilt1: [middle[0] - 0.87 * ring, middle[1], middle[2] + 0.5 * ring],
    };
  }

  /**
   * @param {Studio.Eye} eye
   * @param {Point} middle
   * @param {number} radius
   * @param {number} axis
   */
  #ring(eye, middle, radius, axis) {
    const points = [];
    for (let i = 0; i < 64; ++i) {
      const angle = (i * Math.PI) / 32;
      const point = [...middle];
      point[(axis + 1) % 3] += radius * Math.cos(angle);
      point[(axis + 2) % 3] += radius * Math.sin(angle);
      const place = onScreen(eye, point);
      if (place) points.push(place.map((value) => value.toFixed(1)).join(' '));
    }
    return points.length ? `M${points.join('L')}Z` : '';
  }

  /**
   * @param {Studio.Eye} eye
   * @param {Point[]} points
   */
  #line(eye, ...points) {
    const places = points.flatMap((point) => {
      const place = onScreen(eye, point);
      return place ? [place.map((value) => value.toFixed(1)).join(' ')] : [];
    });
    return places.length < points.length ? '' : `M${places.join('L')}`;
  }

  /** @param {Studio.Eye} eye */
  #paintHandles(eye) {
    const scene = this.scenes.find(({key}) => key === this.selected);
    /** @type {NodeListOf<SVGPathElement>} */
    const paths = this.dom.querySelectorAll('.guides path');
    /** @type {NodeListOf<HTMLElement>} */
    const buttons = this.dom.querySelectorAll('[data-handle]');
    const places = scene ? this.#places(scene) : null;
    const [top, foot] = places ? [onScreen(eye, places.lift), onScreen(eye, places.foot)] : [];
    const flat = top && foot && Math.hypot(top[0] - foot[0], top[1] - foot[1]) < TOO_NEAR_PX;
    /** @type {Record<string, string>} */
    const lines = scene && places ? {
      ring: this.#ring(eye, places.foot, places.around, 2),
      stem: this.#line(eye, [places.foot[0], places.foot[1], places.high[2]], places.lift),
      tilt0: this.tilting ? this.#ring(eye, places.middle, places.ring, 0) : '',
      tilt1: this.tilting ? this.#ring(eye, places.middle, places.ring, 1) : '',
      box: this.#isDrawn(scene) ? '' : this.#boxLines(eye, places),
      snap: this.#snapLines(eye, places),
    } :
                                    {};
    for (const path of paths) path.setAttribute('d', lines[path.dataset.line ?? ''] ?? '');
    for (const button of buttons) {
      const kind = /** @type {Handle} */ (button.dataset.handle);
      const place = places && (this.tilting || !kind.startsWith('tilt')) &&
          !(kind === 'lift' && flat) && onScreen(eye, places[kind]);
      button.hidden = !place;
      if (place) Object.assign(button.style, {left: `${place[0]}px`, top: `${place[1]}px`});
    }
    this.#say(eye, places);
  }

  /** @param {Placed} scene */
  #isDrawn(scene) {
    return this.#view !== null && this.#pairs().some(({now}) => now?.key === scene.key);
  }

  /**
   * @param {Studio.Eye} eye
   * @param {Studio.Box} box
   */
  #boxLines(eye, {low, high}) {
    /** @type {(x: number, y: number, z: number) => Point} */
    const corner = (x, y, z) => [x ? high[0] : low[0], y ? high[1] : low[1], z ? high[2] : low[2]];
    /** @param {number} z */
    const ring = (z) => this.#line(
        eye, corner(0, 0, z), corner(1, 0, z), corner(1, 1, z), corner(0, 1, z), corner(0, 0, z));
    return [
      ring(0), ring(1),
      ...[[0, 0], [1, 0], [1, 1], [0, 1]].map(
          ([x, y]) => this.#line(eye, corner(x, y, 0), corner(x, y, 1)))
    ].join('');
  }

  /**
   * @param {Studio.Eye} eye
   * @param {Places} places
   */
  #snapLines(eye, {foot}) {
    if (this.#drag?.kind !== 'move' || !this.#drag.delta) return '';
    return (Math.abs(foot[0]) < 1e-6 ? this.#line(eye, [0, -1, 0], [0, 1, 0]) : '') +
        (Math.abs(foot[1]) < 1e-6 ? this.#line(eye, [-1, 0, 0], [1, 0, 0]) : '');
  }

  /**
   * The size of the move, shown next to it.
   * @param {Studio.Eye} eye
   * @param {Places | null} places
   */
  #say(eye, places) {
    const tip = part(this.dom, '.tip', HTMLElement);
    const text = this.#drag?.delta && this.told.words(this.#drag.change ?? null);
    tip.hidden = !text || !places;
    if (!text || !places) return;
    tip.textContent = text;
    const place = onScreen(eye, places.lift) ?? [0, 0];
    Object.assign(tip.style, {left: `${place[0]}px`, top: `${place[1] - 34}px`});
  }

  // ---- the pointer ----

  /** @param {PointerEvent} event */
  #place(event) {
    const {left, top} = this.dom.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  /**
   * The nearest model under a place.
   * @param {Studio.Eye} eye
   * @param {Point} place
   */
  #under(eye, place) {
    const {from} = sight(eye, place);
    const hit = this.scenes.map((scene) => ({scene, box: boxOf(scene.matrix, scene.half)}))
                    .filter(({box}) => covers(eye, box, place, REACH_PX));
    return hit.sort(
                  (a, b) => Math.hypot(...a.box.middle.map((v, i) => v - from[i])) -
                      Math.hypot(...b.box.middle.map((v, i) => v - from[i])))[0]
               ?.scene ??
        null;
  }

  /** @param {PointerEvent} event */
  #hover(event) {
    if (this.#pointers.size || event.pointerType === 'touch') return;
    this.dom.style.cursor = this.#under(this.eye(), this.#place(event)) ? 'move' : 'grab';
  }

  /**
   * @param {Drag['kind']} kind
   * @param {Placed | null} scene
   * @param {Point} place
   * @returns {Drag}
   */
  #held(kind, scene, place) {
    const box = scene ? boxOf(scene.matrix, scene.half) : boxOf(IDENTITY, [0, 0, 0]);
    return {kind, scene, box, eye: this.eye(), from: place, last: place, apart: 1};
  }

  /** @param {PointerEvent} event */
  #press(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.button !== 0 || target.closest('.over')) return;
    this.#glide = null;
    this.#pointers.set(event.pointerId, this.#place(event));
    this.dom.setPointerCapture(event.pointerId);
    this.dom.onpointermove = (move) => this.#move(move);
    this.dom.onpointerup = this.dom.onpointercancel = (up) => this.#release(up);
    if (this.#pointers.size > 1) {
      this.#drag = {...this.#held('pinch', null, this.#place(event)), apart: this.#apart()};
      return;
    }
    /** @type {HTMLElement | null} */
    const handle = target.closest('[data-handle]');
    const eye = this.eye();
    const place = this.#place(event);
    if (handle) handle.focus({preventScroll: true});
    const scene =
        handle ? this.scenes.find(({key}) => key === this.selected) : this.#under(eye, place);
    if (scene && scene.key !== this.selected) this.told.select(scene);
    const kind = /** @type {Handle | undefined} */ (handle?.dataset.handle) ?? 'move';
    this.#drag = this.#held(scene ? kind : 'orbit', scene ?? null, place);
    event.preventDefault();
  }

  #apart() {
    const [a, b] = [...this.#pointers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const drag = this.#drag;
    if (!drag || !this.#pointers.has(event.pointerId)) return;
    const place = this.#place(event);
    this.#pointers.set(event.pointerId, place);
    const {kind, last} = drag;
    if (kind === 'pinch') {
      if (this.#pointers.size < 2) return;  // one finger has left
      const apart = this.#apart();
      this.zoom(apart / drag.apart);
      drag.apart = apart;
    } else if (kind === 'orbit') {
      this.orbit(-(place[0] - last[0]) / 160, (place[1] - last[1]) / 160);
    } else {
      this.#set(drag, this.#changeTo(drag, place, event.altKey));
    }
    drag.last = place;
  }

  /** @param {PointerEvent} event */
  #release(event) {
    this.#pointers.delete(event.pointerId);
    if (this.#pointers.size) return;
    this.dom.onpointermove = this.dom.onpointerup = this.dom.onpointercancel = null;
    const drag = this.#drag;
    if (event.type === 'pointercancel' || !drag?.delta) this.#drag = null;
    else this.#commit(drag);
    this.draw();
  }

  /**
   * A dragged model stays in place until the project has it.
   * @param {Drag} drag
   */
  #commit(drag) {
    const {scene, change} = drag;
    const done = scene && change && this.told.change(scene, change);
    Promise.resolve(done).finally(() => {
      if (this.#drag === drag) this.#drag = null;
      this.draw();
    });
  }

  /**
   * The change's matrix moves the scene meanwhile.
   * @param {Drag} drag
   * @param {Studio.Change | null} change
   */
  #set(drag, change) {
    if (!change) return;
    const {box} = drag;
    drag.change = change;
    drag.delta = change.move ?
        translation(change.move) :
        change.turn ?
        about(change.turn[0] === 2 ? box.foot : box.middle, rotation(...change.turn)) :
        about(box.foot, scaling(change.size ?? 1));
    this.draw(true);
  }

  /**
   * @param {Drag} drag
   * @param {Point} place
   * @param {boolean} free it does not snap
   * @returns {Studio.Change | null}
   */
  #changeTo(drag, place, free) {
    const {kind, eye, from, box} = drag;
    const now = sight(eye, place);
    const then = sight(eye, from);
    if (kind === 'move')
      return this.#moveTo(
          drag, meet(then, box.foot, [0, 0, 1]), meet(now, box.foot, [0, 0, 1]), free);
    if (kind === 'lift') {
      const facing = [now.along[0], now.along[1], 0];
      const [a, b] = [meet(then, box.middle, facing), meet(now, box.middle, facing)];
      if (!a || !b) return null;
      const up = b[2] - a[2];
      const rests = Math.abs(box.low[2] + up) < SNAP_PX / this.#pixels(eye, box.foot) && !free;
      return {move: [0, 0, rests ? -box.low[2] : up]};
    }
    if (kind === 'size') {
      const foot = onScreen(eye, box.foot);
      if (!foot) return null;
      const [a, b] = [from, place].map((each) => Math.hypot(each[0] - foot[0], each[1] - foot[1]));
      return {size: Math.max(0.02, b / Math.max(a, 1))};
    }
    const axis = kind === 'turn' ? 2 : Number(kind.slice(-1));
    return this.#turnTo(eye, from, place, axis, axis === 2 ? box.foot : box.middle, free);
  }

  /**
   * Pixels in a unit of the picture's space, there.
   * @param {Studio.Eye} eye
   * @param {Point} point
   */
  #pixels(eye, point) {
    const back = inverse([...eye.view]);
    return eye.focal / Math.hypot(...[12, 13, 14].map((at, i) => back[at] - point[i]));
  }

  /**
   * @param {Drag} drag
   * @param {Point | null} a
   * @param {Point | null} b
   * @param {boolean} free
   */
  #moveTo({box, eye}, a, b, free) {
    if (!a || !b) return null;
    const to = [0, 1].map((axis) => {
      const moved = b[axis] - a[axis];
      const middle =
          Math.abs(box.foot[axis] + moved) * this.#pixels(eye, box.foot) < SNAP_PX && !free;
      return middle ? -box.foot[axis] : moved;
    });
    return {move: [...to, 0]};
  }

  /**
   * @param {Studio.Eye} eye
   * @param {Point} from
   * @param {Point} place
   * @param {number} axis
   * @param {Point} middle
   * @param {boolean} free
   * @returns {Studio.Change}
   */
  #turnTo(eye, from, place, axis, middle, free) {
    const normal = [0, 1, 2].map((each) => (each === axis ? 1 : 0));
    const [a, b] = [from, place].map((each) => meet(sight(eye, each), middle, normal));
    let degrees;
    if (a && b) {
      /** @param {Point} point */
      const angle = (point) => Math.atan2(
          point[(axis + 2) % 3] - middle[(axis + 2) % 3],
          point[(axis + 1) % 3] - middle[(axis + 1) % 3]);
      degrees = wrapped(((angle(b) - angle(a)) * 180) / Math.PI);
    } else degrees = (place[0] - from[0]) / 2;  // the ring is seen from its edge
    const whole = Math.round(degrees / SNAP_DEGREES[0]) * SNAP_DEGREES[0];
    return {turn: [axis, !free && Math.abs(degrees - whole) < SNAP_DEGREES[1] ? whole : degrees]};
  }

  // ---- keys ----

  /** @param {KeyboardEvent} event */
  #key(event) {
    /** @type {HTMLElement | null} */
    const button = /** @type {HTMLElement} */ (event.target).closest('[data-handle]');
    const handle = /** @type {Handle | undefined} */ (button?.dataset.handle);
    const way = WAYS[event.key];
    if (event.key === '+' || event.key === '-') this.zoom(event.key === '+' ? 1.15 : 1 / 1.15);
    if (!way) return;
    event.preventDefault();
    if (!handle) {
      this.orbit(-0.12 * way[0], 0.1 * way[1]);
      return;
    }
    const scene = this.scenes.find(({key}) => key === this.selected);
    if (!scene) return;
    const drag =
        this.#drag?.kind === handle && this.#keyed ? this.#drag : this.#held(handle, scene, [0, 0]);
    this.#drag = drag;
    this.#keyed = handle;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#restKeys(), KEYS_REST_MS);
    this.#set(drag, this.#keyChange(handle, way, event.shiftKey ? 1 : 0, drag.change));
  }

  /**
   * What one more press of an arrow key makes of a change.
   * @param {Handle} handle
   * @param {Point} way
   * @param {number} fast
   * @param {Studio.Change | null | undefined} before
   * @returns {Studio.Change}
   */
  #keyChange(handle, [x, y], fast, before) {
    if (handle === 'move' || handle === 'lift') {
      const step = this.unit ? (fast ? 10 : 1) / this.unit : KEY_STEPS.move[fast];
      const by = handle === 'move' ? [x, y, 0] : [0, 0, x + y];
      return {move: by.map((each, i) => (before?.move?.[i] ?? 0) + step * each)};
    }
    if (handle === 'size') return {size: (before?.size ?? 1) * KEY_STEPS.size[fast] ** (x + y)};
    const axis = handle === 'turn' ? 2 : Number(handle.slice(-1));
    return {turn: [axis, (before?.turn?.[1] ?? 0) + KEY_STEPS.turn[fast] * (x + y)]};
  }

  #restKeys() {
    clearTimeout(this.#timer);
    if (!this.#keyed) return;
    this.#keyed = null;
    if (this.#drag?.change) this.#commit(this.#drag);
  }
}
