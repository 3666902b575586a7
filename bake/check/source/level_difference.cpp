#include "bake/check/source/level_difference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/pack/vertex_codec.hpp"

namespace modar {
namespace {

/// The least share of equal bytes by which two levels count as in one order. Far from either case:
/// damage changes few bytes, another order of vertices nearly all.
constexpr double kSameOrder = 0.5;
/// What nobody sees: an eighth of a texel of a picture of 1024, 3 degrees of a normal, a step of
/// 8-bit colour, a part of the distance at which levels change.
constexpr double kPictureSlack = 1.0 / 8192;
constexpr double kNormalCosine = 0.9986;
constexpr double kColourSlack = 1.5 / 255;
constexpr double kErrorSlack = 0.01;

using Triangle = std::array<std::uint16_t, 3>;

std::span<const std::byte> bytes_at(std::span<const std::byte> bytes, std::uint64_t offset,
                                    std::uint64_t size) {
  return bytes.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
}

std::span<const std::byte> vertices_of(const LevelPart& p) {
  return bytes_at(p.vertices, p.level->vertex_offset,
                  std::uint64_t{p.level->vertex_count} * p.layout->stride);
}

std::span<const std::byte> indices_of(const LevelPart& p) {
  return bytes_at(p.indices, p.level->index_offset, 2ull * p.level->index_count);
}

bool mostly_equal(std::span<const std::byte> a, std::span<const std::byte> b) {
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.size(); ++i) same += a[i] == b[i] ? 1u : 0u;
  return static_cast<double>(same) >= kSameOrder * static_cast<double>(a.size());
}

/// Each from its least corner on, in a fixed order: what is drawn, however it is listed.
std::vector<Triangle> triangles_of(const LevelPart& p) {
  std::vector<Triangle> triangles(p.level->index_count / 3);
  const std::span<const std::byte> bytes = indices_of(p);
  if (!bytes.empty()) std::memcpy(triangles.data(), bytes.data(), bytes.size());
  for (Triangle& t : triangles)
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

/// What is wrong with one vertex, or nullptr. Numbers that are none are off.
const char* vertex_difference(const VertexDecoder& decoder, const std::byte* a,
                              const ChunkRecord& at, const VertexDecoder& other, const std::byte* b,
                              const ChunkRecord& there, double slack) {
  if (!(glm::length(decoder.position(a, at) - other.position(b, there)) <= slack)) {
    return "a vertex has another position";
  }
  if (!(glm::dot(decoder.normal(a), other.normal(b)) >= kNormalCosine)) {
    return "a normal points elsewhere";
  }
  if (decoder.has(Semantic::kUv)) {
    const glm::dvec2 off = glm::abs(decoder.uv(a, at) - other.uv(b, there));
    if (!(std::max(off.x, off.y) <= kPictureSlack))
      return "a vertex has another place in its picture";
  }
  if (decoder.has(Semantic::kColour)) {
    const glm::dvec4 off = glm::abs(decoder.colour(a) - other.colour(b));
    if (!(std::max({off.x, off.y, off.z, off.w}) <= kColourSlack)) {
      return "a vertex has another colour";
    }
  }
  return nullptr;
}

}  // namespace

std::string level_difference(const LevelPart& ours, const LevelPart& theirs, double slack) {
  if (ours.level->vertex_count != theirs.level->vertex_count ||
      ours.level->index_count != theirs.level->index_count ||
      std::memcmp(ours.layout, theirs.layout, sizeof *ours.layout) != 0) {
    return "";
  }
  // Triangles in another order tell nothing of vertices that are the same.
  const auto a_indices = indices_of(ours);
  const auto b_indices = indices_of(theirs);
  const bool same_indices = std::equal(a_indices.begin(), a_indices.end(), b_indices.begin());
  if (!mostly_equal(vertices_of(ours), vertices_of(theirs)) && !same_indices) return "";
  const auto error = static_cast<double>(theirs.level->error);
  if (std::fabs(static_cast<double>(ours.level->error) - error) > kErrorSlack * error) {
    return "it states another error";
  }
  if (triangles_of(ours) != triangles_of(theirs)) return "its triangles are not the source's";
  const VertexDecoder decoder(*ours.layout);
  const VertexDecoder other(*theirs.layout);
  const std::byte* a = vertices_of(ours).data();
  const std::byte* b = vertices_of(theirs).data();
  for (std::uint32_t v = 0; v < ours.level->vertex_count; ++v) {
    const char* what = vertex_difference(decoder, a, *ours.chunk, other, b, *theirs.chunk, slack);
    if (what != nullptr) return what + (", vertex " + std::to_string(v));
    a += decoder.stride();
    b += decoder.stride();
  }
  return "";
}

}  // namespace modar
