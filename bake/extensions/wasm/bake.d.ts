// `modar` as a library: see README.md. Options are those of the commands, in camel case: {noLods: true, tier: 'phone'}.
import type * as commands from './commands.js';

/** What a call sets by itself. */
type Set = 'output' | 'json' | 'progressJson' | 'quiet' | 'sarif';
export type BakeOptions = Omit<commands.BakeOptions, Set>;
export type CheckOptions = Omit<commands.CheckOptions, Set>;
export type PatternRectifyOptions = Omit<commands.PatternRectifyOptions, Set>;
export type PatternScoreOptions = Omit<commands.PatternScoreOptions, Set>;

export type Contents = Uint8Array | ArrayBuffer | Blob;
/** By names such as "vase.glb" or "textures/wood.png", as the files name one another. */
export type Files = Record<string, Contents>;

export interface Run {
  /** Aborted, it ends the call, which rejects with the signal's reason. */
  signal?: AbortSignal;
  /** done: 0 to 1, of this stage. */
  onProgress?: (progress: {stage: string, done: number}) => void;
}

/** What a failed call rejects with. */
export declare class ModarError extends Error {
  /** Stable, like "obj.no-faces". */
  code: string;
  /** The file, or empty. */
  where: string;
  cause: string;
  /** What to do about it. */
  cure: string;
  /** The exit code of the command. */
  status?: number;
}

/** JSON as the command prints it, by the schemas next to json.md. */
export type Report = Record<string, any>;

/**
 * One bundle of the models and pictures. The options `model` and `pattern` name them where they have options of their own
 * ("poster.jpg:210mm"); without, all files are taken, each for what it is.
 * @returns the bundle, the report of `modar bake --json`, and what it says on stderr
 */
export function bake(files: Files, options?: BakeOptions, run?: Run): Promise<{bundle: Uint8Array, report: Report, messages: string}>;
/** The verdict of `modar check --json`, also of a bad bundle. files: what `source` names. */
export function check(bundle: Contents, options?: CheckOptions & {files?: Files}, run?: Run): Promise<Report>;
/** What a bundle holds, as `modar inspect --json` prints it. */
export function inspect(bundle: Contents, run?: Run): Promise<Report>;
/** Grade, range and advice for a picture as a pattern. */
export function scorePicture(picture: Contents, options?: PatternScoreOptions, run?: Run): Promise<Report>;
/** A frontal picture (PNG) of the flat thing in a photo; corners: where they were found, unless the options state them. */
export function rectify(photo: Contents, options?: PatternRectifyOptions, run?: Run):
    Promise<{picture: Uint8Array, corners?: Uint8Array, report: Report}>;
