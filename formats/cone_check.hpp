// Holds the normals of triangles against their chunk's cone, one by one. Internal to formats/.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/layout.hpp"
#include "formats/validate.hpp"

namespace modar {

class ConeCheck {
 public:
  /// How many triangles of the level face out of their chunk's cone, and the first index of the
  /// first. 0 where the chunk is never culled. Every index is below vertex_count.
  struct Outside {
    std::uint64_t count = 0;
    std::uint32_t first = 0;
  };
  Outside look(const BundleParts& parts, const LayoutRecord& layout, const ChunkRecord& chunk,
               const LevelRecord& level);

 private:
  void decode(const BundleParts& parts, const LayoutRecord& layout, const ChunkRecord& chunk,
              const LevelRecord& level);

  /// x, y, z of the level's vertices, for at most 65535: it does not grow with the bundle.
  std::vector<float> positions_;
};

}  // namespace modar
