#include "bake/ship/recipe_maker.hpp"

#include <algorithm>
#include <cstring>
#include <set>

#include <zstd.h>

#include "bake/ship/content_pieces.hpp"
#include "bake/ship/mesh/mesh_pieces.hpp"
#include "formats/base/parallel.hpp"
#include "formats/base/ranges.hpp"
#include "formats/transport/feature_text.hpp"
#include "formats/transport/stages.hpp"
#include "modar/packed_record.hpp"
#include "modar/piece.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

/// Feature sets of a pattern up to here travel as one piece: they share most descriptors, but an
/// update downloads them all. Above the four sets of 2000 keypoints.
constexpr std::uint64_t kMaxPatternPiece = 4u << 20;

/// The highest level without more memory for the decoder: time of publishing for download bytes.
constexpr int kZstdLevel = 19;

std::vector<std::byte> zstd(std::span<const std::byte> bytes) {
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  packed.resize(
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kZstdLevel));
  return packed;
}

std::vector<std::byte> split_halves(std::span<const std::byte> blocks) {
  std::vector<std::byte> halves(blocks.size());
  const std::size_t count = blocks.size() / 8;
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(halves.data() + 4 * i, blocks.data() + 8 * i, 4);
    std::memcpy(halves.data() + 4 * (count + i), blocks.data() + 8 * i + 4, 4);
  }
  return halves;
}

/// A piece under construction.
struct Draft {
  PieceRecord record{};
  std::vector<std::byte> stored;
  bool blocks = false;  ///< of ETC1
};

std::uint64_t place_in(const BundleView& bundle, std::span<const std::byte> section) {
  return static_cast<std::uint64_t>(section.data() - bundle.bytes().data());
}

/// A range of the bundle that a piece covers.
struct Covered {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

/// The stage table, but for feature twins that no preview needs: they are most of a pattern.
std::vector<StageRange> recipe_stages(const BundleView& bundle) {
  std::vector<StageRange> stages = stage_ranges(bundle);
  std::set<std::uint64_t> late;
  for (const SectionEntry& entry : bundle.sections()) {
    const bool twin = entry.type == static_cast<std::uint32_t>(SectionType::kMappedFeatures);
    if (twin && !bundle.section(SectionType::kTrackerRecord, entry.owner).empty()) {
      late.insert(entry.offset);
    }
  }
  for (StageRange& range : stages) {
    if (late.contains(range.offset)) range.stage = LoadStage::kRefine;
  }
  return stages;
}

class RecipeMaker {
 public:
  RecipeMaker(const BundleView& bundle, const RecipeOptions& options)
      : bundle_(bundle), options_(options) {}

  Result<PublishedBundle> make() {
    draft_meshes();
    draft_texts();
    draft_records();
    draft_rest();
    parallel_rows(static_cast<std::uint32_t>(drafts_.size()), options_.jobs,
                  [&](std::uint32_t i) { pack(drafts_[i]); });
    std::sort(drafts_.begin(), drafts_.end(),
              [](const Draft& a, const Draft& b) { return a.record.offset < b.record.offset; });
    return finish();
  }

 private:
  [[nodiscard]] std::span<const std::byte> at(std::uint64_t offset, std::uint64_t size) const {
    return bundle_.bytes().subspan(offset, size);
  }

  void cover(std::uint64_t begin, std::uint64_t size) { covered_.push_back({begin, begin + size}); }

  void draft_meshes() {
    for (MeshPiece& piece : mesh_pieces(bundle_, options_.jobs)) {
      Draft draft;
      draft.record = piece.record;
      draft.stored = std::move(piece.stored);
      cover(draft.record.offset, draft.record.raw_size - draft.record.second_size);
      cover(draft.record.second_offset, draft.record.second_size);
      drafts_.push_back(std::move(draft));
    }
  }

  /// Feature texts that can be derived from the mapped features.
  void draft_texts() {
    for (const SectionEntry& entry : bundle_.sections()) {
      if (entry.type != static_cast<std::uint32_t>(SectionType::kFeatureYml)) continue;
      const auto twin = bundle_.section(SectionType::kMappedFeatures, entry.owner, entry.variant);
      const auto text = at(entry.offset, entry.size);
      const std::string made = feature_text(bundle_.features(entry.owner, entry.variant));
      const auto made_bytes = std::as_bytes(std::span(made));
      if (twin.empty() || text.empty() ||
          !std::equal(text.begin(), text.end(), made_bytes.begin(), made_bytes.end())) {
        continue;
      }
      Draft draft;
      draft.record.form = static_cast<std::uint8_t>(PieceForm::kFeatureText);
      draft.record.offset = entry.offset;
      draft.record.second_offset = place_in(bundle_, twin);
      draft.record.second_size = static_cast<std::uint32_t>(twin.size());
      draft.record.raw_size = static_cast<std::uint32_t>(text.size());
      cover(entry.offset, entry.size);
      drafts_.push_back(std::move(draft));
    }
  }

  /// Tracker records of which the picture and the features' places tell the rest.
  void draft_records() {
    for (const SectionEntry& entry : bundle_.sections()) {
      if (entry.type != static_cast<std::uint32_t>(SectionType::kTrackerRecord)) continue;
      auto packed = pack_tracker_record(at(entry.offset, entry.size));
      if (!packed) continue;
      Draft draft;
      draft.record.form = static_cast<std::uint8_t>(PieceForm::kTrackerRecord);
      draft.record.offset = entry.offset;
      draft.record.raw_size = static_cast<std::uint32_t>(entry.size);
      draft.stored = *std::move(packed);
      cover(entry.offset, entry.size);
      drafts_.push_back(std::move(draft));
    }
  }

  /// All other bytes, section by section; those between sections are zero.
  void draft_rest() {
    std::uint64_t payload = bundle_.bytes().size();
    for (const SectionEntry& entry : bundle_.sections()) {
      if (entry.type >= 256) payload = std::min(payload, entry.offset);
    }
    draft_gaps(0, payload, Cut::kContent);
    const auto sections = bundle_.sections();
    for (std::size_t i = 0; i < sections.size();) {
      const SectionEntry& entry = sections[i];
      std::uint64_t end = entry.offset + entry.size;
      ++i;
      if (entry.type < 256) continue;
      if (entry.type == static_cast<std::uint32_t>(SectionType::kMappedFeatures)) {
        // The sets of one pattern share most of their descriptors: one piece for all.
        while (i < sections.size() && sections[i].type == entry.type &&
               sections[i].owner == entry.owner &&
               sections[i].offset + sections[i].size - entry.offset <= kMaxPatternPiece) {
          end = sections[i].offset + sections[i].size;
          ++i;
        }
        draft_gaps(entry.offset, end, Cut::kWhole);
        continue;
      }
      const bool texture = entry.type == static_cast<std::uint32_t>(SectionType::kTextureData);
      draft_gaps(entry.offset, end, texture ? Cut::kBlocks : Cut::kContent);
    }
  }

  enum class Cut { kContent, kBlocks, kWhole };

  /// Drafts what no piece covers yet between two offsets.
  void draft_gaps(std::uint64_t begin, std::uint64_t end, Cut cut) {
    ranges::sort(covered_, {}, &Covered::begin);
    for (const Covered& covered : covered_) {
      if (covered.end <= begin || covered.begin >= end) continue;
      draft_bytes(begin, covered.begin, cut);
      begin = covered.end;
    }
    draft_bytes(begin, end, cut);
  }

  void draft_bytes(std::uint64_t begin, std::uint64_t end, Cut cut) {
    if (begin >= end) return;
    const auto bytes = at(begin, end - begin);
    const bool whole = cut == Cut::kWhole && bytes.size() <= kMaxPatternPiece;
    const std::vector<std::size_t> sizes =
        whole ? std::vector{bytes.size()} : content_pieces(bytes, cut == Cut::kBlocks ? 8 : 1);
    for (const std::size_t size : sizes) {
      const auto raw = at(begin, size);
      Draft draft;
      draft.record.offset = begin;
      draft.record.raw_size = static_cast<std::uint32_t>(size);
      draft.blocks = cut == Cut::kBlocks;
      const bool zero = ranges::all_of(raw, [](std::byte b) { return b == std::byte{0}; });
      if (!zero) drafts_.push_back(std::move(draft));
      begin += size;
    }
  }

  /// Chooses the smallest form and fills in hash and sizes.
  void pack(Draft& draft) const {
    if (draft.record.raw_hash == 0) {
      draft.record.raw_hash = raw_hash(at(draft.record.offset, draft.record.raw_size));
    }
    if (draft.record.form == 0) pack_bytes(draft);
    draft.record.stored_size = static_cast<std::uint32_t>(draft.stored.size());
    if (draft.stored.empty()) return;
    const ObjectId id = object_id(draft.stored);
    std::copy(id.begin(), id.end(), draft.record.id);
  }

  void pack_bytes(Draft& draft) const {
    const auto raw = at(draft.record.offset, draft.record.raw_size);
    draft.stored = zstd(raw);
    draft.record.form = static_cast<std::uint8_t>(PieceForm::kZstd);
    if (draft.blocks && raw.size() % 8 == 0) {
      auto halves = zstd(split_halves(raw));
      if (halves.size() < draft.stored.size()) {
        draft.stored = std::move(halves);
        draft.record.form = static_cast<std::uint8_t>(PieceForm::kZstdHalves);
      }
    }
    if (draft.stored.size() >= raw.size()) {
      draft.stored.assign(raw.begin(), raw.end());
      draft.record.form = static_cast<std::uint8_t>(PieceForm::kStored);
    }
  }

  Result<PublishedBundle> finish() {
    PublishedBundle out;
    RecipeHeader header{};
    header.bundle_size = bundle_.bytes().size();
    const BundleHash hash = bundle_hash(bundle_.bytes());
    std::copy(hash.begin(), hash.end(), header.bundle_hash);
    std::vector<PieceRecord> pieces;
    for (Draft& draft : drafts_) {
      const auto stored = draft.stored.empty()
                              ? at(draft.record.second_offset, draft.record.second_size)
                              : std::span<const std::byte>(draft.stored);
      const auto form = static_cast<PieceForm>(draft.record.form);
      const bool proven = form == PieceForm::kMesh || form == PieceForm::kLevel ||
                          form == PieceForm::kTrackerRecord;  // by the encoder
      if (!proven && !decode_piece(draft.record, stored)) {
        return fail(ExitCode::kInternal, "ship.piece",
                    "byte " + std::to_string(draft.record.offset),
                    "a piece does not decode to its original bytes", "report this as a bug");
      }
      draft.record.stage = static_cast<std::uint8_t>(earliest_stage(draft.record, stages_));
      pieces.push_back(draft.record);
      FormTotals& totals = out.forms[form];
      ++totals.pieces;
      totals.raw_bytes += draft.record.raw_size;
      totals.stored_bytes += draft.record.stored_size;
      if (!draft.stored.empty()) {
        out.objects.emplace(std::to_array(draft.record.id), std::move(draft.stored));
      }
    }
    out.recipe = recipe_bytes(header, pieces);
    out.recipe_object = zstd(out.recipe);
    out.recipe_id = object_id(out.recipe_object);
    out.download_size = out.recipe_object.size();
    for (const auto& [id, object] : out.objects) out.download_size += object.size();
    return out;
  }

  const BundleView& bundle_;
  const RecipeOptions& options_;
  const std::vector<StageRange> stages_ = recipe_stages(bundle_);
  std::vector<Draft> drafts_;
  std::vector<Covered> covered_;
};

}  // namespace

Result<PublishedBundle> make_recipe(const BundleView& bundle, const RecipeOptions& options) {
  return RecipeMaker(bundle, options).make();
}

}  // namespace modar
