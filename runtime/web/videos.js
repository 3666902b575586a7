// The videos that stand on patterns: decoded by the browser, shown as textures of the models' context.

/** A video node's element and texture. */
class Video {
  #texture = null;
  #fresh = false;

  constructor(bytes, { loops, onFrame, onEnd }) {
    this.element = document.createElement('video');
    this.address = URL.createObjectURL(new Blob([bytes], { type: 'video/mp4' }));
    Object.assign(this.element, { src: this.address, loop: loops, muted: true, playsInline: true, preload: 'auto' });
    const next = () => {
      this.#fresh = true;
      onFrame();
      this.element.requestVideoFrameCallback?.(next);
    };
    // Without that callback, a frame may be new whenever one is drawn.
    this.everyTime = !('requestVideoFrameCallback' in this.element);
    if (this.everyTime) this.element.addEventListener('loadeddata', next);
    else this.element.requestVideoFrameCallback(next);
    this.element.addEventListener('ended', onEnd);
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
    const playing = this.everyTime && !element.paused;
    if ((!this.#fresh && !playing) || element.readyState < 2) return;
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
    URL.revokeObjectURL(this.address);
  }
}

/** All of a bundle. An element is made when its video is first to play: until then its poster is shown. */
export class Videos {
  #engine;
  #videos = new Map();
  #wanted = new Set();
  #sound = false;
  #held = false;
  #onFrame;
  /** Nodes whose videos have ended since somebody looked. */
  ended = [];

  /** onFrame: there is something new to draw. */
  constructor(engine, onFrame) {
    this.#engine = engine;
    this.#onFrame = onFrame;
  }

  play(node) {
    this.#wanted.add(node);
    if (!this.#videos.has(node)) {
      this.#videos.set(node, new Video(this.#engine.mediaOf(node), {
        loops: this.#engine.nodes[node].loops, onFrame: this.#onFrame,
        onEnd: () => {
          this.#wanted.delete(node);
          this.ended.push(node);
        },
      }));
    }
    const video = this.#videos.get(node);
    video.element.muted = !this.#sound;
    if (!this.#held) video.play();
  }

  pause(node) {
    this.#wanted.delete(node);
    this.#videos.get(node)?.element.pause();
  }

  /** Off until a visitor asks for it: browsers refuse more, and so would a museum. */
  set sound(on) {
    this.#sound = on;
    for (const { element } of this.#videos.values()) element.muted = !on;
  }

  get sound() {
    return this.#sound;
  }

  /** The visitor's own pause: what is to play waits. */
  set held(on) {
    this.#held = on;
    for (const node of this.#wanted) {
      if (on) this.#videos.get(node).element.pause();
      else this.#videos.get(node).play();
    }
  }

  get held() {
    return this.#held;
  }

  upload(gl) {
    for (const [node, video] of this.#videos) video.upload(gl, () => this.#engine.videoTexture(node));
  }

  forget() {
    for (const video of this.#videos.values()) video.forget();
  }

  close() {
    for (const video of this.#videos.values()) video.close();
    this.#videos.clear();
    this.#wanted.clear();
  }
}
