// Parameters and camera of the vision thread, whatever the tracker.
#include "vision.hpp"

#include <memory>

#include "modar/focal_finder.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

/// Frames between looks for the focal length: neighbours show the same view. Set by hand.
constexpr int kLookEvery = 5;

struct OurVision {
  const BundleView& bundle;
  VisionOptions options;
  Camera camera;
  std::unique_ptr<PoseLoop> loop;
  std::unique_ptr<FocalFinder> finder;
  int frames_to_look = 0;
  FocalProgress focal;

  /// Once the focal length is known, it is the camera's, and the next loop starts with it.
  Result<void> look(const Frame& frame) {
    if (--frames_to_look > 0) return {};
    frames_to_look = kLookEvery;
    if (!finder) {
      MODAR_ASSIGN(auto created, FocalFinder::create(bundle, frame.width, frame.height));
      finder = std::move(created);
    }
    const bool added = finder->add_frame(frame.gray_image());
    focal = finder->progress();
    const std::optional<double> found = added ? finder->focal() : std::nullopt;
    if (!found) return {};
    options.camera = default_camera(frame.width, frame.height);
    options.camera->fx = options.camera->fy = *found;
    finder.reset();
    loop.reset();
    return {};
  }

  Result<void> step(Job& job) {
    const Frame& frame = job.frame;
    const std::int64_t before = now_ns();
    if (camera.width != frame.width || camera.height != frame.height) finder.reset();
    if (options.find_focal && !options.camera) {
      MODAR_TRY(look(frame));
    }
    if (!loop || camera.width != frame.width || camera.height != frame.height) {
      camera = camera_for(options.camera, frame.width, frame.height);
      PoseLoopOptions how;
      how.async_search = options.apart;
      MODAR_ASSIGN(auto created, PoseLoop::create(bundle, camera, how));
      loop = std::move(created);
    }
    MODAR_TRY(loop->step(frame.gray_image(), job.track));
    job.track_ms = ms_since(before);
    job.camera = camera;
    job.focal = focal;
    job.spot = nullptr;
    return {};
  }
};

}  // namespace

TrackStep our_vision(const BundleView& bundle, const VisionOptions& options) {
  const auto state =
      std::make_shared<OurVision>(OurVision{bundle, options, {}, nullptr, nullptr, 0, {}});
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
                "the bundle holds no pattern that the paper's method can look for",
                "bake it with --pattern IMAGE, and without --parameters none");
  }
  const std::string_view wanted = name.empty() ? std::string_view("orb-2000") : name;
  std::string known;
  for (std::uint32_t i = 0; i < sets.size(); ++i) {
    const std::string_view each = bundle.name(sets[i].name);
    if (each == wanted) return sets[i].id;
    if (!known.empty()) known += ", ";
    known += each;
  }
  if (name.empty()) return sets[0].id;
  return fail(ExitCode::kUsage, "parameters.unknown", "--parameters",
              "the bundle has no parameter set '" + name + "'", "it has: " + known);
}

ParameterSetRecord parameter_set(const BundleView& bundle, std::uint32_t id) {
  const Table<ParameterSetRecord> sets = bundle.parameter_sets();
  for (std::uint32_t i = 0; i < sets.size(); ++i) {
    if (sets[i].id == id) return sets[i];
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
