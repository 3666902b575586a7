// tinyobjloader, built with doubles as our reader parses them (Debian's library has floats).
#include "bake/bench/probe_peers.hpp"

#ifdef MODAR_HAVE_TINYOBJ
#define TINYOBJLOADER_USE_DOUBLE
#define TINYOBJLOADER_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#include <tiny_obj_loader.h>
#pragma GCC diagnostic pop
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
