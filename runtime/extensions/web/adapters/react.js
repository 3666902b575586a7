// @ts-check
// <modar-viewer> as a component of React 17 or later, with its events as functions.
import {createElement, forwardRef, useEffect, useImperativeHandle, useRef} from 'react';
import '../modar-viewer.js';

/** Events of the viewer; of React's own names, those of other elements stay React's. */
const EVENTS = {
  onFound: 'found',
  onUpdated: 'updated',
  onLost: 'lost',
  onFrame: 'frame',
  onProgress: 'progress',
  onLoad: 'load',
  onWhole: 'whole',
  onError: 'error',
  onStateChange: 'statechange',
  onCameraChange: 'camerachange',
  onSceneChange: 'scenechange',
  onText: 'text',
  onLink: 'link',
};

/** @see react.d.ts */
export const ModarViewer = forwardRef(/**
    @param {Record<string, any>} props
    @param {import('react').ForwardedRef<import('../modar-viewer.js').ModarViewer>} ref
    */ function ModarViewer({srcObject, patterns, words, maxBytes, ...props}, ref) {
  const own = useRef(/** @type {import('../modar-viewer.js').ModarViewer | null} */ (null));
  const handlers = useRef(props);
  handlers.current = props;
  useImperativeHandle(ref, () => /** @type {NonNullable<typeof own.current>} */ (own.current), []);
  useEffect(() => {
    const viewer = /** @type {NonNullable<typeof own.current>} */ (own.current);
    for (const [key, value] of Object.entries({srcObject, patterns, words}))
      if (value !== undefined) Object.assign(viewer, {[key]: value});
  }, [srcObject, patterns, words]);
  useEffect(() => {
    const stop = new AbortController();
    for (const [key, type] of Object.entries(EVENTS))
      own.current?.addEventListener(
          type, (/** @type {Event} */ event) => handlers.current[key]?.(event),
          {signal: stop.signal});
    return () => stop.abort();
  }, []);
  const rest = Object.fromEntries(Object.entries(props).filter(([key]) => !(key in EVENTS)));
  return createElement('modar-viewer', {...rest, 'max-bytes': maxBytes, ref: own});
});
