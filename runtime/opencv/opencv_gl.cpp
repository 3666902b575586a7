// What OpenCV's archives want of OpenGL. Nobody here opens OpenCV's windows, and libGL would load
// Mesa and LLVM. With Display and Context as untyped pointers: no header of X11 is needed.
extern "C" {
[[gnu::visibility("hidden")]] void* glXGetProcAddressARB(const unsigned char* /*name*/) {
  return nullptr;
}
[[gnu::visibility("hidden")]] void* glXGetCurrentDisplay() {
  return nullptr;
}
[[gnu::visibility("hidden")]] void* glXGetCurrentContext() {
  return nullptr;
}
}
