// Where finished pictures go: a folder of images, a movie, a report.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"
#include "frame_report.hpp"
#include "modar/image.hpp"
#include "options.hpp"

namespace modar {

/// 8-bit R, G, B, A pixels without gaps, top row first, owned by the caller.
struct RgbaView {
  std::span<const std::uint8_t> pixels;
  int width = 0;
  int height = 0;
};

class FrameSink {
 public:
  FrameSink() = default;
  FrameSink(const FrameSink&) = delete;
  FrameSink& operator=(const FrameSink&) = delete;
  virtual ~FrameSink() = default;

  /// Takes a frame's picture. Errors: kIo "out.write", kInvalidInput "out.size-changed".
  virtual Result<void> picture(const RgbaView& image, const FrameReport& report) = 0;
  /// Takes the frame's JSON line (without its newline), after its picture.
  virtual Result<void> line(const FrameReport& /*report*/, std::string_view /*json*/) { return {}; }
  /// Completes the output; summary is the last JSON line. Without it, nothing half-made is left.
  virtual Result<void> finish(std::string_view summary) = 0;
};

/// out: "FILE.mp4" (a movie of that many frames a second) or a folder that takes
/// frame_000000.png and so on (.ppm in the build of the device).
/// Errors: kIo "out.create", kUsage "out.format", kUnsupported "out.unsupported".
Result<std::unique_ptr<FrameSink>> open_frame_sink(const std::string& out, double fps);

/// What the report's page says at its head.
struct ReportTitle {
  std::string bundle;
  std::string input;
  std::string method;
  std::string gl_renderer;  ///< the driver's own name
};

/// A folder with overlay.mp4, poster.png, contact_sheet.png, frames.jsonl and index.html that shows
/// them.
/// pattern_names: by the bundle's pattern index.
Result<std::unique_ptr<FrameSink>> open_report(const std::string& folder, double fps,
                                               const ReportTitle& title,
                                               std::span<const std::string> pattern_names);

/// Refuses, before any work, an output that is an input (by its path, a symbolic or a hard link),
/// and without --force folders of --out and --report that hold files which are not theirs.
/// Errors: kUsage "out.input", "out.foreign".
Result<void> check_outputs(const PlayOptions& options);

/// Removes an earlier run's frame_NNNNNN.png or .ppm, which would stand among the new ones.
void remove_frames(const std::string& folder);

/// The folders that a run makes for its outputs: those without a file go when it fails.
class NewFolders {
 public:
  /// Before any is made.
  explicit NewFolders(const PlayOptions& options);
  void remove_empty() const;

 private:
  std::vector<std::string> paths_;  ///< parents first
};

/// Makes a folder and its parents. Errors: kIo "out.create".
Result<void> make_folder(const std::string& path);

/// Writes path.png on a desk, path.ppm on the device, through AtomicFile. Errors: kIo.
Result<void> write_frame_picture(const std::string& path, const RgbImage& image);

/// Writes a PNG (the alpha is left out) through AtomicFile. Errors: kIo "out.write", "io.*".
Result<void> write_png(const std::string& path, const RgbaView& image);

}  // namespace modar
