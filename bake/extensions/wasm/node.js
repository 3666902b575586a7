// What platform.cpp calls, and what of EGL keeps GlContext::create_offscreen() from a display: Node has none.
mergeInto(LibraryManager.library, {
  eglGetDisplay: function() { return 0; },
  eglCreatePbufferSurface: function() { return 0; },
  modar_studio_start: function(job, kind) { abort('of a page alone') },
  modar_studio_end: function() {  },
  modar_node_folder__deps: ['malloc'],
  modar_node_folder: function() { return allocateUTF8(modarPaths.folder); },
  modar_node_run: function(words, variables, output) {
    const texts = (list) => {
      const found = [];
      for (let at = list >>> 2; HEAPU32[at]; ++at) found.push(UTF8ToString(HEAPU32[at]));
      return found;
    };
    const file = UTF8ToString(output);
    const stdout = file ? fs.openSync(file, 'w', 0o600) : 'ignore';
    const pairs = texts(variables).map((text) => [text.split('=', 1)[0], text.slice(text.indexOf('=') + 1)]);
    const env = pairs.length ? Object.fromEntries(pairs) : process.env;
    const { status } = modarPaths.run(texts(words), { env, stdio: ['inherit', stdout, 'inherit'] });
    if (file) fs.closeSync(stdout);
    return status === null ? -1 : status;
  },
});
