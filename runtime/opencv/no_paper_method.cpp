// In place of runtime/extensions/paper, where that extension is not built (MODAR_PAPER).
#include "modar/paper_tracker.hpp"

namespace modar {

struct PaperTracker::State {};

PaperTracker::PaperTracker(std::unique_ptr<State> state) : state_(std::move(state)) {}
PaperTracker::~PaperTracker() = default;

Result<std::unique_ptr<PaperTracker>> PaperTracker::create(const BundleView&, std::uint32_t,
                                                           const Camera&) {
  return fail(ExitCode::kUnsupported, "tracker.no-paper", "",
              "this build leaves out the ModAR paper's method", "configure with -DMODAR_PAPER=ON");
}

// Nobody has an object of this class.
Result<TrackResult> PaperTracker::step(const GrayImage&) {
  return TrackResult{};
}

}  // namespace modar
