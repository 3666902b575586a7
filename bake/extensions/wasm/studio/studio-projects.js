// @ts-check
// Where the projects of the static studio are: in this browser, or in a folder that the person has granted; and the menu behind the
// project's name that changes between them.
import {button, icon} from './parts.js';
import {edit, state, tellError} from './state.js';
import {t} from './words.js';

const m = window.m;
/** Of this browser's private file system: one folder for each project. */
const PROJECTS = 'modar-projects';
const CHOSEN = 'modar-studio-project';
/** In a project: what the worker unpacks when the project is opened. */
export const ARCHIVE = 'import.zip';
const FIRST = 'project';

/** @typedef {{name: string, folder?: FileSystemDirectoryHandle}} Chosen folder: granted; else in the browser */

// ---- the choice, and the list ----

/**
 * The handle of the granted folder: only this kind of store takes it.
 * @param {FileSystemDirectoryHandle} [handle] to be kept
 * @returns {Promise<FileSystemDirectoryHandle | undefined>}
 */
const granted = (handle) => new Promise((resolve, reject) => {
  const opening = indexedDB.open(PROJECTS, 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore('folder');
  opening.onerror = () => reject(opening.error);
  opening.onsuccess = () => {
    const folders = opening.result.transaction('folder', 'readwrite').objectStore('folder');
    const done = handle ? folders.put(handle, 'last') : folders.get('last');
    done.onsuccess = () => resolve(handle ?? done.result);
    done.onerror = () => reject(done.error);
  };
});

/**
 * @param {string} name of a project in this browser; empty: the granted folder
 */
export function choose(name) {
  localStorage.setItem(CHOSEN, name);
  location.reload();
}

/** @returns {Promise<Chosen>} the project of the last time */
export async function chosen() {
  const name = localStorage.getItem(CHOSEN) ?? FIRST;
  const folder = name ? undefined : await granted().catch(() => undefined);
  return folder ? {name: folder.name, folder} : {name: name || FIRST};
}

/** The folder of this browser that has its projects. */
const ownProjects = async () => (await navigator.storage.getDirectory()).getDirectoryHandle(PROJECTS, {create: true});

async function names() {
  /** @type {string[]} */
  const found = [];
  for await (const [name] of /** @type {any} */ (await ownProjects()).entries()) found.push(name);
  return found.sort();
}

/**
 * @param {string} wanted
 * @returns {Promise<string>} a name that no project has: "vase", "vase-2"
 */
async function freeName(wanted) {
  const taken = await names();
  const stem = wanted.replace(/[/\\]/g, '').replace(/^\.+/, '').slice(0, 60) || FIRST;
  const free = [stem, ...taken.map((_, i) => `${stem}-${i + 2}`)];
  return /** @type {string} */ (free.find((name) => !taken.includes(name)));
}

/**
 * May the page write there? Browsers ask the person on a press of a button alone.
 * @param {FileSystemDirectoryHandle} folder
 * @param {'queryPermission' | 'requestPermission'} method
 * @returns {Promise<boolean>}
 */
export const mayWrite = async (folder, method) => await /** @type {any} */ (folder)[method]({mode: 'readwrite'}) === 'granted';

// ---- what the menu does ----

async function openNew() {
  choose(await freeName(FIRST));
}

async function openFolder() {
  const folder = await /** @type {any} */ (window).showDirectoryPicker({id: 'modar', mode: 'readwrite'});
  await granted(folder);
  choose('');
}

/** @param {File} file a project as the studio exports it */
async function openArchive(file) {
  const name = await freeName(file.name.replace(/\.zip$/i, ''));
  const project = await (await ownProjects()).getDirectoryHandle(name, {create: true});
  try {
    const writing = await /** @type {any} */ (await project.getFileHandle(ARCHIVE, {create: true})).createWritable();
    await writing.write(file);
    await writing.close();
  } catch (error) {
    await (await ownProjects()).removeEntry(name, {recursive: true});
    throw error;
  }
  choose(name);
}

/** @param {string} name */
async function remove(name) {
  if (!confirm(t('static.removeSure', {name}))) return;
  await (await ownProjects()).removeEntry(name, {recursive: true});
}

/** The page shows an error of the action; a person who closes the dialog of folders has changed their mind. */
const told = (/** @type {() => Promise<unknown>} */ action) => () => action().catch(tellError);

/** The project's name, which opens the menu. */
export class Projects {
  constructor() {
    this.open = false;
    /** @type {string[]} */
    this.names = [];
  }

  async toggle() {
    this.open = !this.open;
    if (this.open) this.names = await names().catch(() => []);
    m.redraw();
  }

  /** @param {string} name */
  async remove(name) {
    await remove(name);
    this.names = await names();
    m.redraw();
  }

  places() {
    const now = window.modarStatic?.chosen;
    return m('ul', this.names.map((name) => {
      const open = !now?.folder && now?.name === name;
      return m(
          'li', {key: name}, button(name, () => choose(name), {disabled: open, dir: 'auto'}),
          !open && button(t('static.remove'), told(() => this.remove(name)), {kind: '.quiet'}));
    }));
  }

  menu() {
    return m(
        'section.projects', {'aria-label': t('static.projects')},
        m('label', t('static.name'), m('input', {
            type: 'text',
            value: state.project.name,
            maxlength: 60,
            onchange: (/** @type {any} */ {target}) => edit({op: 'set', table: 'project', key: 'name', value: target.value.trim()})
          })),
        m('h2', t('static.inBrowser')), this.places(), button(t('static.new'), told(openNew)),
        'showDirectoryPicker' in window && button(t('static.folder'), told(openFolder)),
        m('label', t('static.archive'), m('input', {
            type: 'file',
            accept: '.zip',
            onchange: (/** @type {any} */ {target}) => target.files[0] && told(() => openArchive(target.files[0]))()
          })));
  }

  view() {
    return [
      m('button.project', {type: 'button', 'aria-expanded': String(this.open), title: t('static.projects'), onclick: () => this.toggle()},
        m('bdi', state.project.name), icon('pencil')),
      !window.modarStatic?.kept && m('strong.unkept', t('static.unkept')), this.open && this.menu()
    ];
  }
}
