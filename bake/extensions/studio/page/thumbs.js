// @ts-check
// Models as small pictures that turn, drawn by the device's renderer from the bundle: what a card
// shows is what ships. Only those that are in view are drawn, one frame at a time, and all sides of
// one only once somebody points at it.
import {viewFrom} from './engine/turntable.js';
import {View} from './engine/modar-view.js';
import {icon} from './parts.js';
import {bundleBytes, state} from './state.js';

const m = window.m;
const SIDE = 160;
const VIEWS = 8;
const TILT = 0.35;
const FIELD = (40 * Math.PI) / 180;
const MARGIN = 1.05;
/** Milliseconds without work after which the bundle leaves the GPU. */
const REST_MS = 4000;

/** @type {Map<string, { baked: number, views: number, url: string }>} the drawing of each model */
const strips = new Map();
/**
 * Models that are in view, or pointed at, and how many views each needs.
 * @type {Map<string, number>}
 */
const wanted = new Map();
let working = false;
/** The bake of which nothing could be drawn. */
let failed = -1;
/**
 * @typedef {object} Room
 * @property {number} baked
 * @property {Promise<import('./engine/modar-view.js').View>} view
 * @property {HTMLCanvasElement} models
 * @property {HTMLElement} box
 * @property {Studio.Scene[]} scenes
 */
/** @type {Room | null} the bundle on the GPU; null: none is */
let room = null;
let restTimer = 0;

const rest = () => new Promise((done) => {
  (window.requestIdleCallback ?? setTimeout)(done);
});

function closeRoom() {
  clearTimeout(restTimer);
  room?.models.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
  room?.box.remove();
  room = null;
}

/** @returns {Room} */
function openRoom() {
  clearTimeout(restTimer);
  const {baked, project} = state;
  if (room?.baked === baked) return room;
  closeRoom();
  const box = document.body.appendChild(
      Object.assign(document.createElement('div'), {className: 'darkroom', ariaHidden: 'true'}));
  const [picture, models] = ['picture', 'models'].map(
      (className) => box.appendChild(Object.assign(document.createElement('canvas'), {className})));
  room = {
    baked,
    box,
    models,
    view: bundleBytes().then((bytes) => View.create(bytes, {picture, models, fixedLight: true})),
    scenes: project.bundle.scenes ?? project.scenes.filter(({model}) => model)
  };
  return room;
}

/**
 * The place of the eye to see all models of a pattern.
 * @param {Studio.Box} box
 */
function eyeOf({low, high}) {
  const target = low.map((value, i) => (value + high[i]) / 2);
  const radius = Math.hypot(...low.map((value, i) => (high[i] - value) / 2));
  return {target, distance: (MARGIN * radius) / Math.sin(FIELD / 2)};
}

/**
 * A model on its first picture, from this many sides; models without a picture are in no bundle.
 * @param {string} model
 * @param {number} views
 */
async function drawStrip(model, views) {
  const {view: opened, scenes, models} = openRoom();
  const view = await opened;
  const number = scenes.findIndex((scene) => scene.model === model);
  const bounds = number < 0 ?
      null :
      view.bounds(view.patterns.findIndex(({name}) => name === scenes[number].pattern));
  const kept = view.patterns.length;
  if (!bounds || !view.stand(model, number)) return '';
  const strip =
      Object.assign(document.createElement('canvas'), {width: views * SIDE, height: SIDE});
  const context = /** @type {CanvasRenderingContext2D} */ (strip.getContext('2d'));
  for (let i = 0; i < views; ++i) {
    if (i) await rest();
    view.drawFrom(
        kept, viewFrom({...eyeOf(bounds), turn: (2 * Math.PI * i) / VIEWS, tilt: TILT}),
        SIDE / 2 / Math.tan(FIELD / 2));
    context.drawImage(models, i * SIDE, 0, SIDE, SIDE);
  }
  view.forgetPatterns(kept);
  /** @type {Blob | null} */
  const drawn = await new Promise((resolve) => {
    strip.toBlob(resolve);
  });
  return drawn ? URL.createObjectURL(drawn) : '';
}

/** A model that is wanted and not drawn in its present form. */
const next = () => [...wanted]
                       .find(([model, views]) => {
                         const known = strips.get(model);
                         return known?.baked !== state.baked || known.views < views;
                       })
                       ?.[0];

async function work() {
  if (working || failed === state.baked || !state.project.bundle.baked) return;
  working = true;
  try {
    for (let model = next(); model !== undefined; model = next()) {
      const [views, {baked}, before] = [wanted.get(model) ?? 1, state, strips.get(model)];
      await rest();
      strips.set(model, {baked, views, url: await drawStrip(model, views)});
      if (before?.url) URL.revokeObjectURL(before.url);
      m.redraw();
    }
  } catch {
    failed = state.baked;  // without WebGL the cards keep their signs, and the scene says why
    closeRoom();
  } finally {
    working = false;
    clearTimeout(restTimer);
    restTimer = setTimeout(closeRoom, REST_MS);
  }
}

/**
 * @param {string} model
 * @param {number} views
 */
function want(model, views) {
  if (views) wanted.set(model, Math.max(views, wanted.get(model) ?? 0));
  else wanted.delete(model);
  if (views) work();
}

const observer = new IntersectionObserver((entries) => {
  for (const {target, isIntersecting} of entries)
    want(/** @type {HTMLElement} */ (target).dataset.model ?? '', isIntersecting ? 1 : 0);
}, {rootMargin: '120px'});

/** @typedef {Studio.Vnode<{ model: string, little?: boolean }>} ThumbVnode */

/** A model's picture, which turns while its card is pointed at. */
export class ModelThumb {
  /** @param {ThumbVnode} vnode */
  oncreate({dom, attrs}) {
    observer.observe(dom);
    const card = dom.closest('a, button') ?? dom;
    const turn = () => want(attrs.model, VIEWS);
    for (const event of ['pointerenter', 'focus']) card.addEventListener(event, turn);
  }

  /** @param {ThumbVnode} vnode */
  onupdate({attrs}) {
    if (wanted.has(attrs.model)) work();
  }

  /** @param {ThumbVnode} vnode */
  onremove({dom, attrs}) {
    observer.unobserve(dom);
    want(attrs.model, 0);
  }

  /** @param {ThumbVnode} vnode */
  view({attrs: {model, little}}) {
    const {url, views} = strips.get(model) ?? {};
    return m(
        `span.thumb${little ? '.little' : ''}${views === VIEWS ? '.turning' : ''}`,
        {'data-model': model}, icon('model'), url && m('img', {src: url, alt: ''}));
  }
}
