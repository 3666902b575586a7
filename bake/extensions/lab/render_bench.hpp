// What drawing costs: the ModAR paper's four ways to draw copies of a model (its Tables 10 to 12)
// side by side in one run, loading against copying, culling against brute force.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// While one lives, renderers that are created shade models plainly: Lambert in stored colours,
/// hardly any ambient light, a light that turns with the camera. Items without a scene have no
/// shadow then. One at a time.
class PlainShading {
 public:
  PlainShading();
  ~PlainShading();
  PlainShading(const PlainShading&) = delete;
  PlainShading& operator=(const PlainShading&) = delete;

 private:
  std::array<const char*, 2> before_{};
};

struct RenderBenchOptions {
  std::string device;     ///< profile that masks the context; empty: none
  int most_copies = 10;   ///< the curve goes from 1 to this
  int frames = 20;        ///< drawn frames a point of the curve; medians count
  int idle_frames = 100;  ///< frames a point where nothing is rasterised; 0: no cpu_ms
  int width = 480;        ///< pixels
  int height = 800;
  /// Models with more triangles have no curve: a software rasteriser would draw for hours.
  std::uint64_t most_triangles = 500000;
  /// Told how much is done; may be empty.
  std::function<void(std::uint64_t done, std::uint64_t all)> progress;
};

/// measure: "MODEL xN WAY FIGURE". ours and reference in the same unit; where a figure has no
/// counterpart, reference is 0.
struct RenderBenchRow {
  std::string measure;
  double ours = 0;
  double reference = 0;
};

/// Ways: index_arrays, index_vbo, instancing_arrays, instancing_vbo (uniform matrix array),
/// instanced_arrays (the extension, where the context has it); the reference is index_arrays: a
/// call a copy, from client memory. Figures: draw_calls, state_changes, bytes_per_frame (what the
/// driver is handed), frame_ms (wall clock until the driver has finished), cpu_ms (of the process
/// while the driver rasterises nothing: Mesa's no-op driver, in a child process; left out where
/// Mesa is not the driver). "MODEL x10 WAY gain_low_end" and "gain_mid_range": how often our frame
/// time of index_arrays holds that of the way, and the paper's; Tables 10 to 12 in their own units,
/// with seconds of 1,800 frames: "table11_fps_low_end", "table10_speed_up_pct_low_end". "MODEL x1
/// shading_cpu_ms" (CPU time of a frame with a camera picture, the model on its pattern, its
/// shadow): the reference is plain shading. Then, a bundle (by its path): open_ms; load_cpu_ms
/// (buffers into GL) and driver_cpu_ms (glBufferData of the same bytes alone), both against memcpy;
/// bytes in GL by kind; "arrival": it comes in pieces of 64 KiB, ETC1 in place against whole
/// levels: uploaded_bytes, kept_bytes (the most in memory), draw_calls of a frame; and, a model,
/// triangles sent from inside it against those whose own boxes meet the frustum. Call it before
/// anything else of this process has opened a GL context. Errors: those of MappedFile, BundleView,
/// GlContext and Renderer; kUsage "device.unknown".
Result<std::vector<RenderBenchRow>> bench_render(std::span<const std::string> bundle_paths,
                                                 const RenderBenchOptions& options);

}  // namespace modar
