// Splits a mesh into chunks along a kd tree over its triangles; chunks' boxes and normal cones.
#include "bake/mesh/pack/chunk.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "formats/layout.hpp"

namespace modar {
namespace {

/// Triangles and their centres, counted along each axis in 65,536ths of [-1,1] from its middle:
/// finer than the triangles of any model that has to be split. An array for each, as a pass needs
/// few of them.
struct Items {
  std::array<Array<std::int16_t>, 3> centres;
  Array<std::uint32_t> triangles;

  [[nodiscard]] std::size_t size() const { return triangles.size(); }
  void resize(std::size_t size) {
    for (Array<std::int16_t>& each : centres) each.resize(size);
    triangles.resize(size);
  }
  void set(std::size_t i, const TriMesh& mesh, std::uint32_t triangle) {
    const auto& t = mesh.triangles[triangle];
    const glm::dvec3 sum = mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]];
    for (int axis = 0; axis < 3; ++axis) {
      const double at = std::clamp((sum[axis] / 3.0 + 1.0) * 32768.0, 0.0, 65535.0);
      centres[static_cast<std::size_t>(axis)][i] =
          static_cast<std::int16_t>(static_cast<int>(at) - 32768);
    }
    triangles[i] = triangle;
  }
};

/// Some of them, one behind the other.
struct Stretch {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t size() const { return end - begin; }
};

/// Estimated excess over the limit at which a piece is split without counting. Lower makes chunks
/// too small when estimates are wrong. [1.1, 1.6]
constexpr double kSurely = 1.25;
/// Allowance for borders' vertices and uneven halves. Lower splits too late, higher makes more
/// chunks. [1, 1.15]
constexpr double kMargin = 1.055;

/// Marks that are looked at together, and what they are where all are set.
constexpr std::size_t kTogether = 8;
constexpr std::uint64_t kAllMarks = 0x0101010101010101u;

class ChunkBuilder {
 public:
  ChunkBuilder(const TriMesh& mesh, Items& items, const ChunkOptions& options,
               std::vector<Chunk>& chunks)
      : mesh_(mesh),
        items_(items),
        max_vertices_(options.max_vertices),
        max_side_(options.max_side),
        chunks_(chunks),
        local_(mesh.positions.size(), kNoIndex),
        vertices_per_triangle_(static_cast<double>(mesh.positions.size()) /
                               static_cast<double>(mesh.triangles.size())) {}

  /// Triangles of one material in the order of the file. Returns false where one of them is longer
  /// than a chunk may be.
  bool split(const Stretch& items, std::uint32_t material) {
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
    const std::size_t border = items.begin + middle;
    return split({items.begin, border}, material) && split({border, items.end}, material);
  }

 private:
  /// The axis along which the centres spread most.
  [[nodiscard]] std::size_t longest_axis(const Stretch& items) const {
    std::array<int, 3> sides{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int16_t* const at = items_.centres[axis].data();
      std::int16_t low = at[items.begin];
      std::int16_t high = low;
      for (std::size_t i = items.begin; i < items.end; ++i) {
        low = at[i] < low ? at[i] : low;
        high = at[i] > high ? at[i] : high;
      }
      sides[axis] = high - low;
    }
    return sides[0] >= sides[1] && sides[0] >= sides[2] ? 0 : (sides[1] >= sides[2] ? 1 : 2);
  }

  /// Moves the `middle` triangles that are lowest along the longest side of their box to the front;
  /// both parts keep file order, and ties go to the first in the file.
  void partition(const Stretch& items, std::size_t middle) {
    const std::int16_t* const centres = items_.centres[longest_axis(items)].data() + items.begin;
    histogram_.assign(65536, 0);
    for (std::size_t i = 0; i < items.size(); ++i) {
      ++histogram_[static_cast<std::size_t>(centres[i] + 32768)];
    }
    std::size_t left = middle;
    std::size_t border = 0;
    while (histogram_[border] <= left) left -= histogram_[border++];
    mark_front(centres, items.size(), static_cast<int>(border) - 32768, left);
    for (Array<std::int16_t>& each : items_.centres) move_front(each, items, middle, behind_);
    move_front(items_.triangles, items, middle, behind_triangles_);
  }

  /// Marks the triangles below `border`, and the first `ties` at it.
  void mark_front(const std::int16_t* centres, std::size_t count, int border, std::size_t ties) {
    in_front_.resize((count + kTogether - 1) / kTogether * kTogether);
    for (std::size_t i = 0; i < count; ++i) {
      in_front_[i] = static_cast<std::uint8_t>(centres[i] < border);
    }
    for (std::size_t i = 0; ties > 0; ++i) {
      if (centres[i] != border) continue;
      in_front_[i] = 1;
      --ties;
    }
  }

  /// Moves those of `values` that are marked to the front. Neighbours mostly go the same way, so
  /// eight are looked at together; where they do not, each is written to both parts and one of them
  /// continues, without branches, which would be mispredicted.
  template <class T>
  void move_front(Array<T>& values, const Stretch& items, std::size_t middle, Array<T>& behind) {
    const std::size_t behind_size = items.size() - middle + 1;  // one more may be written
    // Memory of the first pieces is not held while the last are cut.
    if (behind.size() < behind_size || behind.size() / 4 > behind_size) {
      behind.release();
      behind.resize(behind_size);
    }
    T* to = values.data() + items.begin;
    T* to_behind = behind.data();
    const T* const from = to;
    std::size_t i = 0;
    while (i < items.size()) {
      std::uint64_t marks = 0;
      std::memcpy(&marks, in_front_.data() + i, kTogether);
      const bool whole = i + kTogether <= items.size();
      if (whole && (marks == 0 || marks == kAllMarks)) {
        std::array<T, kTogether> some;
        std::memcpy(some.data(), from + i, sizeof some);
        T*& end = marks == 0 ? to_behind : to;
        std::memcpy(end, some.data(), sizeof some);
        end += kTogether;
        i += kTogether;
        continue;
      }
      for (const std::size_t stop = std::min(i + kTogether, items.size()); i < stop; ++i) {
        const T value = from[i];
        *to = value;
        *to_behind = value;
        to += in_front_[i];
        to_behind += 1 - in_front_[i];
      }
    }
    std::copy(behind.data(), to_behind, to);
  }

  /// Numbers the vertices of these triangles by first use; stops one past the limit.
  std::uint32_t number_vertices(const Stretch& items) {
    used_.clear();
    for (const std::uint32_t triangle : triangles(items)) {
      for (const std::uint32_t v : mesh_.triangles[triangle]) {
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

  void emit(const Stretch& items, std::uint32_t material) {
    Chunk& chunk = chunks_.emplace_back();
    chunk.material = material;
    chunk.indices.reserve(3 * items.size());
    for (const std::uint32_t triangle : triangles(items)) {
      for (const std::uint32_t v : mesh_.triangles[triangle]) {
        chunk.indices.push_back(static_cast<std::uint16_t>(local_[v]));
      }
    }
    chunk.vertices = used_;
    forget_vertices();
  }

  [[nodiscard]] std::span<const std::uint32_t> triangles(const Stretch& items) const {
    return {items_.triangles.data() + items.begin, items.size()};
  }

  const TriMesh& mesh_;
  Items& items_;
  std::uint32_t max_vertices_;
  double max_side_;
  std::vector<Chunk>& chunks_;
  std::vector<std::uint32_t> local_;  // of each vertex, kNoIndex outside the chunk at hand
  std::vector<std::uint32_t> used_;
  double vertices_per_triangle_;
  std::vector<std::uint32_t> histogram_;
  Array<std::uint8_t> in_front_;
  Array<std::int16_t> behind_;
  Array<std::uint32_t> behind_triangles_;
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
  MODAR_TRY(options.validate());
  if (mesh.triangles.empty()) return no_triangle_left(mesh.name, "there is nothing to split");
  StageTimer timer(report, "chunk");
  ChunkedMesh result;
  result.mesh = std::move(mesh);
  result.repeats = repeating_materials(result.mesh);
  // Triangles by material, in file order within each.
  std::vector<std::uint32_t> begins(result.mesh.materials.size() + 1, 0);
  for (const std::uint32_t m : result.mesh.triangle_material) ++begins[m + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  Items items;
  items.resize(result.mesh.triangles.size());
  std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
  for (std::uint32_t t = 0; t < items.size(); ++t) {
    items.set(next[result.mesh.triangle_material[t]]++, result.mesh, t);
  }
  result.mesh.triangle_material.release();  // chunks hold it from here on
  ChunkBuilder builder(result.mesh, items, options, result.chunks);
  for (std::uint32_t m = 0; m + 1 < begins.size(); ++m) {
    const Stretch part = {begins[m], begins[m + 1]};
    if (part.size() != 0 && !builder.split(part, m)) {
      return fail(ExitCode::kUnsupported, "model.max-error", result.mesh.name,
                  "a triangle is too long for the grid that the requested error requires",
                  "allow a larger --max-error, or split the model's longest triangles");
    }
  }
  timer.done(result.mesh.triangles.size(), result.chunks.size());
  result.mesh.triangles.release();
  return result;
}
namespace {

// Boxes and cones.

/// A hundred times the rounding of the axis to float, of the renderer's normalisation and dot
/// product (some 1e-6).
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
  if (indices.empty()) return bounds;
  bounds.low = positions[indices[0]];
  bounds.high = positions[indices[0]];
  for (const std::uint16_t v : indices) {
    bounds.low = glm::min(bounds.low, positions[v]);
    bounds.high = glm::max(bounds.high, positions[v]);
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
