// Draco buffers of integer attributes to plain arrays: the only file of the device that includes
// Draco.
#include <cstring>
#include <memory>

#include <draco/compression/decode.h>

#include "modar/piece.hpp"

namespace modar {
namespace {

/// Of a chunk: 16-bit indices bound its vertices; the faces bound memory, 12 MB of indices.
constexpr std::uint32_t kMaxPoints = 65536;
constexpr std::uint32_t kMaxFaces = 1u << 20;

tl::unexpected<Error> broken(const char* cause) {
  return fail(ExitCode::kInvalidInput, "mesh.draco", "mesh object", cause,
              "publish the release again");
}

bool copy_values(const draco::PointAttribute& from, std::uint32_t points, DracoValues& to) {
  if (from.data_type() != draco::DT_INT32 && from.data_type() != draco::DT_UINT32) return false;
  to.components = static_cast<std::uint32_t>(from.num_components());
  if (to.components == 0 || to.components > 4 || from.size() > kMaxPoints) return false;
  to.values.resize(std::size_t{to.components} * from.size());
  for (std::size_t v = 0; v < from.size(); ++v) {
    from.GetValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(v)),
                  to.values.data() + v * to.components);
  }
  to.value_of_point.resize(points);
  for (std::uint32_t p = 0; p < points; ++p) {
    const std::uint32_t value = from.mapped_index(draco::PointIndex(p)).value();
    if (value >= from.size()) return false;
    to.value_of_point[p] = value;
  }
  return true;
}

}  // namespace

Result<DracoMesh> decode_draco(std::span<const std::byte> buffer) {
  draco::DecoderBuffer input;
  input.Init(reinterpret_cast<const char*>(buffer.data()), buffer.size());
  draco::Decoder decoder;
  decoder.SetSkipAttributeTransform(draco::GeometryAttribute::NORMAL);
  auto decoded = decoder.DecodeMeshFromBuffer(&input);
  if (!decoded.ok()) return broken("Draco cannot decode it");
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  if (mesh->num_points() > kMaxPoints || mesh->num_faces() > kMaxFaces) {
    return broken("it exceeds the limits of a chunk");
  }
  DracoMesh out;
  out.point_count = mesh->num_points();
  out.corners.reserve(3 * std::size_t{mesh->num_faces()});
  for (std::uint32_t f = 0; f < mesh->num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh->face(draco::FaceIndex(f));
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t point = face[c].value();
      if (point >= out.point_count) return broken("a triangle refers to a missing point");
      out.corners.push_back(point);
    }
  }
  out.attributes.resize(static_cast<std::size_t>(mesh->num_attributes()));
  for (std::size_t a = 0; a < out.attributes.size(); ++a) {
    if (!copy_values(*mesh->attribute(static_cast<std::int32_t>(a)), out.point_count,
                     out.attributes[a])) {
      return broken("an attribute is not of integers");
    }
  }
  return out;
}

}  // namespace modar
