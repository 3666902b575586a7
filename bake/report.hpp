// What a bake says of itself: stages as they run, findings as they turn up. The progress bar,
// --json and the summary all read this one stream.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bake/topology_figures.hpp"

namespace modar {

/// Told when a stage begins or moves on: its name and how much of it is done (0 to 1).
using ProgressCallback = std::function<void(const std::string& stage, double done)>;

enum class DiagnosticSeverity : std::uint8_t { kInfo, kWarning, kError };

/// Something in the input that a person may want to know or mend; the bake goes on.
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

/// What a model's levels of detail are off by, the worst of all.
struct LevelFigures {
  double position_error_max = 0;   ///< source units: bounds the distance from level 0
  double uv_shift_max_texels = 0;  ///< at vertices of level 0 that were taken out
};

/// Collects the stream. Not thread-safe: stages report from the thread that called them.
struct Report {
  std::vector<StageReport> stages;
  std::vector<Diagnostic> findings;
  std::vector<MeshTopology> topologies;  ///< one a model, where they were asked for
  std::vector<LevelFigures> levels;      ///< one a model, where levels were asked for
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
