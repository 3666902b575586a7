// How long tinyobjloader takes.
#include "bake/extensions/lab/probe_peers.hpp"

#ifdef MODAR_HAVE_TINYOBJ
#include "bake/extensions/lab/tinyobj_library.hpp"
#endif

namespace modar {

std::uint64_t parse_with_tinyobj([[maybe_unused]] const std::string& path) {
  std::uint64_t faces = 0;
#ifdef MODAR_HAVE_TINYOBJ
  tinyobj::ObjReader reader;
  if (!reader.ParseFromFile(path)) return 0;
  for (const auto& shape : reader.GetShapes()) faces += shape.mesh.num_face_vertices.size();
#endif
  return faces;
}

}  // namespace modar
