// Sweeps size and tilt.
#include "bake/check/picture/pose_check.hpp"

#include <algorithm>
#include <memory>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/verdict.hpp"
#include "bake/pattern/pattern.hpp"
#include "formats/base/ranges.hpp"
#include "formats/tracker_record.hpp"
#include "modar/paper_tracker.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr double kRightPixels = 5.0;
constexpr double kDegrees = 57.29577951308232;
constexpr double kAreas[] = {0.1, 0.16, 0.25, 0.4, 0.63, 1.0, 1.6, 2.5, 4.0};
constexpr double kTilts[] = {15, 30, 45, 60, 70};
constexpr double kExpectedTilt = 30;

/// Either tracker, stepping over unrelated frames.
class BundleTracker {
 public:
  static Result<BundleTracker> open(const BundleView& bundle, const Camera& camera) {
    BundleTracker tracker;
    const bool records = std::any_of(
        bundle.sections().begin(), bundle.sections().end(), [](const SectionEntry& entry) {
          return entry.type == static_cast<std::uint32_t>(SectionType::kTrackerRecord);
        });
    if (records) {
      PoseLoopOptions options;
      options.track = false;
      MODAR_ASSIGN(tracker.ours_, PoseLoop::create(bundle, camera, options));
      return tracker;
    }
    const std::uint32_t set = bundle.parameter_sets().empty() ? 0 : bundle.parameter_sets()[0].id;
    MODAR_ASSIGN(tracker.paper_, PaperTracker::create(bundle, set, camera));
    return tracker;
  }
  [[nodiscard]] const char* method() const { return ours_ ? "ours" : "paper"; }
  Result<TrackResult> step(const GrayImage& frame) {
    return ours_ ? ours_->step(frame) : paper_->step(frame);
  }

 private:
  std::unique_ptr<PoseLoop> ours_;
  std::unique_ptr<PaperTracker> paper_;
};

class PatternSweep {
 public:
  PatternSweep(BundleTracker& tracker, std::uint32_t pattern, GrayPicture picture,
               const PatternSurface& surface, const Camera& camera, const PoseCheckOptions& options)
      : tracker_(tracker),
        pattern_(pattern),
        picture_(std::move(picture)),
        surface_(surface),
        camera_(camera),
        options_(options),
        random_(options.seed + 7919 * pattern),
        background_(made_background(camera.width, camera.height, random_)) {}

  Result<PoseStep> step(double area, double tilt) {
    PoseStep step;
    step.area = area;
    step.tilt_deg = tilt;
    SceneBand band;
    band.area_low = band.area_high = area;
    if (surface_.flat()) {
      band.tilt_low = band.tilt_high = tilt;
    } else {
      band.surface = &surface_;
      band.around_low = band.around_high = tilt;
    }
    for (; step.views < options_.views; ++step.views) {
      const Pose pose = draw_pose(band, picture_.view(), camera_, random_);
      const SceneFrame scene =
          render_scene(picture_.view(), camera_, pose, background_, band, random_);
      MODAR_ASSIGN(const TrackResult seen, tracker_.step(scene.picture.view()));
      add(step, scene, seen);
    }
    if (step.right > 0) {
      step.corner_px /= step.right;
      step.rotation_deg /= step.right;
      step.translation_percent /= step.right;
    }
    return step;
  }

 private:
  void add(PoseStep& step, const SceneFrame& truth, const TrackResult& seen) const {
    for (const Detection& detection : seen.visible) {
      if (detection.pattern != pattern_) continue;
      double off = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        off += glm::length(detection.corners[i] - truth.corners[i]) / 4;
      }
      if (!(off < kRightPixels)) return;
      const glm::dmat3 turn = glm::transpose(truth.pose.rotation) * detection.pose.rotation;
      ++step.right;
      step.corner_px += off;
      step.rotation_deg += glm::length(rotation_vector(turn)) * kDegrees;
      step.translation_percent += 100 *
                                  glm::length(detection.pose.translation - truth.pose.translation) /
                                  glm::length(truth.pose.translation);
      return;
    }
  }

  BundleTracker& tracker_;
  std::uint32_t pattern_;
  GrayPicture picture_;
  PatternSurface surface_;
  Camera camera_;
  const PoseCheckOptions& options_;
  Random random_;
  GrayPicture background_;
};

bool works(const PoseStep& step) {
  return 4 * step.right >= 3 * step.views;
}

/// The range around the picture's own size without a gap, and the mean errors.
void sum_up(PatternRange& range) {
  const auto first_tilted = std::find_if(range.steps.begin(), range.steps.end(),
                                         [](const PoseStep& s) { return s.tilt_deg > 0; });
  const auto own = std::find_if(range.steps.begin(), first_tilted,
                                [](const PoseStep& s) { return s.area == 1.0; });
  range.tilt_deg = -1;
  if (own != first_tilted && works(*own)) {
    auto low = own;
    while (low != range.steps.begin() && works(*std::prev(low))) --low;
    auto high = own;
    while (std::next(high) != first_tilted && works(*std::next(high))) ++high;
    range.area_low = low->area;
    range.area_high = high->area;
    range.tilt_deg = 0;
    for (auto step = first_tilted; step != range.steps.end() && works(*step); ++step) {
      range.tilt_deg = step->tilt_deg;
    }
  }
  int right = 0;
  for (const PoseStep& step : range.steps) {
    right += step.right;
    range.corner_px += step.right * step.corner_px;
    range.rotation_deg += step.right * step.rotation_deg;
    range.translation_percent += step.right * step.translation_percent;
  }
  if (right == 0) return;
  range.corner_px /= right;
  range.rotation_deg /= right;
  range.translation_percent /= right;
}

/// Steps of size from the front, then of tilt at the picture's own size.
constexpr std::size_t kSteps = std::size(kAreas) + std::size(kTilts);

Result<PatternRange> sweep_pattern(PatternSweep& sweep, const std::function<void()>& stepped) {
  PatternRange range;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const bool front = i < std::size(kAreas);
    MODAR_ASSIGN(const PoseStep step,
                 front ? sweep.step(kAreas[i], 0) : sweep.step(1.0, kTilts[i - std::size(kAreas)]));
    range.steps.push_back(step);
    stepped();
  }
  sum_up(range);
  return range;
}

void tell(const BundleView& bundle, const PatternRecord& record, const IssueSink& sink,
          WorkstationRule rule, std::string detail,
          std::optional<Severity> severity = std::nullopt) {
  sink(Issue{&workstation_issue_kind(rule),
             "pattern '" + std::string(bundle.name(record.name)) + "'",
             static_cast<std::uint64_t>(reinterpret_cast<const std::byte*>(&record) -
                                        bundle.bytes().data()),
             std::move(detail), severity});
}

/// The picture of a box's sides as the bake put them together.
GrayPicture baked_picture(const BundleView& bundle, std::uint32_t pattern) {
  TrackerRecordView view;
  GrayPicture picture;
  if (view_tracker_record(bundle.section(SectionType::kTrackerRecord, pattern), view))
    return picture;
  picture.width = static_cast<int>(view.header.width);
  picture.height = static_cast<int>(view.header.height);
  const std::size_t size = std::size_t{view.header.width} * view.header.height;
  picture.pixels.assign(view.pixels.begin(),
                        view.pixels.begin() + static_cast<std::ptrdiff_t>(size));
  return picture;
}

}  // namespace

Result<std::vector<PatternRange>> check_poses(const BundleView& bundle,
                                              const PoseCheckOptions& options,
                                              const IssueSink& sink) {
  std::vector<PatternRange> ranges;
  if (bundle.patterns().empty()) return ranges;
  const Camera camera = default_camera(options.width, options.height);
  MODAR_ASSIGN(BundleTracker tracker, BundleTracker::open(bundle, camera));
  double done = 0;
  const auto stepped = [&] {
    done += 1.0 / (kSteps * static_cast<double>(bundle.patterns().size()));
    if (options.progress) options.progress(done);
  };
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    const PatternRecord& record = bundle.patterns()[p];
    const auto path =
        ranges::find(options.pictures, bundle.name(record.name), &PatternRequest::name);
    if (path == options.pictures.end()) {
      tell(bundle, record, sink, WorkstationRule::kSourceMissing,
           "its picture is needed to render views of it");
      continue;
    }
    MODAR_ASSIGN(ShapedPicture shaped, load_shaped(path->path, path->width_mm, path->shape));
    GrayPicture picture = std::move(shaped.picture);
    PatternSurface surface;
    const auto shape = bundle.section(SectionType::kPatternShape, p);
    if (!shape.empty()) {
      static_cast<void>(view_pattern_shape(shape, record.width, record.height, surface));
      if (!surface.faces().empty()) picture = baked_picture(bundle, p);
    }
    PatternSweep sweep(tracker, p, std::move(picture), surface, camera, options);
    MODAR_ASSIGN(PatternRange range, sweep_pattern(sweep, stepped));
    range.name = bundle.name(record.name);
    range.method = tracker.method();
    if (range.tilt_deg < kExpectedTilt) {
      const bool missed = range.tilt_deg < 0;
      tell(bundle, record, sink, WorkstationRule::kPoseRange,
           missed ? "it is missed from the front"
                  : "it is found up to a tilt of " +
                        std::to_string(static_cast<int>(range.tilt_deg)) + " degrees",
           missed ? Severity::kError : Severity::kWarning);
    }
    ranges.push_back(std::move(range));
  }
  return ranges;
}

}  // namespace modar
