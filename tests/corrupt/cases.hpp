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
/// What only a workstation finds, in bundles that are good by their bytes: they are in
/// tests/corrupt/workstation/, each with the words of its `modar check` (ID.args) and the files
/// that these name (ID/).
std::span<const CorruptCase> workstation_cases();

}  // namespace modar::test
