// The compiler's own half float, as an oracle.
#pragma once

namespace modar::testing {

// Clang 14 has no _Float16 on x86, and GCC no __fp16.
#ifdef __clang__
using CompilerHalf = __fp16;
#else
using CompilerHalf = _Float16;
#endif

}  // namespace modar::testing
