// Writes scripts of the page into a folder, without comments, blanks and long names: minify.cjs FOLDER FILE...
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

// No text of ours depends on blanks at the start of a line: those of styles in templates go, too.
const read = (file) => readFileSync(file, 'utf8').replace(/^ +/gm, '');

/** A module after those that it imports, each once. shared: names of SHARED that they use. entry: what it exports stays. */
function joined(file, seen, shared, entry = false) {
  if (seen.has(file)) return '';
  seen.add(file);
  const text = read(file);
  const before = [...text.matchAll(IMPORT)].map(([, names, other]) => {
    if (other !== SHARED) return joined(join(dirname(file), other), seen, shared);
    for (const name of names.split(',')) shared.add(name.trim());
    return '';
  });
  return before.join('') + text.replace(IMPORT, '').replace(entry ? '' : EXPORT, '');
}

/** One script of them. Their names must differ: terser refuses two of one name. */
function bundle(file) {
  const shared = new Set();
  const text = joined(file, new Set(), shared, true);
  return `import { ${[...shared].join(', ')} } from './${SHARED}';\n${text}`;
}

async function main([folder, ...files]) {
  for (const file of files) {
    const name = basename(file);
    const text = BUNDLED.includes(name) ? bundle(file) : read(file);
    // A service worker is no module, and the line that `modar web` writes before it keeps its name.
    const { code } = await minify({ [name]: text }, { ...OPTIONS, module: name !== 'sw.js' });
    writeFileSync(join(folder, name), `${code}\n`);
  }
}

main(process.argv.slice(2)).catch((error) => {
  console.error(`${error.filename ?? 'minify.cjs'}:${error.line ?? 0}: ${error.message}`);
  process.exit(1);
});
