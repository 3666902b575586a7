// What platform.cpp and the studio's files call, for bake.js and studio-worker.js: no process can be started and nothing be served there. Files of the page for
// `modar web` are in /modar, where the worker puts them.
mergeInto(LibraryManager.library, {
  eglGetDisplay: function() { return 0; },
  eglCreatePbufferSurface: function() { return 0; },
  modar_node_folder__deps: ['malloc'],
  modar_node_folder: function() { return allocateUTF8('/modar/bin'); },
  modar_node_run: function() { return -1; },
  modar_studio_start: function(job, kind) { Module['startJob'](job, UTF8ToString(kind)); },
  modar_studio_end: function() { Module['endJob'](); },
  modar_studio_quit: function() {},
  modar_node_job: function() { return 0; },
  modar_node_run_job: function() {},
  modar_node_open_studio: function() { return allocateUTF8('{"error": "a page has no server"}'); },
  modar_node_serve_studio: function() {},
  modar_node_serve_site: function() { return allocateUTF8('{"error": "a page has no server"}'); },
  modar_node_wait: function() {},
});
