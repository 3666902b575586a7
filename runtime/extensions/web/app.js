// @ts-check
// The page around <modar-viewer>: a cover, languages, photos and films to share, storage on the
// device.
import {Camera} from './camera.js';
import {Copy, isRotten, STORE_S} from './copy.js';
import {Source, within} from './download.js';
import {ModarError} from './engine.js';
import {forgetInstalled, installedBundles, installedFile} from './installed-release.js';
import './modar-viewer.js';
import {View} from './modar-view.js';
import {canRecord, Recorder} from './recorder.js';
import {forgetStored, store, stored} from './storage.js';
import {adopt, BASE} from './viewer-parts.js';
import {directionOf, fetchJson, fill, labelOf, showWords} from './viewer-words.js';

export {Camera, Recorder, View};  // as this page has them

/**
 * @typedef {import('./modar-viewer.js').ViewerPattern & {image: string, usdz?: string, glb?:
 * string}} Pattern of site.json
 * @typedef {{title: string, file: string, hash: string, installed?: boolean, patterns: Pattern[],
 *     source?: () => Promise<any>}} Bundle
 * @typedef {{text: string, url: string, lang?: string}} Link
 * @typedef {{title: string, languages: string[], bundles: Bundle[], own?: Bundle[],
 *     release?: {url: string}, statements?: Record<string, Link>, links?: Link[],
 *     baker?: boolean}} Site
 *
 * The elements that are more than an HTMLElement.
 * @typedef {{
 *   viewer: import('./modar-viewer.js').ModarViewer, bundle: HTMLSelectElement,
 *   language: HTMLSelectElement, qr: HTMLCanvasElement, room: HTMLAnchorElement,
 *   save: HTMLAnchorElement, film: HTMLVideoElement, 'photo-image': HTMLImageElement,
 *   'own-file': HTMLInputElement, start: HTMLButtonElement, look: HTMLButtonElement,
 *   forget: HTMLButtonElement, share: HTMLButtonElement, photo: HTMLDialogElement,
 *   notes: HTMLDialogElement, own: HTMLDialogElement,
 * }} Parts
 */

/**
 * @template {string} Id
 * @param {Id} id
 * @returns {Id extends keyof Parts ? Parts[Id] : HTMLElement}
 */
const $ = (id) => /** @type {any} */ (document.getElementById(id));
const root = document.documentElement;
const viewer = $('viewer');
const SCOPE = new URL('./', location.href).href;

const KEPT_LANGUAGE = 'modar-language';
/** Pictures of the visitor's own. */
const OWN_CACHE = `modar own ${SCOPE}`;

/**
 * The promise of what own-picture.js exports, once it is needed; and what the visitor has added.
 * @type {Promise<import('./own-picture.js').OwnPictures> | null}
 */
let own = null;
/**
 * Where the page's address asks for it.
 * @type {import('./survey.js').Survey | null}
 */
let survey = null;

/** @type {Site} */
let site;
/** @type {Record<string, any>} */
let words;
/** @type {Recorder | null} */
let recorder = null;
/**
 * The promise of the bundle that is loaded before the visitor starts.
 * @type {Promise<void> | null}
 */
let loading = null;
/**
 * The copy of the bundle that comes.
 * @type {Copy | null}
 */
let copy = null;
/**
 * Of requests for bundles: past what the browser has kept, once that was no good.
 * @type {RequestCache}
 */
let cache = 'default';
/**
 * Until the stored bundle is whole; and whether the visitor has deleted it since the page was
 * opened.
 * @type {Promise<unknown> | null}
 */
let keeping = null;
let forgotten = false;

// ---- words ----

/** @param {string[]} languages */
function chooseLanguage(languages) {
  const wanted = new URLSearchParams(location.search).get('lang');
  const liked = [wanted ?? '', stored(KEPT_LANGUAGE), ...navigator.languages].map(
      (tag) => tag.toLowerCase().split('-')[0]);
  return liked.find((tag) => languages.includes(tag)) ?? languages[0];
}

/** @param {string} language */
async function useLanguage(language) {
  words = await fetchJson(`words/${language}.json`);
  root.lang = language;
  root.dir = directionOf(language);
  showWords(document, words);
  $('photo-image').alt = words.photoAlt;
  [, $('elsewhere-text').textContent] = words.errors.none;
  viewer.words = words;
  own?.then((pictures) => {
    pictures.words = words;
  });
  showPlates();
  showLinks();
  await survey?.speak(language, words.back);
}

function showLanguages() {
  const nameOf = (/** @type {string} */ language) => {
    const name = new Intl.DisplayNames([language], {type: 'language'}).of(language) ?? language;
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
  const statement = site.statements?.[root.lang];
  $('links').replaceChildren(...[...statement ? [statement] : [], ...site.links ?? []].map(
      ({text, url, lang = ''}) => Object.assign(
          document.createElement('a'), {textContent: text, href: url, lang, rel: 'noopener'})));
}

// ---- the cover ----

function currentBundle() { return site.bundles[Number($('bundle').value) || 0]; }

/**
 * Where a hint's picture is: in the site's folder, or in the files of an update.
 * @param {string} image
 * @param {boolean} [installed]
 */
async function addressOf(image, installed) {
  if (!installed) return image;
  const blob = await installedFile(SCOPE, image);
  return blob ? URL.createObjectURL(blob) : '';
}

function showPlates() {
  const {patterns, installed} = currentBundle();
  $('plates').replaceChildren(...patterns.map(({image, width, height, title}) => {
    const picture = document.createElement('img');
    Object.assign(picture, {width, height, alt: title, decoding: 'async'});
    addressOf(image, installed).then((address) => {
      picture.src = address;
    });
    return picture;
  }));
  $('plates').classList.toggle('many', patterns.length > 1);
  $('plates').tabIndex = patterns.length > 1 ? 0 : -1;  // they scroll
  $('caption').textContent = patterns.length === 1 ? labelOf(patterns[0], root.lang).picture : '';
  $('lead').textContent = words[patterns.length > 1 ? 'leadMany' : 'lead'];
}

/** The site's own bundles, or those of a later release from an earlier visit. */
async function chooseBundles() {
  const installed = site.release &&
      await within(STORE_S, installedBundles(SCOPE, site.release), () => undefined)
          .catch(() => undefined);
  site.own ??= site.bundles;
  site.bundles = installed ?? site.own;
  $('bundle').replaceChildren(...site.bundles.map(({title}, i) => new Option(title, `${i}`)));
  $('choice').hidden = site.bundles.length < 2;
  $('lists-open').hidden = $('choice').hidden && !site.baker;
}

const canKeep = () => !forgotten && 'serviceWorker' in navigator && globalThis.isSecureContext;

/**
 * Where a bundle's bytes come from, the same each time.
 * @param {Bundle} bundle
 */
function sourceOf(bundle) {
  const installed = async () => {
    const file = await installedFile(SCOPE, bundle.file);
    if (!file?.size)
      throw new ModarError(
          {code: 'bundle.missing', where: bundle.file, cause: 'it is not stored any more'});
    return file.arrayBuffer();
  };
  const brought = async () => {
    copy = canKeep() ? await Copy.of(SCOPE, bundle.file) : null;
    return new Source(bundle.file, {copy, cache});
  };
  return bundle.source ??= bundle.installed ? installed : brought;
}

/**
 * The chosen bundle, once: begun before the visitor starts, and waited for then. again: stored
 * files are not used.
 */
async function loadBundle(again = false) {
  const bundle = currentBundle();
  if (viewer.srcObject !== sourceOf(bundle)) {
    viewer.srcObject = sourceOf(bundle);
    viewer.patterns = bundle.patterns.map(
        (pattern) => ({...pattern, image: () => addressOf(pattern.image, bundle.installed)}));
  }
  try {
    await viewer.load();
  } catch (error) {
    if (again || !isRotten(/** @type {{code?: string}} */ (error))) throw error;
    // Stored files have rotted: the network, or the site's own bundles, replace them.
    if (bundle.installed) {
      await forgetInstalled(SCOPE);
      await chooseBundles();
      showPlates();
    } else {
      cache = 'reload';
      await copy?.forget();
    }
    await loadBundle(true);
  }
}

/** Lists of models and pictures, over the camera's picture. */
async function openLists() {
  const {patterns, installed} = currentBundle();
  const lists = await import('./lists.js');
  const choose = (/** @type {number} */ bundle) => {
    viewer.stop();
    $('bundle').selectedIndex = bundle;
    showPlates();
    press('start', () => viewer.start(loadBundle()));
  };
  lists.openLists(
      {
        words,
        titles: site.bundles.map(({title}) => title),
        chosen: $('bundle').selectedIndex,
        pictures: patterns.map(
            ({name, title, image}) => ({name, title, image: addressOf(image, installed)})),
        choose,
        open:
            site.baker && ((title, bytes) => {
              $('bundle').append(new Option(title, `${site.bundles.length}`));
              choose(site.bundles.push({
                title,
                installed,
                file: '',
                hash: '',
                patterns: patterns.map(({texts, usdz, glb, ...rest}) => ({...rest, models: title})),
                source: async () => bytes.buffer
              }) - 1);
            }),
        look(pattern) {
          viewer.stop();
          press('look', () => viewer.look(pattern, loadBundle()));
        },
        own() {
          viewer.stop();
          $('own-file').click();
        }
      },
      adopt);
}

/** Newer bundles of a release folder are downloaded meanwhile; the next visit shows it. */
function update() {
  if (!site.release || !navigator.onLine || !('caches' in globalThis)) return;
  const worker = new Worker('update-worker.js', {type: 'module'});
  const end = (/** @type {{state: string, code?: string, text?: string}} */ {
    state,
    code = '',
    text = ''
  }) => {
    worker.terminate();
    root.dataset.update = `${state} ${code}`.trim();
    if (text) console.info(`No update: ${text} [${code}]`);
  };
  worker.onmessage = ({data}) => end(data);
  worker.onerror = (event) => {
    event.preventDefault();
    end({state: 'failed'});
  };
  worker.postMessage({
    scope: SCOPE,
    ...site.release,
    url: new URL(site.release.url, location.href).href,
    hashes: (site.own ?? site.bundles).map(({hash}) => hash)
  });
}

async function prepare() {
  site = await fetchJson('site.json');
  document.title = site.title;
  $('title').textContent = site.title;
  await chooseBundles();
  if (!navigator.connection?.saveData)
    loading = loadBundle().catch(() => {});  // the start button names the fault
  if (new URLSearchParams(location.search).has('survey')) {
    const {Survey} = await import('./survey.js');
    survey =
        new Survey({viewer, foot: $('foot'), title: site.title, adopt, fetchJson, store, stored});
  }
  await useLanguage(chooseLanguage(site.languages));
  showLanguages();
  update();
}

/**
 * Without its words the page has no buttons to press: index.html has a sentence in each language,
 * which loads the page again.
 * @param {unknown} error
 */
function tellUnprepared(error) {
  console.error(error);
  const sentences = /** @type {HTMLElement[]} */ ([...$('unloaded').children]);
  const language = chooseLanguage(sentences.map(({lang}) => lang));
  for (const sentence of sentences) sentence.hidden = sentence.lang !== language;
  Object.assign($('unloaded'), {hidden: false, className: 'now'});
}

/** On a desktop without a camera, the page's address for a phone. */
async function showElsewhere() {
  const devices = await navigator.mediaDevices?.enumerateDevices();
  if (!devices || devices.some(({kind}) => kind === 'videoinput') ||
      matchMedia('(pointer: coarse)').matches)
    return;
  const {drawQr} = await import('./qr.js');
  drawQr($('qr'), location.href);
  $('elsewhere').hidden = $('qr').hidden;
}

// ---- the visitor's room ----

/**
 * Links to the viewer that a phone has for its visitor's room: Quick Look or Scene Viewer.
 * @param {{usdz?: string, glb?: string}} pattern
 */
function showRoom({usdz, glb} = {}) {
  const room = $('room');
  if (usdz && room.relList.supports('ar')) room.href = usdz;
  else if (glb && navigator.userAgent.includes('Android'))
    room.href = sceneViewer(new URL(glb, location.href));
  else room.removeAttribute('href');
  room.hidden = !room.hasAttribute('href');
}

const sceneViewer = (/** @type {URL} */ file) =>
    `intent://arvr.google.com/scene-viewer/1.0?mode=ar_preferred&file=${
        encodeURIComponent(file.href)}` +
    '#Intent;scheme=https;package=com.google.android.googlequicksearchbox;action=android.intent.action.VIEW;' +
    `S.browser_fallback_url=${encodeURIComponent(location.href)};end;`;

// ---- pictures of the visitor's own ----

/** Loaded by those who add pictures. */
function ownPictures() {
  own ??= import('./own-picture.js')
              .then(({OwnPictures}) => Object.assign(new OwnPictures(viewer, OWN_CACHE), {words}));
  return own;
}

async function addOwn() {
  const file = $('own-file').files?.[0];
  $('own-file').value = '';  // the same one again is a change, too
  if (!file) return;
  try {
    await prepared;
    await loadBundle();
    await (await ownPictures()).open(file);
  } catch (error) { viewer.fail(error); }
}

// ---- photos and films ----

async function shoot() {
  offer(new File([await viewer.photograph()], 'modar.jpg', {type: 'image/jpeg'}));
}

/** A film from the first press to the second, or as long as films get. */
async function record() {
  if (recorder) {
    recorder.stop();
    return;
  }
  const pressed = (/** @type {boolean} */ on) =>
      $('record').setAttribute('aria-pressed', String(on));
  try {
    recorder = new Recorder(viewer.layers, viewer.film);
    pressed(true);
    const file = await recorder.done;
    if (file.size) offer(file);
  } catch (error) { viewer.fail(error); } finally {
    recorder = null;
    pressed(false);
  }
}

/**
 * A photo or film, to be looked at, sent and kept.
 * @param {File} file
 */
function offer(file) {
  const film = file.type.startsWith('video/');
  URL.revokeObjectURL($('save').href);
  $('save').href = URL.createObjectURL(file);
  $('save').download = file.name;
  $('photo-image').hidden = film;
  $('film').hidden = !film;
  $(film ? 'film' : 'photo-image').src = $('save').href;
  $('photo-title').textContent = words[film ? 'film' : 'photo'];
  $('share').hidden = !navigator.canShare?.({files: [file]});
  $('share').onclick = () => navigator.share({files: [file], title: site.title})
                                 .catch(() => {});  // closing it is no error
  $('photo').showModal();
}

// ---- buttons and events ----

function listenToViewer() {
  const progress = (/** @type {string} */ text) => {
    $('progress').textContent = text;
  };
  viewer.addEventListener(
      'progress',
      ({loaded, total}) => words &&
          progress(loaded < total ?
                       fill(words.loading, {percent: Math.floor((100 * loaded) / total)}) :
                       words.preparing));
  for (const type of /** @type {const} */ (['whole', 'error']))
    viewer.addEventListener(type, () => progress(''));
  viewer.addEventListener('load', async () => {
    if (await globalThis.caches?.has(OWN_CACHE)) (await ownPictures()).restore();
  });
  $('own').addEventListener('close', () => {
    if ($('own').returnValue === 'added') progress(words.ownAdded);
  });
  viewer.addEventListener('frame', () => recorder?.add());
  viewer.addEventListener('camerachange', () => {
    recorder?.stop();
    $('record').hidden = !canRecord();
  });
  viewer.addEventListener(
      'scenechange',
      ({detail}) => showRoom(/** @type {Pattern | undefined} */ (viewer.patterns[detail.pattern])));
}

/**
 * Opens the viewer; a second press meanwhile does nothing.
 * @param {'start' | 'look'} button
 * @param {() => Promise<void>} action
 */
async function press(button, action) {
  $(button).disabled = true;
  try {
    await action();
  } finally { $(button).disabled = false; }
}

function listen() {
  listenToViewer();
  const clicks = {
    start: () => press('start', () => viewer.start(loadBundle())),
    look: () => press('look', () => viewer.look(0, loadBundle())),
    about: () => $('notes').showModal(),
    'lists-open': openLists,
    'notes-close': () => $('notes').close(),
    forget,
    shoot,
    record,
    'photo-close': () => $('photo').close(),
  };
  for (const [id, action] of Object.entries(clicks)) $(id).addEventListener('click', action);
  $('bundle').addEventListener('change', () => {
    showPlates();
    loadBundle().catch(() => {});
  });
  $('language').addEventListener('change', () => {
    store(KEPT_LANGUAGE, $('language').value);
    useLanguage($('language').value).catch((error) => viewer.fail(error));
  });
  $('own-open').addEventListener('click', () => $('own-file').click());
  $('own-file').addEventListener('change', addOwn);
  $('photo').addEventListener('close', () => $('film').pause());
}

// ---- storage ----

/** Takes from this device all that the page has kept on it. */
async function forget() {
  forgotten = true;
  forgetStored();
  await globalThis.caches?.delete(OWN_CACHE);
  await within(STORE_S, keeping, () => {});
  const worker = await navigator.serviceWorker?.getRegistration(SCOPE);
  if (worker) await navigator.serviceWorker.ready;  // one that is still installing would write on
  await worker?.unregister();
  for (const name of await globalThis.caches?.keys() ?? [])
    if (name.startsWith(`modar ${SCOPE} `)) await caches.delete(name);
  $('forget').textContent = words.forgotten;
  $('forget').disabled = true;
}

/**
 * Keeps the page for visits without a network; whole: and its bundles, once it has what it needs
 * now.
 * @param {boolean} [whole]
 */
function keep(whole) {
  if (!canKeep()) return;
  keeping = navigator.serviceWorker.register('sw.js')
                .then(({active, waiting, installing}) => whole && new Promise((resolve) => {
                                                           const {port1, port2} =
                                                               new MessageChannel();
                                                           port1.onmessage = resolve;
                                                           /** @type {ServiceWorker} */ (
                                                               active ?? waiting ?? installing)
                                                               .postMessage('keep', [port2]);
                                                         }))
                .catch(() => {});  // the page works without it, but not offline
}

adopt(document, BASE);
$('unloaded').hidden = true;
listen();
const prepared = prepare();
// Not while the first picture is looked for: a service worker that loads the page delayed its
// finding by 3 s.
const found = new Promise((resolve) => {
  viewer.addEventListener('found', resolve, {once: true});
});
showElsewhere().catch(() => {});
prepared.catch(tellUnprepared)
    .then(() => loading)
    .then(() => viewer.shown)
    .then(() => Promise.race([found, viewer.whole]))
    .catch(() => {})
    .then(() => keep())
    .then(() => viewer.whole)
    .then(() => copy?.written)
    .then(() => keep(true), () => {});
