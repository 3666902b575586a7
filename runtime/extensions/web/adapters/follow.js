// @ts-check
// What the adapters have in common: a camera, its picture below an engine's canvas, and the poses.
import {Camera} from '../camera.js';
import {drawFrame, load, projectionOf} from '../modar.js';

/**
 * @typedef {import('./follow.js').Engine} Engine
 * @typedef {import('./follow.js').FollowOptions} FollowOptions
 */

/**
 * Browsers give no frames of a video that is not displayed.
 * @param {HTMLElement} canvas
 */
function hiddenVideo(canvas) {
  const video = document.createElement('video');
  Object.assign(video, {muted: true, playsInline: true});
  video.style.cssText = 'position:absolute;width:2px;height:2px;opacity:.01;pointer-events:none';
  canvas.before(video);
  return video;
}

/**
 * The camera's picture, exactly below the canvas of an engine.
 * @param {HTMLElement} canvas
 */
function pictureBelow(canvas) {
  const {position} = getComputedStyle(canvas);
  if (position === 'static') canvas.style.position = 'relative';
  const picture = document.createElement('canvas');
  picture.style.position = position === 'fixed' ? 'fixed' : 'absolute';
  canvas.before(picture);
  return picture;
}

/**
 * @see follow.d.ts
 * @param {string | URL | ArrayBuffer | Uint8Array} bundle
 * @param {Engine} engine
 * @param {FollowOptions} [options]
 */
export async function follow(bundle, engine, {video: own, ...options} = {}) {
  const {canvas, near = 0.05, far = 100} = engine;
  const modar = await load(bundle, options);
  const camera = own ? null : new Camera();
  const video = own ?? hiddenVideo(canvas);
  const picture = pictureBelow(canvas);
  // An engine has one object of a pattern: the first copy's.
  modar.addEventListener(
      'updated', ({detail}) => detail.copy || engine.place(detail.name, detail.view, detail));
  modar.addEventListener(
      'lost', ({detail}) => detail.copy || engine.place(detail.name, null, detail));
  modar.addEventListener('frame', ({detail}) => {
    for (const side of /** @type {const} */ (['Left', 'Top', 'Width', 'Height']))
      picture.style.setProperty(side.toLowerCase(), `${canvas[`offset${side}`]}px`);
    const size = drawFrame(picture, detail);
    engine.draw(size, projectionOf(detail.camera, near, far, size));
    if (detail.foundFocal) camera?.keepFocal(detail.foundFocal, detail.camera.width);
  });
  const close = () => {
    modar.close();
    camera?.close();
    picture.remove();
    if (!own) video.remove();
  };
  try {
    await camera?.open(video, close);
    await modar.start(video, {...camera?.focal, ...options});
  } catch (error) {
    close();
    throw error;
  }
  return {modar, video, picture, close};
}
