// @ts-check
// What a visitor reads and hears, in the visitor's language.
import {fetchBytes} from './download.js';
import {strandedFile} from './engine.js';

/** Bundlers follow an address that is written out. */
/** @type {Record<string, () => URL>} */
const ADDRESSES = {
  de: () => new URL('./words/de.json', import.meta.url),
  el: () => new URL('./words/el.json', import.meta.url),
  en: () => new URL('./words/en.json', import.meta.url),
  es: () => new URL('./words/es.json', import.meta.url),
  fr: () => new URL('./words/fr.json', import.meta.url),
  it: () => new URL('./words/it.json', import.meta.url),
  nl: () => new URL('./words/nl.json', import.meta.url),
  pl: () => new URL('./words/pl.json', import.meta.url),
};
/** Written from right to left. */
const FROM_RIGHT = ['ar', 'dv', 'fa', 'he', 'ku', 'ps', 'sd', 'ug', 'ur', 'yi'];

/** @param {string} language */
export const directionOf = (language) =>
    (FROM_RIGHT.includes(language.split('-')[0]) ? 'rtl' : 'ltr');

/** @param {string | URL} address */
export async function fetchJson(address) {
  return JSON.parse(new TextDecoder().decode(await fetchBytes(address)));
}

/**
 * {language, words}: of this language, else English.
 * @param {string} tag
 */
export async function wordsFor(tag) {
  const wanted = tag.toLowerCase().split('-')[0];
  const language = ADDRESSES[wanted] ? wanted : 'en';
  return {
    language,
    words: await fetchJson(strandedFile(`words/${language}.json`) ?? ADDRESSES[language]())
  };
}

/**
 * "Loading: {percent} %" with values in place of names.
 * @param {string} text
 * @param {Record<string, string | number>} [values]
 */
export const fill = (text, values = {}) =>
    text.replace(/\{(\w+)\}/g, (_, name) => String(values[name] ?? ''));

/**
 * @param {ParentNode} root
 * @param {string} name
 * @returns {NodeListOf<HTMLElement>}
 */
const elementsWith = (root, name) => root.querySelectorAll(`[data-${name}]`);

/**
 * Fills the elements that name their word.
 * @param {ParentNode} root
 * @param {Record<string, string>} words
 */
export function showWords(root, words) {
  for (const element of elementsWith(root, 'word'))
    element.textContent = words[element.dataset.word ?? ''];
  for (const element of elementsWith(root, 'label')) {
    const label = words[element.dataset.label ?? ''];
    element.setAttribute('aria-label', label);
    if (['a', 'button'].includes(element.localName)) element.title = label;
  }
}

/**
 * The texts of a pattern in this language, else in the first of its own: {language, name,
 * picture, text, alt}. Without the author's name, the content has its models' and the picture
 * its own.
 *
 * @param {import('./modar-viewer.js').ViewerPattern} pattern
 * @param {string} wanted
 * @returns {{ language: string, name: string, picture: string, text: string, alt: string }}
 */
export function labelOf({title, models = '', texts = {}}, wanted) {
  const language =
      [wanted, wanted.split('-')[0], ...Object.keys(texts)].find((each) => texts[each]) ?? '';
  const own = texts[language];
  return {
    language,
    name: own?.name ?? (models || title),
    picture: own?.name ?? title,
    text: own?.text ?? '',
    alt: own?.alt ?? '',
  };
}
