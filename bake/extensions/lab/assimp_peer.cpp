// assimp as people call it to read an OBJ: no post-processing.
#include "bake/extensions/lab/probe_peers.hpp"

#ifdef MODAR_HAVE_ASSIMP
#include <assimp/scene.h>
#include <assimp/Importer.hpp>
#endif

namespace modar {

std::uint64_t parse_with_assimp([[maybe_unused]] const std::string& path) {
  std::uint64_t faces = 0;
#ifdef MODAR_HAVE_ASSIMP
  Assimp::Importer importer;
  const aiScene* const scene = importer.ReadFile(path, 0);
  for (unsigned m = 0; scene != nullptr && m < scene->mNumMeshes; ++m) {
    faces += scene->mMeshes[m]->mNumFaces;
  }
#endif
  return faces;
}

}  // namespace modar
