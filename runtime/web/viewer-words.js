// What a visitor reads and hears, in the visitor's language.
import { ModarError, strandedFile } from './engine.js';

/** Bundlers follow an address that is written out. */
const ADDRESSES = {
  de: () => new URL('./words/de.json', import.meta.url), el: () => new URL('./words/el.json', import.meta.url),
  en: () => new URL('./words/en.json', import.meta.url), es: () => new URL('./words/es.json', import.meta.url),
  fr: () => new URL('./words/fr.json', import.meta.url), it: () => new URL('./words/it.json', import.meta.url),
  nl: () => new URL('./words/nl.json', import.meta.url), pl: () => new URL('./words/pl.json', import.meta.url),
};
/** Written from right to left. */
const FROM_RIGHT = ['ar', 'dv', 'fa', 'he', 'ku', 'ps', 'sd', 'ug', 'ur', 'yi'];

export const directionOf = (language) => (FROM_RIGHT.includes(language.split('-')[0]) ? 'rtl' : 'ltr');

export async function fetchJson(address) {
  const response = await fetch(address);
  if (!response.ok) throw new ModarError({ code: 'web.download', where: String(address), cause: `the server answered ${response.status}` });
  return response.json();
}

/** {language, words}: of this language, else English. */
export async function wordsFor(tag) {
  const wanted = tag.toLowerCase().split('-')[0];
  const language = ADDRESSES[wanted] ? wanted : 'en';
  return { language, words: await fetchJson(strandedFile(`words/${language}.json`) ?? ADDRESSES[language]()) };
}

/** "Loading: {percent} %" with values in place of names. */
export const fill = (text, values = {}) => text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '');

/** Fills the elements that name their word. */
export function showWords(root, words) {
  for (const element of root.querySelectorAll('[data-word]')) element.textContent = words[element.dataset.word];
  for (const element of root.querySelectorAll('[data-label]')) {
    const label = words[element.dataset.label];
    element.setAttribute('aria-label', label);
    if (['a', 'button'].includes(element.localName)) element.title = label;
  }
}

/** What is said of a pattern in this language, else in the first of its own: {language, name, text, alt}. */
export function labelOf({ title, texts = {} }, wanted) {
  const language = [wanted, wanted.split('-')[0], ...Object.keys(texts)].find((each) => texts[each]) ?? '';
  return { language, name: title, text: '', alt: '', ...texts[language] };
}
