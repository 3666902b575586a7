// From bytes to validated spans: no copy, no allocation, nothing of the payload touched.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "formats/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// Records of a table section; steps by the file's stride so that longer, newer records still read.
template <class T>
class Table {
 public:
  Table() = default;
  Table(const std::byte* first, std::uint32_t count, std::uint32_t stride)
      : first_(first), count_(count), stride_(stride) {}
  [[nodiscard]] std::uint32_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  /// index < size(); the record lives as long as the mapped bytes.
  [[nodiscard]] const T& operator[](std::uint32_t index) const {
    return *reinterpret_cast<const T*>(first_ + std::size_t{index} * stride_);
  }

 private:
  const std::byte* first_ = nullptr;
  std::uint32_t count_ = 0;
  std::uint32_t stride_ = sizeof(T);
};

/// One pattern under one parameter set, as mapped arrays.
struct FeatureView {
  std::span<const KeypointRecord> keypoints;
  std::span<const std::byte> descriptors;  ///< keypoints.size() * descriptor_bytes
  std::uint32_t descriptor_bytes = 0;
};

/// A validated bundle. Holds pointers into the caller's bytes, which must outlive it.
class BundleView {
 public:
  /// Validates the header, the section table (with its hash) and every table record's references,
  /// ranges and enums, so that each accessor below is safe for any index in range. Payloads
  /// (vertices, indices, blocks, descriptors) are bounded but not read: see check_bundle().
  /// bytes: 8-byte aligned at least. Errors: kInvalidInput "bundle.*", kUnsupported
  /// "bundle.version" and "bundle.section-required"; `where` is the byte offset.
  static Result<BundleView> open(std::span<const std::byte> bytes);

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }
  [[nodiscard]] const FileHeader& header() const {
    return *reinterpret_cast<const FileHeader*>(bytes_.data());
  }
  [[nodiscard]] std::span<const SectionEntry> sections() const { return sections_; }
  /// The bytes of a section, empty if there is none. O(log sections).
  [[nodiscard]] std::span<const std::byte> section(SectionType type, std::uint32_t owner = kNone,
                                                   std::uint32_t variant = 0) const;

  [[nodiscard]] std::string_view name(NameRef ref) const;
  [[nodiscard]] std::string_view meta() const;
  [[nodiscard]] Table<ModelRecord> models() const { return models_; }
  [[nodiscard]] Table<ChunkRecord> chunks() const { return chunks_; }
  [[nodiscard]] Table<LevelRecord> levels() const { return levels_; }
  [[nodiscard]] Table<MaterialRecord> materials() const { return materials_; }
  [[nodiscard]] Table<LayoutRecord> layouts() const { return layouts_; }
  [[nodiscard]] Table<TextureRecord> textures() const { return textures_; }
  [[nodiscard]] Table<TextureLevelRecord> texture_levels() const { return texture_levels_; }
  [[nodiscard]] Table<PatternRecord> patterns() const { return patterns_; }
  [[nodiscard]] Table<ParameterSetRecord> parameter_sets() const { return parameter_sets_; }
  [[nodiscard]] Table<SceneRecord> scenes() const { return scenes_; }

  [[nodiscard]] std::span<const std::byte> vertices() const { return vertices_; }
  [[nodiscard]] std::span<const std::byte> indices() const { return indices_; }
  [[nodiscard]] std::span<const std::byte> texture_data(std::uint32_t texture) const;
  /// Nothing (count 0) if the pattern was not described with that parameter set.
  [[nodiscard]] FeatureView features(std::uint32_t pattern, std::uint32_t set_id) const;
  [[nodiscard]] std::string_view feature_yml(std::uint32_t pattern, std::uint32_t set_id) const;

 private:
  std::span<const std::byte> bytes_;
  std::span<const SectionEntry> sections_;
  std::span<const std::byte> vertices_;
  std::span<const std::byte> indices_;
  Table<ModelRecord> models_;
  Table<ChunkRecord> chunks_;
  Table<LevelRecord> levels_;
  Table<MaterialRecord> materials_;
  Table<LayoutRecord> layouts_;
  Table<TextureRecord> textures_;
  Table<TextureLevelRecord> texture_levels_;
  Table<PatternRecord> patterns_;
  Table<ParameterSetRecord> parameter_sets_;
  Table<SceneRecord> scenes_;
};

}  // namespace modar
