// Which of the SIMD levels that our loops are compiled for this processor has. Highway's own
// dispatch needs its shared library; this needs none.
#pragma once

namespace modar {

/// 2: AVX2 with FMA and BMI2, 1: SSE4 with carry-less multiplication (what Highway compiles for),
/// 0: neither, or no x86.
inline int x86_simd_level() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("pclmul") ||
      !__builtin_cpu_supports("aes")) {
    return 0;
  }
  // Its F16C is not asked for, which Clang 14 cannot: our loops hold no half floats.
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi2");
  return avx2 ? 2 : 1;
#else
  return 0;
#endif
}

}  // namespace modar
