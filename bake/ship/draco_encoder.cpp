// Encodes integer attributes with Draco: the only file of bake/ship that includes it.
#include <array>
#include <cstring>

#include <draco/compression/expert_encode.h>

#include "bake/ship/mesh_encoder.hpp"

namespace modar {
namespace {

draco::GeometryAttribute::Type type_of(DracoInput::Kind kind) {
  switch (kind) {
    case DracoInput::Kind::kPosition:
      return draco::GeometryAttribute::POSITION;
    case DracoInput::Kind::kNormal:
      return draco::GeometryAttribute::NORMAL;
    case DracoInput::Kind::kUv:
      return draco::GeometryAttribute::TEX_COORD;
    default:
      return draco::GeometryAttribute::GENERIC;
  }
}

void add_attribute(const DracoInput& input, draco::Mesh& mesh) {
  const bool normal = input.kind == DracoInput::Kind::kNormal;
  const auto type = normal ? draco::DT_FLOAT32 : draco::DT_INT32;
  draco::GeometryAttribute shape;
  shape.Init(type_of(input.kind), nullptr, static_cast<std::uint8_t>(input.components), type, false,
             4 * input.components, 0);
  const auto count = static_cast<std::uint32_t>(input.values.size() / input.components);
  const int id = mesh.AddAttribute(shape, false, count);
  draco::PointAttribute& attribute = *mesh.attribute(id);
  for (std::uint32_t v = 0; v < count; ++v) {
    const std::int32_t* value = input.values.data() + std::size_t{v} * input.components;
    std::array<float, 4> floats{};
    for (std::uint32_t c = 0; c < input.components; ++c) floats[c] = static_cast<float>(value[c]);
    attribute.SetAttributeValue(draco::AttributeValueIndex(v),
                                normal ? static_cast<const void*>(floats.data()) : value);
  }
  for (std::uint32_t p = 0; p < input.value_of_vertex.size(); ++p) {
    attribute.SetPointMapEntry(draco::PointIndex(p),
                               draco::AttributeValueIndex(input.value_of_vertex[p]));
  }
}

}  // namespace

std::optional<std::vector<std::byte>> encode_draco(std::span<const DracoInput> attributes,
                                                   std::span<const std::uint16_t> indices,
                                                   std::uint32_t vertex_count, int normal_bits) {
  draco::Mesh mesh;
  mesh.set_num_points(vertex_count);
  mesh.SetNumFaces(indices.size() / 3);
  for (std::uint32_t f = 0; f < indices.size() / 3; ++f) {
    mesh.SetFace(draco::FaceIndex(f),
                 {draco::PointIndex(indices[3 * f]), draco::PointIndex(indices[3 * f + 1]),
                  draco::PointIndex(indices[3 * f + 2])});
  }
  for (const DracoInput& input : attributes) add_attribute(input, mesh);
  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(0, 0);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  for (std::size_t a = 0; a < attributes.size(); ++a) {
    const auto id = static_cast<std::int32_t>(a);
    if (attributes[a].kind == DracoInput::Kind::kNormal) {
      encoder.SetAttributeQuantization(id, normal_bits);
    } else if (normal_bits == kNoMap) {
      // Numbers have nothing to predict; the order of the values does not depend on the predictor.
      encoder.SetAttributePredictionScheme(id, draco::PREDICTION_DIFFERENCE);
    } else if (attributes[a].kind == DracoInput::Kind::kUv) {
      // They are integers already; the bit width enables Draco's texture coordinate predictor.
      encoder.SetAttributeQuantization(id, 16);
    }
  }
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return std::nullopt;
  std::vector<std::byte> bytes(buffer.size());
  std::memcpy(bytes.data(), buffer.data(), buffer.size());
  return bytes;
}

}  // namespace modar
