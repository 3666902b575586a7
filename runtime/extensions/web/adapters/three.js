// @ts-check
// Objects of three.js on the prints of a bundle. Works with any copy of three.js: it imports none.
import {follow as followWith} from './follow.js';

/**
 * @see three.d.ts
 * @param {Parameters<import('./three.js').follow>[0]} bundle
 * @param {Parameters<import('./three.js').follow>[1]} words
 */
export function follow(bundle, {renderer, scene, camera, prints, ...options}) {
  for (const print of Object.values(prints))
    Object.assign(print, {matrixAutoUpdate: false, visible: false});
  return followWith(
      bundle, {
        canvas: renderer.domElement,
        near: camera.near,
        far: camera.far,
        place(name, view) {
          const print = prints[name];
          if (!print) return;
          print.visible = view !== null;
          camera.updateMatrixWorld();
          if (view) print.matrix.fromArray(view).premultiply(camera.matrixWorld);
          print.matrixWorldNeedsUpdate = true;
        },
        draw({width, height}, projection) {
          renderer.setPixelRatio(1);
          renderer.setSize(width, height, false);
          camera.projectionMatrix.fromArray(projection);
          camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
          renderer.render(scene, camera);
        },
      },
      options);
}
