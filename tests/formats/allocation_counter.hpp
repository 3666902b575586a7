// Counts what a test program allocates with operator new.
#pragma once

#include <cstddef>

namespace modar::test {

/// Calls of operator new since the program's start.
std::size_t allocation_count();

}  // namespace modar::test
