// @ts-check
// A phone's gyroscope in addition to its camera: how the camera turned between two frames.

/**
 * Milliseconds that may be between readings, of which browsers deliver some 60 a second; beyond,
 * the turn is unknown.
 */
const LONGEST_GAP = 100;
/**
 * Milliseconds of readings that are kept: a frame is looked at later than it was taken, after
 * another's search at the latest.
 */
const KEPT = 5000;

/** @see modar.d.ts */
export async function allowMotion() {
  try {
    const {DeviceMotionEvent: events = {}} =
        /** @type {{ DeviceMotionEvent?: { requestPermission?: () => Promise<string> } }} */ (
            globalThis);
    return (await events.requestPermission?.() ?? 'granted') === 'granted';
  } catch {
    return false;  // iOS, outside of a click
  }
}

/**
 * A vector of the device (x right and y up on its screen in its natural orientation, z towards
 * the viewer) in the axes of a camera whose picture is upright on the screen: x right, y down, z
 * forward.
 *
 * @param {number[]} vector
 * @param {number} angle degrees that the device is turned
 * counterclockwise, which the screen makes up for
 * @param {boolean} front the camera on the
 * screen's side, its picture not mirrored
 */
export function toCamera([x, y, z], angle, front) {
  const radians = (angle * Math.PI) / 180;
  const [sine, cosine] = [Math.sin(radians), Math.cos(radians)];
  const [right, up] = [cosine * x - sine * y, sine * x + cosine * y];
  return front ? [-right, -up, z] : [right, -up, -z];
}

export class Gyroscope {
  #front;
  #closed = false;
  /**
   * @type {{ time: number, rate: number[] }[]} milliseconds; radians a second about the camera's
   *     axes
   */
  #readings = [];

  /**
   * Of the phone whose camera the video shows, or null: any other camera need not turn with this
   * device.
   * @param {HTMLVideoElement} video
   */
  static of(video) {
    const stream = /** @type {MediaStream | null} */ (video.srcObject);
    const facing = stream?.getVideoTracks?.()[0]?.getSettings().facingMode;
    return facing === 'environment' || facing === 'user' ? new Gyroscope(facing === 'user') : null;
  }

  /** @param {boolean} front */
  constructor(front) {
    this.#front = front;
    allowMotion().then((allowed) => {
      if (allowed && !this.#closed) addEventListener('devicemotion', this.#read);
    });
  }

  close() {
    this.#closed = true;
    removeEventListener('devicemotion', this.#read);
  }

  /** @param {DeviceMotionEvent} event */
  #read = ({timeStamp, rotationRate}) => {
    // About x, y and z, in degrees, in every browser that runs this page: the names are not those
    // of deviceorientation's angles.
    const {alpha, beta, gamma} = rotationRate ?? {};
    if (typeof alpha !== 'number' || typeof beta !== 'number' || typeof gamma !== 'number') return;
    const angle = globalThis.screen.orientation?.angle ?? globalThis.orientation ??
        0;  // the latter before iOS 16.4
    const rate = toCamera([alpha, beta, gamma], angle, this.#front)
                     .map((degrees) => (degrees * Math.PI) / 180);
    this.#readings.push({time: timeStamp, rate});
    while (this.#readings[0].time < timeStamp - KEPT) this.#readings.shift();
  };

  /**
   * How the camera turned from one time to another (milliseconds): a rotation vector; undefined
   * where readings lack.
   * @param {number} from
   * @param {number} to
   */
  turn(from, to) {
    if (!(from < to)) return undefined;
    const turned = [0, 0, 0];
    let known = from;
    for (let i = 0; i < this.#readings.length && known < to; ++i) {
      const before = this.#readings[i];
      const next = this.#readings[i + 1];
      const after = next?.time - before.time <= LONGEST_GAP ?
          next :
          {time: before.time + LONGEST_GAP, rate: before.rate};
      const end = Math.min(after.time, to);
      if (end <= known) continue;
      if (before.time > known) return undefined;
      for (let axis = 0; axis < 3; ++axis) {
        turned[axis] += ((end - known) / 1000) * ((before.rate[axis] + after.rate[axis]) / 2);
      }
      known = end;
    }
    return known < to ? undefined : turned;
  }
}
