// libFuzzer target: any bytes as a recipe and as each form of piece that travels.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "formats/transport/mesh_coder.hpp"
#include "modar/piece.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using namespace modar;
using test::need;

void read_recipe(std::span<const std::byte> bytes) {
  const auto recipe = open_recipe(bytes);
  if (!recipe) return test::need_told(recipe.error());
  for (const PieceRecord& piece : recipe->pieces) {
    const std::uint64_t end = recipe->header.bundle_size;
    need(piece.offset <= end && piece.second_offset <= end);
    need(piece.raw_size <= kMaxPieceBytes && piece.stored_size <= kMaxPieceBytes);
  }
}

/// Sizes as a recipe may state them; the hash, which would hide errors before it, comes last.
void read_piece(std::span<const std::byte> stored, PieceForm form, std::uint32_t raw_size) {
  PieceRecord piece{};
  piece.form = static_cast<std::uint8_t>(form);
  piece.raw_size = raw_size;
  piece.stored_size = static_cast<std::uint32_t>(stored.size());
  piece.second_size = form == PieceForm::kMesh ? raw_size / 4 * 2 : 0;
  const auto raw = decode_piece(piece, stored);
  if (!raw) return test::need_told(raw.error());
  need(raw->size() == piece.raw_size);
}

void read_mesh(std::span<const std::byte> object) {
  const auto mesh = decode_mesh(object);
  if (!mesh) return test::need_told(mesh.error());
  need(mesh->indices.size() % 3 == 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The vector's memory is aligned as a recipe wants it.
  const auto input = std::as_bytes(std::span(data, size));
  const std::vector<std::byte> bytes(input.begin(), input.end());
  read_recipe(bytes);
  read_mesh(bytes);
  const std::uint32_t count = size < 4 ? 3 : 3u * (static_cast<std::uint32_t>(data[3]) + 1);
  (void)decode_level(bytes, count);
  for (const PieceForm form :
       {PieceForm::kStored, PieceForm::kZstd, PieceForm::kZstdHalves, PieceForm::kMesh,
        PieceForm::kFeatureText, PieceForm::kLevel, PieceForm::kTrackerRecord, PieceForm::kCoded}) {
    // Garbage decodes to as much as requested, a decision at a time: 64 make a run 12 ms
    // long.
    read_piece(bytes, form, (form == PieceForm::kCoded ? 4 : 64) * count);
  }
  return 0;
}
