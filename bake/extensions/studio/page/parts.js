// @ts-check
// Parts that every screen is made of. What people wrote is only ever text: nothing here or
// elsewhere makes HTML of it.
import {inUnit, number, numberIn, sentence, settings, t, typed, UNITS} from './words.js';

const m = window.m;
/** Milliseconds after the last step of a number until it counts. */
const STEPS_REST_MS = 350;
/** @type {Record<string, number>} steps of a number by its keys */
const WAYS = {
  ArrowUp: 1,
  ArrowDown: -1,
  PageUp: 10,
  PageDown: -10
};

const SHAPES = {
  picture: 'M4 5h16v14H4z M4 16l5-5 4 4 3-3 4 4 M15.5 9.5h.01',
  try: 'M8 3h8v18H8z M11 18h2',
  undo: 'M8 5L4 9l4 4 M4 9h10a5 5 0 0 1 0 10h-3',
  redo: 'M16 5l4 4-4 4 M20 9H10a5 5 0 0 0 0 10h3',
  add: 'M12 5v14 M5 12h14',
  close: 'M6 6l12 12 M18 6L6 18',
  next: 'M5 12h14 M13 6l6 6-6 6',
  check: 'M5 12.5l4.5 4.5L19 7.5',
  warn: 'M12 4l9 16H3z M12 10v4.5 M12 17.2v.1',
  bad: 'M12 3a9 9 0 1 0 .01 0z M12 7v6 M12 16.2v.1',
  flat: 'M4 8l12-3 4 11-12 3z',
  label:
      'M7 5v14 M17 5v14 M7 5a5 2 0 0 0 10 0a5 2 0 0 0-10 0 M7 19a5 2 0 0 0 10 0 M7 9a5 2 0 0 0 10 0 M7 15a5 2 0 0 0 10 0',
  cup: 'M5 6l2 12 M19 6l-2 12 M5 6a7 2.2 0 0 0 14 0a7 2.2 0 0 0-14 0 M7 18a5 1.8 0 0 0 10 0',
  box: 'M12 3l8 4v9l-8 5-8-5V7z M4 7l8 4 8-4 M12 11v10',
  camera: 'M4 8h4l2-2.5h4L16 8h4v11H4z M12 10a3.5 3.5 0 1 0 .01 0z',
  film: 'M4 6h12v12H4z M16 10.5l4-2.5v8l-4-2.5',
  model: 'M12 3l7 4v9l-7 4-7-4V7z M5 7l7 4 7-4 M12 11v9',
  power: 'M12 3.5v8 M7.2 6.6a8 8 0 1 0 9.6 0',
  tip: 'M9.5 17.5h5 M10.5 20.5h3 M8.5 14.6a6 6 0 1 1 7 0c-.7.6-1 1.4-1 2.2h-5c0-.8-.3-1.6-1-2.2z',
  pencil: 'M5 19l1-4L16.5 4.5l3 3L9 18z M14 7l3 3',
  trash: 'M5 7h14 M10 4h4 M7 7l1 13h8l1-13',
  upright: 'M12 17V4 M8 8l4-4 4 4 M5 20h14',
  move: 'M12 3v18 M3 12h18 M9 6l3-3 3 3 M9 18l3 3 3-3 M6 9l-3 3 3 3 M18 9l3 3-3 3',
  lift: 'M12 20V5 M7 10l5-5 5 5',
  turn: 'M5 12a7 7 0 1 1 3 5.7 M8 22v-4.5h4.5',
  size: 'M6 18L18 6 M11 6h7v7 M6 11v7h7',
};

/** @typedef {keyof typeof SHAPES} Shape */

/**
 * A part of an element that is always there.
 * @template {Element} Kind
 * @param {Element} dom
 * @param {string} selector
 * @param {new () => Kind} kind
 * @returns {Kind}
 */
export function part(dom, selector, kind) {
  const found = dom.querySelector(selector);
  if (found instanceof kind) return found;
  throw new Error(`no ${selector} on the page`);
}

/**
 * @param {Shape} name
 * @param {Studio.Attributes} [attributes]
 */
export const icon = (name, attributes = {}) =>
    m('svg.icon', {viewBox: '0 0 24 24', 'aria-hidden': 'true', ...attributes},
      m('path', {d: SHAPES[name]}));

/**
 * A button; busy ones answer no second press.
 * @param {string} label
 * @param {() => unknown} onclick
 * @param {Studio.Attributes & { kind?: string, shape?: Shape, after?: Shape }} options
 */
export const button = (label, onclick, {kind = '', shape, after, ...rest} = {}) =>
    m(`button${kind}`, {type: 'button', onclick, ...rest}, shape && icon(shape), m('span', label),
      after && icon(after));

/**
 * A button that is a picture alone; its name is read and shown as a tip.
 * @param {string} label
 * @param {Shape} shape
 * @param {() => unknown} onclick
 * @param {Studio.Attributes} [rest]
 */
export const tool = (label, shape, onclick, rest = {}) =>
    m('button.tool', {type: 'button', onclick, title: label, 'aria-label': label, ...rest},
      icon(shape));

/**
 * One of several, as a row of choices.
 * @template {string} Value
 * @param {string} name
 * @param {string} label
 * @param {[value: Value, label: string, shape?: Shape][]} options
 * @param {Value} value
 * @param {(chosen: Value) => unknown} onchoose
 * @param {{ kind?: string }} look
 */
export const choice = (name, label, options, value, onchoose, {kind = ''} = {}) =>
    m(`fieldset.choice${kind}`, m('legend', label),
      m('div.options',
        options.map(
            ([option, text, shape]) =>
                m('label', {key: String(option)}, m('input', {
                    type: 'radio',
                    name,
                    value: String(option),
                    checked: option === value,
                    onchange: () => onchoose(option)
                  }),
                  m('span', shape && icon(shape), text)))));

/**
 * value: null where the field is empty, which `empty` allows; onvalue is called with null then.
 * @typedef {object} FieldAttributes
 * @property {string} id
 * @property {string} label
 * @property {number | null} [value]
 * @property {number} [step]
 * @property {number} [least]
 * @property {number} [most]
 * @property {number} [digits]
 * @property {boolean} [empty]
 * @property {(value: number) => unknown} onvalue
 */
/**
 * @typedef {Studio.Vnode<FieldAttributes & { unit?: Studio.Child },
 *     { draft: string | null, timer: number }>} NumberVnode
 */

/** A number that is typed, or stepped with the arrow keys, and told once it is complete. */
export const NumberField = {
  /** @param {NumberVnode} vnode */
  oninit({state}) {
    state.draft = null;
    state.timer = 0;
  },
  /** @param {NumberVnode} vnode */
  onremove({state}) { clearTimeout(state.timer);},
  /** @param {NumberVnode} vnode */
  view({attrs, state}) {
    const {
      id,
      label,
      value,
      unit,
      step = 1,
      least = -Infinity,
      most = Infinity,
      digits = 2,
      empty = false,
      onvalue
    } = attrs;
    const tell = /** @type {(value: number | null) => unknown} */ (onvalue);
    const shown = state.draft ??
        (value === null || value === undefined ? '' : typed(Number(value.toFixed(digits))));
    /** @param {number} wanted */
    const within = (wanted) => Math.min(most, Math.max(least, Number(wanted.toFixed(digits))));
    /** @param {Studio.On<Event>} [event] */
    const finish = (event) => {
      clearTimeout(state.timer);
      // A field that is taken away loses the focus while the page is drawn, where Mithril would
      // draw at once: in the middle of itself.
      if (event?.type === 'blur') {
        event.redraw = false;
        queueMicrotask(m.redraw);
      }
      if (state.draft === null) return;
      const wanted = numberIn(state.draft);
      state.draft = null;
      if (wanted === null && !empty) return;
      if (wanted !== value) tell(wanted === null ? null : within(wanted));
    };
    /** @param {Studio.On<KeyboardEvent>} event */
    const keys = (event) => {
      const way = WAYS[event.key];
      if (event.key === 'Enter') finish();
      else if (event.key === 'Escape') state.draft = null;
      else if (way) {
        event.preventDefault();
        const from = numberIn(state.draft ?? '') ?? value ?? 0;
        state.draft = typed(within(from + way * step * (event.shiftKey ? 10 : 1)));
        clearTimeout(state.timer);
        state.timer = setTimeout(() => finish(), STEPS_REST_MS);
      } else event.redraw = false;
    };
    return m(
        'div.field',
        m('label',
          { for: id
          },
          label),
        m('span.number', m('input', {
            id,
            type: 'text',
            inputmode: 'decimal',
            autocomplete: 'off',
            spellcheck: false,
            value: shown,
            oninput: (event) => {
              state.draft = event.target.value;
            },
            onchange: finish,
            onblur: finish,
            onkeydown: keys
          }),
          typeof unit === 'string' ? m('span.unit', unit) : unit));
  },
};

/** A length in millimetres, in the unit that the person measures with. */
export const LengthField = {
  /** @param {Studio.Vnode<FieldAttributes & { choose?: boolean }>} vnode */
  view({
    attrs: {value, step = 1, least = -Infinity, most = Infinity, onvalue, choose = false, ...rest}
  }) {
    const tell = /** @type {(value: number | null) => unknown} */ (onvalue);
    const {unit} = settings;
    const factor = UNITS[unit];
    const units = choose &&
        m('select.unit', {
                    'aria-label': t('unit'),
                    value: unit,
                    onchange: (event) => {
                      settings.unit = event.target.value;
                    }
                  },
          Object.keys(UNITS).map(
              (name) => m('option', {value: name, selected: name === unit}, name)));
    return m(NumberField, {
      ...rest,
      value: value === null || value === undefined ? null : inUnit(value),
      unit: units || unit,
      step: unit === 'mm' ? step : step / 10,
      least: least / factor,
      most: most / factor,
      onvalue: (/** @type {number | null} */ wanted) =>
          tell(wanted === null ? null : wanted * factor)
    });
  },
};

/**
 * What a person reads of something that is not well, see said().
 * @param {Studio.Said} what
 * @param {Studio.Child[]} more
 */
export const finding = ({text, cure, detail, severity = 'warning', lang}, ...more) =>
    m(`div.finding.${severity}`,
      icon(
          severity === 'note'      ? 'tip' :
              severity === 'error' ? 'bad' :
                                     'warn'),
      m('div', m('p', {dir: 'auto', lang}, sentence(text)),
        cure && m('p.cure', {dir: 'auto', lang}, sentence(cure)),
        detail && m('small', {dir: 'auto', lang: 'en'}, detail), more));

/** @param {string | null} letter */
export const grade = (letter) => letter &&
    m('span.grade',
      {class: `grade-${letter}`, 'aria-label': t('gradeOf', {grade: letter}), role: 'img'}, letter);

/** @param {number} share */
export const percent = (share) => `${number(Math.round(100 * share))} %`;

/**
 * How far along work is: 0 to 1.
 * @param {number} share
 * @param {string} label
 */
export const meter = (share, label) => m('progress', {max: 1, value: share, 'aria-label': label});

/**
 * A screen's head, which gets the focus when the screen is opened.
 * @param {Studio.Child} title
 * @param {string} [lead]
 */
export const head = (title, lead) =>
    m('div.head', m('h1', {tabindex: -1, id: 'title'}, title), lead && m('p', lead));

/**
 * For an image that cannot be had: parts under it are visible.
 * @param {Studio.On<Event, HTMLImageElement>} event
 */
export const noThumb = (event) => {
  event.redraw = false;
  event.target.hidden = true;
};

/**
 * Users' names are isolated: their direction is their own.
 * @param {string} text
 */
export const name = (text) => m('bdi', text);
