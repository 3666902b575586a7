// Runs the device's tracker over sequences of lookalikes.
#include "bake/extensions/lab/lookalike_bench.hpp"

#include <algorithm>
#include <functional>

#include "bake/extensions/lab/family_prints.hpp"
#include "bake/extensions/lab/field_scene.hpp"
#include "bake/extensions/lab/unknown_view.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kFrames = 60;        // two seconds
constexpr int kFamilyFrames = 75;  // of which those after two seconds count
constexpr int kDecided = 5;        // frames until the name must be right

GrayPicture mirror_of(const GrayImage& pattern) {
  GrayPicture out{pattern.width, pattern.height, {}};
  for (int y = 0; y < pattern.height; ++y) {
    const std::uint8_t* row = pattern.pixels + y * pattern.stride;
    out.pixels.insert(out.pixels.end(), row, row + pattern.width);
    std::reverse(out.pixels.end() - pattern.width, out.pixels.end());
  }
  return out;
}

/// Called with each frame's result.
using Judge = std::function<void(int frame, const TrackResult& seen, const FrameTruth& truth)>;

/// How a print is shown.
struct Showing {
  const GrayPicture& background;
  double covered = 0;  ///< share that the background hides
  std::uint64_t seed = 0;
  bool known_camera = false;  ///< see PoseBenchOptions
  int frames = kFrames;
};

/// A print on a moving hand's path before a tracker.
Result<void> run_sequence(const GrayImage& picture, std::span<const std::byte> bundle,
                          const Showing& showing, const Judge& judge) {
  const GrayPicture& background = showing.background;
  const Camera assumed = default_camera(background.width, background.height);
  MODAR_ASSIGN(const auto view, BundleView::open(bundle));
  PoseLoopOptions how;
  how.estimate_camera = !showing.known_camera;
  MODAR_ASSIGN(const auto loop, PoseLoop::create(view, assumed, how));
  Random drawn(showing.seed + 4099);
  const UnknownView unknown = draw_unknown(picture, assumed, showing.known_camera, drawn);
  const GrayImage print = unknown.print.view();
  const Camera& camera = unknown.lens;
  SceneBand band;
  band.area_low = 0.8;
  band.area_high = 2.0;
  band.tilt_high = 35;
  band.covered_low = band.covered_high = showing.covered;
  Random random(showing.seed);
  const HandPath path(draw_pose(band, print, camera, random), random);
  const SceneLight light = draw_light(random);
  const std::uint64_t side = random.next();
  GrayPicture frame;
  for (int i = 0; i < showing.frames; ++i) {
    Random same_side(side);
    const SceneFrame scene = render_still(print, camera, path.at(i / 30.0, 1.0), background, band,
                                          same_side, light.focus, {});
    expose(scene.picture, light, random, frame);
    MODAR_ASSIGN(const TrackResult seen, loop->step(frame.view()));
    judge(i, seen, {true, scene.corners});
  }
  return {};
}

/// Sums of a measure.
struct Tally {
  LookalikeRow row;
  void add(bool one) {
    ++row.sequences;
    row.percent += one ? 1 : 0;
  }
  LookalikeRow finish() {
    row.percent *= 100.0 / std::max(row.sequences, 1);
    return row;
  }
};

/// Whether the last frame of a print's sequence shows anything; or the pattern, in the right place.
Result<bool> ends_shown(const GrayImage& print, std::span<const std::byte> bundle,
                        const Showing& showing, bool right) {
  bool shown = false;
  MODAR_TRY(run_sequence(print, bundle, showing,
                         [&](int frame, const TrackResult& seen, const FrameTruth& truth) {
                           if (frame != kFrames - 1 || seen.visible.empty()) return;
                           shown = !right || is_right(seen.visible[0], truth);
                         }));
  return shown;
}

/// Whether the wrong name is reported once it must be decided. truth: index of the print.
Result<bool> misnamed(const GrayImage& print, std::span<const std::byte> both, std::uint32_t truth,
                      const Showing& showing) {
  bool wrong = false;
  int since = -1;
  MODAR_TRY(run_sequence(print, both, showing,
                         [&](int frame, const TrackResult& seen, const FrameTruth&) {
                           if (since < 0 && !seen.visible.empty()) since = frame;
                           for (const Detection& one : seen.visible) {
                             const bool late = since >= 0 && frame - since >= kDecided;
                             wrong = wrong || (late && one.pattern != truth);
                           }
                         }));
  return wrong;
}

/// Members of a family of which one alone was baked: whether the other one is shown after two
/// seconds, and whether the true one is hidden then, taken for another print, in view, half covered
/// and held.
struct FamilyTally {
  explicit FamilyTally(const std::string& name)
      : other{{name + " shown"}},
        plain{{name + " plain hidden"}},
        held{{name + " held hidden"}},
        covered{{name + " covered hidden"}} {}
  Tally other;
  Tally plain;
  Tally held;
  Tally covered;

  static Result<void> show(const GrayImage& print, std::span<const std::byte> bundle,
                           const Showing& showing, bool shown, Tally& tally) {
    return run_sequence(
        print, bundle, showing, [&](int frame, const TrackResult& seen, const FrameTruth&) {
          if (frame < kFrames) return;
          tally.add(shown ? !seen.visible.empty() : seen.reason == Reason::kOtherPrint);
        });
  }
  Result<void> add(const FamilyPrints& prints, const GrayPicture& behind, std::uint64_t seed,
                   bool known_camera) {
    const GrayImage own = prints.own.view();
    MODAR_ASSIGN(const auto record, make_tracker_record(own, {}));
    MODAR_ASSIGN(const auto bundle, bundle_of_record(own, record));
    Random random(seed + 17);
    const GrayPicture in_hand = held_print(own, random);
    const double hidden = random.uniform(0.2, 0.6);
    const Showing open{behind, 0, seed, known_camera, kFamilyFrames};
    const Showing half{behind, hidden, seed, known_camera, kFamilyFrames};
    MODAR_TRY(show(prints.other.view(), bundle, open, true, other));
    MODAR_TRY(show(own, bundle, open, false, plain));
    MODAR_TRY(show(in_hand.view(), bundle, open, false, held));
    return show(own, bundle, half, false, covered);
  }
  void finish(std::vector<LookalikeRow>& rows) {
    for (Tally* one : {&other, &plain, &held, &covered}) rows.push_back(one->finish());
  }
};

/// Rows of families made of these pictures.
Result<std::vector<LookalikeRow>> bench_families(const PoseBenchOptions& options,
                                                 std::span<const GrayPicture> pictures,
                                                 std::span<const GrayPicture> backgrounds,
                                                 const ProgressCallback& progress) {
  FamilyTally title("family title");
  FamilyTally fruit("family fruit");
  const std::size_t count = pictures.size();
  for (std::size_t p = 0; p < count; ++p) {
    for (int i = 0; i < options.frames; ++i) {
      const std::uint64_t seed = options.seed + 1000003 * p + 7919 * static_cast<std::uint64_t>(i);
      Random random(seed + 5);
      const GrayImage own = pictures[p].view();
      const GrayPicture& behind = backgrounds[seed % backgrounds.size()];
      MODAR_TRY(title.add(titled_prints(own, random), behind, seed, options.known_camera));
      const std::size_t first = p + 1 + random.next() % (count > 2 ? count - 2 : 1);
      MODAR_TRY(fruit.add(fruit_prints(own, pictures[first % count].view(),
                                       pictures[(first + 1) % count].view(), random),
                          behind, seed, options.known_camera));
      if (progress) {
        progress("families", (static_cast<double>(p) + (i + 1.0) / options.frames) /
                                 static_cast<double>(count));
      }
    }
  }
  std::vector<LookalikeRow> rows;
  title.finish(rows);
  fruit.finish(rows);
  return rows;
}

}  // namespace

Result<std::vector<LookalikeRow>> bench_lookalikes(const PoseBenchOptions& options,
                                                   const std::string& only,
                                                   const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto backgrounds,
               load_backgrounds(options.backgrounds, options.width, options.height));
  std::vector<GrayPicture> pictures;
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    MODAR_ASSIGN(auto picture, load_pattern(path, shrunk));
    pictures.push_back(std::move(picture));
  }
  MODAR_ASSIGN(auto rows, bench_families(options, pictures, backgrounds, progress));
  if (only == "family") return rows;
  Tally edition{{"lookalike shown other photo"}};
  Tally language{{"lookalike shown other language"}};
  Tally mirror{{"lookalike shown mirrored"}};
  Tally named{{"lookalike misnamed"}};
  Tally covered{{"lookalike covered right"}};
  Tally plain{{"lookalike plain right"}};
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    const GrayImage own = pictures[p].view();
    const GrayPicture photo = edition_of(own, pictures[(p + 1) % pictures.size()].view());
    const GrayPicture words = language_of(own);
    const GrayPicture turned = mirror_of(own);
    MODAR_ASSIGN(const auto record, make_tracker_record(own, {}));
    MODAR_ASSIGN(const auto other_record, make_tracker_record(photo.view(), {}));
    MODAR_ASSIGN(const auto alone, bundle_of_record(own, record));
    const std::vector<GrayPicture> prints = {pictures[p], photo};
    const std::vector<std::vector<std::byte>> records = {record, other_record};
    MODAR_ASSIGN(const auto both, bundle_of_records(prints, records));
    for (int i = 0; i < options.frames; ++i) {
      const std::uint64_t seed = options.seed + 1000003 * p + 7919 * static_cast<std::uint64_t>(i);
      const GrayPicture& behind = backgrounds[seed % backgrounds.size()];
      const auto take = [&](Tally& tally, const GrayImage& print, double hidden, bool right) {
        const Showing showing{behind, hidden, seed, options.known_camera};
        return ends_shown(print, alone, showing, right).map([&](bool one) { tally.add(one); });
      };
      MODAR_TRY(take(edition, photo.view(), 0, false));
      MODAR_TRY(take(language, words.view(), 0, false));
      MODAR_TRY(take(mirror, turned.view(), 0, false));
      MODAR_TRY(take(covered, own, 0.5, true));
      MODAR_TRY(take(plain, own, 0, true));
      for (const std::uint32_t k : {0u, 1u}) {
        MODAR_ASSIGN(const bool wrong,
                     misnamed(prints[k].view(), both, k, {behind, 0, seed, options.known_camera}));
        named.add(wrong);
      }
      if (progress) {
        progress("lookalikes", (static_cast<double>(p) + (i + 1.0) / options.frames) /
                                   static_cast<double>(pictures.size()));
      }
    }
  }
  for (Tally* one : {&edition, &language, &mirror, &named, &covered, &plain}) {
    rows.push_back(one->finish());
  }
  return rows;
}

}  // namespace modar
