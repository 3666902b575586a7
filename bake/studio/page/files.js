// Step 1: what the project is made of. Pictures and models are dropped here; what a model lacks is named.
import { askJson, thumb } from './api.js';
import { button, finding, grade, head, icon, meter, name } from './parts.js';
import { addFiles, addScene, begin, missingFiles, patternOf, scenesOf, setPattern, state, tell, tellError } from './state.js';
import { modelViews } from './thumbs.js';
import { length, number, t } from './words.js';

const m = window.m;

/** What is being sent: {done, total, name}; null: nothing. */
let sending = null;
/** What the server said of the files that came last and are not well. */
let problems = [];
/** Pictures whose corners somebody should look at. */
export const unsure = new Set();

/** A model's own files go first: what they name as texture is no picture to be found. */
const ORDER = [/\.(mtl|bin)$/i, /\.(obj|gltf|glb|ply|stl)$/i, /\.zip$/i];
const rank = ({ name: file }) => {
  const found = ORDER.findIndex((pattern) => pattern.test(file));
  return found < 0 ? ORDER.length : found;
};

async function entriesOf(folder) {
  const reader = folder.createReader();
  const all = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return all;
    all.push(...some);
  }
}

async function walk(entry, path, found) {
  if (entry.name.startsWith('.')) return;
  if (entry.isDirectory) for (const each of await entriesOf(entry)) await walk(each, `${path}${entry.name}/`, found);
  else found.push({ name: path + entry.name, blob: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
}

/** What was dropped, folders unfolded. A single folder is the project: its own name is left out. */
export async function filesOf(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.length) return [...transfer.files].map((file) => ({ name: file.name, blob: file }));
  const found = [];
  const tops = entries.length === 1 && entries[0].isDirectory ? await entriesOf(entries[0]) : entries;
  for (const entry of tops) await walk(entry, '', found);
  return found;
}

/** A photo and a model that come to an empty project are meant for each other: the model stands on the picture at once. */
async function pair() {
  const { models, patterns, scenes } = state.project;
  if (models.length === 1 && patterns.length === 1 && !scenes.length) await addScene(patterns[0].name, models[0].name);
}

/** Of photos that are new, what stands out as the picture is cut out. A scan, which it fills, stays as it is. */
async function findPictures(files) {
  for (const pattern of state.project.patterns.filter((each) => files.includes(each.file) && !each.corners)) {
    try {
      const { corners, sure, reason } = await askJson('POST', 'corners', { file: pattern.file });
      if (reason === 'fills') continue;
      await setPattern(pattern.name, { corners });
      if (!sure) unsure.add(pattern.name);
    } catch (error) {
      if (error.status === 0) throw error;
      unsure.add(pattern.name);  // none was found: the person says where it is
    }
  }
}

export async function receive(files) {
  if (!files.length) return;
  try {
    const told = await addFiles([...files].sort((a, b) => rank(a) - rank(b)), (done, total, file) => {
      sending = { done, total, name: file };
      m.redraw();
    });
    problems = told.flatMap(({ name: file, problems: some = [] }) => some.map((problem) => ({ ...problem, file })));
    if (!problems.length) tell(t('filesAdded', { n: told.reduce((sum, { added = [] }) => sum + Math.max(1, added.length), 0) }));
    await findPictures(told.flatMap(({ added = [] }) => added));
    await pair();
  } catch (error) {
    tellError(error);
  } finally {
    sending = null;
    m.redraw();
  }
}

/** A button that opens the browser's own choice of files. */
const chooser = (label, { folder = false, kind = '', shape } = {}) => m('label.button' + kind, shape && icon(shape), m('span', label), m('input.unseen', {
  type: 'file', multiple: true, webkitdirectory: folder || undefined,
  onchange: (event) => {
    receive([...event.target.files].map((file) => ({ name: file.webkitRelativePath.split('/').slice(1).join('/') || file.name, blob: file })));
    event.target.value = '';  // the same ones again are a change, too
  },
}));

const noThumb = (event) => {
  event.redraw = false;
  event.target.hidden = true;
};

/** A model's views side by side, which a card turns, once they have been drawn. */
const modelThumb = (model) => m('span.thumb.turning', icon('model'), modelViews(model.name) && m('img', { src: modelViews(model.name), alt: '' }));
const pictureThumb = (pattern) => m('span.thumb', icon('picture'), m('img', { src: thumb(pattern.file, 320), alt: '', loading: 'lazy', onerror: noThumb }));

function pictureCard(pattern) {
  const standing = scenesOf(pattern.name).length;
  return m('li', { key: pattern.name }, m('a.card', { href: `#/picture/${encodeURIComponent(pattern.name)}` }, pictureThumb(pattern), m('span.about',
    m('b', name(pattern.name)), grade(pattern.grade), m('small', pattern.width_mm ? t('wide', { length: length(pattern.width_mm) }) : t('widthUnknown'),
      standing ? ` · ${t('standsOn', { n: standing })}` : ''))));
}

function modelCard(model) {
  const scene = state.project.scenes.find((each) => each.model === model.name && patternOf(each.pattern));
  const content = [modelThumb(model), m('span.about', m('b', name(model.name)), m('small', model.missing.length ? [icon('warn'), t('incomplete')] : model.triangles ? t('triangles', { n: model.triangles }) : ''))];
  return m('li', { key: model.name }, scene ? m('a.card', { href: `#/scene/${encodeURIComponent(scene.pattern)}` }, content) : m('div.card', content));
}

/** What models name and the folder lacks, where it is seen at once. */
const lacking = () => state.project.models.filter(({ missing }) => missing.length).map((model) => m('div.lacking', { key: model.name },
  finding({ text: [name(model.name), ' – ', t('missing', { files: model.missing.join(', ') })], cure: t('missingCure') }, m('p', chooser(t('chooseIt'), { kind: '.quiet.small' })))));

const welcome = () => m('div.welcome', m('div.art', { 'aria-hidden': 'true' }, icon('picture'), icon('add'), icon('model')),
  head(t('welcome'), t('welcomeLead')), m('p.row', chooser(t('chooseFiles'), { kind: '.primary' }), chooser(t('chooseFolder'), { folder: true, kind: '.quiet' })),
  m('p.small', t('welcomeKinds')));

/** The folder has files and no project yet. */
const found = ({ models, pictures }) => m('div.welcome', m('div.art', { 'aria-hidden': 'true' }, icon('picture'), icon('add'), icon('model')),
  head(t('found'), t('foundLead', { models: t('modelCount', { n: models }), pictures: t('pictureCount', { n: pictures }) })),
  m('p.row', button(t('beginHere'), begin, { kind: '.primary' })));

const group = (title, count, cards, empty) => m('section.group', m('h2', title, ' ', m('span.number-of', number(count))),
  count ? m('ul.cards', cards) : m('p.empty', empty));

function whatNext() {
  const { models, patterns } = state.project;
  if (!patterns.length) return m('p.next-words', t('nextPhoto'));
  if (!models.length) return m('p.next-words', t('nextModel'));
  return m(`a.button${missingFiles().length ? '.quiet' : '.primary'}`, { href: `#/picture/${encodeURIComponent(patterns[0].name)}` }, m('span', t('toPicture')), icon('next'));
}

export const Files = {
  view() {
    const { models, patterns, init, problems: wrong } = state.project;
    const all = [...problems, ...wrong.map(({ error, cure, file, line }) => ({ text: error, cure, file, line }))];
    const busy = sending && m('p.sending', { role: 'status' }, meter(sending.done / sending.total, t('sending')), sending.done < sending.total ? [t('sendingFile', { n: sending.total, done: sending.done + 1 }), ' ', name(sending.name)] : t('looking'));
    const told = all.length > 0 && m('section.problems', { 'aria-label': t('problems') }, all.map((problem) => finding({
      text: `${problem.file ? `${problem.file}${problem.line ? `:${problem.line}` : ''}: ` : ''}${problem.text}`, cure: problem.cure, lang: 'en' })));
    if (init) return m('div.screen.narrow', found(init), told);
    if (!models.length && !patterns.length) return m('div.screen.narrow', welcome(), busy, told);
    return m('div.screen', m('div.top', head(t('files'), t('filesLead')), m('p.row', chooser(t('addFiles'), { kind: '.quiet', shape: 'add' }), whatNext())), busy, told, m('div', lacking()),
      group(t('pictures'), patterns.length, patterns.map(pictureCard), t('nextPhoto')), group(t('models'), models.length, models.map(modelCard), t('nextModel')));
  },
};
