// Draco on a whole model, as its users would: float attributes, Draco's own quantisation.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include "bake/extensions/lab/ship_bench.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/process/thread_clock.hpp"

namespace modar {
namespace {

constexpr int kNormalBits = 9;
constexpr int kUvBits = 16;

/// A model's level 0 as floats, chunk after chunk.
struct FloatMesh {
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<float> uvs;
  std::vector<std::uint8_t> colours;
  std::vector<std::uint32_t> indices;
};

FloatMesh floats_of(const BundleView& bundle, const ModelRecord& model) {
  FloatMesh mesh;
  const VertexDecoder decoder(bundle.layouts()[model.layout]);
  const auto append = [](std::vector<float>& to, const auto& values, int count) {
    for (int c = 0; c < count; ++c) to.push_back(static_cast<float>(values[c]));
  };
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    const LevelRecord& level = bundle.levels()[chunk.first_level];
    std::vector<std::uint16_t> indices(level.index_count);
    std::memcpy(indices.data(), bundle.indices().data() + level.index_offset, 2 * indices.size());
    const auto [low, high] = std::minmax_element(indices.begin(), indices.end());
    const auto base = static_cast<std::uint32_t>(mesh.positions.size() / 3) - *low;
    for (const std::uint16_t index : indices) mesh.indices.push_back(base + index);
    for (std::uint32_t v = *low; v <= *high; ++v) {
      const std::byte* at =
          bundle.vertices().data() + level.vertex_offset + std::size_t{v} * decoder.stride();
      append(mesh.positions, decoder.position(at, chunk), 3);
      append(mesh.normals, decoder.normal(at), 3);
      if (decoder.has(Semantic::kUv)) append(mesh.uvs, decoder.uv(at, chunk), 2);
      if (!decoder.has(Semantic::kColour)) continue;
      const glm::dvec4 colour = decoder.colour(at);
      for (int i = 0; i < 4; ++i) {
        mesh.colours.push_back(static_cast<std::uint8_t>(std::lround(255 * colour[i])));
      }
    }
  }
  return mesh;
}

void add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, std::uint8_t components,
                   draco::DataType kind, std::size_t size, const void* values, bool normalised) {
  draco::GeometryAttribute shape;
  shape.Init(type, nullptr, components, kind, normalised, static_cast<std::int64_t>(size), 0);
  const int id = mesh.AddAttribute(shape, true, mesh.num_points());
  for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                          static_cast<const char*>(values) + i * size);
  }
}

void to_draco(const FloatMesh& from, draco::Mesh& mesh) {
  mesh.set_num_points(static_cast<std::uint32_t>(from.positions.size() / 3));
  mesh.SetNumFaces(from.indices.size() / 3);
  for (std::uint32_t f = 0; f < from.indices.size() / 3; ++f) {
    mesh.SetFace(draco::FaceIndex(f), {draco::PointIndex(from.indices[3 * f]),
                                       draco::PointIndex(from.indices[3 * f + 1]),
                                       draco::PointIndex(from.indices[3 * f + 2])});
  }
  using Attribute = draco::GeometryAttribute;
  add_attribute(mesh, Attribute::POSITION, 3, draco::DT_FLOAT32, 12, from.positions.data(), false);
  add_attribute(mesh, Attribute::NORMAL, 3, draco::DT_FLOAT32, 12, from.normals.data(), false);
  if (!from.uvs.empty()) {
    add_attribute(mesh, Attribute::TEX_COORD, 2, draco::DT_FLOAT32, 8, from.uvs.data(), false);
  }
  if (!from.colours.empty()) {
    add_attribute(mesh, Attribute::COLOR, 4, draco::DT_UINT8, 4, from.colours.data(), true);
  }
  mesh.DeduplicateAttributeValues();
  mesh.DeduplicatePointIds();
}

/// Of Draco's grid over a box whose largest side is 2, in the model's space.
double grid_rms(int bits) {
  const double step = 2.0 / ((1 << bits) - 1);
  return step / std::sqrt(12.0) * std::sqrt(3.0);
}

}  // namespace

DracoPeer encode_with_draco(const BundleView& bundle, std::uint32_t model) {
  const ModelRecord& record = bundle.models()[model];
  DracoPeer peer;
  peer.position_bits = 8;
  while (peer.position_bits < 20 &&
         grid_rms(peer.position_bits) > record.position_error_rms / record.scale) {
    ++peer.position_bits;
  }
  draco::Mesh mesh;
  to_draco(floats_of(bundle, record), mesh);
  draco::Encoder encoder;
  encoder.SetSpeedOptions(0, 0);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, peer.position_bits);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, kNormalBits);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::TEX_COORD, kUvBits);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(mesh, &buffer).ok()) return peer;
  peer.bytes = buffer.size();
  const double begin = thread_seconds();
  draco::DecoderBuffer input;
  input.Init(buffer.data(), buffer.size());
  draco::Decoder decoder;
  const bool decoded = decoder.DecodeMeshFromBuffer(&input).ok();
  peer.decode_s = decoded ? thread_seconds() - begin : 0;
  return peer;
}

}  // namespace modar
