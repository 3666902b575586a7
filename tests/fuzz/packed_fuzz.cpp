// libFuzzer target: any bytes as a packed bundle that arrives, and as a packed tracker record.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/tracker_record.hpp"
#include "modar/arriving_bundle.hpp"
#include "modar/packed_record.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using namespace modar;
using test::need;

/// Of larger ones the memory alone would take the time.
constexpr std::uint64_t kMostBytes = 4 << 20;

void place(ArrivingBundle& bundle, const PieceRecord& piece, std::span<const std::byte> stored) {
  auto raw = decode_own_piece(piece, stored);
  if (!raw) return test::need_told(raw.error());
  need(raw->size() == piece.raw_size);
  need(bundle.put_piece(piece, *raw));
}

void read_packed(std::span<const std::byte> bytes) {
  const auto size = packed_recipe_size(bytes);
  if (!size) return test::need_told(size.error());
  if (*size > bytes.size()) return;
  // Aligned, and of its exact length: the sanitizer watches the end.
  const std::vector<std::byte> table(bytes.begin(),
                                     bytes.begin() + static_cast<std::ptrdiff_t>(*size));
  const auto recipe = open_packed(table);
  if (!recipe) return test::need_told(recipe.error());
  if (recipe->header.bundle_size > kMostBytes) return;
  const auto bundle = ArrivingBundle::create(recipe->header.bundle_size);
  if (bundle == nullptr) return;
  std::size_t at = *size;
  for (const PieceRecord& piece : recipe->pieces) {
    if (piece.stored_size > bytes.size() - at) break;
    place(*bundle, piece, bytes.subspan(at, piece.stored_size));
    at += piece.stored_size;
  }
  if (const auto shown = bundle->show_coarsest(); !shown) test::need_told(shown.error());
  bundle->show_all();
  const auto kept = bundle->keep(true);
  if (!kept) return test::need_told(kept.error());
  for (const StageRange& range : bundle->kept()) {
    need(range.offset <= bundle->bytes().size());
    need(range.size <= bundle->bytes().size() - range.offset);
  }
  const std::vector<std::byte> all(bundle->bytes().begin(), bundle->bytes().end());
  if (const auto passed = bundle->pass(0, all); !passed) test::need_told(passed.error());
  if (const auto verified = bundle->verify(); !verified) test::need_told(verified.error());
}

/// The hash of a recipe hides the parts behind it: made true first.
void read_rehashed(std::vector<std::byte> bytes) {
  RecipeHeader header{};
  const auto size = packed_recipe_size(bytes);
  if (!size || *size > bytes.size()) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  std::vector<PieceRecord> pieces(header.piece_count);
  if (!pieces.empty()) {
    std::memcpy(pieces.data(), bytes.data() + sizeof header, *size - sizeof header);
  }
  const auto table = recipe_bytes(header, pieces);
  std::copy(table.begin(), table.end(), bytes.begin());
  read_packed(bytes);
}

void read_record(std::span<const std::byte> bytes) {
  const auto record = unpack_tracker_record(bytes);
  RecordUnpacker begun(bytes);
  for (std::size_t there = 0; there < bytes.size(); there += 1 + bytes.size() / 3)
    begun.go_on(there);
  const auto same = begun.finish();
  need(same.has_value() == record.has_value() && (!same || *same == *record));
  if (!record) return test::need_told(record.error());
  TrackerRecordView view;
  need(!view_tracker_record(*record, view));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto input = std::as_bytes(std::span(data, size));
  const std::vector<std::byte> bytes(input.begin(), input.end());
  read_packed(bytes);
  read_rehashed(bytes);
  read_record(bytes);
  return 0;
}
