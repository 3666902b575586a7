// How many mapped files that are open have lost pages: results made from them must not be kept.
#pragma once

#include <atomic>

namespace modar {

/// Counted by MappedFile; above 0, AtomicFile::commit() fails.
inline std::atomic<int> lost_mappings{0};

}  // namespace modar
