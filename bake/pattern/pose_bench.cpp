// Runs both methods over bands of rendered frames and over hand-held paths.
#include "bake/pattern/pose_bench.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>

#include <glm/geometric.hpp>
#include <opencv2/core.hpp>

#include "bake/pattern/loop_bake.hpp"
#include "bake/pattern/pattern_picture.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/loop_record.hpp"
#include "modar/features.hpp"
#include "modar/pose_loop.hpp"
#include "modar/tracker.hpp"

namespace modar {
namespace {

constexpr double kRight = 5.0;  // pixels

double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// A pattern, its bundle and the trackers on it.
struct Subject {
  GrayPicture picture;
  std::vector<std::byte> bytes;
  std::unique_ptr<PaperTracker> paper;
  std::unique_ptr<PoseLoop> ours;
};

Result<std::vector<std::byte>> bundle_of(const GrayImage& pattern, std::uint32_t set_id) {
  BundleContent content;
  PatternRecord record{};
  record.name = content.intern("pattern");
  record.width = static_cast<std::uint32_t>(pattern.width);
  record.height = static_cast<std::uint32_t>(pattern.height);
  const auto corners = pattern_corners(pattern.width, pattern.height);
  record.half_width = static_cast<float>(corners[1].x);
  record.half_height = static_cast<float>(corners[1].y);
  record.score = -1.0f;
  content.patterns.push_back(record);
  content.features.emplace_back();
  for (ParameterSetRecord set : paper_parameter_sets()) {
    if (set.id != set_id) continue;
    set.name = content.intern(parameter_set_name(set_id));
    content.parameter_sets.push_back(set);
    auto features = describe_image(pattern, set);
    if (!features) return tl::unexpected(features.error());
    auto yml = features_to_yml(*features);
    if (!yml) return tl::unexpected(yml.error());
    content.features[0].push_back({set_id, features->descriptor_bytes,
                                   std::move(features->keypoints), std::move(features->descriptors),
                                   std::move(*yml)});
  }
  auto loop = bake_loop_record(pattern, LoopBakeOptions{});
  if (!loop) return tl::unexpected(loop.error());
  ExtraSection section;
  section.type = kLoopRecordSection;
  section.owner = 0;
  section.bytes = std::move(*loop);
  content.extra.push_back(std::move(section));
  std::vector<std::byte> bytes;
  const auto written = write_bundle(content, [&](std::span<const std::byte> part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  });
  if (!written) return tl::unexpected(written.error());
  return bytes;
}

Result<Subject> make_subject(const std::string& path, const PoseBenchOptions& options,
                             const Camera& camera, bool track) {
  Subject subject;
  bool shrunk = false;
  auto picture = load_pattern(path, shrunk);
  if (!picture) return tl::unexpected(picture.error());
  subject.picture = std::move(*picture);
  auto bytes = bundle_of(subject.picture.view(), options.paper_set);
  if (!bytes) return tl::unexpected(bytes.error());
  subject.bytes = std::move(*bytes);
  const auto bundle = BundleView::open(subject.bytes);
  if (!bundle) return tl::unexpected(bundle.error());
  if (options.paper_set != 0) {
    auto paper = PaperTracker::create(*bundle, options.paper_set, camera);
    if (!paper) return tl::unexpected(paper.error());
    subject.paper = std::move(*paper);
  }
  if (options.ours) {
    PoseLoopOptions loop;
    loop.track = track;
    auto ours = PoseLoop::create(*bundle, camera, loop);
    if (!ours) return tl::unexpected(ours.error());
    subject.ours = std::move(*ours);
  }
  return subject;
}

/// Sums of one method on one band.
struct Tally {
  PoseBenchRow row;
  std::vector<double> errors;
  double change = 0.0;
  int changes = 0;
  bool have_last = false;
  std::array<glm::dvec2, 4> last{};

  void add(const TrackResult& result, const SceneFrame& scene, bool pattern, double ms) {
    ++row.frames;
    row.ms += ms;
    row.stages_ms[0] += result.times.detect;
    row.stages_ms[1] += result.times.describe;
    row.stages_ms[2] += result.times.match;
    row.stages_ms[3] += result.times.homography + result.times.pose;
    if (result.visible.empty()) {
      have_last = false;
      return;
    }
    ++row.recognised;
    if (!pattern) return;
    double error = 0.0;
    std::array<glm::dvec2, 4> miss;
    for (std::size_t i = 0; i < 4; ++i) {
      miss[i] = result.visible[0].corners[i] - scene.corners[i];
      error += 0.25 * glm::length(miss[i]);
    }
    if (error < kRight) {
      ++row.right;
      errors.push_back(error);
    }
    if (have_last && error < kRight) {
      for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec2 d = miss[i] - last[i];
        change += 0.5 * glm::dot(d, d);
        ++changes;
      }
    }
    have_last = error < kRight;
    last = miss;
  }

  PoseBenchRow finish() {
    const double frames = std::max(row.frames, 1);
    row.ms /= frames;
    for (double& stage : row.stages_ms) stage /= frames;
    if (!errors.empty()) {
      std::nth_element(errors.begin(),
                       errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                       errors.end());
      row.error_px = errors[errors.size() / 2];
    }
    if (changes > 0) row.jitter_px = std::sqrt(change / changes);
    return row;
  }
};

template <class Method>
Result<void> measure(Method& method, const SceneFrame& scene, bool pattern, Tally& tally) {
  const double start = thread_ms();
  auto result = method.step(scene.picture.view());
  const double ms = thread_ms() - start;
  if (!result) return tl::unexpected(result.error());
  tally.add(*result, scene, pattern, ms);
  return {};
}

Result<void> measure(Subject& subject, const SceneFrame& scene, bool pattern, Tally& paper,
                     Tally& ours) {
  if (subject.paper) {
    if (auto done = measure(*subject.paper, scene, pattern, paper); !done) return done;
  }
  if (subject.ours) {
    if (auto done = measure(*subject.ours, scene, pattern, ours); !done) return done;
  }
  return {};
}

Result<std::vector<GrayPicture>> load_backgrounds(const PoseBenchOptions& options) {
  std::vector<GrayPicture> backgrounds;
  for (const std::string& path : options.backgrounds) {
    auto background = load_background(path, options.width, options.height);
    if (!background) return tl::unexpected(background.error());
    backgrounds.push_back(std::move(*background));
  }
  if (backgrounds.empty() || options.patterns.empty()) {
    return fail(ExitCode::kUsage, "bench.input", "", "the bench needs patterns and backgrounds",
                "give folders with pictures");
  }
  return backgrounds;
}

/// A hand's path: slow sines of all six parameters about a pose.
Pose path_pose(const Pose& middle, double time, double speed, const std::array<double, 12>& phase) {
  const auto sway = [&](std::size_t k, double hertz) {
    return std::sin(2 * 3.14159265358979323846 * hertz * speed * time + phase[k]) +
           0.3 * std::sin(2 * 3.14159265358979323846 * 2.7 * hertz * speed * time + phase[k + 6]);
  };
  Pose pose = middle;
  pose.rotation =
      rotation_matrix({0.20 * sway(0, 0.31), 0.20 * sway(1, 0.23), 0.25 * sway(2, 0.17)}) *
      middle.rotation;
  const double depth = middle.translation.z;
  pose.translation +=
      glm::dvec3(0.10 * sway(3, 0.29), 0.07 * sway(4, 0.37), 0.15 * sway(5, 0.13)) * depth;
  return pose;
}

std::vector<PoseBenchRow> rows_of(Tally& paper, Tally& ours, const PoseBenchOptions& options) {
  std::vector<PoseBenchRow> rows;
  paper.row.method = "paper";
  ours.row.method = "ours";
  if (options.paper_set != 0) rows.push_back(paper.finish());
  if (options.ours) rows.push_back(ours.finish());
  return rows;
}

}  // namespace

Result<std::vector<PoseBenchRow>> bench_detection(const PoseBenchOptions& options,
                                                  const PoseBenchProgress& progress) {
  cv::setNumThreads(1);
  const auto backgrounds = load_backgrounds(options);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  const Camera camera = default_camera(options.width, options.height);
  const std::vector<SceneBand> bands = options.bands.empty() ? pose_bands() : options.bands;
  std::vector<Tally> paper(bands.size());
  std::vector<Tally> ours(bands.size());
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    auto subject = make_subject(options.patterns[p], options, camera, false);
    if (!subject) return tl::unexpected(subject.error());
    for (std::size_t b = 0; b < bands.size(); ++b) {
      Random random(options.seed + 1000003 * p + 7919 * b);
      for (int i = 0; i < options.frames; ++i) {
        const GrayPicture& background =
            (*backgrounds)[static_cast<std::size_t>(random.next() % backgrounds->size())];
        const Pose pose = draw_pose(bands[b], subject->picture.view(), camera, random);
        const SceneFrame scene =
            render_scene(subject->picture.view(), camera, pose, background, bands[b], random);
        if (auto done = measure(*subject, scene, bands[b].pattern, paper[b], ours[b]); !done) {
          return tl::unexpected(done.error());
        }
      }
      if (progress) {
        progress("detection", static_cast<double>(p * bands.size() + b + 1) /
                                  static_cast<double>(options.patterns.size() * bands.size()));
      }
    }
  }
  std::vector<PoseBenchRow> rows;
  for (std::size_t b = 0; b < bands.size(); ++b) {
    paper[b].row.band = ours[b].row.band = bands[b].name;
    for (PoseBenchRow& row : rows_of(paper[b], ours[b], options)) rows.push_back(std::move(row));
  }
  return rows;
}

Result<std::vector<PoseBenchRow>> bench_tracking(const PoseBenchOptions& options, double speed,
                                                 double blur, const PoseBenchProgress& progress) {
  cv::setNumThreads(1);
  const auto backgrounds = load_backgrounds(options);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  const Camera camera = default_camera(options.width, options.height);
  SceneBand band;
  band.name = "tracking x" + std::to_string(static_cast<int>(speed)) + (blur > 0 ? " blurred" : "");
  band.area_low = 0.8;
  band.area_high = 2.0;
  band.tilt_high = 35;
  Tally paper;
  Tally ours;
  paper.row.band = ours.row.band = band.name;
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    auto subject = make_subject(options.patterns[p], options, camera, true);
    if (!subject) return tl::unexpected(subject.error());
    Random random(options.seed + 1000003 * p + 17);
    const GrayPicture& background =
        (*backgrounds)[static_cast<std::size_t>(random.next() % backgrounds->size())];
    Pose middle = draw_pose(band, subject->picture.view(), camera, random);
    middle.translation.x = middle.translation.y = 0.0;
    std::array<double, 12> phase{};
    for (double& value : phase) value = random.uniform(0.0, 6.28);
    glm::dvec2 last{0.0};
    paper.have_last = ours.have_last = false;
    for (int i = 0; i < options.frames; ++i) {
      const Pose pose = path_pose(middle, i / 30.0, speed, phase);
      const glm::dvec2 centre = project(camera, pose.translation);
      const glm::dvec2 motion = i > 0 ? centre - last : glm::dvec2(0.0);
      last = centre;
      // The same light throughout, other noise in each frame.
      Random noise(options.seed + 31 * p);
      for (int skipped = 0; skipped < i; ++skipped) noise.next();
      const SceneFrame scene =
          render_scene(subject->picture.view(), camera, pose, background, band, noise,
                       blur * glm::length(motion), std::atan2(motion.y, motion.x));
      if (auto done = measure(*subject, scene, true, paper, ours); !done)
        return tl::unexpected(done.error());
    }
    if (progress)
      progress("tracking",
               static_cast<double>(p + 1) / static_cast<double>(options.patterns.size()));
  }
  return rows_of(paper, ours, options);
}

}  // namespace modar
