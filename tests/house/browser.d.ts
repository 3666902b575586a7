// For types_test.py: what Debian's TypeScript does not know of browsers, and what the build makes.

interface VideoFrame {
  readonly format: string | null;
  readonly rotation?: number;
  readonly flip?: boolean;
  readonly visibleRect: DOMRectReadOnly;
  readonly colorSpace?: { readonly fullRange: boolean | null };
  readonly displayWidth: number;
  readonly displayHeight: number;
  allocationSize(): number;
  copyTo(to: Uint8Array): Promise<{ offset: number; stride: number }[]>;
  clone(): VideoFrame;
  close(): void;
}
declare const VideoFrame: { new(source: HTMLVideoElement, options: { timestamp: number }): VideoFrame };

interface MediaTrackCapabilities {
  torch?: boolean;
}
interface MediaTrackConstraintSet {
  torch?: boolean;
}
interface Navigator {
  readonly connection?: { readonly saveData: boolean };
}

interface ExtendableEvent extends Event {
  waitUntil(promise: Promise<unknown>): void;
}
interface FetchEvent extends ExtendableEvent {
  readonly request: Request;
  respondWith(response: Promise<Response>): void;
}
interface WindowEventMap {
  install: ExtendableEvent;
  activate: ExtendableEvent;
  fetch: FetchEvent;
}
interface Window {
  readonly registration: ServiceWorkerRegistration;
}
/** Of the line that `modar web` writes before sw.js. */
declare const SITE: { hash: string; files: Record<string, number> };

declare module '*/engine-plain.js' {
  export default function load(options: object): Promise<unknown>;
}
declare module '*/engine-simd.js' {
  export default function load(options: object): Promise<unknown>;
}
declare module '*/engine-update.js' {
  export default function load(options: object): Promise<unknown>;
}
