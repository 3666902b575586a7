// The one file of the workstation that ships with meshoptimizer's codec.
#include <algorithm>
#include <cstring>

#include <meshoptimizer.h>

#include "bake/ship/mesh_encoder.hpp"
#include "modar/mesh_transport.hpp"

namespace modar {

std::optional<std::vector<std::byte>> encode_level(std::span<const std::uint16_t> indices) {
  if (indices.empty() || indices.size() % 3 != 0) return std::nullopt;
  const std::size_t vertices = *std::max_element(indices.begin(), indices.end()) + std::size_t{1};
  std::vector<unsigned char> coded(meshopt_encodeIndexBufferBound(indices.size(), vertices));
  coded.resize(
      meshopt_encodeIndexBuffer(coded.data(), coded.size(), indices.data(), indices.size()));
  const auto bytes = std::as_bytes(std::span(coded));
  const auto back = decode_level(bytes, indices.size());
  if (!back || !std::equal(back->begin(), back->end(), indices.begin(), indices.end())) {
    return std::nullopt;
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace modar
