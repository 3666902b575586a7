// The one file of the device that knows meshoptimizer's codec.
#include <algorithm>

#include <meshoptimizer.h>

#include "formats/transport/chunk_order.hpp"
#include "modar/mesh_transport.hpp"

namespace modar {

Result<std::vector<std::uint16_t>> decode_level(std::span<const std::byte> buffer,
                                                std::size_t index_count) {
  std::vector<std::uint16_t> indices(index_count);
  if (index_count % 3 != 0 || index_count == 0 ||
      meshopt_decodeIndexBuffer(indices.data(), indices.size(), sizeof indices[0],
                                reinterpret_cast<const unsigned char*>(buffer.data()),
                                buffer.size()) != 0) {
    return fail(ExitCode::kInvalidInput, "mesh.level", "level of detail",
                "meshoptimizer cannot decode it", "publish the release again");
  }
  // The codec keeps triangles and their winding, but turns some of them.
  LevelOrderer orderer;
  orderer.order(indices, *std::max_element(indices.begin(), indices.end()) + 1u);
  return indices;
}

}  // namespace modar
