// Where the fields of the specification lie in one bundle: what mutations choose from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/field_table.hpp"

namespace modar {

/// `count` elements, each `step` bytes behind the one before.
struct PlaceRange {
  std::uint64_t first = 0;  ///< byte in the file
  std::uint64_t step = 0;
  std::uint64_t count = 0;
};

/// One field of the specification with all its places in the file.
struct MutationField {
  std::string name;  ///< "ModelRecord.center", "vertex uv", "index", "names"
  FieldType type = FieldType::kU8;
  bool hash = false;  ///< made true again where hashes are
  std::vector<PlaceRange> places;

  [[nodiscard]] std::uint64_t elements() const;
  /// Byte of element i < elements().
  [[nodiscard]] std::uint64_t place(std::uint64_t i) const;
};

/// Every field that has a place in the bundle, in a fixed order.
std::vector<MutationField> mutation_fields(const BundleView& bundle);

}  // namespace modar
