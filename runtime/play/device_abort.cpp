// The device's build has no exceptions, yet libstdc++ brings the machinery to throw, to demangle
// and to print them: 200 KB that could only end the program. These end it at once.
//
// operator new may be replaced by anybody; the other names are libstdc++'s own hooks, which its
// headers call where another library would throw.
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {

[[noreturn]] void give_up(const char* what) {
  std::fputs("modar-play: out of memory or a broken contract: ", stderr);
  std::fputs(what, stderr);
  std::fputc('\n', stderr);
  std::abort();
}

}  // namespace

void* operator new(std::size_t size) {
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) give_up("new");
  return memory;
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

#ifdef __GLIBCXX__
namespace std {
void __throw_bad_alloc() {
  give_up("allocation");
}
void __throw_bad_array_new_length() {
  give_up("array length");
}
void __throw_bad_function_call() {
  give_up("empty function");
}
void __throw_length_error(const char* what) {
  give_up(what);
}
void __throw_logic_error(const char* what) {
  give_up(what);
}
void __throw_out_of_range(const char* what) {
  give_up(what);
}
void __throw_out_of_range_fmt(const char* what, ...) {
  give_up(what);
}
void __throw_system_error(int /*error*/) {
  give_up("thread");
}
}  // namespace std
namespace __gnu_cxx {
void __verbose_terminate_handler() {
  give_up("terminate");
}
}  // namespace __gnu_cxx
#endif
