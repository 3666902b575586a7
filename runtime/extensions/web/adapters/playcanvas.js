// @ts-check
// Entities of PlayCanvas on the prints of a bundle. Works with any copy of it: it imports none.
import {follow as followWith} from './follow.js';

/**
 * @see playcanvas.d.ts
 * @param {Parameters<import('./playcanvas.js').follow>[0]} bundle
 * @param {Parameters<import('./playcanvas.js').follow>[1]} words
 */
export function follow(bundle, {app, camera, prints, ...options}) {
  const lens = /** @type {import('playcanvas').CameraComponent} */ (camera.camera);
  const matrix = camera.getWorldTransform().clone();
  /** @type {Float32Array | null} */
  let latest = null;
  lens.clearColor.set(0, 0, 0, 0);
  lens.clearColor = lens.clearColor;
  lens.calculateProjection = (to) => {
    if (latest) to.data.set(latest);
  };
  app.autoRender = false;
  for (const print of Object.values(prints)) print.enabled = false;
  return followWith(
      bundle, {
        canvas: app.graphicsDevice.canvas,
        near: lens.nearClip,
        far: lens.farClip,
        place(name, view) {
          const print = prints[name];
          if (!print) return;
          print.enabled = view !== null;
          if (!view) return;
          matrix.data.set(view);
          print.setLocalPosition(
              0, 0, 0);  // marks the world's matrix, which follows from the local one
          print.getLocalTransform().mul2(camera.getWorldTransform(), matrix);
        },
        draw({width, height}, projection) {
          latest = projection;
          app.graphicsDevice.resizeCanvas(width, height);
          app.renderNextFrame = true;
        },
      },
      options);
}
