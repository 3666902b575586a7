// Bundles that are installed already, as a source of pieces for the next.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "modar/mapped_file.hpp"
#include "store.hpp"

namespace modar::fetch {

/// An installed bundle with its recipe.
struct OldBundle {
  MappedFile bundle;
  std::vector<std::uint64_t> recipe_bytes;  ///< aligned for RecipeView
  RecipeView recipe;
};

class PieceSource {
 public:
  /// Maps the bundles of an installed release that have a readable recipe.
  void add(const InstalledRelease& installed);
  /// Whether a piece with this id lies in one of them.
  [[nodiscard]] bool has(const ObjectId& id) const { return places_.contains(id); }
  /// Its raw bytes; nothing if they are not what the recipe says (a damaged file).
  [[nodiscard]] std::optional<std::vector<std::byte>> raw(const ObjectId& id) const;

 private:
  std::vector<std::unique_ptr<OldBundle>> bundles_;
  std::map<ObjectId, std::pair<const OldBundle*, const PieceRecord*>> places_;
};

/// A recipe's text as stored, unpacked and validated. Errors: kInvalidInput "recipe.*".
Result<RecipeView> unpack_recipe(std::span<const std::byte> stored, std::size_t raw_size,
                                 std::vector<std::uint64_t>& bytes);

/// Adds `base` to each 16-bit index, modulo 65536: a piece's indices are local to its chunk.
void shift_indices(std::span<std::byte> indices, std::uint16_t base);

}  // namespace modar::fetch
