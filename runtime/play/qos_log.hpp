// Quality of service of a run, for a field trial: how fast, how late, found and lost, why, and what
// memory it took. No picture and no pose is written.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/atomic_file.hpp"
#include "frame_report.hpp"
#include "run_stats.hpp"

namespace modar {

/// Bytes by kind.
struct MemoryByKind {
  std::uint64_t resident = 0;         ///< of the process
  std::uint64_t heap = 0;             ///< allocated and not freed; 0 where libc does not tell
  std::uint64_t bundle = 0;           ///< mapped
  std::uint64_t bundle_resident = 0;  ///< of those, pages in memory
  std::uint64_t gpu_geometry = 0;
  std::uint64_t gpu_textures = 0;
  std::uint64_t gpu_batches = 0;
};

/// Measures what the operating system tells; the GPU's part stays 0. mapped: the bundle's bytes.
MemoryByKind measure_memory(std::span<const std::byte> mapped);

/// What the log says about the machine and the run, once.
struct QosHead {
  std::string bundle;
  std::string input;
  std::string method;
  std::string parameters;
  std::string gl_renderer;
  std::string gl_version;
  std::string device;  ///< profile that masks the context
};

/// JSON lines: {"qos":{...head}}, {"event":"found"|"lost",...} as they happen, {"second":{...}}
/// once a second (or 30 frames, where frames are not live), {"summary":{...}}.
class QosLog {
 public:
  /// every_s: seconds of a window by the frames' own clock. Errors: kIo.
  static Result<QosLog> create(const std::string& path, const QosHead& head, double every_s = 1);

  /// True where this frame completes a window: then call window() with the memory as it is.
  [[nodiscard]] bool due(const FrameReport& report) const;
  Result<void> add(const FrameReport& report, std::span<const std::string> pattern_names);
  Result<void> window(const MemoryByKind& memory);
  Result<void> finish(std::string_view summary);

 private:
  QosLog(AtomicFile file, double every_s) : file_(std::move(file)), every_s_(every_s) {}
  Result<void> write(std::string_view line);

  AtomicFile file_;
  double every_s_;
  double window_start_s_ = 0;
  double last_s_ = 0;
  RunStats window_;
  std::vector<bool> seen_;       ///< by pattern, in the frame before
  std::vector<double> since_s_;  ///< when it was found or lost
};

}  // namespace modar
