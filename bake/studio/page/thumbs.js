// Models as small pictures that turn, drawn by the device's renderer from the bundle: what a card shows is what ships.
import { viewFrom } from './engine/turntable.js';
import { View } from './engine/modar-view.js';
import { bundleBytes, state } from './state.js';

const m = window.m;
const SIDE = 160;
const VIEWS = 8;
const TILT = 0.35;
const FIELD = (40 * Math.PI) / 180;
const MARGIN = 1.05;

/** Addresses of strips of VIEWS pictures, by model. */
const strips = new Map();
let drawn = -1;
let drawing = false;

/** The strip of a model; undefined until it has been drawn. Models that stand on nothing are in no bundle. */
export function modelViews(name) {
  if (drawn !== state.baked && !drawing && state.project.bundle.baked) drawAll();
  return strips.get(name);
}

/** Where the eye stands to see all that stands on a pattern. */
function eyeOf({ low, high }) {
  const target = low.map((value, i) => (value + high[i]) / 2);
  const radius = Math.hypot(...low.map((value, i) => (high[i] - value) / 2));
  return { target, distance: (MARGIN * radius) / Math.sin(FIELD / 2) };
}

async function drawStrip(view, pattern, bounds, canvas) {
  const strip = Object.assign(document.createElement('canvas'), { width: VIEWS * SIDE, height: SIDE });
  const context = strip.getContext('2d');
  for (let i = 0; i < VIEWS; ++i) {
    view.drawFrom(pattern, viewFrom({ ...eyeOf(bounds), turn: (2 * Math.PI * i) / VIEWS, tilt: TILT }), SIDE / 2 / Math.tan(FIELD / 2));
    context.drawImage(canvas, i * SIDE, 0, SIDE, SIDE);
  }
  return URL.createObjectURL(await new Promise((resolve) => { strip.toBlob(resolve); }));
}

/** One model after the other, each on the first picture that it stands on. The page may do other things between them. */
async function drawAll() {
  drawing = true;
  const { baked, project } = state;
  const box = document.body.appendChild(Object.assign(document.createElement('div'), { className: 'darkroom', ariaHidden: 'true' }));
  const [picture, models] = [0, 1].map(() => box.appendChild(document.createElement('canvas')));
  try {
    const view = await View.create(await bundleBytes(), { picture, models, fixedLight: true });
    const kept = view.patterns.length;
    const scenes = project.bundle.scenes ?? project.scenes.filter(({ model }) => model);
    for (const [number, { model, pattern }] of scenes.entries()) {
      if (scenes.findIndex((scene) => scene.model === model) !== number) continue;
      const bounds = view.bounds(view.patterns.findIndex(({ name }) => name === pattern));
      view.forgetPatterns(kept);
      if (!bounds || !view.stand(model, number)) continue;
      const before = strips.get(model);
      strips.set(model, await drawStrip(view, kept, bounds, models));
      if (before) URL.revokeObjectURL(before);
      m.redraw();
    }
    models.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
  } catch {
    // Without WebGL the cards keep their signs, and the scene says why.
  } finally {
    box.remove();
    drawing = false;
    drawn = baked;
  }
}
