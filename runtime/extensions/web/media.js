// @ts-check
// The videos and sounds of patterns: decoded by the browser, videos shown as textures of the
// models' context, captions told.

/**
 * Videos whose first picture waits, decoded, for their pattern to be found: they start on the
 * spot. More start when they are created: phones give a page few decoders at once. Not measured.
 */
const READY_VIDEOS = 4;

/** A node's element, and a video's texture. */
class Player {
  /** @type {WebGLTexture | null} */
  #texture = null;
  #fresh = false;
  #everyTime = false;
  /** It was to play: until then a video's poster is shown. */
  begun = false;

  /**
   * @param {Uint8Array} bytes
   * @param {{ kind: string, loops: boolean, onFrame: () => void, onEnd: () => void }} options
   */
  constructor(bytes, {kind, loops, onFrame, onEnd}) {
    const seen = kind === 'video';
    /** @type {HTMLVideoElement | HTMLAudioElement} */
    this.element = document.createElement(seen ? 'video' : 'audio');
    this.addresses =
        [URL.createObjectURL(new Blob([bytes], {type: seen ? 'video/mp4' : 'audio/mp4'}))];
    Object.assign(
        this.element,
        {src: this.addresses[0], loop: loops, muted: true, playsInline: true, preload: 'auto'});
    if (this.element instanceof HTMLVideoElement) this.#tellFrames(this.element, onFrame);
    this.element.addEventListener('ended', onEnd);
  }

  /**
   * @param {HTMLVideoElement} video
   * @param {() => void} onFrame
   */
  #tellFrames(video, onFrame) {
    const next = () => {
      this.#fresh = true;
      if (this.begun) onFrame();
      video.requestVideoFrameCallback?.(next);
    };
    // Without that callback, a frame may be new whenever one is drawn.
    this.#everyTime = !('requestVideoFrameCallback' in video);
    if (this.#everyTime) video.addEventListener('loadeddata', next);
    else video.requestVideoFrameCallback(next);
  }

  /** From now on it is shown, as it waits. */
  begin() {
    this.begun = true;
    this.#fresh = true;
  }

  /**
   * captions: a WebVTT file. onCue: the words that are heard now, '' for none.
   * @param {string} captions
   * @param {string} language
   * @param {(words: string) => void} onCue
   */
  caption(captions, language, onCue) {
    this.addresses.push(URL.createObjectURL(new Blob([captions], {type: 'text/vtt'})));
    const track = Object.assign(
        document.createElement('track'),
        {kind: 'captions', srclang: language, src: this.addresses.at(-1)});
    this.element.append(track);
    track.track.mode = 'hidden';  // read, but not drawn by the browser
    track.track.addEventListener('cuechange', () => {
      onCue([...track.track.activeCues ?? []]
                .map((cue) => /** @type {VTTCue} */ (cue).getCueAsHTML().textContent)
                .join('\n'));
    });
  }

  /** Plays with sound where it may, without where the browser wants a tap first. */
  async play() {
    try {
      await this.element.play();
    } catch {
      if (this.element.muted) return;
      this.element.muted = true;
      await this.element.play().catch(() => {});
    }
  }

  /**
   * Its sound goes to these nodes from now on, and no longer to the device by itself.
   * @param {AudioContext} context
   * @param {AudioNode[]} nodes
   */
  route(context, nodes) {
    const source = context.createMediaElementSource(this.element);
    for (const node of nodes) source.connect(node);
  }

  /**
   * The newest frame into its texture; make answers a new one. The context's state stays.
   * @param {WebGLRenderingContext} gl
   * @param {() => WebGLTexture} make
   */
  upload(gl, make) {
    const {element} = this;
    const playing = this.#everyTime && !element.paused;
    if (!this.begun || (!this.#fresh && !playing) || element.readyState < 2) return;
    this.#fresh = false;
    const unit = gl.getParameter(gl.ACTIVE_TEXTURE);
    const bound = gl.getParameter(gl.TEXTURE_BINDING_2D);
    this.#texture ??= make();
    gl.bindTexture(gl.TEXTURE_2D, this.#texture);
    gl.texImage2D(
        gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE,
        /** @type {HTMLVideoElement} */ (element));
    for (const [name, value] of [
             [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
             [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
      gl.texParameteri(gl.TEXTURE_2D, name, value);
    }
    gl.bindTexture(gl.TEXTURE_2D, bound);
    gl.activeTexture(unit);
  }

  /** Its texture went with its context. */
  forget() {
    this.#texture = null;
    this.#fresh = true;
  }

  close() {
    this.element.pause();
    this.element.removeAttribute('src');
    for (const address of this.addresses) URL.revokeObjectURL(address);
  }
}

/**
 * The words of a WebVTT file without their times.
 * @param {string} captions
 */
function transcriptOf(captions) {
  const words = captions.split('\n\n')
                    .slice(1)
                    .map((cue) => cue.trim().split('\n').slice(1).join(' '))
                    .join('\n');
  return new DOMParser()
      .parseFromString(words.replace(/<[^>]*>/g, ''), 'text/html')
      .body.textContent;
}

/**
 * All of a bundle. The elements of the first videos are made by prepare(), others when they are
 * first to play.
 */
export class Media {
  #engine;
  /** @type {Map<number, Player>} */
  #players = new Map();
  /** @type {Set<number>} */
  #wanted = new Set();
  #sound = false;
  #volume = 1;
  #held = false;
  /**
   * Where sound goes once a film has asked for it.
   * @type {{ context: AudioContext, heard: GainNode, film: MediaStreamAudioDestinationNode } |
   *     null}
   */
  #mixer = null;
  #onFrame;
  #onCue;
  /** @type {string[]} */
  #languages = [];
  /**
   * Nodes that have ended since somebody looked.
   * @type {number[]}
   */
  ended = [];

  /**
   * onFrame: there is something new to draw. onCue(node, words, language): they are heard now.
   * @param {any} engine
   * @param {() => void} onFrame
   * @param {(node: number, words: string, language: string) => void} onCue
   */
  constructor(engine, onFrame, onCue) {
    this.#engine = engine;
    this.#onFrame = onFrame;
    this.#onCue = onCue;
  }

  /**
   * For captions, the first one first; of media made from now on.
   * @param {string[]} languages
   */
  set languages(languages) { this.#languages = languages; }

  /**
   * {language, captions, transcript} in the first language that has them, or null.
   * @param {number} node
   */
  captionsOf(node) {
    for (const language of [...this.#languages, ...this.#engine.languages]) {
      const captions = this.#engine.captionsOf(node, language);
      if (captions) return {language, captions, transcript: transcriptOf(captions)};
    }
    return null;
  }

  /** @param {number} node */
  play(node) {
    this.#wanted.add(node);
    const player = this.#players.get(node) ?? this.#open(node);
    if (!player.begun) this.#begin(node, player);
    this.#tune();
    if (!this.#held) player.play();
  }

  /** @param {number} node */
  #open(node) {
    const player = new Player(this.#engine.mediaOf(node), {
      ...this.#engine.nodes[node],
      onFrame: this.#onFrame,
      onEnd: () => {
        this.#wanted.delete(node);
        this.ended.push(node);
        this.#onFrame();
      },
    });
    this.#players.set(node, player);
    this.#route(player);
    return player;
  }

  /**
   * @param {number} node
   * @param {Player} player
   */
  #begin(node, player) {
    player.begin();
    const told = this.captionsOf(node);
    if (told)
      player.caption(
          told.captions, told.language, (words) => this.#onCue(node, words, told.language));
  }

  /** Makes the first videos, paused at their beginning, once the bundle's bytes are there. */
  prepare() {
    /** @type {{ kind: string }[]} */
    const nodes = this.#engine.nodes;
    const videos = nodes.flatMap(({kind}, node) => (kind === 'video' ? [node] : []));
    for (const node of videos.slice(0, READY_VIDEOS))
      if (!this.#players.has(node)) this.#open(node);
  }

  /** @param {number} node */
  pause(node) {
    this.#wanted.delete(node);
    this.#players.get(node)?.element.pause();
    this.#onCue(node, '', '');
  }

  #tune() {
    const mixer = this.#mixer;
    if (mixer) mixer.heard.gain.value = this.sound ? this.#volume : 0;
    const loudness = mixer ? {muted: false, volume: 1} : {muted: !this.sound, volume: this.#volume};
    for (const {element} of this.#players.values()) Object.assign(element, loudness);
  }

  /** @param {Player} player */
  #route(player) {
    if (this.#mixer) player.route(this.#mixer.context, [this.#mixer.heard, this.#mixer.film]);
  }

  /**
   * The sound of all that plays as a stream, whether the visitor hears it or not. Asked for in a
   * click's handler.
   */
  get film() {
    const mixer = this.#mixer ??= this.#mix();
    this.#tune();
    mixer.context.resume();  // phones stop it while another app sounds
    return mixer.film.stream;
  }

  #mix() {
    const context = new AudioContext();
    const mixer = {
      context,
      heard: context.createGain(),
      film: context.createMediaStreamDestination()
    };
    mixer.heard.connect(context.destination);
    for (const player of this.#players.values()) player.route(context, [mixer.heard, mixer.film]);
    return mixer;
  }

  /**
   * Off until a visitor asks for it: browsers refuse more, and so would a museum.
   * @param {boolean} on
   */
  set sound(on) {
    this.#sound = on;
    this.#tune();
  }

  get sound() { return this.#sound; }

  /**
   * 0 to 1.
   * @param {number} volume
   */
  set volume(volume) {
    this.#volume = volume;
    this.#tune();
  }

  /**
   * The visitor's own pause: media to play wait.
   * @param {boolean} on
   */
  set held(on) {
    this.#held = on;
    for (const node of this.#wanted) {
      const player = this.#players.get(node);
      if (on) player?.element.pause();
      else player?.play();
    }
  }

  get held() { return this.#held; }

  /** @param {WebGLRenderingContext} gl */
  upload(gl) {
    this.prepare();  // again, after close()
    for (const [node, player] of this.#players) {
      if (this.#engine.nodes[node].kind === 'video')
        player.upload(gl, () => this.#engine.videoTexture(node));
    }
  }

  forget() {
    for (const player of this.#players.values()) player.forget();
  }

  close() {
    for (const [node, player] of this.#players) {
      player.close();
      this.#onCue(node, '', '');
    }
    this.#players.clear();
    this.#wanted.clear();
    this.#mixer?.context.close();
    this.#mixer = null;
  }
}
