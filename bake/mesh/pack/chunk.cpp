// Splits a mesh into chunks along a kd tree over its triangles; chunks' boxes and normal cones.
#include "bake/mesh/pack/chunk.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/repeating.hpp"
#include "formats/layout.hpp"

namespace modar {
namespace {

/// A triangle and its centre, counted along each axis in 65,536ths of [-1,1]: finer than the
/// triangles of any model that has to be split.
struct Item {
  std::array<std::uint16_t, 3> centre;
  std::uint16_t unused = 0;
  std::uint32_t triangle = 0;
};

Item make_item(const TriMesh& mesh, std::uint32_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const glm::dvec3 sum = mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]];
  Item item;
  item.triangle = triangle;
  for (int i = 0; i < 3; ++i) {
    const double at = std::clamp((sum[i] / 3.0 + 1.0) * 32768.0, 0.0, 65535.0);
    item.centre[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(at);
  }
  return item;
}

/// A piece estimated to exceed the limit by this factor is split without counting its vertices: a
/// wrong estimate would make chunks small. Set by hand.
constexpr double kSurely = 1.25;
/// What borders add to the vertices of a piece, and a margin for uneven halves. Set by hand.
constexpr double kMargin = 1.055;

class ChunkBuilder {
 public:
  ChunkBuilder(const TriMesh& mesh, const ChunkOptions& options, std::vector<Chunk>& chunks)
      : mesh_(mesh),
        max_vertices_(options.max_vertices),
        max_side_(options.max_side),
        chunks_(chunks),
        local_(mesh.positions.size(), kNoIndex),
        vertices_per_triangle_(static_cast<double>(mesh.positions.size()) /
                               static_cast<double>(mesh.triangles.size())) {}

  /// Triangles of one material in the order of the file. Returns false where one of them is longer
  /// than a chunk may be.
  bool split(std::span<Item> items, std::uint32_t material) {
    double vertices = static_cast<double>(items.size()) * vertices_per_triangle_;
    if (vertices < kSurely * max_vertices_) {
      const std::uint32_t count = number_vertices(items);
      if (count <= max_vertices_ && fits()) {
        emit(items, material);
        return true;
      }
      forget_vertices();
      vertices = count;
    }
    if (items.size() == 1) return false;
    const double pieces = std::max(2.0, std::ceil(vertices * kMargin / max_vertices_));
    const double share = std::floor(pieces / 2) / pieces;
    auto middle = static_cast<std::size_t>(static_cast<double>(items.size()) * share);
    middle = std::clamp<std::size_t>(middle, 1, items.size() - 1);
    partition(items, middle);
    return split(items.first(middle), material) && split(items.subspan(middle), material);
  }

 private:
  /// The axis along which the centres spread most.
  static std::size_t longest_axis(std::span<const Item> items) {
    std::array<std::uint16_t, 3> low = items[0].centre;
    std::array<std::uint16_t, 3> high = low;
    for (const Item& item : items) {
      for (std::size_t i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], item.centre[i]);
        high[i] = std::max(high[i], item.centre[i]);
      }
    }
    const auto side = [&](std::size_t i) { return high[i] - low[i]; };
    return side(0) >= side(1) && side(0) >= side(2) ? 0 : (side(1) >= side(2) ? 1 : 2);
  }

  /// Moves the `middle` triangles that lie lowest along the longest side of their box to the front;
  /// both parts keep file order, and ties go to the first in the file.
  void partition(std::span<Item> items, std::size_t middle) {
    const std::size_t axis = longest_axis(items);
    histogram_.assign(65536, 0);
    for (const Item& item : items) ++histogram_[item.centre[axis]];
    std::size_t left = middle;
    std::uint32_t border = 0;
    while (histogram_[border] <= left) left -= histogram_[border++];
    behind_.resize(0);
    behind_.reserve(items.size() - middle);
    std::size_t kept = 0;
    for (const Item& item : items) {
      const std::uint16_t at = item.centre[axis];
      const bool front = at < border || (at == border && left > 0);
      if (front && at == border) --left;
      if (front) {
        items[kept++] = item;
      } else {
        behind_.push_back(item);
      }
    }
    std::copy(behind_.begin(), behind_.end(), items.begin() + static_cast<std::ptrdiff_t>(kept));
  }

  /// Numbers the vertices of these triangles by first use; stops one past the limit.
  std::uint32_t number_vertices(std::span<const Item> items) {
    used_.clear();
    for (const Item& item : items) {
      for (const std::uint32_t v : mesh_.triangles[item.triangle]) {
        if (local_[v] != kNoIndex) continue;
        local_[v] = static_cast<std::uint32_t>(used_.size());
        used_.push_back(v);
      }
    }
    return static_cast<std::uint32_t>(used_.size());
  }

  /// Do the numbered vertices fit into a box of max_side?
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

  void emit(std::span<const Item> items, std::uint32_t material) {
    Chunk& chunk = chunks_.emplace_back();
    chunk.material = material;
    chunk.indices.reserve(3 * items.size());
    for (const Item& item : items) {
      for (const std::uint32_t v : mesh_.triangles[item.triangle]) {
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
  double vertices_per_triangle_;
  std::vector<std::uint32_t> histogram_;
  Array<Item> behind_;
};

}  // namespace

std::uint32_t chunk_vertices_for(std::size_t model_vertices) {
  constexpr std::uint32_t kFinerFrom = 4;  // chunks
  return model_vertices > kFinerFrom * std::size_t{kMaxChunkVertices} ? 16384 : kMaxChunkVertices;
}

Result<void> ChunkOptions::validate() const {
  if (max_vertices < 3 || max_vertices > kMaxChunkVertices) {
    return fail(ExitCode::kUsage, "chunk.max-vertices", "", "a chunk has 3 to 65535 vertices",
                "choose a number in that range");
  }
  return {};
}

Result<ChunkedMesh> chunk(TriMesh mesh, const ChunkOptions& options, Report& report) {
  MODAR_TRY(options.validate());
  StageTimer timer(report, "chunk");
  ChunkedMesh result;
  result.mesh = std::move(mesh);
  result.repeats = repeating_materials(result.mesh);
  // Triangles by material, in file order within each.
  std::vector<std::uint32_t> begins(result.mesh.materials.size() + 1, 0);
  for (const std::uint32_t m : result.mesh.triangle_material) ++begins[m + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  Array<Item> items(result.mesh.triangles.size());
  std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
  for (std::uint32_t t = 0; t < items.size(); ++t) {
    items[next[result.mesh.triangle_material[t]]++] = make_item(result.mesh, t);
  }
  result.mesh.triangle_material.release();  // chunks hold it from here on
  ChunkBuilder builder(result.mesh, options, result.chunks);
  for (std::uint32_t m = 0; m + 1 < begins.size(); ++m) {
    const auto part =
        std::span(items.data(), items.size()).subspan(begins[m], begins[m + 1] - begins[m]);
    if (!part.empty() && !builder.split(part, m)) {
      return fail(ExitCode::kUnsupported, "model.max-error", result.mesh.name,
                  "a triangle is too long for the grid that the requested error needs",
                  "allow a greater --max-error, or divide the model's longest triangles");
    }
  }
  timer.done(result.mesh.triangles.size(), result.chunks.size());
  result.mesh.triangles.release();
  return result;
}
namespace {

// Boxes and cones.

/// Covers the rounding of the axis to float, of the renderer's normalisation and dot product (some
/// 1e-6); set by hand.
constexpr double kConeSlack = 1e-4;

/// Unit normal of triangle i, or zero where it has no area.
glm::dvec3 face_normal(std::span<const glm::vec3> positions, std::span<const std::uint16_t> indices,
                       std::size_t i) {
  const glm::dvec3 a(positions[indices[i]]);
  const glm::dvec3 b(positions[indices[i + 1]]);
  const glm::dvec3 c(positions[indices[i + 2]]);
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double length = glm::length(n);
  return length > 0 ? n / length : glm::dvec3(0.0);
}

}  // namespace

ChunkBounds chunk_bounds(std::span<const glm::vec3> positions,
                         std::span<const std::uint16_t> indices) {
  ChunkBounds bounds;
  if (positions.empty()) return bounds;
  bounds.low = positions[0];
  bounds.high = positions[0];
  for (const glm::vec3& p : positions) {
    bounds.low = glm::min(bounds.low, p);
    bounds.high = glm::max(bounds.high, p);
  }
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < indices.size(); i += 3) sum += face_normal(positions, indices, i);
  const double length = glm::length(sum);
  if (!(length > 0)) return bounds;
  const glm::vec3 axis(sum / length);
  double least = 1.0;
  for (std::size_t i = 0; i < indices.size() && least > 0; i += 3) {
    const glm::dvec3 n = face_normal(positions, indices, i);
    if (n != glm::dvec3(0.0)) least = std::min(least, glm::dot(n, glm::dvec3(axis)));
  }
  // Half the opening is acos(least). A direction within 90 degrees less that of the axis meets
  // every triangle from behind: its cosine with the axis is at least sin(acos(least)).
  const double cutoff = std::sqrt(std::max(0.0, 1.0 - least * least)) + kConeSlack;
  if (least <= 0 || cutoff >= 1.0) return bounds;
  bounds.cone_axis = axis;
  bounds.cone_cutoff = static_cast<float>(cutoff);
  return bounds;
}

}  // namespace modar
