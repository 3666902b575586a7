// @ts-check
// The studio: a bar of steps, and the step that the address names: #/scene/cover.
import {ask} from './api.js';
import {Files, filesOf, receive} from './files.js';
import {icon, meter, part, percent, tool} from './parts.js';
import {Picture} from './picture.js';
import {Scene} from './scene.js';
import {Ship} from './ship.js';
import {cancel, isBakeable, listen, load, missingFiles, redo, state, tellError, undo} from './state.js';
import {Try} from './try.js';
import {bytes, firstLanguage, LANGUAGES, languageName, sentence, t, useLanguage} from './words.js';

const m = window.m;
const VIEWS = {
  files: Files,
  picture: Picture,
  scene: Scene,
  try: Try,
  ship: Ship
};
/** @typedef {keyof typeof VIEWS} View */
const STEPS = /** @type {View[]} */ (Object.keys(VIEWS));
/** Milliseconds that a message stays, unless it is pointed at or reports an error. */
const NOTICE_MS = 6000;

let noticeTimer = 0;
/** @type {typeof state.notice} */
let noticed = null;
let ended = false;
let draggedOver = false;

/** {view, name} of the address. A name that the project does not have falls back to the first. */
function place() {
  const [view, ...name] = location.hash.replace(/^#\/?/, '').split('/');
  const known = STEPS.find((each) => each === view) ?? 'files';
  const wanted = decodeURIComponent(name.join('/'));
  const {patterns} = state.project;
  return {
    view: known,
    pattern: patterns.find((each) => each.name === wanted) ?? patterns[0] ?? null
  };
}

/**
 * @param {View} view
 * @param {string} pattern
 */
export const addressOf = (view, pattern = '') =>
    `#/${view}${pattern ? `/${encodeURIComponent(pattern)}` : ''}`;

/**
 * What each step waits for: null where it may be opened.
 * @param {View} view
 */
function obstacle(view) {
  const {patterns, models} = state.project;
  if (view === 'picture' && !patterns.length) return t('needPicture');
  if (view === 'scene' && !(patterns.length && models.length)) return t('needBoth');
  if ((view === 'try' || view === 'ship') && !isBakeable()) return t('needScene');
  return null;
}

// ---- the bar ----

/**
 * @param {View} now
 * @param {Studio.Pattern | null} pattern
 */
function steps(now, pattern) {
  return m('nav.steps', {'aria-label': t('steps')}, m('ol', STEPS.map((view, i) => {
             const why = obstacle(view);
             return m(
                 'li', {key: view},
                 m('a', {
                   ...(why ? {role: 'link', 'aria-disabled': 'true'} : {
                     href: addressOf(view, ['picture', 'scene'].includes(view) ? pattern?.name : '')
                   }),
                   'aria-current': view === now && 'step',
                   title: why ?? '',
                 },
                   m('span.count', i + 1), m('span', t(`step.${view}`))));
           })));
}

function status() {
  const {progress, failure, project} = state;
  if (state.gone) return m('span.status.bad', icon('bad'), t('gone'));
  if (progress) {
    return m(
        'span.status', meter(progress.done, t('preparing')), m('span', percent(progress.done)),
        tool(t('cancel'), 'close', cancel));
  }
  if (failure)
    return m(
        'a.status.bad', {href: addressOf(failure.kind === 'bake' ? 'files' : 'ship')}, icon('bad'),
        t('notPrepared'));
  if (!project.bundle.baked) return null;
  return m('span.status', icon('check'), t('prepared', {size: bytes(project.bundle.bytes)}));
}

/**
 * @param {View} now
 * @param {Studio.Pattern | null} pattern
 */
function bar(now, pattern) {
  const {project} = state;
  return m(
      'header.bar',
      m('div.brand', m('img', {src: 'engine/icon.svg', alt: '', width: 28, height: 28}),
        window.modarStatic ? m(window.modarStatic.Projects) :
                             m('bdi', {title: project.folder}, project.name)),
      steps(now, pattern),
      m('div.tools', m('div.state', {role: 'status'}, status()),
        tool(t('undo'), 'undo', undo, {disabled: !project.undo, 'aria-keyshortcuts': 'Control+Z'}),
        tool(
            t('redo'), 'redo', redo,
            {disabled: !project.redo, 'aria-keyshortcuts': 'Control+Shift+Z'}),
        m('select.language', {
          'aria-label': t('language'),
          onchange: (event) => useLanguage(event.target.value).then(m.redraw)
        },
          LANGUAGES.map(
              (tag) =>
                  m('option', {
                    value: tag,
                    lang: tag,
                    selected: tag === document.documentElement.lang,
                    'aria-label': languageName(tag)
                  },
                    tag.toUpperCase()))),
        tool(t('quit'), 'power', quit)));
}

async function quit() {
  await ask('POST', 'quit', {}).catch(() => {});
  ended = true;
  m.redraw();
}

// ---- messages ----

function notice() {
  const {notice: told} = state;
  if (told !== noticed) {
    noticed = told;
    clearTimeout(noticeTimer);
    if (told && !told.bad) noticeTimer = setTimeout(hush, NOTICE_MS);
  }
  return m(
      'div.notices', {'aria-live': told?.bad ? 'assertive' : 'polite'},
      told &&
          m(`div.notice${told.bad ? '.bad' : ''}`,
            {onpointerenter: () => clearTimeout(noticeTimer)}, icon(told.bad ? 'bad' : 'check'),
            m('div', m('p', {dir: 'auto'}, sentence(told.text)),
              told.cure && m('p.cure', {dir: 'auto'}, sentence(told.cure)),
              told.detail && m('small', {dir: 'auto', lang: 'en'}, told.detail)),
            tool(t('close'), 'close', hush)));
}

function hush() {
  state.notice = null;
  m.redraw();
}

/** Files may be dropped anywhere, at any time. */
function dropping() {
  /** @param {DragEvent} event */
  const over = (event) => {
    if (!event.dataTransfer?.types.includes('Files')) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
    if (draggedOver) return;
    draggedOver = true;
    m.redraw();
  };
  addEventListener('dragenter', over);
  addEventListener('dragover', over);
  addEventListener('dragleave', (event) => {
    if (event.relatedTarget) return;
    draggedOver = false;
    m.redraw();
  });
  addEventListener('drop', async (event) => {
    draggedOver = false;
    if (!event.dataTransfer?.types.includes('Files')) return;
    event.preventDefault();
    if (!location.hash.startsWith('#/files') && !missingFiles().length)
      location.hash = addressOf('files');
    await receive(await filesOf(event.dataTransfer));
  });
}

/** Undo by keys, but not while a text is typed, which has its own. */
function shortcuts() {
  addEventListener('keydown', (event) => {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !['z', 'y'].includes(key)) return;
    const {target} = event;
    if (target instanceof Element && target.matches('textarea, input[type="text"]')) return;
    event.preventDefault();
    (key === 'y' || event.shiftKey ? redo : undo)();
  });
}

// ---- the whole ----

const Studio = {
  view() {
    if (ended) return m('main.end', m('h1', t('ended')), m('p', t('endedLead')));
    if (!state.project)
      return state.gone ? m('main.end', m('h1', t('gone')), m('p', t('goneLead'))) :
                          m('main.end', {'aria-busy': 'true'}, m('p', t('opening')));
    const {view, pattern} = place();
    const shown = obstacle(view) ? 'files' : view;
    const attributes = {
      pattern,
      key: shown === 'picture' || shown === 'scene' ? `${shown} ${pattern.name}` : shown
    };
    return [
      bar(shown, pattern),
      m('main', {'aria-labelledby': 'title', class: shown}, m(VIEWS[shown], attributes)), notice(),
      draggedOver && m('aside.drop-here', {'aria-label': t('dropHere')}, m('p', t('dropHere')))
    ];
  },
};

/** Who comes by keys or a screen reader begins at the screen's head. */
function opened() {
  const focused = document.activeElement;
  if (focused instanceof HTMLElement)
    focused.blur();  // typed text counts, and is stored while its field is still there
  m.redraw();
  requestAnimationFrame(() => document.getElementById('title')?.focus({preventScroll: true}));
}

async function begin() {
  await useLanguage(firstLanguage());
  m.mount(part(document.body, '#studio', HTMLElement), Studio);
  addEventListener('hashchange', opened);
  dropping();
  shortcuts();
  try {
    listen();
    await load();
    if (!location.hash) location.replace(addressOf('files'));
  } catch (error) {
    state.gone = true;
    tellError(error);
  }
}

begin();
