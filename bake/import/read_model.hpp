// The door of this room: model files to SourceModel.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bake/import/source_model.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Where the files that a model names are looked up.
struct ModelFolder {
  // A path alone is such a folder, too.
  ModelFolder(std::string folder_path, std::string may_read = "")  // NOLINT
      : path(std::move(folder_path)), within(std::move(may_read)) {}
  ModelFolder(const char* folder_path) : path(folder_path) {}  // NOLINT
  /// Whether a file is there and may be read.
  [[nodiscard]] bool has(const std::string& file) const;

  std::string path;    ///< empty: nothing is read
  std::string within;  ///< files outside of this folder are not read; empty: all are
};

struct ReadOptions {
  unsigned jobs = 1;  ///< threads; the result does not depend on it
  /// A picture that is named as the model may be its texture. False where that picture is a
  /// pattern.
  bool own_picture = true;
  std::string within = "";  ///< as in ModelFolder
  bool clips = true;        ///< false: all stays in the pose of the file
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
/// names are tried unchanged, too); empty if none. Tried in this order: as written;
/// without quotes and escapes, backslashes as slashes; in any spelling (case, Unicode form, cp1252,
/// percent codes); the tails of its path in `folder`, the longest first; its name in "textures" and
/// "../textures".
std::string find_named_file(std::string_view name, const ModelFolder& folder);

/// The warning of a file that a model names and that find_named_file() does not find: missing, or
/// outside of the folder that may be read. what: "texture 'a.png'". missing: the cure where it is
/// missing.
Diagnostic not_read(const char* id, const std::string& label, std::uint64_t line,
                    const std::string& what, const std::string& name, const ModelFolder& folder,
                    const char* missing);

/// Refuses what read_model() has no reader for, by its extension and its first bytes. Errors:
/// kUnsupported "model.format", whose cure converts the file; those of require_kind().
Result<void> require_model_format(const std::string& path);

/// An OBJ file that begins with zeros, or is large and has some inside, as a copy that broke off
/// leaves: read_model() refuses it. A few looks, however large it is.
bool is_broken_off(const std::string& path);

/// Bytes of an OBJ text that one thread parses. Larger leaves the second-level cache, smaller has
/// more overhead. [65536, 262144]
inline constexpr std::uint64_t kObjBlockBytes = std::uint64_t{1} << 17;

/// Reads an OBJ file and the MTL files it names. Positions are parsed in double with correct
/// rounding. Oddities become diagnostics with their line; an error is returned only where nothing
/// is left to read: kIo "io.open"; kInvalidInput "obj.utf16", "obj.not-text" (see is_broken_off()),
/// "obj.no-faces", "obj.too-large".
Result<SourceModel> read_obj(const std::string& path, const ReadOptions& options = {});

/// The same from memory, for fuzzing and tests. folder: where mtllib names are looked up; empty:
/// material files are not read. label: the file's name in diagnostics.
Result<SourceModel> parse_obj(std::string_view text, const ModelFolder& folder,
                              const std::string& label, const ReadOptions& options = {});

/// Materials of an MTL text. Map paths are resolved against `folder` (backslashes, quotes, wrong
/// case, options and blanks in names are handled). label: the file's name in diagnostics. missing:
/// receives the paths of maps that are not there, where given.
std::vector<SourceMaterial> parse_mtl(std::string_view text, const ModelFolder& folder,
                                      const std::string& label,
                                      std::vector<Diagnostic>& diagnostics,
                                      std::vector<std::string>* missing = nullptr);

/// Reads a binary or ASCII STL: triangles, in the colours of the usual extensions of the format
/// where it has them. Corners of equal coordinates become one position. Errors: kIo "io.open";
/// kInvalidInput "stl.short" (fewer bytes than its triangles need), "stl.text" (a line that is not
/// of the format), "stl.no-faces".
Result<SourceModel> read_stl(const std::string& path);
Result<SourceModel> parse_stl(std::string_view bytes, const std::string& label);

/// Reads a binary or ASCII PLY: positions, normals, uvs and colours of vertices, uvs of corners,
/// polygons and triangle strips. Errors: kIo "io.open"; kInvalidInput "ply.header", "ply.short"
/// (the file ends within an element), "ply.number", "ply.no-faces" (a point cloud).
Result<SourceModel> read_ply(const std::string& path, const ReadOptions& options = {});
Result<SourceModel> parse_ply(std::string_view bytes, const std::string& label);

/// Reads a .gltf with its buffers, or a .glb, through tinygltf: the triangles of the default
/// scene's meshes (of all root nodes without one), transformed by their nodes; normals, the
/// uv set that the base colour texture names, first vertex colours; base colour, emission,
/// roughness and opacity of materials; morph targets at their default weights; Draco-compressed
/// primitives. Nodes that KHR_node_visibility hides are left out. Images inside the file become
/// temporary files that live as long as the model's materials. Whatever is left out (points, lines,
/// animations) becomes a diagnostic. Errors: kIo "io.open", kInvalidInput "gltf.read",
/// "gltf.no-faces", "gltf.accessor" (data outside of its buffer, an index beyond its vertices);
/// kUnsupported "gltf.version" (glTF 1.0), "gltf.extension" (required extensions that are not read,
/// by name), "gltf.meshopt" (views of a newer codec). The last two say which command converts what
/// a tool can.
Result<SourceModel> read_gltf(const std::string& path, const ReadOptions& options = {});

}  // namespace modar
