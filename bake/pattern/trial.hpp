// Patterns baked into a bundle in memory, and the device's own tracker tried on rendered frames of
// known pose.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/pattern/picture.hpp"
#include "bake/pattern/record.hpp"
#include "bake/pattern/scene.hpp"
#include "bake/pattern/shape.hpp"
#include "formats/base/error.hpp"
#include "modar/camera.hpp"
#include "modar/tracker.hpp"

namespace modar {

/// A bundle that holds that pattern's tracker record alone. Errors: those of make_tracker_record().
Result<std::vector<std::byte>> bundle_of_pattern(const GrayImage& pattern,
                                                 const TrackerRecordOptions& options);
/// The same with a record that is baked already. shape: its SectionType::kPatternShape section;
/// empty: flat.
Result<std::vector<std::byte>> bundle_of_record(const GrayImage& pattern,
                                                std::vector<std::byte> record,
                                                const std::vector<std::byte>& shape = {});
/// A bundle of patterns with a record each. A set other than null adds each pattern's features
/// under that parameter set of the ModAR paper; a record that is empty is left out. shapes: the
/// patterns' SectionType::kPatternShape sections, or none where all are flat.
Result<std::vector<std::byte>> bundle_of_records(
    std::span<const GrayPicture> patterns, std::span<const std::vector<std::byte>> records,
    const ParameterSetRecord* set = nullptr, std::span<const std::vector<std::byte>> shapes = {});

/// A pattern as the device has it.
struct NamedPattern {
  std::string name;
  GrayPicture picture;
  std::vector<std::byte> bundle;   ///< holds its tracker record and shape alone
  std::vector<std::byte> shape{};  ///< its SectionType::kPatternShape section; empty: flat
};

/// The patterns of a bundle (*.modar, from their tracker records), or that of a picture. Errors:
/// those of opening and of baking; kInvalidInput "confusion.record" (a bundle with a pattern whose
/// tracker record is missing or invalid).
Result<std::vector<NamedPattern>> read_patterns(const std::string& path, const ShapeRequest& shape,
                                                unsigned jobs);

/// What a frame truly shows.
struct FrameTruth {
  bool pattern = false;
  std::array<glm::dvec2, 4> corners{};
};

/// Mean distance of the four corners from the truth, pixels.
double corner_error(const Detection& detection, const FrameTruth& truth);
/// Whether that is under 5 pixels: in a frame 1280 wide, where a misplaced model catches the eye.
bool is_right(const Detection& detection, const FrameTruth& truth);

/// Counts over frames.
struct PoseFigures {
  int frames = 0;
  int without_pattern = 0;  ///< of the frames
  int false_found = 0;      ///< recognitions in those
  int recognised = 0;       ///< recognitions in the others
  int right = 0;            ///< of those, see is_right()
  int within_15 = 0;        ///< of those, with a mean error of the corners under 15 pixels
  double worst_px = 0;      ///< greatest error of a recognition
  double error_px = 0;      ///< median over the right ones
  double jitter_px = 0;     ///< rms change of the corners' error from frame to frame
  int held_wrong = 0;       ///< most frames in a row that show a pose that is not right
};

/// Sums up the tracker's answers.
class PoseTally {
 public:
  void add(const TrackResult& result, const FrameTruth& truth);
  /// The next frame does not follow the last one: no jitter between them.
  void cut() {
    have_last_ = false;
    wrong_ = 0;
  }
  [[nodiscard]] PoseFigures figures();

 private:
  PoseFigures figures_;
  std::vector<double> errors_;
  double change_ = 0.0;
  int changes_ = 0;
  int wrong_ = 0;  ///< frames in a row, up to the last
  bool have_last_ = false;
  std::array<glm::dvec2, 4> last_{};
};

/// What the views of one trial have in common; values left open are drawn for each view.
struct TrialSetting {
  SceneBand band;
  std::optional<SceneLight> light;
  double motion_px = 0;  ///< length of the motion blur, in a random direction
};

struct TrialSetup {
  GrayImage picture;                         ///< the pattern's
  std::span<const std::byte> bundle;         ///< holds that pattern alone, with its tracker record
  const PatternSurface* surface = nullptr;   ///< and of this shape; null: flat
  Camera camera;                             ///< frames have its size
  std::span<const GrayPicture> backgrounds;  ///< of that size, at least one
  int views = 10;                            ///< of each setting
  std::uint64_t seed = 1;
  unsigned jobs = 1;  ///< threads; the outcome does not depend on it
};

struct TrialOutcome {
  PoseFigures figures;  ///< of two exposures of each view: the pattern is detected, then tracked
  GrayPicture sample;   ///< the first view, a quarter of its sides
  std::array<glm::dvec2, 4> truth{};  ///< pixels of the sample
  std::array<glm::dvec2, 4> seen{};
  bool sample_right = false;  ///< else `seen` is not set
  [[nodiscard]] double right_share() const {
    return figures.frames > 0 ? 1.0 * figures.right / figures.frames : 0;
  }
};

/// Runs the tracker over views of each setting. setting_done: called after each, from any thread;
/// may be empty. Errors: those of the tracker.
Result<std::vector<TrialOutcome>> try_views(const TrialSetup& setup,
                                            std::span<const TrialSetting> settings,
                                            const std::function<void()>& setting_done);

}  // namespace modar
