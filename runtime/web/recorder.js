// A film of what is seen: the camera's picture with the models on it, at the size of the screen.

/** Seconds: what a message takes along, and a phone's memory bears. */
export const LONGEST = 30;
const FRAMES_A_SECOND = 30;
/** Bits a second: a phone's screen at this is a message of 19 MB at the most. */
const BITS = 5e6;
/** MP4 plays wherever a film is sent; not every browser writes it. */
const TYPES = ['video/mp4;codecs=avc1.42E01F', 'video/mp4', 'video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];

const typeOf = () => TYPES.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));

export const canRecord = () => Boolean(typeOf() && HTMLCanvasElement.prototype.captureStream);

export class Recorder {
  #layers;
  #canvas = document.createElement('canvas');
  #context;
  #recorder;
  #parts = [];
  #timer = 0;
  /** @type {Promise<File>} when it has ended */
  done;
  #resolve;
  #reject;

  /** layers: canvases that lie over each other. Begins with the first add(); ends by stop(), or when it is long enough. */
  constructor(layers) {
    this.#layers = layers;
    // Encoders take even sides, and keep to the first frame's.
    Object.assign(this.#canvas, { width: layers[0].width & ~1, height: layers[0].height & ~1 });
    this.#context = this.#canvas.getContext('2d', { alpha: false });
    this.done = new Promise((resolve, reject) => {
      this.#resolve = resolve;
      this.#reject = reject;
    });
  }

  /** Takes the layers as they are: call it in the task that has drawn them, as browsers empty them afterwards. */
  add() {
    for (const layer of this.#layers) this.#context.drawImage(layer, 0, 0, this.#canvas.width, this.#canvas.height);
    if (!this.#recorder) this.#begin();
  }

  #begin() {
    const mimeType = typeOf();
    this.#recorder = new MediaRecorder(this.#canvas.captureStream(FRAMES_A_SECOND), { mimeType, videoBitsPerSecond: BITS });
    this.#recorder.ondataavailable = ({ data }) => this.#parts.push(data);
    this.#recorder.onstop = () => this.#end(mimeType);
    this.#recorder.onerror = ({ error }) => this.#reject(error ?? new Error('the film could not be written'));
    this.#recorder.start(1000);
    this.#timer = setTimeout(() => this.stop(), 1000 * LONGEST);
  }

  #end(mimeType) {
    const type = mimeType.split(';')[0];
    this.#resolve(new File(this.#parts, `modar.${type.split('/')[1]}`, { type }));
  }

  stop() {
    clearTimeout(this.#timer);
    if (!this.#recorder) this.#end(typeOf());  // nothing was drawn meanwhile: an empty film
    else if (this.#recorder.state !== 'inactive') this.#recorder.stop();
  }
}
