// EXT_meshopt_compression and KHR_meshopt_compression: glTF files with buffer views that
// meshoptimizer has encoded. Internal to the glTF reader.
#pragma once

#include <string>

#include "bake/import/read_model.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// The file with these views decoded, as a GLB; `file` itself where it has none. folder: where the
/// names of buffers are looked up, with a trailing slash. label: the file's name in errors.
/// Errors: kInvalidInput "gltf.meshopt", which names the buffer view; kUnsupported where the result
/// is larger than a GLB can be, or the view was encoded by a newer version than the library reads,
/// with its place and the command that converts the file.
Result<std::string> decode_meshopt_views(std::string file, const ModelFolder& folder,
                                         const std::string& label);

}  // namespace modar
