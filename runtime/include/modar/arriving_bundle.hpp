// A packed bundle that is still on its way: a recipe, then its pieces in the order of need, in one
// file. formats/shipping.md is the normative text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/transport/recipe.hpp"
#include "modar/packed_record.hpp"

namespace modar {

/// Raw bytes of a piece whose form needs no library: kStored, kTrackerRecord, kCoded. Verified.
/// begun: of a kTrackerRecord, what was unpacked of these bytes while they came, or null.
/// Errors: kInvalidInput "piece.*", "record.packed"; kUnsupported "piece.form".
Result<std::vector<std::byte>> decode_own_piece(const PieceRecord& piece,
                                                std::span<const std::byte> stored,
                                                RecordUnpacker* begun = nullptr);

/// Bytes of the recipe at the start of a packed bundle; start: its first sizeof(RecipeHeader)
/// bytes. Errors: kInvalidInput "recipe.magic", "recipe.header"; kUnsupported "recipe.version".
Result<std::size_t> packed_recipe_size(std::span<const std::byte> start);

/// The recipe of a packed bundle. bytes: as long as packed_recipe_size() says, 8-byte aligned.
/// Errors: as of open_recipe(), and "recipe.order": pieces are not in the order of need, or not of
/// forms that need no library.
Result<RecipeView> open_packed(std::span<const std::byte> bytes);

/// The memory of a bundle of which some pieces are there; zeros elsewhere, which take no memory
/// where the system gives it page by page.
class ArrivingBundle {
 public:
  /// Null where there is no memory.
  static std::unique_ptr<ArrivingBundle> create(std::uint64_t bundle_size);

  [[nodiscard]] std::span<std::byte> bytes() { return {bytes_.get(), size_}; }
  /// Puts raw bytes in their place; false where they leave the bundle.
  bool put(std::uint64_t offset, std::span<const std::byte> raw);
  /// Copies the tables, then shows the coarsest of everything: see show_coarsest(). Errors: as of
  /// BundleView::open().
  Result<void> show_coarsest();
  /// Puts the tables back.
  void show_all();

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_ = 0;
  std::vector<std::byte> tables_;  ///< while other ones are shown
};

}  // namespace modar
