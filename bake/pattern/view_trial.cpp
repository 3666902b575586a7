// Renders views of known pose and judges the loop on them.
#include "bake/pattern/view_trial.hpp"

#include <glm/geometric.hpp>

#include "bake/parallel.hpp"
#include "bake/pattern/pose_subject.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kExposures = 2;
constexpr int kSampleScale = 4;  // frame pixels in one of the sample
constexpr double kPi = 3.14159265358979323846;

GrayPicture quarter(const GrayPicture& frame) {
  const auto levels = halved(frame.view());
  return levels[std::min<std::size_t>(2, levels.size() - 1)];
}

void keep_sample(const SceneFrame& scene, const GrayPicture& frame, const TrackResult& result,
                 TrialOutcome& outcome) {
  outcome.sample = quarter(frame);
  const auto scaled = [](const std::array<glm::dvec2, 4>& corners) {
    std::array<glm::dvec2, 4> out;
    for (std::size_t i = 0; i < 4; ++i) out[i] = corners[i] / static_cast<double>(kSampleScale);
    return out;
  };
  outcome.truth = scaled(scene.corners);
  if (result.visible.empty()) return;
  outcome.seen = scaled(result.visible[0].corners);
  outcome.sample_right = is_right(result.visible[0], {true, scene.corners});
}

Result<TrialOutcome> try_setting(const TrialBed& bed, const TrialSetting& setting,
                                 std::uint64_t seed) {
  const auto bundle = BundleView::open(bed.bundle);
  if (!bundle) return tl::unexpected(bundle.error());
  auto loop = PoseLoop::create(*bundle, bed.camera);
  if (!loop) return tl::unexpected(loop.error());
  Random random(seed);
  Tally tally(setting.band.name, "ours", true);
  TrialOutcome outcome;
  TrackResult result;
  GrayPicture frame;
  for (int view = 0; view < bed.views; ++view) {
    const GrayPicture& background = bed.backgrounds[random.next() % bed.backgrounds.size()];
    const Pose pose = draw_pose(setting.band, bed.picture, bed.camera, random);
    const SceneLight light = setting.light ? *setting.light : draw_light(random);
    const SceneFrame scene =
        render_still(bed.picture, bed.camera, pose, background, setting.band, random, light.focus,
                     {setting.motion_px, random.uniform(0, kPi)});
    (*loop)->reset();
    tally.cut();
    for (int i = 0; i < kExposures; ++i) {
      expose(scene.picture, light, random, frame);
      if (auto done = (*loop)->step(frame.view(), result); !done) {
        return tl::unexpected(done.error());
      }
      tally.add(result, {true, scene.corners}, 0);
      if (view == 0 && i == 0) keep_sample(scene, frame, result, outcome);
    }
  }
  outcome.row = tally.finish();
  return outcome;
}

}  // namespace

Result<std::vector<TrialOutcome>> try_views(const TrialBed& bed,
                                            std::span<const TrialSetting> settings,
                                            const std::function<void()>& stepped) {
  std::vector<Result<TrialOutcome>> all(settings.size(), TrialOutcome{});
  parallel_rows(static_cast<std::uint32_t>(settings.size()), bed.jobs, [&](std::uint32_t i) {
    all[i] = try_setting(bed, settings[i], bed.seed + 1000003 * i);
    if (stepped) stepped();
  });
  std::vector<TrialOutcome> outcomes;
  for (auto& one : all) {
    if (!one) return tl::unexpected(one.error());
    outcomes.push_back(std::move(*one));
  }
  return outcomes;
}

}  // namespace modar
