// @ts-check
// The project as the server has it, and every change of it: one place, so that undo, the file on
// disk and the view agree.
import {ask, askJson, pathOf, Refused} from './api.js';
import {bytes, said, t} from './words.js';

/**
 * Milliseconds without a change after which the bundle is baked anew: trades an answer soon
 * against bakes that are thrown away. Changes here are drawn at once, and followed by more;
 * changes in other editors appear with the bake.
 */
const BAKE_AFTER_MS = {
  here: 300,
  byHand: 50
};

/** @typedef {keyof typeof BAKE_AFTER_MS} Where */
/** @typedef {Studio.Edit | ((now: Studio.Project) => Studio.Edit[])} Wish */
/** @typedef {Studio.Score & { pending?: undefined, failed?: undefined }} Known */
/** @typedef {{ pending: true, failed?: undefined }} Asked */
/** @typedef {{ pending?: undefined, failed: Studio.Wrong }} Failed */
/** @typedef {{ found?: Studio.Rival[], pending?: boolean }} Rivals */

export const state = {
  /** @type {Studio.Project} the page draws none of it before load() */
  project: /** @type {never} */ (null),
  /** @type {{ kind: string, stage: string, done: number, eta_s?: number } | null} 0 to 1 */
  progress: null,
  /** @type {Studio.Failure | null} why the last bake or export failed */
  failure: null,
  /** Counts bakes: the stage loads the bundle anew. */
  baked: 0,
  /** @type {Map<string, Known | Asked | Failed>} answers of api/score by pattern */
  scores: new Map(),
  /** @type {Map<string, Rivals>} what each pattern is taken for */
  rivals: new Map(),
  /** @type {Map<string, { path: string, url?: string }>} the last exports by kind */
  exported: new Map(),
  gone: false,
  /** @type {(Studio.Said & { bad: boolean }) | null} a message that goes away */
  notice: null,
};

/** @type {Promise<unknown>} */
let queue = Promise.resolve();
let bakeTimer = 0;
/** The person has cancelled: nothing is baked until something changes. */
let halted = false;

const redraw = () => window.m.redraw();

/** @param {unknown} error */
export const isGone = (error) => error instanceof Refused && error.status === 0;
/**
 * The file on disk, or the server's work, is not what the request takes it for.
 * @param {unknown} error
 */
const isConflict = (error) => error instanceof Refused && error.status === 409;

/**
 * @param {Studio.Child} text
 * @param {{ cure?: Studio.Child, detail?: string, bad?: boolean }} more
 */
export function tell(text, {cure = '', detail = '', bad = false} = {}) {
  state.notice = {text, cure, detail, bad};
  redraw();
}

/**
 * An error in words. A request that the page itself gave up reports nothing.
 * @param {unknown} error
 */
export function tellError(error) {
  if (error instanceof Error && error.name === 'AbortError') return;
  const words = said(/** @type {Studio.Wrong} */ (error));
  if (error instanceof Refused && error.status === 0) state.gone = true;
  else tell(words.text, {...words, bad: true});
  redraw();
}

/** @param {string} name */
export const patternOf = (name) => state.project?.patterns.find((pattern) => pattern.name === name);
/** @param {string} name */
export const modelOf = (name) => state.project?.models.find((model) => model.name === name);
/** @param {string} pattern */
export const scenesOf = (pattern) =>
    state.project?.scenes.filter((scene) => scene.pattern === pattern && scene.model) ?? [];
export const missingFiles = () =>
    state.project?.models.flatMap((model) => model.missing.map((file) => ({model, file}))) ?? [];

/** Nodes that must be visible to have a place: a model that has all its files, on a picture. */
export const isBakeable = () => (state.project?.scenes.length ?? 0) > 0;

/**
 * What a picture's grade follows from.
 * @param {Studio.Pattern} pattern
 */
const lookOf = ({
  file,
  corners,
  width_mm: width,
  height_mm: height,
  kind,
  arc_deg: arc,
  top_mm: top,
  bottom_mm: bottom,
  box_mm: box
}) => JSON.stringify([file, corners, width, height, kind, arc, top, bottom, box]);

/**
 * @param {Studio.Project} project
 * @param {Where} where
 */
function take(project, where = 'here') {
  /** @type {Studio.Project | null} */
  const before = state.project;
  state.project = project;
  /** @param {Studio.Pattern[]} patterns */
  const looks = (patterns = []) =>
      JSON.stringify(patterns.map(({name, file, corners}) => [name, file, corners]));
  if (looks(before?.patterns) !== looks(project.patterns)) state.rivals.clear();
  for (const pattern of project.patterns) {
    const known = before?.patterns.find(({name}) => name === pattern.name);
    if (!known || lookOf(known) !== lookOf(pattern)) state.scores.delete(pattern.name);
  }
  if ((project.bundle.stale || !project.bundle.baked) && !state.failure && !halted && isBakeable())
    bakeSoon(where);
  redraw();
}

export async function load() { take(await askJson('GET', 'project'), 'byHand'); }

/**
 * Changes wait for one another: each names the revision that the one before has made.
 * @template Done
 * @param {() => Promise<Done>} work
 */
function queued(work) {
  const done = queue.then(work);
  queue = done.catch(() => {});
  return done;
}

/**
 * @param {Studio.Project} before
 * @param {Studio.Project} after
 * @param {Wish} each
 */
function sameScene(before, after, each) {
  if (typeof each === 'function' || each.table !== 'scene' || each.index === undefined) return true;
  const [was, now] = [before.scenes[each.index], after.scenes[each.index]];
  return was?.pattern === now?.pattern && was?.model === now?.model;
}

/**
 * Several edits are one step of undo; a function answers those that a project needs. Where the file
 * has changed meanwhile, they are made again if they still mean the same.
 * @param {Wish[]} wanted
 */
export function edit(...wanted) {
  const send = () => {
    const {project} = state;
    const edits = wanted.flatMap((each) => (typeof each === 'function' ? each(project) : [each]));
    return askJson('POST', 'edit', {revision: project.revision, edits});
  };
  return queued(async () => {
           const before = state.project;
           state.failure = null;
           halted = false;
           try {
             take(await send());
           } catch (error) {
             if (!isConflict(error)) throw error;
             await load();
             if (!wanted.every((each) => sameScene(before, state.project, each))) throw error;
             take(await send());
           }
         })
      .catch(tellError);
}

/**
 * Keys of a table as modar.toml has them; null takes one out.
 * @param {Studio.Edit} which
 * @param {Studio.Values} values
 * @returns {Studio.Edit[]}
 */
const changes = (which, values) => Object.entries(values).map(
    ([key, value]) =>
        (value === null ? {op: 'remove', ...which, key} : {op: 'set', ...which, key, value}));

/**
 * A scene that modar.toml does not name, but has by the names of its files, has no index.
 * @param {Studio.Scene} scene
 */
const whichScene = ({index, pattern, model}) =>
    ({table: 'scene', ...(index === null ? {pattern, model} : {index})});

/**
 * values: keys, or a function that answers them for the scene of the moment when its turn comes:
 * changes add up, however fast they follow.
 * @param {Studio.Scene} scene
 * @param {Studio.Values | ((now: Studio.Scene) => Studio.Values)} values
 */
export const setScene = (scene, values) => edit((project) => {
  /** @param {Studio.Scene} each */
  const same = (each) => each.pattern === scene.pattern && each.model === scene.model;
  const now = project.scenes.find((each) => same(each) && each.index === scene.index) ??
      project.scenes.find(same);
  return now ? changes(whichScene(now), typeof values === 'function' ? values(now) : values) : [];
});
/**
 * @param {string} name
 * @param {Studio.Values} values
 */
export const setPattern = (name, values) => edit(...changes({table: 'pattern', name}, values));
/**
 * @param {string} name
 * @param {Studio.Values} values
 */
export const setModel = (name, values) => edit(...changes({table: 'model', name}, values));
/**
 * @param {string} pattern
 * @param {string} model
 */
export const addScene = (pattern, model) =>
    edit({op: 'add', table: 'scene', value: {pattern, model}});
/** @param {Studio.Scene} scene */
export const deleteScene = (scene) => edit({op: 'delete', ...whichScene(scene)});
/**
 * @param {'model' | 'pattern'} table
 * @param {string} name
 */
export const deleteAsset = (table, name) => edit({op: 'delete', table, name});
export const begin = () =>
    queued(async () => take(await askJson('POST', 'init', {}))).catch(tellError);

export const undo = () =>
    queued(async () => take(await askJson('POST', 'undo', {}))).catch(tellError);
export const redo = () =>
    queued(async () => take(await askJson('POST', 'redo', {}))).catch(tellError);

/** Bytes that the server takes of a file, see kMostUploadBytes of server.cpp. */
const MOST_BYTES = 2 ** 31;

/**
 * Sends files one after the other. Answers what the server said of each.
 * @param {Studio.Sent[]} files
 * @param {(done: number, total: number, file: string) => void} onProgress
 */
export async function addFiles(files, onProgress) {
  /** @type {{ name: string, added?: string[], problems?: Studio.Wrong[] }[]} */
  const told = [];
  for (const [i, {name, blob}] of files.entries()) {
    onProgress(i, files.length, name);
    if (blob.size > MOST_BYTES) {  // the server would hang up
      told.push({
        name,
        problems: [{said: {text: t('tooLarge', {size: bytes(blob.size)}), cure: t('tooLargeCure')}}]
      });
      continue;
    }
    try {
      const answer = await queued(() => askJson('PUT', `files/${pathOf(name)}`, blob));
      told.push({name, ...answer});
    } catch (error) {
      if (isGone(error)) throw error;
      told.push({name, problems: [/** @type {Studio.Wrong} */ (error)]});
    }
  }
  onProgress(files.length, files.length, '');
  await load();
  return told;
}

/**
 * A running job is ended if its result is no longer wanted, and waited for if it is another one
 * or if files have changed meanwhile, which may be unrelated: it ends with an event.
 * @param {Where} where
 */
async function bake(where) {
  try {
    if (state.progress?.kind === 'bake' && where === 'here') await ask('DELETE', 'job');
    else if (!state.progress) {
      state.progress = {kind: 'bake', stage: '', done: 0};
      redraw();
      const [, shown = ''] = /^#\/(?:picture|scene)\/(.+)/.exec(location.hash) ?? [];
      await ask('POST', 'bake', {shown: decodeURIComponent(shown)});
    }
  } catch (error) {
    state.progress = null;
    if (!isConflict(error)) tellError(error);
  }
}

/** @param {Where} where */
function bakeSoon(where) {
  clearTimeout(bakeTimer);
  bakeTimer = setTimeout(() => {
    bakeTimer = 0;
    bake(where);
  }, BAKE_AFTER_MS[where]);
}

/** Whether a bake runs, or is about to. */
export const isBaking = () => bakeTimer !== 0 || state.progress?.kind === 'bake';

/**
 * A bake that read a file while it was written is made again.
 * @param {Studio.Failure | null} failure
 */
const lasting = (failure) => (failure?.code === 'project.changing' ? null : failure);

/**
 * modar.toml or a file of it has been changed in an editor: what failed or was cancelled before
 * may do now.
 */
function follow() {
  if (state.failure?.kind === 'bake') state.failure = null;
  halted = false;
  queued(load).catch(tellError);
}

export async function cancel() {
  halted = true;
  await ask('DELETE', 'job').catch(tellError);
}

/** @param {string} name */
export async function loadScore(name) {
  if (state.scores.get(name)?.pending) return;
  state.scores.set(name, {pending: true});
  try {
    const score = await askJson('GET', `score?pattern=${encodeURIComponent(name)}`);
    state.scores.set(name, score);
  } catch (error) { state.scores.set(name, {failed: /** @type {Studio.Wrong} */ (error)}); }
  redraw();
}

/**
 * What a phone may take a picture for, of the project's others.
 * @param {string} name
 */
export async function loadRivals(name) {
  if (state.rivals.has(name)) return;
  if (state.project.patterns.length < 2) {
    state.rivals.set(name, {found: []});
    return;
  }
  const asked = {pending: true};
  state.rivals.set(name, asked);
  redraw();
  const found = await askJson('GET', `rivals?pattern=${encodeURIComponent(name)}`)
                    .then(({rivals}) => rivals, () => []);  // its own error is the score's
  if (state.rivals.get(name) === asked) state.rivals.set(name, {found});
  redraw();
}

/**
 * The bundle that was baked last, once for all that draws it.
 * @type {{ baked: number, bytes: Promise<Uint8Array> } | null}
 */
let bundle = null;

export function bundleBytes() {
  const {baked} = state;
  if (bundle?.baked !== baked)
    bundle = {
      baked,
      bytes: ask('GET', 'bundle')
                 .then((answer) => answer.arrayBuffer())
                 .then((buffer) => new Uint8Array(buffer))
    };
  return bundle.bytes;
}

/** What happens on the server, as it happens. */
export function listen() {
  const events = new EventSource('api/events');
  /**
   * @template Told
   * @param {string} type
   * @param {(told: Told) => void} act
   */
  const on = (type, act) => events.addEventListener(type, (event) => {
    const {data} = /** @type {MessageEvent<string | undefined>} */ (event);
    act(data ? JSON.parse(data) : {});
    redraw();
  });
  on('progress', (/** @type {typeof state.progress} */ progress) => {
    state.progress = progress;
  });
  /** @typedef {{ revision?: string, files?: boolean }} ProjectTold */
  on('project', (/** @type {ProjectTold} */ {revision, files = false}) => {
    if (files || revision !== state.project?.revision) follow();
  });
  /** @typedef {{ errors?: Studio.Wrong[] }} BakedTold */
  on('baked', (/** @type {BakedTold} */ {errors = []}) => {
    Object.assign(state, {
      progress: null,
      failure: lasting(errors.length ? {kind: 'bake', ...errors[0], errors} : null)
    });
    ++state.baked;
    queued(load).catch(tellError);
  });
  on('shown', () => {  // what the screen shows is there before the rest
    ++state.baked;
    queued(load).catch(tellError);
  });
  on('failed', (/** @type {Studio.Failure} */ failure) => {
    Object.assign(state, {progress: null, failure: lasting(failure)});
    if (!state.failure) queued(load).catch(tellError);
  });
  on('cancelled', () => {
    state.progress = null;
    queued(load).catch(tellError);
  });
  /** @typedef {{ kind: string, path: string, url?: string }} Exported */
  on('exported', (/** @type {Exported} */ {kind, path, url}) => {
    state.progress = null;
    state.exported.set(kind, {path, url});
    queued(load).catch(tellError);  // what has changed meanwhile is baked now
  });
  events.onerror = () => {
    state.gone = true;
    redraw();
  };
  events.onopen = () => {
    if (!state.gone) return;
    state.gone = false;  // after a while without the server much may have changed
    queued(load).catch(tellError);
  };
}
