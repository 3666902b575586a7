// What a bake says of itself: stages as they run, diagnostics as they turn up. The progress bar,
// --json and the summary all read this one stream.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/up_axis.hpp"

namespace modar {

/// Told when a stage begins or moves on: its name and how much of it is done (0 to 1).
using ProgressCallback = std::function<void(const std::string& stage, double done)>;

enum class DiagnosticSeverity : std::uint8_t { kInfo, kWarning, kError };

/// Something in the input that a person may want to know or repair; the bake continues.
struct Diagnostic {
  std::string id;  ///< stable, "obj.missing-mtl"
  DiagnosticSeverity severity = DiagnosticSeverity::kWarning;
  std::string file;        ///< as the user named it
  std::uint64_t line = 0;  ///< 1 for the first; 0: the whole file
  std::string message;
  std::string cure;
};

/// One stage that has run. `in` and `out` count what the stage's name suggests (faces, vertices,
/// pixels, keypoints); max_error in the stage's unit, 0 where it is exact.
struct StageReport {
  std::string name;
  double ms = 0;
  std::uint64_t in = 0;
  std::uint64_t out = 0;
  double max_error = 0;
};

/// A half-edge mesh, as OpenMesh builds it.
struct HalfEdgeCount {
  std::uint64_t boundary_loops = 0;  ///< where fans touch, a walk goes from one to the next
  std::uint64_t copied_faces = 0;    ///< that it refused, and that use copies of their vertices
  std::uint64_t copied_vertices = 0;
};

/// Over the positions that the file's corners refer to (vertices that only differ in uv or normal
/// are one; positions written twice are two) and the triangles that the weld kept.
struct MeshTopology {
  std::string model;           ///< its name
  std::uint64_t vertices = 0;  ///< positions that triangles use
  std::uint64_t edges = 0;     ///< pairs of positions
  std::uint64_t triangles = 0;
  std::uint64_t components = 0;             ///< parts that share no position
  std::uint64_t boundary_edges = 0;         ///< of one triangle
  std::uint64_t non_manifold_edges = 0;     ///< of more than two triangles
  std::uint64_t flipped_edges = 0;          ///< of two triangles that wind against each other
  std::uint64_t non_manifold_vertices = 0;  ///< at such an edge, or where several fans touch
  std::uint64_t duplicate_triangles = 0;    ///< over the same positions as an earlier one
  std::uint64_t boundary_loops = 0;  ///< holes and rims; where fans touch, each goes its own way
  /// What OpenMesh makes of it; nothing where its mesh would not fit in memory.
  std::optional<HalfEdgeCount> half_edges;

  /// Vertices less edges plus faces: 2 for a sphere, 0 for a torus, 1 for a disk.
  [[nodiscard]] std::int64_t euler() const {
    return static_cast<std::int64_t>(vertices + triangles) - static_cast<std::int64_t>(edges);
  }
};

/// Defects of meshes, in the order of kDefectNames.
enum class Defect : std::uint8_t {
  kDegenerate,  ///< triangles without area
  kDuplicate,   ///< triangles over the positions of another
  kEdge,        ///< edges of more than two triangles
  kVertex,      ///< positions where fans of triangles touch
  kWinding,     ///< edges of two triangles that wind against each other; repaired: triangles
  kIsland,      ///< small parts
  kHole,        ///< small ones
  kSupport      ///< the flat surface that a scan is on; removed on request, else not counted
};
/// Keys of documents (json.md).
inline constexpr std::array kDefectNames = {
    "degenerate", "duplicates", "non_manifold_edges", "touching_vertices", "winding", "islands",
    "holes",      "support"};
inline constexpr std::size_t kDefects = kDefectNames.size();
/// For people: "1 small island".
inline std::string defect_words(Defect defect, std::uint64_t count) {
  struct Words {
    const char* one;
    const char* many;
  };
  constexpr std::array<Words, kDefects> kWords = {
      {{"triangle without area", "triangles without area"},
       {"repeated triangle", "repeated triangles"},
       {"non-manifold edge", "non-manifold edges"},
       {"vertex where parts touch", "vertices where parts touch"},
       {"change of winding", "changes of winding"},
       {"small island", "small islands"},
       {"small hole", "small holes"},
       {"support surface", "support surfaces"}}};
  const Words& words = kWords[static_cast<std::size_t>(defect)];
  return std::to_string(count) + " " + (count == 1 ? words.one : words.many);
}

struct DefectCount {
  std::uint64_t count = 0;
  double area = 0;  ///< of the triangles, or of the hole; square source units
};

/// How many defects a mesh has, or had before they were repaired.
struct MeshDefects {
  std::string model;  ///< its name
  std::array<DefectCount, kDefects> counts{};
  /// Whether backs of a material's triangles would be seen: its surface is open, or inside out.
  std::vector<bool> backs;
  [[nodiscard]] DefectCount& of(Defect defect) { return counts[static_cast<std::size_t>(defect)]; }
};

/// What became of the things of one kind that a model's file names: used unchanged, used in another
/// form, left out.
struct Fate {
  std::uint64_t used = 0;
  std::uint64_t changed = 0;
  std::uint64_t left_out = 0;
};

/// An account of all that a model's file names.
struct Account {
  std::string model;  ///< its name
  Fate images;        ///< maps of materials, and images that no material names
  Fate colours;       ///< of materials; changed: a gray that multiplies no picture
  Fate faces;         ///< changed: polygons that became triangles
  Fate nodes;         ///< of a glTF scene; changed: posed by a skin
  Fate animations;
  Fate attributes;  ///< of vertices; of glTF, each primitive's
};

/// What a model's levels of detail are off by, the worst of all.
struct LevelFigures {
  double position_error_max = 0;   ///< source units: bounds the distance from level 0
  double uv_shift_max_texels = 0;  ///< at vertices of level 0 that were taken out
};

/// Collects the stream. Not thread-safe: stages report from the thread that called them.
struct Report {
  std::vector<StageReport> stages;
  std::vector<Diagnostic> diagnostics;
  std::vector<MeshTopology> topologies;  ///< one a model, where requested
  std::vector<MeshDefects> defects;      ///< one a model, after its repair
  std::vector<MeshDefects> repairs;      ///< one a model, where requested
  std::vector<Account> accounts;         ///< one a model
  std::vector<LevelFigures> levels;      ///< one a model, where levels were requested
  std::vector<Upright> uprights;         ///< one a model
  ProgressCallback progress;             ///< may be empty
};

/// Times a stage: begins it in the constructor, records it when done() is called.
class StageTimer {
 public:
  StageTimer(Report& report, std::string name)
      : report_(report), name_(std::move(name)), start_(std::chrono::steady_clock::now()) {
    if (report_.progress) report_.progress(name_, 0.0);
  }
  void done(std::uint64_t in, std::uint64_t out, double max_error = 0.0) {
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start_;
    if (report_.progress) report_.progress(name_, 1.0);
    report_.stages.push_back({name_, ms.count(), in, out, max_error});
  }

 private:
  Report& report_;
  std::string name_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace modar
