#include "formats/trim.hpp"

#include <algorithm>
#include <set>

#include "formats/content_summary.hpp"

namespace modar {
namespace {

template <class T>
std::vector<T> records_of(const Table<T>& table) {
  std::vector<T> records;
  records.reserve(table.size());
  for (std::uint32_t i = 0; i < table.size(); ++i) records.push_back(table[i]);
  return records;
}

std::vector<std::byte> bytes_of(std::span<const std::byte> bytes) {
  return {bytes.begin(), bytes.end()};
}

/// Whether BundleContent has a member for sections of this type.
bool has_member(SectionType type) {
  using enum SectionType;
  constexpr SectionType kMembers[] = {
      kNames,      kMeta,     kContentSummary, kModels,        kChunks,      kLevels,
      kMaterials,  kLayouts,  kTextures,       kTextureLevels, kPatterns,    kParameterSets,
      kScenes,     kLights,   kOcclusion,      kNodes,         kActions,     kMappedFeatures,
      kFeatureYml, kShadow,   kVertices,       kIndices,       kTextureData, kMedia,
      kMediaData,  kStandIns, kStandInChunks,  kStandInLevels};
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
void copy_stand_ins(const BundleView& bundle, BundleContent& content) {
  content.stand_ins = records_of(bundle.stand_ins());
  const auto chunks = static_cast<std::uint32_t>(content.chunks.size());
  const auto levels = static_cast<std::uint32_t>(content.levels.size());
  for (StandInRecord& stand_in : content.stand_ins) stand_in.first_chunk -= chunks;
  for (std::uint32_t c = chunks; c < bundle.chunks().size(); ++c) {
    content.stand_in_chunks.push_back(bundle.chunks()[c]);
    content.stand_in_chunks.back().first_level -= levels;
  }
  for (std::uint32_t l = levels; l < bundle.levels().size(); ++l) {
    content.stand_in_levels.push_back(bundle.levels()[l]);
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
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    content.shadows.push_back(bytes_of(bundle.section(SectionType::kShadow, s)));
  }
  for (const SectionEntry& entry : bundle.sections()) {
    const auto type = static_cast<SectionType>(entry.type);
    if (has_member(type)) continue;
    content.extra.push_back({entry.type, entry.version, entry.flags, entry.owner, entry.variant,
                             bytes_of(bundle.section(type, entry.owner, entry.variant))});
  }
}

}  // namespace

BundleContent trim(const BundleView& bundle) {
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
  copy_stand_ins(bundle, content);
  keep_features(bundle, content);
  copy_payloads(bundle, content);
  content.summary = content_summary_of(content);
  return content;
}

}  // namespace modar
