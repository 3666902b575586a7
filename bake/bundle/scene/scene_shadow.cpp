// Casts rays from texels of the plane through the model's coarse levels.
#include "bake/bundle/scene/scene_shadow.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <set>

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>

#include "bake/bundle/scene/model_pose.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "bake/texture/texture_codec.hpp"
#include "formats/base/colour.hpp"
#include "formats/base/parallel.hpp"
#include "formats/component.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kShadowSide = 64;  ///< texels: 4 KB a scene, as a shadow is soft
/// Rays of a texel to the sky. More make smoother shadows and take time.
constexpr int kSkyRays = 64;
constexpr int kKeyRays = 36;
/// Half the angle under which the key light is seen, as a tangent: a lamp with a wide shade.
constexpr double kKeySpread = 0.2;
constexpr std::size_t kMostTriangles = 200'000;  ///< of the tree, where levels allow
/// Around the model's own box, in parts of its height: beyond, a shadow is too faint to see.
constexpr double kMargin = 0.9;
constexpr std::uint32_t kAlphaSide = 128;  ///< texels of a mask: finer than the shadow's are
constexpr double kLift = 1e-4;             ///< pattern units: above the models on the plane

/// Triangles of a level of detail, or of the coarsest that a chunk has.
const LevelRecord& level_at(const BundleContent& content, const ChunkRecord& chunk,
                            std::uint32_t depth) {
  return content.levels[chunk.first_level + std::min(depth, chunk.level_count - 1)];
}

/// A texture's alpha, at a level that a soft shadow needs.
struct AlphaMask {
  RgbaImage image;  ///< empty: opaque
  TextureWrap wrap{};

  [[nodiscard]] double at(const glm::dvec2& uv) const {
    if (image.pixels.empty()) return 1;
    const auto texel = [](double x, std::uint32_t side, Wrap along) {
      const auto place = static_cast<std::int64_t>(std::floor(x * side));
      return static_cast<std::size_t>(wrapped(place, side, along));
    };
    const std::size_t row = texel(uv.y, image.height, wrap[1]);
    return image.pixels[4 * (row * image.width + texel(uv.x, image.width, wrap[0]))] / 255.0;
  }
};

AlphaMask alpha_mask(const BundleContent& content, std::uint32_t texture) {
  AlphaMask mask;
  if (texture == kNone || (content.textures[texture].flags & kTextureAlpha) == 0) return mask;
  const TextureRecord& record = content.textures[texture];
  std::uint32_t level = record.first_level;
  while (level + 1 < record.first_level + record.level_count &&
         std::max(content.texture_levels[level].width, content.texture_levels[level].height) >
             kAlphaSide) {
    ++level;
  }
  const TextureLevelRecord& place = content.texture_levels[level];
  mask.image = decode_texture(
      static_cast<TextureFormat>(record.format),
      std::span(content.texture_data[texture]).subspan(place.alpha_offset, place.size), place.width,
      place.height);
  mask.wrap = texture_wrap(record.flags);
  return mask;
}

/// The models on the plane: corners of triangles, three after three, and what they let through.
class Casters {
 public:
  Casters(const BundleContent& content, const SceneRecord& scene, const ModelPose& pose) {
    place(content, scene, pose);
    masks_.resize(content.materials.size());
    for (const MaterialRecord& material : content.materials) {
      opacities_.push_back(static_cast<double>(material.opacity));
    }
    const std::set<std::uint32_t> used(materials_.begin(), materials_.end());
    for (const std::uint32_t m : used)
      masks_[m] = alpha_mask(content, content.materials[m].texture);
    std::vector<RayTree::Triangle> triangles;
    for (std::uint32_t i = 0; i < corners_.size(); i += 3) triangles.push_back({i, i + 1, i + 2});
    if (!triangles.empty()) tree_.emplace(corners_, triangles);
  }

  [[nodiscard]] const std::vector<glm::dvec3>& corners() const { return corners_; }

  /// The share of a ray's light that gets past all of them. At least one triangle.
  [[nodiscard]] double left(const glm::dvec3& origin, const glm::dvec3& direction,
                            double reach) const {
    double left = 1;
    double from = 0;
    while (left > 0.01) {
      const auto hit = tree_->first_hit(origin, direction, from, reach);
      if (!hit) return left;
      left *= 1 - alpha(*hit);
      from = hit->distance + 1e-6;
    }
    return 0;
  }

 private:
  [[nodiscard]] double alpha(const RayHit& hit) const {
    const std::uint32_t first = hit.triangle[0];
    const std::uint32_t material = materials_[first / 3];
    const AlphaMask& mask = masks_[material];
    if (mask.image.pixels.empty()) return opacities_[material];
    const glm::dvec2 uv =
        (1 - hit.b - hit.c) * uvs_[first] + hit.b * uvs_[first + 1] + hit.c * uvs_[first + 2];
    return opacities_[material] * mask.at(uv);
  }

  void place(const BundleContent& content, const SceneRecord& scene, const ModelPose& pose);

  std::vector<glm::dvec3> corners_;
  std::vector<glm::dvec2> uvs_;           ///< of each corner
  std::vector<std::uint32_t> materials_;  ///< of each triangle
  std::vector<double> opacities_;         ///< of each material
  std::vector<AlphaMask> masks_;
  std::optional<RayTree> tree_;
};

void Casters::place(const BundleContent& content, const SceneRecord& scene, const ModelPose& pose) {
  const ModelRecord& model = content.models[scene.model];
  const auto count_at = [&](std::uint32_t depth) {
    std::size_t count = 0;
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      count += level_at(content, content.chunks[model.first_chunk + c], depth).index_count / 3;
    }
    return count;
  };
  std::uint32_t depth = 0;
  while (depth + 1 < model.level_count && count_at(depth) > kMostTriangles) ++depth;
  const LayoutRecord& layout = content.layouts[model.layout];
  const VertexDecoder decoder(layout);
  const bool textured = decoder.has(Semantic::kUv);
  const glm::dmat4 to_pattern(scene_matrix(scene));
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = content.chunks[model.first_chunk + c];
    const MaterialRecord& material = content.materials[chunk.material];
    if ((material.flags & kMaterialOccluder) != 0) continue;
    const LevelRecord& level = level_at(content, chunk, depth);
    for (std::uint32_t i = 0; i < level.index_count; ++i) {
      std::uint16_t index = 0;
      std::memcpy(&index, content.indices.data() + level.index_offset + 2 * std::uint64_t{i}, 2);
      const std::byte* vertex =
          content.vertices.data() + level.vertex_offset + std::uint64_t{index} * decoder.stride();
      corners_.emplace_back(to_pattern *
                            glm::dvec4(pose.place(layout, decoder, chunk, vertex), 1.0));
      uvs_.push_back(textured ? decoder.uv(vertex, chunk) : glm::dvec2(0.0));
      if (i % 3 == 0) materials_.push_back(chunk.material);
    }
  }
}

struct Ray {
  glm::dvec3 direction;
  double light = 0;  ///< that it gives to a plane that nothing hides
};

/// Each neighbouring texel casts its own part of the rays; blurred() averages squares of two by
/// two.
constexpr std::uint32_t kParts = 4;

/// What reaches the plane from all around: cosine-weighted, brighter where the light says so.
std::vector<Ray> light_rays(const RoomLight& light) {
  const auto luma = [](const glm::vec3& rgb) {
    return luminance(static_cast<double>(rgb.r), static_cast<double>(rgb.g),
                     static_cast<double>(rgb.b));
  };
  std::vector<Ray> rays;
  double sum = 0;
  for (int i = 0; i < kSkyRays; ++i) {
    // Points of a sunflower on a disc, lifted to the half sphere.
    const double square = (i + 0.5) / kSkyRays;
    const double angle = 2.399963229728653 * i;
    const glm::dvec3 d(std::sqrt(square) * std::cos(angle), std::sqrt(square) * std::sin(angle),
                       std::sqrt(1 - square));
    // Radiance of which the coefficients are the irradiance: Ramamoorthi and Hanrahan, 2001.
    const double radiance =
        luma(light.sky[0]) +
        1.5 * (luma(light.sky[1]) * d.y + luma(light.sky[2]) * d.z + luma(light.sky[3]) * d.x);
    rays.push_back({d, std::max(radiance, 0.0)});
    sum += rays.back().light;
  }
  const double wanted = luma(light.sky[0]) + luma(light.sky[2]);
  for (Ray& ray : rays) ray.light *= sum > 0 ? std::max(wanted, 0.0) / sum : 0.0;
  const glm::dvec3 to_key = glm::normalize(glm::dvec3(light.direction));
  const double key = luma(light.key) * std::max(to_key.z, 0.0);
  if (key > 0) {
    const glm::dvec3 side = glm::normalize(
        glm::cross(std::fabs(to_key.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0), to_key));
    const glm::dvec3 other = glm::cross(to_key, side);
    for (int i = 0; i < kKeyRays; ++i) {
      const double radius = kKeySpread * std::sqrt((i + 0.5) / kKeyRays);
      const double angle = 2.399963229728653 * i;
      const glm::dvec3 d = to_key + radius * (std::cos(angle) * side + std::sin(angle) * other);
      if (d.z > 0.02) rays.push_back({glm::normalize(d), key / kKeyRays});
    }
  }
  // All light is 1 for each part.
  std::array<double, kParts> all{};
  for (std::size_t i = 0; i < rays.size(); ++i) all[i % kParts] += rays[i].light;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].light /= all[i % kParts] > 0 ? all[i % kParts] : 1.0;
  }
  return rays;
}

RoomLight light_of(const BundleContent& content, std::uint32_t scene) {
  for (const LightRecord& record : content.lights) {
    if (record.scene == scene) return light_of_record(record);
  }
  return neutral_room();
}

/// Takes out the grain of the rays: each texel becomes the binomial mean of the five by five around
/// it.
std::vector<double> blurred(const std::vector<double>& shares) {
  constexpr std::array<double, 5> kWeights = {1 / 16.0, 4 / 16.0, 6 / 16.0, 4 / 16.0, 1 / 16.0};
  std::vector<double> from = shares;
  std::vector<double> to(shares.size());
  for (const bool down : {false, true}) {
    for (std::uint32_t row = 0; row < kShadowSide; ++row) {
      for (std::uint32_t column = 0; column < kShadowSide; ++column) {
        double sum = 0;
        for (int k = -2; k <= 2; ++k) {
          const int at = std::clamp(static_cast<int>(down ? row : column) + k, 0,
                                    static_cast<int>(kShadowSide) - 1);
          const auto other = static_cast<std::uint32_t>(at);
          sum += kWeights[static_cast<std::size_t>(k + 2)] *
                 from[down ? other * kShadowSide + column : row * kShadowSide + other];
        }
        to[row * kShadowSide + column] = sum;
      }
    }
    std::swap(from, to);
  }
  return from;
}

/// Fades to all light at the rim, so that no edge is seen.
double faded(double left, double u, double v) {
  const double rim = std::min({u, v, 1 - u, 1 - v}) * 8;
  return glm::mix(1.0, left, std::clamp(rim - 0.5 / 8, 0.0, 1.0));
}

/// The scene's model, through the clip that it plays.
std::vector<Casters> poses_of(const BundleContent& content, std::uint32_t scene) {
  constexpr int kPoses = 8;
  std::uint32_t clip = kNone;
  for (const SceneClipRecord& plays : content.scene_clips) {
    if (plays.scene == scene) clip = plays.clip;
  }
  const SceneRecord& record = content.scenes[scene];
  std::vector<Casters> poses;
  if (clip == kNone) poses.emplace_back(content, record, ModelPose());
  for (int i = 0; i < kPoses && clip != kNone; ++i) {
    poses.emplace_back(content, record, pose_at(content, clip, (i + 0.5) / kPoses));
  }
  return poses;
}

}  // namespace

std::vector<std::byte> scene_shadow(const BundleContent& content, std::uint32_t scene,
                                    unsigned jobs) {
  const std::vector<Casters> poses = poses_of(content, scene);
  glm::dvec3 low(1e30);
  glm::dvec3 high(-1e30);
  for (const Casters& casters : poses) {
    for (const glm::dvec3& corner : casters.corners()) {
      low = glm::min(low, corner);
      high = glm::max(high, corner);
    }
  }
  if (poses[0].corners().empty() || high.z <= kLift) return {};
  const double margin = kMargin * (high.z - std::max(low.z, 0.0)) + 0.05;
  ShadowHeader header{kShadowSide, kShadowSide, {}, {}, {}};
  for (int axis = 0; axis < 2; ++axis) {
    header.low[axis] = static_cast<float>(low[axis] - margin);
    header.high[axis] = static_cast<float>(high[axis] + margin);
  }
  const std::vector<Ray> rays = light_rays(light_of(content, scene));
  const double reach = 2 * glm::length(high - low) + 1;
  std::vector<double> shares(std::size_t{kShadowSide} * kShadowSide);
  const auto place = [](std::uint32_t index) { return (index + 0.5) / kShadowSide; };
  parallel_rows(kShadowSide, jobs, [&](std::uint32_t row) {
    for (std::uint32_t column = 0; column < kShadowSide; ++column) {
      const double x = glm::mix(static_cast<double>(header.low[0]),
                                static_cast<double>(header.high[0]), place(column));
      const double y = glm::mix(static_cast<double>(header.high[1]),
                                static_cast<double>(header.low[1]), place(row));
      double& left = shares[row * kShadowSide + column];
      for (std::size_t i = row % 2 * 2 + column % 2; i < rays.size(); i += kParts) {
        double through = 0;
        for (const Casters& casters : poses) {
          through += casters.left({x, y, kLift}, rays[i].direction, reach);
        }
        left += rays[i].light * through / static_cast<double>(poses.size());
      }
    }
  });
  shares = blurred(shares);
  std::vector<std::byte> section(sizeof header + shares.size());
  std::memcpy(section.data(), &header, sizeof header);
  for (std::uint32_t i = 0; i < shares.size(); ++i) {
    const double left = faded(shares[i], place(i % kShadowSide), place(i / kShadowSide));
    section[sizeof header + i] =
        static_cast<std::byte>(std::lround(255 * std::clamp(left, 0.0, 1.0)));
  }
  return section;
}

}  // namespace modar
