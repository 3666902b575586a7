import type { Camera, Object3D, Scene, WebGLRenderer } from 'three';
import type { Following, FollowOptions } from './follow.js';

/**
 * Draws the camera's picture below the renderer's canvas, which has to be transparent (`alpha: true`), and the scene on it, after each
 * frame. prints: by the pattern's name, the object that is placed on it, a child of the scene: x right, y up, z towards the viewer, the
 * picture's longer side from -1 to 1. A PerspectiveCamera's near and far are used; its projection is the camera's.
 */
export function follow(bundle: string | URL | ArrayBuffer | Uint8Array, words: FollowOptions & {
  renderer: WebGLRenderer; scene: Scene; camera: Camera & { near?: number; far?: number }; prints: Record<string, Object3D>;
}): Promise<Following>;
