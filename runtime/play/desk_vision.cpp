// Our loop, and the ModAR paper's tracker, as a step of the pipeline.
#include <memory>

#include "vision.hpp"

#include "modar/paper_tracker.hpp"

namespace modar {
namespace {

struct State {
  BundleView bundle;
  VisionOptions options;
  Camera camera;
  std::unique_ptr<PaperTracker> tracker;
  std::shared_ptr<const SpotPattern> spot;  ///< tracked in place of the bundle's patterns
  TrackStep ours;                           ///< empty: the paper's method alone
  std::shared_ptr<const LiveBundle> live;   ///< holds the bytes of `bundle` where it is a newer one

  Result<void> step(Job& job) {
    const Frame& frame = job.frame;
    if (options.spot != nullptr) {
      if (auto made = options.spot->take()) {
        tracker.reset();
        spot = std::move(made);
      }
    }
    if (ours && !spot) return ours(job);
    // A pattern made on the spot stays; ours takes what comes meanwhile once it is gone.
    if (auto newer = options.live == nullptr || ours ? nullptr : options.live->take()) {
      if (!spot) tracker.reset();
      bundle = newer->view;
      live = std::move(newer);
    }
    if (!tracker || camera.width != frame.width || camera.height != frame.height) {
      camera = camera_for(options.camera, frame.width, frame.height);
      MODAR_ASSIGN(auto created,
                   PaperTracker::create(spot ? spot->view : bundle, options.parameter_set, camera));
      tracker = std::move(created);
    }
    const std::int64_t before = now_ns();
    MODAR_ASSIGN(TrackResult result, tracker->step(frame.gray_image()));
    job.track = std::move(result);
    job.track_ms = ms_since(before);
    job.camera = camera;
    job.spot = spot;
    if (!ours) job.live = live;
    return {};
  }
};

}  // namespace

Result<TrackStep> open_vision(const BundleView& bundle, const VisionOptions& options) {
  const auto state =
      std::make_shared<State>(State{bundle, options, {}, nullptr, nullptr, {}, nullptr});
  if (options.ours) state->ours = our_vision(bundle, options);
  return TrackStep([state](Job& job) { return state->step(job); });
}

}  // namespace modar
