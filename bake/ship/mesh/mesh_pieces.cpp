#include "bake/ship/mesh/mesh_pieces.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <span>
#include <utility>

#include "formats/base/parallel.hpp"
#include "formats/transport/mesh_coder.hpp"

namespace modar {
namespace {

/// Bytes of a chunk or level below which it travels with its neighbours: each piece is a download.
constexpr std::size_t kLeastRaw = 4096;

/// A chunk's finest level, or the indices of a coarser one.
struct MeshPlace {
  std::uint64_t vertices = 0;      ///< byte in the bundle
  std::uint64_t vertex_bytes = 0;  ///< 0: a coarser level
  std::uint64_t indices = 0;
  std::uint16_t index_base = 0;
  std::vector<std::uint16_t> local;  ///< indices
  const LayoutRecord* layout = nullptr;
};

std::uint64_t start_of(const BundleView& bundle, std::span<const std::byte> section) {
  return static_cast<std::uint64_t>(section.data() - bundle.bytes().data());
}

/// A model's layout, with the byte of its occlusion as one more attribute.
LayoutRecord travelling_layout(const BundleView& bundle, std::uint32_t number) {
  LayoutRecord layout = bundle.layouts()[number];
  const std::uint32_t byte = occlusion_byte(bundle.occlusion(), number);
  if (byte == kNone || layout.attribute_count == std::size(layout.attributes)) return layout;
  AttributeRecord& occlusion = layout.attributes[layout.attribute_count++];
  occlusion.semantic = kTravellingOcclusion;
  occlusion.type = static_cast<std::uint8_t>(ComponentType::kU8);
  occlusion.components = 1;
  occlusion.offset = static_cast<std::uint16_t>(byte);
  return layout;
}

/// Finds what can travel, each byte once.
class MeshFinder {
 public:
  explicit MeshFinder(const BundleView& bundle) : bundle_(bundle) {
    for (std::uint32_t l = 0; l < bundle.layouts().size(); ++l) {
      layouts_.push_back(travelling_layout(bundle, l));
    }
    for (std::uint32_t g = 0; g < bundle.chunk_groups(); ++g) {
      const ChunkGroup group = bundle.chunk_group(g);
      for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
        add_chunk(bundle.chunks()[group.first_chunk + c],
                  layouts_[bundle.models()[group.model].layout]);
      }
    }
  }
  [[nodiscard]] const std::vector<MeshPlace>& places() const { return places_; }

 private:
  void add_chunk(const ChunkRecord& chunk, const LayoutRecord& layout) {
    std::uint16_t base = 0;
    for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
      const LevelRecord& level = bundle_.levels()[chunk.first_level + l];
      if (level.index_count == 0) continue;
      const auto bytes = bundle_.indices().subspan(level.index_offset, 2ull * level.index_count);
      MeshPlace place;
      place.indices = start_of(bundle_, bytes);
      place.local.resize(level.index_count);
      std::memcpy(place.local.data(), bytes.data(), bytes.size());
      const auto [low, high] = std::minmax_element(place.local.begin(), place.local.end());
      if (l == 0) {
        base = *low;
        place.layout = &layout;
        place.vertices = start_of(bundle_, bundle_.vertices()) + level.vertex_offset +
                         std::uint64_t{*low} * layout.stride;
        place.vertex_bytes = (std::uint64_t{*high} - *low + 1) * layout.stride;
      }
      if (*low < base) continue;
      for (std::uint16_t& index : place.local) index = static_cast<std::uint16_t>(index - base);
      place.index_base = base;
      add(std::move(place), bytes.size());
    }
  }

  void add(MeshPlace place, std::uint64_t index_bytes) {
    if (place.vertex_bytes + index_bytes < kLeastRaw ||
        place.vertex_bytes + index_bytes > kMaxPieceBytes || covered(place.indices, index_bytes) ||
        covered(place.vertices, place.vertex_bytes)) {
      return;
    }
    covered_[place.indices] = place.indices + index_bytes;
    if (place.vertex_bytes > 0) covered_[place.vertices] = place.vertices + place.vertex_bytes;
    places_.push_back(std::move(place));
  }

  [[nodiscard]] bool covered(std::uint64_t begin, std::uint64_t size) const {
    const auto next = covered_.lower_bound(begin + size);
    return size > 0 && next != covered_.begin() && std::prev(next)->second > begin;
  }

  const BundleView& bundle_;
  std::vector<LayoutRecord> layouts_;
  std::vector<MeshPlace> places_;
  std::map<std::uint64_t, std::uint64_t> covered_;  ///< begin, end
};

MeshPiece encode(const BundleView& bundle, const MeshPlace& place) {
  const auto vertices = bundle.bytes().subspan(place.vertices, place.vertex_bytes);
  const auto indices = std::as_bytes(std::span(place.local));
  MeshPiece piece;
  PieceRecord& record = piece.record;
  record.index_base = place.index_base;
  record.raw_size = static_cast<std::uint32_t>(vertices.size() + indices.size());
  std::optional<std::vector<std::byte>> coded;
  if (place.layout != nullptr) {
    coded = encode_mesh(vertices, place.local, *place.layout);
    record.form = static_cast<std::uint8_t>(PieceForm::kMesh);
    record.offset = place.vertices;
    record.second_offset = place.indices;
    record.second_size = static_cast<std::uint32_t>(indices.size());
  } else {
    coded = encode_level(place.local);
    record.form = static_cast<std::uint8_t>(PieceForm::kLevel);
    record.offset = place.indices;
  }
  if (coded) piece.stored = *std::move(coded);
  std::vector<std::byte> raw(vertices.begin(), vertices.end());
  raw.insert(raw.end(), indices.begin(), indices.end());
  record.raw_hash = raw_hash(raw);
  return piece;
}

}  // namespace

std::vector<MeshPiece> mesh_pieces(const BundleView& bundle, unsigned jobs) {
  const MeshFinder finder(bundle);
  std::vector<MeshPiece> pieces(finder.places().size());
  parallel_rows(static_cast<std::uint32_t>(pieces.size()), jobs,
                [&](std::uint32_t i) { pieces[i] = encode(bundle, finder.places()[i]); });
  std::erase_if(pieces, [](const MeshPiece& piece) {
    return piece.stored.empty() || piece.stored.size() >= piece.record.raw_size;
  });
  return pieces;
}

}  // namespace modar
