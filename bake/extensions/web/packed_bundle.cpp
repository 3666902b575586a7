#include "bake/extensions/web/packed_bundle.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <span>
#include <utility>

#include "bake/ship/mesh/mesh_pieces.hpp"
#include "formats/transport/coded_bytes.hpp"
#include "formats/transport/recipe.hpp"
#include "formats/transport/stages.hpp"
#include "modar/arriving_bundle.hpp"
#include "modar/packed_record.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

/// Of a piece, at most: what a damaged one costs to fetch again, against what a coder learns within
/// one. As large as the largest piece of a release.
constexpr std::uint64_t kMostRaw = 256 << 10;
/// Coded bytes of a bundle at most. A phone decodes slower than a fast network delivers; the rest
/// is not coded.
constexpr std::uint64_t kMostCoded = 4 << 20;

/// Bytes at least of a piece that ends with a level's vertices or indices. Smaller pieces enlarge
/// the recipe.
constexpr std::uint64_t kLeastCut = 8 << 10;

struct Piece {
  PieceRecord record{};
  std::vector<std::byte> stored;
};

class Packer {
 public:
  Packer(const BundleView& bundle, unsigned jobs) : bundle_(bundle), jobs_(jobs) {
    find_level_ends();
  }

  std::vector<std::byte> pack() {
    const std::vector<StageRange> stages = stage_ranges(bundle_);
    add_meshes(stages);
    for (const StageRange& range : stages) {
      if (!add_record(range)) add_rest(range);
    }
    std::stable_sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
      return a.record.stage < b.record.stage;
    });
    RecipeHeader header{};
    header.bundle_size = bundle_.bytes().size();
    const BundleHash hash = bundle_hash(bundle_.bytes());
    std::copy(hash.begin(), hash.end(), header.bundle_hash);
    std::vector<PieceRecord> records;
    for (const Piece& piece : pieces_) records.push_back(piece.record);
    std::vector<std::byte> out = recipe_bytes(header, records);
    for (const Piece& piece : pieces_) {
      out.insert(out.end(), piece.stored.begin(), piece.stored.end());
    }
    return out;
  }

 private:
  void add(const StageRange& range, std::uint64_t offset, std::uint64_t size, PieceForm form,
           std::vector<std::byte> stored) {
    Piece piece;
    const ObjectId id = object_id(stored);
    std::copy(id.begin(), id.end(), piece.record.id);
    piece.record.raw_hash = raw_hash(bundle_.bytes().subspan(offset, size));
    piece.record.offset = offset;
    piece.record.raw_size = static_cast<std::uint32_t>(size);
    piece.record.stored_size = static_cast<std::uint32_t>(stored.size());
    piece.record.form = static_cast<std::uint8_t>(form);
    piece.record.stage = static_cast<std::uint8_t>(range.stage);
    if (form == PieceForm::kCoded) {
      piece.record.index_base = static_cast<std::uint16_t>(range.stride);
    }
    piece.stored = std::move(stored);
    pieces_.push_back(std::move(piece));
  }

  /// Chunks and levels; not those of which a page loads parts.
  void add_meshes(std::span<const StageRange> stages) {
    const bool whole = bundle_.bytes().size() <= kMostWhole;
    for (MeshPiece& mesh : mesh_pieces(bundle_, jobs_)) {
      PieceRecord& record = mesh.record;
      record.stage = static_cast<std::uint8_t>(earliest_stage(record, stages));
      if (!whole && record.stage == static_cast<std::uint8_t>(LoadStage::kRefine)) continue;
      const ObjectId id = object_id(mesh.stored);
      std::copy(id.begin(), id.end(), record.id);
      record.stored_size = static_cast<std::uint32_t>(mesh.stored.size());
      covered_[record.offset] = record.offset + record.raw_size - record.second_size;
      if (record.second_size > 0) {
        covered_[record.second_offset] = record.second_offset + record.second_size;
      }
      pieces_.push_back({record, std::move(mesh.stored)});
    }
  }

  /// Bytes that no mesh covers.
  void add_rest(StageRange range) {
    const std::uint64_t end = range.offset + range.size;
    auto next = covered_.upper_bound(range.offset);
    if (next != covered_.begin() && std::prev(next)->second > range.offset) --next;
    for (; range.offset < end; ++next) {
      const bool last = next == covered_.end() || next->first >= end;
      const std::uint64_t begin = last ? end : next->first;
      if (begin > range.offset) {
        range.size = begin - range.offset;
        add_bytes(range);
      }
      if (last) return;
      range.offset = next->second;
    }
  }

  /// A whole tracker record, packed.
  bool add_record(const StageRange& range) {
    const auto record = [&](const SectionEntry& entry) {
      return entry.type == static_cast<std::uint32_t>(SectionType::kTrackerRecord) &&
             entry.offset == range.offset && entry.size == range.size;
    };
    const auto sections = bundle_.sections();
    if (std::none_of(sections.begin(), sections.end(), record)) return false;
    auto packed = pack_tracker_record(bundle_.bytes().subspan(range.offset, range.size));
    if (!packed) return false;
    add(range, range.offset, range.size, PieceForm::kTrackerRecord, *std::move(packed));
    return true;
  }

  /// Levels that come by ranges: see Renderer::Part::kWanted.
  void find_level_ends() {
    const auto start = [&](std::span<const std::byte> section) {
      return static_cast<std::uint64_t>(section.data() - bundle_.bytes().data());
    };
    for (std::uint32_t g = 0; g < bundle_.chunk_groups(); ++g) {
      const ChunkGroup group = bundle_.chunk_group(g);
      const std::uint64_t stride = bundle_.layouts()[bundle_.models()[group.model].layout].stride;
      for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
        const ChunkRecord& chunk = bundle_.chunks()[group.first_chunk + c];
        for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
          const LevelRecord& level = bundle_.levels()[chunk.first_level + l];
          ends_.push_back(start(bundle_.vertices()) + level.vertex_offset +
                          level.vertex_count * stride);
          ends_.push_back(start(bundle_.indices()) + level.index_offset + 2ull * level.index_count);
        }
      }
    }
    std::sort(ends_.begin(), ends_.end());
  }

  /// Of `size` bytes, those up to the end of a level, if one ends there.
  [[nodiscard]] std::uint64_t cut(std::uint64_t offset, std::uint64_t size) const {
    const auto end = std::lower_bound(ends_.begin(), ends_.end(), offset + kLeastCut);
    return end == ends_.end() ? size : std::min(size, *end - offset);
  }

  void add_bytes(const StageRange& range) {
    const std::uint64_t most = kMostRaw / range.stride * range.stride;
    for (std::uint64_t at = 0, size = 0; at < range.size; at += size) {
      size = std::min(most, range.size - at);
      auto raw = bundle_.bytes().subspan(range.offset + at, size);
      if (coded_ + size <= kMostCoded) {
        coded_ += size;
        auto coded = encode_bytes(raw, range.stride);
        if (coded.size() < size) {
          add(range, range.offset + at, size, PieceForm::kCoded, std::move(coded));
          continue;
        }
      }
      size = cut(range.offset + at, size);
      raw = raw.first(size);
      add(range, range.offset + at, size, PieceForm::kStored, {raw.begin(), raw.end()});
    }
  }

  const BundleView& bundle_;
  const unsigned jobs_;
  std::map<std::uint64_t, std::uint64_t> covered_;  ///< by meshes: begin, end
  std::vector<std::uint64_t> ends_;  ///< of levels' vertices and indices, in the file
  std::vector<Piece> pieces_;
  std::uint64_t coded_ = 0;
};

}  // namespace

std::vector<std::byte> pack_bundle(const BundleView& bundle, unsigned jobs) {
  return Packer(bundle, jobs).pack();
}

std::size_t shown_bytes(std::span<const std::byte> packed) {
  const auto size = packed_recipe_size(packed);
  if (!size) return 0;
  const auto recipe = open_packed(packed.first(std::min(*size, packed.size())));
  if (!recipe) return 0;
  std::size_t bytes = *size;
  for (const PieceRecord& piece : recipe->pieces) {
    if (piece.stage < static_cast<std::uint8_t>(LoadStage::kRefine)) bytes += piece.stored_size;
  }
  return bytes;
}

}  // namespace modar
