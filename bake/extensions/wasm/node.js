// What platform.cpp calls, and what of EGL keeps GlContext::create_offscreen() from a display: Node has none.
mergeInto(LibraryManager.library, {
  eglGetDisplay: function() { return 0; },
  eglCreatePbufferSurface: function() { return 0; },
  // The servers run in a thread of their own (server.js): this one waits for what they want of the program.
  $modarStudio__postset: 'modarStudio = require("./studio.js")(Module, { allocateUTF8, UTF8ToString, heap: () => HEAPU8, free: (pointer) => _free(pointer), files: fs });',
  $modarStudio: null,
  $modarStudio__deps: ['malloc', 'free'],
  modar_studio_start__deps: ['$modarStudio'],
  modar_studio_start: function(job, kind) { modarStudio.startJob(job, UTF8ToString(kind)); },
  modar_studio_end__deps: ['$modarStudio'],
  modar_studio_end: function() { modarStudio.endJob(); },
  modar_studio_quit__deps: ['$modarStudio'],
  modar_studio_quit: function() { modarStudio.quit(); },
  modar_node_job__deps: ['$modarStudio'],
  modar_node_job: function() { return process.env.MODAR_STUDIO_JOB ? allocateUTF8(process.env.MODAR_STUDIO_JOB) : 0; },
  modar_node_run_job: function(folder, request) { modarStudio.runJob(UTF8ToString(folder), UTF8ToString(request)); },
  modar_node_open_studio__deps: ['$modarStudio'],
  modar_node_open_studio: function(options) { return allocateUTF8(JSON.stringify(modarStudio.open('studio', JSON.parse(UTF8ToString(options))))); },
  modar_node_serve_studio: function() { modarStudio.serve(); },
  modar_node_serve_site__deps: ['$modarStudio'],
  modar_node_serve_site: function(options) { return allocateUTF8(JSON.stringify(modarStudio.open('site', JSON.parse(UTF8ToString(options))))); },
  modar_node_wait: function() { modarStudio.wait(); },
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
