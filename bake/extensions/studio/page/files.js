// @ts-check
// Step 1: what the project is made of. Pictures and models are dropped here; what a model lacks is
// named.
import {askJson, thumb} from './api.js';
import {button, finding, grade, head, icon, meter, name, noThumb, tool} from './parts.js';
import {addFiles, addScene, begin, deleteAsset, isGone, missingFiles, patternOf, scenesOf, setPattern, state, tell, tellError} from './state.js';
import {ModelThumb} from './thumbs.js';
import {length, number, said, t} from './words.js';

const m = window.m;

/** @type {{ done: number, total: number, name: string } | null} the upload */
let sending = null;
/**
 * What the server said of files that are not well, and what it is about.
 * @typedef {object} Problem
 * @property {Studio.Wrong} [problem]
 * @property {{ text: string, cure: string }} [said]
 * @property {string} [file]
 * @property {number} [line]
 * @property {'model' | 'pattern'} [table]
 * @property {string} [name]
 */
/** @type {Problem[]} of the files that came last */
let problems = [];
/** Pictures and models that stand side by side, without scrolling. */
const FEW = 2;
/** @type {Set<string>} pictures whose corners somebody should look at */
export const unsure = new Set();

/** Kinds that people have and nothing here reads, which would be unused in the project. */
const FOREIGN = {
  photo: /\.(hei[cf]|avif|gif|svg|pdf|psd|ai|dng|nef|cr[23]|arw|orf|rw2|raf)$/i,
  model: /\.(fbx|dae|blend|3ds|max|usd[acz]?|step|stp|iges|skp|3mf|c4d|ma|mb|lwo|x3d|wrl|ztl)$/i
};
/** @param {string} file */
const foreignKind = (file) =>
    Object.entries(FOREIGN).find(([, pattern]) => pattern.test(file))?.[0];

/** A model's own files go first: what they name as texture is no picture to be found. */
const ORDER = [/\.(mtl|bin)$/i, /\.(obj|gltf|glb|ply|stl)$/i, /\.zip$/i];
/** @param {Studio.Sent} sent */
const rank = ({name: file}) => {
  const found = ORDER.findIndex((pattern) => pattern.test(file));
  return found < 0 ? ORDER.length : found;
};

/**
 * @param {FileSystemEntry} entry
 * @returns {entry is FileSystemDirectoryEntry}
 */
const isFolder = (entry) => entry.isDirectory;

/** @param {FileSystemDirectoryEntry} folder */
async function entriesOf(folder) {
  const reader = folder.createReader();
  /** @type {FileSystemEntry[]} */
  const all = [];
  for (;;) {
    /** @type {FileSystemEntry[]} */
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return all;
    all.push(...some);
  }
}

/**
 * @param {FileSystemEntry} entry
 * @param {string} path
 * @param {Studio.Sent[]} found
 */
async function walk(entry, path, found) {
  if (entry.name.startsWith('.')) return;
  if (isFolder(entry))
    for (const each of await entriesOf(entry)) await walk(each, `${path}${entry.name}/`, found);
  else
    found.push({
      name: path + entry.name,
      blob: await new Promise(
          (resolve, reject) => /** @type {FileSystemFileEntry} */ (entry).file(resolve, reject))
    });
}

/**
 * Dropped files, folders unfolded. A single folder is the project: its own name is left out.
 * @param {DataTransfer} transfer
 */
export async function filesOf(transfer) {
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry?.() ?? []);
  if (!entries.length) return [...transfer.files].map((file) => ({name: file.name, blob: file}));
  /** @type {Studio.Sent[]} */
  const found = [];
  const [top] = entries;
  const tops = entries.length === 1 && isFolder(top) ? await entriesOf(top) : entries;
  for (const entry of tops) await walk(entry, '', found);
  return found;
}

/**
 * A photo and a model that come to an empty project are meant for each other: the model is on
 * the picture at once.
 */
async function pair() {
  const {models, patterns, scenes} = state.project;
  if (models.length === 1 && patterns.length === 1 && !scenes.length)
    await addScene(patterns[0].name, models[0].name);
}

/** @param {Studio.Point[]} corners */
export const toHundredths = (corners) =>
    corners.map((corner) => corner.map((value) => Number(value.toFixed(2))));

/**
 * Of photos that are new, what stands out as the picture is cut out. A scan, which it fills or
 * in which nothing stands out, stays unchanged.
 * @param {string[]} files
 */
async function findPictures(files) {
  for (const pattern of state.project.patterns.filter(
           (each) => files.includes(each.file) && !each.corners)) {
    try {
      const {corners, cut, doubt} = await askJson('POST', 'corners', {file: pattern.file});
      if (cut) await setPattern(pattern.name, {corners: toHundredths(corners)});
      if (doubt) unsure.add(pattern.name);
    } catch (error) {
      if (isGone(error)) throw error;
    }
  }
}

/** @param {Studio.Sent[]} files */
export async function receive(files) {
  if (!files.length) return;
  try {
    const foreign = files.filter(({name: file}) => foreignKind(file))
                        .map(({name: file}) => ({
                               said: {
                                 text: t(`foreign.${foreignKind(file)}`),
                                 cure: t(`foreign.${foreignKind(file)}Cure`)
                               },
                               file
                             }));
    const told = await addFiles(
        files.filter(({name: file}) => !foreignKind(file)).sort((a, b) => rank(a) - rank(b)),
        (done, total, file) => {
          sending = {done, total, name: file};
          m.redraw();
        });
    problems = [
      ...foreign,
      ...told.flatMap(
          ({name: file, problems: some = []}) =>
              some.map((problem) => ({problem, said: problem.said, file})))
    ];
    if (!problems.length)
      tell(
          t('filesAdded',
            {n: told.reduce((sum, {added = []}) => sum + Math.max(1, added.length), 0)}));
    await findPictures(told.flatMap(({added = []}) => added));
    await pair();
  } catch (error) { tellError(error); } finally {
    sending = null;
    m.redraw();
  }
}

/**
 * A button that opens the browser's own choice of files.
 * @param {string} label
 * @param {{ folder?: boolean, kind?: string, shape?: import('./parts.js').Shape }} options
 */
const chooser = (label, {folder = false, kind = '', shape} = {}) =>
    m('label.button' + kind, shape && icon(shape), m('span', label), m('input.unseen', {
        type: 'file',
        multiple: true,
        webkitdirectory: folder || undefined,
        onchange: (event) => {
          receive([...event.target.files ?? []].map(
              (file) => ({
                name: file.webkitRelativePath.split('/').slice(1).join('/') || file.name,
                blob: file
              })));
          event.target.value = '';  // the same ones again are a change, too
        },
      }));

/** @param {Studio.Pattern} pattern */
const pictureThumb = (pattern) =>
    m('span.thumb', icon('picture'),
      m('img', {src: thumb(pattern.file, 320), alt: '', loading: 'lazy', onerror: noThumb}));

/** @type {(table: 'model' | 'pattern', asset: string) => Studio.Drawn} */
const takeOut = (table, asset) => tool(
    t('takeOut', {name: asset}), 'trash', () => deleteAsset(table, asset), {class: 'take-out'});

/** @param {Studio.Pattern} pattern */
function pictureCard(pattern) {
  const standing = scenesOf(pattern.name).length;
  return m(
      'li', {key: pattern.name}, takeOut('pattern', pattern.name),
      m('a.card', {href: `#/picture/${encodeURIComponent(pattern.name)}`}, pictureThumb(pattern),
        m('span.about', m('b', name(pattern.name)), grade(pattern.grade),
          m('small',
            pattern.width_mm ? t('wide', {length: length(pattern.width_mm)}) : t('widthUnknown'),
            standing ? ` · ${t('standsOn', {n: standing})}` : ''))));
}

/** @param {Studio.Model} model */
function modelCard(model) {
  const scene =
      state.project.scenes.find((each) => each.model === model.name && patternOf(each.pattern));
  const content = [
    m(ModelThumb, {model: model.name}),
    m('span.about', m('b', name(model.name)),
      m('small',
        model.missing.length ? [icon('warn'), t('incomplete')] :
            model.triangles  ? t('triangles', {n: model.triangles}) :
                               ''))
  ];
  return m(
      'li', {key: model.name}, takeOut('model', model.name),
      scene ? m('a.card', {href: `#/scene/${encodeURIComponent(scene.pattern)}`}, content) :
              m('div.card', content));
}

/** What models name and the folder lacks, where it is seen at once. */
const lacking = () =>
    state.project.models.filter(({missing}) => missing.length)
        .map(
            (model) =>
                m('div.lacking', {key: model.name},
                  finding(
                      {
                        text: [
                          name(model.name), ' – ', t('missing', {files: model.missing.join(', ')})
                        ],
                        cure: t('missingCure')
                      },
                      m('p', chooser(t('chooseIt'), {kind: '.quiet.small'})))));

const welcome = () =>
    m('div.welcome',
      m('div.art', {'aria-hidden': 'true'}, icon('picture'), icon('add'), icon('model')),
      head(t('welcome'), t('welcomeLead')),
      m('p.row', chooser(t('chooseFiles'), {kind: '.primary'}),
        chooser(t('chooseFolder'), {folder: true, kind: '.quiet'})),
      m('p.small', t('welcomeKinds')));

/**
 * The folder has files and no project yet.
 * @param {{ models: number, pictures: number }} count
 */
const found = ({models, pictures}) =>
    m('div.welcome',
      m('div.art', {'aria-hidden': 'true'}, icon('picture'), icon('add'), icon('model')),
      head(
          t('found'),
          t('foundLead',
            {models: t('modelCount', {n: models}), pictures: t('pictureCount', {n: pictures})})),
      m('p.row', button(t('beginHere'), begin, {kind: '.primary'})));

/**
 * @param {string} title
 * @param {import('./parts.js').Shape} shape
 * @param {number} count
 * @param {Studio.Child[]} cards
 * @param {string} empty
 */
const group = (title, shape, count, cards, empty) => m(
    'section.group', m('h2', title, ' ', m('span.number-of', number(count))),
    count ?
        m('ul.cards', cards) :
        m('div.empty', icon(shape), m('p', empty), chooser(t('chooseFiles'), {kind: '.primary'})));

/**
 * Why nothing could be prepared from these files.
 * @returns {Problem[]}
 */
function failures() {
  const {failure, project} = state;
  if (failure?.kind !== 'bake') return [];
  return (failure.errors?.length ? failure.errors : [failure]).map((problem) => {
    const {where = ''} = problem;
    /** @param {Studio.Asset} asset */
    const isIt = ({file}) => file === where;
    const model = project.models.find(isIt);
    const asset = model ?? project.patterns.find(isIt);
    return {problem, file: where, table: asset && (model ? 'model' : 'pattern'), name: asset?.name};
  });
}

function whatNext() {
  const {models, patterns} = state.project;
  if (!patterns.length || !models.length) return null;
  return m(
      `a.button${missingFiles().length ? '.quiet' : '.primary'}`,
      {href: `#/picture/${encodeURIComponent(patterns[0].name)}`}, m('span', t('toPicture')),
      icon('next'));
}

export const Files = {
  view() {
    const {models, patterns, init, problems: wrong} = state.project;
    /** @type {Problem[]} */
    const all = [
      ...problems, ...wrong.map((problem) => ({problem, file: problem.file, line: problem.line})),
      ...failures()
    ];
    const busy = sending &&
        m('p.sending', {role: 'status'}, meter(sending.done / sending.total, t('sending')),
          sending.done < sending.total ?
              [
                t('sendingFile', {n: sending.total, done: sending.done + 1}), ' ',
                name(sending.name)
              ] :
              t('looking'));
    const told = all.length > 0 &&
        m('section.problems', {'aria-label': t('problems')},
          all.map(
              ({problem = {}, said: words = said(problem), file, line, table, name: asset}) =>
                  finding(
                      {
                        ...words,
                        text: [file && [name(file), line ? `:${line}` : '', ': '], words.text],
                        severity: 'error'
                      },
                      table && asset &&
                          m('p', button(t('remove'), () => deleteAsset(table, asset), {
                              kind: '.link.small'
                            })))));
    if (init) return m('div.screen.narrow', found(init), told);
    if (!models.length && !patterns.length) return m('div.screen.narrow', welcome(), busy, told);
    return m(
        'div.screen',
        m('div.top', head(t('files'), t('filesLead')),
          m('p.row', chooser(t('addFiles'), {kind: '.quiet', shape: 'add'}), whatNext())),
        busy, told, m('div', lacking()),
        m(`div.groups${Math.max(patterns.length, models.length) <= FEW ? '.few' : ''}`,
          group(
              t('pictures'), 'picture', patterns.length, patterns.map(pictureCard), t('nextPhoto')),
          group(t('models'), 'model', models.length, models.map(modelCard), t('nextModel'))));
  },
};
