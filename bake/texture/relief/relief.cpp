// Goes over the texels of each triangle with a normal map, and shades them twice.
#include "bake/texture/relief/relief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "bake/process/process.hpp"
#include "formats/base/colour.hpp"
#include "formats/base/parallel.hpp"
#include "formats/base/path.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

/// Largest change of a stored colour. Higher matches the neutral room better and is more wrong in
/// other light.
constexpr float kMostRelief = 0.3F;
/// Repeats of a picture over all triangles that are sampled; the rest is skipped evenly. More take
/// time, fewer are less exact.
constexpr double kMostRepeats = 8;
/// Tiles that one triangle may span: what repeats more often shows no relief.
constexpr double kMostTiles = 256;

/// The neutral room in a model's space, as brightness.
class ReliefLight {
 public:
  explicit ReliefLight(const glm::dquat& stands) : to_room_(glm::mat3_cast(stands)) {
    const RoomLight room = neutral_room();
    key_direction_ = glm::normalize(room.direction);
    key_ = luminance(room.key.r, room.key.g, room.key.b);
    for (std::size_t i = 0; i < sky_.size(); ++i) {
      sky_[i] = luminance(room.sky[i].r, room.sky[i].g, room.sky[i].b);
    }
  }

  /// What the device multiplies a stored colour with where a surface looks along `normal`: see
  /// encode() in shaders/model.vert.
  [[nodiscard]] float factor(const glm::vec3& normal) const {
    const glm::vec3 n = to_room_ * normal;
    const float sky = sky_[0] + sky_[1] * n.y + sky_[2] * n.z + sky_[3] * n.x +
                      sky_[4] * n.x * n.y + sky_[5] * n.y * n.z + sky_[6] * (3 * n.z * n.z - 1) +
                      sky_[7] * n.z * n.x + sky_[8] * (n.x * n.x - n.y * n.y);
    const float light = std::max(sky, 0.0F) + key_ * std::max(glm::dot(n, key_direction_), 0.0F);
    return 1.05F * std::sqrt(light) - 0.05F * light;
  }

 private:
  glm::mat3 to_room_;
  glm::vec3 key_direction_{0.0F, 0.0F, 1.0F};
  float key_ = 0;
  std::array<float, 9> sky_{};
};

/// A normal map's vectors at a size near that of the picture that they change.
class NormalField {
 public:
  /// texels: of the map that one texel of the picture spans, across and down. Means of vectors:
  /// what light sees of a patch is nearly what their mean does.
  NormalField(const RgbaImage& map, glm::dvec2 texels, const NormalMap& normal)
      : wrap_(normal.wrap) {
    const auto step = [](double span, std::uint32_t side) {
      return static_cast<std::uint32_t>(
          std::clamp(std::floor(span + 1e-6), 1.0, static_cast<double>(side)));
    };
    const std::uint32_t across = step(texels.x, map.width);
    const std::uint32_t down = step(texels.y, map.height);
    width_ = map.width / across;
    height_ = map.height / down;
    vectors_.resize(std::size_t{width_} * height_);
    for (std::uint32_t y = 0; y < height_; ++y) {
      for (std::uint32_t x = 0; x < width_; ++x) {
        glm::vec3 sum(0.0F);
        for (std::uint32_t j = 0; j < down; ++j) {
          const std::size_t row = std::size_t{y * down + j} * map.width;
          for (std::uint32_t i = 0; i < across; ++i) {
            const std::uint8_t* rgb = &map.pixels[4 * (row + x * across + i)];
            sum += glm::vec3(rgb[0], rgb[1], rgb[2]);
          }
        }
        // 128 is straight on: exporters write it, and 127.5 is no byte.
        const glm::vec3 mean = sum / float(across * down);
        vectors_[std::size_t{y} * width_ + x] =
            glm::vec3(normal.scale, normal.scale, 1.0F) * (mean - 128.0F) / 127.0F;
      }
    }
  }

  /// Whether it looks straight on everywhere.
  [[nodiscard]] bool flat() const {
    return std::all_of(vectors_.begin(), vectors_.end(),
                       [](const glm::vec3& v) { return v.x == 0 && v.y == 0; });
  }

  /// Between its four neighbours.
  [[nodiscard]] glm::vec3 at(glm::dvec2 uv) const {
    const auto [x0, x1, fx] = neighbours(uv.x, width_, wrap_[0]);
    const auto [y0, y1, fy] = neighbours(uv.y, height_, wrap_[1]);
    const auto vector = [&](std::size_t x, std::size_t y) { return vectors_[y * width_ + x]; };
    return glm::mix(glm::mix(vector(x0, y0), vector(x1, y0), fx),
                    glm::mix(vector(x0, y1), vector(x1, y1), fx), fy);
  }

 private:
  static std::tuple<std::size_t, std::size_t, float> neighbours(double at, std::uint32_t side,
                                                                Wrap wrap) {
    const double texel = at * side - 0.5;
    const double low = std::floor(texel);
    const auto first = static_cast<std::int64_t>(low);
    return {static_cast<std::size_t>(wrapped(first, side, wrap)),
            static_cast<std::size_t>(wrapped(first + 1, side, wrap)),
            static_cast<float>(texel - low)};
  }

  TextureWrap wrap_;
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 0;
  std::vector<glm::vec3> vectors_;
};

/// Materials that one picture serves.
struct ReliefGroup {
  std::string colour;
  NormalMap normal;
  std::vector<std::uint32_t> materials;
};

std::vector<ReliefGroup> groups_of(const TriMesh& mesh) {
  std::vector<bool> shown(mesh.materials.size(), false);
  for (const std::uint32_t material : mesh.triangle_material) shown[material] = true;
  std::vector<ReliefGroup> groups;
  for (std::uint32_t m = 0; m < mesh.materials.size(); ++m) {
    const SourceMaterial& material = mesh.materials[m];
    if (!shown[m] || material.normal.path.empty()) continue;
    const auto same = [&](const ReliefGroup& group) {
      return group.colour == material.diffuse_map && group.normal == material.normal;
    };
    auto found = std::find_if(groups.begin(), groups.end(), same);
    if (found == groups.end()) {
      groups.push_back({material.diffuse_map, material.normal, {}});
      found = groups.end() - 1;
    }
    found->materials.push_back(m);
  }
  return groups;
}

/// Directions of rising u at the vertices, as MikkTSpace has them: sums over the triangles around,
/// by their angles, apart for those whose uvs are mirrored. Unit length, or zero.
struct Tangents {
  std::array<std::vector<glm::vec3>, 2> of;  ///< [0]: mirrored
};

glm::vec3 unit(const glm::vec3& v) {
  const float length = glm::length(v);
  return length > 0 ? v / length : v;
}

/// A triangle's corners on a picture, v down.
struct UvTriangle {
  std::array<glm::dvec2, 3> corners;
  double area2 = 0;  ///< twice the signed area; above 0: mirrored, as v points down
  [[nodiscard]] bool mirrored() const { return area2 > 0; }

  UvTriangle(const TriMesh& mesh, std::size_t triangle) {
    for (std::size_t i = 0; i < 3; ++i) corners[i] = mesh.uvs[mesh.triangles[triangle][i]];
    const glm::dvec2 a = corners[1] - corners[0];
    const glm::dvec2 b = corners[2] - corners[0];
    area2 = a.x * b.y - a.y * b.x;
  }
};

/// The direction of rising u over a triangle; zero where its uvs span nothing.
glm::dvec3 tangent_of(const TriMesh& mesh, std::size_t triangle, const UvTriangle& uv) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const glm::dvec3 along = mesh.positions[b] - mesh.positions[a];
  const glm::dvec3 across = mesh.positions[c] - mesh.positions[a];
  const glm::dvec3 tangent =
      along * (uv.corners[2].y - uv.corners[0].y) - across * (uv.corners[1].y - uv.corners[0].y);
  const double length = glm::length(tangent);
  return uv.area2 != 0 && length > 0 ? tangent * ((uv.area2 < 0 ? -1 : 1) / length)
                                     : glm::dvec3(0.0);
}

/// The angle at a corner of a triangle, radians.
double angle_at(const TriMesh& mesh, std::size_t triangle, std::size_t corner) {
  const auto& t = mesh.triangles[triangle];
  const glm::dvec3& at = mesh.positions[t[corner]];
  const glm::dvec3 a = mesh.positions[t[(corner + 1) % 3]] - at;
  const glm::dvec3 b = mesh.positions[t[(corner + 2) % 3]] - at;
  const double lengths = glm::length(a) * glm::length(b);
  return lengths > 0 ? std::acos(std::clamp(glm::dot(a, b) / lengths, -1.0, 1.0)) : 0.0;
}

Tangents tangents_of(const TriMesh& mesh, const std::vector<bool>& wanted) {
  Tangents tangents;
  for (auto& of : tangents.of) of.assign(mesh.positions.size(), glm::vec3(0.0F));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!wanted[mesh.triangle_material[t]]) continue;
    const UvTriangle uv(mesh, t);
    const glm::dvec3 tangent = tangent_of(mesh, t, uv);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = mesh.triangles[t][i];
      const glm::dvec3 normal(mesh.normals[v]);
      const glm::dvec3 level = tangent - normal * glm::dot(normal, tangent);
      const double length = glm::length(level);
      if (!(length > 0)) continue;
      tangents.of[uv.mirrored() ? 0 : 1][v] += glm::vec3(level * (angle_at(mesh, t, i) / length));
    }
  }
  for (auto& of : tangents.of) {
    for (glm::vec3& tangent : of) tangent = unit(tangent);
  }
  return tangents;
}

/// Sums of factors at the texels of a picture.
struct FactorSums {
  FactorSums(std::uint32_t across, std::uint32_t down)
      : width(across),
        height(down),
        sums(std::size_t{across} * down, 0.0F),
        counts(sums.size(), 0) {}

  std::uint32_t width;
  std::uint32_t height;
  std::vector<float> sums;
  std::vector<std::uint16_t> counts;
};

/// At half the size, rounded up.
FactorSums halved(const FactorSums& fine) {
  FactorSums coarse((fine.width + 1) / 2, (fine.height + 1) / 2);
  for (std::uint32_t y = 0; y < fine.height; ++y) {
    for (std::uint32_t x = 0; x < fine.width; ++x) {
      const std::size_t from = std::size_t{y} * fine.width + x;
      if (fine.counts[from] == 0) continue;
      const std::size_t to = std::size_t{y / 2} * coarse.width + x / 2;
      coarse.sums[to] += fine.sums[from] / fine.counts[from];
      ++coarse.counts[to];
    }
  }
  return coarse;
}

/// Means of all texels. Those without any, at the edges of the visible part, have that of the
/// smallest square around them that has one: filters mix them in.
std::vector<float> means_of(const FactorSums& finest) {
  std::vector<FactorSums> levels = {finest};
  while (levels.back().width > 1 || levels.back().height > 1)
    levels.push_back(halved(levels.back()));
  std::vector<float> means(finest.sums.size(), 1.0F);
  for (std::uint32_t y = 0; y < finest.height; ++y) {
    for (std::uint32_t x = 0; x < finest.width; ++x) {
      for (std::size_t l = 0; l < levels.size(); ++l) {
        const std::size_t at = std::size_t{y >> l} * levels[l].width + (x >> l);
        if (levels[l].counts[at] == 0) continue;
        means[std::size_t{y} * finest.width + x] = levels[l].sums[at] / levels[l].counts[at];
        break;
      }
    }
  }
  return means;
}

/// Adds what triangles of one group do to rows [first, end) of the picture.
class ReliefRows {
 public:
  ReliefRows(const TriMesh& mesh, const Tangents& tangents, const NormalField& field,
             const glm::dmat3& to_map, const ReliefLight& light, FactorSums& sums)
      : mesh_(mesh),
        tangents_(tangents),
        field_(field),
        to_map_(to_map),
        light_(light),
        sums_(sums) {}

  /// every: one tile of this many is looked at.
  void add(std::size_t triangle, std::uint32_t every, std::uint32_t first, std::uint32_t end) {
    const UvTriangle uv(mesh_, triangle);
    if (uv.area2 == 0) return;
    glm::dvec2 low = glm::min(glm::min(uv.corners[0], uv.corners[1]), uv.corners[2]);
    glm::dvec2 high = glm::max(glm::max(uv.corners[0], uv.corners[1]), uv.corners[2]);
    // Also false where a corner is no number.
    if (!(high.x - low.x <= kMostTiles && high.y - low.y <= kMostTiles)) return;
    const TextureWrap wrap =
        texture_wrap(mesh_.materials[mesh_.triangle_material[triangle]].beyond);
    // All that is beyond the edge shows the texels at it, which are shaded as on its inner side.
    for (int i = 0; i < 2; ++i) {
      if (wrap[static_cast<std::size_t>(i)] != Wrap::kClamp) continue;
      low[i] = 0;
      high[i] = 0;
    }
    const glm::dvec2 tile = glm::floor(low);
    const auto columns = static_cast<std::int64_t>(std::floor(high.x) - tile.x);
    const auto rows = static_cast<std::int64_t>(std::floor(high.y) - tile.y);
    for (std::int64_t y = 0; y <= rows; ++y) {
      for (std::int64_t x = 0; x <= columns; ++x) {
        // A hash (Knuth's): triangles and tiles come in regular orders.
        const auto number =
            static_cast<std::uint32_t>(triangle + static_cast<std::size_t>(x + 257 * y));
        if ((number * 2654435761U >> 8) % every != 0) continue;
        add_tile(triangle, uv, tile + glm::dvec2(x, y), wrap, first, end);
      }
    }
  }

 private:
  /// The part of a triangle on one repeat of the picture.
  void add_tile(std::size_t triangle, const UvTriangle& uv, glm::dvec2 tile,
                const TextureWrap& wrap, std::uint32_t first, std::uint32_t end) {
    const glm::dvec2 size(sums_.width, sums_.height);
    std::array<glm::dvec2, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = uv.corners[i] - tile;
    double area2 = uv.area2 * size.x * size.y;
    for (int axis = 0; axis < 2; ++axis) {
      if (wrap[static_cast<std::size_t>(axis)] != Wrap::kMirror || std::fmod(tile[axis], 2) == 0) {
        continue;
      }
      for (glm::dvec2& corner : p) corner[axis] = 1 - corner[axis];
      area2 = -area2;
    }
    for (glm::dvec2& corner : p) corner = corner * size - 0.5;
    const auto span = [&](int axis, std::uint32_t from, std::uint32_t to) {
      const double least = std::min({p[0][axis], p[1][axis], p[2][axis]});
      const double most = std::max({p[0][axis], p[1][axis], p[2][axis]});
      return std::pair(std::max(std::ceil(least), double(from)),
                       std::min(std::floor(most), double(to) - 1));
    };
    const auto [top, bottom] = span(1, first, end);
    const auto [left, right] = span(0, 0, sums_.width);
    if (!(top <= bottom && left <= right)) return;
    const auto cross = [](const glm::dvec2& a, const glm::dvec2& b) {
      return a.x * b.y - a.y * b.x;
    };
    for (double y = top; y <= bottom; ++y) {
      for (double x = left; x <= right; ++x) {
        const glm::dvec2 at(x, y);
        const double b = cross(at - p[0], p[2] - p[0]) / area2;
        const double c = cross(p[1] - p[0], at - p[0]) / area2;
        if (b < 0 || c < 0 || b + c > 1) continue;
        const std::size_t texel =
            static_cast<std::size_t>(y) * sums_.width + static_cast<std::size_t>(x);
        if (sums_.counts[texel] == 0xFFFF) continue;
        ++sums_.counts[texel];
        sums_.sums[texel] += factor(triangle, uv, {1 - b - c, b, c});
      }
    }
  }

  [[nodiscard]] float factor(std::size_t triangle, const UvTriangle& uv,
                             const glm::dvec3& weights) const {
    glm::vec3 normal(0.0F);
    glm::vec3 tangent(0.0F);
    glm::dvec2 place(0.0);
    float before = 0;  // the device shades vertices, and goes from one to the other in a line
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t v = mesh_.triangles[triangle][static_cast<std::size_t>(i)];
      const auto weight = static_cast<float>(weights[i]);
      normal += weight * mesh_.normals[v];
      tangent += weight * tangents_.of[uv.mirrored() ? 0 : 1][v];
      place += weights[i] * uv.corners[static_cast<std::size_t>(i)];
      before += weight * light_.factor(unit(mesh_.normals[v]));
    }
    const glm::vec3 map = field_.at(glm::dvec2(to_map_ * glm::dvec3(place, 1.0)));
    // Green points to the picture's top, where v is least.
    const glm::vec3 up = glm::cross(normal, tangent) * (uv.mirrored() ? -1.0F : 1.0F);
    const glm::vec3 turned = map.x * tangent + map.y * up + map.z * normal;
    const glm::vec3 straight = unit(normal);
    const float after = light_.factor(glm::dot(turned, turned) > 0 ? unit(turned) : straight);
    return before > 0 ? std::clamp(after / before, 1 - kMostRelief, 1 + kMostRelief) : 1.0F;
  }

  const TriMesh& mesh_;
  const Tangents& tangents_;
  const NormalField& field_;
  const glm::dmat3& to_map_;
  const ReliefLight& light_;
  FactorSums& sums_;
};

/// White is this many texels above black where an MTL file's bump map states no factor: a
/// convention of this bake, as no format says in which unit heights are.
constexpr float kHeightTexels = 4;

/// Heights are grey; most texels of a normal map look straight on, which is blue.
bool holds_heights(const RgbaImage& map) {
  std::uint64_t red = 0;
  std::uint64_t blue = 0;
  for (std::size_t p = 0; p < map.pixels.size(); p += 4) {
    red += map.pixels[p];
    blue += map.pixels[p + 2];
  }
  return blue < red + 32 * (map.pixels.size() / 4);
}

/// Heights as a normal map; the picture repeats.
RgbaImage normals_of_heights(const RgbaImage& heights) {
  RgbaImage normals = heights;
  const auto height = [&](std::uint32_t x, std::uint32_t y) {
    return float(heights.pixels[4 * (std::size_t{y} * heights.width + x)]) / 255;
  };
  for (std::uint32_t y = 0; y < heights.height; ++y) {
    const std::uint32_t above = y == 0 ? heights.height - 1 : y - 1;
    const std::uint32_t below = (y + 1) % heights.height;
    for (std::uint32_t x = 0; x < heights.width; ++x) {
      const std::uint32_t left = x == 0 ? heights.width - 1 : x - 1;
      const std::uint32_t right = (x + 1) % heights.width;
      const glm::vec3 normal = unit({kHeightTexels / 2 * (height(left, y) - height(right, y)),
                                     kHeightTexels / 2 * (height(x, below) - height(x, above)), 1});
      for (int i = 0; i < 3; ++i) {
        normals.pixels[4 * (std::size_t{y} * heights.width + x) + static_cast<std::size_t>(i)] =
            static_cast<std::uint8_t>(std::lround(128 + 127 * normal[i]));
      }
    }
  }
  return normals;
}

Result<RgbaImage> read_normals(const NormalMap& normal) {
  MODAR_ASSIGN(RgbaImage map, read_texture(normal.path, Colours::kStored));
  if (normal.may_be_heights && holds_heights(map)) return normals_of_heights(map);
  return map;
}

/// Texels of the normal map that one texel of a picture of this size spans, across and down.
glm::dvec2 spanned(const RgbaImage& map, const NormalMap& normal, const RgbaImage& picture) {
  const glm::dvec2 across = glm::dvec2(normal.uv[0]) / double(picture.width);
  const glm::dvec2 down = glm::dvec2(normal.uv[1]) / double(picture.height);
  return glm::max(glm::abs(across), glm::abs(down)) * glm::dvec2(map.width, map.height);
}

/// White, as large as a map, with no side above `max_side`.
RgbaImage white_picture(const RgbaImage& map, std::uint32_t max_side) {
  const double scale = std::min(1.0, double(max_side) / std::max(map.width, map.height));
  const auto side = [&](std::uint32_t whole) {
    return static_cast<std::uint32_t>(std::max(1.0, std::round(whole * scale)));
  };
  RgbaImage white{side(map.width), side(map.height), {}};
  white.pixels.assign(std::size_t{4} * white.width * white.height, 255);
  return white;
}

/// The colours that relief is drawn on: white if none. As large as the normal map
/// where that is larger; else unchanged; no side above `max_side`.
Result<RgbaImage> read_colours(const ReliefGroup& group, const RgbaImage& map,
                               const ReliefOptions& options, std::uint32_t beyond) {
  if (group.colour.empty()) return white_picture(map, options.max_side);
  MODAR_ASSIGN(RgbaImage image, read_texture(group.colour));
  const glm::dvec2 span = spanned(map, group.normal, image);
  double scale = std::max({1.0, std::min(span.x, span.y)});
  scale = std::min(scale, double(options.max_side) / std::max(image.width, image.height));
  const auto side = [&](std::uint32_t whole) {
    return static_cast<std::uint32_t>(std::max(1.0, std::round(whole * scale)));
  };
  if (scale == 1.0) return image;
  return resize(image, side(image.width), side(image.height), {texture_wrap(beyond), options.jobs});
}

/// Draws one group's picture; nothing where its map is flat.
class ReliefPainter {
 public:
  ReliefPainter(const TriMesh& mesh, const ReliefOptions& options)
      : mesh_(mesh), options_(options), light_(options.stands) {}

  /// The picture, the factor for its colours, and false if it is unchanged.
  Result<bool> paint(const ReliefGroup& group, const Tangents& tangents, RgbaImage& image,
                     float& headroom) const {
    MODAR_ASSIGN(const RgbaImage map, read_normals(group.normal));
    const std::uint32_t beyond = mesh_.materials[group.materials.front()].beyond;
    MODAR_ASSIGN(image, read_colours(group, map, options_, beyond));
    const NormalField field(map, spanned(map, group.normal, image), group.normal);
    if (field.flat()) return false;
    const std::vector<std::uint32_t> triangles = triangles_of(group);
    double repeats = 0;
    for (const std::uint32_t t : triangles) repeats += std::fabs(UvTriangle(mesh_, t).area2) / 2;
    const double every = std::clamp(std::floor(repeats / kMostRepeats), 1.0, 1e6);
    FactorSums sums(image.width, image.height);
    const std::uint32_t bands = std::clamp(options_.jobs, 1U, image.height);
    parallel_rows(bands, options_.jobs, [&](std::uint32_t band) {
      ReliefRows rows(mesh_, tangents, field, group.normal.uv, light_, sums);
      const auto edge = [&](std::uint64_t b) {
        return static_cast<std::uint32_t>(b * image.height / bands);
      };
      for (const std::uint32_t t : triangles) {
        rows.add(t, static_cast<std::uint32_t>(every), edge(band), edge(band + 1));
      }
    });
    return apply(means_of(sums), image, headroom);
  }

 private:
  [[nodiscard]] std::vector<std::uint32_t> triangles_of(const ReliefGroup& group) const {
    std::vector<bool> ours(mesh_.materials.size(), false);
    for (const std::uint32_t material : group.materials) ours[material] = true;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (ours[mesh_.triangle_material[t]]) triangles.push_back(t);
    }
    return triangles;
  }

  /// Where some gets brighter than white, all is divided by headroom.
  static bool apply(const std::vector<float>& factors, RgbaImage& image, float& headroom) {
    float most = 255.0F;
    const auto drawn = [&](std::size_t p) { return float(image.pixels[p]) * factors[p / 4]; };
    for (std::size_t p = 0; p < image.pixels.size(); ++p) {
      if (p % 4 != 3) most = std::max(most, drawn(p));
    }
    headroom = most / 255.0F;
    bool changed = headroom > 1.0F;
    for (std::size_t p = 0; p < image.pixels.size(); ++p) {
      if (p % 4 == 3) continue;
      const std::uint8_t before = image.pixels[p];
      image.pixels[p] = static_cast<std::uint8_t>(std::lround(drawn(p) / headroom));
      changed = changed || image.pixels[p] != before;
    }
    return changed;
  }

  const TriMesh& mesh_;
  const ReliefOptions& options_;
  ReliefLight light_;
};

/// A made picture, and what kept those that it was made of.
struct KeptPicture {
  TemporaryFolder folder;
  std::shared_ptr<const void> before;
};

Result<void> keep_picture(const ReliefGroup& group, const RgbaImage& image, float headroom,
                          TriMesh& mesh) {
  const std::string& name = group.colour.empty() ? group.normal.path : group.colour;
  auto kept = std::make_shared<KeptPicture>();
  kept->before = mesh.materials[group.materials.front()].keeper;
  const std::string path = kept->folder.path() + "/" + file_stem(name) + ".png";
  MODAR_TRY(write_png(image, path));
  for (const std::uint32_t m : group.materials) {
    mesh.materials[m].diffuse_map = path;
    mesh.materials[m].diffuse *= headroom;
    mesh.materials[m].keeper = kept;
  }
  return {};
}

}  // namespace

Result<void> draw_relief(TriMesh& mesh, const ReliefOptions& options, Report& report) {
  const std::vector<ReliefGroup> groups = groups_of(mesh);
  if (groups.empty() || mesh.uvs.empty() || mesh.normals.empty()) return {};
  StageTimer timer(report, "relief");
  std::vector<bool> wanted(mesh.materials.size(), false);
  for (const ReliefGroup& group : groups) {
    for (const std::uint32_t material : group.materials) wanted[material] = true;
  }
  const Tangents tangents = tangents_of(mesh, wanted);
  const ReliefPainter painter(mesh, options);
  std::size_t drawn = 0;
  std::uint64_t texels = 0;
  for (const ReliefGroup& group : groups) {
    RgbaImage image;
    float headroom = 1.0F;
    const Result<bool> changed = painter.paint(group, tangents, image, headroom);
    if (!changed) {
      // Where it is the colour, whoever reads it for the bundle says so.
      const Error& error = changed.error();
      if (error.where == group.colour) continue;
      report.diagnostics.push_back(
          {error.code, DiagnosticSeverity::kWarning, error.where, 0, error.cause, error.cure});
    } else if (*changed) {
      MODAR_TRY(keep_picture(group, image, headroom, mesh));
      drawn += group.materials.size();
      texels += std::uint64_t{image.width} * image.height;
    }
  }
  timer.done(mesh.triangles.size(), texels);
  if (drawn == 0) return {};
  report.diagnostics.push_back({"model.normal-map", DiagnosticSeverity::kInfo, mesh.name, 0,
                                std::to_string(drawn) +
                                    (drawn == 1 ? " material has" : " materials have") +
                                    " a normal map; the base colour shows it as relief in the "
                                    "light of a neutral room",
                                ""});
  return {};
}

}  // namespace modar
