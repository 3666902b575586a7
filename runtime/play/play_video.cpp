// Plays a bundle over frames: puts source, vision and player together.
#include <cstdio>
#include <optional>

#include "modar/camera_file.hpp"
#include "pipeline.hpp"
#include "play.hpp"
#include "player.hpp"
#include "recording.hpp"
#include "vision.hpp"
#include "yuv.hpp"

namespace modar {
namespace {

/// What the command line and, of a replay, the recording ask for.
struct Plan {
  std::string input;
  std::string method;
  std::string parameters;
  std::optional<Camera> camera;
  std::optional<GoldenCheck> golden;
};

Result<Plan> make_plan(const PlayOptions& options, const BundleView& bundle) {
  Plan plan{options.input, options.method, options.parameters, std::nullopt, std::nullopt};
  if (!options.golden.empty()) {
    Result<Recording> recording = read_recording(options.golden);
    if (!recording) return tl::unexpected(recording.error());
    const RecordingHead& head = recording->head;
    if (head.bundle_hash != bundle.header().hash && !options.quiet) {
      std::fprintf(stderr, "modar-play: the recording was made with another bundle\n");
    }
    plan.input = options.golden + "/frames";
    if (plan.method.empty() && plan.parameters.empty()) plan.method = head.method;
    if (plan.parameters.empty()) plan.parameters = head.parameters;
    if (head.camera.width > 0) plan.camera = head.camera;
    plan.golden.emplace(std::move(*recording), options.tolerance);
  }
  if (!options.camera_file.empty()) {
    Result<Camera> camera = read_camera_file(options.camera_file);
    if (!camera) return tl::unexpected(camera.error());
    plan.camera = *camera;
  }
  return plan;
}

/// Recordings and replays look at the gray of the recorded picture, not at the camera's own.
TrackStep with_gray_of_rgb(TrackStep track) {
  return [track = std::move(track)](Job& job) {
    make_rgb(job.frame);
    gray_from_rgb(job.frame);
    return track(job);
  };
}

}  // namespace

Result<int> play_video(const PlayOptions& asked, const BundleView& bundle) {
  Result<Plan> plan = make_plan(asked, bundle);
  if (!plan) return tl::unexpected(plan.error());
  PlayOptions options = asked;
  options.method = choose_method(bundle, plan->method, plan->parameters);
  const Result<std::uint32_t> set = choose_parameter_set(bundle, options.method, plan->parameters);
  if (!set) return tl::unexpected(set.error());
  if (options.find_focal && options.method != "ours") {
    return fail(ExitCode::kUsage, "usage.conflict", "--find-focal",
                "it looks with our loop's records, not with the article's method",
                "leave --method and --parameters out, and bake the pattern with this modar");
  }
  auto source = open_frame_source(plan->input);
  if (!source) return tl::unexpected(source.error());
  const SourceInfo info = (*source)->info();
  // Only where frames may be dropped may a result depend on time.
  const bool newest = info.live || options.realtime;
  SpotSlot spot;
  Result<TrackStep> track = open_vision(
      bundle, {options.method == "ours", *set, plan->camera, &spot, newest, options.find_focal});
  if (!track) return tl::unexpected(track.error());

  Player player(options, bundle);
  const std::string name(bundle.name(parameter_set(bundle, *set).name));
  if (auto opened = player.open({info, *set, name, plan->camera.value_or(Camera{}), &spot});
      !opened) {
    return tl::unexpected(opened.error());
  }
  if (!options.record.empty() || plan->golden) *track = with_gray_of_rgb(std::move(*track));
  if (plan->golden) player.compare(std::move(*plan->golden));
  if (bundle.scenes().empty() && !options.quiet) {
    std::fprintf(stderr, "modar-play: no scene of the bundle binds a model to a pattern\n");
  }

  PipelineOptions how;
  how.paced = options.realtime && !info.live;
  if (newest) how.delivery = Delivery::kNewest;
  how.idle = [&player] { return player.idle(); };
  catch_interrupts();
  const Result<PipelineCounts> counts = run_pipeline(
      **source, *track, [&player](const Job& job) { return player.show(job); }, how);
  if (!counts) return tl::unexpected(counts.error());
  return player.finish(*counts);
}

}  // namespace modar
