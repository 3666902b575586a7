// @ts-check
// Lists over the camera's picture: what to show, and the pictures that show it. A model of the
// visitor's own is baked onto these pictures, in the browser. Loaded by those who open them.

/**
 * What app.js hands over.
 * @typedef {{words: Record<string, string>, titles: string[], chosen: number,
 *     pictures: {name: string, title: string, image: Promise<string>}[],
 *     choose: (bundle: number) => void, look: (pattern: number) => void, own: () => void,
 *     open?: false | ((title: string, bundle: Uint8Array) => void)}} Choices
 */

const MODELS = /\.(obj|glb|gltf|ply|stl)$/i;

/**
 * files: a model and those that it names.
 * @param {File[]} files
 * @param {Choices['pictures']} pictures
 * @param {{signal: AbortSignal, onProgress: (progress: {done: number}) => void}} run
 * @returns {Promise<{title: string, bundle: Uint8Array}>}
 */
async function bakeModel(files, pictures, run) {
  const {bake} = await import(new URL('./bake.js', import.meta.url).href);
  const {name} = files.find((file) => MODELS.test(file.name)) ?? files[0];
  /** @type {[string, Blob][]} */
  const plates = await Promise.all(pictures.map(
      async (picture) =>
          [`pictures/${encodeURIComponent(picture.name)}.webp`,
           await (await fetch(await picture.image)).blob()]));
  const all = [...files.map((file) => [file.name, file]), ...plates];
  const {bundle} = await bake(
      Object.fromEntries(all), {tier: 'phone', model: name, pattern: plates.map(([file]) => file)},
      run);
  return {title: name.replace(MODELS, ''), bundle};
}

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
export function openLists({words, titles, chosen, pictures, choose, look, own, open: show}, adopt) {
  let dialog = /** @type {HTMLDialogElement | null} */ (document.getElementById('lists'));
  if (!dialog) {
    adopt(document, STYLE);
    dialog = document.createElement('dialog');
    Object.assign(dialog, {id: 'lists', className: 'dialog'});
    dialog.setAttribute('aria-labelledby', 'lists-title');
    document.body.append(dialog);
  }
  const open = dialog;
  const stop = new AbortController();
  open.addEventListener('close', () => stop.abort(), {once: true});
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
  if (show) {
    const told = Object.assign(document.createElement('output'), {className: 'small'});
    // Of any kind: phones do not offer files of kinds that they do not know.
    const files = Object.assign(document.createElement('input'), {type: 'file', multiple: true});
    files.addEventListener('change', async () => {
      const onProgress = ({done = 0}) => {
        told.value = words.loading.replace('{percent}', String(Math.round(100 * done)));
      };
      onProgress({});
      try {
        const {title: name, bundle} =
            await bakeModel([...files.files ?? []], pictures, {signal: stop.signal, onProgress});
        open.close();
        show(name, bundle);
      } catch (error) {
        const {cause = error, cure = ''} = /** @type {Record<string, string>} */ (error);
        told.value = [cause, cure].filter(Boolean).join('; ');
      }
    });
    const label = Object.assign(document.createElement('label'), {className: 'small'});
    label.append(words.openModel, files);
    open.lastElementChild?.before(label, told);
  }
  open.showModal();
}
