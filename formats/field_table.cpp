// Names, places and types of all fields, taken from the structs by the compiler.
#include "formats/field_table.hpp"
#include "formats/clip_tracks.hpp"
#include "formats/clips.hpp"
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

// A member's name and place can be had together through the preprocessor only: MODAR_FIELDS(record,
// members...) is the array of what the members are. A macro that is scanned again calls itself once
// more, for the next member: 27 times, as its nesting is.
#define MODAR_SCAN(...) MODAR_SCAN_9(MODAR_SCAN_9(MODAR_SCAN_9(__VA_ARGS__)))
#define MODAR_SCAN_9(...) MODAR_SCAN_3(MODAR_SCAN_3(MODAR_SCAN_3(__VA_ARGS__)))
#define MODAR_SCAN_3(...) MODAR_SCAN_1(MODAR_SCAN_1(MODAR_SCAN_1(__VA_ARGS__)))
#define MODAR_SCAN_1(...) __VA_ARGS__
#define MODAR_NO_ARGUMENT ()
#define MODAR_EACH(record, member, ...)                             \
  info<decltype(record::member)>(#member, offsetof(record, member)) \
      __VA_OPT__(, MODAR_EACH_AGAIN MODAR_NO_ARGUMENT(record, __VA_ARGS__))
#define MODAR_EACH_AGAIN() MODAR_EACH
#define MODAR_FIELDS(record, ...) \
  constexpr FieldInfo k##record[] = {MODAR_SCAN(MODAR_EACH(record, __VA_ARGS__))}

MODAR_FIELDS(ModelRecord, name, center, scale, diagonal, unit_metres, position_error_max,
             position_error_rms, normal_error_max_deg, normal_error_rms_deg, uv_error_max_texels,
             uv_error_rms_texels, vertex_count, triangle_count, source_vertex_count,
             source_face_count, layout, first_chunk, chunk_count, first_material, material_count,
             level_count, reserved);
MODAR_FIELDS(ChunkRecord, bounds_min, bounds_max, cone_axis, cone_cutoff, position_offset,
             position_step, uv_offset, uv_scale, material, first_level, level_count, reserved);
MODAR_FIELDS(LevelRecord, vertex_offset, index_offset, vertex_count, index_count, error, reserved);
MODAR_FIELDS(MaterialRecord, name, ambient, diffuse, specular, emission, shininess, opacity,
             texture, flags, reserved);
MODAR_FIELDS(LayoutRecord, stride, attribute_count, reserved, attributes);
MODAR_FIELDS(TextureRecord, name, width, height, source_width, source_height, format, flags,
             first_level, level_count, psnr_db, ssim, reserved);
MODAR_FIELDS(TextureLevelRecord, offset, alpha_offset, size, width, height, psnr_db, ssim,
             reserved);
MODAR_FIELDS(PatternRecord, name, width, height, width_mm, half_width, half_height, score,
             score_version, copies, reserved);
MODAR_FIELDS(ParameterSetRecord, name, id, detector, max_features, scale_factor, level_count,
             edge_threshold, first_level, wta_k, harris, patch_size, fast_threshold,
             agast_threshold, octaves, pattern_scale, descriptor_bits, max_distance, min_matches,
             min_inliers, ransac_threshold, reserved);
MODAR_FIELDS(SceneRecord, pattern, model, scale, offset, rotation, reserved);
MODAR_FIELDS(LightRecord, scene, reserved0, sky, direction, key, reserved1);
MODAR_FIELDS(OcclusionRecord, layout, offset);
MODAR_FIELDS(NodeRecord, name, pattern, kind, subject, flags, group, place, rotation, half_size,
             mark, alpha, key, reach, reserved);
MODAR_FIELDS(MediaRecord, name, kind, flags, width, height, seconds, poster, reserved);
MODAR_FIELDS(ActionRecord, event, command, source, target, part, address, seconds, duration, axis,
             degrees, reserved);
MODAR_FIELDS(ProxyRecord, model, first_chunk, chunk_count, reserved);
MODAR_FIELDS(ClipRecord, name, model, tracks, seconds, error, reserved);
MODAR_FIELDS(JointRecord, model, parent, before, translation, rotation, scale);
MODAR_FIELDS(BoneRecord, joint, reserved, inverse);
MODAR_FIELDS(PartRecord, material, first_bone, bone_count, target_count, bounds_min, bounds_max);
MODAR_FIELDS(SceneClipRecord, scene, clip, flags, reserved);
MODAR_FIELDS(ClipTracksHeader, track_count, sample_count, reserved);
MODAR_FIELDS(TrackRecord, joint, path, reserved0, key_count, keys, low, step, reserved1);
MODAR_FIELDS(ColourGridHeader, columns, rows, reserved);
MODAR_FIELDS(PatternShapeHeader, kind, face_count, half_arc, slope, reserved);
MODAR_FIELDS(ShapeFaceRecord, place, corner, right, down, reserved);
MODAR_FIELDS(DrawOrderRecord, plane, behind, triangle);
MODAR_FIELDS(ShadowHeader, width, height, low, high, reserved);
MODAR_FIELDS(FileHeader, magic, major, minor, section_count, file_size, table_offset, entry_size,
             reserved0, reserved1, hash);
MODAR_FIELDS(SectionEntry, type, version, flags, owner, variant, offset, size, hash, reserved);
MODAR_FIELDS(TableHeader, count, stride, reserved);
MODAR_FIELDS(AttributeRecord, semantic, type, components, normalised, offset, reserved);
MODAR_FIELDS(FeatureHeader, count, descriptor_bytes, keypoints_offset, descriptors_offset,
             reserved);
MODAR_FIELDS(KeypointRecord, x, y, size, angle, response, octave, class_id);
#undef MODAR_FIELDS

constexpr RecordInfo record_of(const char* name, std::size_t size,
                               std::span<const FieldInfo> fields) {
  return {name, nullptr, SectionType::kNames, size, fields};
}

/// The table and its name are those of the registry.
constexpr RecordInfo table_of(const char* name, std::size_t size,
                              std::span<const FieldInfo> fields) {
  const SectionInfo& section = section_of_record(name);
  return {name, section.name, section.type, size, fields};
}

#define MODAR_TYPE(record) #record, sizeof(record), k##record
constexpr RecordInfo kRecords[] = {
    table_of(MODAR_TYPE(ModelRecord)),         table_of(MODAR_TYPE(ChunkRecord)),
    table_of(MODAR_TYPE(LevelRecord)),         table_of(MODAR_TYPE(MaterialRecord)),
    table_of(MODAR_TYPE(LayoutRecord)),        table_of(MODAR_TYPE(TextureRecord)),
    table_of(MODAR_TYPE(TextureLevelRecord)),  table_of(MODAR_TYPE(PatternRecord)),
    table_of(MODAR_TYPE(ParameterSetRecord)),  table_of(MODAR_TYPE(SceneRecord)),
    table_of(MODAR_TYPE(LightRecord)),         table_of(MODAR_TYPE(OcclusionRecord)),
    table_of(MODAR_TYPE(NodeRecord)),          table_of(MODAR_TYPE(ActionRecord)),
    table_of(MODAR_TYPE(MediaRecord)),         table_of(MODAR_TYPE(ProxyRecord)),
    table_of(MODAR_TYPE(ClipRecord)),          table_of(MODAR_TYPE(JointRecord)),
    table_of(MODAR_TYPE(BoneRecord)),          table_of(MODAR_TYPE(PartRecord)),
    table_of(MODAR_TYPE(SceneClipRecord)),     record_of(MODAR_TYPE(ClipTracksHeader)),
    record_of(MODAR_TYPE(TrackRecord)),        record_of(MODAR_TYPE(FileHeader)),
    record_of(MODAR_TYPE(SectionEntry)),       record_of(MODAR_TYPE(TableHeader)),
    record_of(MODAR_TYPE(AttributeRecord)),    record_of(MODAR_TYPE(FeatureHeader)),
    record_of(MODAR_TYPE(KeypointRecord)),     record_of(MODAR_TYPE(ColourGridHeader)),
    record_of(MODAR_TYPE(PatternShapeHeader)), record_of(MODAR_TYPE(ShapeFaceRecord)),
    record_of(MODAR_TYPE(DrawOrderRecord)),    record_of(MODAR_TYPE(ShadowHeader)),
};
#undef MODAR_TYPE

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
