// Two meshes of the same form, from the bundle and from the second reader, measured and drawn
// alike.
#include "bake/check/source/second_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <unistd.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/check/picture/reference_renderer.hpp"
#include "bake/check/picture/visual_check.hpp"
#include "bake/check/verdict.hpp"
#include "bake/export/model_file.hpp"
#include "bake/export/room_models.hpp"
#include "bake/image/resample.hpp"
#include "bake/io/input.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "bake/process/process.hpp"
#include "formats/base/ranges.hpp"

namespace modar {
namespace {

/// Share of triangles that may differ: those that rounding makes flat. Higher: lost parts pass.
constexpr double kMaxCount = 0.03;
constexpr double kFewTriangles = 16;  ///< of flat ones in faces with holes, which area judges
/// Share of area, of the box's volume and of the diagonal. Higher: lost parts pass; lower: rounded
/// positions fail.
constexpr double kMaxShape = 0.01;
/// Mean CIEDE2000 over the pixels that show the model. A person sees 1 to 2 next to each other.
constexpr double kMaxColour = 4.0;
constexpr std::size_t kLarge = 10000;  ///< triangles of a mesh whose creases may be noise
constexpr int kSide = 96;  ///< of a picture, pixels. Larger takes longer, smaller hides small parts

/// A mesh in the bundle's [-1,1], and its materials' pictures.
struct Look {
  TriMesh mesh;
  std::vector<SoftTexture> textures;
};

/// Puts a colour on white paper, by its opacity.
glm::dvec3 on_white(const glm::dvec4& colour) {
  return glm::mix(glm::dvec3(1), glm::dvec3(colour), glm::clamp(colour.a, 0.0, 1.0));
}

void add_material(Look& look, const glm::dvec4& colour, const glm::dvec3& emission,
                  RgbaImage picture, const TextureWrap& wrap) {
  SourceMaterial& material = look.mesh.materials.emplace_back();
  material.diffuse = glm::vec3(on_white(colour));
  material.emission = glm::vec3(emission);
  SoftTexture& texture = look.textures.emplace_back();
  if (picture.pixels.empty()) return;
  for (std::size_t i = 0; i < picture.pixels.size(); i += 4) {
    std::uint8_t* p = &picture.pixels[i];
    const glm::dvec3 paper = on_white(glm::dvec4(p[0], p[1], p[2], p[3]) / 255.0);
    for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>(std::lround(255 * paper[c]));
    p[3] = 255;
  }
  texture.levels = mip_chain(picture, wrap);
  texture.wrap = wrap;
}

void add_corner(TriMesh& mesh, const glm::dvec3& at, const glm::dvec3& normal, const glm::dvec2& uv,
                const glm::dvec3& colour) {
  mesh.positions.push_back(at);
  mesh.normals.push_back(glm::vec3(normal));
  mesh.uvs.push_back(uv);
  mesh.colours.push_back(glm::u8vec4(glm::round(glm::clamp(colour, 0.0, 1.0) * 255.0), 255));
}

Result<Look> look_of(const BundleView& bundle, const ModelRecord& model) {
  Look look;
  const std::vector<GlbImage> images = decoded_textures(bundle);
  for (std::uint32_t m = 0; m < model.material_count; ++m) {
    const MaterialRecord& record = bundle.materials()[model.first_material + m];
    const bool pictured = record.texture != kNone;
    const float gain = pictured ? export_gain(bundle, record.texture) : 1;
    const glm::dvec3 colour(record.diffuse[0] / gain, record.diffuse[1] / gain,
                            record.diffuse[2] / gain);
    add_material(look, glm::dvec4(colour, record.opacity),
                 {record.emission[0], record.emission[1], record.emission[2]},
                 pictured ? images[record.texture].pixels : RgbaImage(),
                 texture_wrap(pictured ? bundle.textures()[record.texture].flags : 0));
  }
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    MODAR_ASSIGN(const DecodedLevel level,
                 decode_level(bundle, bundle.layouts()[model.layout], chunk));
    const auto first = static_cast<std::uint32_t>(look.mesh.positions.size());
    for (std::size_t v = 0; v < level.positions.size(); ++v) {
      add_corner(look.mesh, level.positions[v], level.normals[v],
                 level.uvs.empty() ? glm::dvec2(0) : level.uvs[v],
                 level.colours.empty() ? glm::dvec3(1) : glm::dvec3(level.colours[v]));
    }
    for (std::size_t i = 0; i + 2 < level.indices.size(); i += 3) {
      look.mesh.triangles.push_back(
          {first + level.indices[i], first + level.indices[i + 1], first + level.indices[i + 2]});
      look.mesh.triangle_material.push_back(chunk.material - model.first_material);
    }
  }
  return look;
}

Look look_of(const SecondModel& second, const ModelRecord& model) {
  Look look;
  for (const SecondMaterial& m : second.materials) {
    add_material(look, m.colour, m.emission, m.picture, m.wrap);
  }
  const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
  for (const std::array<SecondCorner, 3>& triangle : second.triangles) {
    const auto first = static_cast<std::uint32_t>(look.mesh.positions.size());
    for (const SecondCorner& corner : triangle) {
      add_corner(look.mesh, (corner.position - center) / model.scale, corner.normal, corner.uv,
                 corner.colour);
    }
    look.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  for (const std::uint32_t m : second.triangle_material) look.mesh.triangle_material.push_back(m);
  return look;
}

/// Corners of a polygon whose triangulations are all looked at; the time grows with their cube.
constexpr std::uint32_t kMostCorners = 32;

/// Cosine to a polygon's normal of triangles that cover others. Lower: wrong cuts pass as bends.
constexpr double kFolded = -0.5;

/// Of a polygon's triangulations, the one whose inner edges are nearest to a surface.
class NearestTriangles {
 public:
  NearestTriangles(std::span<const SecondCorner> corners, const ModelRecord& model,
                   TriangleTree& surface)
      : corners_(corners), count_(corners.size()), best_(count_ * count_), middle_(best_.size()) {
    const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
    glm::dvec3 up(0);
    for (std::size_t i = 2; i < count_; ++i) up += twice_area(0, i - 1, i);
    for (std::size_t step = 2; step < count_; ++step) {
      for (std::size_t i = 0; i + step < count_; ++i) {
        const std::size_t k = i + step;
        Best best;
        for (std::size_t j = i + 1; j < k; ++j) {
          const double off = best_[i * count_ + j] + best_[j * count_ + k];
          const glm::dvec3 area = twice_area(i, j, k);
          const bool folded = glm::dot(area, up) <= kFolded * glm::length(area) * glm::length(up);
          if (off < best.off && !folded) best = {off, j};
        }
        for (const double t : {0.25, 0.5, 0.75}) {
          const glm::dvec3 at = glm::mix(corners[i].position, corners[k].position, t);
          if (step + 1 < count_) best.off += surface.nearest((at - center) / model.scale);
        }
        best_[i * count_ + k] = best.off;
        middle_[i * count_ + k] = best.middle;
      }
    }
  }

  /// Rewrites triangles, unless each triangulation is folded.
  void put(std::array<SecondCorner, 3>* triangles) const {
    if (std::isfinite(best_[count_ - 1])) put(0, count_ - 1, triangles);
  }

 private:
  struct Best {
    double off = std::numeric_limits<double>::infinity();
    std::size_t middle = 0;
  };

  [[nodiscard]] glm::dvec3 twice_area(std::size_t i, std::size_t j, std::size_t k) const {
    return glm::cross(corners_[j].position - corners_[i].position,
                      corners_[k].position - corners_[i].position);
  }

  void put(std::size_t i, std::size_t k, std::array<SecondCorner, 3>*& triangles) const {
    if (k < i + 2) return;
    const std::size_t j = middle_[i * count_ + k];
    *triangles++ = {corners_[i], corners_[j], corners_[k]};
    put(i, j, triangles);
    put(j, k, triangles);
  }

  std::span<const SecondCorner> corners_;
  std::size_t count_;
  std::vector<double> best_;         // of the part of the polygon from corner i to corner k
  std::vector<std::size_t> middle_;  // of its triangle at the edge from i to k
};

/// Cuts polygons that are not flat as the surface is cut: a lost one has its area all the same.
void follow(const TriMesh& surface, const ModelRecord& model, SecondModel& second) {
  // Of many, each changes little.
  if (second.polygons.size() > kLarge || surface.triangles.empty()) return;
  TriangleTree tree(std::span(surface.positions.data(), surface.positions.size()),
                    {surface.triangles.begin(), surface.triangles.end()});
  for (const SecondPolygon& polygon : second.polygons) {
    if (polygon.corners > kMostCorners) continue;
    const std::span corners(&second.polygon_corners[polygon.first_corner], polygon.corners);
    NearestTriangles(corners, model, tree).put(&second.triangles[polygon.first_triangle]);
  }
}

/// Both are drawn without colours where only one knows them.
void forget_colours(Look& look) {
  for (SourceMaterial& material : look.mesh.materials) material = SourceMaterial();
  for (SoftTexture& texture : look.textures) texture = SoftTexture();
  std::fill(look.mesh.colours.begin(), look.mesh.colours.end(), glm::u8vec4(255));
}

struct Measures {
  double area = 0;
  double volume = 0;     ///< signed, of open meshes as seen from the origin
  glm::dvec3 middle{0};  ///< of the area
  double radius = 0;
};

Measures measures_of(const TriMesh& mesh) {
  Measures sum;
  for (const auto& [i, j, k] : mesh.triangles) {
    const glm::dvec3& a = mesh.positions[i];
    const glm::dvec3& b = mesh.positions[j];
    const glm::dvec3& c = mesh.positions[k];
    const double area = glm::length(glm::cross(b - a, c - a)) / 2;
    sum.area += area;
    sum.volume += glm::dot(a, glm::cross(b, c)) / 6;
    sum.middle += area * (a + b + c) / 3.0;
    sum.radius = std::max({sum.radius, glm::length(a), glm::length(b), glm::length(c)});
  }
  sum.middle /= sum.area;
  return sum;
}

/// Mean CIEDE2000 of the pixels that show a model in one of two pictures, over 12 of them.
double colour_distance(const Look& a, const Look& b, double radius) {
  RenderOptions options;
  options.clear_colour = {0.5f, 0.5f, 0.5f, 1.0f};
  Camera camera = default_camera(kSide, kSide);
  radius = std::min(radius, 0.9 * kViewDistance);
  camera.fx = camera.fy =
      0.49 * kSide * std::sqrt(kViewDistance * kViewDistance / (radius * radius) - 1);
  double sum = 0;
  double count = 0;
  for (const glm::dvec3& view : view_directions()) {
    const RgbaImage p = render_reference(a.mesh, a.textures, camera, view_from(view), options);
    const RgbaImage q = render_reference(b.mesh, b.textures, camera, view_from(view), options);
    for (std::size_t i = 0; i < p.pixels.size(); i += 4) {
      const auto is_clear = [i](const RgbaImage& image) {
        return std::all_of(&image.pixels[i], &image.pixels[i + 3],
                           [](std::uint8_t value) { return value == 128; });
      };
      if (is_clear(p) && is_clear(q)) continue;
      sum += ciede2000(lab_of(&p.pixels[i]), lab_of(&q.pixels[i]));
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

/// Fills `second`. Answers a reason where a part of the file is not known.
std::string ask(const std::string& reader, const std::string& path, double crease,
                SecondModel& second) {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/model";
  if (run_process({{reader, path, std::to_string(crease), file}, {}, ""}) == 0) {
    const auto bytes = read_file(file, std::numeric_limits<std::size_t>::max());
    if (bytes && read_second(*bytes, second)) {
      return second.knows_colours ? "" : "the second reader does not know its colours";
    }
  }
  second.triangles.clear();
  return "the second reader does not know it";
}

}  // namespace

Result<void> check_second(const BundleView& bundle, std::uint32_t index, SecondModel second,
                          const IssueSink& sink) {
  const ModelRecord& model = bundle.models()[index];
  const auto tell = [&](WorkstationRule rule, const std::string& detail) {
    const auto* place = reinterpret_cast<const std::byte*>(&model);
    sink(Issue{&workstation_issue_kind(rule),
               "model '" + std::string(bundle.name(model.name)) + "'",
               static_cast<std::uint64_t>(place - bundle.bytes().data()), detail});
  };
  MODAR_ASSIGN(Look ours, look_of(bundle, model));
  follow(ours.mesh, model, second);
  Look theirs = look_of(second, model);
  const auto count = static_cast<double>(ours.mesh.triangles.size());
  const auto other = static_cast<double>(theirs.mesh.triangles.size());
  // It may have more: translucent triangles are cut for their order.
  if (count + kFewTriangles < (1 - kMaxCount) * other) {
    tell(WorkstationRule::kSourceCounts,
         with_numbers("{} triangles, a second reader's are {}",
                      {ours.mesh.triangles.size(), theirs.mesh.triangles.size()}));
  }
  const Measures a = measures_of(ours.mesh);
  const Measures b = measures_of(theirs.mesh);
  const auto shape = [&](const char* what, double x, double y, double unit) {
    if (std::fabs(x - y) <= kMaxShape * unit) return;
    tell(WorkstationRule::kSourceSurface, std::string("its ") + what + " is " + std::to_string(x) +
                                              ", a second reader's is " + std::to_string(y));
  };
  shape("area", a.area, b.area, b.area);
  shape("volume", a.volume, b.volume, std::max(std::fabs(b.volume), b.area * b.radius / 6));
  shape("distance from the middle", 0, glm::length(a.middle - b.middle), b.radius);
  if (!second.knows_colours) {
    forget_colours(ours);
    forget_colours(theirs);
  }
  const double off = colour_distance(ours, theirs, std::max(a.radius, b.radius));
  if (!(off <= kMaxColour)) {
    tell(WorkstationRule::kSourceColour,
         "it differs from a second reader's by " + std::to_string(off) +
             " (CIEDE2000, mean of 12 views; at most " + std::to_string(kMaxColour) + ")");
  }
  return {};
}

Result<void> check_second(const BundleView& bundle, const BakeRequest& request,
                          const std::string& reader, const IssueSink& sink) {
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::string name(bundle.name(bundle.models()[m].name));
    const auto asked = ranges::find(request.models, name, &ModelRequest::name);
    if (asked == request.models.end()) continue;  // SOURCE_MISSING reports it
    std::string why = "the program '" + reader + "' of the laboratory is not installed";
    std::vector<Issue> found;
    // Creases of a large mesh may be noise, which the bake smooths: either is right.
    for (const double crease : {request.crease_degrees(), 180.0}) {
      if (::access(reader.c_str(), X_OK) != 0) break;
      SecondModel second;
      why = ask(reader, asked->path, crease, second);
      if (second.triangles.empty()) break;
      found.clear();
      const bool reduced = request.repairs() || (request.most_triangles != 0 &&
                                                 second.triangles.size() > request.most_triangles);
      MODAR_TRY(check_second(bundle, m, second, [&](const Issue& issue) {
        const auto& colour = workstation_issue_kind(WorkstationRule::kSourceColour);
        if (!reduced || issue.kind == &colour) found.push_back(issue);
      }));
      if (found.empty() || second.triangles.size() < kLarge) break;
    }
    for (const Issue& issue : found) sink(issue);
    if (why.empty()) continue;
    const auto* place = reinterpret_cast<const std::byte*>(&bundle.models()[m]);
    sink(Issue{&workstation_issue_kind(WorkstationRule::kSourceReader), "model '" + name + "'",
               static_cast<std::uint64_t>(place - bundle.bytes().data()), why});
  }
  return {};
}

}  // namespace modar
