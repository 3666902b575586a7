// Step 5: what the bundle weighs, whether it is good, and the forms in which it leaves this
// machine.
import {ask, askJson} from './api.js';
import {button, finding, head, icon, meter, name, percent} from './parts.js';
import {isBaking, state, tellError} from './state.js';
import {bytes, said, sentence, t, told} from './words.js';

const m = window.m;
const KINDS = ['page', 'zip', 'apk', 'release'];
/** Milliseconds between looks at whether the server is still at work. */
const BUSY_MS = 150;
/** Parts that are named one by one; the others are one line. */
const NAMED_PARTS = 6;

const whole = (text) => sentence(text) + (/[.!?]$/.test(text) ? '' : '.');

/**
 * What the checker or the bake found, in the page's language where it has the words: see said().
 */
function issue({id, text: english, cure: remedy, place}) {
  const rule = told(`issue.${id}`, english);
  const {text, cure, ...more} = id.includes('.') ?
      said({code: id, text: english, cure: remedy}) :
      {...rule, cure: told(`issue.${id}.cure`, remedy).text};
  return {text: [place?.name && [name(place.name), ': '], whole(text)], cure: whole(cure), ...more};
}

/** In this machine's own program for files. */
const showFolder = () => ask('POST', 'show', {}).catch(tellError);

export class Ship {
  oninit() {
    this.title = state.project.name;
    this.passPhrase = '';
    this.asked = -1;
    this.check = this.sizes = this.devices = null;
    /** What cannot be made here, by kind: {text, cure}. */
    this.refused = new Map();
    this.making = null;
  }

  /** Of each bake anew. */
  async ask() {
    if (this.asked === state.baked || !state.project.bundle.baked) return;
    this.asked = state.baked;
    const each = async (key) => {
      try {
        this[key] = await askJson('GET', key);
      } catch (error) { tellError(error); }
      m.redraw();
    };
    await Promise.all(['check', 'sizes', 'devices'].map(each));
  }

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
        if (error.code === 'studio.busy')
          await new Promise((done) => {
            setTimeout(done, BUSY_MS);
          });
        else asked = this.refuse(kind, error);
      }
    }
    m.redraw();
  }

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
    const parts = [...this.sizes.parts].sort((a, b) => b.bytes - a.bytes);
    const rest = parts.slice(NAMED_PARTS).reduce((sum, part) => sum + part.bytes, 0);
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
                      m('td', bytes(part.bytes)),
                      m('td', m('meter', {
                          min: 0,
                          max: 1,
                          value: part.bytes / this.sizes.bytes,
                          'aria-label': percent(part.bytes / this.sizes.bytes)
                        })))))));
  }

  phones() {
    if (!this.devices) return null;
    return m(
        'section', m('h2', t('devices')),
        m('ul.devices', this.devices.map(({name: device, title, fits, findings}) => {
          const remarks = findings.filter(({severity}) => severity !== 'info');
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
                {kind: kind === 'page' ? '.primary' : '.quiet', disabled: this.making !== null}),
        busy && m('p', {role: 'status'}, meter(state.progress?.done ?? 0, t('preparing'))),
        refused && finding({...refused, severity: 'error'}),
        done &&
            m('div.made', {role: 'status'}, icon('check'),
              m('div', m('p', t('made')),
                m('p', m('code', name(`${state.project.folder}/${done.path}`))),
                m('p.row', button(t('showFolder'), showFolder, {kind: '.link.small'}),
                  done.url &&
                      m('a.small', {href: done.url, target: '_blank', rel: 'noopener'},
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
