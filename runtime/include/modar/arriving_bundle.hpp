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
#include "formats/bundle_view.hpp"
#include "formats/transport/recipe.hpp"
#include "formats/transport/stages.hpp"
#include "modar/packed_record.hpp"

namespace modar {

/// Raw bytes of a piece whose form needs no library: all but zstd's and kFeatureText. Verified.
/// begun: of a kTrackerRecord, the part of these bytes that is unpacked already, or null.
/// Errors: kInvalidInput "piece.*", "mesh.*", "record.packed"; kUnsupported "piece.form".
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
  /// The same of what decode_own_piece() answers.
  bool put_piece(const PieceRecord& piece, std::span<std::byte> raw);
  /// Of the last stage, whose vertices, indices and texture blocks go to the GPU: puts what
  /// kept_ranges() names in its place, and looks at section hashes if bytes come in the file's
  /// order (from gpu_start() on). Errors: kInvalidInput "section.hash".
  Result<void> pass(std::uint64_t offset, std::span<const std::byte> raw);
  /// What of the bundle stays in this memory. Empty before keep().
  [[nodiscard]] std::span<const StageRange> kept() const { return kept_; }
  /// Begins the last stage: for pass(). in_order: the bytes are a file's, no pieces that were
  /// verified. Errors: as of BundleView::open().
  Result<void> keep(bool in_order);
  /// Whether every section that stays whole has the hash that the table states, and all bytes of
  /// the others were looked at where keep() requires it. Errors: kInvalidInput
  /// "section.hash".
  [[nodiscard]] Result<void> verify() const;
  /// For what reads triangles of kept_ranges() alone: calls `read` while models have the chunks of
  /// their coarsest proxies.
  template <class Read>
  auto with_proxies(const Read& read) {
    const auto models = view_.section(SectionType::kModels);
    const std::vector<std::byte> before(models.begin(), models.end());
    use_proxies(bytes(), view_);
    auto answer = read();
    if (!models.empty()) put(static_cast<std::uint64_t>(models.data() - bytes_.get()), before);
    return answer;
  }
  /// Shows the coarsest of everything, in tables that take the place of the bundle's own: see
  /// show_coarsest(). Errors: as of BundleView::open().
  Result<void> show_coarsest();
  /// Puts the bundle's own tables back.
  void show_all();
  [[nodiscard]] bool shows_all() const { return !coarse_; }

 private:
  struct Hash;
  struct FreeHash {
    void operator()(Hash* hash) const;
  };
  Result<void> look_at(std::uint64_t offset, std::span<const std::byte> raw);

  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_ = 0;
  std::vector<std::byte> tables_;  ///< those that are not shown
  bool coarse_ = false;
  BundleView view_;  ///< of keep()
  std::vector<StageRange> kept_;
  std::unique_ptr<Hash, FreeHash> hash_;  ///< of the section `looked_at_`; null: not wanted
  std::size_t looked_at_ = 0;
};

}  // namespace modar
