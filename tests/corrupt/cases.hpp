// One damaged bundle for each rule of the checker.
#pragma once

#include <span>

#include "tests/formats/support.hpp"

namespace modar::test {

struct CorruptCase {
  const char* id;  ///< of the issue that the damage is to show
  Bytes (*make)();
};

/// Damage to the structure: what BundleView::open() refuses.
std::span<const CorruptCase> structure_cases();
/// Damage to payloads, in bundles that open.
std::span<const CorruptCase> payload_cases();

}  // namespace modar::test
