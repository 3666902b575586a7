// @ts-check
// The QR code of an address (ISO/IEC 18004): bytes, error correction level M, up to version 20.
// Loaded where it is shown.

/** By version, from 1 on: bytes of error correction in a block, and blocks. */
const CORRECTION = [10, 16, 26, 18, 24, 16, 18, 22, 22, 26, 30, 22, 22, 24, 24, 28, 28, 26, 26, 26];
const BLOCKS = [1, 1, 1, 2, 2, 4, 4, 4, 5, 5, 5, 8, 9, 9, 10, 10, 11, 13, 14, 16];
/** Light modules around the code, which readers need. */
const MARGIN = 4;
/** @type {((x: number, y: number) => number)[]} */
const MASKS = [
  (x, y) => (x + y) % 2,
  (x, y) => y % 2,
  (x) => x % 3,
  (x, y) => (x + y) % 3,
  (x, y) => (Math.floor(x / 3) + (y >> 1)) % 2,
  (x, y) => (x * y) % 2 + (x * y) % 3,
  (x, y) => ((x * y) % 2 + (x * y) % 3) % 2,
  (x, y) => ((x + y) % 2 + (x * y) % 3) % 2,
];

/**
 * value and, behind it, the remainder of its division by a polynomial over two elements.
 * @param {number} value
 * @param {number} polynomial
 * @param {number} bits
 */
function withRemainder(value, polynomial, bits) {
  let rest = value << bits;
  for (let bit = 31 - Math.clz32(rest); bit >= bits; --bit)
    if ((rest >> bit) & 1) rest ^= polynomial << (bit - bits);
  return (value << bits) | rest;
}

/**
 * A square of modules: 1 dark, 0 light, null where data goes.
 * @param {number} version
 */
function frameOf(version) {
  const size = 17 + 4 * version;
  /** @type {(number | null)[][]} */
  const rows = Array.from({length: size}, () => new Array(size).fill(null));
  /**
   * @type {(centreX: number, centreY: number, reach: number, isDark: (distance: number) =>
   *     boolean) => void}
   */
  const ring = (centreX, centreY, reach, isDark) => {
    for (let y = Math.max(0, centreY - reach); y <= Math.min(size - 1, centreY + reach); ++y) {
      for (let x = Math.max(0, centreX - reach); x <= Math.min(size - 1, centreX + reach); ++x) {
        rows[y][x] = Number(isDark(Math.max(Math.abs(x - centreX), Math.abs(y - centreY))));
      }
    }
  };
  const gaps = Math.floor(version / 7) + 1;
  const step = 2 * Math.ceil((2 * version + 2) / gaps);
  const centres = version === 1 ?
      [] :
      [6, ...Array.from({length: gaps}, (_, i) => size - 7 - step * (gaps - 1 - i))];
  /** @type {(x: number, y: number) => boolean} */
  const inFinder = (x, y) =>
      (x === 6 && y === 6) || Math.min(x, y) === 6 && Math.max(x, y) === size - 7;
  for (const y of centres)
    for (const x of centres)
      if (!inFinder(x, y)) ring(x, y, 2, (distance) => distance !== 1);
  for (let i = 8; i < size - 8; ++i) rows[6][i] = rows[i][6] = (i + 1) % 2;
  for (const [x, y] of [[3, 3], [size - 4, 3], [3, size - 4]])
    ring(x, y, 4, (distance) => distance !== 2 && distance !== 4);
  if (version >= 7) {
    const word = withRemainder(version, 0x1f25, 12);
    for (let i = 0; i < 18; ++i) {
      const [near, far] = [Math.floor(i / 3), size - 11 + (i % 3)];
      rows[near][far] = rows[far][near] = (word >> i) & 1;
    }
  }
  putFormat(rows, 0);
  return rows;
}

/**
 * Which mask is used, at two places; level M is 00.
 * @param {(number | null)[][]} rows
 * @param {number} mask
 */
function putFormat(rows, mask) {
  const size = rows.length;
  const word = withRemainder(mask, 0x537, 10) ^ 0x5412;
  for (let i = 0; i < 15; ++i) {
    const bit = (word >> i) & 1;
    rows[i < 6 ? i : i < 8 ? i + 1 : size - 15 + i][8] = bit;
    rows[8][i < 8 ? size - 1 - i : i < 9 ? 7 : 14 - i] = bit;
  }
  rows[size - 8][8] = 1;
}

/**
 * Product in the field of 256 elements.
 * @param {number} a
 * @param {number} b
 */
function times(a, b) {
  let product = 0;
  for (let i = 7; i >= 0; --i)
    product = ((product << 1) ^ (product >> 7) * 0x11d) ^ ((b >> i) & 1) * a;
  return product;
}

/**
 * The bytes of error correction (Reed-Solomon) of a block.
 * @param {number[]} data
 * @param {number} count
 */
function correctionOf(data, count) {
  let generator = [1];
  for (let i = 0, root = 1; i < count; ++i, root = times(root, 2)) {
    generator =
        [...generator, 0].map((value, k) => value ^ (k > 0 ? times(generator[k - 1], root) : 0));
  }
  const rest = [...data, ...new Array(count).fill(0)];
  for (let i = 0; i < data.length; ++i) {
    const factor = rest[i];
    for (let k = 0; k <= count; ++k) rest[i + k] ^= times(generator[k], factor);
  }
  return rest.slice(data.length);
}

/**
 * All bytes in the order of the code, or null where the text is too long for the version.
 * @param {Uint8Array} text
 * @param {number} version
 * @param {number} capacity bytes of data and correction
 */
function bytesOf(text, version, capacity) {
  const [blocks, correction] = [BLOCKS[version - 1], CORRECTION[version - 1]];
  const room = capacity - blocks * correction;
  const lengthDigits = version < 10 ? 2 : 4;
  /** @type {(value: number, digits: number) => string} */
  const hex = (value, digits) => value.toString(16).padStart(digits, '0');
  const digits =
      `4${hex(text.length, lengthDigits)}${[...text].map((byte) => hex(byte, 2)).join('')}0`;
  if (digits.length > 2 * room) return null;
  const data = Array.from(
      {length: room},
      (_, i) => (2 * i < digits.length ? parseInt(digits.slice(2 * i, 2 * i + 2), 16) : 0));
  for (let i = digits.length / 2, pad = 0xec; i < room; ++i, pad ^= 0xec ^ 0x11) data[i] = pad;
  const short = Math.floor(room / blocks);
  const longFrom = blocks - (room % blocks);
  /** @type {(block: number) => number} */
  const starts = (block) => short * block + Math.max(0, block - longFrom);
  const parts =
      Array.from({length: blocks}, (_, block) => data.slice(starts(block), starts(block + 1)));
  /** @type {(lists: number[][], length: number) => number[]} */
  const columns = (lists, length) =>
      Array.from({length}, (_, i) => lists.filter((list) => i < list.length).map((list) => list[i]))
          .flat();
  return [
    ...columns(parts, short + 1),
    ...columns(parts.map((part) => correctionOf(part, correction)), correction)
  ];
}

/**
 * How hard a code is to read, by the standard's four rules.
 * @param {number[][]} rows
 */
function penaltyOf(rows) {
  const lines =
      [...rows, ...rows[0].map((_, x) => rows.map((row) => row[x]))].map((line) => line.join(''));
  let penalty = 0;
  for (const line of lines) {
    for (const [run] of line.matchAll(/0{5,}|1{5,}/g)) penalty += run.length - 2;
    penalty += 40 * [...line.matchAll(/(?=10111010000|00001011101)/g)].length;
  }
  for (let y = 1; y < rows.length; ++y) {
    for (let x = 1; x < rows.length; ++x) {
      const sum = rows[y][x] + rows[y - 1][x] + rows[y][x - 1] + rows[y - 1][x - 1];
      if (sum % 4 === 0) penalty += 3;
    }
  }
  const share = rows.flat().filter(Boolean).length / rows.length ** 2;
  return penalty + 10 * Math.floor(Math.abs(share - 0.5) * 20);
}

/**
 * Rows of modules, 1 for dark ones; null for a text that is too long.
 * @param {string} text
 */
export function qrOf(text) {
  const bytes = new TextEncoder().encode(text);
  for (let version = 1; version <= BLOCKS.length; ++version) {
    const frame = frameOf(version);
    const all =
        bytesOf(bytes, version, frame.flat().filter((module) => module === null).length >> 3);
    if (!all) continue;
    const size = frame.length;
    /** @type {[number, number][]} */
    const places = [];  // two columns at a time, upwards and downwards, from the right
    for (let right = size - 1, up = true; right > 0; right -= right === 8 ? 3 : 2, up = !up) {
      for (let i = 0; i < size; ++i)
        for (const x of [right, right - 1]) places.push([x, up ? size - 1 - i : i]);
    }
    const free = places.filter(([x, y]) => frame[y][x] === null);
    const codes = MASKS.map((mask, number) => {
      const rows = frame.map((row) => row.map((module) => module ?? 0));
      free.forEach(([x, y], i) => {
        rows[y][x] = ((all[i >> 3] >> (7 - (i & 7))) & 1) ^ Number(mask(x, y) === 0);
      });
      putFormat(rows, number);
      return {rows, penalty: penaltyOf(rows)};
    });
    return codes.reduce((best, code) => (code.penalty < best.penalty ? code : best)).rows;
  }
  return null;
}

/**
 * Shows the code on a canvas, which stays hidden where the text is too long.
 * @param {HTMLCanvasElement} canvas
 * @param {string} text
 */
export function drawQr(canvas, text) {
  const rows = qrOf(text);
  canvas.hidden = !rows;
  if (!rows) return;
  canvas.width = canvas.height = rows.length + 2 * MARGIN;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  context.fillStyle = '#fff';
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = '#000';
  rows.forEach((row, y) => row.forEach((dark, x) => {
    if (dark) context.fillRect(x + MARGIN, y + MARGIN, 1, 1);
  }));
}
