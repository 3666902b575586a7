// From bytes to validated spans: no copy, no allocation, nothing of the payload touched.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "formats/base/error.hpp"
#include "formats/clip_tracks.hpp"
#include "formats/clips.hpp"
#include "formats/layout.hpp"
#include "formats/scene_nodes.hpp"

namespace modar {

/// A Table of records of any type.
class TableBytes {
 public:
  TableBytes() = default;
  TableBytes(const std::byte* first, std::uint32_t count, std::uint32_t stride)
      : first_(first), count_(count), stride_(stride) {}
  [[nodiscard]] std::uint32_t size() const { return count_ + more_count_; }
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// Continues with the records of another section.
  void append(const TableBytes& more) {
    more_ = more.first_;
    more_count_ = more.count_;
    more_stride_ = more.stride_;
  }

 protected:
  const std::byte* first_ = nullptr;
  const std::byte* more_ = nullptr;
  std::uint32_t count_ = 0;
  std::uint32_t more_count_ = 0;
  std::uint32_t stride_ = 0;
  std::uint32_t more_stride_ = 0;
};

/// Records of a table section; steps by the file's stride so that longer, newer records still read.
template <class T>
class Table : public TableBytes {
 public:
  using TableBytes::TableBytes;
  /// index < size(); the record lives as long as the mapped bytes.
  [[nodiscard]] const T& operator[](std::uint32_t index) const {
    const std::byte* at = index < count_ ? first_ + std::size_t{index} * stride_
                                         : more_ + std::size_t{index - count_} * more_stride_;
    return *reinterpret_cast<const T*>(at);
  }

  /// Goes through the records; the table outlives it.
  class Iterator {
   public:
    Iterator(const Table& table, std::uint32_t index) : table_(&table), index_(index) {}
    const T& operator*() const { return (*table_)[index_]; }
    Iterator& operator++() {
      ++index_;
      return *this;
    }
    bool operator==(const Iterator&) const = default;

   private:
    const Table* table_;
    std::uint32_t index_;
  };
  [[nodiscard]] Iterator begin() const { return {*this, 0}; }
  [[nodiscard]] Iterator end() const { return {*this, size()}; }

  /// Without appended parts.
  [[nodiscard]] Table own() const { return {first_, count_, stride_}; }
};

/// The byte of a layout's vertices that holds occlusion, or kNone.
inline std::uint32_t occlusion_byte(const Table<OcclusionRecord>& records, std::uint32_t layout) {
  for (const OcclusionRecord& record : records) {
    if (record.layout == layout) return record.offset;
  }
  return kNone;
}

/// Chunks that are drawn together: those of a model, or those of one of its proxies.
struct ChunkGroup {
  std::uint32_t model = 0;
  std::uint32_t first_chunk = 0;
  std::uint32_t chunk_count = 0;
};

/// One pattern under one parameter set, as mapped arrays.
struct FeatureView {
  std::span<const KeypointRecord> keypoints;
  std::span<const std::byte> descriptors;  ///< keypoints.size() * descriptor_bytes
  std::uint32_t descriptor_bytes = 0;
};

/// What a view points at. Validation fills it; everyone else reads it through BundleView.
struct BundleParts {
  std::span<const std::byte> bytes;
  std::span<const SectionEntry> sections;
  std::span<const std::byte> names;
  std::span<const std::byte> vertices;
  std::span<const std::byte> indices;
  Table<ModelRecord> models;
  Table<ChunkRecord> chunks;  ///< of models, then of proxies; levels alike
  Table<LevelRecord> levels;
  Table<ProxyRecord> proxies;
  Table<MaterialRecord> materials;
  Table<LayoutRecord> layouts;
  Table<TextureRecord> textures;
  Table<TextureLevelRecord> texture_levels;
  Table<PatternRecord> patterns;
  Table<ParameterSetRecord> parameter_sets;
  Table<SceneRecord> scenes;
  Table<LightRecord> lights;
  Table<OcclusionRecord> occlusion;
  Table<NodeRecord> nodes;
  Table<ActionRecord> actions;
  Table<MediaRecord> media;
  Table<ClipRecord> clips;
  Table<JointRecord> joints;
  Table<BoneRecord> bones;
  Table<PartRecord> parts;
  Table<SceneClipRecord> scene_clips;

  /// Groups in the order of their chunks, which follow each other: all models, then all proxies.
  [[nodiscard]] std::uint32_t chunk_groups() const { return models.size() + proxies.size(); }
  [[nodiscard]] ChunkGroup chunk_group(std::uint32_t index) const {
    if (index < models.size()) {
      return {index, models[index].first_chunk, models[index].chunk_count};
    }
    const ProxyRecord& proxy = proxies[index - models.size()];
    return {proxy.model, proxy.first_chunk, proxy.chunk_count};
  }
};

/// A validated bundle. Holds pointers into the caller's bytes, which must outlive it.
class BundleView {
 public:
  /// A view of nothing: every table and section is empty, and header() may not be called.
  BundleView() = default;
  /// Validates the header, the section table (with its hash) and every table record's references,
  /// ranges and enums, so that each accessor below is safe for any index in range. Payloads
  /// (vertices, indices, blocks, descriptors) are bounded but not read: see check_bundle().
  /// bytes: 8-byte aligned at least. Errors: kInvalidInput "bundle.*", kUnsupported
  /// "bundle.version" and "bundle.section-required"; `where` is the byte offset.
  static Result<BundleView> open(std::span<const std::byte> bytes);

  [[nodiscard]] std::span<const std::byte> bytes() const { return parts_.bytes; }
  [[nodiscard]] const BundleParts& parts() const { return parts_; }
  [[nodiscard]] const FileHeader& header() const {
    return *reinterpret_cast<const FileHeader*>(parts_.bytes.data());
  }
  [[nodiscard]] std::span<const SectionEntry> sections() const { return parts_.sections; }
  /// The bytes of a section, empty if absent. O(log sections).
  [[nodiscard]] std::span<const std::byte> section(SectionType type, std::uint32_t owner = kNone,
                                                   std::uint32_t variant = 0) const;

  [[nodiscard]] std::string_view name(NameRef ref) const;
  [[nodiscard]] std::string_view meta() const;
  [[nodiscard]] Table<ModelRecord> models() const { return parts_.models; }
  /// Of models, and behind them, from chunks().own().size() on, of proxies. Levels alike.
  [[nodiscard]] Table<ChunkRecord> chunks() const { return parts_.chunks; }
  [[nodiscard]] Table<LevelRecord> levels() const { return parts_.levels; }
  /// Sorted by model, those of one model from fine to coarse.
  [[nodiscard]] Table<ProxyRecord> proxies() const { return parts_.proxies; }
  [[nodiscard]] std::uint32_t chunk_groups() const { return parts_.chunk_groups(); }
  [[nodiscard]] ChunkGroup chunk_group(std::uint32_t index) const {
    return parts_.chunk_group(index);
  }
  [[nodiscard]] Table<MaterialRecord> materials() const { return parts_.materials; }
  [[nodiscard]] Table<LayoutRecord> layouts() const { return parts_.layouts; }
  [[nodiscard]] Table<TextureRecord> textures() const { return parts_.textures; }
  [[nodiscard]] Table<TextureLevelRecord> texture_levels() const { return parts_.texture_levels; }
  [[nodiscard]] Table<PatternRecord> patterns() const { return parts_.patterns; }
  [[nodiscard]] Table<ParameterSetRecord> parameter_sets() const { return parts_.parameter_sets; }
  [[nodiscard]] Table<SceneRecord> scenes() const { return parts_.scenes; }

  [[nodiscard]] Table<LightRecord> lights() const { return parts_.lights; }
  [[nodiscard]] Table<OcclusionRecord> occlusion() const { return parts_.occlusion; }
  [[nodiscard]] Table<NodeRecord> nodes() const { return parts_.nodes; }
  [[nodiscard]] Table<ActionRecord> actions() const { return parts_.actions; }
  [[nodiscard]] Table<MediaRecord> media() const { return parts_.media; }
  [[nodiscard]] Table<ClipRecord> clips() const { return parts_.clips; }
  [[nodiscard]] Table<JointRecord> joints() const { return parts_.joints; }
  [[nodiscard]] Table<BoneRecord> bones() const { return parts_.bones; }
  [[nodiscard]] Table<PartRecord> moving_parts() const { return parts_.parts; }
  [[nodiscard]] Table<SceneClipRecord> scene_clips() const { return parts_.scene_clips; }
  /// Those of its own or of the clip that it names; validated: tracks name joints of its model, by
  /// their index in it.
  [[nodiscard]] ClipTracksView clip_tracks(std::uint32_t clip) const;
  /// The file of a media record.
  [[nodiscard]] std::span<const std::byte> media_data(std::uint32_t media) const;

  [[nodiscard]] std::span<const std::byte> vertices() const { return parts_.vertices; }
  [[nodiscard]] std::span<const std::byte> indices() const { return parts_.indices; }
  [[nodiscard]] std::span<const std::byte> texture_data(std::uint32_t texture) const;
  /// Nothing (count 0) if the pattern was not described with that parameter set.
  [[nodiscard]] FeatureView features(std::uint32_t pattern, std::uint32_t set_id) const;
  [[nodiscard]] std::string_view feature_yml(std::uint32_t pattern, std::uint32_t set_id) const;

 private:
  explicit BundleView(const BundleParts& parts) : parts_(parts) {}
  BundleParts parts_;
};

/// Boxes that hold a model in every pose of its clips, as arrays of three floats: the least and the
/// greatest corner.
template <class Visit>
void visit_boxes(const BundleView& bundle, const ModelRecord& model, const Visit& visit) {
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    visit(chunk.bounds_min, chunk.bounds_max);
  }
  for (const PartRecord& part : bundle.moving_parts()) {
    if (part.material - model.first_material < model.material_count)
      visit(part.bounds_min, part.bounds_max);
  }
}

}  // namespace modar
