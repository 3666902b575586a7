// What platform.cpp calls, for bake.js: no process can be started there, and the files of the page are nowhere.
mergeInto(LibraryManager.library, {
  eglGetDisplay: function() { return 0; },
  eglCreatePbufferSurface: function() { return 0; },
  modar_node_folder__deps: ['malloc'],
  modar_node_folder: function() { return allocateUTF8('/'); },
  modar_node_run: function() { return -1; },
});
