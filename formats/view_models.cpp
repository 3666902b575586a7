// Validation of models, chunks, levels, materials and layouts.
#include <algorithm>

#include "formats/validate.hpp"

namespace modar {
namespace {

/// What ES 2.0 can be handed for a semantic.
bool components_fit(std::uint8_t semantic, std::uint8_t components) {
  switch (static_cast<Semantic>(semantic)) {
    case Semantic::kPosition:
      return components == 3 || components == 4;
    case Semantic::kNormal:
      return components == 3;
    case Semantic::kUv:
    case Semantic::kNormalOct:
      return components == 2;
    case Semantic::kColour:
      return components == 4;
  }
  return false;
}

bool known_semantic(std::uint8_t semantic) {
  return semantic >= static_cast<std::uint8_t>(Semantic::kPosition) &&
         semantic <= static_cast<std::uint8_t>(Semantic::kNormalOct);
}

bool is_float(std::uint8_t type) {
  return type == static_cast<std::uint8_t>(ComponentType::kHalf) ||
         type == static_cast<std::uint8_t>(ComponentType::kF32);
}

void check_attribute(const RecordCheck& check, const LayoutRecord& layout,
                     const AttributeRecord& attribute) {
  const std::uint32_t size = component_bytes(attribute.type);
  check.reserved(&attribute.reserved, sizeof(attribute.reserved));
  if (!known_semantic(attribute.semantic) || size == 0 || attribute.normalised > 1) {
    return check.fault(Rule::kEnum, &attribute,
                       "an attribute has semantic " + std::to_string(attribute.semantic) +
                           ", type " + std::to_string(attribute.type) + ", normalised " +
                           std::to_string(attribute.normalised));
  }
  const std::uint32_t end = attribute.offset + size * attribute.components;
  if (!components_fit(attribute.semantic, attribute.components) ||
      (is_float(attribute.type) && attribute.normalised != 0) || attribute.offset % 2 != 0 ||
      attribute.offset % size != 0 || end > layout.stride) {
    check.fault(Rule::kLayout, &attribute,
                "an attribute of " + std::to_string(attribute.components) + " components of " +
                    std::to_string(size) + " bytes at " + std::to_string(attribute.offset) +
                    " does not suit its meaning or the stride " + std::to_string(layout.stride));
  }
}

/// True if two attributes share a meaning or a byte.
bool collide(const AttributeRecord& a, const AttributeRecord& b) {
  const bool normal_twice =
      std::min(a.semantic, b.semantic) == static_cast<std::uint8_t>(Semantic::kNormal) &&
      std::max(a.semantic, b.semantic) == static_cast<std::uint8_t>(Semantic::kNormalOct);
  const std::uint32_t a_end = a.offset + component_bytes(a.type) * a.components;
  const std::uint32_t b_end = b.offset + component_bytes(b.type) * b.components;
  return a.semantic == b.semantic || normal_twice || (a.offset < b_end && b.offset < a_end);
}

void check_layout(const RecordCheck& check, const LayoutRecord& layout) {
  check.reserved(&layout.reserved, sizeof(layout.reserved));
  const std::uint32_t count = layout.attribute_count;
  if (layout.stride == 0 || layout.stride % 4 != 0 || layout.stride > kMaxVertexStride ||
      count == 0 || count > std::size(layout.attributes)) {
    return check.fault(Rule::kLayout, &layout,
                       "stride " + std::to_string(layout.stride) + " and " + std::to_string(count) +
                           " attributes are not possible");
  }
  std::uint32_t positions = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    check_attribute(check, layout, layout.attributes[i]);
    positions += layout.attributes[i].semantic == static_cast<std::uint8_t>(Semantic::kPosition);
    for (std::uint32_t j = 0; j < i; ++j) {
      if (collide(layout.attributes[i], layout.attributes[j])) {
        check.fault(Rule::kLayout, &layout.attributes[i],
                    "attributes " + std::to_string(j) + " and " + std::to_string(i) + " collide");
      }
    }
  }
  if (positions == 0) check.fault(Rule::kLayout, &layout, "it has no position");
  check.reserved(&layout.attributes[count],
                 (std::size(layout.attributes) - count) * sizeof(AttributeRecord));
}

void check_material(const RecordCheck& check, const BundleParts& parts,
                    const MaterialRecord& material) {
  check.name(material.name);
  check.numbers(material.ambient, "ambient");
  check.numbers(material.diffuse, "diffuse");
  check.numbers(material.specular, "specular");
  check.numbers(material.emission, "emission");
  check.number(material.shininess, "shininess");
  check.number(material.opacity, "opacity");
  check.flags(material.flags, kMaterialTwoSided);
  check.reserved(material.reserved, sizeof(material.reserved));
  if (material.texture != kNone && material.texture >= parts.textures.size()) {
    check.fault(Rule::kMaterialRange, &material.texture,
                "texture " + std::to_string(material.texture) + " is not there");
  }
}

void check_level(const RecordCheck& check, const BundleParts& parts, const LevelRecord& level,
                 std::uint32_t stride) {
  check.number(level.error, "error", 0.0);
  check.reserved(&level.reserved, sizeof(level.reserved));
  const std::uint64_t vertex_bytes = std::uint64_t{level.vertex_count} * stride;
  if (level.vertex_count > kMaxChunkVertices || level.vertex_offset % 4 != 0 ||
      level.vertex_offset > parts.vertices.size() ||
      vertex_bytes > parts.vertices.size() - level.vertex_offset) {
    check.fault(Rule::kLevelRange, &level.vertex_offset,
                std::to_string(level.vertex_count) + " vertices of " + std::to_string(stride) +
                    " bytes at " + std::to_string(level.vertex_offset) + " do not lie in the " +
                    std::to_string(parts.vertices.size()) + " bytes of vertices");
  }
  const std::uint64_t index_bytes = std::uint64_t{level.index_count} * 2;
  if (level.index_count % 3 != 0 || level.index_offset % 2 != 0 ||
      level.index_offset > parts.indices.size() ||
      index_bytes > parts.indices.size() - level.index_offset) {
    check.fault(Rule::kLevelRange, &level.index_offset,
                std::to_string(level.index_count) + " indices at " +
                    std::to_string(level.index_offset) + " are no triangles in the " +
                    std::to_string(parts.indices.size()) + " bytes of indices");
  }
}

void check_chunk(const RecordCheck& check, const ModelRecord& model, const ChunkRecord& chunk) {
  check.numbers(chunk.bounds_min, "bounds_min");
  check.numbers(chunk.bounds_max, "bounds_max");
  for (int axis = 0; axis < 3; ++axis) {
    if (chunk.bounds_min[axis] > chunk.bounds_max[axis]) {
      check.fault(Rule::kChunkRange, &chunk.bounds_min[axis], "its box is inside out");
    }
  }
  check.numbers(chunk.cone_axis, "cone_axis");
  check.number(chunk.cone_cutoff, "cone_cutoff");
  check.numbers(chunk.position_offset, "position_offset");
  check.number(chunk.position_step, "position_step", std::numeric_limits<float>::denorm_min());
  check.numbers(chunk.uv_offset, "uv_offset");
  check.numbers(chunk.uv_scale, "uv_scale");
  check.reserved(&chunk.reserved, sizeof(chunk.reserved));
  if (chunk.level_count == 0) {
    check.fault(Rule::kChunkRange, &chunk.level_count, "it has no level");
  }
  // The model's own range was held against the table before.
  if (chunk.material < model.first_material ||
      chunk.material - model.first_material >= model.material_count) {
    check.fault(Rule::kMaterialRange, &chunk.material,
                "material " + std::to_string(chunk.material) + " is none of its model's");
  }
}

void check_model(const RecordCheck& check, const BundleParts& parts, const ModelRecord& model) {
  check.name(model.name);
  check.numbers(model.center, "center");
  check.number(model.scale, "scale", std::numeric_limits<double>::denorm_min());
  check.number(model.diagonal, "diagonal", 0.0);
  check.number(model.unit_metres, "unit_metres", 0.0);
  check.number(model.position_error_max, "position_error_max", 0.0);
  check.number(model.position_error_rms, "position_error_rms", 0.0);
  check.number(model.normal_error_max_deg, "normal_error_max_deg", 0.0, 180.0);
  check.number(model.normal_error_rms_deg, "normal_error_rms_deg", 0.0, 180.0);
  check.number(model.uv_error_max_texels, "uv_error_max_texels", 0.0);
  check.number(model.uv_error_rms_texels, "uv_error_rms_texels", 0.0);
  check.reserved(model.reserved, sizeof(model.reserved));
  if (model.layout >= parts.layouts.size()) {
    check.fault(Rule::kModelRange, &model.layout,
                "layout " + std::to_string(model.layout) + " is not there");
  }
  if (std::uint64_t{model.first_material} + model.material_count > parts.materials.size()) {
    check.fault(Rule::kModelRange, &model.first_material, "its materials are not there");
  }
}

/// Chunks of one model and their levels; `next_level` runs over the levels of the whole bundle.
void check_chunks(FaultLog& log, const BundleParts& parts, const ModelRecord& model,
                  std::uint64_t& next_level) {
  const std::uint32_t stride =
      model.layout < parts.layouts.size() ? parts.layouts[model.layout].stride : 0;
  for (std::uint32_t i = 0; i < model.chunk_count && !log.stop(); ++i) {
    const std::uint32_t index = model.first_chunk + i;
    const ChunkRecord& chunk = parts.chunks[index];
    const RecordCheck check(log, parts, "chunk", index);
    check_chunk(check, model, chunk);
    const bool found = check.range(Rule::kChunkRange, chunk.first_level, chunk.level_count,
                                   next_level, parts.levels.size(), "level");
    next_level += chunk.level_count;
    for (std::uint32_t j = 0; found && j < chunk.level_count && !log.stop(); ++j) {
      const std::uint32_t level = chunk.first_level + j;
      check_level(RecordCheck(log, parts, "level", level), parts, parts.levels[level], stride);
    }
  }
}

}  // namespace

void validate_models(FaultLog& log, const BundleParts& parts) {
  for (std::uint32_t i = 0; i < parts.layouts.size() && !log.stop(); ++i) {
    check_layout(RecordCheck(log, parts, "layout", i), parts.layouts[i]);
  }
  for (std::uint32_t i = 0; i < parts.materials.size() && !log.stop(); ++i) {
    check_material(RecordCheck(log, parts, "material", i), parts, parts.materials[i]);
  }
  // Ranges have to follow each other without gap or overlap: each chunk has one model and each
  // level one chunk, and the time taken does not exceed the size of the tables.
  std::uint64_t next_chunk = 0;
  std::uint64_t next_level = 0;
  for (std::uint32_t i = 0; i < parts.models.size() && !log.stop(); ++i) {
    const ModelRecord& model = parts.models[i];
    const RecordCheck check(log, parts, "model", i);
    check_model(check, parts, model);
    const bool found = check.range(Rule::kModelRange, model.first_chunk, model.chunk_count,
                                   next_chunk, parts.chunks.size(), "chunk");
    next_chunk += model.chunk_count;
    if (found) check_chunks(log, parts, model, next_level);
  }
  if (!log.clean()) return;
  // Levels that shared indices could make a small file cost any time to draw or check.
  std::uint64_t index_bytes = 0;
  for (std::uint32_t i = 0; i < parts.levels.size(); ++i) {
    index_bytes += std::uint64_t{parts.levels[i].index_count} * 2;
  }
  if (index_bytes > parts.indices.size()) {
    log.add(Rule::kLevelRange, 0, "levels",
            "levels use " + std::to_string(index_bytes) + " bytes of indices where " +
                std::to_string(parts.indices.size()) + " are: some are shared");
  }
  if (next_chunk != parts.chunks.size()) {
    log.add(Rule::kModelRange, 0, "chunks",
            std::to_string(parts.chunks.size() - next_chunk) + " chunks belong to no model");
  } else if (next_level != parts.levels.size()) {
    log.add(Rule::kChunkRange, 0, "levels",
            std::to_string(parts.levels.size() - next_level) + " levels belong to no chunk");
  }
}

}  // namespace modar
