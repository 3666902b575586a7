// @ts-check
// A film of the view: the camera's picture with the models on it, at the size of the screen.

/** Seconds: what a message takes along, and a phone's memory bears. */
export const LONGEST = 30;
const FRAMES_A_SECOND = 30;
/** Bits a second: a phone's screen at this is a message of 19 MB at the most. */
const BITS = 5e6;
/**
 * MP4 plays wherever a film is sent; not every browser writes it. Behind each type, what it has
 * for sound.
 */
const TYPES = [
  ['video/mp4;codecs=avc1.42E01F', ',mp4a.40.2'], ['video/mp4', ''],
  ['video/webm;codecs=vp9', ',opus'], ['video/webm;codecs=vp8', ',opus'], ['video/webm', '']
];

/** @param {boolean} sound */
const typeOf = (sound) => TYPES.map(([type, more]) => (sound ? type + more : type))
                              .find((type) => globalThis.MediaRecorder?.isTypeSupported(type));

export const canRecord = () => Boolean(typeOf(false) && HTMLCanvasElement.prototype.captureStream);

export class Recorder {
  #layers;
  #sound;
  #canvas = document.createElement('canvas');
  /** @type {CanvasRenderingContext2D} */
  #context;
  /** @type {MediaRecorder | undefined} */
  #recorder;
  /** @type {Blob[]} */
  #parts = [];
  #timer = 0;
  /** @type {Promise<File>} when it has ended */
  done;
  /** @type {(film: File) => void} */
  #resolve = () => {};
  /** @type {(error: unknown) => void} */
  #reject = () => {};

  /**
   * layers: stacked canvases. sound: a stream, or null. Begins with the first add(); ends by
   * stop(), or when it is long enough.
   *
   * @param {HTMLCanvasElement[]} layers
   * @param {MediaStream |
   * null} sound
   */
  constructor(layers, sound) {
    this.#layers = layers;
    this.#sound = sound;
    // Encoders take even sides, and keep to the first frame's.
    Object.assign(this.#canvas, {width: layers[0].width & ~1, height: layers[0].height & ~1});
    this.#context =
        /** @type {CanvasRenderingContext2D} */ (this.#canvas.getContext('2d', {alpha: false}));
    this.done = new Promise((resolve, reject) => {
      this.#resolve = resolve;
      this.#reject = reject;
    });
  }

  /**
   * Takes the layers unchanged: call it in the task that has drawn them, as browsers empty them
   * afterwards.
   */
  add() {
    for (const layer of this.#layers)
      this.#context.drawImage(layer, 0, 0, this.#canvas.width, this.#canvas.height);
    if (!this.#recorder) this.#begin();
  }

  #begin() {
    const mimeType = this.#mimeType;
    const seen = this.#canvas.captureStream(FRAMES_A_SECOND);
    const stream = new MediaStream([...seen.getTracks(), ...this.#sound?.getTracks() ?? []]);
    const recorder = this.#recorder =
        new MediaRecorder(stream, {mimeType, videoBitsPerSecond: BITS});
    recorder.ondataavailable = ({data}) => this.#parts.push(data);
    recorder.onstop = () => this.#end(mimeType);
    recorder.onerror = (event) =>
        this.#reject('error' in event ? event.error : new Error('the film could not be written'));
    recorder.start(1000);
    this.#timer = setTimeout(() => this.stop(), 1000 * LONGEST);
  }

  get #mimeType() { return typeOf(Boolean(this.#sound)) ?? ''; }

  /** @param {string} mimeType */
  #end(mimeType) {
    const type = mimeType.split(';')[0];
    this.#resolve(new File(this.#parts, `modar.${type.split('/')[1]}`, {type}));
  }

  stop() {
    clearTimeout(this.#timer);
    if (!this.#recorder) this.#end(this.#mimeType);  // nothing was drawn meanwhile: an empty film
    else if (this.#recorder.state !== 'inactive') this.#recorder.stop();
  }
}
