// @ts-check
// Step 5: what the bundle weighs, whether it is good, and the forms in which it leaves this
// machine.
import {ask, askJson, Refused} from './api.js';
import {button, finding, head, icon, meter, name, percent} from './parts.js';
import {isBaking, state, tellError} from './state.js';
import {bytes, said, sentence, t, told} from './words.js';

const m = window.m;
/** @typedef {import('./parts.js').Shape} Shape */
/** @typedef {{ name: string, title: string, fits: boolean, findings: Studio.Finding[] }} Device */

/** Of a static page, whose project is in the browser: what can be downloaded. */
const STATIC = 'modarStatic' in globalThis;
const KINDS = STATIC ? ['zip', 'project'] : ['page', 'zip', 'apk', 'release'];
/** Milliseconds between looks at whether the server is still at work. */
const BUSY_MS = 150;
/** Milliseconds after which a file that is being saved has been read. */
const SAVED_MS = 60000;
/** Parts that are named one by one; the others are one line. */
const NAMED_PARTS = 6;

/** @param {string} text */
const whole = (text) => sentence(text) + (/[.!?]$/.test(text) ? '' : '.');

/**
 * What the checker or the bake found, in the page's language where it has the words: see said().
 * @param {Omit<Studio.Finding, 'severity'>} found
 * @returns {Studio.Said}
 */
function issue({id, text: english, cure: remedy, place}) {
  const rule = told(`issue.${id}`, english);
  /** @type {{ text: string, cure: string, lang?: string, detail?: string }} */
  const {text, cure, ...more} = id.includes('.') ?
      said({code: id, text: english, cure: remedy}) :
      {...rule, cure: told(`issue.${id}.cure`, remedy).text};
  return {text: [place?.name && [name(place.name), ': '], whole(text)], cure: whole(cure), ...more};
}

/** In this machine's own program for files. */
const showFolder = () => ask('POST', 'show', {}).catch(tellError);

/**
 * Downloads what a link names: browsers do not ask service workers for it.
 * @param {MouseEvent} event
 */
async function save(event) {
  event.preventDefault();
  const {href} = /** @type {HTMLAnchorElement} */ (event.currentTarget);
  const link = document.createElement('a');
  link.href = URL.createObjectURL(await (await fetch(href)).blob());
  link.download = decodeURIComponent(href.slice(href.lastIndexOf('/') + 1));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), SAVED_MS);
}

export class Ship {
  constructor() {
    this.title = state.project.name;
    this.passPhrase = '';
    this.asked = -1;
    /**
     * @type {{ good: boolean, errors: number, warnings: number, findings: Studio.Finding[] } |
     *     null}
     */
    this.check = null;
    /** @type {{ bytes: number, parts: { kind: string, name: string, bytes: number }[] } | null} */
    this.sizes = null;
    /** @type {Device[] | null} */
    this.devices = null;
    /** @type {Map<string, Studio.Said>} what cannot be made here, by kind */
    this.refused = new Map();
    /** @type {string | null} */
    this.making = null;
  }

  /** Of each bake anew. */
  async ask() {
    if (this.asked === state.baked || !state.project.bundle.baked) return;
    this.asked = state.baked;
    /** @param {'check' | 'sizes' | 'devices'} key */
    const each = async (key) => {
      try {
        this[key] = await askJson('GET', key);
      } catch (error) { tellError(error); }
      m.redraw();
    };
    await Promise.all([each('check'), each('sizes'), each('devices')]);
  }

  /** @param {string} kind */
  async make(kind) {
    this.refused.delete(kind);
    state.exported.delete(kind);
    this.making = kind;
    const wish = {
      kind,
      title: this.title,
      ...(kind === 'release' && this.passPhrase ? {pass_phrase: this.passPhrase} : {})
    };
    for (let asked = false; !asked;) {
      while (isBaking())
        await new Promise((done) => {
          setTimeout(done, BUSY_MS);
        });  // the last change leaves
      try {
        await ask('POST', 'export', wish);
        asked = true;
      } catch (error) {
        if (error instanceof Refused && error.code === 'studio.busy')
          await new Promise((done) => {
            setTimeout(done, BUSY_MS);
          });
        else asked = this.refuse(kind, /** @type {Refused} */ (error));
      }
    }
    m.redraw();
  }

  /**
   * @param {string} kind
   * @param {Refused} error
   */
  refuse(kind, error) {
    this.making = null;
    this.refused.set(kind, {
      ...said(error),
      ...(error.package && {cure: t('install', {packages: [error.package].flat().join(' ')})})
    });
    return true;
  }

  // ---- what it is ----

  verdict() {
    const {check} = this;
    if (!check)
      return m('section', m('h2', t('verdict')), m('p.small', {'aria-busy': 'true'}, t('judging')));
    const words = check.good ? (check.warnings ? t('goodBut', {n: check.warnings}) : t('good')) :
                               t('notGood', {n: check.errors});
    return m(
        'section.judged', m('h2', t('verdict')),
        m(`p.verdict-words${check.good ? '.good' : '.not-good'}`,
          icon(check.good ? 'check' : 'bad'), words),
        check.findings.filter(({severity}) => severity !== 'info')
            .map(
                ({severity, place, ...found}) => finding(
                    {severity, ...issue({...found, place})},
                    place &&
                        m('p',
                          m('a', {
                            href: `#/${place.view}${
                                place.name ? `/${encodeURIComponent(place.name)}` : ''}`
                          },
                            t('goThere'))))));
  }

  weights() {
    if (!this.sizes) return null;
    const {bytes: sum} = this.sizes;
    const parts = [...this.sizes.parts].sort((a, b) => b.bytes - a.bytes);
    const rest = parts.slice(NAMED_PARTS).reduce((all, part) => all + part.bytes, 0);
    const shown =
        [...parts.slice(0, NAMED_PARTS), ...(rest ? [{kind: 'rest', name: '', bytes: rest}] : [])];
    return m(
        'section', m('h2', t('weighs', {size: bytes(this.sizes.bytes)})),
        m('table.weights',
          m('thead.unseen', m('tr', m('th', t('part')), m('th', t('size')), m('th', t('share')))),
          m('tbody',
            shown.map(
                (part, i) =>
                    m('tr', {key: i},
                      m('th', {scope: 'row'}, t(`part.${part.kind}`),
                        part.name ? [' ', name(part.name)] : ''),
                      m('td', bytes(part.bytes)), m('td', m('meter', {
                                                      min: 0,
                                                      max: 1,
                                                      value: part.bytes / sum,
                                                      'aria-label': percent(part.bytes / sum)
                                                    })))))));
  }

  phones() {
    if (!this.devices) return null;
    return m(
        'section', m('h2', t('devices')),
        m('ul.devices', this.devices.map(({name: device, title, fits, findings}) => {
          const remarks = findings.filter(({severity}) => severity !== 'info');
          /** @type {[kind: string, shape: Shape, words: string]} */
          const [kind, shape, words] = !fits ? ['fails', 'bad', 'fitsNot'] :
              remarks.length                 ? ['limits', 'warn', 'fitsBut'] :
                                               ['fits', 'check', 'fits'];
          return m(
              'li', {key: device, class: kind}, icon(shape),
              m('span', told(`device.${device}`, title || device).text,
                m('span.unseen', ` ${t(words)}`), remarks.map((found) => {
                  const {text, cure, lang} = issue(found);
                  return m('small', {dir: 'auto', lang}, text, ' ', cure);
                })));
        })));
  }

  // ---- how it leaves ----

  /** @param {string} kind */
  way(kind) {
    const done = state.exported.get(kind);
    if (done && this.making === kind) this.making = null;
    const refused =
        this.refused.get(kind) ?? (state.failure?.kind === kind ? said(state.failure) : null);
    if (refused && this.making === kind) this.making = null;
    const busy = this.making === kind;
    const lacks = kind === 'apk' && state.project.app;
    return m(
        'li.way-out', {key: kind},
        m('div', m('h2', t(`ship.${kind}`)), m('p.small', t(`ship.${kind}Words`))),
        kind === 'release' &&
            m('div.field',
              m('label',
                { for: 'pass'
                },
                t('passPhrase')),
              m('input', {
                id: 'pass',
                type: 'password',
                autocomplete: 'off',
                value: this.passPhrase,
                oninput: (event) => {
                  this.passPhrase = event.target.value;
                }
              })),
        lacks ?
            finding({...said(lacks), severity: 'note'}) :
            button(
                t(`ship.${kind}Make`), () => this.make(kind),
                {kind: kind === KINDS[0] ? '.primary' : '.quiet', disabled: this.making !== null}),
        busy && m('p', {role: 'status'}, meter(state.progress?.done ?? 0, t('preparing'))),
        refused && finding({...refused, severity: 'error'}),
        done &&
            m('div.made', {role: 'status'}, icon('check'),
              m('div', m('p', t('made')),
                !STATIC && m('p', m('code', name(`${state.project.folder}/${done.path}`))),
                m('p.row', !STATIC && button(t('showFolder'), showFolder, {kind: '.link.small'}),
                  done.url &&
                      m('a.small', {
                        href: done.url,
                        ...(STATIC ? {onclick: save} : {target: '_blank', rel: 'noopener'})
                      },
                        t('download')),
                  kind === 'page' && m('a.small', {href: '#/try'}, t('tryOnPhone'))))));
  }

  view() {
    this.ask();
    return m(
        'div.screen.ship', head(t('ship'), t('shipLead')),
        m('div.columns',
          m('section.out',
            m('div.field',
              m('label',
                { for: 'page-title'
                },
                t('pageTitle')),
              m('input', {
                id: 'page-title',
                type: 'text',
                dir: 'auto',
                value: this.title,
                oninput: (event) => {
                  this.title = event.target.value;
                }
              })),
            m('ul', KINDS.map((kind) => this.way(kind)))),
          m('div.facts', this.verdict(), this.weights(), this.phones())));
  }
}
