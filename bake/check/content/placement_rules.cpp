// Scenes: places by the meta text, shadows and draw orders by the geometry.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/bundle/scene/scene_shadow.hpp"
#include "bake/check/content/content_rules.hpp"
#include "bake/mesh/draw_order.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/base/ranges.hpp"
#include "formats/draw_order.hpp"
#include "formats/trim.hpp"

namespace modar {
namespace {

/// Of texels, 0 to 255: what another version of the baker or another processor may round.
constexpr int kShadowTexelSlack = 3;
/// Of its place, in units of the pattern.
constexpr float kShadowSlack = 1e-6f;

/// The sides of a model's box in source units.
std::array<double, 3> sides_of(const BundleView& bundle, const ModelRecord& model) {
  glm::dvec3 low(1e9);
  glm::dvec3 high(-1e9);
  for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], static_cast<double>(chunk.bounds_min[i]));
      high[i] = std::max(high[i], static_cast<double>(chunk.bounds_max[i]));
    }
  }
  const glm::dvec3 sides = (high - low) * model.scale;
  return {sides.x, sides.y, sides.z};
}

std::string place_fault(const BundleView& bundle, const BundleContent& content,
                        const SceneRecord& scene, const Json& stated) {
  if (stated.text_at("pattern") != bundle.name(bundle.patterns()[scene.pattern].name) ||
      stated.text_at("model") != bundle.name(bundle.models()[scene.model].name)) {
    return "another pattern or model";
  }
  const auto up = up_axis_of(stated.text_at("up"));
  const auto scale = stated["scale"].number();
  const Json turn = stated["turn"];
  const Json offset = stated["offset_sides"];
  if (!up || !scale || turn.size() != 3 || offset.size() != 3) return {};
  SceneRequest request;
  request.up = up;
  request.size = {SceneSize::Kind::kScale, *scale};
  request.centred = stated["centred"].truth().value_or(false);
  request.offset.unit = SceneOffset::Unit::kSide;
  request.clip = stated.text_at("clip");
  for (std::size_t i = 0; i < 3; ++i) {
    request.turn[i] = turn[i].number().value_or(0);
    request.offset.value[i] = offset[i].number().value_or(0);
  }
  const ModelRecord& model = bundle.models()[scene.model];
  const std::array<double, 3> sides = sides_of(bundle, model);
  const SceneRecord again = place_scene(request, content, scene.pattern, {scene.model, sides, *up});
  const auto near = [](float a, float b, double slack) {
    return std::fabs(static_cast<double>(a) - static_cast<double>(b)) <= slack;
  };
  // The source's box may be larger than what its triangles fill.
  const double off = 2 * model.position_error_max / model.scale + 1e-6;
  const double diagonal = std::hypot(sides[0], sides[1], sides[2]);
  const bool filled = std::fabs(diagonal - model.diagonal) <= off * model.scale;
  const bool turned = request.turn != std::array<double, 3>{};
  bool same = scene.scale == again.scale && scene.offset[0] == again.offset[0] &&
              scene.offset[1] == again.offset[1] &&
              (!filled || near(scene.offset[2], again.offset[2], *scale * off));
  for (int i = 0; i < 4; ++i) {
    same = same && near(scene.rotation[i], again.rotation[i], turned ? 1e-6 : 0);
  }
  return same ? "" : "another place";
}

std::string shadow_fault(std::span<const std::byte> stored, std::span<const std::byte> again) {
  if (stored.size() != again.size()) return "its shadow has another size";
  std::array<ShadowHeader, 2> headers{};
  std::memcpy(&headers[0], stored.data(), sizeof(ShadowHeader));
  std::memcpy(&headers[1], again.data(), sizeof(ShadowHeader));
  for (int i = 0; i < 2; ++i) {
    if (std::fabs(headers[0].low[i] - headers[1].low[i]) > kShadowSlack ||
        std::fabs(headers[0].high[i] - headers[1].high[i]) > kShadowSlack) {
      return "its shadow is elsewhere";
    }
  }
  int worst = 0;
  for (std::size_t i = sizeof(ShadowHeader); i < stored.size(); ++i) {
    worst =
        std::max(worst, std::abs(std::to_integer<int>(stored[i]) - std::to_integer<int>(again[i])));
  }
  if (worst <= kShadowTexelSlack) return "";
  return "a texel of its shadow is off by " + std::to_string(worst) + " of 255";
}

void check_scene(ContentLog& log, const BundleContent& content, const Json& scenes,
                 std::uint32_t s) {
  const SceneRecord& scene = log.bundle.scenes()[s];
  const std::string where = "scene " + std::to_string(s);
  const auto stated = scenes.at(s);
  if (stated) {
    const std::string fault = place_fault(log.bundle, content, scene, *stated);
    if (!fault.empty())
      log.tell(WorkstationRule::kMetaDiffers, where, &scene, "the meta text states " + fault);
    const bool lit =
        ranges::any_of(content.lights, [s](const LightRecord& light) { return light.scene == s; });
    if (lit != stated->find("light").has_value()) {
      log.tell(WorkstationRule::kMetaDiffers, where, &scene,
               "the meta text states a light, or the bundle has one, and not both");
    }
  }
  const auto shadow = log.bundle.section(SectionType::kShadow, s);
  const bool concerned = log.concerns(
      {SectionType::kShadow, SectionType::kScenes, SectionType::kLights, SectionType::kModels,
       SectionType::kChunks, SectionType::kLevels, SectionType::kMaterials,
       SectionType::kTextureData, SectionType::kVertices, SectionType::kIndices});
  if (shadow.empty() || log.done() || !concerned) return;
  const std::string fault = shadow_fault(shadow, scene_shadow(content, s, log.options.jobs));
  if (!fault.empty()) log.tell(WorkstationRule::kSceneContent, where, shadow.data(), fault);
}

bool moves(const BundleView& bundle, std::uint32_t material) {
  for (const PartRecord& part : bundle.moving_parts()) {
    if (part.material == material) return true;
  }
  return false;
}

/// Of a chunk that is seen through. Empty: it is drawn as it comes, as in moving ones.
std::vector<DrawOrderRecord> order_of(const BundleView& bundle, const BundleContent& content,
                                      const ModelRecord& model, const ChunkRecord& chunk) {
  const LevelRecord& level = bundle.levels()[chunk.first_level];
  const std::size_t count = level.index_count / 3;
  if (!blended(content.materials[chunk.material], content) || count < 2 ||
      count > kMostOrderedTriangles || moves(bundle, chunk.material)) {
    return {};
  }
  const VertexDecoder decoder(bundle.layouts()[model.layout]);
  const auto* indices =
      reinterpret_cast<const std::uint16_t*>(bundle.indices().data() + level.index_offset);
  std::vector<std::array<glm::dvec3, 3>> triangles(count);
  for (std::size_t i = 0; i < 3 * count; ++i) {
    triangles[i / 3][i % 3] = decoder.position(
        bundle.vertices().data() + level.vertex_offset + std::size_t{indices[i]} * decoder.stride(),
        chunk);
  }
  return draw_order(triangles);
}

bool same_order(std::span<const std::byte> stored, const std::vector<DrawOrderRecord>& nodes) {
  if (stored.size() != nodes.size() * sizeof(DrawOrderRecord)) return false;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    DrawOrderRecord node{};
    std::memcpy(&node, stored.data() + i * sizeof node, sizeof node);
    for (int k = 0; k < 4; ++k) {
      if (std::fabs(node.plane[k] - nodes[i].plane[k]) > 1e-5f) return false;
    }
    if (node.behind != nodes[i].behind || node.triangle != nodes[i].triangle) return false;
  }
  return true;
}

void check_draw_orders(ContentLog& log, const BundleContent& content) {
  for (const ModelRecord& model : log.bundle.models()) {
    for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
      const ChunkRecord& chunk = log.bundle.chunks()[c];
      const auto stored = log.bundle.section(SectionType::kDrawOrder, c);
      if (same_order(stored, order_of(log.bundle, content, model, chunk))) continue;
      log.tell(WorkstationRule::kChunkContent,
               log.label("model", model.name) + ", chunk " + std::to_string(c), &chunk,
               "its draw order is not that of its triangles");
    }
  }
}

}  // namespace

void check_placements(ContentLog& log) {
  const BundleContent content = trim(log.bundle);
  check_draw_orders(log, content);
  const Json scenes = stated_list(log.bundle, "scenes");
  if (scenes.size() != content.scenes.size()) {
    log.tell(WorkstationRule::kMetaDiffers, "scenes", log.bundle.meta().data(),
             "the meta text states another number");
  }
  for (std::uint32_t s = 0; s < content.scenes.size() && !log.done(); ++s) {
    check_scene(log, content, scenes, s);
  }
}

}  // namespace modar
