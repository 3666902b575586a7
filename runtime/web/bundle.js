// What a page shows of a bundle besides its models: texts and pictures of its patterns. The engine has opened and verified these
// bytes; formats/bundle.md says how they lie.

export const HEADER_BYTES = 64;
export const ENTRY_BYTES = 48;
const NO_OWNER = 0xffffffff;
const META = 2, TRACKER_RECORD = 258, PATTERN_COLOURS = 259, PATTERN_SHAPE = 261;

const viewOf = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
const offsetAt = (view, at) => Number(view.getBigUint64(at, true));

/** The bytes of the first section of this type and owner; null where there is none. */
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

/** "red_vase" as people write it. */
export const titleOf = (name) => name.replaceAll('_', ' ');

/** Texts of modar.toml: {pattern: {language: {name, text, alt}}}; `alt` where there is one. bake/web/page_texts.cpp does the same. */
export function textsOf(meta) {
  const texts = {};
  for (const scene of meta.texts ?? []) {
    for (const key of ['text', 'alt']) {
      for (const [language, words] of Object.entries(scene[key] ?? {})) {
        texts[scene.pattern] ??= {};
        const entry = texts[scene.pattern][language] ??= { name: titleOf(scene.pattern), text: '' };
        entry[key] = entry[key] ? `${entry[key]} ${words}` : words;
      }
    }
  }
  return texts;
}

/** From light, 0 to 65535, to what a screen is told, 0 to 255. */
function srgbOf(light) {
  const share = light / 65535;
  return Math.round(255 * (share <= 0.0031308 ? 12.92 * share : 1.055 * share ** (1 / 2.4) - 0.055));
}

/** The mean colours of a pattern's cells, a pixel each. */
function cellsOf(section) {
  const view = viewOf(section);
  const [columns, rows] = [view.getUint32(0, true), view.getUint32(4, true)];
  const image = new ImageData(columns, rows);
  for (let i = 0; i < columns * rows; ++i) {
    for (let c = 0; c < 3; ++c) image.data[4 * i + c] = srgbOf(view.getUint16(16 + 6 * i + 2 * c, true));
    image.data[4 * i + 3] = 255;
  }
  return image;
}

function contextOf({ width, height }) {
  return Object.assign(document.createElement('canvas'), { width, height }).getContext('2d');
}

/** What is looked for, as an address of its own: the tracker's gray picture in the colours of its cells. */
function drawPicture(record, colours, { width, height }) {
  const context = contextOf({ width, height });
  const image = new ImageData(width, height);
  const gray = record.subarray(offsetAt(viewOf(record), 56));
  new Uint32Array(image.data.buffer).forEach((_, i, pixels) => { pixels[i] = 0xff000000 | (0x010101 * gray[i]); });
  context.putImageData(image, 0, 0);
  if (colours) {
    const cells = contextOf({ width: viewOf(colours).getUint32(0, true), height: viewOf(colours).getUint32(4, true) });
    cells.putImageData(cellsOf(colours), 0, 0);
    context.globalCompositeOperation = 'color';  // keeps the lightness of what is there
    context.imageSmoothingQuality = 'high';
    context.drawImage(cells.canvas, 0, 0, width, height);
  }
  return context.canvas.toDataURL('image/jpeg', 0.85);
}

function describePattern(bytesOf, name, index) {
  const bytes = bytesOf();
  const record = sectionOf(bytes, TRACKER_RECORD, index);
  const size = record ? { width: viewOf(record).getUint32(16, true), height: viewOf(record).getUint32(20, true) } : { width: 1, height: 1 };
  let image = null;
  return {
    name, title: titleOf(name), flat: !sectionOf(bytes, PATTERN_SHAPE, index), ...size,
    image: () => (image ??= record
      ? drawPicture(sectionOf(bytesOf(), TRACKER_RECORD, index), sectionOf(bytesOf(), PATTERN_COLOURS, index), size) : 'data:,'),
  };
}

/**
 * Of each pattern of the engine's what a site has in its site.json: {name, title, texts, image, width, height, flat}; image() answers
 * the address of a picture. bytesOf: answers the bundle, or what has come of it.
 */
export function describe(bytesOf, patterns) {
  const meta = sectionOf(bytesOf(), META);
  const texts = textsOf(meta ? JSON.parse(new TextDecoder().decode(meta)) : {});
  return patterns.map(({ name }, index) => ({ ...describePattern(bytesOf, name, index), texts: texts[name] }));
}
