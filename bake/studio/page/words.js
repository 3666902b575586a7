// What the studio says, by language: words/LANGUAGE.json.

export const LANGUAGES = ['en', 'de'];
const KEPT = 'modar-studio-language';

let words = {};
let plurals = new Intl.PluralRules('en');
let numbers = new Intl.NumberFormat('en');

/** What a browser forbids to keep is not kept. */
function kept(value) {
  try {
    if (value) localStorage.setItem(KEPT, value);
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}

/** Of the addresses that a person opens, `?lang=de` asks for a language. */
export const firstLanguage = () => [new URLSearchParams(location.search).get('lang'), kept(), ...navigator.languages]
  .filter(Boolean).map((tag) => tag.toLowerCase().split('-')[0]).find((tag) => LANGUAGES.includes(tag)) ?? LANGUAGES[0];

export async function useLanguage(language) {
  words = await (await fetch(`words/${language}.json`)).json();
  plurals = new Intl.PluralRules(language);
  numbers = new Intl.NumberFormat(language, { maximumFractionDigits: 2, useGrouping: true });
  document.documentElement.lang = language;
  document.title = words.studio;
  kept(language);
}

/** The words of a key with {names} filled in; `key_one` stands for `key` where {n} is one. */
export function t(key, values = {}) {
  const one = 'n' in values && plurals.select(Number(values.n)) === 'one';
  const text = (one ? words[`${key}_one`] : undefined) ?? words[key] ?? key;
  return text.replace(/\{(\w+)\}/g, (all, name) => (typeof values[name] === 'number' ? number(values[name]) : values[name] ?? all));
}

/** What the server says in parts of a sentence, as one; of what begins with a file's name, the name stays. */
export const sentence = (text) => (typeof text === 'string' && /^[a-z]+[ ,]/.test(text) ? text.charAt(0).toUpperCase() + text.slice(1) : text);

/** The words of a key, or what the server said in English: {text, lang}. */
export const told = (key, english) => (words[key] ? { text: words[key] } : { text: english, lang: 'en' });

export const number = (value) => numbers.format(value);

export const languageName = (tag) => {
  try {
    const name = new Intl.DisplayNames([document.documentElement.lang], { type: 'language' }).of(tag);
    return name.charAt(0).toLocaleUpperCase() + name.slice(1);
  } catch {
    return tag;  // no tag of a language: shown as it is written
  }
};

/** "1.2 MB" */
export function bytes(count) {
  const steps = [[1e6, 'MB', 1], [1e3, 'KB', 0]];
  const [size, unit, digits] = steps.find(([least]) => count >= least) ?? [1, 'B', 0];
  return `${number(Number((count / size).toFixed(digits)))} ${unit}`;
}

// ---- lengths ----

/** Millimetres in the units that people measure with. */
export const UNITS = { mm: 1, cm: 10, in: 25.4 };
export const settings = { unit: document.documentElement.lang === 'en-US' ? 'in' : 'cm' };

/** Millimetres as a number of the chosen unit, with the digits that a ruler shows. */
export const inUnit = (mm, unit = settings.unit) => Number((mm / UNITS[unit]).toFixed(unit === 'mm' ? 1 : 2));
export const length = (mm) => `${number(inUnit(mm))} ${settings.unit}`;
