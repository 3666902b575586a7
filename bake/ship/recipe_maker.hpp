// Splits a bundle into the pieces that travel, and writes the recipe that joins them again.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// Sums over the pieces of one form.
struct FormTotals {
  std::uint64_t pieces = 0;
  std::uint64_t raw_bytes = 0;
  std::uint64_t stored_bytes = 0;
};

struct RecipeOptions {
  unsigned jobs = 1;  ///< processes and threads; the pieces do not depend on it
};

/// Everything that a server needs for one bundle.
struct PublishedBundle {
  std::vector<std::byte> recipe;         ///< as RecipeView reads it
  std::vector<std::byte> recipe_object;  ///< zstd of it
  ObjectId recipe_id{};
  std::map<ObjectId, std::vector<std::byte>> objects;  ///< the pieces' stored bytes
  std::map<PieceForm, FormTotals> forms;
  std::uint64_t download_size = 0;  ///< recipe and objects
};

/// Verifies every piece by decoding it.
/// Errors: kInternal "ship.piece".
Result<PublishedBundle> make_recipe(const BundleView& bundle, const RecipeOptions& options);

}  // namespace modar
