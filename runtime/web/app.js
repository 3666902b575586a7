// The page: a cover with a start button, then the camera with models, label and tools.
import { Camera, hostApp, ownBrowser } from './camera.js';
import { allowMotion, load, ModarError } from './modar.js';
import { POSE, POSE_FLOATS } from './engine.js';
import { View } from './modar-view.js';
import { forgetInstalled, installedBundles, installedFile } from './installed.js';
import { canRecord, Recorder } from './recorder.js';
import { forgetStored, store, stored } from './storage.js';
import { Turntable } from './turntable.js';

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
const KEPT_LANGUAGE = 'modar-language';
/** Written from right to left. */
const FROM_RIGHT = ['ar', 'dv', 'fa', 'he', 'ku', 'ps', 'sd', 'ug', 'ur', 'yi'];
const directionOf = (language) => (FROM_RIGHT.includes(language.split('-')[0]) ? 'rtl' : 'ltr');

let site;
let words;
let modar = null;
let view = null;
/** {bundle, done}: what is or was loaded, and the promise of it. */
let loading = null;
const camera = new Camera();
let scenePattern = -1;
let unseenSince = 0;
const gesture = { turn: 0, size: 1, mirror: false };
/** While models are looked at without a camera. */
let table = null;
let recorder = null;
/** Until what is kept on the device is whole; and whether the visitor has deleted it since the page was opened. */
let keeping = null;
let forgotten = false;

const fill = (text, values) => text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '');

function say(key, values = {}) {
  return fill(words[key], values);
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
  const liked = [wanted, stored(KEPT_LANGUAGE), ...navigator.languages].filter(Boolean).map((tag) => tag.toLowerCase().split('-')[0]);
  return liked.find((tag) => languages.includes(tag)) ?? languages[0];
}

function showWords() {
  for (const element of document.querySelectorAll('[data-word]')) element.textContent = say(element.dataset.word);
  for (const element of document.querySelectorAll('[data-label]')) {
    element.setAttribute('aria-label', say(element.dataset.label));
    if (['a', 'button'].includes(element.localName)) element.title = say(element.dataset.label);
  }
  $('models').setAttribute('aria-label', say('nothingSeen'));
  $('models').setAttribute('aria-roledescription', say('scene'));
  $('photo-image').alt = say('photoAlt');
}

async function useLanguage(language) {
  words = await fetchJson(`words/${language}.json`);
  root.lang = language;
  root.dir = directionOf(language);
  showWords();
  showPlates();
}

function showLanguages() {
  const nameOf = (language) => {
    const name = new Intl.DisplayNames([language], { type: 'language' }).of(language);
    return name.charAt(0).toLocaleUpperCase(language) + name.slice(1);
  };
  $('language').replaceChildren(...site.languages.map((language) => {
    const option = new Option(nameOf(language), language, false, language === root.lang);
    option.lang = language;
    return option;
  }));
  $('tongue').hidden = site.languages.length < 2;
}

function showLinks() {
  $('links').replaceChildren(...(site.links ?? []).map(({ text, url }) =>
    Object.assign(document.createElement('a'), { textContent: text, href: url, rel: 'noopener' })));
}

/** What the site says of a pattern in this language, else in its first, else in any: {language, name, text, alt}. */
function labelOf(bundle, pattern) {
  const texts = bundle.patterns[pattern].texts ?? {};
  const language = [root.lang, site.languages[0], ...Object.keys(texts)].find((each) => texts[each]);
  return { language: language ?? '', name: bundle.patterns[pattern].title, text: '', alt: '', ...texts[language] };
}

// ---- the cover ----

function currentBundle() {
  return site.bundles[Number($('bundle').value) || 0];
}

/** Where a hint's picture is: in the site's folder, or in what an update has brought. */
async function addressOf(image) {
  if (!currentBundle().installed) return image;
  const blob = await installedFile(SCOPE, image);
  return blob ? URL.createObjectURL(blob) : '';
}

function showPlates() {
  const { patterns } = currentBundle();
  const plate = ({ image, width, height, title }, described) => {
    const picture = document.createElement('img');
    Object.assign(picture, { width, height, alt: described ? title : '', decoding: 'async' });
    addressOf(image).then((address) => { picture.src = address; });
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
  document.title = site.title;
  $('title').textContent = site.title;
  await chooseBundles();
  await useLanguage(chooseLanguage(site.languages));
  showLanguages();
  showLinks();
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

/** What the browser of another app may lack, and the phone's own has. */
const OF_HOSTS = ['refused', 'none', 'busy', 'old'];

function kindOf(error) {
  const byCode = ({ code }) => BY_CODE[code] ?? (code.startsWith('gl.') ? 'webgl' : 'bundle');
  const kind = error instanceof ModarError ? byCode(error) : BY_NAME[error?.name] ?? 'other';
  return hostApp() && OF_HOSTS.includes(kind) ? 'host' : kind;
}

function tell(error) {
  stop();
  const kind = kindOf(error);
  const [title, cure] = words?.errors[kind] ?? ['The page could not be loaded', 'Check the network and load it again.'];
  const host = { app: hostApp(), browser: ownBrowser() };
  $('problem-title').textContent = fill(title, host);
  $('problem-cure').textContent = fill(cure, host);
  const plain = ['refused', 'none', 'insecure'].includes(kind);
  $('problem-detail').textContent = kind === 'host' ? location.href : plain ? '' : String(error?.message ?? error);
  $('copy').hidden = kind !== 'host';
  $('again').hidden = kind === 'host';
  // Models can be looked at wherever they can be drawn.
  $('look-instead').hidden = !words || ['webgl', 'network', 'bundle', 'memory', 'other'].includes(kind);
  setState('error');
  root.dataset.error = kind;
  if (!$('problem').open) $('problem').showModal();
}

/** For another browser. Where the clipboard is closed, the address is selected, to be copied by hand. */
async function copyAddress() {
  try {
    await navigator.clipboard.writeText(location.href);
    $('copy').textContent = say('copied');
  } catch {
    getSelection().selectAllChildren($('problem-detail'));
  }
}

// ---- the camera ----

async function openCamera() {
  await camera.open($('video'), () => tell(new ModarError({ code: 'web.ended', cause: 'the camera ended' })));
  gesture.mirror = camera.mirrored;
  performance.mark('camera');
}

/** Tracks in what the camera brings, with the tools that it has. */
async function follow() {
  await modar.start($('video'), { ...camera.focal, extended: true });
  $('flip').hidden = (await camera.list()).length < 2;
  $('torch').hidden = !camera.track.getCapabilities?.().torch;
  $('torch').setAttribute('aria-pressed', 'false');
  $('record').hidden = !canRecord();
}

function closeCamera() {
  recorder?.stop();
  modar?.stop();
  camera.close();
  $('video').srcObject = null;
}

async function reopenCamera() {
  closeCamera();
  try {
    await openCamera();
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
  modar.addEventListener('dropped', ({ detail }) => { if (camera.stream) view.show(detail.source, gesture); });
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
    await openCamera();
    await loaded;
    await follow();
    unseenSince = performance.now();
    $('reason').textContent = lookWords();
    enter('looking');
  } catch (error) {
    tell(error);
  } finally {
    $('start').disabled = false;
  }
}

/** Shows the stage instead of the cover. */
function enter(state) {
  $('cover').hidden = true;
  $('stage').hidden = false;
  scenePattern = -1;
  $('full').hidden = !document.fullscreenEnabled;
  setState(state);
  $('models').focus({ preventScroll: true });
}

// ---- a look without a camera ----

async function lookAround() {
  $('look').disabled = true;
  try {
    await loadBundle();
    const { patterns } = currentBundle();
    $('scene').replaceChildren(...patterns.map((_, i) => new Option(labelOf(currentBundle(), i).name, i)));
    $('which').hidden = patterns.length < 2;
    enter('around');
    table = new Turntable(view, $('ground'));
    await showScene(0);
  } catch (error) {
    tell(error);
  } finally {
    $('look').disabled = false;
  }
}

async function showScene(pattern) {
  const picture = currentBundle().patterns[pattern];
  Object.assign($('ground'), { width: picture.width, height: picture.height, src: await addressOf(picture.image) });
  table.show(pattern, picture);
  showLabel(pattern);
  showRoom(picture);
}

/** Links to the viewer that a phone has for its visitor's room: Quick Look or Scene Viewer. */
function showRoom({ usdz, glb }) {
  const room = $('room');
  if (usdz && room.relList.supports('ar')) room.href = usdz;
  else if (glb && navigator.userAgent.includes('Android')) room.href = sceneViewer(new URL(glb, location.href));
  else room.removeAttribute('href');
  room.hidden = !room.hasAttribute('href');
}

const sceneViewer = (file) =>
  `intent://arvr.google.com/scene-viewer/1.0?mode=ar_preferred&file=${encodeURIComponent(file.href)}`
  + '#Intent;scheme=https;package=com.google.android.googlequicksearchbox;action=android.intent.action.VIEW;'
  + `S.browser_fallback_url=${encodeURIComponent(location.href)};end;`;

function stop() {
  closeCamera();
  table?.close();
  table = null;
  $('which').hidden = true;
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
  const { language, name, text, alt } = labelOf(currentBundle(), pattern);
  $('label-name').textContent = name;
  $('label-text').textContent = text;
  Object.assign($('label'), { hidden: false, lang: language, dir: language ? directionOf(language) : '' });
  const models = modar.scenes.filter((scene) => scene.pattern === pattern).map(({ model }) => model);
  $('models').setAttribute('aria-label', say('seen', { name: alt || models.join(', '), pattern: name }));
}

function onFrame(frame) {
  if (!camera.stream) return;
  if (root.dataset.state === 'looking' && frame.reason === 'visible') performance.mark('tracked');
  try {
    view.draw(frame, gesture);
  } catch (error) {
    tell(error);
    return;
  }
  camera.copied(frame.copyMs);
  recorder?.add();
  if (frame.foundFocal) camera.keepFocal(frame.foundFocal, Math.max(frame.camera.width, frame.camera.height));
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
    if (fingers.size === 1) {
      turn(((event.clientX - finger.x) / canvas.clientWidth) * 2 * Math.PI);
      tilt(((event.clientY - finger.y) / canvas.clientHeight) * Math.PI);
    }
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

/** What a visitor's hand moves: models before the camera at the next frame, the turntable at once. */
function change(by) {
  by(table?.gesture ?? gesture);
  table?.touched();
}

const turn = (radians) => change((held) => { held.turn += radians; });
const resize = (factor) => change((held) => { held.size = Math.min(LARGEST, Math.max(SMALLEST, held.size * factor)); });
/** Of the turntable alone: before the camera, the visitor walks. */
const tilt = (radians) => { if (table) change((held) => { held.tilt += radians; }); };

function undo() {
  Object.assign(gesture, { turn: 0, size: 1 });
  table?.reset();
}

const KEYS = {
  ArrowLeft: () => turn(-TURN_A_KEY),
  ArrowRight: () => turn(TURN_A_KEY),
  ArrowUp: () => resize(SIZE_A_KEY),
  ArrowDown: () => resize(1 / SIZE_A_KEY),
  PageUp: () => tilt(TURN_A_KEY),
  PageDown: () => tilt(-TURN_A_KEY),
  '+': () => resize(SIZE_A_KEY),
  '-': () => resize(1 / SIZE_A_KEY),
  0: () => undo(),
  Escape: () => stop(),
};
/** The same for those who do not drag, pinch or type. */
const HANDLES = {
  'turn-left': KEYS.ArrowLeft, 'turn-right': KEYS.ArrowRight, larger: KEYS['+'], smaller: KEYS['-'], higher: KEYS.PageUp,
  lower: KEYS.PageDown, reset: KEYS[0],
};

// ---- tools ----

async function shoot() {
  offer(new File([await view.photograph()], 'modar.jpg', { type: 'image/jpeg' }));
}

/** A film from the first press to the second, or as long as films get. */
async function record() {
  if (recorder) {
    recorder.stop();
    return;
  }
  const pressed = (on) => $('record').setAttribute('aria-pressed', String(on));
  try {
    recorder = new Recorder([$('picture'), $('models')]);
    pressed(true);
    const file = await recorder.done;
    if (file.size) offer(file);
  } catch (error) {
    tell(error);
  } finally {
    recorder = null;
    pressed(false);
  }
}

/** A photo or film, to be looked at, sent and kept. */
function offer(file) {
  const film = file.type.startsWith('video/');
  URL.revokeObjectURL($('save').href);
  $('save').href = URL.createObjectURL(file);
  $('save').download = file.name;
  $('photo-image').hidden = film;
  $('film').hidden = !film;
  $(film ? 'film' : 'photo-image').src = $('save').href;
  $('photo-title').textContent = say(film ? 'film' : 'photo');
  $('share').hidden = !navigator.canShare?.({ files: [file] });
  $('share').onclick = () => navigator.share({ files: [file], title: site.title }).catch(() => {});  // closing it is no error
  $('photo').showModal();
}

async function flip() {
  camera.flip();
  await reopenCamera();
}

async function toggleTorch() {
  const lit = $('torch').getAttribute('aria-pressed') !== 'true';
  await camera.track.applyConstraints({ advanced: [{ torch: lit }] });
  $('torch').setAttribute('aria-pressed', String(lit));
}

async function showCameras() {
  const devices = await camera.list();
  const current = camera.track.getSettings().deviceId;
  $('choose-list').replaceChildren(...devices.map((device, i) => {
    const label = document.createElement('label');
    const input = Object.assign(document.createElement('input'), { type: 'radio', name: 'camera', checked: device.deviceId === current });
    input.addEventListener('change', () => {
      camera.choose(device.deviceId);
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
  for (const id of ['look', 'look-instead']) {
    $(id).addEventListener('click', () => {
      $('problem').close();
      lookAround();
    });
  }
  $('scene').addEventListener('change', () => showScene(Number($('scene').value)));
  $('language').addEventListener('change', () => {
    store(KEPT_LANGUAGE, $('language').value);
    useLanguage($('language').value).catch(tell);
  });
  $('about').addEventListener('click', () => $('notes').showModal());
  $('notes-close').addEventListener('click', () => $('notes').close());
  $('forget').addEventListener('click', forget);
  for (const [id, move] of Object.entries(HANDLES)) $(id).addEventListener('click', move);
  addEventListener('resize', () => table?.draw());
  $('close').addEventListener('click', stop);
  $('flip').addEventListener('click', flip);
  $('shoot').addEventListener('click', shoot);
  $('record').addEventListener('click', record);
  $('torch').addEventListener('click', toggleTorch);
  $('cameras').addEventListener('click', showCameras);
  $('full').addEventListener('click', () => (document.fullscreenElement ? document.exitFullscreen() : $('stage').requestFullscreen()));
  $('photo-close').addEventListener('click', () => $('photo').close());
  $('photo').addEventListener('close', () => $('film').pause());
  $('choose-close').addEventListener('click', () => $('choose').close());
  $('problem-close').addEventListener('click', () => $('problem').close());
  $('copy').addEventListener('click', copyAddress);
  $('again').addEventListener('click', () => {
    $('problem').close();
    if (words) start();
    else location.reload();
  });
  $('problem').addEventListener('close', () => {
    if (root.dataset.state === 'error') setState('start');
    delete root.dataset.error;
  });
  listenToGestures($('models'));
  $('stage').addEventListener('keydown', (event) => {
    if (['button', 'select'].includes(event.target.localName) && event.key !== 'Escape') return;
    if (event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  // A page that nobody looks at has no business with the camera.
  document.addEventListener('visibilitychange', () => {
    if ($('stage').hidden || table) return;
    if (document.hidden) closeCamera();
    else reopenCamera();
  });
}

/** Takes from this device all that the page has kept on it. */
async function forget() {
  forgotten = true;
  forgetStored();
  await keeping;
  const worker = await navigator.serviceWorker?.getRegistration(SCOPE);
  if (worker) await navigator.serviceWorker.ready;  // one that is still installing would write on
  await worker?.unregister();
  for (const name of await globalThis.caches?.keys() ?? []) if (name.startsWith(`modar ${SCOPE} `)) await caches.delete(name);
  $('forget').textContent = say('forgotten');
  $('forget').disabled = true;
}

/** Keeps the page for visits without a network, once it has what it needs now. */
function keep() {
  if (forgotten || !('serviceWorker' in navigator) || !globalThis.isSecureContext) return;
  keeping = navigator.serviceWorker.register('sw.js').then(({ active }) => active && new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = resolve;
    active.postMessage('keep', [port2]);
  })).catch(() => {});  // the page works without it, but not offline
}

listen();
prepare().catch(tell).then(() => loading?.done.catch(() => {})).then(keep);
