import type { ForwardRefExoticComponent, HTMLAttributes, RefAttributes } from 'react';
import type { ModarViewer as Viewer, ModarViewerEventMap, ViewerAttributes } from '../modar-viewer.js';

type Handlers = {
  onFound: 'found'; onUpdated: 'updated'; onLost: 'lost'; onFrame: 'frame'; onProgress: 'progress'; onLoad: 'load'; onWhole: 'whole';
  onError: 'error'; onStateChange: 'statechange'; onCameraChange: 'camerachange'; onSceneChange: 'scenechange'; onText: 'text';
  onLink: 'link';
};
export type ModarViewerProps = Omit<HTMLAttributes<Viewer>, keyof Handlers | 'children'> & Omit<ViewerAttributes, 'max-bytes'>
  & { [K in keyof Handlers]?: (event: ModarViewerEventMap[Handlers[K]]) => void }
  & { maxBytes?: number; children?: HTMLAttributes<Viewer>['children'] } & Partial<Pick<Viewer, 'srcObject' | 'patterns' | 'words'>>;

/** The element <modar-viewer>, which its ref is: start(), look(), stop() and others are called on it. */
export const ModarViewer: ForwardRefExoticComponent<ModarViewerProps & RefAttributes<Viewer>>;
