// Which materials repeat their texture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/mesh/tri_mesh.hpp"

namespace modar {

/// How far uv may leave [0,1] and still count as inside: half a texel at 4096, which is what
/// exporters' rounding leaves at a border. Larger clamps textures that repeat by a sliver; smaller
/// repeats (and so resizes to powers of two) textures that do not. Set by hand.
inline constexpr double kUvSlack = 1e-4;

/// For each material, whether any of its triangles samples outside of [0,1].
inline std::vector<bool> repeating_materials(const TriMesh& mesh) {
  std::vector<bool> repeats(mesh.materials.size(), false);
  if (mesh.uvs.empty()) return repeats;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      const glm::dvec2& uv = mesh.uvs[v];
      if (uv.x < -kUvSlack || uv.y < -kUvSlack || uv.x > 1 + kUvSlack || uv.y > 1 + kUvSlack) {
        repeats[mesh.triangle_material[t]] = true;
      }
    }
  }
  return repeats;
}

}  // namespace modar
