// @ts-check
// The engine (engine.cpp) as an object: WebAssembly with vectors of 128 bits where the browser has
// them, without elsewhere.

/**
 * What emscripten makes of engine.cpp.
 * @typedef {Record<`_web_${string}`, (...numbers: number[]) => number> & {
 *   HEAPU8: Uint8Array,
 *   UTF8ToString: (address: number) => string,
 *   GL: {
 *     textures: WebGLTexture[],
 *     registerContext: (context: WebGLRenderingContext, attributes: object) => number,
 *     makeContextCurrent: (handle: number) => void,
 *   },
 * }} Module
 *
 * @typedef {import('./modar.js').Modar['kind']} Kind of build
 * @typedef {{code: string, where?: string, cause: string, cure?: string}} Plain error
 * @typedef {{name: string, widthMm?: number}} Pattern
 * @typedef {import('./modar-view.js').SceneNode & {loops: boolean}} Node
 * @typedef {{node: number, material?: number, ended?: boolean}} Happened
 * @typedef {{play: number} | {pause: number} | {text: number} | {link: string}} Todo
 */

/** A module of one function that answers a v128: browsers without SIMD refuse it. */
const NEEDS_SIMD = Uint8Array.of(
    0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 8, 1, 6, 0, 65, 0, 253, 15,
    11);

/** As modar.h numbers them. */
const STATES = /** @type {const} */ (['start', 'looking', 'seen', 'around']);
const HINTS = /** @type {const} */ (
    ['look', 'far', 'dark', 'blurred', 'outside', 'hold', 'bright', 'whole', 'flat']);

/** Numbers in a pose of Engine.poses(), and where its parts begin; see modar/pose_floats.hpp. */
export const POSE_FLOATS = 45;
export const POSE = {
  visible: 0,
  shown: 1,
  inliers: 2,
  fit: 3,
  rotation: 4,
  translation: 13,
  corners: 16,
  view: 24,
  extended: 40,
  agreeing: 41,
  likeness: 42,
  positionSigma: 43,
  rotationSigma: 44,
};

/**
 * Frames are tracked with a longer side from this to twice it, pixels: features are found there
 * as well as in larger ones, for a fraction of the time. The display keeps the camera's size.
 */
const TRACKED_SIDE = 640;

/**
 * By how much the sides of a frame are divided before it is tracked.
 * @param {number} width
 * @param {number} height
 */
export const shrinkOf = (width, height) =>
    Math.max(1, Math.floor(Math.max(width, height) / TRACKED_SIDE));

/**
 * Frees the memory of arrays that nothing needs any more, which have no bytes then: by
 * themselves, browsers let some 64 MB of such pile up. Messages to a port are freed when the
 * port is closed; of a closed one Chromium takes nothing, and transfer() frees nothing that came
 * from a network.
 * @param {Uint8Array[]} arrays
 */
export function release(...arrays) {
  const {port1, port2} = new MessageChannel();
  port1.postMessage(0, arrays.map(({buffer}) => buffer));
  port1.close();
  port2.close();
}

/** What went wrong: `code` is stable, `cure` says what to do. */
export class ModarError extends Error {
  /** @param {Plain} error */
  constructor({code, where = '', cause, cure = ''}) {
    super(`${where ? `${where}: ` : ''}${cause}${cure ? `; ${cure}` : ''} [${code}]`);
    this.name = 'ModarError';
    this.code = code;
    this.where = where;
    this.reason = cause;
    this.cure = cure;
  }

  /** For postMessage(), which drops what a subclass of Error adds. */
  plain() { return {code: this.code, where: this.where, cause: this.reason, cure: this.cure}; }
}

export function hasSimd() {
  if (typeof WebAssembly !== 'object') {
    throw new ModarError(
        {code: 'web.wasm', cause: 'this browser has no WebAssembly', cure: 'update the browser'});
  }
  return WebAssembly.validate(NEEDS_SIMD);
}

/**
 * Vite's server before version 8 copies modules into a folder that has no other file of this
 * package.
 */
const STRANDED = new URL('./engine-simd.wasm', import.meta.url).pathname.includes('/.vite/deps/');

/**
 * Where that server has a file of this package; null in any other place, where bundlers see the
 * addresses that modules name.
 * @param {string} name
 */
export function strandedFile(name) {
  return STRANDED ? import.meta.url.replace(/\/\.vite\/deps\/.*$/, `/modar/${name}`) : null;
}

/** Seconds in which the engine has to be loaded. */
export const ENGINE_S = 60;

/**
 * Throws what kept an engine from being loaded.
 * @param {{message?: string}} error
 * @returns {never}
 */
export function engineFailed({message = ''}) {
  const cause = `the engine did not load: ${message}`;
  if (/unsafe-eval|content.security/i.test(message)) {
    throw new ModarError({
      code: 'web.policy',
      cause,
      cure: 'the site\'s Content-Security-Policy has to allow script-src \'wasm-unsafe-eval\''
    });
  }
  if (/memory/i.test(message))
    throw new ModarError({code: 'web.memory', cause, cure: 'close other pages'});
  throw new ModarError({code: 'web.download', cause, cure: 'check the network and try again'});
}

export class Engine {
  #module;
  /** Its place in the heap. */
  #bundle = {at: 0, size: 0};
  /** @type {Pattern[]} */
  patterns = [];
  /** @type {string[]} */
  languages = [];
  /** @type {Node[]} */
  nodes = [];
  /** @type {import('./modar.js').Scene[]} */
  scenes = [];
  /** @type {{name: string, seconds: number}[]} */
  clips = [];
  width = 0;
  height = 0;

  /**
   * @param {Module} module
   * @param {Kind} kind
   */
  constructor(module, kind) {
    this.#module = module;
    this.kind = kind;
    this.frameAt = 0;
    this.frameBytes = 0;
  }

  /**
   * load: what a build's JavaScript exports.
   * @param {(options: object) => Promise<unknown>} load
   * @param {Kind} kind
   */
  static async of(load, kind) {
    return new Engine(
        /** @type {Module} */ (
            await load(STRANDED ? {locateFile: strandedFile} : {}).catch(engineFailed)),
        kind);
  }

  /** For lod-stream.js: what most pages do not load. */
  get module() { return this.#module; }

  /** @param {number} status */
  check(status) {
    if (status === 0) return;
    const text = (/** @type {number} */ field) =>
        this.#module.UTF8ToString(this.#module._web_error(field));
    throw new ModarError({code: text(0), where: text(1), cause: text(2), cure: text(3)});
  }

  /** @param {number} bytes */
  #reserve(bytes) { return this.#module._web_reserve(bytes) || this.#missing(bytes); }

  /**
   * @param {number} bytes
   * @returns {never}
   */
  #missing(bytes) {
    throw new ModarError({
      code: 'web.memory',
      cause: `this browser gives no ${Math.ceil(bytes / 1e6)} MB of memory`,
      cure: 'close other pages, or bake the bundle smaller (--max-texture, --device)',
    });
  }

  /**
   * Makes room for a bundle of that many bytes, where unwritten pages take no memory, and opens
   * it with the parts written first. The coarsest levels come by put(), the rest by pass().
   * @param {number} size
   * @param {import('./arrival.js').Part[]} pieces
   */
  arrive(size, pieces) {
    this.#bundle = {at: this.#module._web_arrive(size) || this.#missing(size), size};
    for (const {offset, bytes} of pieces) this.put(offset, bytes);
    this.#open();
  }

  /**
   * @param {number} offset
   * @param {Uint8Array} bytes
   */
  put(offset, bytes) { this.#module.HEAPU8.set(bytes, this.#bundle.at + offset); }

  /**
   * Before pass(), in the context that is current. inOrder: bytes come as in a file; else what
   * showCoarse() shows is there.
   * @param {boolean} [inOrder]
   */
  beginRest(inOrder) { this.check(this.#module._web_begin_rest(inOrder ? 1 : 0)); }

  /**
   * Takes bytes that are drawn from to the GPU, and keeps what the engine itself reads; then they
   * are gone.
   * @param {number} offset
   * @param {Uint8Array} bytes
   */
  pass(offset, bytes) {
    const {length} = bytes;
    this.frameBuffer(length).set(bytes);
    release(bytes);
    this.check(this.#module._web_pass(offset, this.frameAt, length));
  }

  /**
   * Draws the coarsest of everything from now on. fixedLight: the models' light does not follow
   * look().
   * @param {boolean} fixedLight
   */
  showCoarse(fixedLight) { this.check(this.#module._web_show_coarse(fixedLight ? 1 : 0)); }

  /**
   * Draws what pass() took from now on, which is verified.
   * @param {boolean} fixedLight
   */
  showAll(fixedLight) { this.check(this.#module._web_show_all(fixedLight ? 1 : 0)); }

  /** The bundle, a view until the heap grows: what pass() took is missing in part. */
  get bytes() {
    return this.#module.HEAPU8.subarray(this.#bundle.at, this.#bundle.at + this.#bundle.size);
  }

  /**
   * Takes the recipe of a packed bundle, for decode().
   * @param {Uint8Array} bytes
   */
  recipe(bytes) {
    const at = this.#reserve(bytes.length);
    this.#module.HEAPU8.set(bytes, at);
    this.check(this.#module._web_recipe(at, bytes.length));
  }

  /**
   * Some of a tracker record's `stored` bytes have come: decode() has less to do.
   * @param {number} index
   * @param {number} stored
   * @param {number} at
   * @param {Uint8Array} bytes
   */
  begin(index, stored, at, bytes) {
    this.frameBuffer(stored).set(bytes, at);
    this.#module._web_begin_piece(index, this.frameAt, at + bytes.length);
  }

  /**
   * The raw bytes of a piece, verified.
   * @param {number} index
   * @param {Uint8Array} stored
   * @param {number} size
   */
  decode(index, stored, size) {
    this.frameBuffer(stored.length).set(stored);
    const at = this.#module._web_piece(index, this.frameAt);
    if (at === 0) this.check(1);
    return this.#module.HEAPU8.slice(at, at + size);
  }

  #open() {
    const m = this.#module;
    this.check(m._web_open());
    this.patterns =
        Array.from({length: m._web_pattern_count()}, (_, i) => ({
                                                       name: m.UTF8ToString(m._web_pattern_name(i)),
                                                       widthMm: m._web_pattern_width_mm(i),
                                                     }));
    for (let i = 0, at; (at = m._web_language(i)) !== 0; ++i)
      this.languages.push(m.UTF8ToString(at));
    this.nodes = Array.from(
        {length: m._web_node_count()},
        (_, i) => ({
          name: this.#nodeText(i, 3),
          pattern: m._web_node(i, 0),
          kind: /** @type {Node['kind']} */ (
              ['model', 'picture', 'label', 'video', 'sound'][m._web_node(i, 1) - 1] ?? ''),
          mark: this.#nodeText(i, 4),
          loops: m._web_node(i, 2) !== 0,
        }));
    this.scenes = Array.from(
        {length: m._web_scene_count()},
        (_, i) => ({
          pattern: m._web_scene(i, 0),
          model: m.UTF8ToString(m._web_model_name(m._web_scene(i, 1))),
        }));
    for (let i = 0, at; (at = m._web_clip_name(i)) !== 0; ++i)
      this.clips.push({name: m.UTF8ToString(at), seconds: m._web_clip_seconds(i)});
  }

  /**
   * Where the engine reads a short text.
   * @param {string} text
   */
  #given(text) {
    const bytes = new TextEncoder().encode(`${text}\0`);
    this.frameBuffer(bytes.length).set(bytes);
    return this.frameAt;
  }

  /**
   * kind: 0 text, 1 description, 2 title, 3 name, 4 mark.
   * @param {number} node
   * @param {number} kind
   */
  #nodeText(node, kind, language = '') {
    return this.#module.UTF8ToString(
        this.#module._web_node_text(node, kind, this.#given(language)));
  }

  /**
   * A WebVTT file of the captions of a video or sound; '' where it has none in that language.
   * @param {number} node
   * @param {string} language
   */
  captionsOf(node, language) {
    return this.#module.UTF8ToString(this.#module._web_captions(node, this.#given(language)));
  }

  /**
   * The words of a node: {title, text, alt}, '' where it has none in that language.
   * @param {number} node
   * @param {string} language
   */
  wordsOf(node, language) {
    const [text, alt, title] = [0, 1, 2].map((kind) => this.#nodeText(node, kind, language));
    return {title, text, alt};
  }

  /**
   * A step of the bundle's actions. time: seconds. event: {node, material} that was tapped, {node,
   * ended: true} of a video or sound, or nothing.
   * @param {number} time
   * @param {Happened | null} event
   * @returns {Todo[]} what the page has to do
   */
  act(time, event) {
    const m = this.#module;
    const count = m._web_act(
        time, event ? (event.ended ? 2 : 1) : -1, event?.node ?? 0, event?.material ?? 0);
    return Array.from({length: count}, (_, i) => {
      const [kind, node, action] = [0, 1, 2].map((field) => m._web_command(i, field));
      if (kind === 7) return {link: m.UTF8ToString(m._web_address(action))};
      const todo = /** @type {Record<number, string>} */ ({1: 'play', 2: 'pause', 6: 'text'})[kind];
      return /** @type {Todo} */ ({[todo]: node});
    });
  }

  /**
   * The file of a video or sound.
   * @param {number} node
   */
  mediaOf(node) {
    const at = this.#module._web_media(node);
    return this.#module.HEAPU8.slice(at, at + this.#module._web_media_size(node));
  }

  /**
   * A new texture that a video node shows from now on, as WebGL knows it.
   * @param {number} node
   */
  videoTexture(node) { return this.#module.GL.textures[this.#module._web_video_texture(node)]; }

  /** Something turns, or a delay runs: act() and draw() again, though no frame comes. */
  get acting() { return this.#module._web_acting() !== 0; }

  /**
   * Models that have a clip of this name play it.
   * @param {string} name
   * @param {boolean} loops
   * @param {number} blend seconds
   */
  play(name, loops, blend) {
    this.scenes.forEach((_, scene) => this.clips.forEach((clip, i) => {
      if (clip.name === name) this.#module._web_play(scene, i, loops ? 1 : 0, blend);
    }));
  }
  stop() { this.scenes.forEach((_, scene) => this.#module._web_stop(scene)); }

  /** Of each scene, the clip that moves its model. */
  get playing() {
    return this.scenes.map((_, scene) => this.clips[this.#module._web_playing(scene) - 1]?.name);
  }

  forgetActs() { this.#module._web_forget_acts(); }

  /**
   * The node under a pixel of the canvas: {node, material}, or null.
   * @param {number} width
   * @param {number} height
   * @param {boolean} mirror
   * @param {number} x
   * @param {number} y
   */
  pick(width, height, mirror, x, y) {
    const at = this.#module._web_pick(width, height, mirror ? 1 : 0, x, y);
    if (at === 0) return null;
    const [node, material] = new Uint32Array(this.#module.HEAPU8.buffer, at, 2);
    return {node, material};
  }

  /**
   * Where a label is on the canvas, pixels: {x, y, covered}, or null. look: whether something may
   * cover it.
   * @param {number} node
   * @param {number} width
   * @param {number} height
   * @param {boolean} mirror
   * @param {boolean} look
   */
  label(node, width, height, mirror, look) {
    const at = this.#module._web_label(node, width, height, mirror ? 1 : 0, look ? 1 : 0);
    if (at === 0) return null;
    const [x, y, covered] = new Float32Array(this.#module.HEAPU8.buffer, at, 3);
    return {x, y, covered: covered !== 0};
  }

  /**
   * The box of a pattern's content, in its space: {low, high}, or null where nothing does.
   * @param {number} pattern
   */
  bounds(pattern) {
    const address = this.#module._web_bounds(pattern);
    if (address === 0) return null;
    const numbers = new Float32Array(this.#module.HEAPU8.buffer, address, 6);
    return {low: [...numbers.subarray(0, 3)], high: [...numbers.subarray(3)]};
  }

  /**
   * Of the camera's frames. focal: in pixels, 0: unknown (the longer side, to begin with).
   * @param {number} width
   * @param {number} height
   * @param {number} focal
   */
  setCamera(width, height, focal) {
    this.width = width;
    this.height = height;
    this.#module._web_camera(width, height, focal);
  }

  get focal() { return this.#module._web_focal(); }

  /** Its standard deviation, pixels; 0 where it is not estimated. */
  get focalSigma() { return this.#module._web_focal_sigma(); }

  /**
   * Starts tracking anew for the camera.
   * @param {boolean} findFocal
   */
  track(findFocal, budget = 0, extended = false) {
    this.check(this.#module._web_track(findFocal ? 1 : 0, budget, extended ? 1 : 0));
  }

  reset() { this.#module._web_reset(); }

  /**
   * How the camera turned up to the next frame: three numbers, see modar.d.ts.
   * @param {[number, number, number]} turn
   */
  turn([x, y, z]) { this.#module._web_turn(x, y, z); }

  /**
   * Room for a frame in the heap, the same until a larger one is requested.
   * @param {number} bytes
   */
  frameBuffer(bytes) {
    if (bytes > this.frameBytes) {
      if (this.frameAt !== 0) this.#module._web_free(this.frameAt);
      this.frameAt = this.#reserve(bytes);
      this.frameBytes = bytes;
    }
    return this.#module.HEAPU8.subarray(this.frameAt, this.frameAt + bytes);
  }

  /** The frame buffer's RGBA becomes gray, in place. */
  grayFromRgba() { this.#module._web_gray_from_rgba(this.frameAt, this.width, this.height); }

  /**
   * Takes a record as a further pattern.
   * @param {Uint8Array} record
   * @param {Pattern} pattern
   */
  addPattern(record, pattern) {
    this.frameBuffer(record.length).set(record);
    this.check(this.#module._web_add_pattern(this.frameAt, record.length));
    this.patterns.push(pattern);
  }

  /**
   * A further pattern, as another engine's addPattern() has it, gets the content of a scene.
   * @returns false: there are too many
   * @param {Pattern} pattern
   * @param {number} scene
   */
  stand(pattern, scene) {
    if (!this.#module._web_stand(scene)) return false;
    this.patterns.push(pattern);
    return true;
  }

  /**
   * Forgets all further patterns.
   * @param {number} kept those of the bundle. Tracking begins anew
   */
  forgetPatterns(kept) {
    this.#module._web_forget_patterns();
    this.patterns.length = kept;
  }

  /**
   * The frame buffer's gray picture, `shrink` times the camera's size, becomes that size, in
   * place; its stride is the width.
   * @param {number} stride
   * @param {number} shrink
   */
  shrink(stride, shrink) {
    this.#module._web_shrink(this.frameAt, stride, this.width, this.height, shrink);
  }

  /**
   * The frame buffer's luma of video (16 to 235) becomes 0 to 255.
   * @param {number} stride
   */
  widenLuma(stride) { this.#module._web_widen_luma(this.frameAt, stride * this.height); }

  /**
   * Tracks the gray frame in the frame buffer.
   * @returns poses, a view that the next call changes.
   * @param {number} stride
   * @param {number} time
   */
  step(stride, time) {
    this.check(this.#module._web_step(this.frameAt, stride, time));
    return this.poses();
  }

  /** @param {number} stride */
  brightness(stride) { return this.#module._web_brightness(this.frameAt, stride); }

  get reason() {
    return /** @type {import('./modar.js').Reason} */ (
        this.#module.UTF8ToString(this.#module._web_reason()));
  }

  poses() {
    return new Float32Array(
        this.#module.HEAPU8.buffer, this.#module._web_poses(),
        this.copies * this.patterns.length * POSE_FLOATS);
  }

  /** Most of a pattern. In poses(), second copies follow the first ones of all patterns. */
  get copies() { return this.#module._web_copies(); }

  get heapBytes() { return this.#module.HEAPU8.length; }

  /**
   * Makes a WebGL context current.
   * @param {1 | 2} version
   * @param {WebGLRenderingContext | WebGL2RenderingContext} context
   */
  useContext(context, version) {
    const {GL} = this.#module;
    GL.makeContextCurrent(
        GL.registerContext(context, {majorVersion: version, enableExtensionsByDefault: true}));
  }

  /**
   * The light in a small copy of the poses' frame.
   * @param {ImageData} image
   */
  look({data, width, height}) {
    this.frameBuffer(data.length).set(data);
    this.#module._web_look(this.frameAt, width, height);
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  draw(width, height, mirror = false) { this.#module._web_draw(width, height, mirror ? 1 : 0); }

  /**
   * As modar_screen_touch() says, of a canvas of that size: 0 nothing, 1 moved, 2 tapped.
   * @param {number} kind
   * @param {number} finger
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   * @returns {number}
   */
  touch(kind, finger, x, y, width, height) {
    return this.#module._web_touch(kind, finger, x, y, width, height);
  }

  /**
   * As modar_screen_press() says.
   * @param {number} button
   * @param {number} steps
   */
  press(button, steps) { this.#module._web_press(button, steps); }

  /**
   * A look without a camera from now on, until forgetActs(): with orbit().
   * @param {number} pattern
   * @param {number} time
   * @param {boolean} presents
   */
  lookAround(pattern, time, presents) {
    this.#module._web_look_around(pattern, time, presents ? 1 : 0);
  }

  /**
   * A frame with the poses of poses(), and what the tracker's engine says of it.
   * @param {number} time
   * @param {string} reason
   * @param {number} brightness
   */
  follow(time, reason, brightness) {
    this.#module._web_follow(time, this.#given(reason), brightness);
  }

  /** @returns {import('./modar-view.js').ViewStatus} */
  get status() {
    const m = this.#module;
    const [state, hint, number, sound, paused, captions] =
        new Int32Array(m.HEAPU8.buffer, m._web_status(), 6);
    return {
      state: STATES[state],
      hint: HINTS[hint],
      pattern: number - 1,
      sound: !!sound,
      paused: !!paused,
      captions: !!captions
    };
  }

  /**
   * A pattern as the visitor's eye sees it at a time, in place of a camera's frame.
   * @param {number} pattern
   * @param {number} width
   * @param {number} height
   * @param {number} time
   */
  orbit(pattern, width, height, time) { this.#module._web_orbit(pattern, width, height, time); }

  /** Of the last drawing. */
  get triangles() { return this.#module._web_triangles(); }

  get gpuBytes() { return this.#module._web_gpu_bytes(); }
}
