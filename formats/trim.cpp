#include "formats/trim.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#include "formats/content_summary.hpp"
#include "formats/meta_text.hpp"
#include "formats/transport/recipe.hpp"
#include "formats/transport/stages.hpp"

namespace modar {
namespace {

template <class T>
std::vector<T> records_of(const Table<T>& table) {
  std::vector<T> records;
  records.reserve(table.size());
  for (const auto& each : table) records.push_back(each);
  return records;
}

std::vector<std::byte> bytes_of(std::span<const std::byte> bytes) {
  return {bytes.begin(), bytes.end()};
}

/// Whether BundleContent has a member for sections of this type.
bool has_member(SectionType type) {
  using enum SectionType;
  constexpr SectionType kMembers[] = {
      kNames,      kMeta,    kContentSummary, kModels,        kChunks,      kLevels,
      kMaterials,  kLayouts, kTextures,       kTextureLevels, kPatterns,    kParameterSets,
      kScenes,     kLights,  kOcclusion,      kNodes,         kActions,     kMappedFeatures,
      kFeatureYml, kShadow,  kVertices,       kIndices,       kTextureData, kMedia,
      kMediaData,  kProxies, kProxyChunks,    kProxyLevels,   kClips,       kJoints,
      kBones,      kParts,   kSceneClips,     kClipTracks};
  return std::find(std::begin(kMembers), std::end(kMembers), type) != std::end(kMembers);
}

/// The features of patterns that nothing else could find, and the parameter sets that these name.
void keep_features(const BundleView& bundle, BundleContent& content) {
  std::set<std::uint32_t> used;
  content.features.resize(bundle.patterns().size());
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    if (!bundle.section(SectionType::kTrackerRecord, p).empty()) continue;
    for (const ParameterSetRecord& set : records_of(bundle.parameter_sets())) {
      const FeatureView view = bundle.features(p, set.id);
      if (view.descriptor_bytes == 0) continue;
      used.insert(set.id);
      content.features[p].push_back({set.id,
                                     view.descriptor_bytes,
                                     {view.keypoints.begin(), view.keypoints.end()},
                                     bytes_of(view.descriptors),
                                     std::string(bundle.feature_yml(p, set.id))});
    }
  }
  for (const ParameterSetRecord& set : records_of(bundle.parameter_sets())) {
    if (used.contains(set.id)) content.parameter_sets.push_back(set);
  }
}

/// Behind content.chunks and content.levels.
void copy_proxies(const BundleView& bundle, BundleContent& content) {
  content.proxies = records_of(bundle.proxies());
  const auto chunks = static_cast<std::uint32_t>(content.chunks.size());
  const auto levels = static_cast<std::uint32_t>(content.levels.size());
  for (ProxyRecord& proxy : content.proxies) proxy.first_chunk -= chunks;
  for (std::uint32_t c = chunks; c < bundle.chunks().size(); ++c) {
    content.proxy_chunks.push_back(bundle.chunks()[c]);
    content.proxy_chunks.back().first_level -= levels;
  }
  for (std::uint32_t l = levels; l < bundle.levels().size(); ++l) {
    content.proxy_levels.push_back(bundle.levels()[l]);
  }
}

void copy_shadows(const BundleView& bundle, BundleContent& content) {
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    content.shadows.push_back(bytes_of(bundle.section(SectionType::kShadow, s)));
  }
}

void copy_payloads(const BundleView& bundle, BundleContent& content) {
  content.vertices = bytes_of(bundle.vertices());
  content.indices = bytes_of(bundle.indices());
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    content.texture_data.push_back(bytes_of(bundle.texture_data(t)));
  }
  for (std::uint32_t m = 0; m < bundle.media().size(); ++m) {
    content.media_data.push_back(bytes_of(bundle.media_data(m)));
  }
}

ExtraSection extra_of(const BundleView& bundle, const SectionEntry& entry) {
  const auto type = static_cast<SectionType>(entry.type);
  return {entry.type,  entry.version, entry.flags,
          entry.owner, entry.variant, bytes_of(bundle.section(type, entry.owner, entry.variant))};
}

/// Tables, and tracks of clips, that are about neither proxies nor features.
BundleContent tables_of(const BundleView& bundle) {
  BundleContent content;
  const auto names = bundle.section(SectionType::kNames);
  content.names.assign(reinterpret_cast<const char*>(names.data()), names.size());
  content.meta = bundle.meta();
  content.models = records_of(bundle.models());
  content.chunks = records_of(bundle.chunks().own());
  content.levels = records_of(bundle.levels().own());
  content.materials = records_of(bundle.materials());
  content.layouts = records_of(bundle.layouts());
  content.textures = records_of(bundle.textures());
  content.texture_levels = records_of(bundle.texture_levels());
  content.patterns = records_of(bundle.patterns());
  content.scenes = records_of(bundle.scenes());
  content.lights = records_of(bundle.lights());
  content.occlusion = records_of(bundle.occlusion());
  content.nodes = records_of(bundle.nodes());
  content.actions = records_of(bundle.actions());
  content.media = records_of(bundle.media());
  content.clips = records_of(bundle.clips());
  content.joints = records_of(bundle.joints());
  content.bones = records_of(bundle.bones());
  content.parts = records_of(bundle.moving_parts());
  content.scene_clips = records_of(bundle.scene_clips());
  for (std::uint32_t c = 0; c < bundle.clips().size(); ++c) {
    content.clip_tracks.push_back(bytes_of(bundle.section(SectionType::kClipTracks, c)));
  }
  return content;
}

// --- The preview ---

/// Ranges of a section without the bytes between them. Those that share bytes continue to share
/// them.
class KeptRanges {
 public:
  KeptRanges(std::span<const std::byte> section, std::vector<StageRange> ranges) {
    std::sort(ranges.begin(), ranges.end(),
              [](const StageRange& a, const StageRange& b) { return a.offset < b.offset; });
    std::uint64_t end = 0;
    for (const StageRange& range : ranges) {
      if (runs_.empty() || range.offset > end) {
        runs_[range.offset] = bytes.size();
        end = range.offset;
      }
      if (range.offset + range.size <= end) continue;
      const auto more = section.subspan(static_cast<std::size_t>(end),
                                        static_cast<std::size_t>(range.offset + range.size - end));
      bytes.insert(bytes.end(), more.begin(), more.end());
      end += more.size();
    }
  }
  /// The new place of the range that began at `offset`.
  [[nodiscard]] std::uint64_t place(std::uint64_t offset) const {
    const auto run = std::prev(runs_.upper_bound(offset));
    return run->second + (offset - run->first);
  }

  std::vector<std::byte> bytes;

 private:
  std::map<std::uint64_t, std::uint64_t> runs_;  ///< from the old place of one to its new place
};

/// A model that its proxy has taken the place of: one level, off by the proxy's error.
void count_anew(ModelRecord& model, std::span<const LevelRecord> levels, float error) {
  model.level_count = 1;
  model.position_error_max += static_cast<double>(error) * model.scale;
  model.vertex_count = 0;
  model.triangle_count = 0;
  for (const LevelRecord& level : levels) {
    model.vertex_count += level.vertex_count;
    model.triangle_count += level.index_count / 3;
  }
}

void keep_shown_geometry(const BundleView& bundle, BundleContent& content) {
  KeptRanges vertices(bundle.vertices(), shown_geometry(bundle, false));
  KeptRanges indices(bundle.indices(), shown_geometry(bundle, true));
  content.chunks.clear();
  content.levels.clear();
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::uint32_t proxy = coarsest_proxy(bundle, m);
    const ChunkGroup group = bundle.chunk_group(proxy == kNone ? m : proxy);
    ModelRecord& model = content.models[m];
    model.first_chunk = static_cast<std::uint32_t>(content.chunks.size());
    model.chunk_count = group.chunk_count;
    const std::size_t first = content.levels.size();
    float error = 0;
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      ChunkRecord chunk = bundle.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        LevelRecord level = bundle.levels()[chunk.first_level + l];
        level.vertex_offset = vertices.place(level.vertex_offset);
        level.index_offset = indices.place(level.index_offset);
        if (proxy != kNone) error = std::exchange(level.error, 0.0f);
        content.levels.push_back(level);
      }
      chunk.first_level = static_cast<std::uint32_t>(content.levels.size()) - chunk.level_count;
      content.chunks.push_back(chunk);
    }
    if (proxy != kNone) count_anew(model, std::span(content.levels).subspan(first), error);
  }
  content.vertices = std::move(vertices.bytes);
  content.indices = std::move(indices.bytes);
}

void keep_shown_textures(const BundleView& bundle, BundleContent& content) {
  content.texture_levels.clear();
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    TextureRecord& texture = content.textures[t];
    const KeptRanges blocks(bundle.texture_data(t), shown_blocks(bundle, t));
    const std::uint32_t first = first_shown_level(bundle, texture);
    const std::uint32_t from = texture.first_level + first;
    texture.first_level = static_cast<std::uint32_t>(content.texture_levels.size());
    texture.level_count -= first;
    for (std::uint32_t l = 0; l < texture.level_count; ++l) {
      TextureLevelRecord level = bundle.texture_levels()[from + l];
      level.offset = blocks.place(level.offset);
      if (level.alpha_offset != kNoOffset) level.alpha_offset = blocks.place(level.alpha_offset);
      content.texture_levels.push_back(level);
    }
    const TextureLevelRecord& finest = content.texture_levels[texture.first_level];
    texture.width = finest.width;
    texture.height = finest.height;
    texture.psnr_db = finest.psnr_db;
    texture.ssim = finest.ssim;
    content.texture_data.push_back(blocks.bytes);
  }
}

/// Other sections that are there; orders in which triangles are drawn, of chunks that still are.
void keep_shown_extra(const BundleView& bundle, BundleContent& content) {
  for (const SectionEntry& entry : bundle.sections()) {
    const auto type = static_cast<SectionType>(entry.type);
    if (has_member(type)) continue;
    if (entry.type >= kFirstPayload && stage_of(type) != LoadStage::kFind) continue;
    ExtraSection extra = extra_of(bundle, entry);
    if (type == SectionType::kDrawOrder) {
      std::uint32_t m = 0;
      while (bundle.models()[m].first_chunk + bundle.models()[m].chunk_count <= entry.owner) ++m;
      if (coarsest_proxy(bundle, m) != kNone) continue;
      extra.owner = entry.owner - bundle.models()[m].first_chunk + content.models[m].first_chunk;
    }
    content.extra.push_back(std::move(extra));
  }
}

/// Files that are played come last, and what acts may act on them; texts of features likewise.
void leave_out_last(BundleContent& content) {
  for (auto& sets : content.features) {
    for (FeatureContent& features : sets) features.yml.clear();
  }
  content.media.clear();
  content.actions.clear();
  std::erase_if(content.nodes, plays_media);
}

std::string preview_meta(std::string_view meta) {
  const std::size_t first = meta.find_first_not_of(" \t\r\n", meta.find('{') + 1);
  const std::string begin(kPreviewMeta);
  if (meta.empty() || first == std::string_view::npos) return begin + "}";
  return begin + (meta[first] == '}' ? "" : ", ") + std::string(meta.substr(first));
}

}  // namespace

BundleContent trim(const BundleView& bundle) {
  BundleContent content = tables_of(bundle);
  copy_proxies(bundle, content);
  keep_features(bundle, content);
  copy_payloads(bundle, content);
  copy_shadows(bundle, content);
  for (const SectionEntry& entry : bundle.sections()) {
    if (!has_member(static_cast<SectionType>(entry.type))) {
      content.extra.push_back(extra_of(bundle, entry));
    }
  }
  content.summary = content_summary_of(content);
  return content;
}

std::optional<std::vector<std::byte>> hide_twins(std::span<const std::byte> start) {
  FileHeader header{};
  if (start.size() < sizeof header) return std::nullopt;
  std::memcpy(&header, start.data(), sizeof header);
  const std::size_t room = (start.size() - sizeof header) / sizeof(SectionEntry);
  if (header.section_count > room) return std::nullopt;
  std::vector<SectionEntry> table(header.section_count);
  const std::size_t size = table.size() * sizeof(SectionEntry);
  std::memcpy(table.data(), start.data() + sizeof header, size);
  std::set<std::uint32_t> recorded;
  for (const SectionEntry& entry : table) {
    if (static_cast<SectionType>(entry.type) == SectionType::kTrackerRecord) {
      recorded.insert(entry.owner);
    }
  }
  std::erase_if(table, [&](const SectionEntry& entry) {
    const auto type = static_cast<SectionType>(entry.type);
    const bool features = type == SectionType::kMappedFeatures || type == SectionType::kFeatureYml;
    return features && recorded.contains(entry.owner);
  });
  header.section_count = static_cast<std::uint32_t>(table.size());
  std::vector<std::byte> out(sizeof header + size);
  const auto kept = std::as_bytes(std::span(table));
  std::memcpy(out.data(), &header, sizeof header);
  std::copy(kept.begin(), kept.end(), out.begin() + sizeof header);
  std::vector<std::byte> hashed(out.begin(), out.begin() + offsetof(FileHeader, hash));
  hashed.insert(hashed.end(), kept.begin(), kept.end());
  header.hash = raw_hash(hashed);
  std::memcpy(out.data(), &header, sizeof header);
  return out;
}

BundleContent preview(const BundleView& bundle) {
  BundleContent content = tables_of(bundle);
  content.meta = preview_meta(bundle.meta());
  keep_features(bundle, content);
  keep_shown_geometry(bundle, content);
  keep_shown_textures(bundle, content);
  copy_shadows(bundle, content);
  keep_shown_extra(bundle, content);
  leave_out_last(content);
  content.summary = content_summary_of(content);
  return content;
}

}  // namespace modar
