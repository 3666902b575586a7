// Clusters of near vertices that look the same way, and values between them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace modar {

/// Vertices in cubic cells of a grid, up to six clusters in each: one for each side that normals
/// look to most.
class SurfaceCells {
 public:
  /// Positions are in [-1,1]; there are as many normals, of unit length. Side: of a cell, 1e-4 at
  /// least.
  SurfaceCells(std::span<const glm::dvec3> positions, std::span<const glm::vec3> normals,
               double side);

  /// Of each cluster, in the order of their first vertices: where the first one is, and the mean
  /// normal.
  [[nodiscard]] const std::vector<glm::vec3>& positions() const { return positions_; }
  [[nodiscard]] const std::vector<glm::vec3>& normals() const { return normals_; }
  /// The cluster of each vertex.
  [[nodiscard]] const std::vector<std::uint32_t>& of_vertices() const { return of_vertices_; }
  /// Mean distance of vertices from the planes of their clusters, in sides of a cell.
  [[nodiscard]] double thickness() const { return thickness_; }

  /// Reads one value a cluster between them: linear in the place, and weighed by the squares of the
  /// normal's coordinates. One thread each.
  class Reader {
   public:
    Reader(const SurfaceCells& cells, std::span<const float> values)
        : cells_(cells), values_(values) {}
    [[nodiscard]] float at(const glm::dvec3& position, const glm::vec3& normal, float otherwise);

   private:
    const SurfaceCells& cells_;
    std::span<const float> values_;
    std::uint64_t key_ = ~std::uint64_t{0};  // of the first of eight cells
    std::array<const std::array<std::uint32_t, 6>*, 8> around_{};
  };

 private:
  struct Cell {
    std::uint64_t key = ~std::uint64_t{0};
    std::array<std::uint32_t, 6> clusters;
  };
  static std::uint64_t key_of(const glm::dvec3& place);
  static std::size_t facing(const glm::vec3& normal);
  [[nodiscard]] std::size_t slot(std::uint64_t key) const;
  Cell& cell(std::uint64_t key);

  double cells_a_length_;
  unsigned table_bits_ = 12;
  std::size_t used_ = 0;
  std::vector<Cell> table_;
  std::vector<glm::vec3> positions_;
  std::vector<glm::vec3> normals_;
  std::vector<std::uint32_t> of_vertices_;
  double thickness_ = 0;
};

}  // namespace modar
