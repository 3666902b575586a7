// What benches tell of the heap.
#pragma once

#include <malloc.h>

namespace modar {

/// Bytes of this process that are allocated and not freed, by glibc's own count.
inline double heap_bytes() {
  const struct mallinfo2 now = mallinfo2();
  return static_cast<double>(now.uordblks + now.hblkhd);
}

}  // namespace modar
