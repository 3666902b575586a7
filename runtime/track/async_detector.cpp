// One search at a time: who may touch frame and candidates changes hands through turn_.
#include "async_detector.hpp"

#include <algorithm>
#include <cstring>

namespace modar::tracker {

AsyncDetector::AsyncDetector(const Camera& camera, std::span<const TrackedPattern> patterns,
                             const DetectOptions& options)
    : eye_(FeatureExtractor::create(camera.width, camera.height, options)),
      search_(camera, patterns, options),
      pixels_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      wants_(patterns.size(), Want::kNo) {
  frame_ = {pixels_.data(), camera.width, camera.height, camera.width};
  findings_.patterns.resize(patterns.size());
  thread_ = std::thread([this] { work(); });
}

AsyncDetector::~AsyncDetector() {
  closing_.store(true, std::memory_order_release);
  wake_.release();
  thread_.join();
}

void AsyncDetector::start(const GrayImage& frame, std::span<const Want> wants) {
  for (int y = 0; y < frame_.height; ++y) {
    std::memcpy(pixels_.data() + y * frame_.stride, frame.pixels + y * frame.stride,
                static_cast<std::size_t>(frame_.width));
  }
  std::copy(wants.begin(), wants.end(), wants_.begin());
  turn_.store(Turn::kSearching, std::memory_order_release);
  wake_.release();
}

bool AsyncDetector::take(DetectionCandidates& candidates, std::vector<Want>& wants) {
  if (turn_.load(std::memory_order_acquire) != Turn::kFound) return false;
  std::swap(candidates, findings_);
  wants.swap(wants_);
  turn_.store(Turn::kIdle, std::memory_order_release);
  return true;
}

void AsyncDetector::work() {
  for (;;) {
    wake_.acquire();
    if (closing_.load(std::memory_order_acquire)) return;
    eye_->set_frame(frame_);
    search_.run(*eye_, wants_, findings_);
    turn_.store(Turn::kFound, std::memory_order_release);
  }
}

}  // namespace modar::tracker
