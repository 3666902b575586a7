// Our reading of a bundle as JSON, decoded in double arithmetic as bundle.md says.
#include "tests/formats/dump.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "formats/quantise.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar::test {
namespace {

using nlohmann::json;

std::string hex(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

std::string digest(const void* data, std::size_t size) {
  return hex(XXH64(data, size, 0));
}
std::string digest(std::span<const std::byte> bytes) {
  return digest(bytes.data(), bytes.size());
}

template <class T, std::size_t N>
json list(const T (&values)[N]) {
  json out = json::array();
  for (const T& value : values) out.push_back(value);
  return out;
}
template <class T>
json list(const T& value) {
  return value;
}

template <class T>
double raw(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof(T));
  return static_cast<double>(value);
}

/// The value and, for normalised integers, how many bits it had.
double component(const AttributeRecord& attribute, const std::byte* vertex, std::size_t index) {
  const std::byte* at = vertex + attribute.offset;
  const bool normalised = attribute.normalised != 0;
  switch (static_cast<ComponentType>(attribute.type)) {
    case ComponentType::kHalf: {
      std::uint16_t half = 0;
      std::memcpy(&half, at + 2 * index, 2);
      return static_cast<double>(half_to_float(half));
    }
    case ComponentType::kI16: {
      const double c = raw<std::int16_t>(at + 2 * index);
      return normalised ? (2 * c + 1) / 65535 : c;
    }
    case ComponentType::kU16: {
      const double c = raw<std::uint16_t>(at + 2 * index);
      return normalised ? c / 65535 : c;
    }
    case ComponentType::kI8: {
      const double c = raw<std::int8_t>(at + index);
      return normalised ? (2 * c + 1) / 255 : c;
    }
    case ComponentType::kU8: {
      const double c = raw<std::uint8_t>(at + index);
      return normalised ? c / 255 : c;
    }
    case ComponentType::kF32:
      return raw<float>(at + 4 * index);
  }
  return 0;
}

void append_decoded(const AttributeRecord& attribute, const ChunkRecord& chunk,
                    const std::byte* vertex, std::vector<double>& out) {
  std::array<double, 4> a{};
  for (std::size_t i = 0; i < attribute.components; ++i) a[i] = component(attribute, vertex, i);
  std::size_t count = attribute.components;
  switch (static_cast<Semantic>(attribute.semantic)) {
    case Semantic::kPosition:
      count = 3;
      for (std::size_t i = 0; i < 3; ++i) {
        a[i] = static_cast<double>(chunk.position_offset[i]) +
               static_cast<double>(chunk.position_step) * a[i];
      }
      break;
    case Semantic::kUv:
      for (std::size_t i = 0; i < 2; ++i) {
        a[i] =
            static_cast<double>(chunk.uv_offset[i]) + static_cast<double>(chunk.uv_scale[i]) * a[i];
      }
      break;
    case Semantic::kNormalOct: {
      count = 3;
      a[2] = 1 - std::fabs(a[0]) - std::fabs(a[1]);
      if (a[2] < 0) {
        const double x = (1 - std::fabs(a[1])) * (a[0] >= 0 ? 1 : -1);
        a[1] = (1 - std::fabs(a[0])) * (a[1] >= 0 ? 1 : -1);
        a[0] = x;
      }
      const double length = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
      for (double& side : a) side /= length;
      break;
    }
    default:
      break;
  }
  out.insert(out.end(), a.begin(), a.begin() + static_cast<std::ptrdiff_t>(count));
}

void add_digests(const BundleView& view, const LayoutRecord& layout, const ChunkRecord& chunk,
                 const LevelRecord& level, json& out) {
  const std::byte* first = view.vertices().data() + level.vertex_offset;
  for (std::size_t i = 0; i < layout.attribute_count; ++i) {
    const AttributeRecord& attribute = layout.attributes[i];
    std::vector<double> values;
    for (std::size_t v = 0; v < level.vertex_count; ++v) {
      append_decoded(attribute, chunk, first + v * layout.stride, values);
    }
    const char* names[] = {"",       "positions", "normals", "uvs",     "colours", "normals",
                           "joints", "weights",   "morph_x", "morph_y", "morph_z"};
    out[names[attribute.semantic]] = digest(values.data(), values.size() * sizeof(double));
  }
  out["indices"] = digest(view.indices().subspan(level.index_offset, level.index_count * 2));
}

// A list of a record's fields by name; what reads as text is set by the callers.
#define GET(field) out[#field] = list(record.field)

json dump_models(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.models().size(); ++i) {
    const ModelRecord& record = view.models()[i];
    json out;
    out["name"] = view.name(record.name);
    GET(center), GET(scale), GET(diagonal), GET(unit_metres), GET(position_error_max);
    GET(position_error_rms), GET(normal_error_max_deg), GET(normal_error_rms_deg);
    GET(uv_error_max_texels), GET(uv_error_rms_texels), GET(vertex_count), GET(triangle_count);
    GET(source_vertex_count), GET(source_face_count), GET(layout), GET(first_chunk);
    GET(chunk_count), GET(first_material), GET(material_count), GET(level_count);
    rows.push_back(out);
  }
  return rows;
}

json dump_proxies(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.proxies().size(); ++i) {
    const ProxyRecord& record = view.proxies()[i];
    json out;
    GET(model), GET(first_chunk), GET(chunk_count);
    rows.push_back(out);
  }
  return rows;
}

json dump_chunks(const BundleView& view, std::uint32_t first, std::uint32_t end) {
  json rows = json::array();
  for (std::uint32_t i = first; i < end; ++i) {
    const ChunkRecord& record = view.chunks()[i];
    json out;
    GET(bounds_min), GET(bounds_max), GET(cone_axis), GET(cone_cutoff), GET(position_offset);
    GET(position_step), GET(uv_offset), GET(uv_scale), GET(material), GET(first_level);
    GET(level_count);
    rows.push_back(out);
  }
  return rows;
}

json dump_levels(const BundleView& view, std::uint32_t first, std::uint32_t end) {
  json rows = json::array();
  for (std::uint32_t g = first; g < end; ++g) {
    const ChunkGroup group = view.chunk_group(g);
    const ModelRecord& model = view.models()[group.model];
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = view.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        const LevelRecord& record = view.levels()[chunk.first_level + l];
        json out;
        GET(vertex_offset), GET(index_offset), GET(vertex_count), GET(index_count), GET(error);
        add_digests(view, view.layouts()[model.layout], chunk, record, out);
        rows.push_back(out);
      }
    }
  }
  return rows;
}

json dump_materials(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.materials().size(); ++i) {
    const MaterialRecord& record = view.materials()[i];
    json out;
    out["name"] = view.name(record.name);
    GET(ambient), GET(diffuse), GET(specular), GET(emission), GET(shininess), GET(opacity);
    GET(texture), GET(flags);
    rows.push_back(out);
  }
  return rows;
}

json dump_layouts(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.layouts().size(); ++i) {
    const LayoutRecord& layout = view.layouts()[i];
    json attributes = json::array();
    for (std::size_t a = 0; a < layout.attribute_count; ++a) {
      const AttributeRecord& record = layout.attributes[a];
      json out;
      GET(semantic), GET(type), GET(components), GET(normalised), GET(offset);
      attributes.push_back(out);
    }
    rows.push_back({{"stride", layout.stride},
                    {"attribute_count", layout.attribute_count},
                    {"attributes", attributes}});
  }
  return rows;
}

json dump_textures(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.textures().size(); ++i) {
    const TextureRecord& record = view.textures()[i];
    json out;
    out["name"] = view.name(record.name);
    GET(width), GET(height), GET(source_width), GET(source_height), GET(format), GET(flags);
    GET(first_level), GET(level_count), GET(psnr_db), GET(ssim);
    rows.push_back(out);
  }
  return rows;
}

json dump_texture_levels(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t t = 0; t < view.textures().size(); ++t) {
    const TextureRecord& texture = view.textures()[t];
    for (std::uint32_t l = 0; l < texture.level_count; ++l) {
      const TextureLevelRecord& record = view.texture_levels()[texture.first_level + l];
      json out;
      GET(offset), GET(alpha_offset), GET(size), GET(width), GET(height), GET(psnr_db), GET(ssim);
      const auto data = view.texture_data(t);
      out["blocks"] = digest(data.subspan(record.offset, record.size));
      out["alpha_blocks"] = nullptr;
      if (record.alpha_offset != kNoOffset) {
        out["alpha_blocks"] = digest(data.subspan(record.alpha_offset, record.size));
      }
      rows.push_back(out);
    }
  }
  return rows;
}

json dump_patterns(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.patterns().size(); ++i) {
    const PatternRecord& record = view.patterns()[i];
    json out;
    out["name"] = view.name(record.name);
    GET(width), GET(height), GET(width_mm), GET(half_width), GET(half_height), GET(score);
    GET(score_version), GET(copies);
    rows.push_back(out);
  }
  return rows;
}

json dump_parameter_sets(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.parameter_sets().size(); ++i) {
    const ParameterSetRecord& record = view.parameter_sets()[i];
    json out;
    out["name"] = view.name(record.name);
    GET(id), GET(detector), GET(max_features), GET(scale_factor), GET(level_count);
    GET(edge_threshold), GET(first_level), GET(wta_k), GET(harris), GET(patch_size);
    GET(fast_threshold), GET(agast_threshold), GET(octaves), GET(pattern_scale);
    GET(descriptor_bits), GET(max_distance), GET(min_matches), GET(min_inliers);
    GET(ransac_threshold);
    rows.push_back(out);
  }
  return rows;
}

json dump_scenes(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.scenes().size(); ++i) {
    const SceneRecord& record = view.scenes()[i];
    json out;
    GET(pattern), GET(model), GET(scale), GET(offset), GET(rotation);
    rows.push_back(out);
  }
  return rows;
}

json dump_lights(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.lights().size(); ++i) {
    const LightRecord& record = view.lights()[i];
    json out;
    GET(scene), GET(sky), GET(direction), GET(key);
    rows.push_back(out);
  }
  return rows;
}

json dump_occlusion(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.occlusion().size(); ++i) {
    const OcclusionRecord& record = view.occlusion()[i];
    json out;
    GET(layout), GET(offset);
    rows.push_back(out);
  }
  return rows;
}

json dump_nodes(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.nodes().size(); ++i) {
    const NodeRecord& record = view.nodes()[i];
    json out = {{"name", view.name(record.name)}, {"mark", view.name(record.mark)}};
    GET(pattern), GET(kind), GET(subject), GET(flags), GET(group), GET(place), GET(rotation);
    GET(half_size), GET(alpha), GET(key), GET(reach);
    rows.push_back(out);
  }
  return rows;
}

json dump_media(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.media().size(); ++i) {
    const MediaRecord& record = view.media()[i];
    json out = {{"name", view.name(record.name)}};
    GET(kind), GET(flags), GET(width), GET(height), GET(seconds), GET(poster);
    rows.push_back(out);
  }
  return rows;
}

json dump_clips(const BundleView& view) {
  json rows = json::array();
  for (const ClipRecord& record : view.clips()) {
    json out = {{"name", view.name(record.name)}};
    GET(model), GET(tracks), GET(seconds), GET(error);
    rows.push_back(out);
  }
  return rows;
}

json dump_joints(const BundleView& view) {
  json rows = json::array();
  for (const JointRecord& record : view.joints()) {
    json out;
    GET(model), GET(parent), GET(before), GET(translation), GET(rotation), GET(scale);
    rows.push_back(out);
  }
  return rows;
}

json dump_bones(const BundleView& view) {
  json rows = json::array();
  for (const BoneRecord& record : view.bones()) {
    json out;
    GET(joint), GET(inverse);
    rows.push_back(out);
  }
  return rows;
}

json dump_parts(const BundleView& view) {
  json rows = json::array();
  for (const PartRecord& record : view.moving_parts()) {
    json out;
    GET(material), GET(first_bone), GET(bone_count), GET(target_count);
    GET(bounds_min), GET(bounds_max);
    rows.push_back(out);
  }
  return rows;
}

json dump_scene_clips(const BundleView& view) {
  json rows = json::array();
  for (const SceneClipRecord& record : view.scene_clips()) {
    json out;
    GET(scene), GET(clip), GET(flags);
    rows.push_back(out);
  }
  return rows;
}

json dump_actions(const BundleView& view) {
  json rows = json::array();
  for (std::uint32_t i = 0; i < view.actions().size(); ++i) {
    const ActionRecord& record = view.actions()[i];
    json out = {{"part", view.name(record.part)}, {"address", view.name(record.address)}};
    GET(event), GET(command), GET(source), GET(target), GET(seconds), GET(duration), GET(axis);
    GET(degrees);
    rows.push_back(out);
  }
  return rows;
}

json dump_sections_and_features(const BundleView& view, json& features) {
  json rows = json::array();
  features = json::array();
  for (const SectionEntry& record : view.sections()) {
    json out;
    GET(type), GET(version), GET(flags), GET(owner), GET(variant), GET(offset), GET(size);
    out["hash"] = hex(record.hash);
    rows.push_back(out);
    if (static_cast<SectionType>(record.type) != SectionType::kMappedFeatures) continue;
    const FeatureView twin = view.features(record.owner, record.variant);
    const std::string_view yml = view.feature_yml(record.owner, record.variant);
    json entry = {{"pattern", record.owner},
                  {"set_id", record.variant},
                  {"count", twin.keypoints.size()},
                  {"descriptor_bytes", twin.descriptor_bytes},
                  {"keypoints", digest(std::as_bytes(twin.keypoints))},
                  {"descriptors", digest(twin.descriptors)},
                  {"yml", nullptr}};
    if (!yml.empty()) entry["yml"] = digest(yml.data(), yml.size());
    features.push_back(entry);
  }
  return rows;
}

}  // namespace

json dump(const BundleView& view) {
  json features;
  const json sections = dump_sections_and_features(view, features);
  const std::uint32_t models = view.models().size();
  const std::uint32_t chunks = view.chunks().own().size();
  return {{"format", {{"major", view.header().major}, {"minor", view.header().minor}}},
          {"bytes", view.bytes().size()},
          {"meta", view.meta()},
          {"sections", sections},
          {"models", dump_models(view)},
          {"chunks", dump_chunks(view, 0, chunks)},
          {"levels", dump_levels(view, 0, models)},
          {"proxies", dump_proxies(view)},
          {"proxy_chunks", dump_chunks(view, chunks, view.chunks().size())},
          {"proxy_levels", dump_levels(view, models, view.chunk_groups())},
          {"materials", dump_materials(view)},
          {"layouts", dump_layouts(view)},
          {"textures", dump_textures(view)},
          {"texture_levels", dump_texture_levels(view)},
          {"patterns", dump_patterns(view)},
          {"parameter_sets", dump_parameter_sets(view)},
          {"scenes", dump_scenes(view)},
          {"lights", dump_lights(view)},
          {"occlusion", dump_occlusion(view)},
          {"nodes", dump_nodes(view)},
          {"actions", dump_actions(view)},
          {"media", dump_media(view)},
          {"clips", dump_clips(view)},
          {"joints", dump_joints(view)},
          {"bones", dump_bones(view)},
          {"parts", dump_parts(view)},
          {"scene_clips", dump_scene_clips(view)},
          {"features", features}};
}

}  // namespace modar::test
