// Splits a mesh into chunks along a kd tree over its triangles.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include <glm/common.hpp>

#include "bake/model/chunked_mesh.hpp"
#include "formats/layout.hpp"

namespace modar {
namespace {

/// Vertices a triangle that a large piece of a closed mesh has, with what its border adds.
constexpr double kVerticesPerTriangle = 0.52;

class ChunkBuilder {
 public:
  ChunkBuilder(const TriMesh& mesh, const ChunkOptions& options, std::vector<Chunk>& chunks)
      : mesh_(mesh),
        max_vertices_(options.max_vertices),
        max_side_(options.max_side),
        chunks_(chunks),
        local_(mesh.positions.size(), kNoIndex) {}

  /// Triangles of one material, in any order that the caller can repeat. Answers false where one
  /// of them is longer than a chunk may be.
  bool split(std::span<std::uint32_t> triangles, std::uint32_t material) {
    const double guess = static_cast<double>(triangles.size()) * kVerticesPerTriangle;
    double vertices = guess;
    if (guess < 4.0 * max_vertices_) {
      const std::uint32_t count = number_vertices(triangles);
      if (count <= max_vertices_ && fits()) {
        emit(triangles, material);
        return true;
      }
      forget_vertices();
      vertices = count;
    }
    if (triangles.size() == 1) return false;
    const double pieces = std::max(2.0, std::ceil(vertices * 1.02 / max_vertices_));
    const double share = std::floor(pieces / 2) / pieces;
    auto middle = static_cast<std::size_t>(static_cast<double>(triangles.size()) * share);
    middle = std::clamp<std::size_t>(middle, 1, triangles.size() - 1);
    partition(triangles, middle);
    return split(triangles.first(middle), material) && split(triangles.subspan(middle), material);
  }

 private:
  /// Three times the centre of a triangle.
  [[nodiscard]] glm::dvec3 centre(std::uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    return mesh_.positions[t[0]] + mesh_.positions[t[1]] + mesh_.positions[t[2]];
  }

  /// Puts the `middle` triangles that lie lowest along the longest side of the box in front.
  void partition(std::span<std::uint32_t> triangles, std::size_t middle) {
    glm::dvec3 low(4.0);
    glm::dvec3 high(-4.0);
    for (const std::uint32_t t : triangles) {
      const glm::dvec3 c = centre(t);
      low = glm::min(low, c);
      high = glm::max(high, c);
    }
    const glm::dvec3 side = high - low;
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
    keys_.clear();
    keys_.reserve(triangles.size());
    for (const std::uint32_t t : triangles) keys_.push_back({centre(t)[axis], t});
    std::nth_element(keys_.begin(), keys_.begin() + static_cast<std::ptrdiff_t>(middle),
                     keys_.end());
    // In file order on both sides, so that the result does not hang on the library's selection.
    for (std::size_t i = 0; i < keys_.size(); ++i) triangles[i] = keys_[i].second;
    std::sort(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(middle));
    std::sort(triangles.begin() + static_cast<std::ptrdiff_t>(middle), triangles.end());
  }

  /// Numbers the vertices of these triangles by first use; stops one past the limit.
  std::uint32_t number_vertices(std::span<const std::uint32_t> triangles) {
    used_.clear();
    for (const std::uint32_t t : triangles) {
      for (const std::uint32_t v : mesh_.triangles[t]) {
        if (local_[v] != kNoIndex) continue;
        local_[v] = static_cast<std::uint32_t>(used_.size());
        used_.push_back(v);
      }
    }
    return static_cast<std::uint32_t>(used_.size());
  }

  /// Are the numbered vertices as close together as they must be?
  [[nodiscard]] bool fits() const {
    if (!(max_side_ > 0)) return true;
    glm::dvec3 low = mesh_.positions[used_[0]];
    glm::dvec3 high = low;
    for (const std::uint32_t v : used_) {
      low = glm::min(low, mesh_.positions[v]);
      high = glm::max(high, mesh_.positions[v]);
    }
    const glm::dvec3 side = high - low;
    return std::max({side.x, side.y, side.z}) <= max_side_;
  }

  void forget_vertices() {
    for (const std::uint32_t v : used_) local_[v] = kNoIndex;
    used_.clear();
  }

  void emit(std::span<const std::uint32_t> triangles, std::uint32_t material) {
    Chunk& chunk = chunks_.emplace_back();
    chunk.material = material;
    chunk.indices.reserve(3 * triangles.size());
    for (const std::uint32_t t : triangles) {
      for (const std::uint32_t v : mesh_.triangles[t]) {
        chunk.indices.push_back(static_cast<std::uint16_t>(local_[v]));
      }
    }
    chunk.vertices = used_;
    forget_vertices();
  }

  const TriMesh& mesh_;
  std::uint32_t max_vertices_;
  double max_side_;
  std::vector<Chunk>& chunks_;
  std::vector<std::uint32_t> local_;  // of each vertex, kNoIndex outside the chunk at hand
  std::vector<std::uint32_t> used_;
  std::vector<std::pair<double, std::uint32_t>> keys_;
};

}  // namespace

Result<void> ChunkOptions::validate() const {
  if (max_vertices < 3 || max_vertices > kMaxChunkVertices) {
    return fail(ExitCode::kUsage, "chunk.max-vertices", "", "a chunk has 3 to 65535 vertices",
                "choose a number in that range");
  }
  return {};
}

Result<ChunkedMesh> chunk(TriMesh mesh, const ChunkOptions& options, Report& report) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  StageTimer timer(report, "chunk");
  ChunkedMesh result;
  result.mesh = std::move(mesh);
  // Triangles by material, in file order within each.
  std::vector<std::uint32_t> begins(result.mesh.materials.size() + 1, 0);
  for (const std::uint32_t m : result.mesh.triangle_material) ++begins[m + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<std::uint32_t> triangles(result.mesh.triangles.size());
  std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    triangles[next[result.mesh.triangle_material[t]]++] = t;
  }
  ChunkBuilder builder(result.mesh, options, result.chunks);
  for (std::uint32_t m = 0; m + 1 < begins.size(); ++m) {
    const auto part = std::span(triangles).subspan(begins[m], begins[m + 1] - begins[m]);
    if (!part.empty() && !builder.split(part, m)) {
      return fail(ExitCode::kUnsupported, "model.max-error", result.mesh.name,
                  "a triangle is too long for the grid that the asked error needs",
                  "allow a greater --max-error, or divide the model's longest triangles");
    }
  }
  timer.done(result.mesh.triangles.size(), result.chunks.size());
  return result;
}

}  // namespace modar
