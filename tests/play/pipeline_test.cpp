// The player's three threads with a fake source, a fake tracker and no renderer.
#include "runtime/play/pipeline.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace modar {
namespace {

using std::chrono::milliseconds;

/// Counts frames; `live` ones arrive on their own clock. May fail or block at a frame.
class FakeSource final : public FrameSource {
 public:
  std::uint64_t frames = 50;
  std::uint64_t fail_at = ~std::uint64_t{0};
  std::uint64_t block_at = ~std::uint64_t{0};
  milliseconds every{0};

  [[nodiscard]] SourceInfo info() const override { return {100, frames, every.count() > 0}; }

  Result<bool> next(Frame& frame) override {
    if (next_ == fail_at) return fail(ExitCode::kInvalidInput, "input.damaged", "", "torn", "");
    if (next_ == block_at) stopped_.acquire();
    if (stop_ || next_ == frames) return false;
    if (every.count() > 0) std::this_thread::sleep_for(every);
    frame.index = next_;
    frame.time_s = static_cast<double>(next_) / 100.0;
    frame.width = 1;
    frame.height = 1;
    frame.rgb.assign(3, static_cast<std::uint8_t>(next_));
    frame.gray.assign(1, static_cast<std::uint8_t>(next_));
    ++next_;
    return true;
  }

  void stop() override {
    stop_ = true;
    stopped_.release();
  }

 private:
  std::uint64_t next_ = 0;
  std::atomic<bool> stop_{false};
  Semaphore stopped_{0};
};

Result<void> track(Job& job) {
  job.track.features = job.frame.gray[0];
  return {};
}

TEST(Pipeline, FilesShowEveryFrameInOrderWithItsOwnResult) {
  FakeSource source;
  std::uint64_t expected = 0;
  const auto counts =
      run_pipeline(source, track,
                   [&](const Job& job) -> Result<bool> {
                     EXPECT_EQ(job.frame.index, expected++);
                     EXPECT_EQ(job.track.features, static_cast<int>(job.frame.index));
                     return true;
                   },
                   {});
  ASSERT_TRUE(counts);
  EXPECT_EQ(expected, 50u);
  EXPECT_EQ(counts->dropped, 0u);
}

TEST(Pipeline, SlowVisionDropsFramesOfALiveCameraAndKeepsTheNewest) {
  FakeSource source;
  source.every = milliseconds(2);
  std::vector<std::uint64_t> shown;
  PipelineOptions options;
  options.delivery = Delivery::kNewest;
  const auto counts = run_pipeline(
      source,
      [](Job& job) -> Result<void> {
        std::this_thread::sleep_for(milliseconds(11));
        return track(job);
      },
      [&](const Job& job) -> Result<bool> {
        shown.push_back(job.frame.index);
        return true;
      },
      options);
  ASSERT_TRUE(counts);
  EXPECT_GT(counts->dropped, 0u);
  EXPECT_EQ(counts->dropped + shown.size(), 50u);
  ASSERT_FALSE(shown.empty());
  EXPECT_EQ(shown.back(), 49u);
  EXPECT_TRUE(std::is_sorted(shown.begin(), shown.end()));
}

TEST(Pipeline, PacedFramesComeNoEarlierThanTheirTime) {
  FakeSource source;
  source.frames = 6;
  PipelineOptions options;
  options.paced = true;
  options.delivery = Delivery::kNewest;
  const std::int64_t start = now_ns();
  const auto counts = run_pipeline(
      source, track,
      [&](const Job& job) -> Result<bool> {
        EXPECT_GE(ms_since(start) + 0.5, job.frame.time_s * 1000);
        return true;
      },
      options);
  ASSERT_TRUE(counts);
  EXPECT_GE(ms_since(start), 49.0);
}

TEST(Pipeline, ReportsTheErrorOfEachStageAndEnds) {
  const ShowStep show = [](const Job&) -> Result<bool> { return true; };
  FakeSource torn;
  torn.fail_at = 10;
  EXPECT_EQ(run_pipeline(torn, track, show, {}).error().code, "input.damaged");

  FakeSource source;
  const TrackStep lost = [](Job& job) -> Result<void> {
    if (job.frame.index < 5) return {};
    return fail(ExitCode::kInternal, "tracker.opencv", "", "", "");
  };
  EXPECT_EQ(run_pipeline(source, lost, show, {}).error().code, "tracker.opencv");

  FakeSource other;
  const ShowStep full = [](const Job&) -> Result<bool> {
    return fail(ExitCode::kIo, "out.write", "", "", "");
  };
  EXPECT_EQ(run_pipeline(other, track, full, {}).error().code, "out.write");
}

TEST(Pipeline, EndsAtAnyFrameWhileItsNeighboursWork) {
  for (std::uint64_t end = 0; end < 20; ++end) {
    FakeSource source;
    PipelineOptions options;
    options.delivery = end % 2 == 0 ? Delivery::kInOrder : Delivery::kNewest;
    const auto counts = run_pipeline(
        source, track, [end](const Job& job) -> Result<bool> { return job.frame.index < end; },
        options);
    EXPECT_TRUE(counts);
  }
}

TEST(Pipeline, AnIdleStepEndsARunWhoseSourceSleeps) {
  FakeSource source;
  source.block_at = 3;
  int idle = 0;
  PipelineOptions options;
  options.delivery = Delivery::kNewest;
  options.idle_every = milliseconds(5);
  options.idle = [&idle] { return ++idle < 4; };
  const auto counts = run_pipeline(
      source, track, [](const Job&) -> Result<bool> { return true; }, options);
  EXPECT_TRUE(counts);
  EXPECT_EQ(idle, 4);
}

}  // namespace
}  // namespace modar
