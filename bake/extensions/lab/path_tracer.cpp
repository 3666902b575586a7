// Paths through a tree of triangles.
#include "bake/extensions/lab/path_tracer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "bake/mesh/rays/triangle_tree.hpp"
#include "formats/base/colour.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

constexpr int kBounces = 6;
constexpr double kLift = 1e-4;  ///< pattern units: paths continue this far above a surface
constexpr double kKeySpread =
    0.2;  ///< radius of the key light's disc at distance 1, as the bake has it
constexpr double kFarLevel = 3;  ///< mip level that paths see after their first surface
constexpr double kTurn = 6.283185307179586;

/// Numbers in [0, 1) of one path. The first of each kind are spread evenly over a pixel's paths
/// (Roberts' R2 sequence, turned for each pixel), the rest are random (splitmix64).
class PathNumbers {
 public:
  PathNumbers(std::uint64_t pixel, std::uint64_t seed, int path)
      : state_((seed << 40) ^ (pixel * 0x9E3779B97F4A7C15u)), path_(path) {
    for (glm::dvec2& start : starts_) start = {next(), next()};
    state_ ^= static_cast<std::uint64_t>(path) * 0xD1342543DE82EF95u;
  }
  enum Kind : std::size_t { kPixel, kKey, kBounce, kKinds };
  glm::dvec2 pair(Kind kind, bool first) {
    if (!first) return {next(), next()};
    return glm::fract(starts_[kind] + static_cast<double>(path_) *
                                          glm::dvec2(0.7548776662466927, 0.5698402909980532));
  }
  double next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
  int path_;
  std::array<glm::dvec2, kKinds> starts_;
};

struct Ray {
  glm::dvec3 origin;
  glm::dvec3 direction;
};

struct Surface {
  glm::dvec3 point{0.0};
  glm::dvec3 normal{0, 0, 1};  ///< as shaded, on the ray's side
  glm::dvec3 flat{0, 0, 1};    ///< the triangle's own, on the ray's side
  glm::dvec3 albedo{0.0};
  glm::dvec3 emission{0.0};
  glm::dvec3 specular{0.0};
  double reflectance = 0;
  double metalness = 0;
  double shininess = 0;
  double alpha = 1;
  bool back = false;  ///< of a material with one side
};

/// A right-handed frame whose third axis is n.
glm::dmat3 frame_of(const glm::dvec3& n) {
  const glm::dvec3 other = std::fabs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 x = glm::normalize(glm::cross(other, n));
  return {x, glm::cross(n, x), n};
}

glm::dvec3 cosine_direction(const glm::dvec2& u) {
  return {std::sqrt(u.x) * std::cos(kTurn * u.y), std::sqrt(u.x) * std::sin(kTurn * u.y),
          std::sqrt(1 - u.x)};
}

}  // namespace

class PathTracer::Scene {
 public:
  explicit Scene(const TracedScene& scene)
      : scene_(scene), turn_(glm::transpose(glm::inverse(glm::dmat3(scene.place)))) {
    // Corners of their own, so that what a ray meets tells its triangle.
    std::vector<RayTree::Triangle> triangles;
    two_sided_.resize(scene.mesh.triangles.size());
    std::map<std::array<std::array<double, 3>, 3>, std::uint32_t> known;
    for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
      std::array<std::array<double, 3>, 3> places;
      for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3& p = scene.mesh.positions[scene.mesh.triangles[t][i]];
        places[i] = {p.x, p.y, p.z};
        positions_.emplace_back(scene.place * glm::dvec4(p, 1.0));
      }
      const SourceMaterial& material = scene.mesh.materials[scene.mesh.triangle_material[t]];
      if (material.occluder()) continue;
      two_sided_[t] = material.two_sided;
      // Two triangles back to back are one with two sides: a ray could not tell which is first.
      std::sort(places.begin(), places.end());
      const auto [twin, added] = known.try_emplace(places, t);
      if (added) {
        triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
      } else {
        two_sided_[twin->second] = true;
      }
    }
    if (!triangles.empty()) tree_.emplace(positions_, triangles);
    to_key_ = glm::normalize(glm::dvec3(scene.light.direction));
    key_ = scene.room != nullptr ? glm::dvec3(0.0) : glm::dvec3(scene.light.key);
    if (scene.room != nullptr) {
      room_gain_ = light_upward() / sky_upward();
      weigh_room();
    }
    given_ = sky_upward() + key_ * std::max(to_key_.z, 0.0);
  }

  /// The radiance of a path from the camera. touched: whether the model is in its way.
  glm::dvec3 radiance(Ray ray, PathNumbers& numbers, bool& touched) const {
    glm::dvec3 sum(0.0);
    glm::dvec3 through(1.0);
    for (int bounce = 0; bounce <= kBounces; ++bounce) {
      const bool first = bounce == 0;
      const std::optional<Surface> met = meet(ray, first, numbers, touched);
      if (!met) return sum + through * sky(ray.direction);
      const Surface& s = *met;
      sum += through * (s.emission + from_key(s, ray.direction, first, numbers));
      glm::dvec3 next;
      through *= scatter(s, ray.direction, first, numbers, next);
      const double most = std::max({through.x, through.y, through.z});
      if (bounce > 2) {
        if (numbers.next() >= most) break;
        through /= most;
      }
      ray = {s.point + kLift * s.flat, next};
    }
    return sum;
  }

  /// The same without a model and without chance.
  [[nodiscard]] glm::dvec3 ground_alone(const Ray& ray) const {
    if (!(ray.direction.z < 0)) return sky(ray.direction);
    return given_ * ground_albedo(ray.origin - ray.direction * (ray.origin.z / ray.direction.z), 0);
  }

 private:
  /// The next direction of a path, and its weight: scattered, or mirrored by a facet.
  glm::dvec3 scatter(const Surface& s, const glm::dvec3& direction, bool first,
                     PathNumbers& numbers, glm::dvec3& next) const {
    const auto fresnel = [&](double cosine) {
      const glm::dvec3 straight = glm::mix(glm::dvec3(s.reflectance), s.albedo, s.metalness);
      return straight + (1.0 - straight) * std::pow(1 - std::clamp(cosine, 0.0, 1.0), 5.0);
    };
    const glm::dvec2 u = numbers.pair(PathNumbers::kBounce, first);
    const glm::dmat3 frame = frame_of(s.normal);
    const double around = scene_.room != nullptr ? 0.5 : 0.0;  // paths that seek bright parts of it
    if (s.reflectance + s.metalness + around == 0) {
      next = frame * cosine_direction(u);
      const double side = glm::dot(next, s.flat);
      if (side < 0) next -= 2 * side * s.flat;
      return s.albedo;
    }
    const double sight = std::max(-glm::dot(s.normal, direction), 1e-4);
    const glm::dvec3 scattered = s.albedo * (1 - s.metalness) * (1.0 - fresnel(sight));
    const double mirror = s.reflectance + s.metalness > 0 ? luminance_of(fresnel(sight)) : 0.0;
    const double share = mirror / (mirror + luminance_of(scattered) + 1e-6);
    // GGX: Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007.
    const double square = 2.0 / (s.shininess + 2.0);  // of alpha
    const double choice = numbers.next();
    if (choice < around) {
      next = room_direction(u);
    } else if (choice < around + (1 - around) * share) {
      const double cosine = std::sqrt((1 - u.x) / (1 + (square - 1) * u.x));
      const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
      next = glm::reflect(direction, frame * glm::dvec3(sine * std::cos(kTurn * u.y),
                                                        sine * std::sin(kTurn * u.y), cosine));
    } else {
      next = frame * cosine_direction(u);
    }
    const double out = glm::dot(next, s.normal);
    if (out <= 1e-6 || glm::dot(next, s.flat) <= 0) return glm::dvec3(0.0);
    const glm::dvec3 facet = glm::normalize(next - direction);
    const double cosine = glm::dot(facet, s.normal);
    const double on_facet = std::max(-glm::dot(direction, facet), 1e-6);
    const double bottom = cosine * cosine * (square - 1) + 1;
    const double facets = 2 * square / (kTurn * bottom * bottom);
    const auto unshadowed = [&](double c) {
      return 2 * c / (c + std::sqrt(square + (1 - square) * c * c));
    };
    glm::dvec3 given = scattered * (2 * out / kTurn);
    if (mirror > 0) {
      given += fresnel(on_facet) * (facets * unshadowed(sight) * unshadowed(out) / (4 * sight));
    }
    const double own = share * facets * cosine / (4 * on_facet) + (1 - share) * 2 * out / kTurn;
    return given / ((1 - around) * own + around * (around > 0 ? room_density(next) : 0.0));
  }

  static double luminance_of(const glm::dvec3& rgb) { return luminance(rgb.r, rgb.g, rgb.b); }

  /// What the sky gives a white surface that looks up.
  [[nodiscard]] glm::dvec3 sky_upward() const {
    constexpr int kSteps = 4096;
    glm::dvec3 sum(0.0);
    for (int i = 0; i < kSteps; ++i) {
      const glm::dvec2 u((i + 0.5) / kSteps, glm::fract(i * 0.6180339887498949));
      sum += sky(cosine_direction(u)) / static_cast<double>(kSteps);
    }
    return sum;
  }

  /// What the light's coefficients and key light give it.
  [[nodiscard]] glm::dvec3 light_upward() const {
    const auto& c = scene_.light.sky;
    return glm::dvec3(c[0] + c[2] + 2.0f * c[6]) +
           glm::dvec3(scene_.light.key) * std::max(to_key_.z, 0.0);
  }

  /// Directions are as likely as the panorama is bright there.
  void weigh_room() {
    const LinearImage& image = *scene_.room;
    double sum = 0;
    for (std::uint32_t y = 0; y < image.height; ++y) {
      const double size = std::sin(kTurn / 2 * (y + 0.5) / image.height) * kTurn / image.width *
                          (kTurn / 2 / image.height);
      for (std::uint32_t x = 0; x < image.width; ++x) {
        sum += size * luminance_of(pixel(x, y));
        room_sums_.push_back(sum);
      }
    }
  }

  [[nodiscard]] glm::dvec3 room_direction(const glm::dvec2& u) const {
    const auto found =
        std::upper_bound(room_sums_.begin(), room_sums_.end() - 1, u.x * room_sums_.back());
    const auto index = static_cast<std::size_t>(found - room_sums_.begin());
    const double before = index > 0 ? room_sums_[index - 1] : 0.0;
    const double part =
        std::clamp((u.x * room_sums_.back() - before) / (*found - before), 0.0, 1.0);
    const std::size_t width = scene_.room->width;
    const double azimuth =
        kTurn * ((static_cast<double>(index % width) + part) / static_cast<double>(width) - 0.5);
    const double polar =
        kTurn / 2 * (static_cast<double>(index / width) + u.y) / scene_.room->height;
    return {std::sin(polar) * std::sin(azimuth), std::sin(polar) * std::cos(azimuth),
            std::cos(polar)};
  }

  [[nodiscard]] double room_density(const glm::dvec3& d) const {
    return luminance_of(room(d)) / room_sums_.back();
  }

  [[nodiscard]] glm::dvec3 pixel(std::uint32_t x, std::uint32_t y) const {
    const float* p = &scene_.room->pixels[4 * (std::size_t{y} * scene_.room->width + x)];
    return room_gain_ * glm::dvec3(p[0], p[1], p[2]);
  }

  /// The panorama's radiance, its pixels unfiltered.
  [[nodiscard]] glm::dvec3 room(const glm::dvec3& d) const {
    const LinearImage& image = *scene_.room;
    const double across = glm::fract(std::atan2(d.x, d.y) / kTurn + 0.5);
    const double down = std::acos(std::clamp(d.z, -1.0, 1.0)) / (kTurn / 2);
    const auto x = std::min(static_cast<std::uint32_t>(across * image.width), image.width - 1);
    const auto y = std::min(static_cast<std::uint32_t>(down * image.height), image.height - 1);
    return pixel(x, y);
  }

  /// Radiance of the room. A band of degree l of the coefficients is weakened to 1, 2/3 and 1/4.
  [[nodiscard]] glm::dvec3 sky(const glm::dvec3& d) const {
    if (scene_.room != nullptr) return room(d);
    const auto& c = scene_.light.sky;
    const glm::dvec3 linear =
        glm::dvec3(c[1]) * d.y + glm::dvec3(c[2]) * d.z + glm::dvec3(c[3]) * d.x;
    const glm::dvec3 square = glm::dvec3(c[4]) * (d.x * d.y) + glm::dvec3(c[5]) * (d.y * d.z) +
                              glm::dvec3(c[6]) * (3 * d.z * d.z - 1) +
                              glm::dvec3(c[7]) * (d.z * d.x) +
                              glm::dvec3(c[8]) * (d.x * d.x - d.y * d.y);
    return glm::max(glm::dvec3(c[0]) + 1.5 * linear + 4.0 * square, 0.0);
  }

  [[nodiscard]] glm::dvec3 ground_albedo(const glm::dvec3& p, double level) const {
    const TracedGround& ground = scene_.ground;
    const glm::dvec2 uv(0.5 + 0.5 * p.x / ground.half_width, 0.5 - 0.5 * p.y / ground.half_height);
    const bool printed = uv.x >= 0 && uv.x < 1 && uv.y >= 0 && uv.y < 1;
    if (!printed || ground.print.levels.empty()) return ground.table;
    return srgb_to_linear(glm::dvec3(look_up(ground.print, uv, level)));
  }

  /// The first surface that stops the ray. first: it comes from the camera, which looks through the
  /// backs of what has one side.
  std::optional<Surface> meet(const Ray& ray, bool first, PathNumbers& numbers,
                              bool& touched) const {
    const double to_ground = ray.direction.z < 0 ? -ray.origin.z / ray.direction.z
                                                 : std::numeric_limits<double>::infinity();
    double from = 0;
    for (;;) {
      const auto hit =
          tree_ ? tree_->first_hit(ray.origin, ray.direction, from, 1e9) : std::nullopt;
      if (!hit || hit->distance >= to_ground) break;
      Surface s = surface(*hit, ray, first ? 0 : kFarLevel);
      from = hit->distance + 1e-6;
      if (first && s.back) continue;
      if (s.alpha > 0) touched = touched || first;
      if (s.alpha < 1 && numbers.next() >= s.alpha) continue;
      return s;
    }
    if (std::isinf(to_ground)) return std::nullopt;
    Surface s;
    s.point = ray.origin + to_ground * ray.direction;
    s.albedo = ground_albedo(s.point, first ? 0 : kFarLevel);
    return s;
  }

  [[nodiscard]] Surface surface(const RayHit& hit, const Ray& ray, double level) const {
    const TriMesh& mesh = scene_.mesh;
    const std::uint32_t triangle = hit.triangle[0] / 3;
    const auto& [p, q, r] = mesh.triangles[triangle];
    const std::uint32_t material = mesh.triangle_material[triangle];
    const SourceMaterial& m = mesh.materials[material];
    const glm::dvec3 weights(1 - hit.b - hit.c, hit.b, hit.c);
    Surface s;
    s.point = ray.origin + hit.distance * ray.direction;
    const glm::dvec3* corner = &positions_[hit.triangle[0]];
    s.flat = glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
    s.normal = glm::normalize(turn_ * (weights.x * glm::dvec3(mesh.normals[p]) +
                                       weights.y * glm::dvec3(mesh.normals[q]) +
                                       weights.z * glm::dvec3(mesh.normals[r])));
    if (glm::dot(s.flat, ray.direction) > 0) {
      s.back = !two_sided_[triangle];
      s.flat = -s.flat;
      s.normal = -s.normal;
    }
    glm::dvec4 base(1.0);
    if (!scene_.textures[material].levels.empty()) {
      const glm::dvec2 uv =
          weights.x * mesh.uvs[p] + weights.y * mesh.uvs[q] + weights.z * mesh.uvs[r];
      base = look_up(scene_.textures[material], uv, level);
    }
    base = glm::dvec4(srgb_to_linear(glm::dvec3(base)), base.w);
    if (!mesh.colours.empty()) {
      const auto linear = [&](std::uint32_t v) {
        const glm::dvec4 colour = glm::dvec4(mesh.colours[v]) / 255.0;
        return glm::dvec4(srgb_to_linear(glm::dvec3(colour)), colour.w);
      };
      base *= weights.x * linear(p) + weights.y * linear(q) + weights.z * linear(r);
    }
    s.albedo = glm::dvec3(base) * srgb_to_linear(glm::dvec3(m.diffuse));
    s.alpha = base.w * static_cast<double>(m.opacity);
    s.emission = srgb_to_linear(glm::dvec3(m.emission));
    s.specular = m.shininess > 0 ? srgb_to_linear(glm::dvec3(m.specular)) : glm::dvec3(0.0);
    s.shininess = static_cast<double>(m.shininess);
    s.reflectance = static_cast<double>(m.reflectance);
    s.metalness = static_cast<double>(m.metalness);
    return s;
  }

  [[nodiscard]] glm::dvec3 from_key(const Surface& s, const glm::dvec3& direction, bool first,
                                    PathNumbers& numbers) const {
    const glm::dvec2 u = numbers.pair(PathNumbers::kKey, first);
    const glm::dvec3 spot(kKeySpread * std::sqrt(u.x) * std::cos(kTurn * u.y),
                          kKeySpread * std::sqrt(u.x) * std::sin(kTurn * u.y), 1.0);
    const glm::dvec3 to_light = glm::normalize(frame_of(to_key_) * spot);
    const double cosine = glm::dot(s.normal, to_light);
    if (cosine <= 0 || glm::dot(s.flat, to_light) <= 0) return glm::dvec3(0.0);
    if (key_ == glm::dvec3(0.0)) return glm::dvec3(0.0);
    bool touched = false;
    if (meet({s.point + kLift * s.flat, to_light}, false, numbers, touched)) return glm::dvec3(0.0);
    glm::dvec3 given = s.albedo * (cosine * (1 - s.metalness));
    if (first && s.shininess > 0) {
      const glm::dvec3 halfway = glm::normalize(to_light - direction);
      given += glm::mix(glm::dvec3(1.0), s.albedo, s.metalness) * s.specular *
               std::pow(std::max(glm::dot(s.normal, halfway), 0.0), s.shininess);
    }
    return given * key_;
  }

  const TracedScene& scene_;
  glm::dmat3 turn_;
  std::vector<glm::dvec3> positions_;  ///< three a triangle, in the world
  std::vector<bool> two_sided_;        ///< of each triangle
  std::optional<RayTree> tree_;
  glm::dvec3 to_key_{0, 0, 1};
  glm::dvec3 key_{0.0};  ///< where paths see no panorama
  glm::dvec3 room_gain_{1.0};
  std::vector<double> room_sums_;  ///< of the panorama's light, pixel by pixel
  glm::dvec3 given_{0.0};          ///< irradiance over pi of the open ground
};

PathTracer::PathTracer(const TracedScene& scene) : scene_(std::make_unique<Scene>(scene)) {}
PathTracer::~PathTracer() = default;

namespace {

/// Calls sample(pixel, ray, numbers) for each path of each pixel.
template <class Sample>
void shoot(const Camera& camera, const glm::dmat4& to_eye, int samples, std::uint64_t seed,
           unsigned jobs, const Sample& sample) {
  const glm::dmat4 to_world = glm::inverse(to_eye);
  const glm::dmat3 turn(to_world);
  parallel_rows(static_cast<std::uint32_t>(camera.height), jobs, [&](std::uint32_t y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t pixel =
          std::size_t{y} * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x);
      for (int i = 0; i < samples; ++i) {
        PathNumbers numbers(pixel, seed, i);
        const glm::dvec2 at = numbers.pair(PathNumbers::kPixel, true) - 0.5;
        const glm::dvec3 direction((x + at.x - camera.cx) / camera.fx,
                                   -(y + at.y - camera.cy) / camera.fy, -1.0);
        sample(pixel, Ray{glm::dvec3(to_world[3]), glm::normalize(turn * direction)}, numbers);
      }
    }
  });
}

TracedPicture empty_picture(const Camera& camera) {
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  return {camera.width, camera.height, std::vector<glm::dvec3>(pixels),
          std::vector<double>(pixels)};
}

}  // namespace

TracedPicture PathTracer::draw(const Camera& camera, const glm::dmat4& to_eye, int samples,
                               std::uint64_t seed, unsigned jobs) const {
  TracedPicture picture = empty_picture(camera);
  shoot(camera, to_eye, samples, seed, jobs,
        [&](std::size_t pixel, const Ray& ray, PathNumbers& numbers) {
          bool touched = false;
          picture.pixels[pixel] += scene_->radiance(ray, numbers, touched) / double(samples);
          picture.model[pixel] += touched ? 1.0 / samples : 0.0;
        });
  return picture;
}

TracedPicture PathTracer::draw_ground(const Camera& camera, const glm::dmat4& to_eye, int samples,
                                      unsigned jobs) const {
  TracedPicture picture = empty_picture(camera);
  shoot(camera, to_eye, samples, 0, jobs, [&](std::size_t pixel, const Ray& ray, PathNumbers&) {
    picture.pixels[pixel] += scene_->ground_alone(ray) / double(samples);
  });
  return picture;
}

}  // namespace modar
