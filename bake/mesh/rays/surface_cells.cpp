// Cells of a grid by a hash of their places.
#include "bake/mesh/rays/surface_cells.hpp"

#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

namespace modar {
namespace {

constexpr std::uint32_t kNoCluster = ~std::uint32_t{0};
constexpr unsigned kAxisBits = 21;
constexpr std::uint64_t kEmptyKey = ~std::uint64_t{0};

}  // namespace

SurfaceCells::SurfaceCells(std::span<const glm::dvec3> positions,
                           std::span<const glm::vec3> normals, double side)
    : cells_a_length_(1 / side), table_(std::size_t{1} << table_bits_) {
  of_vertices_.reserve(positions.size());
  std::uint64_t last_key = kEmptyKey;
  Cell* last = nullptr;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const std::uint64_t key = key_of((positions[v] + 1.0) * cells_a_length_ + 1.0);
    if (key != last_key) last = &cell(key);
    last_key = key;
    std::uint32_t& cluster = last->clusters[facing(normals[v])];
    if (cluster == kNoCluster) {
      cluster = static_cast<std::uint32_t>(positions_.size());
      positions_.emplace_back(positions[v]);
      normals_.emplace_back(0.0f);
    }
    normals_[cluster] += normals[v];
    of_vertices_.push_back(cluster);
  }
  for (glm::vec3& normal : normals_) normal = glm::normalize(normal);  // all look to one side
  double heights = 0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const std::uint32_t cluster = of_vertices_[v];
    const glm::vec3 away = glm::vec3(positions[v]) - positions_[cluster];
    heights += std::fabs(static_cast<double>(glm::dot(away, normals_[cluster])));
  }
  if (!positions.empty()) {
    thickness_ = heights * cells_a_length_ / static_cast<double>(positions.size());
  }
}

std::uint64_t SurfaceCells::key_of(const glm::dvec3& place) {
  return static_cast<std::uint64_t>(place.x) << 2 * kAxisBits |
         static_cast<std::uint64_t>(place.y) << kAxisBits | static_cast<std::uint64_t>(place.z);
}

std::size_t SurfaceCells::facing(const glm::vec3& normal) {
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::fabs(normal[i]) > std::fabs(normal[axis])) axis = i;
  }
  return static_cast<std::size_t>(2 * axis + (normal[axis] < 0 ? 1 : 0));
}

/// Where the table has the key, or has room for it.
std::size_t SurfaceCells::slot(std::uint64_t key) const {
  std::size_t at = key * 0x9E3779B97F4A7C15u >> (64 - table_bits_);
  while (table_[at].key != key && table_[at].key != kEmptyKey) at = (at + 1) % table_.size();
  return at;
}

SurfaceCells::Cell& SurfaceCells::cell(std::uint64_t key) {
  Cell* found = &table_[slot(key)];
  if (found->key == key) return *found;
  if (2 * ++used_ > table_.size()) {
    std::vector<Cell> old(std::size_t{1} << ++table_bits_);
    old.swap(table_);
    for (const Cell& moved : old) {
      if (moved.key != kEmptyKey) table_[slot(moved.key)] = moved;
    }
    found = &table_[slot(key)];
  }
  found->key = key;
  found->clusters.fill(kNoCluster);
  return *found;
}

float SurfaceCells::Reader::at(const glm::dvec3& position, const glm::vec3& normal,
                               float otherwise) {
  // What weighs less moves the mean by 2 % of its difference from it, and costs a look; along an
  // axis, by 10 % of a corner's.
  constexpr float kLeastWeight = 0.02f;
  constexpr float kLeastSquare = 0.1f;
  const glm::dvec3 place = (position + 1.0) * cells_.cells_a_length_ + 0.5;
  const std::uint64_t key = key_of(place);
  if (key != std::exchange(key_, key)) {
    for (std::uint64_t i = 0; i < 8; ++i) {
      const std::uint64_t beside =
          (i & 4) << (2 * kAxisBits - 2) | (i & 2) << (kAxisBits - 1) | (i & 1);
      const Cell& cell = cells_.table_[cells_.slot(key + beside)];
      around_[i] = cell.key == kEmptyKey ? nullptr : &cell.clusters;
    }
  }
  const glm::vec3 part(place - glm::dvec3(glm::uvec3(place)));
  const glm::vec3 square = normal * normal;
  float sum = 0;
  float weights = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const float near = ((i & 4) != 0 ? part.x : 1 - part.x) * ((i & 2) != 0 ? part.y : 1 - part.y) *
                       ((i & 1) != 0 ? part.z : 1 - part.z);
    if (near < kLeastWeight || around_[i] == nullptr) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (square[axis] < kLeastSquare) continue;
      const std::uint32_t cluster =
          (*around_[i])[static_cast<std::size_t>(2 * axis + (normal[axis] < 0 ? 1 : 0))];
      if (cluster == kNoCluster) continue;
      sum += near * square[axis] * values_[cluster];
      weights += near * square[axis];
    }
  }
  return weights > 0 ? sum / weights : otherwise;
}

}  // namespace modar
