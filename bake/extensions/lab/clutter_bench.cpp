#include "bake/extensions/lab/clutter_bench.hpp"

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/field_scene.hpp"
#include "bake/extensions/lab/hard_prints.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kSequence = 10;  // frames of a print, and as many photos

/// The patterns of one bundle.
struct ExpectedBundle {
  std::vector<std::string> kinds;
  std::vector<std::byte> bytes;
  std::unique_ptr<PoseLoop> loop;
};

tl::unexpected<Error> no_backgrounds() {
  return fail(ExitCode::kUsage, "bench.input", "", "the bench needs backgrounds",
              "give a folder with pictures");
}

/// The hard prints and the requested patterns.
Result<std::vector<HardPrint>> all_prints(const PoseBenchOptions& options) {
  Random random(options.seed);
  std::vector<HardPrint> prints = hard_prints(random);
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    MODAR_ASSIGN(auto picture, load_pattern(path, shrunk));
    prints.push_back({path, std::move(picture)});
  }
  return prints;
}

/// All prints at once, then every print in a bundle so small that a search matches each of them in
/// full; prints of one kind are side by side, and in different bundles.
Result<std::vector<ExpectedBundle>> bake_all(std::span<const HardPrint> prints,
                                             const PoseBenchOptions& options) {
  constexpr std::size_t kFew = 3;
  const std::size_t few = (prints.size() + kFew - 1) / kFew;
  std::vector<ExpectedBundle> bundles(1 + few);
  std::vector<std::vector<GrayPicture>> pictures(bundles.size());
  std::vector<std::vector<std::vector<std::byte>>> records(bundles.size());
  for (std::size_t i = 0; i < prints.size(); ++i) {
    MODAR_ASSIGN(const auto record, make_tracker_record(prints[i].picture.view(), {}));
    for (const std::size_t at : {std::size_t{0}, 1 + i % few}) {
      pictures[at].push_back(prints[i].picture);
      records[at].push_back(record);
      bundles[at].kinds.push_back(prints[i].kind);
    }
  }
  PoseLoopOptions how;
  how.estimate_camera = !options.known_camera;
  for (std::size_t at = 0; at < bundles.size(); ++at) {
    MODAR_ASSIGN(bundles[at].bytes, bundle_of_records(pictures[at], records[at]));
    MODAR_ASSIGN(const auto bundle, BundleView::open(bundles[at].bytes));
    MODAR_ASSIGN(bundles[at].loop, PoseLoop::create(bundle, default_camera(kWidth, kHeight), how));
  }
  return bundles;
}

class ClutterTally {
 public:
  /// kind: of the print that the frame shows; empty: a photo.
  void add(const ExpectedBundle& wanted, const TrackResult& seen, const std::string& kind) {
    const bool photo = kind.empty();
    bool wrong = false;
    bool alike = false;
    for (const Detection& one : seen.visible) {
      const std::string& name = wanted.kinds[one.pattern];
      if (name == kind) {
        alike = true;
        continue;
      }
      wrong = true;
      ++named_[name + " in " + (photo ? "a photo" : kind)];
    }
    ++frames_[photo ? 0 : 1];
    false_[photo ? 0 : 1] += wrong ? 1 : 0;
    alike_ += alike ? 1 : 0;
  }
  [[nodiscard]] std::vector<BenchRow> rows() const {
    std::vector<BenchRow> rows;
    const auto add = [&](const std::string& what, double count, double all) {
      rows.push_back({what, count, all, ratio(count, all)});
    };
    add("false_frames photos", false_[0], frames_[0]);
    add("false_frames prints", false_[1], frames_[1]);
    add("same_kind_frames prints", alike_, frames_[1]);
    for (const auto& [what, count] : named_) add("false " + what, count, frames_[0] + frames_[1]);
    return rows;
  }

 private:
  double frames_[2] = {0, 0};  ///< photos, prints
  double false_[2] = {0, 0};
  double alike_ = 0;
  std::map<std::string, double> named_;
};

/// A hand moves a print before the loop; `add` takes what it sees of each frame.
template <class Add>
Result<void> show_print(const HardPrint& print, const GrayPicture& behind, Random& random,
                        PoseLoop& loop, int frames, const Add& add) {
  const Camera camera = default_camera(kWidth, kHeight);
  SceneBand band;
  band.area_low = 0.2;
  band.area_high = 2.0;
  band.tilt_high = 60;
  const HandPath path(draw_pose(band, print.picture.view(), camera, random), random);
  const SceneLight light = draw_light(random);
  for (int i = 0; i < frames; ++i) {
    const SceneFrame scene = render_scene(print.picture.view(), camera, path.at(i / 30.0, 1.0),
                                          behind, band, random, &light);
    MODAR_ASSIGN(const TrackResult seen, loop.step(scene.picture.view()));
    add(seen);
  }
  return {};
}

}  // namespace

Result<std::vector<BenchRow>> bench_clutter(const PoseBenchOptions& options,
                                            const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto photos, load_backgrounds(options.backgrounds, kWidth, kHeight));
  if (photos.empty()) return no_backgrounds();
  MODAR_ASSIGN(const auto prints, all_prints(options));
  MODAR_ASSIGN(const auto bundles, bake_all(prints, options));
  Random random(options.seed + 4099);
  ClutterTally tally;
  std::vector<HardPrint> shown;
  std::size_t turn = 0;
  for (int done = 0; done < options.clutter_frames; done += 2 * kSequence, ++turn) {
    if (progress) progress("clutter", 1.0 * done / options.clutter_frames);
    const ExpectedBundle& wanted = bundles[turn % 2 == 0 ? 0 : 1 + turn / 2 % (bundles.size() - 1)];
    const auto photo = [&] { return another_view(photos[random.next() % photos.size()], random); };
    for (int i = 0; i < kSequence; ++i) {
      GrayPicture frame = photo();
      expose(frame, draw_light(random), random, frame);
      MODAR_ASSIGN(const TrackResult seen, wanted.loop->step(frame.view()));
      tally.add(wanted, seen, "");
    }
    wanted.loop->reset();
    if (shown.empty()) shown = hard_prints(random);
    const std::size_t which = random.next() % shown.size();
    const HardPrint& print = shown[which];
    MODAR_TRY(show_print(print, photo(), random, *wanted.loop, kSequence,
                         [&](const TrackResult& seen) { tally.add(wanted, seen, print.kind); }));
    shown.erase(shown.begin() + static_cast<std::ptrdiff_t>(which));
    wanted.loop->reset();
  }
  return tally.rows();
}

Result<std::vector<BenchRow>> bench_phantoms(const PoseBenchOptions& options,
                                             const ProgressCallback& progress) {
  constexpr int kFrames = 3 * kSequence;  // of a print in a turn: some searches for more copies
  MODAR_ASSIGN(const auto photos, load_backgrounds(options.backgrounds, kWidth, kHeight));
  if (photos.empty()) return no_backgrounds();
  MODAR_ASSIGN(const auto prints, all_prints(options));
  PoseLoopOptions how;
  how.max_instances = 8;
  how.estimate_camera = !options.known_camera;
  std::map<std::string, std::array<double, 3>> counts;  // of all frames, phantoms, shown
  Random random(options.seed + 4099);
  for (std::size_t turn = 0; counts["all prints"][0] < options.clutter_frames; ++turn) {
    const HardPrint& print = prints[turn % prints.size()];
    if (progress) progress("copies", counts["all prints"][0] / options.clutter_frames);
    MODAR_ASSIGN(const auto record, make_tracker_record(print.picture.view(), {}));
    MODAR_ASSIGN(const auto bytes, bundle_of_records({&print.picture, 1}, {&record, 1}));
    MODAR_ASSIGN(const auto bundle, BundleView::open(bytes));
    MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, default_camera(kWidth, kHeight), how));
    const GrayPicture behind = another_view(photos[random.next() % photos.size()], random);
    MODAR_TRY(show_print(print, behind, random, *loop, kFrames, [&](const TrackResult& seen) {
      for (const std::string& name : {std::string("all prints"), print.kind}) {
        auto& [frames, phantoms, shown] = counts[name];
        ++frames;
        phantoms += seen.visible.size() > 1 ? 1 : 0;
        shown += seen.visible.empty() ? 0 : 1;
      }
    }));
  }
  std::vector<BenchRow> rows;
  for (const auto& [name, count] : counts) {
    const auto& [frames, phantoms, shown] = count;
    rows.push_back({"phantom_frames " + name, phantoms, frames, ratio(phantoms, frames)});
    rows.push_back({"shown_frames " + name, shown, frames, ratio(shown, frames)});
  }
  return rows;
}

}  // namespace modar
