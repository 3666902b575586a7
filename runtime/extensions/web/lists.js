// @ts-check
// Lists over the camera's picture, of a page with several bundles: what to show, and the pictures
// that show it. Loaded by those who open them.

/**
 * What app.js hands over.
 * @typedef {{words: Record<string, string>, titles: string[], chosen: number,
 *     pictures: {title: string, image: Promise<string>}[], choose: (bundle: number) => void,
 *     look: (pattern: number) => void, own: () => void}} Choices
 */

const STYLE = `
#lists .row { flex-wrap: wrap; }
#lists [aria-pressed="true"] { outline: 3px solid var(--accent); outline-offset: 2px; }
#lists img { display: block; max-width: 6rem; max-height: 6rem; width: auto; height: auto; }
#lists .plate { padding: .3rem; display: grid; gap: .3rem; justify-items: center; }`;

/**
 * Opens the dialog; each choice closes it, as "back" does.
 * @param {Choices} choices
 * @param {typeof import('./viewer-parts.js').adopt} adopt
 */
export function openLists({words, titles, chosen, pictures, choose, look, own}, adopt) {
  let dialog = /** @type {HTMLDialogElement | null} */ (document.getElementById('lists'));
  if (!dialog) {
    adopt(document, STYLE);
    dialog = document.createElement('dialog');
    Object.assign(dialog, {id: 'lists', className: 'dialog'});
    dialog.setAttribute('aria-labelledby', 'lists-title');
    document.body.append(dialog);
  }
  const open = dialog;
  const button = (/** @type {string} */ text, /** @type {() => void} */ action, name = 'quiet') => {
    const made = document.createElement('button');
    Object.assign(made, {type: 'button', className: name, textContent: text});
    made.addEventListener('click', () => {
      open.close();
      action();
    });
    return made;
  };
  const row = (/** @type {HTMLElement[]} */ parts) => {
    const made = Object.assign(document.createElement('div'), {className: 'row'});
    made.append(...parts);
    return made;
  };
  const title = Object.assign(
      document.createElement('h2'), {id: 'lists-title', textContent: words.collection});
  const models = titles.map((text, i) => {
    const made = button(text, () => choose(i));
    made.setAttribute('aria-pressed', String(i === chosen));
    return made;
  });
  const plates = pictures.map(({title: text, image}, i) => {
    const made = button(text, () => look(i), 'quiet plate');
    const picture = Object.assign(document.createElement('img'), {alt: ''});
    image.then((address) => {
      picture.src = address;
    });
    made.prepend(picture);
    return made;
  });
  const lead =
      Object.assign(document.createElement('p'), {className: 'small', textContent: words.lookMany});
  open.replaceChildren(
      title, row(models), lead, row(plates),
      row([button(words.own, own), button(words.back, () => {}, '')]));
  open.showModal();
}
