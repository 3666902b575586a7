#include "formats/transport/recipe.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "formats/transport/coded_bytes.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

tl::unexpected<Error> broken(const char* code, std::size_t offset, const char* cause) {
  return fail(ExitCode::kInvalidInput, code, with_numbers("recipe, byte {}", {offset}), cause,
              "publish the release again");
}

bool is_zero(std::span<const std::uint8_t> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t b) { return b == 0; });
}

bool fits(std::uint64_t offset, std::uint64_t size, std::uint64_t limit) {
  return offset <= limit && size <= limit - offset;
}

/// The fault of a piece, or nullptr.
const char* fault_of(const PieceRecord& piece, std::uint64_t bundle_size, std::uint32_t version) {
  const auto form = static_cast<PieceForm>(piece.form);
  const PieceForm last = version == 1 ? PieceForm::kLevel : PieceForm::kCoded;
  if (form < PieceForm::kStored || form > last) return "its form is unknown";
  const LoadStage most = version == 1 ? LoadStage::kAny : LoadStage::kRefine;
  if (static_cast<LoadStage>(piece.stage) > most) return "its stage is unknown";
  if (!is_zero(piece.reserved)) return "its reserved bytes are not zero";
  if (piece.raw_size == 0 || piece.raw_size > kMaxPieceBytes ||
      piece.stored_size > kMaxPieceBytes) {
    return "its size is out of range";
  }
  const bool two_parts = form == PieceForm::kMesh || form == PieceForm::kFeatureText;
  if (!two_parts && (piece.second_offset != 0 || piece.second_size != 0)) {
    return "it has a second part that its form does not know";
  }
  if (form == PieceForm::kCoded) {
    if (piece.index_base == 0 || piece.index_base > kMostCodedStride) return "it has no stride";
  } else if (form != PieceForm::kMesh && form != PieceForm::kLevel && piece.index_base != 0) {
    return "it has no indices to shift";
  }
  if (!fits(piece.second_offset, piece.second_size, bundle_size)) return "it leaves the bundle";
  if (form == PieceForm::kFeatureText) {
    if (piece.stored_size != 0 || !is_zero(piece.id)) return "a derived piece has nothing stored";
    return fits(piece.offset, piece.raw_size, bundle_size) ? nullptr : "it leaves the bundle";
  }
  if (piece.stored_size == 0) return "its size is out of range";
  if (form == PieceForm::kStored && piece.stored_size != piece.raw_size) {
    return "stored and raw size differ";
  }
  if (form == PieceForm::kLevel && piece.raw_size % 6 != 0) return "its indices make no triangles";
  if (form == PieceForm::kZstdHalves && piece.raw_size % 8 != 0) return "it is not of ETC1 blocks";
  if (form == PieceForm::kMesh &&
      (piece.second_size >= piece.raw_size || piece.second_size % 6 != 0)) {
    return "its indices make no triangles";
  }
  const std::uint64_t first = piece.raw_size - (form == PieceForm::kMesh ? piece.second_size : 0);
  return fits(piece.offset, first, bundle_size) ? nullptr : "it leaves the bundle";
}

/// Adds to each of the piece's indices, modulo 65536: they are local to a chunk.
void shift_indices(const PieceRecord& piece, std::span<std::byte> raw, std::uint32_t base) {
  const auto form = static_cast<PieceForm>(piece.form);
  if (form != PieceForm::kMesh && form != PieceForm::kLevel) return;
  const auto indices = form == PieceForm::kLevel ? raw : parts_of(piece, raw).second;
  for (std::size_t i = 0; i + 1 < indices.size(); i += 2) {
    std::uint16_t index = 0;
    std::memcpy(&index, indices.data() + i, sizeof index);
    index = static_cast<std::uint16_t>(index + base);
    std::memcpy(indices.data() + i, &index, sizeof index);
  }
}

/// recipe: a header at least.
std::uint64_t table_hash(std::span<const std::byte> recipe) {
  RecipeHeader header{};
  std::vector<std::byte> hashed(recipe.begin(), recipe.end());
  std::memcpy(&header, recipe.data(), sizeof header);
  header.table_hash = 0;
  std::memcpy(hashed.data(), &header, sizeof header);
  return raw_hash(hashed);
}

}  // namespace

PieceParts parts_of(const PieceRecord& piece, std::span<std::byte> raw) {
  const bool mesh = static_cast<PieceForm>(piece.form) == PieceForm::kMesh;
  const std::size_t second = mesh ? std::min<std::size_t>(piece.second_size, raw.size()) : 0;
  return {raw.first(raw.size() - second), raw.last(second)};
}

void add_index_base(const PieceRecord& piece, std::span<std::byte> raw) {
  shift_indices(piece, raw, piece.index_base);
}

void subtract_index_base(const PieceRecord& piece, std::span<std::byte> raw) {
  shift_indices(piece, raw, 0x10000u - piece.index_base);
}

std::vector<std::byte> recipe_bytes(RecipeHeader header, std::span<const PieceRecord> pieces) {
  std::copy(kRecipeMagic.begin(), kRecipeMagic.end(), header.magic);
  header.version = kRecipeVersion;
  header.piece_count = static_cast<std::uint32_t>(pieces.size());
  std::vector<std::byte> bytes(sizeof header + pieces.size_bytes());
  std::memcpy(bytes.data(), &header, sizeof header);
  if (!pieces.empty()) {
    std::memcpy(bytes.data() + sizeof header, pieces.data(), pieces.size_bytes());
  }
  header.table_hash = table_hash(bytes);
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

Result<RecipeView> open_recipe(std::span<const std::byte> bytes) {
  RecipeView view;
  if (bytes.size() < sizeof view.header) {
    return broken("recipe.truncated", bytes.size(), "it ends in its header");
  }
  std::memcpy(&view.header, bytes.data(), sizeof view.header);
  if (!std::equal(kRecipeMagic.begin(), kRecipeMagic.end(), view.header.magic)) {
    return broken("recipe.magic", 0, "it does not begin as a recipe does");
  }
  if (view.header.version < 1 || view.header.version > kRecipeVersion) {
    return fail(ExitCode::kUnsupported, "recipe.version", "recipe, byte 8",
                with_numbers("it is of version {}, not 1 or 2", {view.header.version}),
                "use a newer modar-fetch");
  }
  if ((view.header.version == 1 && view.header.table_hash != 0) ||
      view.header.bundle_size > kMaxBundleBytes || view.header.piece_count > kMaxPieces) {
    return broken("recipe.header", 12, "its header is out of range");
  }
  if (bytes.size() !=
      sizeof view.header + std::size_t{view.header.piece_count} * sizeof(PieceRecord)) {
    return broken("recipe.truncated", bytes.size(), "its pieces do not add up to its size");
  }
  if (view.header.version > 1 && view.header.table_hash != table_hash(bytes)) {
    return broken("recipe.hash", offsetof(RecipeHeader, table_hash), "its bytes are damaged");
  }
  view.pieces = {reinterpret_cast<const PieceRecord*>(bytes.data() + sizeof view.header),
                 view.header.piece_count};
  for (std::size_t i = 0; i < view.pieces.size(); ++i) {
    if (const char* fault =
            fault_of(view.pieces[i], view.header.bundle_size, view.header.version)) {
      return broken("recipe.piece", sizeof view.header + i * sizeof(PieceRecord), fault);
    }
  }
  return view;
}

std::uint64_t raw_hash(std::span<const std::byte> bytes) {
  return XXH64(bytes.data(), bytes.size(), 0);
}

}  // namespace modar
