// Unpacks a packed bundle, and says what came out: the same on every processor
// (scripts/foreign.sh).
#include <cstdio>
#include <cstring>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "modar/arriving_bundle.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

Result<std::uint64_t> unpacked_hash(std::span<const std::byte> file) {
  MODAR_ASSIGN(const std::size_t size, packed_recipe_size(file));
  if (size > file.size()) return fail(ExitCode::kInvalidInput, "probe.size", "", "too short", "");
  MODAR_ASSIGN(const RecipeView recipe, open_packed(file.first(size)));
  const auto bundle = ArrivingBundle::create(recipe.header.bundle_size);
  std::size_t at = size;
  for (const PieceRecord& piece : recipe.pieces) {
    if (piece.stored_size > file.size() - at) break;  // verify_sections() tells
    MODAR_ASSIGN(auto raw, decode_own_piece(piece, file.subspan(at, piece.stored_size)));
    bundle->put_piece(piece, raw);
    at += piece.stored_size;
  }
  MODAR_ASSIGN(const BundleView view, BundleView::open(bundle->bytes()));
  MODAR_TRY(verify_sections(view));
  return raw_hash(bundle->bytes());
}

}  // namespace
}  // namespace modar

int main(int count, char** words) {
  if (count != 2) return 2;
  const auto file = modar::MappedFile::open(words[1]);
  if (!file) return 1;
  const auto hash = modar::unpacked_hash(file->bytes());
  if (!hash) {
    std::fprintf(stderr, "%s: %s\n", hash.error().code.c_str(), hash.error().cause.c_str());
    return 1;
  }
  std::printf("%016llx\n", static_cast<unsigned long long>(*hash));
}
