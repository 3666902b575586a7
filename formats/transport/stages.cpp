#include "formats/transport/stages.hpp"

#include <algorithm>

namespace modar {
namespace {

constexpr std::uint32_t kBlockBytes = 8;     // of ETC1
constexpr std::uint32_t kTriangleBytes = 6;  // three u16 indices

class Planner {
 public:
  explicit Planner(const BundleView& bundle) : bundle_(bundle) {}

  std::vector<StageRange> plan() {
    std::uint64_t tables = bundle_.bytes().size();
    for (const SectionEntry& entry : bundle_.sections()) {
      if (entry.type >= kFirstPayload) tables = std::min(tables, entry.offset);
    }
    add({0, tables, LoadStage::kFind, kBlockBytes});
    for (const SectionEntry& entry : bundle_.sections()) {
      if (entry.type >= kFirstPayload) plan_section(entry);
    }
    std::stable_sort(ranges_.begin(), ranges_.end(),
                     [](const StageRange& a, const StageRange& b) { return a.stage < b.stage; });
    return std::move(ranges_);
  }

 private:
  void add(const StageRange& range) {
    if (range.size > 0) ranges_.push_back(range);
  }

  void plan_section(const SectionEntry& entry) {
    const auto type = static_cast<SectionType>(entry.type);
    const std::uint32_t layouts = bundle_.layouts().size();
    if (type == SectionType::kVertices) {
      plan_geometry(entry, layouts > 0 ? bundle_.layouts()[0].stride : 4u, false);
    } else if (type == SectionType::kIndices) {
      plan_geometry(entry, kTriangleBytes, true);
    } else if (type == SectionType::kTextureData) {
      plan_texture(entry);
    } else {
      add({entry.offset, entry.size, stage_of(type), kBlockBytes});
    }
  }

  /// The shown part of the section, then the rest.
  void split(const SectionEntry& entry, std::uint32_t stride, std::vector<StageRange> shown) {
    std::sort(shown.begin(), shown.end(),
              [](const StageRange& a, const StageRange& b) { return a.offset < b.offset; });
    std::vector<StageRange> rest;
    std::uint64_t at = 0;
    std::uint64_t from = 0;
    const auto close = [&](std::uint64_t next) {
      if (at > from) add({entry.offset + from, at - from, LoadStage::kShow, stride});
      if (next > at) rest.push_back({entry.offset + at, next - at, LoadStage::kRefine, stride});
      from = next;
    };
    for (const StageRange& range : shown) {
      if (range.offset > at) close(range.offset);
      at = std::max(at, range.offset + range.size);
    }
    close(entry.size);
    for (const StageRange& range : rest) add(range);
  }

  void plan_geometry(const SectionEntry& entry, std::uint32_t stride, bool indices) {
    split(entry, stride, shown_geometry(bundle_, indices));
  }

  /// Levels from small to large, those that are shown together.
  void plan_texture(const SectionEntry& entry) {
    split(entry, kBlockBytes, shown_blocks(bundle_, entry.owner));
  }

  const BundleView& bundle_;
  std::vector<StageRange> ranges_;
};

/// The record of a table, in the bytes that it is a view of.
template <class Record>
Record& writable(std::span<std::byte> bytes, const BundleView& bundle, const Record& record) {
  const auto* at = reinterpret_cast<const std::byte*>(&record);
  return *reinterpret_cast<Record*>(bytes.data() + (at - bundle.bytes().data()));
}

}  // namespace

LoadStage stage_of(SectionType type) {
  switch (type) {
    case SectionType::kMappedFeatures:
    case SectionType::kTrackerRecord:
    case SectionType::kPatternColours:
    case SectionType::kPatternPicture:
    case SectionType::kPatternShape:
    // Opening a bundle reads these.
    case SectionType::kShadow:
    case SectionType::kDrawOrder:
    case SectionType::kClipTracks:
      return LoadStage::kFind;
    default:
      return LoadStage::kRefine;
  }
}

std::uint32_t coarsest_proxy(const BundleView& bundle, std::uint32_t model) {
  for (std::uint32_t i = bundle.proxies().size(); i-- > 0;) {
    if (bundle.proxies()[i].model == model) return bundle.models().size() + i;
  }
  return kNone;
}

std::uint32_t first_shown_level(const BundleView& bundle, const TextureRecord& texture) {
  std::uint32_t level = 0;
  for (; level + 1 < texture.level_count; ++level) {
    const TextureLevelRecord& record = bundle.texture_levels()[texture.first_level + level];
    if (std::max<std::uint32_t>(record.width, record.height) <= kShownSide) break;
  }
  return level;
}

std::vector<StageRange> shown_blocks(const BundleView& bundle, std::uint32_t number) {
  const TextureRecord& texture = bundle.textures()[number];
  std::vector<StageRange> shown;
  for (std::uint32_t l = first_shown_level(bundle, texture); l < texture.level_count; ++l) {
    const TextureLevelRecord& level = bundle.texture_levels()[texture.first_level + l];
    shown.push_back({level.offset, level.size});
    if (level.alpha_offset != kNoOffset) shown.push_back({level.alpha_offset, level.size});
  }
  return shown;
}

std::vector<StageRange> shown_geometry(const BundleView& bundle, bool indices) {
  std::vector<StageRange> shown;
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::uint32_t proxy = coarsest_proxy(bundle, m);
    const ChunkGroup group = bundle.chunk_group(proxy == kNone ? m : proxy);
    const std::uint32_t vertex = bundle.layouts()[bundle.models()[m].layout].stride;
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        const LevelRecord& level = bundle.levels()[chunk.first_level + l];
        shown.push_back(
            {indices ? level.index_offset : level.vertex_offset,
             indices ? 2ull * level.index_count : std::uint64_t{level.vertex_count} * vertex});
      }
    }
  }
  return shown;
}

std::vector<StageRange> stage_ranges(const BundleView& bundle) {
  return Planner(bundle).plan();
}

LoadStage earliest_stage(const PieceRecord& piece, std::span<const StageRange> stages) {
  const auto meets = [](const StageRange& range, std::uint64_t offset, std::uint64_t size) {
    return offset < range.offset + range.size && range.offset < offset + size;
  };
  const bool mesh = static_cast<PieceForm>(piece.form) == PieceForm::kMesh;
  const std::uint64_t second = mesh ? piece.second_size : 0;
  LoadStage stage = LoadStage::kRefine;
  for (const StageRange& range : stages) {
    if (meets(range, piece.offset, piece.raw_size - second) ||
        (mesh && meets(range, piece.second_offset, second))) {
      stage = std::min(stage, range.stage);
    }
  }
  return stage;
}

std::uint64_t gpu_start(const BundleView& bundle) {
  std::uint64_t start = bundle.bytes().size();
  for (const SectionEntry& entry : bundle.sections()) {
    if (entry.type >= kFirstOfGpu) start = std::min(start, entry.offset);
  }
  return start;
}

Overlap overlap(std::uint64_t start, std::uint64_t size, std::uint64_t offset,
                std::span<const std::byte> bytes) {
  const std::uint64_t from = std::max(start, offset);
  const std::uint64_t to = std::min(start + size, offset + bytes.size());
  if (from >= to) return {};
  return {from - start, bytes.subspan(static_cast<std::size_t>(from - offset),
                                      static_cast<std::size_t>(to - from))};
}

std::vector<StageRange> kept_ranges(const BundleView& bundle) {
  std::vector<StageRange> kept{{0, gpu_start(bundle)}};
  const auto add = [&](std::span<const std::byte> section, std::uint64_t at, std::uint64_t size) {
    kept.push_back({static_cast<std::uint64_t>(section.data() - bundle.bytes().data()) + at, size});
  };
  for (const bool indices : {false, true}) {
    for (const StageRange& range : shown_geometry(bundle, indices)) {
      add(indices ? bundle.indices() : bundle.vertices(), range.offset, range.size);
    }
  }
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    for (const StageRange& range : shown_blocks(bundle, t)) {
      add(bundle.texture_data(t), range.offset, range.size);
    }
  }
  for (const SectionEntry& entry : bundle.sections()) {
    if (entry.type != static_cast<std::uint32_t>(SectionType::kDrawOrder)) continue;
    const LevelRecord& level = bundle.levels()[bundle.chunks()[entry.owner].first_level];
    add(bundle.indices(), level.index_offset, 2ull * level.index_count);
  }
  return kept;
}

void use_proxies(std::span<std::byte> bytes, const BundleView& bundle) {
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::uint32_t proxy = coarsest_proxy(bundle, m);
    if (proxy == kNone) continue;
    const ChunkGroup group = bundle.chunk_group(proxy);
    ModelRecord& model = writable(bytes, bundle, bundle.models()[m]);
    model.first_chunk = group.first_chunk;
    model.chunk_count = group.chunk_count;
  }
}

void show_coarsest(std::span<std::byte> bytes, const BundleView& bundle) {
  for (const TextureRecord& each : bundle.textures()) {
    const std::uint32_t first = first_shown_level(bundle, each);
    TextureRecord& texture = writable(bytes, bundle, each);
    texture.first_level += first;
    texture.level_count -= first;
    texture.width = bundle.texture_levels()[texture.first_level].width;
    texture.height = bundle.texture_levels()[texture.first_level].height;
  }
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::uint32_t proxy = coarsest_proxy(bundle, m);
    if (proxy == kNone) continue;
    // As exact as can be, and cheaper than chunks of their finest levels: chosen from everywhere.
    const ChunkGroup coarse = bundle.chunk_group(proxy);
    for (std::uint32_t c = 0; c < coarse.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[coarse.first_chunk + c];
      writable(bytes, bundle, bundle.levels()[chunk.first_level]).error = 0.0f;
    }
    const ChunkGroup fine = bundle.chunk_group(m);
    for (std::uint32_t c = 0; c < fine.chunk_count; ++c) {
      writable(bytes, bundle, bundle.chunks()[fine.first_chunk + c]).level_count = 1;
    }
  }
}

}  // namespace modar
