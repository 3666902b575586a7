// Writes scripts of the page into a folder, without comments, blanks and long names: minify.cjs FOLDER FILE...
// Texts stay, those of errors too. Needs Debian's terser (NODE_PATH=/usr/share/nodejs).
const { readFileSync, writeFileSync } = require('fs');
const { basename, join } = require('path');
const { minify } = require('terser');

/** ES2021: what the browsers of CMakeLists.txt's MIN_..._VERSION understand as it stands. */
const OPTIONS = { ecma: 2021, compress: { passes: 2 } };

async function main([folder, ...files]) {
  for (const file of files) {
    // No text of ours depends on blanks at the start of a line: those of styles in templates go, too.
    const text = readFileSync(file, 'utf8').replace(/^ +/gm, '');
    // A service worker is no module, and the line that `modar web` writes before it keeps its name.
    const { code } = await minify({ [basename(file)]: text }, { ...OPTIONS, module: basename(file) !== 'sw.js' });
    writeFileSync(join(folder, basename(file)), `${code}\n`);
  }
}

main(process.argv.slice(2)).catch((error) => {
  console.error(`${error.filename ?? 'minify.cjs'}:${error.line ?? 0}: ${error.message}`);
  process.exit(1);
});
