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

export const state = {
  project: null,
  /** The work that runs: {kind, stage, done (0 to 1), eta_s}; null: none. */
  progress: null,
  /** Why the last bake or export failed: {kind, error, cure}. */
  failure: null,
  /** Counts bakes: the stage loads the bundle anew. */
  baked: 0,
  /** Answers of api/score by pattern. */
  scores: new Map(),
  /**
     What each pattern is taken for, by pattern: {found: [{pattern, times, views}]}, or {pending}.
   */
  rivals: new Map(),
  /** The last exports by kind: {path, url}. */
  exported: new Map(),
  gone: false,
  /** Messages that go away: {text, cure, bad}. */
  notice: null,
};

let queue = Promise.resolve();
let bakeTimer = 0;
/** The person has cancelled: nothing is baked until something changes. */
let halted = false;

const redraw = () => window.m.redraw();

export function tell(text, {cure = '', detail = '', bad = false} = {}) {
  state.notice = {text, cure, detail, bad};
  redraw();
}

/** An error in words. A request that the page itself gave up reports nothing. */
export function tellError(error) {
  if (error.name === 'AbortError') return;
  if (error instanceof Refused && error.status === 0) state.gone = true;
  else tell(said(error).text, {...said(error), bad: true});
  redraw();
}

export const patternOf = (name) => state.project?.patterns.find((pattern) => pattern.name === name);
export const modelOf = (name) => state.project?.models.find((model) => model.name === name);
export const scenesOf = (pattern) =>
    state.project?.scenes.filter((scene) => scene.pattern === pattern && scene.model) ?? [];
export const missingFiles = () =>
    state.project?.models.flatMap((model) => model.missing.map((file) => ({model, file}))) ?? [];

/** Nodes that must be visible to have a place: a model that has all its files, on a picture. */
export const isBakeable = () => (state.project?.scenes.length ?? 0) > 0;

/** What a picture's grade follows from. */
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

function take(project, where = 'here') {
  const before = state.project;
  state.project = project;
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

/** Changes wait for one another: each names the revision that the one before has made. */
function queued(work) {
  const done = queue.then(work);
  queue = done.catch(() => {});
  return done;
}

const sameScene = (before, after, each) => each.table !== 'scene' || each.index === undefined || [
  'pattern', 'model'
].every((key) => before.scenes[each.index]?.[key] === after.scenes[each.index]?.[key]);

/**
 * Several edits are one step of undo; a function answers those that a project needs. Where the file
 * has changed meanwhile, they are made again if they still mean the same.
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
             if (error.status !== 409) throw error;
             await load();
             if (!wanted.every((each) => sameScene(before, state.project, each))) throw error;
             take(await send());
           }
         })
      .catch(tellError);
}

/** Keys of a table as modar.toml has them; null takes one out. */
const changes = (which, values) => Object.entries(values).map(
    ([key, value]) =>
        (value === null ? {op: 'remove', ...which, key} : {op: 'set', ...which, key, value}));

/** A scene that modar.toml does not name, but has by the names of its files, has no index. */
const whichScene = ({index, pattern, model}) =>
    ({table: 'scene', ...(index === null ? {pattern, model} : {index})});

/**
 * values: keys, or a function that answers them for the scene of the moment when its turn comes:
 * changes add up, however fast they follow.
 */
export const setScene = (scene, values) => edit((project) => {
  const same = (each) => each.pattern === scene.pattern && each.model === scene.model;
  const now = project.scenes.find((each) => same(each) && each.index === scene.index) ??
      project.scenes.find(same);
  return now ? changes(whichScene(now), typeof values === 'function' ? values(now) : values) : [];
});
export const setPattern = (name, values) => edit(...changes({table: 'pattern', name}, values));
export const addScene = (pattern, model) =>
    edit({op: 'add', table: 'scene', value: {pattern, model}});
export const deleteScene = (scene) => edit({op: 'delete', ...whichScene(scene)});
export const deleteAsset = (table, name) => edit({op: 'delete', table, name});
export const begin = () =>
    queued(async () => take(await askJson('POST', 'init', {}))).catch(tellError);

export const undo = () =>
    queued(async () => take(await askJson('POST', 'undo', {}))).catch(tellError);
export const redo = () =>
    queued(async () => take(await askJson('POST', 'redo', {}))).catch(tellError);

/** Bytes that the server takes of a file, see kMostUploadBytes of server.cpp. */
const MOST_BYTES = 2 ** 31;

/** Sends files one after the other: {name, blob}. Answers what the server said of each. */
export async function addFiles(files, onProgress) {
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
      if (error.status === 0) throw error;
      told.push({name, problems: [error]});
    }
  }
  onProgress(files.length, files.length, '');
  await load();
  return told;
}

/**
 * A running job is ended if its result is no longer wanted, and waited for if it is another one
 * or if files have changed meanwhile, which may be unrelated: it ends with an event.
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
    if (error.status !== 409) tellError(error);
  }
}

function bakeSoon(where) {
  clearTimeout(bakeTimer);
  bakeTimer = setTimeout(() => {
    bakeTimer = 0;
    bake(where);
  }, BAKE_AFTER_MS[where]);
}

/** Whether a bake runs, or is about to. */
export const isBaking = () => bakeTimer !== 0 || state.progress?.kind === 'bake';

/** A bake that read a file while it was written is made again. */
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

export async function loadScore(name) {
  if (state.scores.get(name)?.pending) return;
  state.scores.set(name, {pending: true});
  try {
    const score = await askJson('GET', `score?pattern=${encodeURIComponent(name)}`);
    state.scores.set(name, score);
  } catch (error) { state.scores.set(name, {failed: error}); }
  redraw();
}

/** What a phone may take a picture for, of the project's others. */
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

/** The bundle that was baked last, once for all that draws it: {baked, bytes}. */
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
  const on = (type, act) => events.addEventListener(type, ({data}) => {
    act(data ? JSON.parse(data) : {});
    redraw();
  });
  on('progress', (progress) => {
    state.progress = progress;
  });
  on('project', ({revision, files = false}) => {
    if (files || revision !== state.project?.revision) follow();
  });
  on('baked', ({findings = [], errors = []}) => {
    Object.assign(state, {
      progress: null,
      failure: lasting(errors.length ? {kind: 'bake', ...errors[0], errors} : null),
      findings
    });
    ++state.baked;
    queued(load).catch(tellError);
  });
  on('shown', () => {  // what the screen shows is there before the rest
    ++state.baked;
    queued(load).catch(tellError);
  });
  on('failed', (failure) => {
    Object.assign(state, {progress: null, failure: lasting(failure)});
    if (!state.failure) queued(load).catch(tellError);
  });
  on('cancelled', () => {
    state.progress = null;
    queued(load).catch(tellError);
  });
  on('exported', ({kind, path, url}) => {
    state.progress = null;
    state.exported.set(kind, {path, url});
    queued(load).catch(tellError);  // what has changed meanwhile is baked now
  });
  on('phone', ({url}) => {
    state.phone = url;
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
