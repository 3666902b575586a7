// Writes scripts and style sheets of the page into a folder, without comments, blanks and long names, each with a source map: minify.cjs FOLDER FILE...
// Texts stay, those of errors too.
// Needs Debian's terser (NODE_PATH=/usr/share/nodejs).
const { readFileSync, writeFileSync } = require('fs');
const { basename, dirname, join } = require('path');
const { minify } = require('terser');

/** ES2021: what the browsers of CMakeLists.txt's MIN_..._VERSION understand as it stands. */
const OPTIONS = { ecma: 2021, compress: { passes: 4 } };
/** These get what they import written into them: one request, instead of one after the other. */
const BUNDLED = ['app.js', 'modar-worker-plain.js', 'modar-worker-simd.js'];
/** But for what page and worker share, and loaders. */
const SHARED = 'engine.js';
const IMPORT = /^import (?:\{([^}]*)\} from )?'\.\/([\w-]+\.js)';\n/gm;
const EXPORT = /^export (?:\{[^}]*\};\n)?/gm;

/** Scripts of emscripten have no source that anyone reads, and `modar web` writes a line before the service worker. */
const hasMap = (name) => name !== 'sw.js' && !name.startsWith('engine-');

const read = (file) => readFileSync(file, 'utf8');
const blank = (text) => text.replace(/[^\n]/g, '');

/** A style sheet without comments and blanks, its lines kept. */
const bareStyle = (css) => css.replace(/\/\*[^]*?\*\//g, blank).replace(/([:;,{}]) +/g, '$1').replace(/ +([{}])/g, '$1').replace(/;(?=\s*\})/g, '');
/** The same in a script: its lines are joined, and stay lines of the source. */
const scriptStyle = (css) => bareStyle(css).replace(/([;{},])((?:\n *)+)/g, (_, end, lines) => end + lines.replace(/\n/g, '\\\n'));
/** The style sheets in a script. */
const STYLES = /(?<=^export const [A-Z]+ = `\n):(?:root|host)[^`]*(?=`;)/gm;

/** {lines, from}: lines of a script, and of each the file, the line and the column where its text begins there. */
const script = (file, text) => {
  const lines = text.split('\n');
  // None of our texts depends on blanks at the start of a line: those of styles in templates go, too.
  const bare = lines.map((line) => line.replace(/^ +/, ''));
  return { lines: bare, from: bare.map((line, i) => ({ file, line: i, column: lines[i].length - line.length })) };
};

const join2 = (a, b) => ({ lines: [...a.lines, ...b.lines], from: [...a.from, ...b.from] });
const NOTHING = { lines: [], from: [] };

/** A module after those that it imports, each once. shared: names of SHARED that they use. entry: what it exports stays. */
function joined(file, seen, shared, entry = false) {
  if (seen.has(file)) return NOTHING;
  seen.add(file);
  const text = read(file).replace(STYLES, scriptStyle);
  let before = NOTHING;
  for (const [, names, other] of text.matchAll(IMPORT)) {
    if (other !== SHARED) before = join2(before, joined(join(dirname(file), other), seen, shared));
    else for (const name of names.split(',')) shared.add(name.trim());
  }
  const own = text.replace(IMPORT, blank);
  return join2(before, script(file, entry ? own : own.replace(EXPORT, blank)));
}

/** One script of them. Their names must differ: terser refuses two of one name. */
function bundle(file) {
  const shared = new Set();
  const all = joined(file, new Set(), shared, true);
  return join2({ lines: [`import { ${[...shared].join(', ')} } from './${SHARED}';`], from: [null] }, all);
}

/**
 * Emscripten writes a function for each export, which replaces itself when it is called: one loop does it. Of the extensions
 * that it wraps, the renderer uses instances alone.
 */
const bareEngine = (text) => text.replace(/\b__webgl_enable_(?!ANGLE)\w+\(GLctx\);/g, '').replace(/var _web_\w+ = Module\["_web_\w+"\] = function\(\) \{\n[^\n]*\n\};\n/g, '')
  .replace("Module['asm'] = exports;", "$&\nfor (const name in exports) Module['_' + name] = exports[name];");

const DIGITS = 'ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/';

/** A number as source maps have it: five bits a digit, the lowest bit the sign. */
function digitsOf(number) {
  let rest = Math.abs(number) * 2 + (number < 0 ? 1 : 0);
  let digits = '';
  do {
    digits += DIGITS[(rest & 31) | (rest > 31 ? 32 : 0)];
    rest >>= 5;
  } while (rest > 0);
  return digits;
}

/** The source map of a script before it is shortened: where each line begins. */
function mapOf({ from }) {
  const files = [...new Set(from.filter(Boolean).map(({ file }) => file))];
  let before = [0, 0, 0];
  const mappings = from.map((place) => {
    if (!place) return '';
    const now = [files.indexOf(place.file), place.line, place.column];
    const segment = [0, ...now.map((number, i) => number - before[i])].map(digitsOf).join('');
    before = now;
    return segment;
  }).join(';');
  return { version: 3, names: [], sources: files.map((file) => basename(file)), sourcesContent: files.map(read), mappings };
}

async function main([folder, ...files]) {
  for (const file of files) {
    const name = basename(file);
    if (name.endsWith('.css')) {
      writeFileSync(join(folder, name), bareStyle(read(file)).replace(/\s*\n\s*/g, '\n').trim());
      continue;
    }
    const text = name.startsWith('engine-') ? bareEngine(read(file)) : read(file).replace(STYLES, scriptStyle);
    const before = BUNDLED.includes(name) ? bundle(file) : script(file, text);
    const sourceMap = hasMap(name) && { content: mapOf(before), includeSources: true, url: `${name}.map` };
    // A service worker is no module, and the line that `modar web` writes before it keeps its name.
    const { code, map } = await minify({ [name]: before.lines.join('\n') }, { ...OPTIONS, module: name !== 'sw.js', sourceMap });
    writeFileSync(join(folder, name), `${code}\n`);
    if (map) writeFileSync(join(folder, `${name}.map`), map);
  }
}

main(process.argv.slice(2)).catch((error) => {
  console.error(`${error.filename ?? 'minify.cjs'}:${error.line ?? 0}: ${error.message}`);
  process.exit(1);
});
