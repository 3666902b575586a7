// @ts-check
// What the studio says, by language: words/LANGUAGE.json.

export const LANGUAGES = ['en', 'de'];
const KEPT = 'modar-studio-language';

/** @type {Record<string, any>} */
let words = {};
let plurals = new Intl.PluralRules('en');
let numbers = new Intl.NumberFormat('en');
let fields = numbers;
let decimal = '.';

/**
 * What a browser forbids to keep is not kept.
 * @param {string} [value]
 */
function kept(value) {
  try {
    if (value) localStorage.setItem(KEPT, value);
    return localStorage.getItem(KEPT);
  } catch { return null; }
}

/** Of the addresses that a person opens, `?lang=de` asks for a language. */
export const firstLanguage =
    () => [new URLSearchParams(location.search).get('lang'), kept(), ...navigator.languages]
              .map((tag) => (tag ?? '').toLowerCase().split('-')[0])
              .find((tag) => LANGUAGES.includes(tag)) ??
    LANGUAGES[0];

/** @param {string} language */
export async function useLanguage(language) {
  words = await (await fetch(`words/${language}.json`)).json();
  plurals = new Intl.PluralRules(language);
  numbers = new Intl.NumberFormat(language, {maximumFractionDigits: 2, useGrouping: true});
  fields = new Intl.NumberFormat(language, {maximumFractionDigits: 6, useGrouping: false});
  decimal = fields.format(0.5).charAt(1);
  document.documentElement.lang = language;
  document.title = words.studio;
  kept(language);
}

/**
 * The words of a key with {names} filled in; `key_one` replaces `key` where {n} is one.
 * @param {string} key
 * @param {Record<string, any>} [values]
 */
export function t(key, values = {}) {
  const one = 'n' in values && plurals.select(Number(values.n)) === 'one';
  const text = (one ? words[`${key}_one`] : undefined) ?? words[key] ?? key;
  return String(text).replace(
      /\{(\w+)\}/g,
      (/** @type {string} */ all, /** @type {string} */ name) =>
          (typeof values[name] === 'number' ? number(values[name]) : values[name] ?? all));
}

/**
 * What the server says in parts of a sentence, as one; of what begins with a file's name, the name
 * stays.
 * @param {any} text
 */
export const sentence = (text) =>
    (typeof text === 'string' && /^[a-z]+[ ,]/.test(text) ?
         text.charAt(0).toUpperCase() + text.slice(1) :
         text);

/**
 * What the server says is wrong, in the page's language: {text, cure}, with {q} for the first
 * thing that is quoted. Words of a code's room are used for a code that has none, and what the
 * server said follows them: {detail}. English, and what has no words, is the server's own.
 * @param {{ code?: string, error?: string, message?: string, text?: any, cure?: string }} wrong
 * @returns {{ text: any, cure: string, lang?: string, detail?: any }}
 */
export function said({code = '', error, message, text = error ?? message, cure = ''}) {
  const own = words[`error.${code}`];
  const [first, second] = own ?? words[`error.${code.split('.')[0]}`] ?? [text, cure];
  if (first === text) return {text, cure, lang: 'en'};
  /** @param {string} each */
  const fill = (each) => each.replace('{q}', /'([^']+)'/.exec(text)?.[1] ?? '').replace('  ', ' ');
  return {text: fill(first), cure: fill(second), ...(!own && {detail: text})};
}

/**
 * The words of a key, or what the server said in English: {text, lang}.
 * @param {string} key
 * @param {string} english
 */
export const told = (key, english) =>
    (words[key] ? {text: words[key]} : {text: english, lang: 'en'});

/** @param {number} value */
export const number = (value) => numbers.format(value);

/**
 * A number as a field shows it: without marks between thousands, which would be taken for decimals
 * when it is typed.
 * @param {number} value
 */
export const typed = (value) => fields.format(value);

/**
 * Text typed as a number: a comma is as good as a point. Where both are there, the last one is
 * the decimal mark; of one kind that is there more than once, or of the language's mark of
 * thousands before three digits, none is. null: it is no number.
 * @param {string} text
 */
export function numberIn(text) {
  const plain = text.replace(/[\s\u00a0\u202f'’]/g, '').replace('\u2212', '-');
  /** @type {string[]} */
  const marks = plain.match(/[.,]/g) ?? [];
  const last = marks.at(-1);
  const thousands = marks.length > 1 ?
      marks.filter((each) => each === last).length > 1 && new Set(marks).size === 1 :
      last !== undefined && last !== decimal && /^-?[1-9]\d{0,2}[.,]\d{3}$/.test(plain);
  const value = Number(
      thousands ? plain.replace(/[.,]/g, '') :
                  plain.replace(/[.,](?=.*[.,])/g, '').replace(',', '.'));
  return plain === '' || !Number.isFinite(value) ? null : value;
}

/** @param {string} tag */
export const languageName = (tag) => {
  try {
    const name =
        new Intl.DisplayNames([document.documentElement.lang], {type: 'language'}).of(tag) ?? tag;
    return name.charAt(0).toLocaleUpperCase() + name.slice(1);
  } catch {
    return tag;  // no tag of a language: shown as written
  }
};

/**
 * "1.2 MB"
 * @param {number} count
 */
export function bytes(count) {
  /** @type {[number, string, number][]} */
  const steps = [[1e6, 'MB', 1], [1e3, 'KB', 0]];
  const [size, unit, digits] = steps.find(([least]) => count >= least) ?? [1, 'B', 0];
  return `${number(Number((count / size).toFixed(digits)))} ${unit}`;
}

// ---- lengths ----

/**
 * Millimetres in the units that people measure with.
 * @type {Record<string, number>}
 */
export const UNITS = { mm: 1, cm: 10, in: 25.4 };
export const settings = {
  unit: document.documentElement.lang === 'en-US' ? 'in' : 'cm'
};

/**
 * Millimetres as a number of the chosen unit, with the digits that a ruler shows.
 * @param {number} mm
 */
export const inUnit = (mm, unit = settings.unit) =>
    Number((mm / UNITS[unit]).toFixed(unit === 'mm' ? 1 : 2));
/** @param {number} mm */
export const length = (mm) => `${number(inUnit(mm))} ${settings.unit}`;
