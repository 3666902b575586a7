// Holds the byte-offset tables of formats/bundle.md against the structs, in both directions.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "formats/clips.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/field_table.hpp"
#include "formats/layout.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/scene_nodes.hpp"
#include "formats/tracker_record.hpp"

namespace {

struct Field {
  std::size_t offset = 0;
  std::size_t size = 0;
  std::string type;
  std::string name;
  bool operator==(const Field&) const = default;
};

struct Struct {
  std::size_t size = 0;
  std::vector<Field> fields;
};

std::ostream& operator<<(std::ostream& out, const Field& field) {
  return out << field.offset << " " << field.size << " " << field.type << " " << field.name;
}

template <class T>
std::string type_name() {
  if constexpr (std::is_array_v<T>) {
    return type_name<std::remove_extent_t<T>>() + "[" + std::to_string(std::extent_v<T>) + "]";
  } else if constexpr (std::is_same_v<T, modar::NameRef>) {
    return "NameRef";
  } else if constexpr (std::is_same_v<T, modar::AttributeRecord>) {
    return "AttributeRecord";
  } else {
    const char* kind = std::is_floating_point_v<T> ? "f" : std::is_signed_v<T> ? "i" : "u";
    return kind + std::to_string(sizeof(T) * 8);
  }
}

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::stringstream stream(line.substr(1));
  for (std::string cell; std::getline(stream, cell, '|');) {
    const auto first = cell.find_first_not_of(' ');
    const auto last = cell.find_last_not_of(' ');
    out.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return out;
}

/// Every "### Name (N bytes)" of the specification with the rows of its table.
std::map<std::string, Struct> specified() {
  std::ifstream file(std::string(std::getenv("MODAR_SOURCE_DIR")) + "/formats/bundle.md");
  std::map<std::string, Struct> out;
  std::string name;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#")) {
      name.clear();
      const auto open = line.find(" (");
      if (line.starts_with("### ") && open != std::string::npos) {
        name = line.substr(4, open - 4);
        out[name].size = std::stoul(line.substr(open + 2));
      }
    } else if (!name.empty() && line.starts_with("| ") && std::isdigit(line[2]) != 0) {
      const auto row = cells(line);
      out[name].fields.push_back({std::stoul(row[0]), std::stoul(row[1]), row[2], row[3]});
    }
  }
  return out;
}

#define MODAR_FIELD(type, field)                                                           \
  Field {                                                                                  \
    offsetof(type, field), sizeof(type::field), type_name<decltype(type::field)>(), #field \
  }

/// The structs as compiled. A field that this list forgets leaves a hole, which a test below finds.
std::map<std::string, Struct> compiled() {
  using namespace modar;
  std::map<std::string, Struct> out;
#define F(field) MODAR_FIELD(T, field)
#define MODAR_STRUCT(type, ...)                       \
  {                                                   \
    using T = type;                                   \
    out[#type] = Struct{sizeof(type), {__VA_ARGS__}}; \
  }
  MODAR_STRUCT(FileHeader, F(magic), F(major), F(minor), F(section_count), F(file_size),
               F(table_offset), F(entry_size), F(reserved0), F(reserved1), F(hash))
  MODAR_STRUCT(SectionEntry, F(type), F(version), F(flags), F(owner), F(variant), F(offset),
               F(size), F(hash), F(reserved))
  MODAR_STRUCT(TableHeader, F(count), F(stride), F(reserved))
  MODAR_STRUCT(NameRef, F(offset), F(length))
  MODAR_STRUCT(ModelRecord, F(name), F(center), F(scale), F(diagonal), F(unit_metres),
               F(position_error_max), F(position_error_rms), F(normal_error_max_deg),
               F(normal_error_rms_deg), F(uv_error_max_texels), F(uv_error_rms_texels),
               F(vertex_count), F(triangle_count), F(source_vertex_count), F(source_face_count),
               F(layout), F(first_chunk), F(chunk_count), F(first_material), F(material_count),
               F(level_count), F(reserved))
  MODAR_STRUCT(ChunkRecord, F(bounds_min), F(bounds_max), F(cone_axis), F(cone_cutoff),
               F(position_offset), F(position_step), F(uv_offset), F(uv_scale), F(material),
               F(first_level), F(level_count), F(reserved))
  MODAR_STRUCT(LevelRecord, F(vertex_offset), F(index_offset), F(vertex_count), F(index_count),
               F(error), F(reserved))
  MODAR_STRUCT(MaterialRecord, F(name), F(ambient), F(diffuse), F(specular), F(emission),
               F(shininess), F(opacity), F(texture), F(flags), F(reserved))
  MODAR_STRUCT(LayoutRecord, F(stride), F(attribute_count), F(reserved), F(attributes))
  MODAR_STRUCT(AttributeRecord, F(semantic), F(type), F(components), F(normalised), F(offset),
               F(reserved))
  MODAR_STRUCT(TextureRecord, F(name), F(width), F(height), F(source_width), F(source_height),
               F(format), F(flags), F(first_level), F(level_count), F(psnr_db), F(ssim),
               F(reserved))
  MODAR_STRUCT(TextureLevelRecord, F(offset), F(alpha_offset), F(size), F(width), F(height),
               F(psnr_db), F(ssim), F(reserved))
  MODAR_STRUCT(PatternRecord, F(name), F(width), F(height), F(width_mm), F(half_width),
               F(half_height), F(score), F(score_version), F(copies), F(reserved))
  MODAR_STRUCT(ParameterSetRecord, F(name), F(id), F(detector), F(max_features), F(scale_factor),
               F(level_count), F(edge_threshold), F(first_level), F(wta_k), F(harris),
               F(patch_size), F(fast_threshold), F(agast_threshold), F(octaves), F(pattern_scale),
               F(descriptor_bits), F(max_distance), F(min_matches), F(min_inliers),
               F(ransac_threshold), F(reserved))
  MODAR_STRUCT(SceneRecord, F(pattern), F(model), F(scale), F(offset), F(rotation), F(reserved))
  MODAR_STRUCT(LightRecord, F(scene), F(reserved0), F(sky), F(direction), F(key), F(reserved1))
  MODAR_STRUCT(OcclusionRecord, F(layout), F(offset))
  MODAR_STRUCT(NodeRecord, F(name), F(pattern), F(kind), F(subject), F(flags), F(group), F(place),
               F(rotation), F(half_size), F(mark), F(alpha), F(key), F(reach), F(reserved))
  MODAR_STRUCT(MediaRecord, F(name), F(kind), F(flags), F(width), F(height), F(seconds), F(poster),
               F(reserved))
  MODAR_STRUCT(ActionRecord, F(event), F(command), F(source), F(target), F(part), F(address),
               F(seconds), F(duration), F(axis), F(degrees), F(reserved))
  MODAR_STRUCT(ProxyRecord, F(model), F(first_chunk), F(chunk_count), F(reserved))
  MODAR_STRUCT(ClipRecord, F(name), F(model), F(tracks), F(seconds), F(error), F(reserved))
  MODAR_STRUCT(JointRecord, F(model), F(parent), F(before), F(translation), F(rotation), F(scale))
  MODAR_STRUCT(BoneRecord, F(joint), F(reserved), F(inverse))
  MODAR_STRUCT(PartRecord, F(material), F(first_bone), F(bone_count), F(target_count),
               F(bounds_min), F(bounds_max))
  MODAR_STRUCT(SceneClipRecord, F(scene), F(clip), F(flags), F(reserved))
  MODAR_STRUCT(ClipTracksHeader, F(track_count), F(sample_count), F(reserved))
  MODAR_STRUCT(TrackRecord, F(joint), F(path), F(reserved0), F(key_count), F(keys), F(low), F(step),
               F(reserved1))
  MODAR_STRUCT(ColourGridHeader, F(columns), F(rows), F(reserved))
  MODAR_STRUCT(PatternShapeHeader, F(kind), F(face_count), F(half_arc), F(slope), F(reserved))
  MODAR_STRUCT(ShapeFaceRecord, F(place), F(corner), F(right), F(down), F(reserved))
  MODAR_STRUCT(DrawOrderRecord, F(plane), F(behind), F(triangle))
  MODAR_STRUCT(ShadowHeader, F(width), F(height), F(low), F(high), F(reserved))
  MODAR_STRUCT(FeatureHeader, F(count), F(descriptor_bytes), F(keypoints_offset),
               F(descriptors_offset), F(reserved))
  MODAR_STRUCT(KeypointRecord, F(x), F(y), F(size), F(angle), F(response), F(octave), F(class_id))
  MODAR_STRUCT(TrackerRecordHeader, F(describer_version), F(feature_count), F(bright_count),
               F(patch_count), F(width), F(height), F(level_count), F(reserved0),
               F(features_offset), F(codes_offset), F(patches_offset), F(pixels_offset),
               F(reserved1))
  MODAR_STRUCT(TrackerFeatureRecord, F(x), F(y), F(warp))
  MODAR_STRUCT(TrackerPatchRecord, F(x), F(y), F(level), F(score))
  return out;
}

TEST(SpecTable, SpecificationAndStructsAreTheSame) {
  const auto spec = specified();
  const auto code = compiled();
  for (const auto& [name, expected] : spec) {
    ASSERT_TRUE(code.contains(name)) << name << " is in the specification only";
    EXPECT_EQ(code.at(name).size, expected.size) << name;
    EXPECT_EQ(code.at(name).fields, expected.fields) << name;
  }
  for (const auto& [name, ignored] : code) {
    EXPECT_TRUE(spec.contains(name)) << name << " is in the code only";
  }
}

TEST(SpecTable, FieldTableHoldsEveryField) {
  auto code = compiled();
  // Names are values of fields; the contents of a loop record are skipped as bytes.
  for (const char* name :
       {"NameRef", "TrackerRecordHeader", "TrackerFeatureRecord", "TrackerPatchRecord"}) {
    code.erase(name);
  }
  ASSERT_EQ(modar::record_infos().size(), code.size());
  for (const modar::RecordInfo& record : modar::record_infos()) {
    ASSERT_TRUE(code.contains(record.name)) << record.name;
    const Struct& expected = code.at(record.name);
    EXPECT_EQ(record.size, expected.size) << record.name;
    ASSERT_EQ(record.fields.size(), expected.fields.size()) << record.name;
    for (std::size_t i = 0; i < expected.fields.size(); ++i) {
      const modar::FieldInfo& field = record.fields[i];
      EXPECT_EQ(field.name, expected.fields[i].name) << record.name;
      EXPECT_EQ(field.offset, expected.fields[i].offset) << record.name << "." << field.name;
      EXPECT_EQ(field.count * modar::field_element_bytes(field.type), expected.fields[i].size)
          << record.name << "." << field.name;
      EXPECT_EQ(field.reserved, expected.fields[i].name.starts_with("reserved"));
    }
  }
}

TEST(SpecTable, FieldsLeaveNoHoles) {
  for (const auto& [name, record] : compiled()) {
    std::size_t end = 0;
    for (const Field& field : record.fields) {
      EXPECT_EQ(field.offset, end) << name << "." << field.name;
      end = field.offset + field.size;
    }
    EXPECT_EQ(end, record.size) << name;
  }
}

TEST(SpecTable, ConstantsAreTheSpecifiedOnes) {
  std::ifstream file(std::string(std::getenv("MODAR_SOURCE_DIR")) + "/formats/bundle.md");
  std::map<unsigned, std::vector<std::string>> rows;
  for (std::string line; std::getline(file, line) && line != "## Models";) {
    const auto row = line.starts_with("| ") ? cells(line) : std::vector<std::string>();
    if (row.size() == 6 && std::isdigit(row[0][0]) != 0)
      rows[static_cast<unsigned>(std::stoul(row[0]))] = row;
  }
  const char* const owners[] = {"NONE", "pattern", "scene", "chunk", "texture", "media", "clip"};
  EXPECT_EQ(rows.size(), modar::kSections.size());
  for (const modar::SectionInfo& section : modar::kSections) {
    const auto& row = rows[static_cast<unsigned>(section.type)];
    ASSERT_EQ(row.size(), 6U) << section.name;
    std::string name = section.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    EXPECT_EQ(row[1], name);
    EXPECT_NE(row[2].find(section.record), std::string::npos) << name;
    const std::string since = "since 1." + std::to_string(section.since);
    EXPECT_EQ(row[2].find("since") == std::string::npos ? 0 : row[2].find(since), 0U) << name;
    EXPECT_EQ(row[2].starts_with("since"), section.since != 0) << name;
    EXPECT_EQ(row[2].starts_with("table of") || row[2].find(": table of") != std::string::npos,
              std::string(section.record).ends_with("Record") &&
                  static_cast<unsigned>(section.type) < 256)
        << name;
    const bool required = (section.flags & modar::kSectionRequired) != 0;
    const bool gpu = (section.flags & modar::kSectionGpu) != 0;
    EXPECT_EQ(row[3], gpu ? "required, GPU" : required ? "required" : "0") << name;
    EXPECT_EQ(row[4], owners[static_cast<std::size_t>(section.owner)]) << name;
  }
}

TEST(SpecTable, FlagsAreTheSpecifiedOnes) {
  std::ifstream file(std::string(std::getenv("MODAR_SOURCE_DIR")) + "/formats/bundle.md");
  std::map<std::string, std::string> flags;  // the bits of each record
  std::string record;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("### ")) record = line.substr(4, line.find(" (") - 4);
    if (line.find("| flags | bit 0") != std::string::npos) flags[record] = line;
  }
  std::map<std::string, std::uint32_t> known;
  for (const modar::FlagInfo& info : modar::kFlags) {
    const int lowest = std::countr_zero(info.flag);
    const int highest = 31 - std::countl_zero(info.flag);
    const std::string bit =
        lowest == highest ? "bit " + std::to_string(lowest)
                          : "bits " + std::to_string(lowest) + " to " + std::to_string(highest);
    const auto at = flags[info.record].find(bit);
    ASSERT_NE(at, std::string::npos) << info.record << " " << bit;
    const std::string since = " (since 1." + std::to_string(info.since);
    EXPECT_EQ(flags[info.record].compare(at + bit.size(), since.size(), since) == 0,
              info.since != 0)
        << info.record << " " << bit;
    known[info.record] |= info.flag;
  }
  for (const auto& [name, line] : flags) {
    std::uint32_t bits = 0;
    for (std::size_t at = 0; (at = line.find("bit ", at)) != std::string::npos; at += 4) {
      if (std::isdigit(line[at + 4]) != 0) bits |= 1U << (line[at + 4] - '0');
    }
    for (std::size_t at = 0; (at = line.find("bits ", at)) != std::string::npos; at += 5) {
      const int first = std::atoi(line.c_str() + at + 5);
      const int last = std::atoi(line.c_str() + line.find(" to ", at) + 4);
      bits |= (2U << last) - (1U << first);
    }
    // "with bit 0" repeats one.
    EXPECT_EQ(bits, known[name]) << name;
    EXPECT_EQ(modar::known_flags(name), known[name]) << name;
  }
}

}  // namespace
