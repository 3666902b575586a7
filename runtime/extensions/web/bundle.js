// @ts-check
// What a page shows of a bundle besides its models: texts and pictures of its patterns.
// The engine has opened and verified these bytes; formats/bundle.md describes their layout.

export const HEADER_BYTES = 64;
export const ENTRY_BYTES = 48;
const NO_OWNER = 0xffffffff;
const META = 2, TRACKER_RECORD = 258, PATTERN_SHAPE = 261, PATTERN_PICTURE = 264;

/** @param {Uint8Array} bytes */
const viewOf = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
/**
 * @param {DataView} view
 * @param {number} at
 */
const offsetAt = (view, at) => Number(view.getBigUint64(at, true));

/**
 * The bytes of the first section of this type and owner; null if none.
 * @param {Uint8Array} bytes
 * @param {number} type
 */
function sectionOf(bytes, type, owner = NO_OWNER) {
  const view = viewOf(bytes);
  const count = view.getUint32(12, true);
  for (let i = 0; i < count; ++i) {
    const entry = HEADER_BYTES + ENTRY_BYTES * i;
    if (view.getUint32(entry, true) !== type || view.getUint32(entry + 8, true) !== owner) continue;
    const from = offsetAt(view, entry + 16);
    return bytes.subarray(from, from + offsetAt(view, entry + 24));
  }
  return null;
}

/**
 * "red_vase" as people write it.
 * @param {string} name
 */
export const titleOf = (name) => name.replaceAll('_', ' ');

/**
 * Texts of modar.toml: {pattern: {language: {text, alt}}}; `alt` where there is one.
 * bake/extensions/web/page_texts.cpp does the same.
 * @param {{ texts?: { pattern: string, text?: Record<string, string>, alt?: Record<string, string>
 *     }[] }} meta
 */
export function textsOf(meta) {
  /** @type {Record<string, Record<string, { text: string, alt?: string }>>} */
  const texts = {};
  for (const scene of meta.texts ?? []) {
    for (const key of /** @type {const} */ (['text', 'alt'])) {
      for (const [language, words] of Object.entries(scene[key] ?? {})) {
        texts[scene.pattern] ??= {};
        const entry = texts[scene.pattern][language] ??= {text: ''};
        entry[key] = entry[key] ? `${entry[key]} ${words}` : words;
      }
    }
  }
  return texts;
}

/**
 * The tracker's gray picture as an address, for bundles of before 1.3 that have no other.
 * @param {Uint8Array} record
 * @param {{ width: number, height: number }} size
 */
function drawGray(record, {width, height}) {
  const canvas = Object.assign(document.createElement('canvas'), {width, height});
  const image = new ImageData(width, height);
  const gray = record.subarray(offsetAt(viewOf(record), 56));
  new Uint32Array(image.data.buffer).forEach((_, i, pixels) => {
    pixels[i] = 0xff000000 | (0x010101 * gray[i]);
  });
  canvas.getContext('2d')?.putImageData(image, 0, 0);
  return canvas.toDataURL();
}

/**
 * The print, as an address of its own.
 * @param {Uint8Array} bytes
 * @param {number} index
 * @param {{ width: number, height: number }} size
 */
function imageOf(bytes, index, size) {
  const file = sectionOf(bytes, PATTERN_PICTURE, index);
  if (file) return URL.createObjectURL(new Blob([file], {type: 'image/webp'}));
  const record = sectionOf(bytes, TRACKER_RECORD, index);
  return record ? drawGray(record, size) : 'data:,';
}

/**
 * The content of a pattern: "red vase, plinth".
 * @param {{ pattern: number, model: string }[]} scenes
 * @param {number} pattern
 */
const modelsOn =
    (scenes, pattern) => [...new Set(scenes.filter((scene) => scene.pattern === pattern)
                                         .map(({model}) => titleOf(model)))]
                             .join(', ');

/**
 * @param {() => Uint8Array} bytesOf
 * @param {string} name
 * @param {number} index
 */
function describePattern(bytesOf, name, index) {
  const bytes = bytesOf();
  const record = sectionOf(bytes, TRACKER_RECORD, index);
  const size = record ?
      {width: viewOf(record).getUint32(16, true), height: viewOf(record).getUint32(20, true)} :
      {width: 1, height: 1};
  /** @type {string | null} */
  let image = null;
  return {
    name,
    title: titleOf(name),
    flat: !sectionOf(bytes, PATTERN_SHAPE, index),
    ...size,
    image: () => (image ??= imageOf(bytesOf(), index, size)),
  };
}

/**
 * Of each pattern of the engine's what a site has in its site.json: {name, title, models, texts,
 * image, width, height, flat}; image() answers the address of a picture. bytesOf: answers the
 * bundle, or what has come of it.
 * @param {() => Uint8Array} bytesOf
 * @param {{ patterns: { name: string }[], scenes: { pattern: number, model: string }[] }} modar
 */
export function describe(bytesOf, {patterns, scenes}) {
  const meta = sectionOf(bytesOf(), META);
  const texts = textsOf(meta ? JSON.parse(new TextDecoder().decode(meta)) : {});
  return patterns.map(({name}, index) => ({
                        ...describePattern(bytesOf, name, index),
                        models: modelsOn(scenes, index),
                        texts: texts[name],
                      }));
}
