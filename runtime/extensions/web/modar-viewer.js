// @ts-check
// <modar-viewer src="vase.modar">: the models of a bundle before a visitor's camera, and on a
// turntable without one. `modar web` makes its page of this element. Types: modar-viewer.d.ts.
import {describe, titleOf} from './bundle.js';
import {Camera, hostApp, ownBrowser} from './camera.js';
import {ModarError, POSE, POSE_FLOATS} from './engine.js';
import {allowMotion, load} from './modar.js';
import {View} from './modar-view.js';
import {groundTransform} from './turntable.js';
import {build} from './viewer-parts.js';
import {directionOf, fill, labelOf, showWords, wordsFor} from './viewer-words.js';

/** Pictures that a hint has room for. */
const MOST_PLATES = 4;
const reducesMotion = () => matchMedia('(prefers-reduced-motion: reduce)').matches;

/**
 * @typedef {import('./modar-viewer.js').ViewerPattern} ViewerPattern
 * @typedef {import('./modar.js').Frame} Frame
 * @typedef {{errors: Record<string, [title: string, cure: string]>} & Record<string, any>} Words
 * @typedef {{node: number, text?: string, language: string}} Caption
 *
 * The parts that are more than an HTMLElement.
 * @typedef {{
 *   poster: HTMLImageElement, ground: HTMLImageElement, video: HTMLVideoElement,
 *   picture: HTMLCanvasElement, models: HTMLCanvasElement, qr: HTMLCanvasElement,
 *   start: HTMLButtonElement, look: HTMLButtonElement, volume: HTMLInputElement,
 *   scene: HTMLSelectElement, 'leave-open': HTMLAnchorElement, stage: HTMLDialogElement,
 *   leave: HTMLDialogElement, choose: HTMLDialogElement, problem: HTMLDialogElement,
 * }} Parts
 */

/** @type {Record<string, string>} */
const BY_NAME = {
  NotAllowedError: 'refused',
  SecurityError: 'refused',
  NotFoundError: 'none',
  OverconstrainedError: 'none',
  NotReadableError: 'busy',
  AbortError: 'busy',
};
/** @type {Record<string, string>} */
const BY_CODE = {
  'web.webgl': 'webgl',
  'web.wasm': 'old',
  'web.download': 'network',
  'web.changed': 'network',
  'web.login': 'login',
  'web.policy': 'policy',
  'web.memory': 'memory',
  'web.insecure': 'insecure',
  'web.old': 'old',
  'web.ended': 'ended',
  'web.worker': 'other',
};
/** What the browser of another app may lack, and the phone's own has. */
const OF_HOSTS = ['refused', 'none', 'busy', 'old'];
/** The error text if no words could be loaded. */
const NO_WORDS =
    /** @type {const} */ (['The page could not be loaded', 'Check the network and load it again.']);

/** @param {any} error */
function kindOf(error) {
  const byCode = (/** @type {ModarError} */ {code}) =>
      BY_CODE[code] ?? (code.startsWith('gl.') ? 'webgl' : 'bundle');
  const kind = error instanceof ModarError ? byCode(error) : BY_NAME[error?.name] ?? 'other';
  return hostApp() && OF_HOSTS.includes(kind) ? 'host' : kind;
}

/**
 * @param {Element} element
 * @param {string} text
 */
function setText(element, text) {
  if (element.textContent !== text)
    element.textContent = text;  // else readers repeat it for each frame
}

const pictureOf = async (/** @type {ViewerPattern} */ {image}) =>
    (typeof image === 'function' ? image() : image);

/** A server that renders pages has no elements, and may import this all the same. */
export class ModarViewer extends (globalThis.HTMLElement ?? Object) {
  static observedAttributes = ['src', 'poster', 'alt', 'lang'];

  #root = build(this);
  /** @type {Words | null} */
  #words = null;
  #wordsGiven = false;
  /**
   * Until words are there.
   * @type {Promise<void> | null}
   */
  #ready = null;
  /** @type {import('./modar-viewer.js').ModarViewer['state']} */
  #state = 'start';
  /** @type {import('./modar-viewer.js').ModarViewer['srcObject']} */
  #srcObject = null;
  /**
   * The loaded bundle, and the promise of it.
   * @type {{source: ModarViewer['srcObject'], done: Promise<void>} | null}
   */
  #loading = null;
  /** Both null without a bundle. */
  #modar = /** @type {import('./modar.js').Modar} */ (/** @type {unknown} */ (null));
  #view = /** @type {View} */ (/** @type {unknown} */ (null));
  /** @type {ViewerPattern[] | null} */
  #patterns = null;
  /** @type {ViewerPattern[] | null} */
  #patternsGiven = null;
  #camera = new Camera();
  #shown = -1;
  /** The label has a node's words, not its pattern's. */
  #noted = false;
  /**
   * The pattern that the label was shown for last; whether it is folded, and whether the visitor
   * has asked for that.
   */
  #labelled = -1;
  #folded = false;
  #asked = false;
  /**
   * The sound of now, by node.
   * @type {Map<number, string>}
   */
  #cues = new Map();
  /** What the visitor has asked for last. */
  #again = () => this.start();

  constructor() {
    super();
    this.#listen();
  }

  /**
   * @template {string} Id
   * @param {Id} id
   * @returns {Id extends keyof Parts ? Parts[Id] : HTMLElement}
   */
  #$(id) { return /** @type {any} */ (this.#root.getElementById(id)); }

  connectedCallback() {
    document.addEventListener('visibilitychange', this.#onVisibility);
    addEventListener('resize', this.#onResize);
    this.#ready ??= this.#loadWords();
  }

  disconnectedCallback() {
    document.removeEventListener('visibilitychange', this.#onVisibility);
    removeEventListener('resize', this.#onResize);
    this.stop();
    this.#unload();
    this.#loading = null;
  }

  /** @param {string} name */
  attributeChangedCallback(name) {
    if (name === 'poster' || name === 'alt') {
      const [poster, src] = [this.#$('poster'), this.getAttribute('poster')];
      Object.assign(poster, {hidden: !src, alt: this.getAttribute('alt') ?? ''});
      if (src) poster.src = src;
    } else if (name === 'lang' && this.isConnected) {
      this.#ready = this.#loadWords();
    }
  }

  // ---- what pages set and read ----

  get src() { return this.getAttribute('src') ?? ''; }

  set src(address) { this.setAttribute('src', address); }

  get srcObject() { return this.#srcObject; }

  set srcObject(source) { this.#srcObject = source; }

  get state() { return this.#state; }

  get modar() { return this.#modar; }

  /** Of a packed bundle: resolved when something of every model is there, and drawn. */
  get shown() { return this.#view?.shown; }

  /** Of a packed bundle: resolved when all of it is there, and drawn. */
  get whole() { return this.#view?.whole ?? Promise.resolve(); }

  /** The track of the camera that is open. */
  get camera() { return this.#camera.track ?? null; }

  /** The stacked canvases of picture and models. */
  get layers() { return [this.#$('picture'), this.#$('models')]; }

  /** The sound of videos and sounds as a stream, or null. Asked for in a click's handler. */
  get film() { return this.#view?.film ?? null; }

  get clips() { return this.#view?.clips ?? []; }
  /**
   * @param {string} name
   * @param {{loop?: boolean, blend?: number}} [options]
   */
  play(name, options) { this.#view?.play(name, options); }

  /** @returns {ViewerPattern[]} */
  get patterns() { return this.#patterns ?? []; }

  /**
   * null: as the bundle says.
   * @param {ViewerPattern[] | null} patterns
   */
  set patterns(patterns) {
    this.#patternsGiven = patterns;
    this.#usePatterns(patterns);
  }

  /** @param {Words} words */
  set words(words) {
    this.#wordsGiven = true;
    this.#ready = Promise.resolve();
    this.#useWords(words, this.#language);
  }

  /** @param {ModarViewer['state']} state */
  #setState(state) {
    if (state === this.#state) return;
    this.#state = state;
    this.setAttribute('state', state);
    this.dispatchEvent(new Event('statechange'));
  }

  // ---- words ----

  get #language() {
    return /** @type {HTMLElement | null} */ (this.closest('[lang]'))?.lang || navigator.language;
  }

  async #loadWords() {
    if (this.#wordsGiven) return;
    const found = await wordsFor(this.#language).catch(() => null);
    if (found && !this.#wordsGiven) this.#useWords(found.words, found.language);
  }

  /**
   * @param {Words} words
   * @param {string} language
   */
  #useWords(words, language) {
    this.#words = words;
    Object.assign(this.#$('all'), {lang: language, dir: directionOf(language)});
    showWords(this.#root, words);
    this.#$('models').setAttribute('aria-roledescription', words.scene);
    this.#showPatternNames();
    if (this.#view) this.#useLanguages();
    this.#showLabel(this.#shown);
    this.#$('marks').replaceChildren();
    if (this.#$('stage').open) this.#showMarks();
  }

  /**
   * @param {string} key
   * @param {Record<string, string | number>} [values]
   */
  #say(key, values) { return fill(this.#words?.[key] ?? '', values); }

  /** @param {number} pattern */
  #labelOf(pattern) { return labelOf(this.patterns[pattern], this.#language); }

  /** @param {ViewerPattern[] | null} patterns */
  #usePatterns(patterns) {
    this.#patterns = patterns;
    this.#shown = -1;
    const few = this.patterns.slice(0, MOST_PLATES);
    this.#$('plates').replaceChildren(...few.map((pattern) => {
      const picture = document.createElement('img');
      Object.assign(
          picture, {width: pattern.width, height: pattern.height, alt: '', decoding: 'async'});
      pictureOf(pattern).then((address) => {
        picture.src = address;
      });
      return picture;
    }));
    this.#$('plates').classList.toggle('many', few.length > 1);
    this.#showPatternNames();
  }

  #showPatternNames() {
    const chosen = this.#$('scene').selectedIndex;
    const labels = this.patterns.map((_, i) => this.#labelOf(i));
    const textOf = (/** @type {ReturnType<typeof labelOf>} */ {name, picture}) =>
        (labels.filter((each) => each.name === name).length > 1 ? `${name} (${picture})` : name);
    this.#$('scene').replaceChildren(
        ...labels.map((label, i) => new Option(textOf(label), `${i}`, false, i === chosen)));
  }

  // ---- the bundle ----

  /**
   * The bundle, once: begun before the visitor starts, and waited for then.
   * @returns {Promise<void>}
   */
  load() {
    const source = this.#srcObject ?? this.src;
    if (this.#loading?.source === source) return this.#loading.done;
    const before = this.#loading?.done.catch(() => {});
    const done = Promise.resolve(before).then(async () => {
      this.#unload();
      try {
        await this.#open(source);
      } catch (error) {
        if (this.#loading?.done === done) this.#loading = null;  // the next start tries again
        this.#showProgress('', 1);
        throw error;
      }
      if (this.#loading?.done !== done)
        this.#unload();  // another was chosen meanwhile, or the viewer was removed
      else this.dispatchEvent(new Event('load'));
    });
    this.#loading = {source, done};
    return done;
  }

  /**
   * @see modar-viewer.d.ts
   * @param {HTMLImageElement | HTMLCanvasElement | ImageBitmap} image
   */
  async addPattern(image, {name = '', widthMm = 0, scene = 0} = {}) {
    await this.load();
    const model = this.#modar.scenes[scene]?.model;
    if (model === undefined)
      throw new ModarError({
        code: 'web.scene',
        cause: `the bundle has no scene ${scene}`,
        cure: 'count from 0 in modar.scenes'
      });
    const pattern = await this.#modar.addPattern(image, {name, widthMm});
    this.#view.stand(name, scene);
    const [width, height] = 'naturalWidth' in image ? [image.naturalWidth, image.naturalHeight] :
                                                      [image.width, image.height];
    const copy = Object.assign(document.createElement('canvas'), {width, height});
    /** @type {CanvasRenderingContext2D} */ (copy.getContext('2d')).drawImage(image, 0, 0);
    const address = URL.createObjectURL(await new Promise((resolve) => {
      copy.toBlob(/** @type {BlobCallback} */ (resolve));
    }));
    this.#usePatterns([
      ...this.patterns, {name, title: name, models: titleOf(model), width, height, image: address}
    ]);
    return pattern;
  }

  #unload() {
    this.#modar?.close();
    this.#modar = this.#view = /** @type {any} */ (null);
  }

  /** @param {NonNullable<ModarViewer['srcObject']>} source */
  async #open(source) {
    const opening = load(typeof source === 'function' ? await source() : source, {
      onProgress: (loaded, total) => this.#tellProgress(loaded, total),
    });
    const most = this.getAttribute('max-bytes');
    const creating = View.create(opening, {
      picture: this.#$('picture'),
      models: this.#freshCanvas(),
      ...(most && {maxBytes: Number(most)})
    });
    creating.catch(() => {});  // told below, after what ails the bundle
    const opened = await opening;
    /** @type {View} */
    let view;
    try {
      view = this.#view = await creating;
    } catch (error) {
      opened.close();
      throw error;
    }
    this.#modar = opened;
    if (!this.#patternsGiven) this.#usePatterns(describe(() => view.bytes, opened));
    this.#listenToScenes(view);
    view.addEventListener('error', ({detail}) => this.#failRest(detail));
    this.#followRest(view);
    opened.addEventListener('frame', ({detail}) => this.#onFrame(detail));
    opened.addEventListener('dropped', ({detail}) => {
      if (this.#camera.stream) view.show(detail.source, {mirror: this.#camera.mirrored});
    });
    opened.addEventListener('error', ({detail}) => this.fail(detail));
    for (const type of /** @type {const} */ (['found', 'updated', 'lost'])) {
      opened.addEventListener(
          type, ({detail}) => this.dispatchEvent(new CustomEvent(type, {detail})));
    }
  }

  /**
   * While the rest comes, the present part can be used.
   * @param {View} view
   */
  async #followRest(view) {
    const wrong = await view.whole.catch((error) => error);
    if (view !== this.#view) return;
    this.#showProgress('', 1);
    if (wrong) this.#failRest(wrong);
    else this.dispatchEvent(new Event('whole'));
  }

  /**
   * @param {number} loaded
   * @param {number} total
   */
  #tellProgress(loaded, total) {
    this.#showProgress(
        loaded < total ? this.#say('loading', {percent: Math.floor((100 * loaded) / total)}) :
                         this.#say('preparing'),
        loaded / total);
    this.dispatchEvent(new ProgressEvent('progress', {lengthComputable: true, loaded, total}));
  }

  /**
   * On the cover in words, on the stage as a bar.
   * @param {string} text
   * @param {number} share
   */
  #showProgress(text, share) {
    setText(this.#$('progress'), text);
    Object.assign(this.#$('rest'), {hidden: share >= 1, value: share});
    this.#$('rest').setAttribute('aria-label', text);
  }

  /** A canvas keeps its first context: another bundle's renderer gets a new one. */
  #freshCanvas() {
    const used = this.#$('models');
    if (!used.dataset.used) {
      used.dataset.used = 'yes';
      return used;
    }
    const canvas = /** @type {HTMLCanvasElement} */ (used.cloneNode(false));
    used.replaceWith(canvas);
    this.#listenToGestures(canvas);
    return canvas;
  }

  // ---- start and stop ----

  /**
   * Opens the camera and shows it with its models. Call it in a click's handler. loaded: the
   * promise to await together with the camera.
   */
  async start(loaded = this.load()) {
    this.#again = () => this.start();
    loaded.catch(() => {});  // told below, after the camera's own troubles
    this.#setBusy(true);
    try {
      await allowMotion();  // first: iOS asks for it within the click only
      await this.#openCamera();
      await Promise.all([loaded, this.#ready]);
      if (!this.isConnected) return this.stop();
      await this.#follow();
      this.#$('reason').textContent = this.#lookWords;
      this.#enter('looking', -1);
    } catch (error) { this.fail(error); } finally {
      this.#setBusy(false);
    }
  }

  /** Shows the content of a pattern on a turntable, without a camera. */
  async look(pattern = 0, loaded = this.load()) {
    this.#again = () => this.look(pattern);
    this.#setBusy(true);
    try {
      await Promise.all([loaded, this.#ready]);
      if (!this.isConnected) return;
      this.#$('which').hidden = this.patterns.length < 2;
      this.#enter('around', pattern);
      await this.#turnScene(pattern);
    } catch (error) { this.fail(error); } finally {
      this.#setBusy(false);
    }
  }

  /** Back to the cover. */
  stop() {
    this.#closeCamera();
    this.#$('which').hidden = this.#$('ground').hidden = true;
    if (this.#root.fullscreenElement) document.exitFullscreen();
    this.#$('stage').close();
    if (this.#$('leave').open) this.#$('leave').close();
    this.#view?.forgetActs();  // else what turns would be drawn on
    this.#hideLabel();
    this.#shown = this.#labelled = -1;
    this.#$('marks').replaceChildren();
    this.#setState('start');
  }

  /**
   * Of an incomplete bundle, the present part stays.
   * @param {unknown} error
   */
  #failRest(error) {
    this.#loading = null;                 // the next start tries again
    if (this.#state === 'start') return;  // and tells
    if (['network', 'login'].includes(kindOf(error))) this.#tellProblem(error);
    else this.fail(error);
  }

  /**
   * Stops, and shows the visitor the fault and its cure.
   * @param {unknown} error
   */
  fail(error) {
    this.stop();
    this.#tellProblem(error);
  }

  /** @param {any} error */
  #tellProblem(error) {
    if (!this.isConnected) return;  // removed meanwhile: there is nobody to tell
    const kind = kindOf(error);
    const [title, cure] = this.#words?.errors[kind] ?? NO_WORDS;
    const host = {app: hostApp(), browser: ownBrowser()};
    this.#$('problem-title').textContent = fill(title, host);
    this.#$('problem-cure').textContent = fill(cure, host);
    const plain = ['refused', 'none', 'insecure'].includes(kind);
    this.#$('problem-detail').textContent = kind === 'host' ? location.href :
        plain                                               ? '' :
                                                              String(error?.message ?? error);
    this.#$('copy').hidden = kind !== 'host';
    this.#$('qr').hidden = true;
    if (kind === 'none')
import('./qr.js').then(({drawQr}) => drawQr(this.#$('qr'), location.href)).catch(() => {});
    this.#$('again').hidden = kind === 'host';
    // Models can be looked at wherever they can be drawn.
    this.#$('look-instead').hidden =
        !this.#words || ['webgl', 'network', 'login', 'bundle', 'memory', 'other'].includes(kind);
    this.#$('problem').dataset.kind = kind;
    if (this.#state === 'start') this.#setState('error');
    if (!this.#$('problem').open) this.#$('problem').showModal();
    this.dispatchEvent(new ErrorEvent('error', {error, message: String(error?.message ?? error)}));
  }

  /**
   * Both layers in one picture.
   * @param {'image/jpeg' | 'image/png'} [type]
   */
  photograph(type) { return this.#view.photograph(type); }

  /** @param {boolean} busy */
  #setBusy(busy) {
    for (const id of /** @type {const} */ (['start', 'look'])) this.#$(id).disabled = busy;
  }

  /**
   * @param {ModarViewer['state']} state
   * @param {number} pattern
   */
  #enter(state, pattern) {
    this.#$('full').hidden = !document.fullscreenEnabled;
    this.#setState(state);
    const names = state === 'around' ? {stage: 'lookAround', close: 'back'} :
                                       {stage: 'stage', close: 'close'};
    for (const [id, word] of Object.entries(names)) this.#$(id).dataset.label = word;
    if (this.#words) showWords(this.#root, this.#words);
    this.#showScene(pattern);
    if (!this.#$('stage').open) this.#$('stage').showModal();
    this.#$('models').focus({preventScroll: true});
  }

  /**
   * For another browser. Where the clipboard is closed, the address is selected, to be copied
   * manually.
   */
  async #copyAddress() {
    try {
      await navigator.clipboard.writeText(location.href);
      this.#$('copy').textContent = this.#say('copied');
    } catch { getSelection()?.selectAllChildren(this.#$('problem-detail')); }
  }

  // ---- the camera ----

  async #openCamera() {
    await this.#camera.open(
        this.#$('video'),
        () => this.fail(new ModarError({code: 'web.ended', cause: 'the camera ended'})));
    performance.mark('modar: camera');
    this.dispatchEvent(new Event('camerachange'));
  }

  /** Tracks in the camera's frames, with the tools that it has. */
  async #follow() {
    const {track} = this.#camera;
    await this.#modar.start(this.#$('video'), {...this.#camera.focal, extended: true});
    this.#$('flip').hidden = (await this.#camera.list()).length < 2;
    this.#$('torch').hidden = !track?.getCapabilities?.().torch;
    this.#$('torch').setAttribute('aria-pressed', 'false');
  }

  #closeCamera() {
    this.#modar?.stop();
    if (!this.#camera.stream) return;
    this.#camera.close();
    this.#$('video').srcObject = null;
    this.dispatchEvent(new Event('camerachange'));
  }

  async #reopenCamera() {
    this.#closeCamera();
    try {
      await this.#openCamera();
      await this.#follow();
    } catch (error) { this.fail(error); }
  }

  #flip() {
    this.#camera.flip();
    return this.#reopenCamera();
  }

  async #toggleTorch() {
    const lit = this.#$('torch').getAttribute('aria-pressed') !== 'true';
    await this.#camera.track?.applyConstraints({advanced: [{torch: lit}]});
    this.#$('torch').setAttribute('aria-pressed', String(lit));
  }

  async #showCameras() {
    const devices = await this.#camera.list();
    const current = this.#camera.track?.getSettings().deviceId;
    this.#$('choose-list').replaceChildren(...devices.map((device, i) => {
      const label = document.createElement('label');
      const input = Object.assign(
          document.createElement('input'),
          {type: 'radio', name: 'camera', checked: device.deviceId === current});
      input.addEventListener('change', () => {
        this.#camera.choose(device.deviceId);
        this.#$('choose').close();
        this.#reopenCamera();
      });
      label.append(input, device.label || this.#say('camera', {number: i + 1}));
      return label;
    }));
    this.#$('choose').showModal();
  }

  /** A page that nobody looks at has no business with the camera. */
  #onVisibility = () => {
    if (!['looking', 'seen'].includes(this.#state)) return;
    if (document.hidden) this.#closeCamera();
    else this.#reopenCamera();
  };

  // ---- a look without a camera ----

  #onResize = () => this.#view?.turned();

  /** @param {number} pattern */
  async #turnScene(pattern) {
    const picture = this.patterns[pattern];
    this.#$('scene').value = `${pattern}`;
    const {width, height, flat} = picture;
    const src = await pictureOf(picture);
    if (this.#state !== 'around') return;
    Object.assign(this.#$('ground'), {width, height, src, hidden: flat === false});
    this.#view.lookAround(pattern, !reducesMotion());
  }

  /** The picture below the content. */
  #layGround() {
    const {view, focal} = this.#view.eye;
    const {clientWidth: width, clientHeight: height} = this.#$('screen');
    const numbers = groundTransform(view, focal, {width, height}, this.patterns[this.#shown]);
    this.#$('ground').style.transform = `matrix3d(${numbers.join()})`;
  }

  // ---- frames ----

  get #lookWords() { return this.#say(this.patterns.length > 1 ? 'lookMany' : 'look'); }

  /** @param {string} name */
  #nameModels(name) { this.#$('models').setAttribute('aria-label', name); }

  /**
   * The texts of a pattern's models and pictures, or of a tapped label.
   * @param {{language: string, name: string, text: string}} label
   */
  #fillLabel({language, name, text}) {
    this.#$('label-name').textContent = name;
    this.#$('label-text').textContent = text;
    Object.assign(this.#$('label'), {lang: language, dir: language ? directionOf(language) : ''});
    this.#fold(this.#folded);
  }

  /**
   * Folded, the label is a button that shows it again. asked: by the visitor, so that it stays
   * unchanged.
   * @param {boolean} folded
   */
  #fold(folded, asked = this.#asked) {
    this.#folded = folded;
    this.#asked = asked;
    this.#$('label').hidden = folded;
    this.#$('label-open').hidden = !folded;
  }

  #hideLabel() { this.#$('label').hidden = this.#$('label-open').hidden = true; }

  /**
   * A label that would cover marks moves to the top, or back; where it would there, too, it folds,
   * unless the visitor asked for it.
   */
  #clearMarks() {
    const label = this.#$('label');
    if (label.hidden) return;
    const marks = this.#marks.map((mark) => mark.getBoundingClientRect());
    const covers = () => {
      const {left, right, top, bottom} = label.getBoundingClientRect();
      return marks.some(
          (mark) =>
              left < mark.right && mark.left < right && top < mark.bottom && mark.top < bottom);
    };
    for (let moves = 0; moves < 2 && covers(); ++moves) this.#$('said').classList.toggle('above');
    if (!this.#asked && covers()) this.#fold(true);
  }

  /** @param {number} pattern */
  #showLabel(pattern) {
    this.#noted = false;
    if (pattern >= 0 && pattern !== this.#labelled) {
      this.#labelled = pattern;
      this.#folded = this.#asked = false;
    }
    if (pattern < 0) {
      this.#hideLabel();
      this.#nameModels(this.#say('nothingSeen'));
    } else {
      const label = this.#labelOf(pattern);
      this.#fillLabel(label);
      const models =
          this.#modar.scenes.filter((scene) => scene.pattern === pattern).map(({model}) => model);
      const heard =
          this.#view.nodes
              .map(
                  (node, i) =>
                      (node.pattern === pattern && this.#view.captionsOf(i)?.transcript) || '')
              .filter(Boolean);
      this.#$('heard').hidden = heard.length === 0;
      this.#$('heard-text').textContent = heard.join('\n\n');
      const pictures = this.#view.nodes.map(
          (node, i) =>
              (node.pattern === pattern && ['picture', 'video'].includes(node.kind) ?
                   this.#wordsOf(i).alt :
                   ''));
      const seen = [
        label.alt || this.patterns[pattern].models || models.join(', '), ...pictures
      ].filter(Boolean).join('; ');
      this.#nameModels(this.#say('seen', {name: seen, pattern: label.picture}));
    }
  }

  /** @param {number} pattern */
  #showScene(pattern) {
    this.#shown = pattern;
    this.#showLabel(pattern);
    this.dispatchEvent(new CustomEvent('scenechange', {detail: {pattern}}));
  }

  // ---- labels that point, and what else a scene does ----

  /** @param {number} node */
  #wordsOf(node) { return this.#view.wordsOf(node, this.#languages); }

  get #languages() { return [this.#language, this.#language.split('-')[0]]; }

  #useLanguages() { this.#view.languages = this.#languages; }

  /** @param {View} view */
  #listenToScenes(view) {
    const sounds = view.nodes.some(({kind}) => kind === 'video' || kind === 'sound');
    this.#$('media').hidden = !sounds && !view.clips.length;
    this.#$('sound').hidden = !sounds;
    // What moves by itself waits for who wants that.
    if (view.clips.length && reducesMotion()) view.press(5);
    this.#$('captions').hidden = !view.nodes.some((_, node) => view.captionsOf(node));
    this.#useLanguages();
    this.#cues.clear();
    view.addEventListener('drawn', () => {
      if (this.#state !== 'start') this.#showMarks();
      if (this.#state === 'around' && this.#shown >= 0) this.#layGround();
    });  // a last frame may come late
    view.addEventListener('caption', ({detail}) => this.#caption(detail));
    view.addEventListener(
        'clipend', ({detail}) => this.dispatchEvent(new CustomEvent('clipend', {detail})));
    view.addEventListener('text', ({detail: {node}}) => {
      const {pattern, name, mark} = view.nodes[node];
      const {language, title, text} = this.#wordsOf(node);
      if (!this.#ask('text', {pattern, node: name, language, title, text})) return;
      this.#fillLabel({language, name: title || mark, text});
      this.#fold(false, true);
      this.#$('heard').hidden = true;
      this.#noted = true;
    });
    view.addEventListener('link', ({detail}) => {
      if (!this.#ask('link', detail)) return;
      this.#$('leave-address').textContent = this.#$('leave-open').href = detail.address;
      if (!this.#$('leave').open) this.#$('leave').showModal();
    });
  }

  /**
   * Those of what plays at once stand below each other.
   * @param {Caption} caption
   */
  #caption({node, text, language}) {
    this.#cues.delete(node);
    if (text) this.#cues.set(node, text);
    Object.assign(this.#$('cue'), {
      textContent: this.#view.status.captions ? [...this.#cues.values()].join('\n') : '',
      lang: language,
      dir: 'auto'
    });
  }

  /** Pressed states: a tap on what plays a sound turns it on. */
  #showSwitches() {
    const {sound, paused, captions} = this.#view.status;
    for (const [id, on] of Object.entries({sound, pause: paused, captions}))
      this.#$(id).setAttribute('aria-pressed', String(on));
    this.#$('volume').hidden = !sound;
  }

  /**
   * Whether the page leaves it to the viewer.
   * @param {string} type
   * @param {unknown} detail
   */
  #ask(type, detail) {
    return this.dispatchEvent(new CustomEvent(type, {detail, cancelable: true}));
  }

  get #marks() { return /** @type {HTMLElement[]} */ ([...this.#$('marks').children]); }

  /** A button for each label on the screen, in the order of the bundle. */
  #showMarks() {
    const buttons = new Map(this.#marks.map((button) => [Number(button.dataset.node), button]));
    for (const {node, x, y, covered} of this.#view?.labels() ?? []) {
      const button = buttons.get(node) ?? this.#addMark(node);
      buttons.delete(node);
      button.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
      button.toggleAttribute('data-covered', covered);
    }
    for (const button of buttons.values()) button.remove();
    this.#clearMarks();
    if (this.#view) this.#showSwitches();
  }

  /** @param {number} node */
  #addMark(node) {
    const {mark} = this.#view.nodes[node];
    const {title, language} = this.#wordsOf(node);
    const button =
        Object.assign(document.createElement('button'), {type: 'button', textContent: mark});
    button.dataset.node = `${node}`;
    if (title) {
      Object.assign(button, {title, lang: language});
      button.setAttribute('aria-label', `${mark}: ${title}`);
    }
    button.addEventListener('click', () => this.#view.tapNode(node));
    const after = this.#marks.find((other) => Number(other.dataset.node) > node);
    this.#$('marks').insertBefore(button, after ?? null);
    return button;
  }

  /** @param {Frame} frame */
  #onFrame(frame) {
    if (!this.#camera.stream) return;
    if (this.#state !== 'seen' && frame.reason === 'visible') performance.mark('modar: tracked');
    try {
      this.#view.draw(frame, {mirror: this.#camera.mirrored});
    } catch (error) {
      this.fail(error);
      return;
    }
    this.#camera.copied(frame.copyMs);
    if (frame.foundFocal)
      this.#camera.keepFocal(frame.foundFocal, Math.max(frame.camera.width, frame.camera.height));
    this.#tellSeen();
    this.dispatchEvent(new CustomEvent('frame', {detail: frame}));
  }

  #tellSeen() {
    const {state, hint, pattern} = this.#view.status;
    if (state === 'seen' && this.#state !== state) performance.mark('modar: seen');
    this.#setState(state);
    const far = hint === 'far' ? ` ${this.#say(hint)}` : '';
    if (state === 'looking')
      setText(this.#$('reason'), hint === 'look' || far ? this.#lookWords + far : this.#say(hint));
    if (pattern !== this.#shown) this.#showScene(pattern);
  }

  // ---- gestures and keys ----

  /** @param {0 | 1 | 2 | 3 | 4 | 5 | 6} button */
  #presses(button, steps = 1) {
    return () => {
      this.#view.press(button, steps);
      this.#showSwitches();
      if (button === 6) this.#caption({node: -1, language: this.#$('cue').lang});
    };
  }

  /** @type {Record<string, () => void>} */
  #keys = {
    ArrowLeft: this.#presses(0, -1),
    ArrowRight: this.#presses(0),
    ArrowUp: this.#presses(2),
    ArrowDown: this.#presses(2, -1),
    PageUp: this.#presses(1),
    PageDown: this.#presses(1, -1),
    '+': this.#presses(2),
    '-': this.#presses(2, -1),
    0: this.#presses(3),
    Escape: () => this.stop(),
  };

  /** @param {HTMLCanvasElement} canvas */
  #listenToGestures(canvas) {
    const kinds = ['pointerdown', 'pointermove', 'pointerup', 'pointercancel'];
    for (const [kind, type] of kinds.entries()) {
      canvas.addEventListener(type, (event) => {
        const {pointerId, clientX, clientY} = /** @type {PointerEvent} */ (event);
        if (kind === 0) canvas.setPointerCapture(pointerId);
        const {left, top} = canvas.getBoundingClientRect();
        const [x, y] = [clientX - left, clientY - top];
        if (!this.#view?.touch(/** @type {0 | 1 | 2 | 3} */ (kind), pointerId, x, y)) return;
        this.#view.tap(x, y);
        if (this.#noted) this.#showLabel(this.#shown);  // the pattern's again
      });
    }
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.#view?.press(2, -event.deltaY / 50);
    }, {passive: false});
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (['button', 'select', 'a', 'input', 'summary'].includes(
            /** @type {Element} */ (event.target).localName) &&
        event.key !== 'Escape')
      return;
    if (event.ctrlKey || event.metaKey || event.altKey || !this.#keys[event.key]) return;
    event.preventDefault();
    this.#keys[event.key]();
  }

  #listen() {
    const keys = this.#keys;
    const clicks = {
      start: () => this.start(),
      look: () => this.look(),
      close: () => this.stop(),
      flip: () => this.#flip(),
      torch: () => this.#toggleTorch(),
      cameras: () => this.#showCameras(),
      'choose-close': () => this.#$('choose').close(),
      copy: () => this.#copyAddress(),
      'problem-close': () => this.#$('problem').close(),
      'leave-open': () => this.#$('leave').close(),
      'leave-close': () => this.#$('leave').close(),
      // Sound comes by a visitor's own click or tap only, and what plays can be paused.
      sound: this.#presses(4),
      pause: this.#presses(5),
      captions: this.#presses(6),
      'label-close': () => {
        this.#fold(true, true);
        this.#$('label-open').focus();
      },
      'label-open': () => {
        this.#fold(false, true);
        this.#$('label-close').focus();
      },
      full: () =>
          (this.#root.fullscreenElement ? document.exitFullscreen() :
                                          this.#$('screen').requestFullscreen()),
      // The same as keys and gestures, for those who do not drag, pinch or type.
      'turn-left': keys.ArrowLeft,
      'turn-right': keys.ArrowRight,
      larger: keys['+'],
      smaller: keys['-'],
      higher: keys.PageUp,
      lower: keys.PageDown,
      reset: keys[0],
      again: () => {
        this.#$('problem').close();
        this.stop();
        this.#again();
      },
      'look-instead': () => {
        this.#$('problem').close();
        this.look();
      },
    };
    for (const [id, action] of Object.entries(clicks))
      this.#$(id).addEventListener('click', action);
    this.#$('volume').addEventListener('input', () => {
      this.#view.volume = this.#$('volume').valueAsNumber;
    });
    this.#$('scene').addEventListener('change', () => {
      const pattern = Number(this.#$('scene').value);
      this.#showScene(pattern);
      this.#turnScene(pattern);
    });
    this.#$('problem').addEventListener('close', () => {
      delete this.#$('problem').dataset.kind;
      if (this.#state === 'error') this.#setState('start');
    });
    this.#$('stage').addEventListener('keydown', (event) => this.#onKey(event));
    // A phone's gesture or button of going back.
    this.#$('stage').addEventListener('close', () => {
      if (!this.#$('stage').open && !['start', 'error'].includes(this.#state)) this.stop();
    });
    this.#listenToGestures(this.#$('models'));
  }
}

if (globalThis.customElements && !customElements.get('modar-viewer'))
  customElements.define('modar-viewer', ModarViewer);
