'use strict';
// Paths as the program knows them, with slashes alone: "C:\a b\vase.glb" of Windows is "/C:/a b/vase.glb" there.
// Elsewhere both are the same.
const childProcess = require('child_process');
const nodeFiles = require('fs');

/** Translation for a system whose paths are `path` (path.win32 or path.posix), with Node's files as `fs` of it. */
function translation(path, fs) {
  const windows = path.sep === '\\';
  // Arguments too: "--out=C:\vase.modar", "C:\poster.png:210mm".
  const toProgram = (text) =>
    windows ? text.replaceAll('\\', '/').replace(/(^|=)([A-Za-z]:)(\/|$)/, '$1/$2/') : text;
  const toSystem = (text) =>
    windows && typeof text === 'string' ? text.replace(/^\/([A-Za-z]:)(\/|$)/, '$1/') : text;
  const files = Object.create(fs);
  const wrap = (name, count) => {
    files[name] = (...rest) => fs[name](...rest.slice(0, count).map(toSystem), ...rest.slice(count));
  };
  for (const name of ['lstat', 'stat', 'mkdir', 'rmdir', 'readdir', 'unlink', 'chmod', 'chown', 'truncate', 'utimes', 'open',
    'writeFile', 'readFile']) wrap(`${name}Sync`, 1);
  for (const name of ['rename', 'symlink']) wrap(`${name}Sync`, 2);
  files.readlinkSync = (text) => toProgram(fs.readlinkSync(toSystem(text)));
  return { toProgram, toSystem, files };
}

const here = translation(require('path'), nodeFiles);
const folder = here.toProgram(__dirname);

/** Runs a program: words[0], this one as "modar" in its folder, with the rest as its arguments. */
function run(words, options) {
  const opener = { win32: ['cmd', '/c', 'start', ''], darwin: ['open'] }[process.platform] ?? ['xdg-open'];
  const [program, ...rest] = (words[0] === 'xdg-open' ? [...opener, ...words.slice(1)] : words).map(here.toSystem);
  return words[0] === `${folder}/modar`
    ? childProcess.spawnSync(process.execPath, [`${__dirname}/modar`, ...rest], options)
    : childProcess.spawnSync(program, rest, options);
}

module.exports = { ...here, translation, folder, run };
