// Names, places and types of all fields, taken from the structs by the compiler.
#include "formats/field_table.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/scene_nodes.hpp"

#include <cstring>
#include <type_traits>

namespace modar {
namespace {

template <class T>
constexpr FieldType type_of() {
  using Element = std::remove_all_extents_t<T>;
  if constexpr (std::is_same_v<Element, NameRef>) return FieldType::kName;
  if constexpr (std::is_same_v<Element, AttributeRecord>) return FieldType::kAttributes;
  if constexpr (std::is_same_v<Element, double>) return FieldType::kF64;
  if constexpr (std::is_same_v<Element, float>) return FieldType::kF32;
  if constexpr (std::is_same_v<Element, std::int32_t>) return FieldType::kI32;
  if constexpr (std::is_same_v<Element, std::uint64_t>) return FieldType::kU64;
  if constexpr (std::is_same_v<Element, std::uint16_t>) return FieldType::kU16;
  if constexpr (std::is_same_v<Element, std::uint8_t>) return FieldType::kU8;
  return FieldType::kU32;
}

constexpr bool starts_with(const char* text, const char* start) {
  while (*start != '\0') {
    if (*text++ != *start++) return false;
  }
  return true;
}

template <class T>
constexpr FieldInfo info(const char* name, std::size_t offset) {
  constexpr std::size_t kCount = sizeof(T) / sizeof(std::remove_all_extents_t<T>);
  return {name, static_cast<std::uint16_t>(offset), type_of<T>(), kCount,
          starts_with(name, "reserved")};
}

// A member's name and place can be had together through the preprocessor only.
#define MODAR_FIELD(type, member) info<decltype(type::member)>(#member, offsetof(type, member))

constexpr FieldInfo kModelRecord[] = {MODAR_FIELD(ModelRecord, name),
                                      MODAR_FIELD(ModelRecord, center),
                                      MODAR_FIELD(ModelRecord, scale),
                                      MODAR_FIELD(ModelRecord, diagonal),
                                      MODAR_FIELD(ModelRecord, unit_metres),
                                      MODAR_FIELD(ModelRecord, position_error_max),
                                      MODAR_FIELD(ModelRecord, position_error_rms),
                                      MODAR_FIELD(ModelRecord, normal_error_max_deg),
                                      MODAR_FIELD(ModelRecord, normal_error_rms_deg),
                                      MODAR_FIELD(ModelRecord, uv_error_max_texels),
                                      MODAR_FIELD(ModelRecord, uv_error_rms_texels),
                                      MODAR_FIELD(ModelRecord, vertex_count),
                                      MODAR_FIELD(ModelRecord, triangle_count),
                                      MODAR_FIELD(ModelRecord, source_vertex_count),
                                      MODAR_FIELD(ModelRecord, source_face_count),
                                      MODAR_FIELD(ModelRecord, layout),
                                      MODAR_FIELD(ModelRecord, first_chunk),
                                      MODAR_FIELD(ModelRecord, chunk_count),
                                      MODAR_FIELD(ModelRecord, first_material),
                                      MODAR_FIELD(ModelRecord, material_count),
                                      MODAR_FIELD(ModelRecord, level_count),
                                      MODAR_FIELD(ModelRecord, reserved)};
constexpr FieldInfo kChunkRecord[] = {
    MODAR_FIELD(ChunkRecord, bounds_min),      MODAR_FIELD(ChunkRecord, bounds_max),
    MODAR_FIELD(ChunkRecord, cone_axis),       MODAR_FIELD(ChunkRecord, cone_cutoff),
    MODAR_FIELD(ChunkRecord, position_offset), MODAR_FIELD(ChunkRecord, position_step),
    MODAR_FIELD(ChunkRecord, uv_offset),       MODAR_FIELD(ChunkRecord, uv_scale),
    MODAR_FIELD(ChunkRecord, material),        MODAR_FIELD(ChunkRecord, first_level),
    MODAR_FIELD(ChunkRecord, level_count),     MODAR_FIELD(ChunkRecord, reserved)};
constexpr FieldInfo kLevelRecord[] = {
    MODAR_FIELD(LevelRecord, vertex_offset), MODAR_FIELD(LevelRecord, index_offset),
    MODAR_FIELD(LevelRecord, vertex_count),  MODAR_FIELD(LevelRecord, index_count),
    MODAR_FIELD(LevelRecord, error),         MODAR_FIELD(LevelRecord, reserved)};
constexpr FieldInfo kMaterialRecord[] = {
    MODAR_FIELD(MaterialRecord, name),     MODAR_FIELD(MaterialRecord, ambient),
    MODAR_FIELD(MaterialRecord, diffuse),  MODAR_FIELD(MaterialRecord, specular),
    MODAR_FIELD(MaterialRecord, emission), MODAR_FIELD(MaterialRecord, shininess),
    MODAR_FIELD(MaterialRecord, opacity),  MODAR_FIELD(MaterialRecord, texture),
    MODAR_FIELD(MaterialRecord, flags),    MODAR_FIELD(MaterialRecord, reserved)};
constexpr FieldInfo kLayoutRecord[] = {
    MODAR_FIELD(LayoutRecord, stride), MODAR_FIELD(LayoutRecord, attribute_count),
    MODAR_FIELD(LayoutRecord, reserved), MODAR_FIELD(LayoutRecord, attributes)};
constexpr FieldInfo kTextureRecord[] = {
    MODAR_FIELD(TextureRecord, name),          MODAR_FIELD(TextureRecord, width),
    MODAR_FIELD(TextureRecord, height),        MODAR_FIELD(TextureRecord, source_width),
    MODAR_FIELD(TextureRecord, source_height), MODAR_FIELD(TextureRecord, format),
    MODAR_FIELD(TextureRecord, flags),         MODAR_FIELD(TextureRecord, first_level),
    MODAR_FIELD(TextureRecord, level_count),   MODAR_FIELD(TextureRecord, psnr_db),
    MODAR_FIELD(TextureRecord, ssim),          MODAR_FIELD(TextureRecord, reserved)};
constexpr FieldInfo kTextureLevelRecord[] = {
    MODAR_FIELD(TextureLevelRecord, offset), MODAR_FIELD(TextureLevelRecord, alpha_offset),
    MODAR_FIELD(TextureLevelRecord, size),   MODAR_FIELD(TextureLevelRecord, width),
    MODAR_FIELD(TextureLevelRecord, height), MODAR_FIELD(TextureLevelRecord, psnr_db),
    MODAR_FIELD(TextureLevelRecord, ssim),   MODAR_FIELD(TextureLevelRecord, reserved)};
constexpr FieldInfo kPatternRecord[] = {
    MODAR_FIELD(PatternRecord, name),       MODAR_FIELD(PatternRecord, width),
    MODAR_FIELD(PatternRecord, height),     MODAR_FIELD(PatternRecord, width_mm),
    MODAR_FIELD(PatternRecord, half_width), MODAR_FIELD(PatternRecord, half_height),
    MODAR_FIELD(PatternRecord, score),      MODAR_FIELD(PatternRecord, score_version),
    MODAR_FIELD(PatternRecord, reserved)};
constexpr FieldInfo kParameterSetRecord[] = {MODAR_FIELD(ParameterSetRecord, name),
                                             MODAR_FIELD(ParameterSetRecord, id),
                                             MODAR_FIELD(ParameterSetRecord, detector),
                                             MODAR_FIELD(ParameterSetRecord, max_features),
                                             MODAR_FIELD(ParameterSetRecord, scale_factor),
                                             MODAR_FIELD(ParameterSetRecord, level_count),
                                             MODAR_FIELD(ParameterSetRecord, edge_threshold),
                                             MODAR_FIELD(ParameterSetRecord, first_level),
                                             MODAR_FIELD(ParameterSetRecord, wta_k),
                                             MODAR_FIELD(ParameterSetRecord, harris),
                                             MODAR_FIELD(ParameterSetRecord, patch_size),
                                             MODAR_FIELD(ParameterSetRecord, fast_threshold),
                                             MODAR_FIELD(ParameterSetRecord, agast_threshold),
                                             MODAR_FIELD(ParameterSetRecord, octaves),
                                             MODAR_FIELD(ParameterSetRecord, pattern_scale),
                                             MODAR_FIELD(ParameterSetRecord, descriptor_bits),
                                             MODAR_FIELD(ParameterSetRecord, max_distance),
                                             MODAR_FIELD(ParameterSetRecord, min_matches),
                                             MODAR_FIELD(ParameterSetRecord, min_inliers),
                                             MODAR_FIELD(ParameterSetRecord, ransac_threshold),
                                             MODAR_FIELD(ParameterSetRecord, reserved)};
constexpr FieldInfo kSceneRecord[] = {
    MODAR_FIELD(SceneRecord, pattern),  MODAR_FIELD(SceneRecord, model),
    MODAR_FIELD(SceneRecord, scale),    MODAR_FIELD(SceneRecord, offset),
    MODAR_FIELD(SceneRecord, rotation), MODAR_FIELD(SceneRecord, reserved)};
constexpr FieldInfo kLightRecord[] = {
    MODAR_FIELD(LightRecord, scene), MODAR_FIELD(LightRecord, reserved0),
    MODAR_FIELD(LightRecord, sky),   MODAR_FIELD(LightRecord, direction),
    MODAR_FIELD(LightRecord, key),   MODAR_FIELD(LightRecord, reserved1)};
constexpr FieldInfo kOcclusionRecord[] = {MODAR_FIELD(OcclusionRecord, layout),
                                          MODAR_FIELD(OcclusionRecord, offset)};
constexpr FieldInfo kNodeRecord[] = {
    MODAR_FIELD(NodeRecord, name),      MODAR_FIELD(NodeRecord, pattern),
    MODAR_FIELD(NodeRecord, kind),      MODAR_FIELD(NodeRecord, subject),
    MODAR_FIELD(NodeRecord, flags),     MODAR_FIELD(NodeRecord, group),
    MODAR_FIELD(NodeRecord, place),     MODAR_FIELD(NodeRecord, rotation),
    MODAR_FIELD(NodeRecord, half_size), MODAR_FIELD(NodeRecord, mark),
    MODAR_FIELD(NodeRecord, alpha),     MODAR_FIELD(NodeRecord, key),
    MODAR_FIELD(NodeRecord, reach),     MODAR_FIELD(NodeRecord, reserved)};
constexpr FieldInfo kMediaRecord[] = {
    MODAR_FIELD(MediaRecord, name),   MODAR_FIELD(MediaRecord, kind),
    MODAR_FIELD(MediaRecord, flags),  MODAR_FIELD(MediaRecord, width),
    MODAR_FIELD(MediaRecord, height), MODAR_FIELD(MediaRecord, seconds),
    MODAR_FIELD(MediaRecord, poster), MODAR_FIELD(MediaRecord, reserved)};
constexpr FieldInfo kActionRecord[] = {
    MODAR_FIELD(ActionRecord, event),   MODAR_FIELD(ActionRecord, command),
    MODAR_FIELD(ActionRecord, source),  MODAR_FIELD(ActionRecord, target),
    MODAR_FIELD(ActionRecord, part),    MODAR_FIELD(ActionRecord, address),
    MODAR_FIELD(ActionRecord, seconds), MODAR_FIELD(ActionRecord, duration),
    MODAR_FIELD(ActionRecord, axis),    MODAR_FIELD(ActionRecord, degrees),
    MODAR_FIELD(ActionRecord, reserved)};
constexpr FieldInfo kStandInRecord[] = {
    MODAR_FIELD(StandInRecord, model), MODAR_FIELD(StandInRecord, first_chunk),
    MODAR_FIELD(StandInRecord, chunk_count), MODAR_FIELD(StandInRecord, reserved)};
constexpr FieldInfo kColourGridHeader[] = {MODAR_FIELD(ColourGridHeader, columns),
                                           MODAR_FIELD(ColourGridHeader, rows),
                                           MODAR_FIELD(ColourGridHeader, reserved)};
constexpr FieldInfo kPatternShapeHeader[] = {
    MODAR_FIELD(PatternShapeHeader, kind), MODAR_FIELD(PatternShapeHeader, face_count),
    MODAR_FIELD(PatternShapeHeader, half_arc), MODAR_FIELD(PatternShapeHeader, slope),
    MODAR_FIELD(PatternShapeHeader, reserved)};
constexpr FieldInfo kShapeFaceRecord[] = {
    MODAR_FIELD(ShapeFaceRecord, place), MODAR_FIELD(ShapeFaceRecord, corner),
    MODAR_FIELD(ShapeFaceRecord, right), MODAR_FIELD(ShapeFaceRecord, down),
    MODAR_FIELD(ShapeFaceRecord, reserved)};
constexpr FieldInfo kDrawOrderRecord[] = {MODAR_FIELD(DrawOrderRecord, plane),
                                          MODAR_FIELD(DrawOrderRecord, behind),
                                          MODAR_FIELD(DrawOrderRecord, triangle)};
constexpr FieldInfo kShadowHeader[] = {
    MODAR_FIELD(ShadowHeader, width), MODAR_FIELD(ShadowHeader, height),
    MODAR_FIELD(ShadowHeader, low), MODAR_FIELD(ShadowHeader, high),
    MODAR_FIELD(ShadowHeader, reserved)};
constexpr FieldInfo kFileHeader[] = {
    MODAR_FIELD(FileHeader, magic),      MODAR_FIELD(FileHeader, major),
    MODAR_FIELD(FileHeader, minor),      MODAR_FIELD(FileHeader, section_count),
    MODAR_FIELD(FileHeader, file_size),  MODAR_FIELD(FileHeader, table_offset),
    MODAR_FIELD(FileHeader, entry_size), MODAR_FIELD(FileHeader, reserved0),
    MODAR_FIELD(FileHeader, reserved1),  MODAR_FIELD(FileHeader, hash)};
constexpr FieldInfo kSectionEntry[] = {
    MODAR_FIELD(SectionEntry, type),    MODAR_FIELD(SectionEntry, version),
    MODAR_FIELD(SectionEntry, flags),   MODAR_FIELD(SectionEntry, owner),
    MODAR_FIELD(SectionEntry, variant), MODAR_FIELD(SectionEntry, offset),
    MODAR_FIELD(SectionEntry, size),    MODAR_FIELD(SectionEntry, hash),
    MODAR_FIELD(SectionEntry, reserved)};
constexpr FieldInfo kTableHeader[] = {MODAR_FIELD(TableHeader, count),
                                      MODAR_FIELD(TableHeader, stride),
                                      MODAR_FIELD(TableHeader, reserved)};
constexpr FieldInfo kAttributeRecord[] = {
    MODAR_FIELD(AttributeRecord, semantic),   MODAR_FIELD(AttributeRecord, type),
    MODAR_FIELD(AttributeRecord, components), MODAR_FIELD(AttributeRecord, normalised),
    MODAR_FIELD(AttributeRecord, offset),     MODAR_FIELD(AttributeRecord, reserved)};
constexpr FieldInfo kFeatureHeader[] = {
    MODAR_FIELD(FeatureHeader, count), MODAR_FIELD(FeatureHeader, descriptor_bytes),
    MODAR_FIELD(FeatureHeader, keypoints_offset), MODAR_FIELD(FeatureHeader, descriptors_offset),
    MODAR_FIELD(FeatureHeader, reserved)};
constexpr FieldInfo kKeypointRecord[] = {
    MODAR_FIELD(KeypointRecord, x),        MODAR_FIELD(KeypointRecord, y),
    MODAR_FIELD(KeypointRecord, size),     MODAR_FIELD(KeypointRecord, angle),
    MODAR_FIELD(KeypointRecord, response), MODAR_FIELD(KeypointRecord, octave),
    MODAR_FIELD(KeypointRecord, class_id)};
#undef MODAR_FIELD

// The table and its name are those of the registry.
#define MODAR_TABLE(record)                                                                    \
  {                                                                                            \
#record, section_of_record(#record).name, section_of_record(#record).type, sizeof(record), \
        k##record                                                                              \
  }
constexpr RecordInfo kRecords[] = {
    MODAR_TABLE(ModelRecord),
    MODAR_TABLE(ChunkRecord),
    MODAR_TABLE(LevelRecord),
    MODAR_TABLE(MaterialRecord),
    MODAR_TABLE(LayoutRecord),
    MODAR_TABLE(TextureRecord),
    MODAR_TABLE(TextureLevelRecord),
    MODAR_TABLE(PatternRecord),
    MODAR_TABLE(ParameterSetRecord),
    MODAR_TABLE(SceneRecord),
    MODAR_TABLE(LightRecord),
    MODAR_TABLE(OcclusionRecord),
    MODAR_TABLE(NodeRecord),
    MODAR_TABLE(ActionRecord),
    MODAR_TABLE(MediaRecord),
    MODAR_TABLE(StandInRecord),
    {"FileHeader", nullptr, SectionType::kNames, sizeof(FileHeader), kFileHeader},
    {"SectionEntry", nullptr, SectionType::kNames, sizeof(SectionEntry), kSectionEntry},
    {"TableHeader", nullptr, SectionType::kNames, sizeof(TableHeader), kTableHeader},
    {"AttributeRecord", nullptr, SectionType::kNames, sizeof(AttributeRecord), kAttributeRecord},
    {"FeatureHeader", nullptr, SectionType::kNames, sizeof(FeatureHeader), kFeatureHeader},
    {"KeypointRecord", nullptr, SectionType::kNames, sizeof(KeypointRecord), kKeypointRecord},
    {"ColourGridHeader", nullptr, SectionType::kNames, sizeof(ColourGridHeader), kColourGridHeader},
    {"PatternShapeHeader", nullptr, SectionType::kNames, sizeof(PatternShapeHeader),
     kPatternShapeHeader},
    {"ShapeFaceRecord", nullptr, SectionType::kNames, sizeof(ShapeFaceRecord), kShapeFaceRecord},
    {"DrawOrderRecord", nullptr, SectionType::kNames, sizeof(DrawOrderRecord), kDrawOrderRecord},
    {"ShadowHeader", nullptr, SectionType::kNames, sizeof(ShadowHeader), kShadowHeader},
};
#undef MODAR_TABLE

}  // namespace

std::span<const RecordInfo> record_infos() {
  return kRecords;
}

const RecordInfo& record_info(const char* name) {
  const RecordInfo* found = kRecords;
  for (const RecordInfo& record : kRecords) {
    if (std::strcmp(record.name, name) == 0) found = &record;
  }
  return *found;
}

}  // namespace modar
