// @ts-check
// The project's pictures in a row: which of them the screen is about. One picture needs no row.
import {thumb} from './api.js';
import {grade, noThumb} from './parts.js';
import {state} from './state.js';
import {t} from './words.js';

const m = window.m;

/**
 * @param {string} view
 * @param {Studio.Pattern} chosen
 */
export const rail = (view, chosen) => state.project.patterns.length > 1 && m('nav.rail', { 'aria-label': t('pictures') }, m('ul',
  state.project.patterns.map((pattern) => m('li', { key: pattern.name }, m('a', {
    href: `#/${view}/${encodeURIComponent(pattern.name)}`, 'aria-current': pattern === chosen && 'true', title: pattern.name,
  }, m('img', { src: thumb(pattern.file, 160), alt: pattern.name, loading: 'lazy', onerror: noThumb }), grade(pattern.grade))))));
