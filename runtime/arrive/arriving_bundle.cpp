#include "modar/arriving_bundle.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "formats/transport/coded_bytes.hpp"
#include "formats/transport/mesh_coder.hpp"
#include "formats/transport/stages.hpp"

#ifdef __EMSCRIPTEN__
#include <unistd.h>
#endif
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

constexpr const char* kCure = "fetch it again, or make the packed bundle again";

Result<std::vector<std::byte>> own_bytes(const PieceRecord& piece,
                                         std::span<const std::byte> stored, RecordUnpacker* begun) {
  switch (static_cast<PieceForm>(piece.form)) {
    case PieceForm::kStored:
      return std::vector<std::byte>(stored.begin(), stored.end());
    case PieceForm::kTrackerRecord:
      return begun != nullptr ? begun->finish() : unpack_tracker_record(stored);
    case PieceForm::kCoded: {
      auto raw = decode_bytes(stored, piece.raw_size, std::max<std::uint32_t>(piece.index_base, 1));
      if (raw) return *std::move(raw);
      return fail(ExitCode::kInvalidInput, "piece.coded", "piece", "it ends too early", kCure);
    }
    case PieceForm::kMesh: {
      MODAR_ASSIGN(auto mesh, decode_mesh(stored));
      const auto indices = std::as_bytes(std::span(mesh.indices));
      mesh.vertices.insert(mesh.vertices.end(), indices.begin(), indices.end());
      return std::move(mesh.vertices);
    }
    case PieceForm::kLevel: {
      MODAR_ASSIGN(const auto indices, decode_level(stored, piece.raw_size / 2));
      const auto bytes = std::as_bytes(std::span(indices));
      return std::vector<std::byte>(bytes.begin(), bytes.end());
    }
    default:
      return fail(ExitCode::kUnsupported, "piece.form", "piece", "its form needs a library",
                  "use modar-fetch");
  }
}

bool needs_no_library(PieceForm form) {
  return form == PieceForm::kStored || form == PieceForm::kMesh || form == PieceForm::kLevel ||
         form == PieceForm::kTrackerRecord || form == PieceForm::kCoded;
}

/// Zeros; untouched where they are zeros already, so that pages without pieces take no memory.
std::byte* zeros(std::size_t size) {
#ifdef __EMSCRIPTEN__
  // Its calloc() writes them. Bytes beyond the heap's end are zeros.
  const auto* const end = static_cast<const std::byte*>(sbrk(0));
  auto* bytes = static_cast<std::byte*>(std::malloc(size));
  if (bytes != nullptr && bytes < end) {
    std::fill(bytes,
              bytes + std::min<std::ptrdiff_t>(end - bytes, static_cast<std::ptrdiff_t>(size)),
              std::byte{0});
  }
  return bytes;
#else
  return static_cast<std::byte*>(std::calloc(size, 1));
#endif
}

}  // namespace

Result<std::vector<std::byte>> decode_own_piece(const PieceRecord& piece,
                                                std::span<const std::byte> stored,
                                                RecordUnpacker* begun) {
  MODAR_ASSIGN(auto raw, own_bytes(piece, stored, begun));
  if (raw.size() != piece.raw_size || raw_hash(raw) != piece.raw_hash) {
    return fail(ExitCode::kInvalidInput, "piece.hash", "piece",
                "it decodes to different bytes than were published", kCure);
  }
  return raw;
}

Result<std::size_t> packed_recipe_size(std::span<const std::byte> start) {
  RecipeHeader header{};
  if (start.size() < sizeof header) {
    return fail(ExitCode::kInvalidInput, "recipe.magic", "packed bundle", "it ends in its header",
                kCure);
  }
  std::memcpy(&header, start.data(), sizeof header);
  if (!std::equal(kRecipeMagic.begin(), kRecipeMagic.end(), header.magic)) {
    return fail(ExitCode::kInvalidInput, "recipe.magic", "packed bundle",
                "it does not begin as one does", kCure);
  }
  if (header.version != kRecipeVersion) {
    return fail(ExitCode::kUnsupported, "recipe.version", "packed bundle", "its version is unknown",
                "load the page again");
  }
  if (header.piece_count > kMaxPieces) {
    return fail(ExitCode::kInvalidInput, "recipe.header", "packed bundle", "it has too many pieces",
                kCure);
  }
  return sizeof header + std::size_t{header.piece_count} * sizeof(PieceRecord);
}

Result<RecipeView> open_packed(std::span<const std::byte> bytes) {
  MODAR_ASSIGN(const RecipeView recipe, open_recipe(bytes));
  std::uint8_t last = static_cast<std::uint8_t>(LoadStage::kFind);
  for (const PieceRecord& piece : recipe.pieces) {
    if (piece.stage < last || !needs_no_library(static_cast<PieceForm>(piece.form))) {
      return fail(ExitCode::kInvalidInput, "recipe.order", "packed bundle",
                  "its pieces are not in the order of need, or of forms for modar-fetch", kCure);
    }
    last = piece.stage;
  }
  return recipe;
}

std::unique_ptr<ArrivingBundle> ArrivingBundle::create(std::uint64_t bundle_size) {
  auto bundle = std::make_unique<ArrivingBundle>();
  bundle->size_ = static_cast<std::size_t>(bundle_size);
  if (bundle->size_ != bundle_size || bundle_size == 0) return nullptr;
  bundle->bytes_.reset(zeros(bundle->size_));
  return bundle->bytes_ == nullptr ? nullptr : std::move(bundle);
}

bool ArrivingBundle::put(std::uint64_t offset, std::span<const std::byte> raw) {
  if (offset > size_ || raw.size() > size_ - offset) return false;
  if (!raw.empty()) std::memcpy(bytes_.get() + offset, raw.data(), raw.size());
  return true;
}

bool ArrivingBundle::put_piece(const PieceRecord& piece, std::span<std::byte> raw) {
  add_index_base(piece, raw);
  const PieceParts parts = parts_of(piece, raw);
  return put(piece.offset, parts.first) && put(piece.second_offset, parts.second);
}

Result<void> ArrivingBundle::show_coarsest() {
  if (coarse_) return {};
  if (tables_.empty()) {
    MODAR_ASSIGN(const BundleView view, BundleView::open(bytes()));
    std::uint64_t end = size_;
    for (const SectionEntry& entry : view.sections()) {
      if (entry.type >= kFirstPayload) end = std::min(end, entry.offset);
    }
    tables_.assign(bytes_.get(), bytes_.get() + end);
    modar::show_coarsest(bytes(), view);
  } else {
    std::swap_ranges(tables_.begin(), tables_.end(), bytes_.get());
  }
  coarse_ = true;
  return {};
}

void ArrivingBundle::show_all() {
  if (coarse_) std::swap_ranges(tables_.begin(), tables_.end(), bytes_.get());
  coarse_ = false;
}

struct ArrivingBundle::Hash {
  XXH64_state_t state;
};

void ArrivingBundle::FreeHash::operator()(Hash* hash) const {
  delete hash;
}

Result<void> ArrivingBundle::keep(bool in_order) {
  MODAR_ASSIGN(view_, BundleView::open(bytes()));
  kept_ = kept_ranges(view_);
  hash_.reset(in_order ? new Hash : nullptr);
  looked_at_ = 0;
  const auto sections = view_.sections();
  while (looked_at_ < sections.size() && sections[looked_at_].type < kFirstOfGpu) ++looked_at_;
  return {};
}

Result<void> ArrivingBundle::pass(std::uint64_t offset, std::span<const std::byte> raw) {
  for (const StageRange& range : kept_) {
    const Overlap part = overlap(range.offset, range.size, offset, raw);
    put(range.offset + part.at, part.bytes);
  }
  return hash_ != nullptr ? look_at(offset, raw) : Result<void>();
}

Result<void> ArrivingBundle::look_at(std::uint64_t offset, std::span<const std::byte> raw) {
  const auto sections = view_.sections();
  while (looked_at_ < sections.size()) {
    const SectionEntry& entry = sections[looked_at_];
    const std::uint64_t end = entry.offset + entry.size;
    if (offset + raw.size() <= entry.offset && end > entry.offset) break;
    const std::uint64_t from = std::max(entry.offset, offset);
    const std::uint64_t to = std::min(end, offset + raw.size());
    if (from == entry.offset || entry.size == 0) XXH64_reset(&hash_->state, 0);
    if (from < to) {
      XXH64_update(&hash_->state, raw.data() + (from - offset),
                   static_cast<std::size_t>(to - from));
    }
    if (to < end) break;
    if (XXH64_digest(&hash_->state) != entry.hash)
      return tl::unexpected(wrong_section(view_, entry));
    ++looked_at_;
  }
  return {};
}

Result<void> ArrivingBundle::verify() const {
  for (const SectionEntry& entry : view_.sections()) {
    if (entry.type >= kFirstOfGpu) break;
    const std::span<const std::byte> section(bytes_.get() + entry.offset,
                                             static_cast<std::size_t>(entry.size));
    if (raw_hash(section) != entry.hash) return tl::unexpected(wrong_section(view_, entry));
  }
  if (hash_ != nullptr && looked_at_ < view_.sections().size()) {
    return tl::unexpected(wrong_section(view_, view_.sections()[looked_at_]));  // has not come
  }
  return {};
}

}  // namespace modar
