// The page: a cover with a start button, then the camera with models, label and tools.
import { allowMotion, load, ModarError } from './modar.js';
import { POSE, POSE_FLOATS } from './engine.js';
import { View } from './modar-view.js';
import { forgetInstalled, installedBundles, installedFile } from './installed.js';

const $ = (id) => document.getElementById(id);
const root = document.documentElement;
const SCOPE = new URL('./', location).href;

/** Milliseconds without a sighting before the visitor is told why: shorter ones flicker. */
const PATIENCE_MS = 900;
/** Milliseconds of searching after which "go closer" is the likeliest advice. */
const FAR_MS = 5000;
/** Mean gray value below which a room is called dark. */
const DARK = 35;
const TURN_A_KEY = Math.PI / 18;
const SIZE_A_KEY = 1.1;
const SMALLEST = 0.2;
const LARGEST = 5;

let site;
let words;
let modar = null;
let view = null;
/** {bundle, done}: what is or was loaded, and the promise of it. */
let loading = null;
let stream = null;
let facing = 'environment';
let chosenCamera = '';
let scenePattern = -1;
let unseenSince = 0;
const gesture = { turn: 0, size: 1, mirror: false };

function say(key, values = {}) {
  return words[key].replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '');
}

function setState(state) {
  root.dataset.state = state;
}

// ---- words ----

async function fetchJson(address) {
  const response = await fetch(address);
  if (!response.ok) throw new ModarError({ code: 'web.download', where: address, cause: `the server answered ${response.status}` });
  return response.json();
}

function chooseLanguage(languages) {
  const wanted = new URLSearchParams(location.search).get('lang');
  const liked = [wanted, ...navigator.languages].filter(Boolean).map((tag) => tag.toLowerCase().split('-')[0]);
  return liked.find((tag) => languages.includes(tag)) ?? languages[0];
}

function showWords() {
  for (const element of document.querySelectorAll('[data-word]')) element.textContent = say(element.dataset.word);
  for (const element of document.querySelectorAll('[data-label]')) {
    element.setAttribute('aria-label', say(element.dataset.label));
    if (element.localName === 'button') element.title = say(element.dataset.label);
  }
  $('models').setAttribute('aria-label', say('nothingSeen'));
  $('photo-image').alt = say('photoAlt');
}

/** What the site says of a pattern in this language, else in its first, else in any: {name, text}; else its own name. */
function labelOf(bundle, pattern) {
  const texts = bundle.patterns[pattern].texts ?? {};
  return texts[root.lang] ?? texts[site.languages[0]] ?? Object.values(texts)[0]
    ?? { name: bundle.patterns[pattern].title, text: '' };
}

// ---- the cover ----

function currentBundle() {
  return site.bundles[Number($('bundle').value) || 0];
}

function showPlates() {
  const { patterns, installed } = currentBundle();
  const plate = ({ image, width, height, title }, described) => {
    const picture = document.createElement('img');
    Object.assign(picture, { width, height, alt: described ? title : '', decoding: 'async' });
    if (!installed) picture.src = image;
    else installedFile(SCOPE, image).then((blob) => { if (blob) picture.src = URL.createObjectURL(blob); });
    return picture;
  };
  $('plates').replaceChildren(...patterns.map((pattern) => plate(pattern, true)));
  $('hint-plates').replaceChildren(...patterns.slice(0, 4).map((pattern) => plate(pattern, false)));
  for (const id of ['plates', 'hint-plates']) $(id).classList.toggle('many', patterns.length > 1);
  $('plates').tabIndex = patterns.length > 1 ? 0 : -1;  // they scroll
  $('caption').textContent = patterns.length === 1 ? labelOf(currentBundle(), 0).name : '';
  $('lead').textContent = say(patterns.length > 1 ? 'leadMany' : 'lead');
}

/** The site's own bundles, or those of a later release that a visit before has brought. */
async function chooseBundles() {
  const installed = site.release && await installedBundles(SCOPE, site.release).catch(() => undefined);
  site.own ??= site.bundles;
  site.bundles = installed ?? site.own;
  $('bundle').replaceChildren(...site.bundles.map(({ title }, i) => new Option(title, i)));
  $('choice').hidden = site.bundles.length < 2;
}

/** What a release folder has of newer bundles is brought meanwhile; the next visit shows it. */
function update() {
  if (!site.release || !navigator.onLine || !('caches' in globalThis)) return;
  const worker = new Worker('update-worker.js', { type: 'module' });
  const end = ({ state, code = '', text = '' }) => {
    worker.terminate();
    root.dataset.update = `${state} ${code}`.trim();
    if (text) console.info(`No update: ${text} [${code}]`);
  };
  worker.onmessage = ({ data }) => end(data);
  worker.onerror = (event) => {
    event.preventDefault();
    end({ state: 'failed' });
  };
  worker.postMessage({ scope: SCOPE, ...site.release, url: new URL(site.release.url, location).href, hashes: site.own.map(({ hash }) => hash) });
}

async function prepare() {
  site = await fetchJson('site.json');
  root.lang = chooseLanguage(site.languages);
  words = await fetchJson(`words/${root.lang}.json`);
  document.title = site.title;
  $('title').textContent = site.title;
  await chooseBundles();
  showWords();
  showPlates();
  if (!navigator.connection?.saveData) loadBundle().catch(() => {});  // the start button tells what is wrong
  update();
}

// ---- errors ----

const BY_NAME = {
  NotAllowedError: 'refused', SecurityError: 'refused', NotFoundError: 'none', OverconstrainedError: 'none',
  NotReadableError: 'busy', AbortError: 'busy',
};
const BY_CODE = {
  'web.webgl': 'webgl', 'web.wasm': 'old', 'web.download': 'network', 'web.memory': 'memory',
  'web.insecure': 'insecure', 'web.old': 'old', 'web.ended': 'ended', 'web.worker': 'other',
};

function kindOf(error) {
  if (!(error instanceof ModarError)) return BY_NAME[error?.name] ?? 'other';
  return BY_CODE[error.code] ?? (error.code.startsWith('gl.') ? 'webgl' : 'bundle');
}

function tell(error) {
  stop();
  const kind = kindOf(error);
  const [title, cure] = words?.errors[kind] ?? ['The page could not be loaded', 'Check the network and load it again.'];
  $('problem-title').textContent = title;
  $('problem-cure').textContent = cure;
  $('problem-detail').textContent = ['refused', 'none', 'insecure'].includes(kind) ? '' : String(error?.message ?? error);
  setState('error');
  root.dataset.error = kind;
  if (!$('problem').open) $('problem').showModal();
}

// ---- the camera ----

function cameraKey(track) {
  const { deviceId = '' } = track.getSettings();
  return `modar-focal:${deviceId || track.label}`;
}

function rememberedFocal(track) {
  try {
    const [focal, focalSide] = JSON.parse(localStorage.getItem(cameraKey(track)) ?? '[0, 0]');
    return { focal, focalSide };
  } catch {
    return { focal: 0, focalSide: 0 };  // storage that is switched off costs a measurement, no more
  }
}

function rememberFocal({ foundFocal, camera }) {
  try {
    const [track] = stream.getVideoTracks();
    localStorage.setItem(cameraKey(track), JSON.stringify([foundFocal, Math.max(camera.width, camera.height)]));
  } catch { /* as above */ }
}

/** Asks for the camera and shows it. */
async function openStream() {
  if (!globalThis.isSecureContext) throw new ModarError({ code: 'web.insecure', cause: 'the page came by http' });
  if (!navigator.mediaDevices?.getUserMedia) throw new ModarError({ code: 'web.old', cause: 'this browser opens no camera' });
  const video = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
  if (chosenCamera) video.deviceId = { exact: chosenCamera };
  else video.facingMode = { ideal: facing };
  stream = await navigator.mediaDevices.getUserMedia({ video, audio: false });
  const [track] = stream.getVideoTracks();
  track.addEventListener('ended', () => tell(new ModarError({ code: 'web.ended', cause: 'the camera ended' })));
  const settings = track.getSettings();
  facing = settings.facingMode ?? facing;
  gesture.mirror = settings.facingMode === 'user';
  $('video').srcObject = stream;
  await $('video').play();
  performance.mark('camera');
}

/** Tracks in what the camera brings, with the tools that it has. */
async function follow() {
  const [track] = stream.getVideoTracks();
  await modar.start($('video'), { ...rememberedFocal(track), extended: true });
  const devices = (await navigator.mediaDevices.enumerateDevices()).filter(({ kind }) => kind === 'videoinput');
  $('flip').hidden = devices.length < 2;
  $('torch').hidden = !track.getCapabilities?.().torch;
  $('torch').setAttribute('aria-pressed', 'false');
  $('full').hidden = !document.fullscreenEnabled;
}

function closeCamera() {
  modar?.stop();
  for (const track of stream?.getTracks() ?? []) track.stop();
  stream = null;
  $('video').srcObject = null;
}

async function reopenCamera() {
  closeCamera();
  try {
    await openStream();
    await follow();
  } catch (error) {
    tell(error);
  }
}

// ---- start and stop ----

async function openBundle(bundle) {
  let bytes = bundle.file;
  if (bundle.installed) bytes = await (await installedFile(SCOPE, bundle.file))?.arrayBuffer() ?? new ArrayBuffer(0);
  const opening = load(bytes, {
    onProgress: (got, total) => { $('progress').textContent = say('loading', { percent: Math.floor((100 * got) / total) }); },
  });
  const creating = View.create(opening.then((opened) => opened.bytes), { picture: $('picture'), models: freshCanvas() });
  creating.catch(() => {});  // told below, after what ails the bundle
  const opened = await opening;
  $('progress').textContent = say('preparing');
  try {
    view = await creating;
  } catch (error) {
    opened.close();
    throw error;
  }
  modar = opened;
  modar.bytes = null;  // the engines have their own copies
  modar.addEventListener('frame', ({ detail }) => onFrame(detail));
  modar.addEventListener('dropped', ({ detail }) => { if (stream) view.show(detail.source, gesture); });
  modar.addEventListener('error', ({ detail }) => tell(detail));
}

/** The chosen bundle, once: begun before the visitor starts, and waited for then. */
function loadBundle() {
  const bundle = currentBundle();
  if (loading?.bundle === bundle) return loading.done;
  const before = loading?.done.catch(() => {});
  const done = Promise.resolve(before).then(async () => {
    modar?.close();
    modar = view = null;
    try {
      await openBundle(bundle);
    } catch (error) {
      const newest = loading?.done === done;
      if (newest) loading = null;  // the next start tries again
      const ofBrowser = error.code === 'web.webgl' || error.code?.startsWith('gl.');
      if (!bundle.installed || ofBrowser) throw error;
      // What was installed has rotted: the site's own bundles stand in.
      await forgetInstalled(SCOPE);
      await chooseBundles();
      showPlates();
      if (newest) await loadBundle();
    }
  }).finally(() => { $('progress').textContent = ''; });
  loading = { bundle, done };
  return done;
}

/** A canvas keeps its first context: another bundle's renderer gets a new one. */
function freshCanvas() {
  if (!$('models').dataset.used) {
    $('models').dataset.used = 'yes';
    return $('models');
  }
  const canvas = $('models').cloneNode(false);
  $('models').replaceWith(canvas);
  listenToGestures(canvas);
  return canvas;
}

async function start() {
  $('start').disabled = true;
  try {
    const loaded = loadBundle();
    loaded.catch(() => {});  // told below, after the camera's own troubles
    await allowMotion();  // first: iOS asks for it within the click only
    await openStream();
    await loaded;
    await follow();
    $('cover').hidden = true;
    $('stage').hidden = false;
    unseenSince = performance.now();
    scenePattern = -1;
    $('reason').textContent = lookWords();
    setState('looking');
    $('models').focus({ preventScroll: true });
  } catch (error) {
    tell(error);
  } finally {
    $('start').disabled = false;
  }
}

function stop() {
  closeCamera();
  if (document.fullscreenElement) document.exitFullscreen();
  $('stage').hidden = true;
  $('cover').hidden = false;
  $('label').hidden = true;
  setState('start');
}

// ---- frames ----

function lookWords() {
  return say(currentBundle().patterns.length > 1 ? 'lookMany' : 'look');
}

function adviceFor({ reason, brightness }, unseenMs) {
  if (brightness < DARK) return say('dark');
  if (unseenMs < PATIENCE_MS) return $('reason').textContent;
  if (reason === 'lost by blur') return say('blurred');
  if (reason === 'out of view') return say('outside');
  if (reason === 'failed verification') return say('hold');
  return unseenMs > FAR_MS ? `${lookWords()} ${say('far')}` : lookWords();
}

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;  // else readers repeat it for each frame
}

function showLabel(pattern) {
  if (pattern === scenePattern) return;
  scenePattern = pattern;
  if (pattern < 0) {
    $('models').setAttribute('aria-label', say('nothingSeen'));
    $('label').hidden = true;
    return;
  }
  const { name, text } = labelOf(currentBundle(), pattern);
  $('label-name').textContent = name;
  $('label-text').textContent = text;
  $('label').hidden = false;
  const models = modar.scenes.filter((scene) => scene.pattern === pattern).map(({ model }) => model);
  $('models').setAttribute('aria-label', say('seen', { name: models.join(', '), pattern: currentBundle().patterns[pattern].title }));
}

function onFrame(frame) {
  if (!stream) return;
  if (root.dataset.state === 'looking' && frame.reason === 'visible') performance.mark('tracked');
  try {
    view.draw(frame, gesture);
  } catch (error) {
    tell(error);
    return;
  }
  if (frame.foundFocal) rememberFocal(frame);
  const now = performance.now();
  let first = -1;
  for (let p = modar.patterns.length - 1; p >= 0; --p) {
    if (frame.poses[p * POSE_FLOATS + POSE.shown] !== 0) first = p;
  }
  if (first >= 0) {
    if (root.dataset.state !== 'seen') performance.mark('seen');
    unseenSince = now;
    setState('seen');
    showLabel(first);
  } else {
    setState('looking');
    setText($('reason'), adviceFor(frame, now - unseenSince));
    if (now - unseenSince > PATIENCE_MS) showLabel(-1);
  }
}

// ---- gestures ----

function listenToGestures(canvas) {
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener('pointermove', (event) => {
    const finger = fingers.get(event.pointerId);
    if (!finger) return;
    const before = fingers.size === 2 ? spread() : 0;
    // Across the whole canvas: one turn.
    if (fingers.size === 1) gesture.turn += ((event.clientX - finger.x) / canvas.clientWidth) * 2 * Math.PI;
    finger.x = event.clientX;
    finger.y = event.clientY;
    if (before > 0) resize(spread() / before);
  });
  for (const type of ['pointerup', 'pointercancel']) {
    canvas.addEventListener(type, ({ pointerId }) => fingers.delete(pointerId));
  }
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    resize(Math.exp(-event.deltaY / 500));
  }, { passive: false });
}

function resize(factor) {
  gesture.size = Math.min(LARGEST, Math.max(SMALLEST, gesture.size * factor));
}

const KEYS = {
  ArrowLeft: () => { gesture.turn -= TURN_A_KEY; },
  ArrowRight: () => { gesture.turn += TURN_A_KEY; },
  ArrowUp: () => resize(SIZE_A_KEY),
  ArrowDown: () => resize(1 / SIZE_A_KEY),
  '+': () => resize(SIZE_A_KEY),
  '-': () => resize(1 / SIZE_A_KEY),
  0: () => Object.assign(gesture, { turn: 0, size: 1 }),
  Escape: () => stop(),
};

// ---- tools ----

async function shoot() {
  const blob = await view.photograph();
  const file = new File([blob], 'modar.jpg', { type: 'image/jpeg' });
  URL.revokeObjectURL($('photo-image').src);
  $('photo-image').src = URL.createObjectURL(blob);
  Object.assign($('save'), { href: $('photo-image').src, download: file.name });
  $('share').hidden = !navigator.canShare?.({ files: [file] });
  $('share').onclick = () => navigator.share({ files: [file], title: site.title }).catch(() => {});  // closing it is no error
  $('photo').showModal();
}

async function flip() {
  facing = facing === 'user' ? 'environment' : 'user';
  chosenCamera = '';
  await reopenCamera();
}

async function toggleTorch() {
  const lit = $('torch').getAttribute('aria-pressed') !== 'true';
  await stream.getVideoTracks()[0].applyConstraints({ advanced: [{ torch: lit }] });
  $('torch').setAttribute('aria-pressed', String(lit));
}

async function showCameras() {
  const devices = (await navigator.mediaDevices.enumerateDevices()).filter(({ kind }) => kind === 'videoinput');
  const current = stream.getVideoTracks()[0].getSettings().deviceId;
  $('choose-list').replaceChildren(...devices.map((device, i) => {
    const label = document.createElement('label');
    const input = Object.assign(document.createElement('input'), { type: 'radio', name: 'camera', checked: device.deviceId === current });
    input.addEventListener('change', () => {
      chosenCamera = device.deviceId;
      $('choose').close();
      reopenCamera();
    });
    label.append(input, device.label || say('camera', { number: i + 1 }));
    return label;
  }));
  $('choose').showModal();
}

function listen() {
  $('start').addEventListener('click', start);
  $('bundle').addEventListener('change', () => {
    showPlates();
    loadBundle().catch(() => {});
  });
  $('close').addEventListener('click', stop);
  $('flip').addEventListener('click', flip);
  $('shoot').addEventListener('click', shoot);
  $('torch').addEventListener('click', toggleTorch);
  $('cameras').addEventListener('click', showCameras);
  $('full').addEventListener('click', () => (document.fullscreenElement ? document.exitFullscreen() : $('stage').requestFullscreen()));
  $('photo-close').addEventListener('click', () => $('photo').close());
  $('choose-close').addEventListener('click', () => $('choose').close());
  $('problem-close').addEventListener('click', () => $('problem').close());
  $('again').addEventListener('click', () => {
    $('problem').close();
    if (words) start();
    else location.reload();
  });
  $('problem').addEventListener('close', () => { setState('start'); delete root.dataset.error; });
  listenToGestures($('models'));
  $('stage').addEventListener('keydown', (event) => {
    if (event.target.localName === 'button' && event.key !== 'Escape') return;
    if (event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  // A page that nobody looks at has no business with the camera.
  document.addEventListener('visibilitychange', () => {
    if ($('stage').hidden) return;
    if (document.hidden) closeCamera();
    else reopenCamera();
  });
}

/** Keeps the page for visits without a network, once it has what it needs now. */
function keep() {
  if (!('serviceWorker' in navigator) || !globalThis.isSecureContext) return;
  navigator.serviceWorker.register('sw.js').catch(() => {});  // the page works without it, but not offline
}

listen();
prepare().catch(tell).then(() => loading?.done.catch(() => {})).then(keep);
