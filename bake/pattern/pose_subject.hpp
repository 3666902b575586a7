// What the pose benches share: patterns with their trackers, and the sums over frames.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bake/lab/pose_bench.hpp"
#include "bake/pattern/pose_scene.hpp"
#include "bake/pattern/tracker_record_bake.hpp"
#include "modar/paper_tracker.hpp"
#include "modar/pose_loop.hpp"

namespace modar {

/// Patterns, their bundle and the trackers on it.
struct Subject {
  std::vector<GrayPicture> pictures;
  std::vector<std::byte> bytes;
  std::unique_ptr<PaperTracker> paper;  ///< null where options.paper_set is 0
  std::unique_ptr<PoseLoop> ours;
};

/// A bundle that holds that pattern's loop record alone. Errors: those of bake_tracker_record().
Result<std::vector<std::byte>> bundle_of_pattern(const GrayImage& pattern,
                                                 const TrackerRecordOptions& options);

/// The same with a record that is there already.
Result<std::vector<std::byte>> bundle_of_record(const GrayImage& pattern,
                                                std::vector<std::byte> record);

/// A bundle of patterns with their records, one each.
Result<std::vector<std::byte>> bundle_of_records(std::span<const GrayPicture> patterns,
                                                 std::span<const std::vector<std::byte>> records);

/// track: whether ours holds patterns from frame to frame. Errors: those of reading pictures,
/// describing and baking them.
Result<Subject> make_subject(const std::vector<std::string>& paths, const PoseBenchOptions& options,
                             const Camera& camera, bool track);

/// What a frame truly shows.
struct FrameTruth {
  bool pattern = false;
  std::array<glm::dvec2, 4> corners{};
};

/// Whether the mean error of the four corners is under 5 pixels.
bool is_right(const Detection& detection, const FrameTruth& truth);

/// Sums of one method on one band.
class Tally {
 public:
  Tally(std::string band, const char* method, bool sequence);
  /// ms: thread-CPU time of the frame.
  void add(const TrackResult& result, const FrameTruth& truth, double ms);
  /// The next frame does not follow the last one.
  void cut() { have_last_ = false; }
  PoseBenchRow finish();

 private:
  PoseBenchRow row_;
  std::vector<double> errors_;
  double change_ = 0.0;
  int changes_ = 0;
  bool have_last_ = false;
  std::array<glm::dvec2, 4> last_{};
};

/// Both methods on the same frames.
struct Tallies {
  Tallies(const std::string& band, bool sequence)
      : paper(band, "paper", sequence), ours(band, "ours", sequence) {}
  Tally paper;
  Tally ours;
  /// Runs the subject's trackers on a frame. Errors: those of the trackers.
  Result<void> measure(Subject& subject, const GrayImage& frame, const FrameTruth& truth);
  /// Appends a row for each method that ran.
  void finish(const PoseBenchOptions& options, std::vector<PoseBenchRow>& rows);
};

}  // namespace modar
