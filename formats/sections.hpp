// The registry of numbers in a bundle: every section type and every flag of a record, once. A
// number that is used twice does not compile. bundle.md is the normative text; tests hold both, and
// the second reader, against each other.
//
// Free: tables and small text 5-15, 21-31, 34-47, 50-63, 73-255; payloads 265-511, 515 and up.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace modar {

/// What the index in a section's `owner` counts; kNothing: it has none, and its variant is 0.
enum class SectionOwner : std::uint8_t {
  kNothing,
  kPattern,
  kScene,
  kChunk,
  kTexture,
  kMedia,
  kClip
};

enum SectionFlags : std::uint16_t {
  kSectionRequired = 1,  ///< a reader that does not know the type must refuse the bundle
  kSectionGpu = 2,       ///< offset is a multiple of kGpuAlignment
};

// Types below 256 are tables and small text, from 256 on payloads, so that everything that opening
// a bundle reads is in its first pages. Numbers are never reused. X(constant, number, name, record
// of the table or at the start, minor version, flags, owner)
#define MODAR_SECTIONS(X)                                                                      \
  X(kNames, 1, "names", "", 0, kSectionRequired, kNothing)                                     \
  X(kMeta, 2, "meta", "", 0, 0, kNothing)                                                      \
  X(kStatement, 3, "statement", "", 0, 0, kNothing) /* of 1.0, no longer read */               \
  X(kContentSummary, 4, "content_summary", "", 1, 0, kNothing)                                 \
  X(kModels, 16, "models", "ModelRecord", 0, kSectionRequired, kNothing)                       \
  X(kChunks, 17, "chunks", "ChunkRecord", 0, kSectionRequired, kNothing)                       \
  X(kLevels, 18, "levels", "LevelRecord", 0, kSectionRequired, kNothing)                       \
  X(kMaterials, 19, "materials", "MaterialRecord", 0, kSectionRequired, kNothing)              \
  X(kLayouts, 20, "layouts", "LayoutRecord", 0, kSectionRequired, kNothing)                    \
  X(kClips, 21, "clips", "ClipRecord", 4, 0, kNothing)                                         \
  X(kJoints, 22, "joints", "JointRecord", 4, 0, kNothing)                                      \
  X(kBones, 23, "bones", "BoneRecord", 4, 0, kNothing)                                         \
  X(kParts, 24, "parts", "PartRecord", 4, 0, kNothing)                                         \
  X(kSceneClips, 25, "scene_clips", "SceneClipRecord", 4, 0, kNothing)                         \
  X(kTextures, 32, "textures", "TextureRecord", 0, kSectionRequired, kNothing)                 \
  X(kTextureLevels, 33, "texture_levels", "TextureLevelRecord", 0, kSectionRequired, kNothing) \
  X(kPatterns, 48, "patterns", "PatternRecord", 0, kSectionRequired, kNothing)                 \
  X(kParameterSets, 49, "parameter_sets", "ParameterSetRecord", 0, kSectionRequired, kNothing) \
  X(kScenes, 64, "scenes", "SceneRecord", 0, kSectionRequired, kNothing)                       \
  X(kLights, 65, "lights", "LightRecord", 2, 0, kNothing)                                      \
  X(kOcclusion, 66, "occlusion", "OcclusionRecord", 2, 0, kNothing)                            \
  X(kProxies, 67, "proxies", "ProxyRecord", 3, 0, kNothing)                                    \
  X(kNodes, 68, "nodes", "NodeRecord", 3, 0, kNothing)                                         \
  X(kActions, 69, "actions", "ActionRecord", 3, 0, kNothing)                                   \
  X(kMedia, 70, "media", "MediaRecord", 3, 0, kNothing)                                        \
  X(kProxyChunks, 71, "proxy_chunks", "ChunkRecord", 3, 0, kNothing)                           \
  X(kProxyLevels, 72, "proxy_levels", "LevelRecord", 3, 0, kNothing)                           \
  X(kMappedFeatures, 256, "feature_twin", "FeatureHeader", 0, kSectionRequired, kPattern)      \
  X(kFeatureYml, 257, "feature_text", "", 0, 0, kPattern)                                      \
  X(kTrackerRecord, 258, "tracker_record", "TrackerRecordHeader", 0, 0, kPattern)              \
  X(kPatternColours, 259, "pattern_colours", "ColourGridHeader", 2, 0, kPattern)               \
  X(kShadow, 260, "shadow", "ShadowHeader", 2, 0, kScene)                                      \
  X(kPatternShape, 261, "pattern_shape", "PatternShapeHeader", 2, 0, kPattern)                 \
  X(kDrawOrder, 262, "draw_order", "DrawOrderRecord", 2, 0, kChunk)                            \
  X(kMediaData, 263, "media_data", "", 3, 0, kMedia)                                           \
  X(kPatternPicture, 264, "pattern_picture", "", 3, 0, kPattern)                               \
  X(kClipTracks, 265, "clip_tracks", "ClipTracksHeader", 4, 0, kClip)                          \
  X(kVertices, 512, "vertices", "", 0, kSectionRequired | kSectionGpu, kNothing)               \
  X(kIndices, 513, "indices", "", 0, kSectionRequired | kSectionGpu, kNothing)                 \
  X(kTextureData, 514, "texture_data", "", 0, kSectionRequired | kSectionGpu, kTexture)

enum class SectionType : std::uint32_t {
#define MODAR_SECTION(constant, number, ...) constant = number,
  MODAR_SECTIONS(MODAR_SECTION)
#undef MODAR_SECTION
};

/// What the specification says about a section type.
struct SectionInfo {
  SectionType type;
  const char* name;     ///< as in bundle.md, with _ for blanks: what content summaries call a table
  const char* record;   ///< of its table, or that it starts with; empty: neither
  std::uint16_t since;  ///< minor version that added it
  std::uint16_t flags;  ///< SectionFlags that it has
  SectionOwner owner;
};

inline constexpr std::array kSections = {
#define MODAR_SECTION(constant, number, name, record, since, flags, owner) \
  SectionInfo{SectionType::constant, name, record, since, flags, SectionOwner::owner},
    MODAR_SECTIONS(MODAR_SECTION)
#undef MODAR_SECTION
};
#undef MODAR_SECTIONS

/// That of a type; nullptr: it is not known.
constexpr const SectionInfo* section_info(std::uint32_t type) {
  for (const SectionInfo& section : kSections) {
    if (static_cast<std::uint32_t>(section.type) == type) return &section;
  }
  return nullptr;
}

/// The table of a record; of several, that with the least number.
constexpr const SectionInfo& section_of_record(std::string_view record) {
  const SectionInfo* found = nullptr;
  for (std::size_t i = kSections.size(); i-- > 0;) {
    if (record == kSections[i].record) found = &kSections[i];
  }
  return *found;  // does not compile if none exists
}

enum MaterialFlags : std::uint32_t {
  kMaterialTwoSided = 1,
  kMaterialOccluder = 2,            ///< hides content behind it and shows the camera's picture
  kMaterialMetalness = 0xFF00,      ///< a share in 255ths, see material_share()
  kMaterialReflectance = 0xFF0000,  ///< likewise
};

/// A share, 0 to 1, that eight of a material's flags hold: kMaterialMetalness or
/// kMaterialReflectance.
constexpr float material_share(std::uint32_t flags, MaterialFlags which) {
  return static_cast<float>(flags & which) / static_cast<float>(which);
}

enum TextureFlags : std::uint32_t {
  kTextureAlpha = 1,    ///< each level has a second ETC1 image whose luminance is alpha
  kTextureRepeat = 2,   ///< uv leave [0,1]: wrap GL_REPEAT (sides are powers of two), else clamp
  kTextureCutOut = 4,   ///< with kTextureAlpha: something where alpha is 1/2 and more, else nothing
  kTextureMirrorU = 8,  ///< these with kTextureRepeat, at most one an axis: its way beyond [0,1]
  kTextureMirrorV = 16,
  kTextureClampU = 32,
  kTextureClampV = 64,
};

/// What a texture shows outside of [0,1].
enum class Wrap : std::uint8_t { kClamp, kRepeat, kMirror };

/// Along u and v.
using TextureWrap = std::array<Wrap, 2>;
inline constexpr TextureWrap kWrapRepeat = {Wrap::kRepeat, Wrap::kRepeat};

/// What flags of a texture say.
constexpr TextureWrap texture_wrap(std::uint32_t flags) {
  const auto along = [flags](std::uint32_t mirror, std::uint32_t clamp) {
    if ((flags & kTextureRepeat) == 0 || (flags & clamp) != 0) return Wrap::kClamp;
    return (flags & mirror) != 0 ? Wrap::kMirror : Wrap::kRepeat;
  };
  return {along(kTextureMirrorU, kTextureClampU), along(kTextureMirrorV, kTextureClampV)};
}

/// The texel of a row of `size` that place x shows.
constexpr std::int64_t wrapped(std::int64_t x, std::int64_t size, Wrap wrap) {
  if (wrap == Wrap::kClamp) return x < 0 ? 0 : x < size ? x : size - 1;
  const std::int64_t period = wrap == Wrap::kMirror ? 2 * size : size;
  x = (x % period + period) % period;
  return x < size ? x : period - 1 - x;
}

enum NodeFlags : std::uint32_t {
  kNodeHidden = 1,  ///< until an action shows it
  kNodePlays = 2,   ///< a video or sound plays from when its pattern is found
  kNodeLoops = 4,   ///< a video or sound begins again where it ends
};

enum MediaFlags : std::uint32_t {
  kMediaSound = 1,    ///< it has a sound track
  kMediaFlashes = 2,  ///< a quarter of it flashes more than three times in a second (WCAG 2.3.1)
};

enum SceneClipFlags : std::uint32_t {
  kSceneClipLoops = 1,  ///< begins again where it ends; else its last pose stays
};

/// A bit of the `flags` of a record.
struct FlagInfo {
  const char* record;
  std::uint32_t flag;
  std::uint16_t since;  ///< minor version that added it
};

inline constexpr FlagInfo kFlags[] = {
    {"SectionEntry", kSectionRequired, 0},
    {"SectionEntry", kSectionGpu, 0},
    {"MaterialRecord", kMaterialTwoSided, 0},
    {"MaterialRecord", kMaterialOccluder, 2},
    {"MaterialRecord", kMaterialMetalness, 3},
    {"MaterialRecord", kMaterialReflectance, 3},
    {"TextureRecord", kTextureAlpha, 0},
    {"TextureRecord", kTextureRepeat, 0},
    {"TextureRecord", kTextureCutOut, 2},
    {"TextureRecord", kTextureMirrorU, 3},
    {"TextureRecord", kTextureMirrorV, 3},
    {"TextureRecord", kTextureClampU, 3},
    {"TextureRecord", kTextureClampV, 3},
    {"NodeRecord", kNodeHidden, 0},
    {"NodeRecord", kNodePlays, 0},
    {"NodeRecord", kNodeLoops, 0},
    {"MediaRecord", kMediaSound, 0},
    {"MediaRecord", kMediaFlashes, 0},
    {"SceneClipRecord", kSceneClipLoops, 4},
};

/// All flags that a record can have.
constexpr std::uint32_t known_flags(std::string_view record) {
  std::uint32_t known = 0;
  for (const FlagInfo& info : kFlags) known |= record == info.record ? info.flag : 0;
  return known;
}

/// The minor version that knows all `flags` of a record.
constexpr std::uint16_t flags_since(std::string_view record, std::uint32_t flags) {
  std::uint16_t since = 0;
  for (const FlagInfo& info : kFlags) {
    const bool set = record == info.record && (flags & info.flag) != 0;
    if (set && info.since > since) since = info.since;
  }
  return since;
}

constexpr bool numbers_are_used_once() {
  for (std::size_t i = 1; i < kSections.size(); ++i) {
    if (kSections[i].type <= kSections[i - 1].type) return false;
  }
  for (const FlagInfo& a : kFlags) {
    int same = 0;
    for (const FlagInfo& b : kFlags) {
      same += std::string_view(a.record) == b.record && (a.flag & b.flag) != 0 ? 1 : 0;
    }
    if (same != 1) return false;
  }
  return true;
}
static_assert(numbers_are_used_once(), "sections in ascending order, a bit a flag");

}  // namespace modar
