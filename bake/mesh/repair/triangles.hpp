// A model as triangles that can be removed, turned, split and added.
#pragma once

#include "bake/import/source_model.hpp"
#include "bake/mesh/repair/surface.hpp"
#include "bake/report.hpp"

namespace modar::repair {

/// Holds the model's faces while they change; the model has them again after finish().
class Triangles {
 public:
  explicit Triangles(SourceModel& model);
  void finish();

  [[nodiscard]] Faces surface() const {
    return {std::span(model_.corner_positions.data(), model_.corner_positions.size()),
            std::span(model_.positions.data(), model_.positions.size())};
  }
  [[nodiscard]] std::span<std::uint32_t> corners() {
    return {model_.corner_positions.data(), model_.corner_positions.size()};
  }
  [[nodiscard]] Corner corner(std::size_t c) const { return model_.corner(c); }
  [[nodiscard]] const SourceModel& model() const { return model_; }
  [[nodiscard]] std::uint32_t material(std::size_t t) const { return material_[t]; }

  /// Removes triangles that are not to be kept.
  void keep(const std::vector<bool>& kept);
  /// Turns a triangle over: corners 1 and 2 change places. Normals that then look to its back go.
  void turn(std::size_t t);
  std::uint32_t copy_position(std::uint32_t position);
  /// Adds a position, and where there are uvs one of these, in the middle of corners.
  Corner add_middle(const std::vector<Corner>& corners);
  /// Adds a triangle like another one.
  void add(const std::array<Corner, 3>& corners, std::size_t like);

 private:
  SourceModel& model_;
  Array<std::uint32_t> material_;   // of each triangle
  Array<std::uint32_t> smoothing_;  // the same
};

/// Makes the surface one that half-edges can hold: at most two triangles at an edge, of one
/// winding, and one fan at a position.
void make_manifold(Triangles& triangles, MeshDefects& defects);

/// The triangles of the flat surface that a scan is on, and of all that is not clear of it: with an
/// open border, most of the model on its front and at most noise behind. Empty: no such surface.
std::vector<bool> find_support(const Faces& surface);

/// Closes the holes of a manifold surface that small_hole() names, each by a fan around its middle
/// that looks as the triangles around it.
void close_holes(Triangles& triangles, DefectCount& count);

}  // namespace modar::repair
