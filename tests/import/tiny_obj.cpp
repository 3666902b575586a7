// tinyobjloader's arrays as ours are.
#include "tests/import/tiny_obj.hpp"

#ifdef MODAR_HAVE_TINYOBJ
#include "bake/extensions/lab/tinyobj_library.hpp"
#endif

namespace modar::testing {

#ifdef MODAR_HAVE_TINYOBJ

bool has_tinyobj() {
  return true;
}

TinyModel load_with_tinyobj(const std::string& path) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = false;
  config.vertex_color = false;
  tinyobj::ObjReader reader;
  TinyModel model;
  model.loaded = reader.ParseFromFile(path, config);
  const tinyobj::attrib_t& attributes = reader.GetAttrib();
  for (std::size_t i = 0; i + 2 < attributes.vertices.size(); i += 3) {
    model.positions.emplace_back(attributes.vertices[i], attributes.vertices[i + 1],
                                 attributes.vertices[i + 2]);
  }
  for (std::size_t i = 0; i + 1 < attributes.texcoords.size(); i += 2) {
    model.uvs.emplace_back(attributes.texcoords[i], attributes.texcoords[i + 1]);
  }
  for (std::size_t i = 0; i + 2 < attributes.normals.size(); i += 3) {
    model.normals.emplace_back(attributes.normals[i], attributes.normals[i + 1],
                               attributes.normals[i + 2]);
  }
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    for (const unsigned size : shape.mesh.num_face_vertices) model.face_sizes.push_back(size);
    for (const tinyobj::index_t& i : shape.mesh.indices) {
      model.corners.push_back({i.vertex_index, i.texcoord_index, i.normal_index});
    }
  }
  return model;
}

#else

bool has_tinyobj() {
  return false;
}

TinyModel load_with_tinyobj(const std::string& /*path*/) {
  return {};
}

#endif

}  // namespace modar::testing
