import type { Camera, Scene, TransformNode } from '@babylonjs/core';
import type { Following, FollowOptions } from './follow.js';

/**
 * Draws the camera's picture below the engine's canvas, and the scene on it, after each frame: use no runRenderLoop(). prints: by the
 * pattern's name, the node that is placed on it, which has no parent: x right, y up, z towards the viewer, the picture's longer side
 * from -1 to 1. Makes the scene right-handed and its background transparent; call it before meshes are made.
 */
export function follow(bundle: string | URL | ArrayBuffer | Uint8Array, words: FollowOptions & {
  scene: Scene; camera: Camera; prints: Record<string, TransformNode>;
}): Promise<Following>;
