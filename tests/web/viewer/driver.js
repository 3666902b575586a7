// Does what a visitor does, and reports what the page then shows: facts, which viewer_test.py judges.
const viewer = document.querySelector('modar-viewer');
const part = (id) => viewer.shadowRoot.getElementById(id);
const facts = { events: [], errors: [] };
addEventListener('error', ({ message }) => facts.errors.push(message));
addEventListener('unhandledrejection', ({ reason }) => facts.errors.push(String(reason)));
for (const type of ['load', 'found', 'lost', 'error']) viewer.addEventListener(type, () => facts.events.push(type));
viewer.addEventListener('statechange', () => facts.events.push(viewer.state));
let found = null, detection = null, lost = null, failure = null;
viewer.addEventListener('found', ({ detail }) => { found = detail; });
viewer.addEventListener('updated', ({ detail }) => { detection = detail; });
viewer.addEventListener('lost', ({ detail }) => { lost = detail; });
viewer.addEventListener('error', (event) => { failure = { name: event.error.name, message: event.message }; });

async function until(condition, what) {
  const began = performance.now();
  while (!condition()) {
    if (performance.now() - began > 60000) throw new Error(`${what} did not happen; state ${viewer.state}, ${JSON.stringify(facts.events.slice(-5))}, ${part('problem-detail').textContent}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

function read(source, width = source.width, height = source.height) {
  const context = Object.assign(document.createElement('canvas'), { width, height }).getContext('2d');
  context.drawImage(source, 0, 0, width, height);
  return context.getImageData(0, 0, width, height);
}

/** Where models are drawn: how many pixels, and their middle; and how much the layer below differs from gray. */
function look() {
  const [picture, models] = viewer.layers;
  const { data, width, height } = read(models);
  let [lit, x, y] = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] < 128) continue;
    lit += 1;
    x += (i / 4) % width;
    y += Math.floor(i / 4 / width);
  }
  return { lit, x: x / lit, y: y / lit, width, height, colour: colourOf(read(picture, 64, 48)) };
}

/** Mean distance of the pixels' channels from each other. */
function colourOf({ data }) {
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum += Math.max(data[i], data[i + 1], data[i + 2]) - Math.min(data[i], data[i + 1], data[i + 2]);
  return sum / (data.length / 4);
}

/** After the next frame that shows models. */
const seen = () => new Promise((resolve) => {
  viewer.addEventListener('frame', function once() {
    if (viewer.state !== 'seen') return;
    viewer.removeEventListener('frame', once);
    resolve({ ...look(), detection });
  });
});

const key = (name) => part('models').dispatchEvent(new KeyboardEvent('keydown', { key: name, bubbles: true, cancelable: true, composed: true }));
const box = (element) => { const { left, top, width, height } = element.getBoundingClientRect(); return [left, top, width, height]; };

async function accessible(name) {
  if (!globalThis.axe) return;
  const { violations } = await axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'] });
  (facts.axe ??= {})[name] = violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(' | ')}`);
}

async function visit() {
  const frame = new Image();
  frame.src = 'frame.png';
  await frame.decode();
  await until(() => part('start').textContent, 'words');
  await until(() => part('poster').complete, 'the poster');
  facts.cover = { start: part('start').textContent, poster: part('poster').naturalWidth, alt: part('poster').alt, size: box(viewer), loaded: viewer.modar !== null,
    font: getComputedStyle(part('start')).fontSize, opacity: getComputedStyle(part('start')).opacity };
  await accessible('cover');

  part('start').click();
  await until(() => viewer.state === 'looking', 'the camera');
  await new Promise((resolve) => setTimeout(resolve, 1200));
  facts.looking = { hint: part('reason').textContent, plates: part('plates').children.length, name: part('models').getAttribute('aria-label'), stage: box(part('stage')) };
  await accessible('looking');
  camera.shows = frame;
  facts.seen = await seen();
  facts.label = { name: part('label-name').textContent, text: part('label-text').textContent, lang: part('label').lang, aria: part('models').getAttribute('aria-label') };
  facts.found = { name: found.name, view: found.view.length };
  facts.photo = (await viewer.photograph()).type;
  await until(() => getComputedStyle(part('models')).opacity === '1', 'models that are opaque');
  await accessible('seen');
  part('larger').click();
  await seen();
  facts.larger = await seen();
  camera.shows = null;
  await until(() => lost, 'the loss');
  await until(() => part('label').hidden, 'no label');
  facts.lost = { name: lost.name, reason: lost.reason };
  key('Escape');
  facts.stopped = { state: viewer.state, tracks: camera.opened.map(({ readyState }) => readyState), open: part('stage').open };

  part('look').click();
  await until(() => viewer.state === 'around' && part('ground').naturalWidth > 0, 'the turntable');
  key('0');
  facts.around = look();
  facts.ground = { width: part('ground').naturalWidth, colour: colourOf(read(part('ground'), 40, 80)) };
  for (const name of ['ArrowLeft', 'ArrowUp', 'PageUp']) {
    key(name);
    (facts.keys ??= {})[name] = look();
    key('0');
  }
  await accessible('around');
  part('close').click();

  camera.refuses = 'NotAllowedError';
  await viewer.start();
  facts.refused = { failure, state: viewer.state, title: part('problem-title').textContent, open: part('problem').open };
  await accessible('problem');
  part('problem-close').click();
  camera.refuses = '';
  await viewer.start();
  const place = viewer.parentElement;
  viewer.remove();
  place.append(viewer);
  const [late, rest] = [viewer.start(), viewer.load()];
  viewer.remove();
  await Promise.all([late, rest]);
  facts.removed = { tracks: camera.opened.map(({ readyState }) => readyState), state: viewer.state, loaded: viewer.modar !== null };
}

visit().catch((error) => facts.errors.push(error.stack)).then(() => fetch('facts', { method: 'POST', body: JSON.stringify(facts) }));
