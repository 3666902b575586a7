// Samples maps at faces and groups faces by what they found.
#include "bake/import/gltf/gltf_metal_maps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <glm/geometric.hpp>

#include "bake/image/image.hpp"
#include "bake/import/reflection.hpp"

namespace modar {
namespace {

/// Texels of a side that faces are sampled from. More costs time, fewer blur small parts.
constexpr std::uint32_t kSampledSide = 256;
/// Materials that one becomes at most. Each costs a draw call a chunk.
constexpr std::size_t kMostGroups = 4;
/// Least rms of metalness and roughness about a group's mean that is seen. Lower splits more.
constexpr double kVisible = 0.08;
/// Steps of metalness and of roughness in which faces are counted.
constexpr std::uint32_t kSteps = 33;
/// Rows of the triangle of samples that a face gets. More costs time, fewer miss small parts.
constexpr int kSampleRows = 4;
constexpr std::size_t kSamples = kSampleRows * (kSampleRows + 1) / 2;

/// Roughness and metalness of a map, row by row from the top.
struct SmallMap {
  std::uint32_t width = 1;
  std::uint32_t height = 1;
  std::vector<glm::dvec2> texels{glm::dvec2(1.0)};
  glm::dvec2 mean{1.0};

  [[nodiscard]] glm::dvec2 at(const glm::dvec2& uv) const {
    const auto index = [](double t, std::uint32_t size) {
      const double place = (t - std::floor(t)) * size;
      return place >= 0 ? std::min(static_cast<std::uint32_t>(place), size - 1) : 0;
    };
    return texels[std::size_t{index(1 - uv.y, height)} * width + index(uv.x, width)];
  }
};

SmallMap shrunk(const RgbaImage& image) {
  SmallMap map;
  const std::uint32_t step = (std::max(image.width, image.height) - 1) / kSampledSide + 1;
  map.width = (image.width - 1) / step + 1;
  map.height = (image.height - 1) / step + 1;
  std::vector<glm::dvec3> sums(std::size_t{map.width} * map.height, glm::dvec3(0.0));
  glm::dvec3 all(0.0);
  const std::uint8_t* pixel = image.pixels.data();
  for (std::uint32_t y = 0; y < image.height; ++y) {
    glm::dvec3* row = &sums[std::size_t{y / step} * map.width];
    for (std::uint32_t x = 0; x < image.width; ++x, pixel += 4) {
      row[x / step] += glm::dvec3(pixel[1], pixel[2], 1);
    }
  }
  map.texels.clear();
  for (const glm::dvec3& sum : sums) {
    map.texels.push_back(glm::dvec2(sum) / (255 * sum.z));
    all += sum;
  }
  map.mean = glm::dvec2(all) / (255 * all.z);
  return map;
}

/// Area of the faces by what the map says of them.
class FaceGroups {
 public:
  FaceGroups() : area_(std::size_t{kSteps} * kSteps, 0.0), group_(area_.size(), 0) {}

  static std::uint32_t cell(const glm::dvec2& found) {
    const auto step = [](double t) {
      return static_cast<std::uint32_t>(std::lround(std::clamp(t, 0.0, 1.0) * (kSteps - 1)));
    };
    return step(found.y) * kSteps + step(found.x);
  }
  void add(std::uint32_t cell, double area) { area_[cell] += area; }

  /// Means of groups: one more where the map differs most from them, until nobody sees it.
  std::vector<glm::dvec2> means() {
    std::vector<glm::dvec2> centres;
    for (;;) {
      const std::uint32_t farthest = assign(centres);
      if (centres.size() == kMostGroups || (!centres.empty() && rms_ <= kVisible)) return centres;
      centres.push_back(centres.empty() ? glm::dvec2(0.5) : middle(farthest));
      for (int round = 0; round < 8; ++round) improve(centres);
    }
  }
  [[nodiscard]] std::uint32_t group(std::uint32_t cell) const { return group_[cell]; }

 private:
  static glm::dvec2 middle(std::uint32_t cell) {
    return glm::dvec2(cell % kSteps, cell / kSteps) / (kSteps - 1.0);
  }

  /// The nearest centre of each cell. Returns the cell that is worst off.
  std::uint32_t assign(const std::vector<glm::dvec2>& centres) {
    std::uint32_t farthest = 0;
    double most = -1;
    double sum = 0;
    double all = 0;
    for (std::uint32_t c = 0; c < area_.size() && !centres.empty(); ++c) {
      double nearest = 1e9;
      for (std::uint32_t g = 0; g < centres.size(); ++g) {
        const glm::dvec2 off = middle(c) - centres[g];
        if (glm::dot(off, off) >= nearest) continue;
        nearest = glm::dot(off, off);
        group_[c] = g;
      }
      sum += area_[c] * nearest;
      all += area_[c];
      if (area_[c] * nearest <= most) continue;
      most = area_[c] * nearest;
      farthest = c;
    }
    rms_ = all > 0 ? std::sqrt(sum / all) : 0;
    return farthest;
  }

  void improve(std::vector<glm::dvec2>& centres) {
    assign(centres);
    std::vector<glm::dvec3> sums(centres.size(), glm::dvec3(0.0));
    for (std::uint32_t c = 0; c < area_.size(); ++c) {
      sums[group_[c]] += area_[c] * glm::dvec3(middle(c), 1.0);
    }
    for (std::size_t g = 0; g < centres.size(); ++g) {
      if (sums[g].z > 0) centres[g] = glm::dvec2(sums[g]) / sums[g].z;
    }
  }

  std::vector<double> area_;
  std::vector<std::uint32_t> group_;
  double rms_ = 0;
};

/// The cells of a face's samples, spread evenly over it.
std::array<std::uint32_t, kSamples> cells_of(const SourceModel& model, std::size_t face,
                                             const SmallMap& map) {
  const std::size_t first = model.face_first(face);
  std::array<glm::dvec2, 3> uvs;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t uv = model.corner(first + k).uv;
    uvs[k] = uv == kNoIndex ? glm::dvec2(0.0) : model.uvs[uv];
  }
  std::array<std::uint32_t, kSamples> cells;
  std::size_t count = 0;
  for (int i = 0; i < kSampleRows; ++i) {
    for (int j = 0; i + j < kSampleRows; ++j) {
      const glm::dvec2 share = (glm::dvec2(i, j) + 1.0 / 3.0) / static_cast<double>(kSampleRows);
      cells[count++] = FaceGroups::cell(
          map.at(uvs[0] + share.x * (uvs[1] - uvs[0]) + share.y * (uvs[2] - uvs[0])));
    }
  }
  return cells;
}

double area_of(const SourceModel& model, std::size_t face) {
  const std::size_t first = model.face_first(face);
  const auto at = [&](std::size_t k) { return model.positions[model.corner_positions[first + k]]; };
  return glm::length(glm::cross(at(1) - at(0), at(2) - at(0)));
}

void set_reflection(const MetalMap& map, const glm::dvec2& found, SourceMaterial& material) {
  set_reflection(map.roughness * found.x, map.metalness * found.y, map.base, map.pictured,
                 material);
}

/// One material becomes one of each group of its faces. of_faces: the material of each face.
void split(const MetalMap& map, const SmallMap& texels, std::vector<std::uint32_t>& of_faces,
           SourceModel& model) {
  FaceGroups groups;
  for (std::size_t f = 0; f < of_faces.size(); ++f) {
    if (of_faces[f] != map.material) continue;
    const double area = area_of(model, f);
    for (const std::uint32_t cell : cells_of(model, f, texels)) groups.add(cell, area);
  }
  const std::vector<glm::dvec2> means = groups.means();
  if (means.size() < 2) return;
  const auto added = static_cast<std::uint32_t>(model.materials.size());
  for (std::size_t g = 1; g < means.size(); ++g) {
    model.materials.push_back(model.materials[map.material]);
    model.materials.back().name += " " + std::to_string(g + 1);
    set_reflection(map, means[g], model.materials.back());
  }
  set_reflection(map, means[0], model.materials[map.material]);
  for (std::size_t f = 0; f < of_faces.size(); ++f) {
    if (of_faces[f] != map.material) continue;
    // Most of a face decides: a face of a mean of its own would show its outline.
    std::array<int, kMostGroups> votes{};
    for (const std::uint32_t cell : cells_of(model, f, texels)) ++votes[groups.group(cell)];
    const auto most = std::max_element(votes.begin(), votes.end()) - votes.begin();
    if (most != 0) of_faces[f] = added + static_cast<std::uint32_t>(most) - 1;
  }
}

}  // namespace

void apply_metal_maps(const std::vector<MetalMap>& maps, const std::string& label,
                      SourceModel& model) {
  std::map<std::string, SmallMap> read;
  std::vector<std::uint32_t> of_faces(model.face_count());
  RunCursor cursor(model.material_runs);
  for (std::size_t f = 0; f < of_faces.size(); ++f) of_faces[f] = cursor.at(f);
  const std::size_t before = model.materials.size();
  for (const MetalMap& map : maps) {
    const auto [found, added] = read.try_emplace(map.path);
    if (added) {
      if (const auto image = read_texture(map.path)) {
        found->second = shrunk(*image);
      } else {
        const Error& e = image.error();
        model.diagnostics.push_back(
            {e.code, DiagnosticSeverity::kWarning, e.where, 0, e.cause, e.cure});
      }
    }
    set_reflection(map, found->second.mean, model.materials[map.material]);
    if (map.on_its_uvs) split(map, found->second, of_faces, model);
  }
  if (maps.empty()) return;
  model.diagnostics.push_back(
      {"gltf.metal-map", DiagnosticSeverity::kInfo, label, 0,
       std::to_string(maps.size()) + (maps.size() == 1 ? " material has" : " materials have") +
           " a metallic-roughness map; its means set the highlight of " +
           std::to_string(maps.size() + model.materials.size() - before) + " groups of faces",
       ""});
  model.material_runs.clear();
  for (std::size_t f = 0; f < of_faces.size(); ++f) {
    if (f == 0 || of_faces[f] != of_faces[f - 1]) model.material_runs.push_back({f, of_faces[f]});
  }
}

}  // namespace modar
