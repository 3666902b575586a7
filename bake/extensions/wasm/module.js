// What platform.cpp and studio_job.cpp call, for bake.js and studio-worker.js: no process can be started there. Files of the page for
// `modar web` are in /modar, where the worker puts them.
mergeInto(LibraryManager.library, {
  eglGetDisplay: function() { return 0; },
  eglCreatePbufferSurface: function() { return 0; },
  modar_node_folder__deps: ['malloc'],
  modar_node_folder: function() { return allocateUTF8('/modar/bin'); },
  modar_node_run: function() { return -1; },
  modar_studio_start: function(job, kind) { Module['startJob'](job, UTF8ToString(kind)); },
  modar_studio_end: function() { Module['endJob'](); },
});
