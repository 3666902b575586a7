// @ts-check
// React Three Fiber: <Prints bundle="museum.modar"><Print name="cover">...</Print></Prints>.
import {useThree} from '@react-three/fiber';
import {createContext, createElement, useContext, useEffect, useRef, useState} from 'react';

import {follow} from './follow.js';

/** @typedef {import('three').Group} Group */

/** Groups by the pattern's name. */
const Placed = createContext(/** @type {Map<string, Set<Group>>} */ (new Map()));

/**
 * @see fiber.d.ts
 * @param {import('./fiber.js').PrintsProps} words
 */
export function Prints({bundle, onReady, onError, children, ...options}) {
  const [groups] = useState(() => new Map());
  const {gl, camera, invalidate, setFrameloop} = useThree();
  const latest = useRef({options, onReady, onError});
  latest.current = {options, onReady, onError};
  useEffect(() => {
    let ended = false;
    const engine = {
      canvas: gl.domElement,
      near: camera.near,
      far: camera.far,
      /** @type {import('./follow.js').Engine['place']} */
      place(name, view) {
        camera.updateMatrixWorld();
        for (const group of groups.get(name) ?? []) {
          group.visible = view !== null;
          if (view) group.matrix.fromArray(view).premultiply(camera.matrixWorld);
          group.matrixWorldNeedsUpdate = true;
        }
      },
      /** @type {import('./follow.js').Engine['draw']} */
      draw(size, projection) {
        camera.projectionMatrix.fromArray(projection);
        camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
        invalidate();
      },
    };
    setFrameloop('demand');
    Object.assign(camera, {manual: true});
    const running = follow(bundle, engine, latest.current.options);
    running.then(
        (started) => {
          if (!ended) latest.current.onReady?.(started);
        },
        (error) => {
          if (!ended) latest.current.onError?.(error);
        });
    return () => {
      ended = true;
      running.then(({close}) => close(), () => {});
    };
  }, [bundle, gl, camera]);
  return createElement(Placed.Provider, {value: groups}, children);
}

/**
 * @see fiber.d.ts
 * @param {import('./fiber.js').PrintProps} words
 */
export function Print({name, children, ...more}) {
  const groups = useContext(Placed);
  const group = useRef(/** @type {Group | null} */ (null));
  useEffect(() => {
    const own = /** @type {Group} */ (group.current);
    own.visible = false;
    if (!groups.has(name)) groups.set(name, new Set());
    groups.get(name)?.add(own);
    return () => {
      groups.get(name)?.delete(own);
    };
  }, [groups, name]);
  return createElement('group', {...more, ref: group, matrixAutoUpdate: false}, children);
}
