// @ts-check
// Which camera a page opens, how large, and where it can be opened at all.
import {ModarError, shrinkOf} from './engine.js';
import {store, stored} from './storage.js';

/**
 * The first request to a camera: the picture is shown as it comes, and tracked in a smaller
 * copy.
 */
const LARGEST_PICTURE = {
  width: 1920,
  height: 1080
};
/**
 * Milliseconds that handing a frame over may take, of 33 between two of them, as the median of
 * this many frames.
 */
const MOST_COPY_MS = 12;
const COPIES = 15;

const KEPT_CAMERA = 'modar-camera';

/**
 * A browser within another app, many of which refuse the camera.
 * @returns its app's name, or ''
 */
export function hostApp(agent = navigator.userAgent) {
  /** @type {[RegExp, string][]} */
  const apps = [
    [/\bInstagram\b/, 'Instagram'],
    [/\bFBA[NV]\b|\bFB_IAB\b/, 'Facebook'],
    [/\bMicroMessenger\b/, 'WeChat'],
    [/\bLinkedInApp\b/, 'LinkedIn'],
    [/\b(TikTok|musical_ly|BytedanceWebview)\b/, 'TikTok'],
    [/\bSnapchat\b/, 'Snapchat'],
    [/\bPinterest\b/, 'Pinterest'],
    [/\bLine\//, 'LINE'],
    [/\bTwitter(Android)?\b/, 'X'],
    [/\bTelegram\b/, 'Telegram'],
    [/; wv\)/, 'Android'],
  ];
  return apps.find(([mark]) => mark.test(agent))?.[1] ?? '';
}

/** The browser that this phone has of its own. */
export function ownBrowser(agent = navigator.userAgent) {
  return /iPhone|iPad|Macintosh/.test(agent) ? 'Safari' : 'Chrome';
}

/**
 * Of cameras that look away from the visitor, the main one: phones have others with wide angles,
 * long lenses or no colour next to it. Chrome on Android names them "camera2 0, facing back",
 * the main one first; Safari "Back Camera", "Back Ultra Wide Camera" and others, in the phone's
 * language.
 *
 * @returns undefined where labels do not tell.
 * @param {{kind: string, label: string,
 * deviceId: string}[]} devices
 */
export function mainCamera(devices) {
  const back = devices.filter(
      ({kind, label}) => kind === 'videoinput' && /facing back|\bback\b|\brear\b/i.test(label));
  const plain = back.filter(
      ({label}) => !/wide|tele|macro|depth|infrared|mono|\btof\b|dual|triple|quad/i.test(label));
  /** @param {{ label: string }} device */
  const number = ({label}) => Number(/camera2? (\d+)/i.exec(label)?.[1] ?? Infinity);
  return plain.sort((a, b) => (number(a) < number(b) ? -1 : Number(number(a) > number(b))))[0];
}

/** A camera that is open: its stream, and its known properties. */
export class Camera {
  /** @type {MediaStream | null} */
  stream = null;
  facing = 'environment';
  /** The visitor's own choice, for later visits, too. */
  #chosen = stored(KEPT_CAMERA);
  #size = LARGEST_PICTURE;
  /** @type {number[]} */
  #copies = [];

  get track() { return this.stream?.getVideoTracks()[0]; }

  get mirrored() { return this.track?.getSettings().facingMode === 'user'; }

  /**
   * Shows the camera in the video. onEnd: called where it is taken away. Throws what getUserMedia()
   * throws, or ModarError.
   * @param {HTMLVideoElement} video
   * @param {() => void} onEnd
   */
  async open(video, onEnd) {
    if (!globalThis.isSecureContext)
      throw new ModarError({code: 'web.insecure', cause: 'the page came by http'});
    if (!navigator.mediaDevices?.getUserMedia)
      throw new ModarError({code: 'web.old', cause: 'this browser opens no camera'});
    const policed =
        /**
           @type {Record<'permissionsPolicy' | 'featurePolicy', { allowsFeature(name: string):
               boolean } | undefined>}
         */
        (/** @type {unknown} */ (document));
    // Browsers but Chromium call it a refusal of the visitor's.
    if ((policed.permissionsPolicy ?? policed.featurePolicy)?.allowsFeature('camera') === false) {
      throw new ModarError({
        code: 'web.policy',
        cause: 'the camera is forbidden by Permissions-Policy, or by the frame that shows the page',
        cure: 'allow="camera"'
      });
    }
    await this.#take(this.#chosen);
    await this.#preferMain();
    this.#copies = [];
    this.track?.addEventListener('ended', onEnd);
    this.facing = this.track?.getSettings().facingMode ?? this.facing;
    video.srcObject = this.stream;
    await video.play();
  }

  /**
   * @param {string} deviceId
   * @returns {Promise<void>}
   */
  async #take(deviceId) {
    // Cropped or enlarged pictures would be asked of cameras that have none of this size.
    const wanted = {
      width: {ideal: this.#size.width},
      height: {ideal: this.#size.height},
      frameRate: {ideal: 30},
      resizeMode: {ideal: 'none'}
    };
    const which = deviceId ? {deviceId: {exact: deviceId}} : {facingMode: {ideal: this.facing}};
    try {
      this.stream =
          await navigator.mediaDevices.getUserMedia({video: {...wanted, ...which}, audio: false});
    } catch (error) {
      if (!deviceId || /** @type {Error} */ (error).name !== 'OverconstrainedError') throw error;
      this.choose('');  // it is no longer there
      await this.#take('');
    }
  }

  /**
   * Names are known once a camera is open: where another one is the main one, it takes its
   * place.
   */
  async #preferMain() {
    if (this.#chosen || this.facing !== 'environment') return;
    const main = mainCamera(await this.list());
    if (!main || main.deviceId === this.track?.getSettings().deviceId) return;
    this.close();
    await this.#take(main.deviceId).catch(() => this.#take(''));
  }

  /** Frees it for other pages and programs. */
  close() {
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    this.stream = null;
  }

  async list() {
    return (await navigator.mediaDevices.enumerateDevices())
        .filter(({kind}) => kind === 'videoinput');
  }

  /**
   * For the next open(). '': the main one.
   * @param {string} deviceId
   */
  choose(deviceId) {
    this.#chosen = deviceId;
    store(KEPT_CAMERA, deviceId);
  }

  flip() {
    this.facing = this.facing === 'user' ? 'environment' : 'user';
    this.choose('');
  }

  /**
   * Receives the handing time of each frame: asks a slow phone's camera for less, a picture that
   * has the same smaller copy, in which tracking continues.
   * @param {number} milliseconds
   */
  async copied(milliseconds) {
    this.#copies.push(milliseconds);
    if (this.#copies.length < COPIES) return;
    const median = this.#copies.sort((a, b) => a - b)[COPIES >> 1];
    this.#copies = [];
    const {width = 0, height = 0} = this.track?.getSettings() ?? {};
    const shrink = shrinkOf(width, height);
    if (median <= MOST_COPY_MS || !(shrink > 1)) return;
    /** @param {number} side */
    const less = (side) => Math.floor(side / shrink) * (shrink - 1);
    this.#size = {width: less(width), height: less(height)};
    await this.track
        ?.applyConstraints(
            {width: {ideal: less(width)}, height: {ideal: less(height)}, frameRate: {ideal: 30}})
        .catch(() => {});
  }

  /** {focal, focalSide}: the measured value of this camera, or 0. */
  get focal() {
    try {
      const [focal, focalSide] = JSON.parse(stored(this.#key) || '[0, 0]');
      return {focal, focalSide};
    } catch { return {focal: 0, focalSide: 0}; }
  }

  /**
   * @param {number} focal
   * @param {number} focalSide
   */
  keepFocal(focal, focalSide) { store(this.#key, JSON.stringify([focal, focalSide])); }

  get #key() {
    const {deviceId = ''} = this.track?.getSettings() ?? {};
    return `modar-focal:${deviceId || this.track?.label}`;
  }
}
