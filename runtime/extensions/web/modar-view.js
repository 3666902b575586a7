// @ts-check
// Draws what modar.js sees: the frame in one canvas, the bundle's models over it in another. Both
// change in the same task, so picture and models never part.
import {RawArrival, STAGE} from './arrival.js';
import {Source, within} from './download.js';
import {Engine, ENGINE_S, engineFailed, hasSimd, ModarError, POSE, POSE_FLOATS} from './engine.js';
import {drawFrame, fitCanvases} from './modar.js';

/**
 * Frames between looks at the room's light, and how wide the copy is that is looked at: reading a
 * picture back is slow.
 */
const LIGHT_EVERY = 4;
/**
 * Drawings between looks at whether a label is covered: one label a look, since that reads a
 * model's triangles.
 */
const COVER_EVERY = 6;
/**
 * Of a bundle that is larger, a view has this many bytes on the GPU at once: what phones with
 * little memory give a page. Not measured.
 */
const MOST_BYTES = 64 << 20;
/** Milliseconds without a frame after which what turns by itself is drawn without one. */
const STILL_MS = 60;
const LIGHT_WIDTH = 160;
/**
 * Milliseconds that finer models take to replace coarser ones, and how much of a pose may change
 * meanwhile, some pixels: more shows two models side by side. Where a picture's share of it is
 * exceeded, at FADE_FRAMES in that time, none begins. Not measured.
 */
const FADE_MS = 250, FADE_MOVED = 0.03, FADE_FRAMES = 8;

/**
 * @typedef {import('./modar.js').Frame} Frame
 * @typedef {import('./modar-view.js').Gesture} Gesture
 * @typedef {import('./engine.js').Happened} Happened
 * @typedef {import('./arrival.js').AnyArrival} AnyArrival
 * @typedef {Parameters<typeof import('./modar-view.js').View.create>} Given
 * @typedef {import('./media.js').Media} Media
 *
 * A picture over the models. triangles: of what it shows; fades: once something else was drawn.
 * @typedef {{copy: HTMLCanvasElement, poses: Float32Array, triangles?: number, fades?: Animation}}
 *     Faded
 */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {boolean} webgl1
 */
function openContext(canvas, webgl1) {
  const attributes =
      {alpha: true, premultipliedAlpha: true, depth: true, stencil: false, antialias: true};
  const context2 = webgl1 ? null : canvas.getContext('webgl2', attributes);
  const context = /** @type {WebGLRenderingContext | null} */ (
      context2 ?? canvas.getContext('webgl', attributes));
  if (!context) {
    throw new ModarError({
      code: 'web.webgl',
      cause: 'this browser draws no WebGL',
      cure: 'switch on hardware acceleration in its settings, or use another browser',
    });
  }
  return {context, version: /** @type {1 | 2} */ (context2 ? 2 : 1)};
}

/**
 * The build of the engine that this browser runs. Not for workers, which bundlers do not split.
 * @param {boolean} simd
 */
async function openEngine(simd) {
  const vectors = simd && hasSimd();
  const opened = async () => {
    const {default: load} =
        await (vectors ? import('./engine-simd.js') : import('./engine-plain.js'))
            .catch(engineFailed);
    return Engine.of(load, vectors ? 'simd' : 'plain');
  };
  return within(
      ENGINE_S, opened(), () => engineFailed({message: `nothing came for ${ENGINE_S} seconds`}));
}

/**
 * Where a bundle's scenes act: `text` {node}: a label's words are to be shown; `link` {address}:
 * the visitor is to be asked; `caption` {node, text, language}: words that are heard now; `drawn`:
 * labels() has changed. `refined`: of a packed bundle more can be drawn than before.
 */
export class View extends EventTarget {
  #engine = /** @type {Engine} */ (/** @type {unknown} */ (null));
  #picture = /** @type {HTMLCanvasElement} */ (/** @type {unknown} */ (null));
  #models = /** @type {HTMLCanvasElement} */ (/** @type {unknown} */ (null));
  #gl = /** @type {ReturnType<typeof openContext>} */ (/** @type {unknown} */ (null));
  #lost = false;
  /** Until there is something to draw. */
  #empty = true;
  /** Of a packed bundle: something of every model is there, and drawn; all of it is. */
  shown = Promise.resolve();
  whole = Promise.resolve();
  #complete = false;
  /** What showCoarse() shows is there. */
  #coarse = false;
  /** Of contexts, and what waits for a new one. */
  #losses = 0;
  #restored = Promise.resolve();
  /** @type {(value?: undefined) => void} */
  #tellRestored = () => {};
  /**
   * The download of all of it.
   * @type {AnyArrival | null}
   */
  #arrival = null;
  /**
   * The loader of levels when they are seen (lod-stream.js), of a bundle that is larger than
   * #maxBytes.
   * @type {import('./lod-stream.js').LodStream | null}
   */
  #wanted = null;
  #maxBytes = 0;
  #fixedLight = false;
  /** @type {CanvasRenderingContext2D | null} */
  #small = null;
  #framesSinceLook = LIGHT_EVERY;
  #redraw = () => {};
  #mirror = false;
  /** The pattern that is looked at without a camera; -1: none. */
  #around = -1;
  /** Of media.js, which is loaded where a bundle has videos or sounds. */
  #playing = /** @type {(string | undefined)[]} */ ([]);
  #media = /** @type {Media} */ (/** @type {unknown} */ ({
    sound: false,
    held: false,
    ended: [],
    captionsOf: () => null,
    prepare() {},
    pause() {},
    upload() {},
    close() {},
    forget() {}
  }));
  /** @type {Happened[]} */
  #taps = [];
  #drawnAt = 0;
  #handle = 0;
  /** @type {Map<number, boolean>} */
  #covered = new Map();
  #drawings = 0;
  /** Poses of the last drawing. */
  #before = /** @type {Float32Array} */ (/** @type {unknown} */ ([]));
  #still = true;
  /** @type {Faded | null} */
  #faded = null;

  /**
   * @param {Given[0]} bundle which may still be on its way
   * @param {Given[1]} options picture, models: laid over each other by the page;
   *     fixedLight: the models' light does not follow the camera's picture
   */
  static async create(
      bundle,
      {picture, models, simd = true, webgl1 = false, fixedLight = false, maxBytes = MOST_BYTES}) {
    const view = new View();
    view.#maxBytes = maxBytes;
    view.#fixedLight = fixedLight;
    view.#picture = picture;
    view.#models = models;
    view.#gl = openContext(models, webgl1);
    view.#engine = await openEngine(simd);
    view.#engine.useContext(view.#gl.context, view.#gl.version);
    const given = /** @type {{arrival?: AnyArrival}} */ (/** @type {unknown} */ (await bundle));
    /** @type {AnyArrival} */
    const arrival = given.arrival ?? new RawArrival(new Source(given));
    if (!given.arrival) await arrival.begin(new Uint8Array());
    view.#engine.arrive(arrival.size, arrival.found.splice(0));
    if (view.#plays) {
      const {Media} = await import('./media.js');
      view.#media = new Media(
          view.#engine, () => view.#soon(),
          (node, text, language) => view.#tell('caption', {node, text, language}));
    }
    models.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();  // without this it is never restored
      view.#lose();
    });
    models.addEventListener('webglcontextrestored', () => view.#restore(webgl1));
    view.shown = view.#bringCoarse(arrival);
    view.whole = view.shown.then(() => view.#refine(arrival));
    view.whole.catch(() => {});  // told to those who wait for it
    if (arrival.inOrder) await view.whole;
    return view;
  }

  /**
   * Of a packed bundle the coarsest of everything.
   * @param {AnyArrival} arrival
   */
  async #bringCoarse(arrival) {
    if (arrival.inOrder) return;
    await arrival.download(STAGE.show, (offset, bytes) => this.#engine.put(offset, bytes));
    this.#showCoarse();
    performance.mark('modar: coarse');
    this.#tellRefined();
  }

  /** @param {AnyArrival} arrival */
  async #refine(arrival) {
    if (arrival.size <= this.#maxBytes || this.#maxBytes === 0 || !await this.#bringWanted(arrival))
      await this.#bringRest(arrival);
  }

  /**
   * Visible levels are loaded on demand.
   * @param {AnyArrival} arrival
   * @returns false: this host or browser gives all or nothing
   */
  async #bringWanted(arrival) {
    const {LodStream} = await import('./lod-stream.js');
    const wanted = new LodStream(
        this.#engine, arrival.parts(), () => this.#soon(), (error) => this.#tell('error', error));
    if (!await wanted.begin()) return false;
    await this.#restored;
    this.#cover();
    try {
      wanted.show(this.#maxBytes, this.#fixedLight);
    } catch (error) {
      if (!this.#gl.context.isContextLost()) return false;  // #bringRest() tells why
      this.#lose();
    }
    this.#wanted = wanted;
    this.#told();
    return true;
  }

  /**
   * Cross-fade: overlays a snapshot of the current frame and fades it out. triangles: of the
   * present drawing; without, it is drawn again
   * @param {number} [triangles]
   */
  #cover(triangles) {
    if (this.#faded || this.#empty || this.#lost || !this.#drawnAt) return;
    const models = this.#models;
    const {width, height, className, offsetLeft, offsetTop, clientWidth, clientHeight} = models;
    const copy = Object.assign(document.createElement('canvas'), {width, height, className});
    copy.style.cssText = `position:absolute;left:${offsetLeft}px;top:${offsetTop}px;width:${
        clientWidth}px;height:${clientHeight}px;pointer-events:none`;
    if (!triangles) this.#redraw();
    /** @type {CanvasRenderingContext2D} */ (copy.getContext('2d')).drawImage(models, 0, 0);
    models.after(copy);
    this.#faded = {copy, poses: this.#before, triangles};
  }

  /** @param {Faded} faded */
  #uncover(faded) {
    faded.copy.width = 0;  // its memory is free at once
    faded.copy.remove();
    if (this.#faded === faded) this.#faded = null;
    this.#soon();
  }

  #showCoarse() {
    this.#coarse = true;
    if (!this.#lost)  // else #restore() will
      this.#inContext(() => this.#engine.showCoarse(this.#fixedLight));
    this.#empty = this.#lost;
  }

  /**
   * False: the context is lost, of which its event may not have told yet.
   * @param {() => void} use
   */
  #inContext(use) {
    try {
      use();
      return true;
    } catch (error) {
      if (!this.#gl.context.isContextLost()) throw error;
      this.#lose();
      return false;
    }
  }

  /**
   * Drawn data goes to the GPU, as often as that forgets it meanwhile.
   * @param {AnyArrival} arrival
   */
  async #bringRest(arrival) {
    for (;;) {
      await this.#restored;
      const run = this.#losses;
      if (!this.#inContext(() => this.#engine.beginRest(arrival.inOrder))) continue;
      await arrival.download(STAGE.refine, (offset, bytes) => this.#engine.pass(offset, bytes));
      this.#cover();
      if (run === this.#losses && this.#inContext(() => this.#engine.showAll(this.#fixedLight)))
        break;
      arrival = await arrival.again();
    }
    this.#arrival = arrival;
    this.#told();
  }

  #told() {
    this.#empty = this.#lost;
    this.#coarse = true;  // it is there
    this.#media.forget();
    if (!this.#complete) this.#media.prepare();
    this.#complete = true;
    performance.mark('modar: whole');
    this.#tellRefined();
  }

  #tellRefined() {
    this.dispatchEvent(new Event('refined'));
    this.#soon();
  }

  /** The bundle has videos or sounds. */
  get #plays() { return this.nodes.some(({kind}) => kind === 'video' || kind === 'sound'); }

  /** Of the bundle, until the next call: what has come of it. */
  get bytes() { return this.#engine.bytes; }

  /** Those of the bundle, then those of stand(): {name, widthMm}. */
  get patterns() { return this.#engine.patterns; }

  /**
   * The content of patterns by name: {name, pattern, kind: 'model' | 'picture' | 'label' |
   * 'video' | 'sound', mark}.
   */
  get nodes() { return this.#engine.nodes; }

  /** Movements of models: {name, seconds}. */
  get clips() { return this.#engine.clips; }

  /**
   * Models that have a clip of this name play it from its beginning. blend: seconds in which they
   * turn from their present poses.
   * @param {string} name
   * @param {{loop?: boolean, blend?: number}} options
   */
  play(name, {loop = true, blend = 0.3} = {}) {
    this.#engine.play(name, loop, blend);
    this.#playing = this.#engine.playing;
    this.#soon();
  }

  /** All models stay in their present poses. */
  stop() {
    this.#engine.stop();
    this.#playing = [];
  }

  /**
   * A node's words in the first of these languages that it has, else in any: {language, title,
   * text, alt}.
   * @param {number} node
   * @param {string[]} languages
   */
  wordsOf(node, languages = []) {
    for (const language of [...languages, ...this.#engine.languages]) {
      const words = this.#engine.wordsOf(node, language);
      if (words.title || words.text || words.alt) return {language, ...words};
    }
    return {language: '', title: '', text: '', alt: ''};
  }

  /**
   * The visitor tapped the canvas there, in CSS pixels from its top left: answers the node, or
   * null.
   * @param {number} x
   * @param {number} y
   */
  tap(x, y) {
    if (this.nodes.length === 0) return null;
    const {width, height, clientWidth} = this.#models;
    const scale = width / clientWidth;
    const found = this.#engine.pick(width, height, this.#mirror, x * scale, y * scale);
    if (found) this.#tapped(found);
    return found?.node ?? null;
  }

  /**
   * The visitor tapped a node: a label's button.
   * @param {number} node
   */
  tapNode(node) { this.#tapped({node, material: 0}); }

  /**
   * @see modar-view.d.ts
   * @param {0 | 1 | 2 | 3} kind
   * @param {number} finger
   * @param {number} x
   * @param {number} y
   */
  touch(kind, finger, x, y) {
    const {clientWidth, clientHeight} = this.#models;
    const done = this.#engine.touch(kind, finger, x, y, clientWidth, clientHeight);
    if (done === 1) this.turned();
    return done === 2;
  }

  /**
   * @see modar-view.d.ts
   * @param {0 | 1 | 2 | 3 | 4 | 5 | 6} button
   */
  press(button, steps = 1) {
    this.#engine.press(button, steps);
    this.#tune();
    if (button < 4) this.turned();
  }

  get status() { return this.#engine.status; }

  #tune() {
    const {sound, paused} = this.status;
    if (this.#media.sound !== sound) this.#media.sound = sound;
    if (this.#media.held !== paused) this.#media.held = paused;
  }

  /**
   * @see modar-view.d.ts
   * @param {number} pattern
   */
  lookAround(pattern, presents = true) {
    this.forgetActs();
    this.#engine.lookAround(pattern, performance.now() / 1000, presents);
    this.#around = pattern;
    this.#mirror = false;
    this.turned();
  }

  /** Without a camera, the view is drawn anew; a camera's next frame shows it anyway. */
  turned() {
    if (this.#around >= 0) this.#again();
  }

  /** @see modar-view.d.ts */
  get eye() {
    const at = this.#around * POSE_FLOATS + POSE.view;
    const {clientWidth, width} = this.#models;
    return {
      view: this.#engine.poses().slice(at, at + 16),
      focal: (this.#engine.focal * clientWidth) / width
    };
  }

  /** Actions begin anew, as if nothing had been found; videos and sounds stop. */
  forgetActs() {
    this.#taps = [];
    this.#around = -1;
    cancelAnimationFrame(this.#handle);
    this.#handle = 0;
    this.#engine.forgetActs();
    this.#playing = [];
    this.#media.close();
  }

  /**
   * For captions of what plays from now on.
   * @param {string[]} languages
   */
  set languages(languages) { this.#media.languages = languages; }

  /**
   * Of a video or sound: {language, captions (a WebVTT file), transcript}, or null.
   * @param {number} node
   */
  captionsOf(node) { return this.#media.captionsOf(node); }

  /**
   * 0 to 1.
   * @param {number} volume
   */
  set volume(volume) { this.#media.volume = volume; }

  /**
   * The sound of videos and sounds, for a film; null where the bundle has none. Asked for in a
   * click's handler.
   */
  get film() { return this.#plays ? this.#media.film : null; }

  /** The labels that are on the screen: [{node, x, y, covered}], CSS pixels of the canvas. */
  labels() {
    const {width, height, clientWidth} = this.#models;
    const scale = clientWidth / width;
    const all = this.nodes.map(({kind}, node) => (kind === 'label' ? node : -1))
                    .filter((node) => node >= 0);
    const looked =
        this.#drawings % COVER_EVERY === 0 ? all[(this.#drawings / COVER_EVERY) % all.length] : -1;
    return all.flatMap((node) => {
      const place = this.#engine.label(node, width, height, this.#mirror, node === looked);
      if (!place) return [];
      if (node === looked) this.#covered.set(node, place.covered);
      return [
        {node, x: place.x * scale, y: place.y * scale, covered: this.#covered.get(node) ?? false}
      ];
    });
  }

  /** @param {Happened} tap */
  #tapped(tap) {
    this.#taps.push(tap);
    this.#soon();
  }

  /** Without a frame of a camera, changes are drawn soon. */
  #soon() { this.#handle ||= requestAnimationFrame(() => this.#goOn(true)); }

  /**
   * Acts and repeats the last drawing.
   * @param {boolean} same its poses are the last ones: nothing says whether the eye moves
   */
  #again(same = false) {
    if (this.#around >= 0) {
      const {width, height} = fitCanvases(this.#models, this.#picture);
      if (this.#lost || this.#empty) return;
      this.#engine.orbit(this.#around, width, height, performance.now() / 1000);
      this.#redraw = () => this.#engine.draw(width, height);
    }
    const poses = this.#engine.poses().slice();
    /** @type {(since: Float32Array, most: number) => boolean} */
    const moved = (since, most) =>
        since.some((value, i) => i % POSE_FLOATS >= POSE.view && Math.abs(value - poses[i]) > most);
    if (!same) this.#still = !moved(this.#before, FADE_MOVED / FADE_FRAMES);
    this.#before = poses;
    this.#act();
    this.#redraw();
    const {triangles} = this.#engine;
    const faded = this.#faded;
    if (faded && (faded.triangles === triangles || moved(faded.poses, FADE_MOVED))) {
      this.#uncover(faded);
    } else if (faded && !faded.fades) {
      faded.fades = faded.copy.animate({opacity: [1, 0]}, FADE_MS);
      faded.fades.onfinish = () => this.#uncover(faded);
    }
    if (this.#wanted?.came && !this.#faded) {
      if (this.#still) this.#cover(triangles);
      this.#wanted.use();
      this.#tellRefined();
    }
    this.#wanted?.ask();
    this.#drawn();
  }

  #act() {
    const still = this.nodes.length + this.clips.length === 0;
    if (still || (this.#plays && !this.#complete)) return;  // what plays has to be there
    /** @type {Happened[]} */
    const happened = [
      ...this.#media.ended.splice(0).map((node) => ({node, ended: true})), ...this.#taps.splice(0)
    ];
    for (const event of happened.length ? happened : [null]) {
      const all = this.#engine.act(performance.now() / 1000, event);
      this.#tune();
      for (const todo of all) {
        if ('play' in todo) this.#media.play(todo.play);
        else if ('pause' in todo) this.#media.pause(todo.pause);
        else if ('link' in todo) this.#tell('link', {address: todo.link});
        else this.#tell('text', {node: todo.text});
      }
    }
    const {playing} = this.#engine;
    for (const [scene, name] of this.#playing.entries())
      if (name && !playing[scene]) this.#tell('clipend', {name, scene});
    this.#playing = playing;
    if (!this.#lost) this.#media.upload(this.#gl.context);
  }

  /**
   * @param {string} type
   * @param {unknown} detail
   */
  #tell(type, detail) { this.dispatchEvent(new CustomEvent(type, {detail})); }

  #drawn() {
    this.#drawnAt = performance.now();
    ++this.#drawings;
    this.dispatchEvent(new Event('drawn'));
    if (this.#engine.acting) this.#handle ||= requestAnimationFrame(() => this.#goOn());
  }

  /**
   * Frames of a camera come by themselves; without them, what turns, plays or was tapped is drawn
   * anyway.
   */
  #goOn(fresh = false) {
    this.#handle = 0;
    if (this.#around >= 0 || performance.now() - this.#drawnAt > STILL_MS)
      this.#again(this.#around < 0);
    else if (fresh || this.#taps.length || this.#engine.acting)
      this.#handle = requestAnimationFrame(() => this.#goOn(fresh));
  }

  /** @param {boolean} webgl1 */
  #restore(webgl1) {
    this.#gl = openContext(this.#models, webgl1);
    const {context, version} = this.#gl;
    try {
      this.#engine.useContext(context, version);
      if (this.#wanted) {
        this.#wanted.show(this.#maxBytes, this.#fixedLight);
      } else if (this.#coarse) {
        this.#engine.showCoarse(this.#fixedLight);
      }
    } catch (error) {
      if (context.isContextLost()) return;  // again: the next one will do
      throw error;
    }
    this.#lost = false;
    this.#empty = !this.#coarse;
    this.#media.forget();
    this.#tellRestored();
    if (!this.#arrival) return;  // #bringRest() sees it
    const arrival = this.#arrival;
    this.#arrival = null;
    arrival.again()
        .then((again) => this.#bringRest(again))
        .catch((error) => this.#tell('error', error));
  }

  #lose() {
    if (!this.#lost)
      this.#restored = new Promise((resolve) => {
        this.#tellRestored = resolve;
      });
    this.#lost = true;
    ++this.#losses;
  }

  /**
   * The picture alone, of a frame that nothing is known of.
   * @param {Frame['source']} source
   * @param {Gesture} gesture
   */
  show(source, gesture) {
    const {displayWidth, displayHeight, width, height} =
        /** @type {VideoFrame & HTMLCanvasElement} */ (source);
    const camera = /** @type {Frame['camera']} */ (
        {width: displayWidth ?? width, height: displayHeight ?? height});
    drawFrame(this.#picture, {source, camera}, gesture);
  }

  /**
   * frame: the detail of modar.js's event. gesture: {mirror}.
   * @param {Frame} frame
   * @param {Gesture} gesture
   */
  draw({source, camera, poses, reason, brightness}, gesture = {}) {
    const {width, height} = fitCanvases(this.#models, this.#picture);
    drawFrame(this.#picture, {source, camera}, gesture);
    if (this.#lost || this.#empty) return;
    this.#engine.setCamera(camera.width, camera.height, camera.focal);
    const known = this.#engine.poses();
    known.fill(0).set(poses.subarray(0, known.length));
    this.#engine.follow(performance.now() / 1000, reason, brightness);
    if (!this.#fixedLight) this.#look(source, camera, poses);
    const mirror = this.#mirror = gesture.mirror ?? false;
    this.#redraw = () => this.#engine.draw(width, height, mirror);
    this.#again();
  }

  /**
   * @see modar-view.d.ts
   * @param {string} name
   * @param {number} scene
   */
  stand(name, scene) { return this.#engine.stand({name}, scene); }

  /**
   * Undoes stand().
   * @param {number} kept
   */
  forgetPatterns(kept) { this.#engine.forgetPatterns(kept); }

  /**
   * The box of a pattern's content, in its space: {low, high}, or null where nothing does.
   * @param {number} pattern
   */
  bounds(pattern) { return this.#engine.bounds(pattern); }

  /**
   * The models of one pattern alone, without a camera's picture, as a camera sees them that stands
   * anywhere. view: pattern space to GL's eye space, column-major. focal: CSS pixels
   * @param {number} pattern
   * @param {Float32Array} view
   * @param {number} focal
   */
  drawFrom(pattern, view, focal) { this.drawEach([[pattern, view]], focal); }

  /**
   * The same of several patterns, each with a view of its own: [[pattern, view]].
   * @param {[number, Float32Array][]} views
   * @param {number} focal
   */
  drawEach(views, focal) {
    const size = fitCanvases(this.#models, this.#picture);
    this.#redraw = () => this.drawEach(views, focal);  // shown parts may have come meanwhile
    if (this.#lost || this.#empty) return;
    this.#engine.setCamera(
        size.width, size.height, (focal * size.width) / this.#models.clientWidth);
    const poses = this.#engine.poses().fill(0);
    for (const [pattern, view] of views) {
      poses[pattern * POSE_FLOATS + POSE.shown] = 1;
      poses.set(view, pattern * POSE_FLOATS + POSE.view);
    }
    this.#mirror = false;
    this.#redraw = () => this.#engine.draw(size.width, size.height);
    this.#again();
  }

  /**
   * As often as the player does, so that both show the same.
   * @param {Frame['source']} source
   * @param {Frame['camera']} camera
   * @param {Float32Array} poses
   */
  #look(source, camera, poses) {
    ++this.#framesSinceLook;
    const shown = poses.some((value, i) => i % POSE_FLOATS === POSE.shown && value !== 0);
    if (!shown || this.#framesSinceLook < LIGHT_EVERY) return;
    this.#framesSinceLook = 0;
    const [width, height] =
        [LIGHT_WIDTH, Math.max(1, Math.round((LIGHT_WIDTH * camera.height) / camera.width))];
    this.#small ??=
        /** @type {CanvasRenderingContext2D} */ (document.createElement('canvas').getContext(
            '2d', {willReadFrequently: true, alpha: false}));
    if (this.#small.canvas.height !== height) Object.assign(this.#small.canvas, {width, height});
    this.#small.drawImage(/** @type {HTMLCanvasElement} */ (source), 0, 0, width, height);
    this.#engine.look(this.#small.getImageData(0, 0, width, height));
  }

  /**
   * Both canvases in one picture. A browser empties the models' once it has shown them: they are
   * drawn again.
   */
  async photograph(type = 'image/jpeg') {
    const photo = document.createElement('canvas');
    Object.assign(photo, {width: this.#picture.width, height: this.#picture.height});
    const context =
        /** @type {CanvasRenderingContext2D} */ (photo.getContext('2d', {alpha: false}));
    context.drawImage(this.#picture, 0, 0);
    if (!this.#lost) this.#redraw();
    context.drawImage(this.#models, 0, 0);
    return new Promise((resolve) => {
      photo.toBlob(resolve, type, 0.92);
    });
  }

  get webgl() { return this.#gl.version; }

  get heapBytes() { return this.#engine.heapBytes; }

  get gpuBytes() { return this.#engine.gpuBytes; }

  get triangles() { return this.#engine.triangles; }
}
