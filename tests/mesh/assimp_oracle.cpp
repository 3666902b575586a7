// The one file that holds assimp.
#include "tests/mesh/assimp_oracle.hpp"

#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar::testing {

SurfaceFigures load_with_assimp(const std::string& path) {
  SurfaceFigures figures;
  Assimp::Importer importer;
  const aiScene* const scene = importer.ReadFile(path, 0);
  if (scene == nullptr) return figures;
  figures.loaded = true;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const auto at = [&](unsigned i) {
      const aiVector3D& v = mesh.mVertices[i];
      return glm::dvec3(v.x, v.y, v.z);
    };
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) continue;
      ++figures.faces;
      figures.corners += face.mNumIndices;
      const glm::dvec3 origin = at(face.mIndices[0]);
      glm::dvec3 area(0.0);
      for (unsigned i = 0; i < face.mNumIndices; ++i) {
        const glm::dvec3 p = at(face.mIndices[i]);
        const glm::dvec3 q = at(face.mIndices[(i + 1) % face.mNumIndices]);
        area += glm::cross(p - origin, q - origin);
        figures.low = glm::min(figures.low, p);
        figures.high = glm::max(figures.high, p);
      }
      figures.area += 0.5 * glm::length(area);
    }
  }
  return figures;
}

}  // namespace modar::testing
