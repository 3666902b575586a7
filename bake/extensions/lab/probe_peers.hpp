// What others make of the same OBJ file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace modar {

/// Faces that the peer parsed, 0 where it failed or this build lacks it.
std::uint64_t parse_with_tinyobj(const std::string& path);
std::uint64_t parse_with_assimp(const std::string& path);

/// meshoptimizer's orders for the vertex cache and for fetching, of one chunk.
void order_with_meshopt(std::span<std::byte> vertices, std::size_t stride,
                        std::span<std::uint16_t> indices);

}  // namespace modar
