// Bundles of quarters of pictures, and what the device's loop makes of them.
#include "bake/pattern/many_bench.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include <malloc.h>

#include "bake/pattern/pattern_picture.hpp"
#include "bake/pattern/pose_subject.hpp"
#include "bake/texture/parallel.hpp"
#include "bake/thread_clock.hpp"
#include "formats/bundle_view.hpp"

namespace modar {
namespace {

constexpr std::size_t kCounts[] = {1, 10, 50};
constexpr std::size_t kMost = 50;
constexpr std::size_t kOfPicture = 8;  // quarters, and those mirrored
constexpr int kSettle = 5;             // frames before a pattern is hidden
constexpr int kHidden = 10;
constexpr int kPatience = 60;  // frames to wait for it

/// Quarter 0 to 3 of a picture, mirrored from 4 on.
GrayPicture quarter_of(const GrayPicture& picture, std::size_t which) {
  GrayPicture quarter{picture.width / 2, picture.height / 2, {}};
  const int left = which % 2 == 0 ? 0 : quarter.width;
  const int top = which / 2 % 2 == 0 ? 0 : quarter.height;
  for (int y = 0; y < quarter.height; ++y) {
    const auto row =
        picture.pixels.begin() + static_cast<std::ptrdiff_t>(top + y) * picture.width + left;
    quarter.pixels.insert(quarter.pixels.end(), row, row + quarter.width);
    if (which >= 4) std::reverse(quarter.pixels.end() - quarter.width, quarter.pixels.end());
  }
  return quarter;
}

struct Many {
  std::vector<GrayPicture> pictures;
  std::vector<std::vector<std::byte>> records;

  [[nodiscard]] Result<std::vector<std::byte>> bundle(std::size_t count) const {
    return bundle_of_records({pictures.data(), count}, {records.data(), count});
  }
};

Result<Many> make_many(const PoseBenchOptions& options, const PoseBenchProgress& progress) {
  const std::size_t files = options.patterns.size();
  if (files * kOfPicture < kMost || options.backgrounds.empty()) {
    return fail(ExitCode::kUsage, "bench.input", "--many",
                "fifty patterns are made of at least seven pictures, and shown over photos",
                "give folders with more pictures");
  }
  std::vector<GrayPicture> whole;
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    auto picture = load_pattern(path, shrunk);
    if (!picture) return tl::unexpected(picture.error());
    whole.push_back(std::move(*picture));
  }
  Many many;
  for (std::size_t i = 0; i < kMost; ++i) {
    many.pictures.push_back(quarter_of(whole[i % files], i / files));
  }
  std::vector<Result<std::vector<std::byte>>> baked(kMost);
  if (progress) progress("baking", 0.0);
  parallel_rows(kMost, std::thread::hardware_concurrency(),
                [&](std::uint32_t i) { baked[i] = bake_loop_record(many.pictures[i].view(), {}); });
  for (auto& record : baked) {
    if (!record) return tl::unexpected(record.error());
    many.records.push_back(std::move(*record));
  }
  return many;
}

/// How pictures are shown: close enough that a search finds what it can.
SceneBand easy_band() {
  SceneBand band;
  band.area_low = 2.0;
  band.area_high = 4.0;
  band.tilt_high = 30;
  return band;
}

/// Searches alone, on the same frames for each count.
Result<void> measure_detection(const Many& many, const std::vector<SceneFrame>& frames,
                               const Camera& camera, std::vector<ManyBenchRow>& rows) {
  double with_one = 0;
  for (const std::size_t count : kCounts) {
    const auto bytes = many.bundle(count);
    if (!bytes) return tl::unexpected(bytes.error());
    PoseLoopOptions how;
    how.track = false;
    auto loop = PoseLoop::create(BundleView::open(*bytes).value(), camera, how);
    if (!loop) return tl::unexpected(loop.error());
    double seconds = 0;
    int right = 0;
    int others = 0;
    TrackResult seen;
    for (const SceneFrame& frame : frames) {
      const double start = thread_seconds();
      if (auto done = (*loop)->step(frame.picture.view(), seen); !done) return done;
      seconds += thread_seconds() - start;
      for (const Sighting& each : seen.visible) {
        right += each.pattern == 0 && is_right(each, {true, frame.corners}) ? 1 : 0;
        others += each.pattern != 0 ? 1 : 0;
      }
    }
    const double all = static_cast<double>(frames.size());
    const double ms = 1e3 * seconds / all;
    if (count == 1) with_one = ms;
    const int patterns = static_cast<int>(count);
    rows.push_back({"detection cpu_ms", patterns, ms, with_one * patterns});
    rows.push_back({"detection right_pct", patterns, 100.0 * right / all, 0});
    rows.push_back({"detection others", patterns, 1.0 * others, 0});
  }
  return {};
}

/// From mapped bytes to a loop that takes frames: median time, and what it holds on the heap.
Result<void> measure_ready(std::span<const std::byte> bytes, const Camera& camera,
                           std::vector<ManyBenchRow>& rows) {
  std::vector<double> times;
  double held = 0;
  for (int i = 0; i < 5; ++i) {
    const struct mallinfo2 before = mallinfo2();
    const auto start = std::chrono::steady_clock::now();
    const auto bundle = BundleView::open(bytes);
    if (!bundle) return tl::unexpected(bundle.error());
    const auto loop = PoseLoop::create(*bundle, camera);
    if (!loop) return tl::unexpected(loop.error());
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    times.push_back(ms.count());
    const struct mallinfo2 after = mallinfo2();
    held = static_cast<double>(after.uordblks + after.hblkhd) -
           static_cast<double>(before.uordblks + before.hblkhd);
  }
  std::nth_element(times.begin(), times.begin() + 2, times.end());
  rows.push_back({"ready_ms", kMost, times[2], 0});
  rows.push_back({"ready_heap_bytes", kMost, held, 0});
  return {};
}

/// A scene of one or two patterns; the first is hidden and shown again, the other stays.
class Return {
 public:
  Return(const Many& many, const GrayPicture& background, const Camera& camera, bool beside,
         std::uint64_t seed)
      : many_(many), background_(background), camera_(camera), random_(seed) {
    patterns_[0] = random_.next() % kMost;
    patterns_[1] = (patterns_[0] + 1 + random_.next() % (kMost - 1)) % kMost;
    const std::size_t shown = beside ? 2 : 1;
    for (std::size_t k = 0; k < shown; ++k) {
      Pose pose = draw_pose(band_, picture(k), camera_, random_);
      const double aside = beside ? 0.25 * camera_.width / camera_.fx : 0.0;
      pose.translation.x = (k == 0 ? -aside : aside) * pose.translation.z;
      pose.translation.y = 0;
      poses_.push_back(pose);
    }
  }

  /// Frames until the pattern is right again, 1: at once; kPatience where it never is; 0 where it
  /// was not there to be lost.
  Result<int> frames(PoseLoop& loop) {
    loop.reset();
    TrackResult seen;
    for (int i = 0; i < kSettle + 10; ++i) {
      if (auto done = show(loop, true, seen); !done) return tl::unexpected(done.error());
    }
    if (!is_back(seen)) return 0;
    for (int i = 0; i < kHidden; ++i) {
      if (auto done = show(loop, false, seen); !done) return tl::unexpected(done.error());
    }
    for (int waited = 1; waited < kPatience; ++waited) {
      if (auto done = show(loop, true, seen); !done) return tl::unexpected(done.error());
      if (is_back(seen)) return waited;
    }
    return kPatience;
  }

 private:
  [[nodiscard]] GrayImage picture(std::size_t k) const {
    return many_.pictures[patterns_[k]].view();
  }
  Result<void> show(PoseLoop& loop, bool first, TrackResult& seen) {
    SceneFrame scene;
    scene.picture = background_;
    for (std::size_t k = first ? 0 : 1; k < poses_.size(); ++k) {
      const GrayPicture behind = std::move(scene.picture);
      scene = render_still(picture(k), camera_, poses_[k], behind, band_, random_, 0.5, {});
      if (k == 0) corners_ = scene.corners;
    }
    GrayPicture exposed;
    expose(scene.picture, {}, random_, exposed);
    return loop.step(exposed.view(), seen);
  }
  [[nodiscard]] bool is_back(const TrackResult& seen) const {
    return std::any_of(seen.visible.begin(), seen.visible.end(), [this](const Sighting& each) {
      return each.pattern == patterns_[0] && is_right(each, {true, corners_});
    });
  }

  const Many& many_;
  const GrayPicture& background_;
  Camera camera_;
  Random random_;
  SceneBand band_ = easy_band();
  std::size_t patterns_[2] = {0, 0};
  std::vector<Pose> poses_;
  std::array<glm::dvec2, 4> corners_{};
};

/// Alone in the frame, and beside a pattern that is tracked on.
Result<void> measure_return(const Many& many, std::span<const std::byte> bytes,
                            const std::vector<GrayPicture>& backgrounds,
                            const PoseBenchOptions& options, const PoseBenchProgress& progress,
                            std::vector<ManyBenchRow>& rows) {
  const Camera camera = default_camera(options.width, options.height);
  auto loop = PoseLoop::create(BundleView::open(bytes).value(), camera);
  if (!loop) return tl::unexpected(loop.error());
  for (const bool beside : {false, true}) {
    double sum = 0;
    int worst = 0;
    int times = 0;
    for (int i = 0; i < options.frames; ++i) {
      const auto k = static_cast<std::size_t>(i);
      Return scene(many, backgrounds[k % backgrounds.size()], camera, beside, options.seed + k);
      const Result<int> frames = scene.frames(**loop);
      if (!frames) return tl::unexpected(frames.error());
      sum += *frames;
      worst = std::max(worst, *frames);
      times += *frames > 0 ? 1 : 0;
      if (progress) progress("return", (beside ? 0.5 : 0.0) + 0.5 * (i + 1) / options.frames);
    }
    const std::string name = beside ? "return_beside " : "return_alone ";
    rows.push_back({name + "mean_frames", kMost, sum / std::max(times, 1), 0});
    rows.push_back({name + "worst_frames", kMost, 1.0 * worst, 0});
    rows.push_back({name + "times", kMost, 1.0 * times, 0});
  }
  return {};
}

}  // namespace

Result<std::vector<ManyBenchRow>> bench_many(const PoseBenchOptions& options,
                                             const PoseBenchProgress& progress) {
  const auto many = make_many(options, progress);
  if (!many) return tl::unexpected(many.error());
  const auto backgrounds = load_backgrounds(options.backgrounds, options.width, options.height);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  const Camera camera = default_camera(options.width, options.height);
  Random random(options.seed);
  const SceneBand band = easy_band();
  std::vector<SceneFrame> frames;
  for (int i = 0; i < options.frames; ++i) {
    const GrayImage picture = many->pictures[0].view();
    const GrayPicture& photo = (*backgrounds)[static_cast<std::size_t>(i) % backgrounds->size()];
    const Pose pose = draw_pose(band, picture, camera, random);
    frames.push_back(render_scene(picture, camera, pose, photo, band, random));
  }
  const auto bytes = many->bundle(kMost);
  if (!bytes) return tl::unexpected(bytes.error());
  std::vector<ManyBenchRow> rows;
  if (auto done = measure_detection(*many, frames, camera, rows); !done) {
    return tl::unexpected(done.error());
  }
  if (auto done = measure_ready(*bytes, camera, rows); !done) return tl::unexpected(done.error());
  auto done = measure_return(*many, *bytes, *backgrounds, options, progress, rows);
  if (!done) return tl::unexpected(done.error());
  return rows;
}

}  // namespace modar
