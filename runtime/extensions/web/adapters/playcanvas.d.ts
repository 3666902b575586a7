import type { AppBase, Entity } from 'playcanvas';
import type { Following, FollowOptions } from './follow.js';

/**
 * Draws the camera's picture below the app's canvas, which has to be transparent (`graphicsDeviceOptions: { alpha: true }`), and the
 * scene on it, after each frame. prints: by the pattern's name, the entity
 * that is placed on it, a child of `app.root`: x right, y up, z towards the viewer, the picture's longer side from -1 to 1. camera: an
 * entity with a camera, whose projection becomes that of the real one.
 */
export function follow(bundle: string | URL | ArrayBuffer | Uint8Array, words: FollowOptions & {
  app: AppBase; camera: Entity; prints: Record<string, Entity>;
}): Promise<Following>;
