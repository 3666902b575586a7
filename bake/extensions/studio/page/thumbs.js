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

/** The drawing of each model: {baked, views, url}. */
const strips = new Map();
/** Models that are in view, or pointed at, and how many views each needs. */
const wanted = new Map();
let working = false;
/** The bake of which nothing could be drawn. */
let failed = -1;
/** The bundle on the GPU: {baked, view, box, scenes}; null: none is. */
let room = null;
let restTimer = 0;

const rest = () => new Promise((done) => {
  (window.requestIdleCallback ?? setTimeout)(done);
});

function closeRoom() {
  clearTimeout(restTimer);
  room?.box.querySelector('.models')
      .getContext('webgl2')
      ?.getExtension('WEBGL_lose_context')
      ?.loseContext();
  room?.box.remove();
  room = null;
}

async function openRoom() {
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
    view: null,
    scenes: project.bundle.scenes ?? project.scenes.filter(({model}) => model)
  };
  room.view = await View.create(await bundleBytes(), {picture, models, fixedLight: true});
  return room;
}

/** The place of the eye to see all models of a pattern. */
function eyeOf({low, high}) {
  const target = low.map((value, i) => (value + high[i]) / 2);
  const radius = Math.hypot(...low.map((value, i) => (high[i] - value) / 2));
  return {target, distance: (MARGIN * radius) / Math.sin(FIELD / 2)};
}

/**
 * A model on its first picture, from this many sides; models without a picture are in no bundle.
 */
async function drawStrip(model, views) {
  const {view, scenes, box} = await openRoom();
  const number = scenes.findIndex((scene) => scene.model === model);
  const bounds = number < 0 ?
      null :
      view.bounds(view.patterns.findIndex(({name}) => name === scenes[number].pattern));
  const kept = view.patterns.length;
  if (!bounds || !view.stand(model, number)) return '';
  const canvas = box.querySelector('.models');
  const strip =
      Object.assign(document.createElement('canvas'), {width: views * SIDE, height: SIDE});
  const context = strip.getContext('2d');
  for (let i = 0; i < views; ++i) {
    if (i) await rest();
    view.drawFrom(
        kept, viewFrom({...eyeOf(bounds), turn: (2 * Math.PI * i) / VIEWS, tilt: TILT}),
        SIDE / 2 / Math.tan(FIELD / 2));
    context.drawImage(canvas, i * SIDE, 0, SIDE, SIDE);
  }
  view.forgetPatterns(kept);
  return URL.createObjectURL(await new Promise((resolve) => {
    strip.toBlob(resolve);
  }));
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
      const [views, {baked}, before] = [wanted.get(model), state, strips.get(model)];
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

function want(model, views) {
  if (views) wanted.set(model, Math.max(views, wanted.get(model) ?? 0));
  else wanted.delete(model);
  if (views) work();
}

const observer = new IntersectionObserver((entries) => {
  for (const {target, isIntersecting} of entries)
    want(target.dataset.model, isIntersecting ? 1 : 0);
}, {rootMargin: '120px'});

/**
 * A model's picture, which turns while its card is pointed at. Attributes: model (its name),
 * little.
 */
export class ModelThumb {
  oncreate({dom, attrs}) {
    observer.observe(dom);
    const card = dom.closest('a, button') ?? dom;
    this.turn = () => want(attrs.model, VIEWS);
    for (const event of ['pointerenter', 'focus']) card.addEventListener(event, this.turn);
  }

  onupdate({attrs}) {
    if (wanted.has(attrs.model)) work();
  }

  onremove({dom, attrs}) {
    observer.unobserve(dom);
    want(attrs.model, 0);
  }

  view({attrs: {model, little}}) {
    const {url, views} = strips.get(model) ?? {};
    return m(
        `span.thumb${little ? '.little' : ''}${views === VIEWS ? '.turning' : ''}`,
        {'data-model': model}, icon('model'), url && m('img', {src: url, alt: ''}));
  }
}
