// The door of this room: model files to SourceModel.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bake/import/source_model.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct ReadOptions {
  unsigned jobs = 1;  ///< threads; the result does not depend on it
  /// A picture that is named as the model may be its texture. False where that picture is a
  /// pattern.
  bool own_picture = true;
};

/// Errors: those of the reader; kUnsupported "model.format" that lists what can be read.
Result<SourceModel> read_model(const std::string& path, const ReadOptions& options);

/// Is it a file that read_model() has a reader for, by its extension?
bool is_model_file(const std::string& path);

/// Is a picture's stem that of a model and a word for its colours, as "pawn_albedo" of "pawn"? Such
/// a picture is the texture of a model that names no material file.
bool is_texture_name(std::string_view picture, std::string_view model);

/// Is a picture's stem, by its start, that of a model and, by its last word, a map of any kind, as
/// "pawn_low_normal" of "pawn" and "pawn_albedo" of "pawn_low"? Such a picture is no pattern.
bool is_map_name(std::string_view picture, std::string_view model);

/// Is a picture's stem that of a model? Such a picture is its texture where ReadOptions and its
/// sides allow it, and nothing else is.
bool is_own_picture(std::string_view picture, std::string_view model);

/// The existing regular file that `name` in a model refers to, looked up in `folder` (absolute
/// names are tried as they are, too); empty where there is none. Tried in this order: as written;
/// without quotes and escapes, backslashes as slashes; with any case; the bare file name in
/// `folder`, with any case.
std::string find_named_file(std::string_view name, const std::string& folder);

/// The same as an error. Errors: kUnsupported
/// "model.format", whose cure converts what it is.
Result<void> require_model_format(const std::string& path);

/// An OBJ file that begins with zeros, or is large and has some inside, as a copy that broke off
/// leaves: read_model() refuses it. A few looks, however large it is.
bool is_broken_off(const std::string& path);

/// An OBJ text is parsed in blocks of so many bytes, each by one thread. Small enough for a block
/// and what it parses to to stay in a core's second-level cache, and for little memory to be
/// touched for small files: of 2^16 to 2^18 the fastest, by a tenth on scans of 10 MB.
inline constexpr std::uint64_t kObjBlockBytes = std::uint64_t{1} << 17;

/// Reads an OBJ file and the MTL files it names. Positions are parsed in double with correct
/// rounding. Oddities become diagnostics with their line; an error is returned only where nothing
/// is left to read: kIo "io.open"; kInvalidInput "obj.utf16", "obj.not-text" (see is_broken_off()),
/// "obj.no-faces", "obj.too-large".
Result<SourceModel> read_obj(const std::string& path, const ReadOptions& options = {});

/// The same from memory, for fuzzing and tests. folder: where mtllib names are looked up; empty:
/// material files are not read. label: the file's name in diagnostics.
Result<SourceModel> parse_obj(std::string_view text, const std::string& folder,
                              const std::string& label, const ReadOptions& options = {});

/// Materials of an MTL text. Map paths are resolved against `folder` (backslashes, quotes, wrong
/// case, options and blanks in names are handled). label: the file's name in diagnostics. missing:
/// receives the paths of maps that are not there, where given.
std::vector<SourceMaterial> parse_mtl(std::string_view text, const std::string& folder,
                                      const std::string& label,
                                      std::vector<Diagnostic>& diagnostics,
                                      std::vector<std::string>* missing = nullptr);

/// Reads a binary or ASCII STL: triangles, in the colours of the usual extensions of the format
/// where it has them. Corners of equal coordinates become one position. Errors: kIo "io.open";
/// kInvalidInput "stl.short" (fewer bytes than its triangles need), "stl.text" (a line that is none
/// of the format), "stl.no-faces".
Result<SourceModel> read_stl(const std::string& path);
Result<SourceModel> parse_stl(std::string_view bytes, const std::string& label);

/// Reads a binary or ASCII PLY: positions, normals, uvs and colours of vertices, uvs of corners,
/// polygons and triangle strips. Errors: kIo "io.open"; kInvalidInput "ply.header", "ply.short"
/// (the file ends within an element), "ply.number", "ply.no-faces" (a point cloud).
Result<SourceModel> read_ply(const std::string& path, const ReadOptions& options = {});
Result<SourceModel> parse_ply(std::string_view bytes, const std::string& label);

/// Reads a .gltf with its buffers, or a .glb, through tinygltf: the triangles of the default
/// scene's meshes (of all root nodes where there is none), transformed by their nodes; normals, the
/// uv set that the base colour texture names, first vertex colours; base colour, emission,
/// roughness and opacity of materials; Draco-compressed primitives. Images inside the file become
/// temporary files that live as long as the model's materials. Whatever is left out (points, lines,
/// skins, morph targets) becomes a diagnostic. Errors: kIo "io.open", kInvalidInput "gltf.read",
/// "gltf.no-faces", "gltf.accessor" (data outside of its buffer, an index beyond its vertices);
/// kUnsupported "gltf.version" (glTF 1.0), "gltf.extension" (required extensions that are not read,
/// by name), "gltf.meshopt" (views of a newer codec). The last two say which command converts what
/// a tool can.
Result<SourceModel> read_gltf(const std::string& path);

}  // namespace modar
