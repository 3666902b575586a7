// Chooses how positions are stored, packs vertices and measures the error of their bytes, decodes
// them.
#include "bake/mesh/pack/vertex_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "formats/quantise.hpp"

namespace modar {
namespace {

// Positions: half floats, or integers on a shared grid.

/// Floats hold all multiples of it in [-1,1] exactly, so that decoding rounds nothing.
constexpr double kFinestStep = 0x1p-23;
constexpr double kSteps = 65534.0;                    ///< that 16 bits span, with both ends at hand
constexpr double kHalfDiagonal = 0.8660254037844387;  ///< of a cube of side 1
constexpr double kFloatStep = 0x1p-24;                ///< between the floats next to 1, below it

/// Lowest and highest point of the grid that a chunk's vertices fall on.
struct GridBox {
  glm::ivec3 low;
  glm::ivec3 high;
};

/// The box of a chunk's vertices.
struct Box {
  glm::dvec3 low;
  glm::dvec3 high;
};

Box box_of(const TriMesh& mesh, const Chunk& chunk) {
  glm::dvec3 low(mesh.positions[chunk.vertices[0]]);
  glm::dvec3 high(low);
  for (const std::uint32_t v : chunk.vertices) {
    low = glm::min(low, mesh.positions[v]);
    high = glm::max(high, mesh.positions[v]);
  }
  return {low, high};
}

GridBox grid_box(const Box& of, double step) {
  GridBox box;
  for (int i = 0; i < 3; ++i) {
    box.low[i] = grid_index(of.low[i], step);
    box.high[i] = grid_index(of.high[i], step);
  }
  return box;
}

double longest_side(const GridBox& box) {
  const glm::ivec3 side = box.high - box.low;
  return std::max({side.x, side.y, side.z});
}

/// Rounds towards minus infinity, on every machine.
glm::ivec3 middle_of(const GridBox& box) {
  glm::ivec3 middle;
  for (int i = 0; i < 3; ++i) middle[i] = (box.low[i] + box.high[i]) >> 1;
  return middle;
}

tl::unexpected<Error> too_fine(const TriMesh& mesh, const PositionRequest& request,
                               const std::string& cause) {
  return fail(ExitCode::kUnsupported, "model.max-error", mesh.name,
              "an error of at most " + std::to_string(request.max_error) + " units: " + cause,
              "allow a larger --max-error, or split the model into several");
}

}  // namespace

int grid_index(double coordinate, double step) {
  return static_cast<int>(std::floor(coordinate / step + 0.5));
}

double half_error(const TriMesh& mesh) {
  double greatest = 0;
  for (const glm::dvec3& p : mesh.positions) {
    const glm::dvec3 error = decoded_position(p, PositionKind::kHalf, {}) - p;
    greatest = std::max(greatest, glm::dot(error, error));
  }
  return std::sqrt(greatest);
}

glm::dvec3 decoded_position(const glm::dvec3& position, PositionKind kind, const ChunkGrid& grid) {
  if (kind == PositionKind::kFloat) return glm::dvec3(glm::vec3(position));
  glm::dvec3 decoded;
  for (int i = 0; i < 3; ++i) {
    decoded[i] =
        kind == PositionKind::kHalf
            ? static_cast<double>(half_to_float(float_to_half(static_cast<float>(position[i]))))
            : grid.step * grid_index(position[i], grid.step);
  }
  return decoded;
}

namespace {

/// The longest side of any triangle's box, model space.
double longest_triangle(const TriMesh& mesh) {
  double longest = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::dvec3& p = mesh.positions[a];
    const glm::dvec3& q = mesh.positions[b];
    const glm::dvec3& r = mesh.positions[c];
    const glm::dvec3 side = glm::max(glm::max(p, q), r) - glm::min(glm::min(p, q), r);
    longest = std::max({longest, side.x, side.y, side.z});
  }
  return longest;
}

/// Of the mean edge: half floats that move a vertex farther bend what triangles show.
constexpr double kVisibleError = 0.05;

/// Triangles that have an area, and none as half floats.
std::size_t lost_as_half(const TriMesh& mesh) {
  Array<glm::dvec3> stored(mesh.positions.size());
  for (std::size_t v = 0; v < stored.size(); ++v) {
    stored[v] = decoded_position(mesh.positions[v], PositionKind::kHalf, {});
  }
  std::size_t lost = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::dvec3 area = glm::cross(stored[b] - stored[a], stored[c] - stored[a]);
    if (area == glm::dvec3(0.0)) ++lost;
  }
  return lost;
}

/// Mean length of the edges of every sixteenth triangle, model space.
double mean_edge_of(const TriMesh& mesh) {
  constexpr std::size_t kStep = 16;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += kStep, count += 3) {
    const auto& corners = mesh.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) {
      sum += glm::length(mesh.positions[corners[i]] - mesh.positions[corners[(i + 1) % 3]]);
    }
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

}  // namespace

Result<PositionPlan> plan_positions(const TriMesh& mesh, const PositionRequest& request) {
  PositionPlan plan;
  plan.mean_edge = mean_edge_of(mesh);
  if (!(request.max_error > 0)) {
    if (request.kind) {
      plan.kind = *request.kind;
      return plan;
    }
    plan.half_error = half_error(mesh);
    plan.half_loss = lost_as_half(mesh);
    const bool harm = plan.half_loss != 0 || plan.half_error > kVisibleError * plan.mean_edge;
    plan.kind = harm ? PositionKind::kInt16 : PositionKind::kHalf;
    return plan;
  }
  const double wanted = request.max_error / mesh.placement.scale;
  if (request.kind != PositionKind::kInt16 && half_error(mesh) <= wanted) return plan;
  if (request.kind == PositionKind::kHalf) {
    return too_fine(
        mesh, request,
        "half floats have one of " + std::to_string(half_error(mesh) * mesh.placement.scale));
  }
  plan.kind = PositionKind::kInt16;
  const double step = std::exp2(std::floor(std::log2(wanted / kHalfDiagonal)));
  // Rounding to the grid moves each end by up to half a step.
  plan.max_side = step * (kSteps - 1);
  const bool grid_holds = step >= kFinestStep && longest_triangle(mesh) <= plan.max_side;
  if (grid_holds) return plan;
  if (!request.kind && kFloatStep * kHalfDiagonal <= wanted) {
    return PositionPlan{PositionKind::kFloat, 0.0, plan.mean_edge};
  }
  if (request.kind) {
    return too_fine(mesh, request, "no grid of 16-bit integers that fine spans its triangles");
  }
  return too_fine(
      mesh, request,
      "floats have one of " + std::to_string(kFloatStep * kHalfDiagonal * mesh.placement.scale));
}

std::vector<ChunkGrid> make_grids(const ChunkedMesh& chunked, PositionKind kind) {
  std::vector<ChunkGrid> grids(chunked.chunks.size());
  if (kind != PositionKind::kInt16) return grids;
  double side = 0;
  std::vector<Box> boxes;
  for (const Chunk& chunk : chunked.chunks) {
    boxes.push_back(box_of(chunked.mesh, chunk));
    side = std::max(side, longest_side(grid_box(boxes.back(), kFinestStep)));
  }
  double step = kFinestStep;
  while (side * kFinestStep > step * (kSteps - 1)) step *= 2;
  for (std::size_t c = 0; c < grids.size(); ++c) {
    grids[c] = {middle_of(grid_box(boxes[c], step)), step};
  }
  return grids;
}
namespace {

// Packing.

constexpr std::uint16_t kMinusZero = 0x8000;
constexpr double kDegrees = 57.29577951308232;
/// snorm8_to_float() of each code + 128: a table saves three divisions a normal.
constexpr std::array<double, 256> make_snorm8_values() {
  std::array<double, 256> values{};
  for (int c = -128; c < 128; ++c) {
    const double value = decode_normalised(static_cast<std::int8_t>(c));
    values[static_cast<std::size_t>(c + 128)] = static_cast<double>(static_cast<float>(value));
  }
  return values;
}
constexpr std::array<double, 256> kSnorm8Values = make_snorm8_values();

}  // namespace

namespace {

/// Morph targets that a vertex of the mesh has.
std::uint8_t targets_of(const TriMesh& mesh) {
  std::size_t most = 0;
  for (const VertexBones& bones : mesh.vertex_bones) {
    for (const auto& axis : bones.morphs) {
      for (std::size_t t = most; t < axis.size(); ++t) most = axis[t] != 0 ? t + 1 : most;
    }
  }
  return static_cast<std::uint8_t>(most);
}

}  // namespace

LayoutRecord make_layout(const TriMesh& mesh, PositionKind kind, VertexOffsets& offsets) {
  LayoutRecord layout{};
  const auto add = [&](Semantic semantic, ComponentType type, std::uint8_t components,
                       bool normalised, std::uint16_t offset) {
    AttributeRecord& a = layout.attributes[layout.attribute_count++];
    a.semantic = static_cast<std::uint8_t>(semantic);
    a.type = static_cast<std::uint8_t>(type);
    a.components = components;
    a.normalised = normalised ? 1 : 0;
    a.offset = offset;
  };
  offsets = VertexOffsets{};
  constexpr ComponentType kTypes[] = {ComponentType::kHalf, ComponentType::kI16,
                                      ComponentType::kF32};
  add(Semantic::kPosition, kTypes[static_cast<std::size_t>(kind)], 3, false, 0);
  if (kind == PositionKind::kInt16 && mesh.occlusion.empty()) {
    offsets.normal_components = 2;
    offsets.normal = 6;
    offsets.stride = 8;
    add(Semantic::kNormalOct, ComponentType::kI8, 2, true, offsets.normal);
  } else {
    // A byte is left behind it, for occlusion.
    offsets.normal = kind == PositionKind::kFloat ? 12 : 8;
    offsets.stride = static_cast<std::uint16_t>(offsets.normal + 4);
    if (!mesh.occlusion.empty()) offsets.occlusion = static_cast<std::uint16_t>(offsets.normal + 3);
    add(Semantic::kNormal, ComponentType::kI8, 3, true, offsets.normal);
  }
  if (!mesh.uvs.empty()) {
    offsets.uv = offsets.stride;
    add(Semantic::kUv, ComponentType::kU16, 2, true, offsets.uv);
    offsets.stride = static_cast<std::uint16_t>(offsets.stride + 4);
  }
  if (!mesh.colours.empty()) {
    offsets.colour = offsets.stride;
    add(Semantic::kColour, ComponentType::kU8, 4, true, offsets.colour);
    offsets.stride = static_cast<std::uint16_t>(offsets.stride + 4);
  }
  if (!mesh.vertex_bones.empty()) {
    offsets.bones = offsets.stride;
    add(Semantic::kJoints, ComponentType::kU8, 4, false, offsets.bones);
    add(Semantic::kWeights, ComponentType::kU8, 4, true,
        static_cast<std::uint16_t>(offsets.bones + 4));
    offsets.stride = static_cast<std::uint16_t>(offsets.stride + 8);
    offsets.morphs = offsets.stride;
    offsets.targets = targets_of(mesh);
    for (std::uint16_t axis = 0; axis < 3 && offsets.targets > 0; ++axis) {
      const auto semantic = static_cast<std::uint8_t>(Semantic::kMorphX) + axis;
      add(static_cast<Semantic>(semantic), ComponentType::kI16, offsets.targets, false,
          offsets.stride);
      offsets.stride = static_cast<std::uint16_t>(offsets.stride + 2 * offsets.targets);
    }
    offsets.stride = static_cast<std::uint16_t>((offsets.stride + 3) & ~3);
  }
  layout.stride = offsets.stride;
  return layout;
}

double ErrorTally::rms() const {
  return count == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(count));
}

void PackErrors::add(const PackErrors& other) {
  position.add(other.position);
  normal.add(other.normal);
  uv.add(other.uv);
}

void PackErrors::write(double scale, ModelRecord& record) const {
  record.position_error_max = position.greatest * scale;
  record.position_error_rms = position.rms() * scale;
  record.normal_error_max_deg = static_cast<float>(normal.greatest);
  record.normal_error_rms_deg = static_cast<float>(normal.rms());
  record.uv_error_max_texels = static_cast<float>(uv.greatest);
  record.uv_error_rms_texels = static_cast<float>(uv.rms());
}

UvRange uv_range(const TriMesh& mesh, const Chunk& chunk, std::uint32_t repeats) {
  UvRange range;
  if (mesh.uvs.empty()) return range;
  glm::dvec2 low(mesh.uvs[chunk.vertices[0]]);
  glm::dvec2 high(low);
  for (const std::uint32_t v : chunk.vertices) {
    low = glm::min(low, mesh.uvs[v]);
    high = glm::max(high, mesh.uvs[v]);
  }
  for (int i = 0; i < 2; ++i) {
    // A texture that repeats looks the same a whole number on; near 0 the device's floats are
    // finer.
    const Wrap wrap = texture_wrap(repeats)[static_cast<std::size_t>(i)];
    const double period = wrap == Wrap::kMirror ? 2 : 1;
    if (wrap != Wrap::kClamp) range.shift[i] = period * std::floor(low[i] / period);
    const double from = low[i] - range.shift[i];
    const double to = high[i] - range.shift[i];
    if (from >= -kUvSlack && to <= 1 + kUvSlack) continue;
    range.offset[i] = static_cast<float>(from);
    // Rounded up, so that the far end is still reached.
    range.scale[i] = std::nextafter(static_cast<float>(to - static_cast<double>(range.offset[i])),
                                    std::numeric_limits<float>::infinity());
  }
  return range;
}

void VertexPacker::pack(const Chunk& chunk, const ChunkGrid& grid, const UvRange& uv,
                        std::uint32_t texture_side, std::byte* bytes,
                        std::vector<glm::vec3>& decoded) {
  errors_ = PackErrors();
  decoded.resize(chunk.vertices.size());
  for (std::size_t i = 0; i < chunk.vertices.size(); ++i, bytes += offsets_.stride) {
    const std::uint32_t v = chunk.vertices[i];
    const glm::dvec3& p = mesh_.positions[v];
    const glm::dvec3 n(mesh_.normals[v]);
    glm::vec3& at = decoded[i];
    if (kind_ == PositionKind::kInt16) {
      at = put_int16(p, grid, bytes);
    } else {
      at = kind_ == PositionKind::kHalf ? put_half(p, bytes) : put_float(p, bytes);
    }
    errors_.position.add(glm::length(glm::dvec3(at) - p));
    std::byte* const normal = bytes + offsets_.normal;
    add_normal_error(offsets_.normal_components == 2 ? put_oct(n, normal) : put_normal(n, normal),
                     n);
    if (offsets_.uv != 0) put_uv(mesh_.uvs[v], uv, texture_side, bytes + offsets_.uv);
    if (offsets_.occlusion != 0) bytes[offsets_.occlusion] = std::byte{mesh_.occlusion[v]};
    if (offsets_.colour != 0) std::memcpy(bytes + offsets_.colour, &mesh_.colours[v], 4);
    if (offsets_.bones != 0) {
      std::memcpy(bytes + offsets_.bones, mesh_.vertex_bones[v].bones.data(), 4);
      std::memcpy(bytes + offsets_.bones + 4, mesh_.vertex_bones[v].bytes().data(), 4);
      const std::size_t words = 2 * std::size_t{offsets_.targets};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::memcpy(bytes + offsets_.morphs + axis * words,
                    mesh_.vertex_bones[v].morphs[axis].data(), words);
      }
    }
  }
}

glm::vec3 VertexPacker::put_float(const glm::dvec3& p, std::byte* bytes) {
  const glm::vec3 decoded = glm::vec3(p) + 0.0f;  // one point, one spelling: no -0
  std::memcpy(bytes, &decoded, sizeof decoded);
  return decoded;
}

glm::vec3 VertexPacker::put_half(const glm::dvec3& p, std::byte* bytes) {
  std::uint16_t halves[3];
  glm::vec3 decoded;
  for (int i = 0; i < 3; ++i) {
    halves[i] = float_to_half(static_cast<float>(p[i]));
    if (halves[i] == kMinusZero) halves[i] = 0;  // one point, one spelling
    decoded[i] = half_to_float(halves[i]);
  }
  std::memcpy(bytes, halves, sizeof halves);
  return decoded;
}

glm::vec3 VertexPacker::put_int16(const glm::dvec3& p, const ChunkGrid& grid, std::byte* bytes) {
  std::int16_t values[3];
  glm::vec3 decoded;
  const auto step = static_cast<float>(grid.step);
  for (int i = 0; i < 3; ++i) {
    values[i] = static_cast<std::int16_t>(grid_index(p[i], grid.step) - grid.middle[i]);
    // Exact: multiples of the step are floats.
    const float offset = static_cast<float>(grid.middle[i]) * step;
    decoded[i] = offset + step * static_cast<float>(values[i]);
  }
  std::memcpy(bytes, values, sizeof values);
  return decoded;
}

glm::dvec3 VertexPacker::put_normal(const glm::dvec3& n, std::byte* bytes) {
  std::int8_t values[3];
  glm::dvec3 decoded;
  for (int i = 0; i < 3; ++i) {
    values[i] = float_to_snorm8(static_cast<float>(n[i]));
    decoded[i] = kSnorm8Values[static_cast<std::size_t>(values[i] + 128)];
  }
  std::memcpy(bytes, values, sizeof values);
  return decoded;
}

glm::dvec3 VertexPacker::put_oct(const glm::dvec3& n, std::byte* bytes) {
  const std::array<std::int8_t, 2> values = normal_to_oct8({n.x, n.y, n.z});
  std::memcpy(bytes, values.data(), sizeof values);
  return oct_to_normal((2.0 * values[0] + 1.0) / 255.0, (2.0 * values[1] + 1.0) / 255.0);
}

void VertexPacker::add_normal_error(const glm::dvec3& decoded, const glm::dvec3& n) {
  // Small angles drown in an arc cosine, and nearly all are small: the first terms of the arc
  // sine's series hold nine digits.
  const double sine = glm::length(glm::cross(decoded, n)) / glm::length(decoded);
  const double square = sine * sine;
  const double angle = glm::dot(decoded, n) > 0 && sine < 0.05
                           ? sine * (1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0)))
                           : std::atan2(sine, glm::dot(decoded, n) / glm::length(decoded));
  errors_.normal.add(angle * kDegrees);
}

void VertexPacker::put_uv(const glm::dvec2& uv, const UvRange& range, std::uint32_t texture_side,
                          std::byte* bytes) {
  std::uint16_t values[2];
  glm::dvec2 error;
  for (int i = 0; i < 2; ++i) {
    const double wanted = uv[i] - range.shift[i];
    const auto offset = static_cast<double>(range.offset[i]);
    const auto scale = static_cast<double>(range.scale[i]);
    values[i] = float_to_unorm16(static_cast<float>((wanted - offset) / scale));
    error[i] = offset + scale * static_cast<double>(unorm16_to_float(values[i])) - wanted;
  }
  std::memcpy(bytes, values, sizeof values);
  if (texture_side != 0) errors_.uv.add(glm::length(error) * texture_side);
}
// Decoding.

VertexDecoder::VertexDecoder(const LayoutRecord& layout) : layout_(layout) {}

glm::dvec3 VertexDecoder::position(const std::byte* vertex, const ChunkRecord& chunk) const {
  const AttributeRecord* a = find_attribute(layout_, Semantic::kPosition);
  glm::dvec3 p(0.0);
  for (int i = 0; a != nullptr && i < 3; ++i) {
    p[i] = static_cast<double>(chunk.position_offset[i]) +
           static_cast<double>(chunk.position_step) *
               decode_component(*a, vertex, static_cast<unsigned>(i));
  }
  return p;
}

glm::dvec3 oct_to_normal(double x, double y) {
  // Meyer et al., "On floating-point normal vectors", 2010: the octahedron's lower half is folded
  // over its upper one.
  const double z = 1.0 - std::abs(x) - std::abs(y);
  if (z >= 0) return {x, y, z};
  return {(1.0 - std::abs(y)) * (x < 0 ? -1.0 : 1.0), (1.0 - std::abs(x)) * (y < 0 ? -1.0 : 1.0),
          z};
}

glm::dvec3 VertexDecoder::normal(const std::byte* vertex) const {
  glm::dvec3 n(0.0);
  if (const AttributeRecord* a = find_attribute(layout_, Semantic::kNormal); a != nullptr) {
    for (unsigned i = 0; i < 3; ++i) n[static_cast<int>(i)] = decode_component(*a, vertex, i);
  } else if (const AttributeRecord* oct = find_attribute(layout_, Semantic::kNormalOct);
             oct != nullptr) {
    n = oct_to_normal(decode_component(*oct, vertex, 0), decode_component(*oct, vertex, 1));
  }
  const double length = glm::length(n);
  return length > 0 ? n / length : glm::dvec3(0, 0, 1);
}

glm::dvec2 VertexDecoder::uv(const std::byte* vertex, const ChunkRecord& chunk) const {
  const AttributeRecord* a = find_attribute(layout_, Semantic::kUv);
  glm::dvec2 uv(0.0);
  for (int i = 0; a != nullptr && i < 2; ++i) {
    uv[i] = static_cast<double>(chunk.uv_offset[i]) +
            static_cast<double>(chunk.uv_scale[i]) *
                decode_component(*a, vertex, static_cast<unsigned>(i));
  }
  return uv;
}

glm::dvec4 VertexDecoder::colour(const std::byte* vertex) const {
  const AttributeRecord* a = find_attribute(layout_, Semantic::kColour);
  glm::dvec4 colour(1.0);
  for (int i = 0; a != nullptr && i < 4; ++i) {
    colour[i] = decode_component(*a, vertex, static_cast<unsigned>(i));
  }
  return colour;
}

}  // namespace modar
