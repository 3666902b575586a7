// From plain structs to the bundle's bytes. The same content gives the same bytes, always.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/clips.hpp"
#include "formats/layout.hpp"
#include "formats/scene_nodes.hpp"

namespace modar {

/// Features of one pattern under one parameter set, in both forms.
struct FeatureContent {
  std::uint32_t set_id = 0;
  std::uint32_t descriptor_bytes = 0;
  std::vector<KeypointRecord> keypoints;
  std::vector<std::byte> descriptors;  ///< keypoints.size() * descriptor_bytes
  std::string yml;                     ///< OpenCV FileStorage text of the same
};

/// A section that the writer does not know: carried unchanged.
struct ExtraSection {
  std::uint32_t type = 0;
  std::uint16_t version = 1;
  std::uint16_t flags = 0;
  std::uint32_t owner = kNone;
  std::uint32_t variant = 0;
  std::vector<std::byte> bytes;
};

/// Everything a bundle holds. Records refer to each other by index; offsets of levels count bytes
/// in `vertices` and `indices`, offsets of texture levels bytes in the texture's `texture_data`.
struct BundleContent {
  std::string names;  ///< filled by intern()
  std::string meta;   ///< JSON text
  /// content_summary_of() everything else, set last; or empty.
  std::string summary;
  std::vector<ModelRecord> models;
  std::vector<ChunkRecord> chunks;
  std::vector<LevelRecord> levels;
  std::vector<MaterialRecord> materials;
  std::vector<LayoutRecord> layouts;
  std::vector<TextureRecord> textures;
  std::vector<TextureLevelRecord> texture_levels;
  std::vector<PatternRecord> patterns;
  std::vector<ParameterSetRecord> parameter_sets;
  std::vector<SceneRecord> scenes;
  std::vector<LightRecord> lights;
  std::vector<OcclusionRecord> occlusion;
  std::vector<NodeRecord> nodes;
  std::vector<ActionRecord> actions;
  std::vector<MediaRecord> media;
  std::vector<ClipRecord> clips;
  std::vector<JointRecord> joints;
  std::vector<BoneRecord> bones;
  std::vector<PartRecord> parts;
  std::vector<SceneClipRecord> scene_clips;
  std::vector<std::vector<std::byte>> clip_tracks;  ///< by clip; empty: another clip owns its own
  /// Their first_chunk counts in proxy_chunks, first_level of these in proxy_levels: the
  /// writer adds the number of chunks and levels of models, which is known last.
  std::vector<ProxyRecord> proxies;
  std::vector<ChunkRecord> proxy_chunks;
  std::vector<LevelRecord> proxy_levels;
  std::vector<std::vector<FeatureContent>> features;  ///< one list a pattern
  std::vector<std::byte> vertices;
  std::vector<std::byte> indices;
  std::vector<std::vector<std::byte>> texture_data;  ///< one a texture
  std::vector<std::vector<std::byte>> media_data;    ///< one a media record
  std::vector<std::vector<std::byte>> shadows;       ///< one a scene, empty: none
  std::vector<ExtraSection> extra;

  /// Stores a name once and refers to it. Names longer than kMaxNameBytes are cut at a character.
  NameRef intern(std::string_view name);
};

/// The least minor version that has all that a content holds, a summary included.
std::uint16_t minor_version_of(const BundleContent& content);

/// The section table that write_bundle() gives a content, in its order: types, sizes, hashes.
std::vector<SectionEntry> section_table(const BundleContent& content);

/// Receives the file front to back. A false return stops the writing ("io.write").
using ByteSink = std::function<bool(std::span<const std::byte>)>;

/// Streams the bundle through `sink`. Errors: kInternal "bundle.content" where the content
/// contradicts itself (two sections with one key), kIo "io.write".
Result<void> write_bundle(const BundleContent& content, const ByteSink& sink);

/// The same into memory.
Result<std::vector<std::byte>> encode_bundle(const BundleContent& content);

/// The same into a file: written next to `path`, synced, renamed over it.
Result<void> save_bundle(const BundleContent& content, const std::string& path);

}  // namespace modar
