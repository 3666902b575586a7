// Runs both methods over bands of rendered frames, over hand-held paths and over real videos.
#include "bake/extensions/lab/pose_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

#include <glm/geometric.hpp>
#include <opencv2/core.hpp>

#include "bake/extensions/lab/feature_peer.hpp"
#include "bake/extensions/lab/field_scene.hpp"
#include "bake/extensions/lab/number_lines.hpp"
#include "bake/extensions/lab/unknown_view.hpp"
#include "bake/process/thread_clock.hpp"
#include "bake/video/video.hpp"
#include "formats/bundle_view.hpp"
#include "modar/features.hpp"
#include "modar/paper_tracker.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

/// Patterns, their bundle and the trackers on it.
struct Fixture {
  std::vector<GrayPicture> pictures;
  std::vector<std::byte> bytes;
  std::unique_ptr<PaperTracker> paper;  ///< null where options.paper_set is 0
  std::unique_ptr<PoseLoop> ours;
  std::unique_ptr<FeaturePeer> sift;  ///< of the first pattern; null unless options.sift
};

/// track: whether ours tracks patterns from frame to frame. Errors: those of reading pictures,
/// describing and baking them.
Result<Fixture> make_fixture(const std::vector<std::string>& paths, const PoseBenchOptions& options,
                             const Camera& camera, bool track) {
  Fixture fixture;
  std::vector<std::vector<std::byte>> records;
  for (const std::string& path : paths) {
    bool shrunk = false;
    MODAR_ASSIGN(auto picture, load_pattern(path, shrunk));
    fixture.pictures.push_back(std::move(picture));
    records.emplace_back();
    // Baking ours takes most of the time of a run of the paper's method alone.
    if (!options.ours) continue;
    MODAR_ASSIGN(records.back(), make_tracker_record(fixture.pictures.back().view(), {}));
  }
  const ParameterSetRecord* set = nullptr;
  const auto sets = paper_parameter_sets();
  for (const ParameterSetRecord& each : sets) set = each.id == options.paper_set ? &each : set;
  MODAR_ASSIGN(fixture.bytes, bundle_of_records(fixture.pictures, records, set));
  MODAR_ASSIGN(const auto bundle, BundleView::open(fixture.bytes));
  if (set != nullptr) {
    MODAR_ASSIGN(fixture.paper, PaperTracker::create(bundle, options.paper_set, camera));
  }
  if (options.ours) {
    PoseLoopOptions how;
    how.track = track;
    how.estimate_camera = !options.known_camera;
    MODAR_ASSIGN(fixture.ours, PoseLoop::create(bundle, camera, how));
  }
  if (options.sift) {
    fixture.sift = FeaturePeer::create(fixture.pictures[0].view(), PeerMethod::kSiftMagsac);
  }
  return fixture;
}

/// Sums of one method on one band.
class MethodTally {
 public:
  MethodTally(std::string band, const char* method, bool sequence) {
    row_.band = std::move(band);
    row_.method = method;
    row_.sequence = sequence;
  }
  void cut() { poses_.cut(); }
  template <class Method>
  Result<void> run(Method& method, const GrayImage& frame, const FrameTruth& truth) {
    const double start = thread_seconds();
    const auto result = method.step(frame);
    row_.ms += 1e3 * (thread_seconds() - start);
    if (!result) return tl::unexpected(result.error());
    poses_.add(*result, truth);
    row_.features.take(result->features);
    for (const Detection& seen : result->visible) row_.inliers.take(seen.inliers);
    row_.stages_ms[0] += result->times.detect;
    row_.stages_ms[1] += result->times.describe;
    row_.stages_ms[2] += result->times.match;
    row_.stages_ms[3] += result->times.homography + result->times.pose;
    return {};
  }
  PoseBenchRow finish() {
    static_cast<PoseFigures&>(row_) = poses_.figures();
    const double frames = std::max(row_.frames, 1);
    row_.ms /= frames;
    for (double& stage : row_.stages_ms) stage /= frames;
    return row_;
  }

 private:
  PoseBenchRow row_;
  PoseTally poses_;
};

/// All methods on the same frames.
class MethodTallies {
 public:
  MethodTallies(const std::string& band, bool sequence)
      : paper_(band, "paper", sequence),
        ours_(band, "ours", sequence),
        sift_(band, "sift", sequence) {}
  void cut() {
    paper_.cut();
    ours_.cut();
    sift_.cut();
  }
  /// Runs the fixture's trackers on a frame. Errors: those of the trackers.
  Result<void> run(Fixture& fixture, const GrayImage& frame, const FrameTruth& truth) {
    if (fixture.paper) MODAR_TRY(paper_.run(*fixture.paper, frame, truth));
    if (fixture.ours) MODAR_TRY(ours_.run(*fixture.ours, frame, truth));
    if (fixture.sift) MODAR_TRY(sift_.run(*fixture.sift, frame, truth));
    return {};
  }
  /// Appends a row for each method that ran.
  void finish(const PoseBenchOptions& options, std::vector<PoseBenchRow>& rows) {
    if (options.paper_set != 0) rows.push_back(paper_.finish());
    if (options.ours) rows.push_back(ours_.finish());
    if (options.sift) rows.push_back(sift_.finish());
  }

 private:
  MethodTally paper_;
  MethodTally ours_;
  MethodTally sift_;
};

Result<std::vector<GrayPicture>> backgrounds_of(const PoseBenchOptions& options) {
  if (options.backgrounds.empty() || options.patterns.empty()) {
    return fail(ExitCode::kUsage, "bench.input", "", "the bench needs patterns and backgrounds",
                "give folders with pictures");
  }
  return load_backgrounds(options.backgrounds, options.width, options.height);
}

/// Of one band and pattern.
int frames_of(const PoseBenchOptions& options, const SceneBand& band) {
  if (band.pattern || options.clutter_frames == 0) return options.frames;
  const int patterns = static_cast<int>(options.patterns.size());
  return (options.clutter_frames + patterns - 1) / patterns;
}

/// The lens and the print of pattern p: the same in every band.
UnknownView unknown_of(const PoseBenchOptions& options, std::size_t p, const Fixture& fixture,
                       const Camera& camera) {
  Random random(options.seed + 1000003 * p + 4099);
  return draw_unknown(fixture.pictures[0].view(), camera, options.known_camera, random);
}

/// All frames but the last one of a view that is held.
Result<void> hold(const PoseBenchOptions& options, Fixture& fixture, GrayPicture& picture,
                  Random& random) {
  if (options.held < 2 || !fixture.ours) return {};
  const GrayPicture still = picture;
  fixture.ours->reset();
  for (int i = 1; i < options.held; ++i) {
    MODAR_TRY(fixture.ours->step(picture.view()));
    expose(still, {}, random, picture);
  }
  return {};
}

/// One path under one exposure, over one photo.
Result<void> run_path(const PoseBenchOptions& options, std::size_t p, const GrayPicture& background,
                      const BenchPath& how, MethodTallies& tallies) {
  const Camera camera = default_camera(options.width, options.height);
  SceneBand band;
  band.area_low = 0.8;
  band.area_high = 2.0;
  band.tilt_high = 35;
  MODAR_ASSIGN(Fixture fixture, make_fixture({options.patterns[p]}, options, camera, true));
  Random random(options.seed + 1000003 * p + 17);
  const UnknownView unknown = unknown_of(options, p, fixture, camera);
  const GrayImage picture = unknown.print.view();
  const HandPath path(draw_pose(band, picture, unknown.lens, random), random);
  const SceneLight light = draw_light(random);
  tallies.cut();
  glm::dvec2 last{0.0};
  for (int i = 0; i < options.frames; ++i) {
    const Pose pose = path.at(i / 30.0, how.speed, how.tremor);
    const glm::dvec2 centre = project(unknown.lens, pose.translation);
    const glm::dvec2 motion = i > 0 ? centre - last : glm::dvec2(0.0);
    last = centre;
    const SceneFrame scene =
        render_scene(picture, unknown.lens, pose, background, band, random, &light,
                     {how.blur * glm::length(motion), std::atan2(motion.y, motion.x)});
    MODAR_TRY(tallies.run(fixture, scene.picture.view(), {true, scene.corners}));
  }
  return {};
}

using Truths = std::map<std::uint64_t, FrameTruth>;

Result<Truths> read_truth(const std::string& path) {
  Truths truths;
  if (path.empty()) return truths;
  MODAR_ASSIGN(const auto lines, read_numbers(path, "bench.truth"));
  for (const auto& [number, values] : lines) {
    FrameTruth truth;
    truth.pattern = values.size() > 1 && values[1] == 1.0;
    if (values.size() < (truth.pattern ? 10 : 2)) {
      return fail(
          ExitCode::kInvalidInput, "bench.truth", path + ":" + std::to_string(number),
          "corners are missing",
          "write a line for each frame: its number, 1 or 0 for a pattern that shows or not, "
          "and at last the corners' eight coordinates");
    }
    for (std::size_t i = 0; i < 8 && truth.pattern; ++i) {
      truth.corners[i / 2][static_cast<int>(i % 2)] = values[values.size() - 8 + i];
    }
    truths[static_cast<std::uint64_t>(values[0])] = truth;
  }
  return truths;
}

/// A frame of a recorded path.
FieldFrame path_frame(const std::vector<double>& values, const GrayImage& picture,
                      const Camera& camera, const GrayPicture& background, Random& random) {
  FieldFrame frame;
  if (values.size() == 9) {
    std::array<double, 9> map;
    std::copy(values.begin(), values.end(), map.begin());
    frame = render_homography(picture, map, background);
  } else {
    Pose pose;
    for (int i = 0; i < 9; ++i) pose.rotation[i % 3][i / 3] = values[static_cast<std::size_t>(i)];
    pose.translation = {values[9], values[10], values[11]};
    SceneFrame scene = render_still(picture, camera, pose, background, {}, random, 0.65, {});
    frame = {std::move(scene.picture), {true, scene.corners}};
  }
  expose(frame.picture, {}, random, frame.picture);
  return frame;
}

std::vector<std::string> patterns_of(const PoseBenchOptions& options, const VideoBench& video) {
  if (!video.pattern.empty()) return {video.pattern};
  const auto beside = std::filesystem::path(video.video).parent_path() / "pattern.png";
  std::error_code failed;
  if (std::filesystem::is_regular_file(beside, failed)) return {beside.string()};
  return options.patterns;
}

}  // namespace

std::vector<SceneBand> pose_bands() {
  return {{"area 0.1-0.25", 0.1, 0.25, 0, 45, 0, 0, true},
          {"area 0.25-0.4", 0.25, 0.4, 0, 45, 0, 0, true},
          {"area 0.4-0.9", 0.4, 0.9, 0, 45, 0, 0, true},
          {"area 0.9-4", 0.9, 4.0, 0, 45, 0, 0, true},
          {"area 4-5", 4.0, 5.0, 0, 45, 0, 0, true},
          {"tilt 45-60", 0.5, 3.0, 45, 60, 0, 0, true},
          {"tilt 60-70", 0.5, 3.0, 60, 70, 0, 0, true},
          {"half covered", 0.5, 3.0, 0, 45, 0.5, 0.5, true},
          {"mixed", 0.25, 5.0, 0, 65, 0, 0.5, true},
          {"none", 0.4, 4.0, 0, 45, 0, 0, false},
          {"70 % covered", 0.5, 3.0, 0, 45, 0.7, 0.7, true},
          {"tilt 75-80", 0.5, 3.0, 75, 80, 0, 0, true},
          {"area 0.02-0.05", 0.02, 0.05, 0, 45, 0, 0, true}};
}

Result<std::vector<PoseBenchRow>> bench_detection(const PoseBenchOptions& options,
                                                  const ProgressCallback& progress) {
  cv::setNumThreads(1);
  MODAR_ASSIGN(const auto backgrounds, backgrounds_of(options));
  const Camera camera = default_camera(options.width, options.height);
  const std::vector<SceneBand> bands = options.bands.empty() ? pose_bands() : options.bands;
  std::vector<MethodTallies> tallies;
  for (const SceneBand& band : bands) tallies.emplace_back(band.name, false);
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    MODAR_ASSIGN(Fixture fixture,
                 make_fixture({options.patterns[p]}, options, camera, options.held > 1));
    const UnknownView unknown = unknown_of(options, p, fixture, camera);
    const GrayImage picture = unknown.print.view();
    for (std::size_t b = 0; b < bands.size(); ++b) {
      Random random(options.seed + 1000003 * p + 7919 * b);
      const int frames = frames_of(options, bands[b]);
      for (int i = 0; i < frames; ++i) {
        const GrayPicture& photo =
            backgrounds[static_cast<std::size_t>(random.next() % backgrounds.size())];
        // Without a pattern only the photo makes the frames differ.
        const GrayPicture background = bands[b].pattern ? photo : another_view(photo, random);
        const Pose pose = draw_pose(bands[b], picture, unknown.lens, random);
        SceneFrame scene = render_scene(picture, unknown.lens, pose, background, bands[b], random);
        MODAR_TRY(hold(options, fixture, scene.picture, random));
        MODAR_TRY(tallies[b].run(fixture, scene.picture.view(), {bands[b].pattern, scene.corners}));
      }
      if (progress) {
        progress("detection", static_cast<double>(p * bands.size() + b + 1) /
                                  static_cast<double>(options.patterns.size() * bands.size()));
      }
    }
  }
  std::vector<PoseBenchRow> rows;
  for (MethodTallies& each : tallies) each.finish(options, rows);
  return rows;
}

Result<std::vector<PoseBenchRow>> bench_tracking(const PoseBenchOptions& options,
                                                 const BenchPath& path,
                                                 const ProgressCallback& progress) {
  cv::setNumThreads(1);
  MODAR_ASSIGN(const auto backgrounds, backgrounds_of(options));
  MethodTallies tallies(path.name, true);
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    const GrayPicture& background = backgrounds[(options.seed + p) % backgrounds.size()];
    MODAR_TRY(run_path(options, p, background, path, tallies));
    if (progress) {
      progress(path.name,
               static_cast<double>(p + 1) / static_cast<double>(options.patterns.size()));
    }
  }
  std::vector<PoseBenchRow> rows;
  tallies.finish(options, rows);
  return rows;
}

Result<std::vector<PoseBenchRow>> bench_field(const PoseBenchOptions& options,
                                              const std::string& only,
                                              const ProgressCallback& progress) {
  cv::setNumThreads(1);
  MODAR_ASSIGN(const auto backgrounds, backgrounds_of(options));
  const Camera camera = default_camera(options.width, options.height);
  std::vector<FieldCondition> conditions;
  std::vector<MethodTallies> tallies;
  for (FieldCondition& condition : field_conditions()) {
    const std::string name = "field " + condition.name;
    if (name.find(only) == std::string::npos) continue;
    tallies.emplace_back(name, false);
    conditions.push_back(std::move(condition));
  }
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    MODAR_ASSIGN(Fixture fixture, make_fixture({options.patterns[p]}, options, camera, false));
    bool shrunk = false;
    MODAR_ASSIGN(const GrayPicture other,
                 load_pattern(options.patterns[(p + 1) % options.patterns.size()], shrunk));
    const UnknownView unknown = unknown_of(options, p, fixture, camera);
    for (std::size_t c = 0; c < conditions.size(); ++c) {
      // The same poses under every condition.
      Random random(options.seed + 1000003 * p);
      for (int i = 0; i < options.frames; ++i) {
        const auto& photo =
            backgrounds[static_cast<std::size_t>(random.next() % backgrounds.size())];
        Random own(random.next());
        const FieldFrame frame = render_field(unknown.print.view(), other.view(), unknown.lens,
                                              photo, conditions[c], own);
        MODAR_TRY(tallies[c].run(fixture, frame.picture.view(), frame.truth));
      }
    }
    if (progress) {
      progress("field", static_cast<double>(p + 1) / static_cast<double>(options.patterns.size()));
    }
  }
  std::vector<PoseBenchRow> rows;
  for (MethodTallies& each : tallies) each.finish(options, rows);
  return rows;
}

Result<std::vector<PoseBenchRow>> bench_path(const PoseBenchOptions& options,
                                             const std::string& path,
                                             const ProgressCallback& progress) {
  cv::setNumThreads(1);
  MODAR_ASSIGN(const auto backgrounds, backgrounds_of(options));
  MODAR_ASSIGN(const auto lines, read_numbers(path, "bench.path"));
  for (const auto& [number, values] : lines) {
    if (values.size() == 9 || values.size() == 12) continue;
    return fail(ExitCode::kInvalidInput, "bench.path", path + ":" + std::to_string(number),
                "a line holds neither 9 nor 12 numbers", "write a homography or a pose a line");
  }
  const Camera camera = default_camera(options.width, options.height);
  MethodTallies tallies("path " + std::filesystem::path(path).filename().string(), true);
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    MODAR_ASSIGN(Fixture fixture, make_fixture({options.patterns[p]}, options, camera, true));
    Random random(options.seed + 1000003 * p);
    const UnknownView unknown = unknown_of(options, p, fixture, camera);
    tallies.cut();
    for (const auto& [number, values] : lines) {
      const FieldFrame frame = path_frame(values, unknown.print.view(), unknown.lens,
                                          backgrounds[p % backgrounds.size()], random);
      MODAR_TRY(tallies.run(fixture, frame.picture.view(), frame.truth));
    }
    if (progress) {
      progress("path", static_cast<double>(p + 1) / static_cast<double>(options.patterns.size()));
    }
  }
  std::vector<PoseBenchRow> rows;
  tallies.finish(options, rows);
  return rows;
}

Result<std::vector<PoseBenchRow>> bench_video(const PoseBenchOptions& options,
                                              const VideoBench& video,
                                              const ProgressCallback& progress) {
  cv::setNumThreads(1);
  MODAR_ASSIGN(const Truths truths, read_truth(video.truth));
  MODAR_ASSIGN(Video played, Video::open(video.video));
  auto picture = played.next();
  if (!picture) {
    return fail(ExitCode::kIo, "bench.video", video.video, "the video cannot be read",
                "give a video that other players show");
  }
  const Camera camera = default_camera(picture->width, picture->height);
  MODAR_ASSIGN(Fixture fixture, make_fixture(patterns_of(options, video), options, camera, true));
  MethodTallies tallies(std::filesystem::path(video.video).filename().string(), true);
  for (std::uint64_t frame = 0; picture; picture = played.next()) {
    const auto truth = truths.find(frame);
    // Frames that the truth does not mention are played, not judged.
    const bool judged = truths.empty() || truth != truths.end();
    MethodTallies unjudged("", true);
    MODAR_TRY((judged ? tallies : unjudged)
                  .run(fixture, *picture, truth != truths.end() ? truth->second : FrameTruth{}));
    ++frame;
    if (progress && played.frames() > 0) {
      progress("video", static_cast<double>(frame) / static_cast<double>(played.frames()));
    }
  }
  std::vector<PoseBenchRow> rows;
  tallies.finish(options, rows);
  return rows;
}

}  // namespace modar
