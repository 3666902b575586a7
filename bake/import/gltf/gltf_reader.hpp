// glTF 2.0 and GLB to SourceModel.
#pragma once

#include <string>

#include "bake/import/source_model.hpp"
#include "formats/error.hpp"

namespace modar {

/// Reads a .gltf with its buffers, or a .glb, through tinygltf: triangles of the meshes of the
/// default scene (of all root nodes where there is none), moved by their nodes; normals, the uv set
/// that the base colour texture names, first vertex colours; base colour, emission, roughness and
/// opacity of materials; Draco-compressed primitives. Images inside the file become temporary files
/// that live as long as the model's materials. What is left out (points, lines, skins, morph
/// targets) is a finding. Errors: kIo "gltf.open", kInvalidInput "gltf.read", "gltf.no-faces",
/// "gltf.accessor" (data outside of its buffer, an index beyond its vertices).
Result<SourceModel> read_gltf(const std::string& path);

}  // namespace modar
