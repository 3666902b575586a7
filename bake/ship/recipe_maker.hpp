// A bundle to the pieces that travel, and the recipe that puts them together again.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// What one form would cost, over all the pieces that could take it: for `modar bench ship`.
struct FormTotals {
  std::uint64_t pieces = 0;
  std::uint64_t raw_bytes = 0;
  std::uint64_t stored_bytes = 0;
};

struct RecipeOptions {
  unsigned jobs = 1;  ///< processes and threads; the pieces do not depend on it
};

/// Everything that has to lie on a server for one bundle.
struct PublishedBundle {
  std::vector<std::byte> recipe;         ///< as RecipeView reads it
  std::vector<std::byte> recipe_object;  ///< zstd of it
  ObjectId recipe_id{};
  std::map<ObjectId, std::vector<std::byte>> objects;  ///< the pieces' stored bytes
  std::map<PieceForm, FormTotals> forms;
  std::uint64_t download_size = 0;  ///< recipe and objects
};

/// Every piece was seen to decode to its bytes of the bundle.
/// Errors: kInternal "ship.piece".
Result<PublishedBundle> make_recipe(const BundleView& bundle, const RecipeOptions& options);

}  // namespace modar
