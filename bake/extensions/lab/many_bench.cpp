// Runs the device's tracker on bundles of many patterns: pictures, or quarters of a few.
#include "bake/extensions/lab/many_bench.hpp"

#include <algorithm>
#include <chrono>
#include <string_view>
#include <thread>

#include "bake/extensions/lab/heap.hpp"
#include "bake/process/thread_clock.hpp"
#include "formats/base/parallel.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr std::size_t kSome = 10;      // patterns, between one and all
constexpr std::size_t kOfPicture = 8;  // four quarters, and those mirrored
constexpr int kShown = 15;             // frames before a pattern is hidden
constexpr int kHidden = 10;            // frames for which it is
constexpr int kPatience = 60;          // frames to wait for it
constexpr int kWithin = 10;            // frames within which a pattern that comes is found

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

struct PatternSet {
  std::vector<GrayPicture> pictures;
  std::vector<std::vector<std::byte>> records;

  [[nodiscard]] std::size_t size() const { return pictures.size(); }
  [[nodiscard]] Result<std::vector<std::byte>> bundle(std::size_t count) const {
    return bundle_of_records({pictures.data(), count}, {records.data(), count});
  }
};

Result<PatternSet> make_many(const PoseBenchOptions& options, const ProgressCallback& progress) {
  const std::size_t files = options.patterns.size();
  const auto most = static_cast<std::size_t>(options.many);
  if (most < 2 || files * kOfPicture < most || options.backgrounds.empty()) {
    return fail(ExitCode::kUsage, "bench.input", "--many",
                "two or more patterns, eight at most of each picture, are shown over photos",
                "give folders with more pictures");
  }
  std::vector<GrayPicture> whole;
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    MODAR_ASSIGN(auto picture, load_pattern(path, shrunk));
    whole.push_back(std::move(picture));
  }
  PatternSet many;
  for (std::size_t i = 0; i < most; ++i) {
    many.pictures.push_back(files < most ? quarter_of(whole[i % files], i / files) : whole[i]);
  }
  std::vector<Result<std::vector<std::byte>>> baked(most);
  if (progress) progress("baking", 0.0);
  parallel_rows(
      static_cast<std::uint32_t>(most), std::thread::hardware_concurrency(),
      [&](std::uint32_t i) { baked[i] = make_tracker_record(many.pictures[i].view(), {}); });
  for (auto& one : baked) {
    MODAR_ASSIGN(auto record, std::move(one));
    many.records.push_back(std::move(record));
  }
  return many;
}

/// How pictures are shown: large and little tilted.
SceneBand easy_band() {
  SceneBand band;
  band.area_low = 2.0;
  band.area_high = 4.0;
  band.tilt_high = 30;
  return band;
}

/// Frames that show one pattern each, rendered on demand.
class Frames {
 public:
  Frames(const PatternSet& many, const std::vector<GrayPicture>& backgrounds,
         const PoseBenchOptions& options)
      : many_(many), backgrounds_(backgrounds), options_(options) {}

  /// Frame i, which shows that pattern.
  [[nodiscard]] SceneFrame at(int i, std::size_t pattern,
                              const SceneBand& band = easy_band()) const {
    Random random(options_.seed + static_cast<std::uint64_t>(i));
    const GrayImage picture = many_.pictures[pattern].view();
    const Camera camera = default_camera(options_.width, options_.height);
    const Pose pose = draw_pose(band, picture, camera, random);
    const GrayPicture& photo = backgrounds_[static_cast<std::size_t>(i) % backgrounds_.size()];
    return render_scene(picture, camera, pose, photo, band, random);
  }
  [[nodiscard]] int count() const { return options_.frames; }

 private:
  const PatternSet& many_;
  const std::vector<GrayPicture>& backgrounds_;
  const PoseBenchOptions& options_;
};

/// Outcome of searches.
struct Searched {
  double seconds = 0;
  int right = 0;
  int others = 0;  ///< recognitions of patterns not shown

  Result<void> add(PoseLoop& loop, const SceneFrame& frame, std::uint32_t shown) {
    TrackResult seen;
    const double start = thread_seconds();
    MODAR_TRY(loop.step(frame.picture.view(), seen));
    seconds += thread_seconds() - start;
    for (const Detection& each : seen.visible) {
      right += each.pattern == shown && is_right(each, {true, frame.corners}) ? 1 : 0;
      others += each.pattern != shown ? 1 : 0;
    }
    return {};
  }
};

/// A tracker that searches every frame anew.
Result<std::unique_ptr<PoseLoop>> searcher(std::span<const std::byte> bytes, const Camera& camera) {
  PoseLoopOptions how;
  how.track = false;
  return PoseLoop::create(BundleView::open(bytes).value(), camera, how);
}

/// Searches in bundles of 1, 10 and 50 patterns, which are shown in turn, compared with searches on
/// the same frames for the pattern that they show alone.
Result<void> measure_detection(const PatternSet& many, const Frames& frames, const Camera& camera,
                               const ProgressCallback& progress, std::vector<ManyBenchRow>& rows) {
  double with_one = 0;
  for (const std::size_t count : {std::size_t{1}, kSome, many.size()}) {
    if (count == kSome && many.size() <= kSome) continue;
    MODAR_ASSIGN(const auto bytes, many.bundle(count));
    MODAR_ASSIGN(const auto loop, searcher(bytes, camera));
    Searched all;
    Searched alone;
    for (int i = 0; i < frames.count(); ++i) {
      const std::size_t shown = static_cast<std::size_t>(i) % count;
      const SceneFrame frame = frames.at(i, shown);
      MODAR_TRY(all.add(*loop, frame, static_cast<std::uint32_t>(shown)));
      MODAR_ASSIGN(const auto single,
                   bundle_of_record(many.pictures[shown].view(), many.records[shown]));
      MODAR_ASSIGN(const auto one, searcher(single, camera));
      MODAR_TRY(alone.add(*one, frame, 0));
      if (progress) progress("detection x" + std::to_string(count), (i + 1.0) / frames.count());
    }
    const double ms = 1e3 * all.seconds / frames.count();
    const double percent = 100.0 / frames.count();
    if (count == 1) with_one = ms;
    const int patterns = static_cast<int>(count);
    rows.push_back({"detection cpu_ms", patterns, ms, with_one * patterns});
    rows.push_back({"detection right_pct", patterns, percent * all.right, percent * alone.right});
    rows.push_back({"detection others", patterns, 1.0 * all.others, 0});
  }
  return {};
}

/// Tilted views, in the greatest bundle compared with searches for the shown pattern alone.
Result<void> measure_tilts(const PatternSet& many, const Frames& frames, const Camera& camera,
                           const ProgressCallback& progress, std::vector<ManyBenchRow>& rows) {
  constexpr double kTilts[] = {45, 60, 70, 75, 80};  // degrees: from one band to the next
  const int patterns = static_cast<int>(many.size());
  MODAR_ASSIGN(const auto bytes, many.bundle(many.size()));
  MODAR_ASSIGN(const auto loop, searcher(bytes, camera));
  for (std::size_t k = 0; k + 1 < std::size(kTilts); ++k) {
    SceneBand band;
    band.area_low = 0.5;
    band.area_high = 3.0;
    band.tilt_low = kTilts[k];
    band.tilt_high = kTilts[k + 1];
    Searched all;
    Searched alone;
    for (int i = 0; i < frames.count(); ++i) {
      const std::size_t shown = static_cast<std::size_t>(i) % many.size();
      const SceneFrame frame = frames.at(i, shown, band);
      MODAR_TRY(all.add(*loop, frame, static_cast<std::uint32_t>(shown)));
      MODAR_ASSIGN(const auto single,
                   bundle_of_record(many.pictures[shown].view(), many.records[shown]));
      MODAR_ASSIGN(const auto one, searcher(single, camera));
      MODAR_TRY(alone.add(*one, frame, 0));
      if (progress) progress("tilt", (1.0 * static_cast<double>(k) + 1.0 * i / frames.count()) / 4);
    }
    const std::string name = "detection tilt " + std::to_string(static_cast<int>(kTilts[k])) + "-" +
                             std::to_string(static_cast<int>(kTilts[k + 1]));
    const double percent = 100.0 / frames.count();
    rows.push_back({name + " right_pct", patterns, percent * all.right, percent * alone.right});
    rows.push_back({name + " others", patterns, 1.0 * all.others, 0});
  }
  return {};
}

/// Whether a tracker that has seen nothing finds a pattern at that pose within kWithin frames.
Result<bool> finds(PoseLoop& loop, std::uint32_t pattern, const SceneFrame& still, Random random) {
  loop.reset();
  TrackResult seen;
  for (int k = 0; k < kWithin; ++k) {
    GrayPicture exposed;
    expose(still.picture, {}, random, exposed);
    MODAR_TRY(loop.step(exposed.view(), seen));
    for (const Detection& each : seen.visible) {
      if (each.pattern == pattern && is_right(each, {true, still.corners})) return true;
    }
  }
  return false;
}

/// Patterns found within kWithin frames, in the greatest bundle and alone; and names given to
/// photos that show none of them.
Result<void> measure_coming(const PatternSet& many, std::span<const std::byte> bytes,
                            const std::vector<GrayPicture>& backgrounds,
                            const PoseBenchOptions& options, const ProgressCallback& progress,
                            std::vector<ManyBenchRow>& rows) {
  const Camera camera = default_camera(options.width, options.height);
  MODAR_ASSIGN(const auto loop, PoseLoop::create(BundleView::open(bytes).value(), camera));
  SceneBand band = easy_band();
  band.area_low = 0.25;
  band.tilt_high = 45;
  Random random(options.seed);
  double found = 0;
  double alone = 0;
  double named = 0;
  for (int i = 0; i < options.frames; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const GrayPicture photo = another_view(backgrounds[k % backgrounds.size()], random);
    const auto shown = static_cast<std::uint32_t>(random.next() % many.size());
    const GrayImage picture = many.pictures[shown].view();
    const Pose pose = draw_pose(band, picture, camera, random);
    const SceneFrame still = render_still(picture, camera, pose, photo, band, random, 0.5, {});
    MODAR_ASSIGN(const auto single, bundle_of_record(picture, many.records[shown]));
    MODAR_ASSIGN(const auto one, PoseLoop::create(BundleView::open(single).value(), camera));
    MODAR_ASSIGN(const bool here, finds(*loop, shown, still, random));
    MODAR_ASSIGN(const bool there, finds(*one, 0, still, random));
    found += here ? 1 : 0;
    alone += there ? 1 : 0;
    loop->reset();
    TrackResult seen;
    GrayPicture exposed;
    expose(photo, {}, random, exposed);
    MODAR_TRY(loop->step(exposed.view(), seen));
    named += seen.visible.empty() ? 0 : 1;
    if (progress) progress("coming", (i + 1.0) / options.frames);
  }
  const int patterns = static_cast<int>(many.size());
  const double percent = 100.0 / options.frames;
  rows.push_back({"coming within_10_pct", patterns, percent * found, percent * alone});
  rows.push_back({"coming photos_named", patterns, named, 0});
  return {};
}

/// From mapped bytes to a tracker that takes frames: median time and heap; then the time of its
/// first search and the heap after it.
Result<void> measure_ready(std::span<const std::byte> bytes, int patterns, const Camera& camera,
                           const SceneFrame& frame, std::vector<ManyBenchRow>& rows) {
  std::vector<double> times;
  double held = 0;
  double searching = 0;
  double first = 0;
  for (int i = 0; i < 5; ++i) {
    const double before = heap_bytes();
    const auto start = std::chrono::steady_clock::now();
    MODAR_ASSIGN(const auto bundle, BundleView::open(bytes));
    MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, camera));
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    times.push_back(ms.count());
    held = heap_bytes() - before;
    const double stepped = thread_seconds();
    MODAR_TRY(loop->step(frame.picture.view()));
    first = 1e3 * (thread_seconds() - stepped);
    searching = heap_bytes() - before;
  }
  std::nth_element(times.begin(), times.begin() + 2, times.end());
  rows.push_back({"ready_ms", patterns, times[2], 0});
  rows.push_back({"ready_heap_bytes", patterns, held, 0});
  rows.push_back({"first_search cpu_ms", patterns, first, 0});
  rows.push_back({"searching_heap_bytes", patterns, searching, 0});
  return {};
}

/// A scene of one or two patterns; the first is hidden and shown again, the other stays.
class HideAndShow {
 public:
  HideAndShow(const PatternSet& many, const GrayPicture& background, const Camera& camera,
              bool beside, std::uint64_t seed)
      : many_(many), camera_(camera), random_(seed) {
    patterns_[0] = random_.next() % many.size();
    patterns_[1] = (patterns_[0] + 1 + random_.next() % (many.size() - 1)) % many.size();
    const std::size_t shown = beside ? 2 : 1;
    for (std::size_t k = 0; k < shown; ++k) {
      Pose pose = draw_pose(band_, picture(k), camera_, random_);
      const double aside = beside ? 0.25 * camera_.width / camera_.fx : 0.0;
      pose.translation.x = (k == 0 ? -aside : aside) * pose.translation.z;
      pose.translation.y = 0;
      poses_.push_back(pose);
    }
    // Rendered once, exposed in each frame.
    hidden_ = beside ? drawn(1, background).picture : background;
    SceneFrame all = drawn(0, hidden_);
    shown_ = std::move(all.picture);
    corners_ = all.corners;
  }

  /// Frames until the pattern is right again, 1: at once; kPatience where it never is; 0 where it
  /// was not recognised before it was hidden.
  Result<int> frames(PoseLoop& loop) {
    loop.reset();
    TrackResult seen;
    for (int i = 0; i < kShown; ++i) {
      MODAR_TRY(show(loop, true, seen));
    }
    if (!is_back(seen)) return 0;
    for (int i = 0; i < kHidden; ++i) {
      MODAR_TRY(show(loop, false, seen));
    }
    for (int waited = 1; waited < kPatience; ++waited) {
      MODAR_TRY(show(loop, true, seen));
      if (is_back(seen)) return waited;
    }
    return kPatience;
  }

 private:
  [[nodiscard]] GrayImage picture(std::size_t k) const {
    return many_.pictures[patterns_[k]].view();
  }
  SceneFrame drawn(std::size_t k, const GrayPicture& behind) {
    return render_still(picture(k), camera_, poses_[k], behind, band_, random_, 0.5, {});
  }
  Result<void> show(PoseLoop& loop, bool first, TrackResult& seen) {
    GrayPicture exposed;
    expose(first ? shown_ : hidden_, {}, random_, exposed);
    return loop.step(exposed.view(), seen);
  }
  [[nodiscard]] bool is_back(const TrackResult& seen) const {
    return std::any_of(seen.visible.begin(), seen.visible.end(), [this](const Detection& each) {
      return each.pattern == patterns_[0] && is_right(each, {true, corners_});
    });
  }

  const PatternSet& many_;
  Camera camera_;
  Random random_;
  SceneBand band_ = easy_band();
  std::size_t patterns_[2] = {0, 0};
  std::vector<Pose> poses_;
  GrayPicture shown_;
  GrayPicture hidden_;  ///< without the first pattern
  std::array<glm::dvec2, 4> corners_{};
};

/// Alone in the frame, and with a pattern that stays tracked.
Result<void> measure_return(const PatternSet& many, std::span<const std::byte> bytes,
                            const std::vector<GrayPicture>& backgrounds,
                            const PoseBenchOptions& options, const ProgressCallback& progress,
                            std::vector<ManyBenchRow>& rows) {
  const Camera camera = default_camera(options.width, options.height);
  MODAR_ASSIGN(const auto loop, PoseLoop::create(BundleView::open(bytes).value(), camera));
  for (const bool beside : {false, true}) {
    double sum = 0;
    int worst = 0;
    int times = 0;
    for (int i = 0; i < options.frames; ++i) {
      const auto k = static_cast<std::size_t>(i);
      HideAndShow scene(many, backgrounds[k % backgrounds.size()], camera, beside,
                        options.seed + k);
      MODAR_ASSIGN(const int frames, scene.frames(*loop));
      sum += frames;
      worst = std::max(worst, frames);
      times += frames > 0 ? 1 : 0;
      if (progress) progress("return", (beside ? 0.5 : 0.0) + 0.5 * (i + 1) / options.frames);
    }
    const int patterns = static_cast<int>(many.size());
    const std::string name = beside ? "return_beside " : "return_alone ";
    rows.push_back({name + "mean_frames", patterns, sum / std::max(times, 1), 0});
    rows.push_back({name + "worst_frames", patterns, 1.0 * worst, 0});
    rows.push_back({name + "times", patterns, 1.0 * times, 1.0 * options.frames});
  }
  return {};
}

}  // namespace

Result<std::vector<ManyBenchRow>> bench_many(const PoseBenchOptions& options,
                                             const std::string& only,
                                             const ProgressCallback& progress) {
  MODAR_ASSIGN(const PatternSet many, make_many(options, progress));
  MODAR_ASSIGN(const auto backgrounds,
               load_backgrounds(options.backgrounds, options.width, options.height));
  const Camera camera = default_camera(options.width, options.height);
  const Frames frames(many, backgrounds, options);
  MODAR_ASSIGN(const auto bytes, many.bundle(many.size()));
  std::vector<ManyBenchRow> rows;
  const auto wanted = [&only](const char* part) {
    return std::string_view(part).find(only) != std::string_view::npos;
  };
  if (wanted("detection")) MODAR_TRY(measure_detection(many, frames, camera, progress, rows));
  if (wanted("tilt")) MODAR_TRY(measure_tilts(many, frames, camera, progress, rows));
  if (wanted("coming")) {
    MODAR_TRY(measure_coming(many, bytes, backgrounds, options, progress, rows));
  }
  if (wanted("ready")) {
    MODAR_TRY(measure_ready(bytes, options.many, camera, frames.at(0, 0), rows));
  }
  if (wanted("return")) {
    MODAR_TRY(measure_return(many, bytes, backgrounds, options, progress, rows));
  }
  return rows;
}

}  // namespace modar
