// Frames and poses of a run, kept so that a later run can be held against them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"
#include "frame_report.hpp"
#include "frame_source.hpp"
#include "modar/camera.hpp"

namespace modar {

/// What a replay needs in addition to the frames and the bundle.
struct RecordingHead {
  std::string method;
  std::string parameters;  ///< name of the parameter set
  double fps = 30;
  std::uint64_t bundle_hash = 0;  ///< that of its header: it covers the section table's hashes
  Camera camera;                  ///< width 0: as default_camera() for each frame
  bool stills = false;            ///< SourceInfo::stills
};

/// A folder with frames/frame_000000.png (.ppm on the device) and poses.jsonl: the head, then the
/// line of each frame. The gray that is tracked comes from those pictures (gray_from_rgb()), so
/// that a replay sees the same.
class Recorder {
 public:
  /// Errors: kIo "out.create".
  static Result<std::unique_ptr<Recorder>> create(const std::string& folder,
                                                  const RecordingHead& head);
  /// Errors: kIo.
  Result<void> add(const Frame& frame, std::string_view json);
  Result<void> finish();

  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

 private:
  struct State;
  explicit Recorder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// One recorded frame: the compared fields.
struct RecordedFrame {
  std::uint64_t frame = 0;
  std::string state;
  struct SeenPattern {
    std::string pattern;
    std::array<glm::dvec2, 4> corners{};
  };
  std::vector<SeenPattern> visible;
};

struct Recording {
  RecordingHead head;
  std::vector<RecordedFrame> frames;
};

/// Reads FOLDER/poses.jsonl. Errors: kIo "io.open", kInvalidInput "golden.damaged" with the line.
Result<Recording> read_recording(const std::string& folder);

/// Holds a run against a recording, frame by frame.
class GoldenCheck {
 public:
  /// tolerance: pixels, greatest mean distance of a pattern's four corners.
  GoldenCheck(Recording recording, double tolerance);

  void add(const FrameReport& report, std::span<const std::string> pattern_names);
  /// {"golden":{frames,compared,different,tolerance_px,worst_px,first:{frame,what}}}
  [[nodiscard]] std::string line() const;
  /// True if each recorded frame came and none differs.
  [[nodiscard]] bool good() const { return different_ == 0 && next_ == recording_.frames.size(); }
  [[nodiscard]] const RecordingHead& head() const { return recording_.head; }

 private:
  std::string difference(const RecordedFrame& wanted, const FrameReport& report,
                         std::span<const std::string> pattern_names);

  Recording recording_;
  double tolerance_;
  std::size_t next_ = 0;
  std::size_t different_ = 0;
  double worst_px_ = 0;
  std::uint64_t first_frame_ = 0;
  std::string first_what_;
};

}  // namespace modar
