// Parameters and camera of the vision thread, whatever the tracker.
#include "vision.hpp"

#include <memory>

#include "modar/pose.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

struct OurVision {
  BundleView bundle;
  VisionOptions options;
  Camera camera;
  std::shared_ptr<const LiveBundle> live;  ///< holds the bytes of `bundle` where it is a newer one
  std::unique_ptr<PoseLoop> loop;
  std::shared_ptr<const LiveBundle> next;  ///< with next_loop: to come
  std::unique_ptr<PoseLoop> next_loop;
  int frames_beside = 0;
  std::uint64_t last_frame = 0;

  [[nodiscard]] PoseLoopOptions loop_options() const {
    PoseLoopOptions how;
    how.async_search = options.apart;
    how.extended = options.extended;
    how.max_instances = options.copies;
    how.estimate_camera = !options.camera;
    return how;
  }

  /// Tells the loop how the camera turned since the last frame that it saw.
  void turn_to(std::uint64_t frame) {
    if (frame > last_frame && frame < options.turns.size()) {
      glm::dvec3 turn = options.turns[last_frame + 1];
      for (std::uint64_t i = last_frame + 2; i <= frame; ++i) {
        turn = -rotation_vector(rotation_matrix(-options.turns[i]) * rotation_matrix(-turn));
      }
      loop->set_turn(turn);
    }
    last_frame = frame;
  }

  /// A newer bundle's loop runs in parallel with the previous one until it detects something too,
  /// or the previous one detects nothing: the pose is not lost on the way.
  Result<void> follow_live(Job& job) {
    constexpr int kMostFrames = 60;  // two seconds: then the new one has no such pattern
    if (auto newer = options.live == nullptr ? nullptr : options.live->take()) {
      MODAR_ASSIGN(next_loop, PoseLoop::create(newer->view, camera, loop_options()));
      next = std::move(newer);
      frames_beside = 0;
    }
    if (!next_loop) return {};
    TrackResult seen;
    MODAR_TRY(next_loop->step(job.frame.gray_image(), seen));
    const bool lost = seen.visible.empty() && !job.track.visible.empty();
    if (lost && ++frames_beside < kMostFrames) return {};
    job.track = std::move(seen);
    loop = std::move(next_loop);
    live = std::move(next);
    bundle = live->view;
    return {};
  }

  Result<void> step(Job& job) {
    const Frame& frame = job.frame;
    const std::int64_t before = now_ns();
    if (options.stills && frame.new_scene) loop.reset();
    if (!loop || camera.width != frame.width || camera.height != frame.height) {
      camera = camera_for(options.camera, frame.width, frame.height);
      MODAR_ASSIGN(auto created, PoseLoop::create(bundle, camera, loop_options()));
      loop = std::move(created);
      if (next) {
        MODAR_ASSIGN(next_loop, PoseLoop::create(next->view, camera, loop_options()));
      }
    }
    turn_to(frame.index);
    MODAR_TRY(loop->step(frame.gray_image(), job.track));
    MODAR_TRY(follow_live(job));
    job.track_ms = ms_since(before);
    if (job.track.camera.estimated) camera.fx = camera.fy = job.track.camera.focal;
    job.camera = camera;
    job.spot = nullptr;
    job.live = live;
    return {};
  }
};

}  // namespace

TrackStep our_vision(const BundleView& bundle, const VisionOptions& options) {
  const auto state =
      std::make_shared<OurVision>(OurVision{bundle, options, {}, {}, {}, {}, {}, 0, 0});
  return [state](Job& job) { return state->step(job); };
}

std::string choose_method(const BundleView& bundle, const std::string& method,
                          const std::string& parameters) {
  if (!method.empty()) return method;
  if (!parameters.empty()) return "paper";
  for (std::uint32_t i = 0; i < bundle.patterns().size(); ++i) {
    if (!bundle.section(SectionType::kTrackerRecord, i).empty()) return "ours";
  }
  return "paper";
}

Result<std::uint32_t> choose_parameter_set(const BundleView& bundle, const std::string& method,
                                           const std::string& name) {
  const Table<ParameterSetRecord> sets = bundle.parameter_sets();
  if (sets.empty()) {
    if (method == "ours") return 0;
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle contains no pattern for the paper's method",
                std::string("bake it again with --parameters ") +
                    (name.empty() ? kDefaultParameterSet : name.c_str()) +
                    "; --parameters none and --device leave it out");
  }
  const std::string_view wanted = name.empty() ? std::string_view(kDefaultParameterSet) : name;
  std::string known;
  for (const ParameterSetRecord& set : sets) {
    const std::string_view each = bundle.name(set.name);
    if (each == wanted) return set.id;
    if (!known.empty()) known += ", ";
    known += each;
  }
  if (name.empty()) return sets[0].id;
  return fail(ExitCode::kUsage, "parameters.unknown", "--parameters",
              "the bundle has no parameter set '" + name + "'",
              "it has: " + known + "; `modar bake --parameters all` stores all four");
}

ParameterSetRecord parameter_set(const BundleView& bundle, std::uint32_t id) {
  const Table<ParameterSetRecord> sets = bundle.parameter_sets();
  for (const ParameterSetRecord& each : sets) {
    if (each.id == id) return each;
  }
  return {};
}

Camera camera_for(const std::optional<Camera>& calibrated, int width, int height) {
  if (!calibrated) return default_camera(width, height);
  if (calibrated->width > 0) return scaled_camera(*calibrated, width, height);
  Camera camera = *calibrated;
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace modar
