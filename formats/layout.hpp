// The bundle's bytes as structs. bundle.md is the normative text; a test holds the two together.
//
// All numbers are little-endian. Every struct is trivially copyable, has no implicit padding, and
// its reserved fields are zero in a file. Numbers of enums are never reused.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "formats/sections.hpp"

namespace modar {

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'O', 'D', 0x0D, 0x0A, 0x1A, 0x0A};
inline constexpr std::uint16_t kMajorVersion = 1;    ///< must match
inline constexpr std::uint16_t kMinorVersion = 4;    ///< additive
inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;  ///< "no such index"
inline constexpr std::uint64_t kNoOffset = 0xFFFFFFFFFFFFFFFFull;
inline constexpr std::uint32_t kMaxSections = 65536;
inline constexpr std::uint32_t kMaxChunkVertices = 65535;
inline constexpr std::uint32_t kMaxNameBytes = 1024;
inline constexpr std::uint32_t kMaxTextureSide = 8192;
inline constexpr std::uint32_t kMaxPatternSide = 65535;
inline constexpr std::uint32_t kMaxShadowSide = 256;
inline constexpr std::uint32_t kMaxPatternPicture = 32768;  ///< bytes
inline constexpr std::uint32_t kMaxVertexStride = 252;      ///< bytes
inline constexpr std::uint32_t kMaxDescriptorBits = 4096;
inline constexpr std::uint8_t kMaxOcclusion = 127;
/// Smallest length of a source unit, in metres. Values outside of these limits are errors.
inline constexpr double kLeastUnitMetres = 1e-9;
inline constexpr double kMostUnitMetres = 1e9;
inline constexpr double kLeastPatternMm = 1e-3;
inline constexpr double kMostPatternMm = 1e7;
inline constexpr double kLeastSceneScale = 1e-9;
inline constexpr double kMostSceneNumber = 1e9;
inline constexpr double kMostLight = 1e6;
inline constexpr double kMostShapeNumber = 1e3;  ///< pattern units
inline constexpr std::uint64_t kSectionAlignment = 64;
inline constexpr std::uint64_t kGpuAlignment = 4096;

struct FileHeader {
  std::uint8_t magic[8];
  std::uint16_t major;
  std::uint16_t minor;
  std::uint32_t section_count;
  std::uint64_t file_size;
  std::uint64_t table_offset;  ///< 64 in version 1
  std::uint32_t entry_size;    ///< sizeof(SectionEntry)
  std::uint32_t reserved0;
  std::uint64_t reserved1[2];
  std::uint64_t hash;  ///< XXH64, seed 0, of bytes 0-55 and the section table
};
static_assert(sizeof(FileHeader) == 64);

/// Entries are sorted by (type, owner, variant), without duplicates, and their payloads are in the
/// file in the same order. Bytes between sections are zero.
struct SectionEntry {
  std::uint32_t type;
  std::uint16_t version;  ///< 1 for every type of bundle version 1.0
  std::uint16_t flags;    ///< SectionFlags
  std::uint32_t owner;    ///< index of the record that it belongs to, or kNone
  std::uint32_t variant;  ///< tells several sections of one owner apart; else 0
  std::uint64_t offset;
  std::uint64_t size;
  std::uint64_t hash;  ///< XXH64, seed 0, of the section's bytes
  std::uint64_t reserved;
};
static_assert(sizeof(SectionEntry) == 48);

/// Every table section starts with this; `count` records of `stride` bytes follow. A later minor
/// version may append fields to a record, so a reader steps by `stride`.
struct TableHeader {
  std::uint32_t count;
  std::uint32_t stride;
  std::uint64_t reserved;
};
static_assert(sizeof(TableHeader) == 16);

/// A slice of the kNames section.
struct NameRef {
  std::uint32_t offset;
  std::uint32_t length;
};

/// source = center + scale * decoded, decoded in [-1,1].
struct ModelRecord {
  NameRef name;
  double center[3];           ///< source units
  double scale;               ///< source units; half of the largest side, 1 for a point
  double diagonal;            ///< source units; of the source bounding box
  double unit_metres;         ///< metres in a source unit; 0: unknown
  double position_error_max;  ///< source units; measured on the decoded bytes
  double position_error_rms;  ///< source units
  float normal_error_max_deg;
  float normal_error_rms_deg;
  float uv_error_max_texels;  ///< 0 where there is no texture
  float uv_error_rms_texels;
  std::uint64_t vertex_count;    ///< packed vertices of level 0
  std::uint64_t triangle_count;  ///< of level 0
  std::uint64_t source_vertex_count;
  std::uint64_t source_face_count;
  std::uint32_t layout;  ///< index into kLayouts
  std::uint32_t first_chunk;
  std::uint32_t chunk_count;
  std::uint32_t first_material;
  std::uint32_t material_count;
  std::uint32_t level_count;  ///< greatest of its chunks
  std::uint32_t reserved[4];
};
static_assert(sizeof(ModelRecord) == 160);

/// A spatially compact part of a model with one material.
/// Decoding: position = position_offset + position_step * attribute; uv = uv_offset + uv_scale *
/// attribute (attributes as GL hands them to a shader: normalised ones are in [0,1] or [-1,1]).
struct ChunkRecord {
  float bounds_min[3];  ///< model space, conservative over all levels, decoded positions
  float bounds_max[3];
  float cone_axis[3];  ///< unit length, or zero where cone_cutoff > 1
  float cone_cutoff;   ///< sine bound: invisible if dot(normalize(p - eye), axis) >= cutoff
                       ///< for every point p of the box; > 1: never culled
  float position_offset[3];
  float position_step;
  float uv_offset[2];
  float uv_scale[2];
  std::uint32_t material;     ///< index into kMaterials, absolute
  std::uint32_t first_level;  ///< index into kLevels
  std::uint32_t level_count;  ///< at least 1; level 0 is the finest
  std::uint32_t reserved;
};
static_assert(sizeof(ChunkRecord) == 88);

/// One level of detail of a chunk: triangles whose indices count from vertex_offset. Levels and
/// chunks may share vertices (the same vertex_offset).
struct LevelRecord {
  std::uint64_t vertex_offset;  ///< bytes into kVertices
  std::uint64_t index_offset;   ///< bytes into kIndices
  std::uint32_t vertex_count;   ///< every index is below it; at most kMaxChunkVertices
  std::uint32_t index_count;    ///< a multiple of 3
  float error;  ///< model space: at least the greatest distance from level 0, both ways
  std::uint32_t reserved;
};
static_assert(sizeof(LevelRecord) == 32);

/// A whole model once more, as one coarse level: drawn in place of all chunks of the model, never
/// together with one of them. Its chunks and levels are in tables of their own, which older readers
/// skip; their numbers continue those of the models' chunks and levels.
struct ProxyRecord {
  std::uint32_t model;  ///< index into kModels; those of one model from fine to coarse
  std::uint32_t first_chunk;
  std::uint32_t chunk_count;  ///< each has one level, and all state the error of the whole
  std::uint32_t reserved;
};
static_assert(sizeof(ProxyRecord) == 16);

struct MaterialRecord {
  NameRef name;
  float ambient[3];
  float diffuse[3];
  float specular[3];
  float emission[3];
  float shininess;
  float opacity;
  std::uint32_t texture;  ///< index into kTextures, or kNone
  std::uint32_t flags;    ///< MaterialFlags
  std::uint32_t reserved[2];
};
static_assert(sizeof(MaterialRecord) == 80);

enum class Semantic : std::uint8_t {
  kPosition = 1,   ///< 3 components, or 4 of which the last is padding
  kNormal = 2,     ///< 3 components
  kUv = 3,         ///< 2 components
  kColour = 4,     ///< RGBA
  kNormalOct = 5,  ///< 2 components, octahedral
  kJoints = 6,     ///< 4 u8: bones of the part, PartRecord
  kWeights = 7,    ///< 4 normalised u8 whose sum is 255
  kMorphX = 8,     ///< i16, one a morph target of the part: along x, in kMorphUnits
  kMorphY = 9,
  kMorphZ = 10,
};
enum class ComponentType : std::uint8_t {
  kHalf = 1,
  kI16 = 2,
  kU16 = 3,
  kI8 = 4,
  kU8 = 5,
  kF32 = 6
};

struct AttributeRecord {
  std::uint8_t semantic;    ///< Semantic
  std::uint8_t type;        ///< ComponentType
  std::uint8_t components;  ///< 1-4
  std::uint8_t normalised;  ///< 0 or 1, as in glVertexAttribPointer
  std::uint16_t offset;     ///< bytes from the start of the vertex; a multiple of 2
  std::uint16_t reserved;
};
static_assert(sizeof(AttributeRecord) == 8);

struct LayoutRecord {
  std::uint16_t stride;  ///< bytes; a multiple of 4
  std::uint16_t attribute_count;
  std::uint32_t reserved;
  AttributeRecord attributes[8];  ///< the first attribute_count are used, the rest zero
};
static_assert(sizeof(LayoutRecord) == 72);

enum class TextureFormat : std::uint32_t { kEtc1Rgb = 1 };

struct TextureRecord {
  NameRef name;
  std::uint32_t width;  ///< of level 0, pixels
  std::uint32_t height;
  std::uint32_t source_width;
  std::uint32_t source_height;
  std::uint32_t format;       ///< TextureFormat
  std::uint32_t flags;        ///< TextureFlags
  std::uint32_t first_level;  ///< index into kTextureLevels
  std::uint32_t level_count;  ///< 1, or a full chain down to 1x1
  float psnr_db;              ///< level 0 against the image that was encoded; 99 where equal
  float ssim;
  std::uint32_t reserved[4];
};
static_assert(sizeof(TextureRecord) == 64);

/// Sizes follow GL: each side is max(1, floor(side / 2)) of the level before.
struct TextureLevelRecord {
  std::uint64_t offset;        ///< bytes into the texture's kTextureData section
  std::uint64_t alpha_offset;  ///< the alpha twin's, or kNoOffset
  std::uint32_t size;          ///< bytes: 8 * ceil(width/4) * ceil(height/4); of the twin too
  std::uint32_t width;
  std::uint32_t height;
  float psnr_db;
  float ssim;
  std::uint32_t reserved;
};
static_assert(sizeof(TextureLevelRecord) == 40);

/// Pattern plane: x right, y up, z towards the viewer; corners (+-half_width, +-half_height, 0).
struct PatternRecord {
  NameRef name;
  std::uint32_t width;  ///< pixels
  std::uint32_t height;
  double width_mm;    ///< physical width; 0: unknown
  float half_width;   ///< W of ModAR Eq. 1: width / max(width, height)
  float half_height;  ///< H of ModAR Eq. 1
  float score;        ///< 0-100; -1: not scored
  std::uint32_t score_version;
  std::uint32_t copies;  ///< of the print that are tracked at once, 2 to kMaxCopies; 0: 1
  std::uint32_t reserved[5];
};
static_assert(sizeof(PatternRecord) == 64);

/// More are rarely in one view.
inline constexpr std::uint32_t kMaxCopies = 16;

enum class Detector : std::uint32_t { kFastOrb = 1, kAgastBrisk = 2 };

/// The parameter set that a bake stores where nobody names one: the choice of the ModAR paper.
inline constexpr const char* kDefaultParameterSet = "orb-2000";

/// Everything that detection on the device shares with the bake (Tables 4 and 5 of the ModAR
/// paper).
struct ParameterSetRecord {
  NameRef name;                ///< "orb-2000"
  std::uint32_t id;            ///< the `variant` of its feature sections; never reused
  std::uint32_t detector;      ///< Detector
  std::uint32_t max_features;  ///< FAST-ORB
  float scale_factor;          ///< FAST-ORB: pyramid decimation
  std::uint32_t level_count;   ///< FAST-ORB
  std::uint32_t edge_threshold;
  std::uint32_t first_level;
  std::uint32_t wta_k;
  std::uint32_t harris;  ///< 1: Harris ranking, 0: FAST score
  std::uint32_t patch_size;
  std::uint32_t fast_threshold;
  std::uint32_t agast_threshold;  ///< AGAST-BRISK
  std::uint32_t octaves;          ///< AGAST-BRISK
  float pattern_scale;            ///< AGAST-BRISK
  std::uint32_t descriptor_bits;
  std::uint32_t max_distance;  ///< bits; a match above it is rejected
  std::uint32_t min_matches;
  std::uint32_t min_inliers;
  float ransac_threshold;  ///< pixels
  std::uint32_t reserved[3];
};
static_assert(sizeof(ParameterSetRecord) == 96);

struct SceneRecord {
  std::uint32_t pattern;
  std::uint32_t model;
  float scale;        ///< factor on the default: model's largest side = pattern's largest side
  float offset[3];    ///< pattern plane units, after scale and rotation
  float rotation[4];  ///< unit quaternion x, y, z, w: model axes to pattern axes
  std::uint32_t reserved[2];
};
static_assert(sizeof(SceneRecord) == 48);

/// The light that falls on a scene, in linear light; 1: a white surface shows as the picture's
/// white. Coefficients of 1, y, z, x, xy, yz, 3 z^2 - 1, zx, x^2 - y^2 for a unit normal (x, y, z)
/// in the pattern's space.
struct LightRecord {
  std::uint32_t scene;
  std::uint32_t reserved0;
  float sky[27];       ///< what a white surface gets from all around: 9 times red, green, blue
  float direction[3];  ///< to the key light, unit length
  float key[3];        ///< what a white surface that faces it gets of it: red, green, blue
  std::uint32_t reserved1;
};
static_assert(sizeof(LightRecord) == 144);

/// Vertices of a layout hold, in a byte of no attribute, the share of the light from all around
/// that reaches them, 0 to 127 (127: all of it). Behind a normal of three i8, a shader gets it as
/// the normal's fourth component.
struct OcclusionRecord {
  std::uint32_t layout;
  std::uint32_t offset;  ///< bytes from the start of the vertex
};
static_assert(sizeof(OcclusionRecord) == 8);

/// Start of a kShadow section: the share of light that a scene's model leaves on its pattern's
/// plane (255: all), width * height bytes behind it, first row at the greatest y.
struct ShadowHeader {
  std::uint32_t width;  ///< texels, 1 to 256
  std::uint32_t height;
  float low[2];  ///< pattern plane units: the rectangle's corners
  float high[2];
  std::uint32_t reserved[2];
};
static_assert(sizeof(ShadowHeader) == 32);

/// Start of a kMappedFeatures section.
struct FeatureHeader {
  std::uint32_t count;
  std::uint32_t descriptor_bytes;
  std::uint64_t keypoints_offset;    ///< from the start of the section: KeypointRecord[count]
  std::uint64_t descriptors_offset;  ///< a multiple of 16: count * descriptor_bytes
  std::uint64_t reserved;
};
static_assert(sizeof(FeatureHeader) == 32);

/// The members of cv::KeyPoint, in its order, pixels of the pattern image.
struct KeypointRecord {
  float x;
  float y;
  float size;
  float angle;  ///< degrees; -1: none
  float response;
  std::int32_t octave;
  std::int32_t class_id;
};
static_assert(sizeof(KeypointRecord) == 28);

}  // namespace modar
