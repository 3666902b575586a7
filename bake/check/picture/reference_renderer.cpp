// Rasterises triangle after triangle into a depth buffer.
#include "bake/check/picture/reference_renderer.hpp"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "bake/texture/texture.hpp"
#include "formats/base/colour.hpp"

namespace modar {
namespace {

/// A vertex after lighting and projection.
struct ShadedVertex {
  double x = 0;  ///< pixels
  double y = 0;
  double inverse_depth = 0;  ///< 0: behind the camera
  glm::dvec3 light{1.0};     ///< linear
  glm::dvec3 added{0.0};     ///< linear
  glm::dvec2 uv{0.0};
  glm::dvec4 colour{1.0};  ///< linear
};

/// Texel of a level, wrapped or clamped.
glm::dvec4 texel(const RgbaImage& image, std::int64_t x, std::int64_t y, const TextureWrap& wrap) {
  x = wrapped(x, std::int64_t{image.width}, wrap[0]);
  y = wrapped(y, std::int64_t{image.height}, wrap[1]);
  const std::uint8_t* p = image.pixels.data() + 4 * (static_cast<std::size_t>(y) * image.width +
                                                     static_cast<std::size_t>(x));
  return glm::dvec4(p[0], p[1], p[2], p[3]) / 255.0;
}

glm::dvec4 bilinear(const RgbaImage& image, const glm::dvec2& uv, const TextureWrap& wrap) {
  const double x = uv.x * image.width - 0.5;
  const double y = uv.y * image.height - 0.5;
  const auto left = static_cast<std::int64_t>(std::floor(x));
  const auto top = static_cast<std::int64_t>(std::floor(y));
  const double u = x - static_cast<double>(left);
  const double v = y - static_cast<double>(top);
  return glm::mix(
      glm::mix(texel(image, left, top, wrap), texel(image, left + 1, top, wrap), u),
      glm::mix(texel(image, left, top + 1, wrap), texel(image, left + 1, top + 1, wrap), u), v);
}

}  // namespace

glm::dvec3 srgb_to_linear(const glm::dvec3& stored) {
  return {linear_of_srgb(stored.r), linear_of_srgb(stored.g), linear_of_srgb(stored.b)};
}

glm::dvec3 linear_to_srgb(const glm::dvec3& linear) {
  return {srgb_of_linear(linear.r), srgb_of_linear(linear.g), srgb_of_linear(linear.b)};
}

glm::dvec4 look_up(const SoftTexture& texture, const glm::dvec2& uv, double level) {
  const double top = static_cast<double>(texture.levels.size() - 1);
  level = std::clamp(level, 0.0, top);
  const auto fine = static_cast<std::size_t>(level);
  const auto coarse = std::min(fine + 1, texture.levels.size() - 1);
  return glm::mix(bilinear(texture.levels[fine], uv, texture.wrap),
                  bilinear(texture.levels[coarse], uv, texture.wrap),
                  level - static_cast<double>(fine));
}

Result<std::vector<SoftTexture>> load_textures(const TriMesh& mesh, unsigned jobs) {
  std::vector<SoftTexture> textures(mesh.materials.size());
  const std::vector<std::uint32_t> repeats = repeating_materials(mesh);
  for (std::size_t m = 0; m < mesh.materials.size(); ++m) {
    if (mesh.uvs.empty() || mesh.materials[m].diffuse_map.empty()) continue;
    MODAR_ASSIGN(const RgbaImage image, read_texture(mesh.materials[m].diffuse_map));
    textures[m].wrap = texture_wrap(repeats[m]);
    textures[m].levels = mip_chain(image, textures[m].wrap, jobs);
  }
  return textures;
}

namespace {

/// Of the light from all around, stored: the coloured Ka of an MTL, at most as bright as Kd, and Kd
/// in what that leaves.
glm::dvec3 ambient_colour(const SourceMaterial& m) {
  const glm::dvec3 ka(m.ambient);
  const glm::dvec3 kd(m.diffuse);
  const double most = std::max({ka.r, ka.g, ka.b});
  const double bright = std::max({kd.r, kd.g, kd.b});
  if (m.metalness > 0 || std::min({ka.r, ka.g, ka.b}) >= 0.95 * most) return kd;
  if (bright <= 0 || most <= 0) return most <= 0 ? kd : ka;
  return most < bright ? ka + kd * (1 - most / bright) : ka * (bright / most);
}

class Canvas {
 public:
  Canvas(const TriMesh& mesh, const std::vector<SoftTexture>& textures, const Camera& camera,
         const glm::dmat4& to_eye, const RenderOptions& options)
      : mesh_(mesh),
        textures_(textures),
        camera_(camera),
        to_eye_(to_eye),
        turn_(glm::transpose(glm::inverse(glm::dmat3(to_eye)))),
        to_world_(glm::transpose(glm::dmat3(DrawItem().world_to_eye))),
        light_(options.light ? *options.light : neutral_room()),
        options_(options) {
    image_.width = static_cast<std::uint32_t>(camera.width);
    image_.height = static_cast<std::uint32_t>(camera.height);
    depth_.assign(std::size_t{image_.width} * image_.height, 0.0);
    const glm::dvec4 clear(options.clear_colour);
    for (std::size_t i = 0; i < depth_.size(); ++i) {
      for (int c = 0; c < 4; ++c) image_.pixels.push_back(to_byte(c < 3 ? clear[c] : 1.0));
    }
  }

  RgbaImage draw() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const std::uint32_t material = mesh_.triangle_material[t];
      const auto& corners = mesh_.triangles[t];
      fill({shade(corners[0], material), shade(corners[1], material), shade(corners[2], material)},
           textures_[material], mesh_.materials[material].two_sided);
    }
    return std::move(image_);
  }

 private:
  static std::uint8_t to_byte(double value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255.0));
  }

  /// What a white surface of that normal gets from all around, with factors on the parts that are
  /// linear and quadratic in it.
  [[nodiscard]] glm::dvec3 sky(const glm::dvec3& n, double linear, double quadratic) const {
    const double x = n.x;
    const double y = n.y;
    const double z = n.z;
    const std::array<double, 9> terms = {
        1, y, z, x, x * y, y * z, 3 * z * z - 1, z * x, x * x - y * y};
    glm::dvec3 sum(0.0);
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const double factor = i == 0 ? 1.0 : (i < 4 ? linear : quadratic);
      sum += factor * terms[i] * glm::dvec3(light_.sky[i]);
    }
    return glm::max(sum, 0.0) * static_cast<double>(options_.ambient_strength);
  }

  [[nodiscard]] ShadedVertex shade(std::uint32_t v, std::uint32_t material) const {
    const SourceMaterial& m = mesh_.materials[material];
    const glm::dvec3 eye(to_eye_ * glm::dvec4(mesh_.positions[v], 1.0));
    glm::dvec3 n = glm::normalize(turn_ * glm::dvec3(mesh_.normals[v]));
    if (m.two_sided && glm::dot(n, eye) > 0) n = -n;
    const glm::dvec3 world = to_world_ * n;
    const glm::dvec3 to_key = glm::normalize(glm::dvec3(light_.direction));
    const glm::dvec3 halfway = glm::normalize(to_key - glm::normalize(to_world_ * eye));
    const glm::dvec3 key = glm::dvec3(light_.key) * static_cast<double>(options_.light_strength);
    const glm::dvec3 ray = glm::normalize(to_world_ * eye);
    const double view = std::fabs(glm::dot(world, ray));
    const double to_light = std::max(glm::dot(world, to_key), 0.0);
    // Of GGX's lobe, the square of its alpha.
    const double square = 2 / (static_cast<double>(std::min(m.shininess, kMostShininess)) + 2);
    const double alpha = std::sqrt(square);
    const double lobe =
        square / (1 - (1 - square) * std::pow(std::max(glm::dot(world, halfway), 0.0), 2));
    const double masked = glm::mix(2 * to_light * view, to_light + view, alpha);
    const double shine =
        m.shininess > 0 ? lobe * lobe * 2 * to_light / std::max(masked, 0.05) : 0.0;
    const glm::dvec4 factors(mirror_factors(m.shininess, m.reflectance, m.metalness));
    const glm::dvec3 along = glm::normalize(glm::mix(glm::reflect(ray, world), world, alpha));
    const glm::dvec3 mirrored = sky(along, factors.x, factors.y);
    const double edge = std::pow(1 - std::min(view, 1.0), 5.0);
    ShadedVertex lit;
    const glm::dvec3 diffuse = srgb_to_linear(glm::dvec3(m.diffuse));
    lit.light = srgb_to_linear(ambient_colour(m)) * sky(world, 1, 1) + diffuse * key * to_light;
    const glm::dvec3 highlight = srgb_to_linear(glm::dvec3(m.specular)) * key * shine;
    const auto metalness = static_cast<double>(m.metalness);
    const double share = metalness > 0 ? static_cast<double>(m.reflectance) * (1 - metalness) : 1.0;
    lit.light =
        glm::mix(lit.light, diffuse * (mirrored * (1 - 0.25 * alpha) + highlight), metalness);
    lit.added = srgb_to_linear(glm::dvec3(m.emission)) + share * highlight +
                mirrored * (factors.z + factors.w * edge);
    if (!mesh_.uvs.empty()) lit.uv = mesh_.uvs[v];
    if (!mesh_.colours.empty()) {
      lit.colour = glm::dvec4(mesh_.colours[v]) / 255.0;
      lit.colour = glm::dvec4(srgb_to_linear(glm::dvec3(lit.colour)), lit.colour.a);
    }
    if (eye.z >= 0) return lit;
    lit.inverse_depth = -1.0 / eye.z;
    lit.x = camera_.cx + camera_.fx * eye.x * lit.inverse_depth;
    lit.y = camera_.cy - camera_.fy * eye.y * lit.inverse_depth;
    return lit;
  }

  void fill(const std::array<ShadedVertex, 3>& v, const SoftTexture& texture, bool two_sided) {
    for (const ShadedVertex& lit : v) {
      if (lit.inverse_depth == 0) return;  // views keep models before the camera
    }
    const double area =
        (v[1].x - v[0].x) * (v[2].y - v[0].y) - (v[2].x - v[0].x) * (v[1].y - v[0].y);
    // Counter-clockwise is front; rows grow downwards. The device draws backs of two-sided
    // materials alone, too.
    if (!(area < 0) && !(two_sided && area > 0)) return;
    const auto [low_x, high_x] = std::minmax({v[0].x, v[1].x, v[2].x});
    const auto [low_y, high_y] = std::minmax({v[0].y, v[1].y, v[2].y});
    const int left = std::max(0, static_cast<int>(std::ceil(low_x)));
    const int right = std::min(camera_.width - 1, static_cast<int>(std::floor(high_x)));
    const int top = std::max(0, static_cast<int>(std::ceil(low_y)));
    const int bottom = std::min(camera_.height - 1, static_cast<int>(std::floor(high_y)));
    // Barycentric coordinates are linear on the screen.
    const glm::dvec3 step_x = glm::dvec3(v[1].y - v[2].y, v[2].y - v[0].y, v[0].y - v[1].y) / area;
    const glm::dvec3 step_y = glm::dvec3(v[2].x - v[1].x, v[0].x - v[2].x, v[1].x - v[0].x) / area;
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        const glm::dvec3 b = glm::dvec3(1, 0, 0) + step_x * (x - v[0].x) + step_y * (y - v[0].y);
        if (b.x < 0 || b.y < 0 || b.z < 0) continue;
        put(v, texture, b, step_x, step_y, x, y);
      }
    }
  }

  void put(const std::array<ShadedVertex, 3>& v, const SoftTexture& texture, const glm::dvec3& b,
           const glm::dvec3& step_x, const glm::dvec3& step_y, int x, int y) {
    const glm::dvec3 inverse(v[0].inverse_depth, v[1].inverse_depth, v[2].inverse_depth);
    const double near = glm::dot(b, inverse);
    const std::size_t at = static_cast<std::size_t>(y) * image_.width + static_cast<std::size_t>(x);
    if (near <= depth_[at]) return;
    const glm::dvec3 w = b * inverse / near;
    glm::dvec4 base = w.x * v[0].colour + w.y * v[1].colour + w.z * v[2].colour;
    if (!texture.levels.empty()) {
      const auto uv_at = [&](const glm::dvec3& weights) {
        return weights.x * v[0].uv + weights.y * v[1].uv + weights.z * v[2].uv;
      };
      const glm::dvec2 uv = uv_at(w);
      const glm::dvec2 size(texture.levels[0].width, texture.levels[0].height);
      // Derivative of the quotient (uv / z) / (1 / z).
      const auto slope = [&](const glm::dvec3& step) {
        const glm::dvec3 change = step * inverse / near;
        return glm::length((uv_at(change) - uv * (change.x + change.y + change.z)) * size);
      };
      const double texels = std::max({slope(step_x), slope(step_y), 1e-9});
      const glm::dvec4 texel = look_up(texture, uv, std::log2(texels));
      if (texel.a < 0.5) return;
      base *= glm::dvec4(srgb_to_linear(glm::dvec3(texel)), 1.0);
    }
    depth_[at] = near;
    const glm::dvec3 albedo(base);
    const auto seen_at = [&](const ShadedVertex& lit) {
      return linear_to_srgb(albedo * lit.light + lit.added);
    };
    const glm::dvec3 colour = w.x * seen_at(v[0]) + w.y * seen_at(v[1]) + w.z * seen_at(v[2]);
    for (int c = 0; c < 3; ++c)
      image_.pixels[4 * at + static_cast<std::size_t>(c)] = to_byte(colour[c]);
  }

  const TriMesh& mesh_;
  const std::vector<SoftTexture>& textures_;
  Camera camera_;
  glm::dmat4 to_eye_;
  glm::dmat3 turn_;
  glm::dmat3 to_world_;
  RoomLight light_;
  const RenderOptions& options_;
  RgbaImage image_;
  std::vector<double> depth_;  // 1 / z of the nearest surface
};

}  // namespace

RgbaImage render_reference(const TriMesh& mesh, const std::vector<SoftTexture>& textures,
                           const Camera& camera, const glm::dmat4& to_eye,
                           const RenderOptions& options) {
  return Canvas(mesh, textures, camera, to_eye, options).draw();
}

}  // namespace modar
