// The videos and sounds of patterns: decoded by the browser, videos shown as textures of the models' context, captions told.

/** Videos whose first picture waits, decoded, for their pattern to be found: they start on the spot. More start as they are made: phones
 * give a page few decoders at once. Set by hand. */
const READY_VIDEOS = 4;

/** A node's element, and a video's texture. */
class Player {
  #texture = null;
  #fresh = false;
  #everyTime = false;
  /** It was to play: until then a video's poster is shown. */
  begun = false;

  constructor(bytes, { kind, loops, onFrame, onEnd }) {
    const seen = kind === 'video';
    this.element = document.createElement(seen ? 'video' : 'audio');
    this.addresses = [URL.createObjectURL(new Blob([bytes], { type: seen ? 'video/mp4' : 'audio/mp4' }))];
    Object.assign(this.element, { src: this.addresses[0], loop: loops, muted: true, playsInline: true, preload: 'auto' });
    if (seen) this.#tellFrames(onFrame);
    this.element.addEventListener('ended', onEnd);
  }

  #tellFrames(onFrame) {
    const next = () => {
      this.#fresh = true;
      if (this.begun) onFrame();
      this.element.requestVideoFrameCallback?.(next);
    };
    // Without that callback, a frame may be new whenever one is drawn.
    this.#everyTime = !('requestVideoFrameCallback' in this.element);
    if (this.#everyTime) this.element.addEventListener('loadeddata', next);
    else this.element.requestVideoFrameCallback(next);
  }

  /** From now on it is shown, as it waits. */
  begin() {
    this.begun = true;
    this.#fresh = true;
  }

  /** captions: a WebVTT file. onCue: the words that are heard now, '' for none. */
  caption(captions, language, onCue) {
    this.addresses.push(URL.createObjectURL(new Blob([captions], { type: 'text/vtt' })));
    const track = Object.assign(document.createElement('track'), { kind: 'captions', srclang: language, src: this.addresses.at(-1) });
    this.element.append(track);
    track.track.mode = 'hidden';  // read, but not drawn by the browser
    track.track.addEventListener('cuechange', () => {
      onCue([...track.track.activeCues ?? []].map((cue) => cue.getCueAsHTML().textContent).join('\n'));
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

  /** The newest frame into its texture; make answers a new one. The context's state stays. */
  upload(gl, make) {
    const { element } = this;
    const playing = this.#everyTime && !element.paused;
    if (!this.begun || (!this.#fresh && !playing) || element.readyState < 2) return;
    this.#fresh = false;
    const unit = gl.getParameter(gl.ACTIVE_TEXTURE);
    const bound = gl.getParameter(gl.TEXTURE_BINDING_2D);
    this.#texture ??= make();
    gl.bindTexture(gl.TEXTURE_2D, this.#texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, element);
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
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

/** The words of a WebVTT file without their times. */
function transcriptOf(captions) {
  const words = captions.split('\n\n').slice(1).map((cue) => cue.trim().split('\n').slice(1).join(' ')).join('\n');
  return new DOMParser().parseFromString(words.replace(/<[^>]*>/g, ''), 'text/html').body.textContent;
}

/** All of a bundle. The elements of the first videos are made by prepare(), others when they are first to play. */
export class Media {
  #engine;
  #players = new Map();
  #wanted = new Set();
  /** What the visitor asked for; undefined: nothing yet. */
  #sound;
  #volume = 1;
  #held = false;
  #onFrame;
  #onCue;
  #languages = [];
  /** Nodes that have ended since somebody looked. */
  ended = [];

  /** onFrame: there is something new to draw. onCue(node, words, language): they are heard now. */
  constructor(engine, onFrame, onCue) {
    this.#engine = engine;
    this.#onFrame = onFrame;
    this.#onCue = onCue;
  }

  /** For captions, the first one first; of what is made from now on. */
  set languages(languages) {
    this.#languages = languages;
  }

  /** {language, captions, transcript} in the first language that has them, or null. */
  captionsOf(node) {
    for (const language of [...this.#languages, ...this.#engine.languages]) {
      const captions = this.#engine.captionsOf(node, language);
      if (captions) return { language, captions, transcript: transcriptOf(captions) };
    }
    return null;
  }

  /** tapped: it was the visitor who asked for it, who hears it unless sound was turned off. */
  play(node, tapped) {
    this.#wanted.add(node);
    const player = this.#players.get(node) ?? this.#open(node);
    if (!player.begun) this.#begin(node, player);
    if (tapped) this.#sound ??= true;
    this.#tune();
    if (!this.#held) player.play();
  }

  #open(node) {
    const player = new Player(this.#engine.mediaOf(node), {
      ...this.#engine.nodes[node], onFrame: this.#onFrame,
      onEnd: () => {
        this.#wanted.delete(node);
        this.ended.push(node);
        this.#onFrame();
      },
    });
    this.#players.set(node, player);
    return player;
  }

  #begin(node, player) {
    player.begin();
    const told = this.captionsOf(node);
    if (told) player.caption(told.captions, told.language, (words) => this.#onCue(node, words, told.language));
  }

  /** Makes the first videos, paused at their beginning, once the bundle's bytes are there. */
  prepare() {
    const videos = this.#engine.nodes.flatMap(({ kind }, node) => (kind === 'video' ? [node] : []));
    for (const node of videos.slice(0, READY_VIDEOS)) if (!this.#players.has(node)) this.#open(node);
  }

  pause(node) {
    this.#wanted.delete(node);
    this.#players.get(node)?.element.pause();
    this.#onCue(node, '', '');
  }

  #tune() {
    for (const { element } of this.#players.values()) Object.assign(element, { muted: !this.sound, volume: this.#volume });
  }

  /** Off until a visitor asks for it: browsers refuse more, and so would a museum. */
  set sound(on) {
    this.#sound = on;
    this.#tune();
  }

  get sound() {
    return this.#sound ?? false;
  }

  /** 0 to 1. */
  set volume(volume) {
    this.#volume = volume;
    this.#tune();
  }

  /** The visitor's own pause: what is to play waits. */
  set held(on) {
    this.#held = on;
    for (const node of this.#wanted) {
      if (on) this.#players.get(node).element.pause();
      else this.#players.get(node).play();
    }
  }

  get held() {
    return this.#held;
  }

  upload(gl) {
    this.prepare();  // again, after close()
    for (const [node, player] of this.#players) {
      if (this.#engine.nodes[node].kind === 'video') player.upload(gl, () => this.#engine.videoTexture(node));
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
  }
}
