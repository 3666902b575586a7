import type { ThreeElements } from '@react-three/fiber';
import type { ReactElement, ReactNode } from 'react';
import type { Following, FollowOptions } from './follow.js';

export interface PrintsProps extends FollowOptions {
  bundle: string | URL | ArrayBuffer | Uint8Array;
  onReady?: (following: Following) => void;
  /** ModarError, or what getUserMedia() throws. */
  onError?: (error: unknown) => void;
  children?: ReactNode;
}
/** Within <Canvas>, which it redraws after each frame of the camera, above the camera's picture. */
export function Prints(props: PrintsProps): ReactElement;

export interface PrintProps extends Omit<ThreeElements['group'], 'name'> {
  /** Of the pattern. */
  name: string;
}
/** Within <Prints>: a group on a print: x right, y up, z towards the viewer, the picture's longer side from -1 to 1. */
export function Print(props: PrintProps): ReactElement;
