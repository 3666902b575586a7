// @ts-check
// Nodes of Babylon.js on the prints of a bundle. Works with any copy of it: it imports none.
import {follow as followWith} from './follow.js';

/**
 * @see babylon.d.ts
 * @param {Parameters<import('./babylon.js').follow>[0]} bundle
 * @param {Parameters<import('./babylon.js').follow>[1]} words
 */
export function follow(bundle, {scene, camera, prints, ...options}) {
  const engine = scene.getEngine();
  scene.useRightHandedSystem = true;
  scene.clearColor.set(0, 0, 0, 0);
  camera.getViewMatrix(true);
  for (const print of Object.values(prints)) print.setEnabled(false);
  const matrix = camera.getWorldMatrix().clone();
  return followWith(
      bundle, {
        canvas: /** @type {HTMLCanvasElement} */ (engine.getRenderingCanvas()),
        near: camera.minZ,
        far: camera.maxZ,
        place(name, view) {
          prints[name]?.setEnabled(view !== null);
          // Babylon.js multiplies vectors from the left.
          if (view)
            prints[name]?.setPreTransformMatrix(
                matrix.fromArray(view).multiply(camera.getWorldMatrix()));
        },
        draw({width, height}, projection) {
          engine.setHardwareScalingLevel(1);
          engine.setSize(width, height);
          camera.freezeProjectionMatrix(matrix.clone().fromArray(projection));
          scene.render();
        },
      },
      options);
}
