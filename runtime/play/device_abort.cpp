// The device's build has no exceptions, yet libstdc++ links the machinery to throw, to demangle
// and to print them: 200 KB that could only end the program. These end it at once.
//
// operator new may be replaced by anybody; std::__throw_*() are libstdc++'s own hooks, which its
// headers call where another library would throw; std::terminate() and the names of the C++ ABI are
// what its threads and guarded statics refer to: left to the library, they link the whole stack
// unwinder (33 KB), which has nothing to read here, for our objects carry no unwind tables.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

#ifdef __GLIBCXX__
#include <cxxabi.h>
#include <unwind.h>
#endif

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
void terminate() noexcept {
  give_up("terminate");
}
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

extern "C" {
void* __cxxabiv1::__cxa_allocate_exception(std::size_t /*size*/) noexcept {
  give_up("throw");
}
void __cxxabiv1::__cxa_free_exception(void* /*exception*/) noexcept {
  give_up("throw");
}
void __cxxabiv1::__cxa_throw(void* /*exception*/, std::type_info* /*type*/, void (*)(void*)) {
  give_up("throw");
}
void __cxxabiv1::__cxa_rethrow() {
  give_up("throw");
}
void* __cxxabiv1::__cxa_begin_catch(void* /*exception*/) noexcept {
  give_up("catch");
}
void __cxxabiv1::__cxa_end_catch() {
  give_up("catch");
}
void _Unwind_Resume(_Unwind_Exception* /*exception*/) {
  give_up("unwind");
}
/// Tables of libstdc++'s own functions name it; without an unwinder nobody calls it.
void __gxx_personality_v0() {
  give_up("unwind");
}
#ifdef __ARM_EABI_UNWINDER__
// What the tables and landing pads of 32-bit ARM name besides.
void __cxa_end_cleanup() {
  give_up("unwind");
}
void __aeabi_unwind_cpp_pr0() {
  give_up("unwind");
}
void __aeabi_unwind_cpp_pr1() {
  give_up("unwind");
}
#endif
}
#endif
