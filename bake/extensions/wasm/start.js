// Runs before what emscripten writes, in its scope. Files are read by Node, of any version: fetch() would take paths for
// addresses, and Node 18 and newer have it.
// Of the program's functions a bake calls a third: compiling each when it is first called saves 0.35 s of 0.6.
require('v8').setFlagsFromString('--wasm-lazy-compilation');
const modarPaths = require('./paths.js');
var fs = modarPaths.files;
var nodePath = require('path');
Module['wasmBinary'] = fs.readFileSync(modarPaths.folder + '/baker.wasm');
Module['arguments'] = process.argv.slice(2).map(modarPaths.toProgram);
Module['preRun'] = () => Object.assign(ENV, process.env, { TMPDIR: modarPaths.toProgram(require('os').tmpdir()) });
Module['onRuntimeInitialized'] = () => {
  for (const each of [0, 1, 2]) FS.streams[each].tty = require('tty').isatty(each);
  FS.cwd = () => modarPaths.toProgram(process.cwd());
};
