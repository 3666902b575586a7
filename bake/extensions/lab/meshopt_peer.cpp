// meshoptimizer on one chunk, as its manual says.
#include <meshoptimizer.h>

#include "bake/extensions/lab/probe_peers.hpp"

namespace modar {

void order_with_meshopt(std::span<std::byte> vertices, std::size_t stride,
                        std::span<std::uint16_t> indices) {
  const std::size_t count = vertices.size() / stride;
  meshopt_optimizeVertexCache(indices.data(), indices.data(), indices.size(), count);
  meshopt_optimizeVertexFetch(vertices.data(), indices.data(), indices.size(), vertices.data(),
                              count, stride);
}

}  // namespace modar
