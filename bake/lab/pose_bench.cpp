// Runs both methods over bands of rendered frames and over hand-held paths.
#include "bake/lab/pose_bench.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <opencv2/core.hpp>

#include "bake/pattern/pose_subject.hpp"

namespace modar {
namespace {

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

/// A hand's path in one light, over one photo.
Result<void> run_path(const PoseBenchOptions& options, std::size_t p, const GrayPicture& background,
                      double speed, double blur, Tallies& tallies) {
  const Camera camera = default_camera(options.width, options.height);
  SceneBand band;
  band.area_low = 0.8;
  band.area_high = 2.0;
  band.tilt_high = 35;
  auto subject = make_subject({options.patterns[p]}, options, camera, true);
  if (!subject) return tl::unexpected(subject.error());
  const GrayImage picture = subject->pictures[0].view();
  Random random(options.seed + 1000003 * p + 17);
  Pose middle = draw_pose(band, picture, camera, random);
  middle.translation.x = middle.translation.y = 0.0;
  std::array<double, 12> phase{};
  for (double& value : phase) value = random.uniform(0.0, 6.28);
  const SceneLight light = draw_light(random);
  tallies.paper.cut();
  tallies.ours.cut();
  glm::dvec2 last{0.0};
  for (int i = 0; i < options.frames; ++i) {
    const Pose pose = path_pose(middle, i / 30.0, speed, phase);
    const glm::dvec2 centre = project(camera, pose.translation);
    const glm::dvec2 motion = i > 0 ? centre - last : glm::dvec2(0.0);
    last = centre;
    const SceneFrame scene =
        render_scene(picture, camera, pose, background, band, random, &light,
                     {blur * glm::length(motion), std::atan2(motion.y, motion.x)});
    auto done = tallies.measure(*subject, scene.picture.view(), {true, scene.corners});
    if (!done) return done;
  }
  return {};
}

}  // namespace

Result<std::vector<GrayPicture>> load_backgrounds(const std::vector<std::string>& paths, int width,
                                                  int height) {
  std::vector<GrayPicture> backgrounds;
  for (const std::string& path : paths) {
    auto background = load_background(path, width, height);
    if (!background) return tl::unexpected(background.error());
    backgrounds.push_back(std::move(*background));
  }
  return backgrounds;
}

Result<std::vector<PoseBenchRow>> bench_detection(const PoseBenchOptions& options,
                                                  const ProgressCallback& progress) {
  cv::setNumThreads(1);
  const auto backgrounds = backgrounds_of(options);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  const Camera camera = default_camera(options.width, options.height);
  const std::vector<SceneBand> bands = options.bands.empty() ? pose_bands() : options.bands;
  std::vector<Tallies> tallies;
  for (const SceneBand& band : bands) tallies.emplace_back(band.name, false);
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    auto subject = make_subject({options.patterns[p]}, options, camera, false);
    if (!subject) return tl::unexpected(subject.error());
    const GrayImage picture = subject->pictures[0].view();
    for (std::size_t b = 0; b < bands.size(); ++b) {
      Random random(options.seed + 1000003 * p + 7919 * b);
      const int frames = frames_of(options, bands[b]);
      for (int i = 0; i < frames; ++i) {
        const GrayPicture& photo =
            (*backgrounds)[static_cast<std::size_t>(random.next() % backgrounds->size())];
        // Without a pattern, the photo alone has to make the frames differ.
        const GrayPicture background = bands[b].pattern ? photo : another_view(photo, random);
        const Pose pose = draw_pose(bands[b], picture, camera, random);
        const SceneFrame scene = render_scene(picture, camera, pose, background, bands[b], random);
        auto done =
            tallies[b].measure(*subject, scene.picture.view(), {bands[b].pattern, scene.corners});
        if (!done) return tl::unexpected(done.error());
      }
      if (progress) {
        progress("detection", static_cast<double>(p * bands.size() + b + 1) /
                                  static_cast<double>(options.patterns.size() * bands.size()));
      }
    }
  }
  std::vector<PoseBenchRow> rows;
  for (Tallies& each : tallies) each.finish(options, rows);
  return rows;
}

Result<std::vector<PoseBenchRow>> bench_tracking(const PoseBenchOptions& options,
                                                 const std::string& name, double speed, double blur,
                                                 const ProgressCallback& progress) {
  cv::setNumThreads(1);
  const auto backgrounds = backgrounds_of(options);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  Tallies tallies(name, true);
  for (std::size_t p = 0; p < options.patterns.size(); ++p) {
    const GrayPicture& background = (*backgrounds)[(options.seed + p) % backgrounds->size()];
    if (auto done = run_path(options, p, background, speed, blur, tallies); !done) {
      return tl::unexpected(done.error());
    }
    if (progress) {
      progress(name, static_cast<double>(p + 1) / static_cast<double>(options.patterns.size()));
    }
  }
  std::vector<PoseBenchRow> rows;
  tallies.finish(options, rows);
  return rows;
}

}  // namespace modar
