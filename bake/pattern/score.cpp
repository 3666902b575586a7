// Runs the device's tracker on harder and harder views of a pattern, measures why it fails, and
// draws where features are.
#include "bake/pattern/score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/gray_mat.hpp"
#include "bake/pattern/shape.hpp"
#include "bake/pattern/surface_scene.hpp"
#include "bake/pattern/trial.hpp"
#include "formats/base/parallel.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pattern_views.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

// View pixels around the pattern: half a descriptor's patch and the detector's border.
constexpr int kViewMargin = 24;
// View pixels within which two features are the same corner, and bits of 256 within which two codes
// are the same feature: as in the bake, which chooses by them.
constexpr double kSamePlace = 3;
constexpr int kSameCode = 64;
// Cells on a side of the grid that features should cover, for the cause "spread".
constexpr int kSpreadGrid = 6;
// Root of the area, in frame pixels, at which tilts are tried: large enough that the size does not
// limit them.
constexpr double kEasySide = 240;

// Views of each step: more make the range finer and slower.
constexpr int kViewsOfStep = 6;
// Value of sharpness_of() at which print begins to be fine.
constexpr double kFine = 1.3;
// Value of sharpness_of() at which all print is fine.
constexpr double kFinest = 1.9;
// Value of range_value() at which a score reaches 63 of 100; the grades' limits follow.
constexpr double kScoreScale = 8.7;
// Least range_value() of the grades A to D: of the twelve pictures of the score ten are A, two B.
constexpr double kGradeLimits[] = {14, 11, 8, 5};

/// A feature that the bake could keep.
struct Describable {
  double x;
  double y;
  TrackerCode code;
  std::uint8_t dark;
};

/// Directions with rational sines: every machine rounds them the same way.
constexpr Turn kTurns[] = {{1, 0}, {0.8, 0.6},  {5.0 / 13, 12.0 / 13},
                           {0, 1}, {-0.6, 0.8}, {-12.0 / 13, 5.0 / 13}};

/// Those of one polarity.
struct KnownSide {
  std::vector<std::array<double, 2>> places;
  std::vector<TrackerCode> codes;
};
using KnownFeatures = std::array<KnownSide, 2>;

struct TestView {
  AffineView view;
  double scale;  ///< view pixels a picture pixel along its least compressed direction
};

TestView test_view(const GrayPicture& picture, double side, double tilt, int direction,
                   int rotation) {
  const double own = std::sqrt(1.0 * picture.width * picture.height);
  const double scale = std::min(1.0, side / own);
  return {make_view(picture.width, picture.height, scale, tilt, kTurns[direction], kTurns[rotation],
                    kViewMargin),
          scale};
}

/// Features of a test view that were matched.
struct Matched {
  std::vector<std::array<double, 2>> held;       ///< unambiguously, in picture pixels
  std::vector<std::array<double, 2>> ambiguous;  ///< elsewhere in the picture nearly as well
};

std::vector<Describable> describe_view(const std::vector<ViewLevel>& levels,
                                       const AffineView& view) {
  const GrayPicture picture = render_view(levels, view, nullptr);
  const auto extractor =
      FeatureExtractor::create(picture.width, picture.height, generous_detection());
  extractor->set_frame(picture.view());
  std::vector<Describable> known;
  for (const TrackerFeature& feature : extractor->features()) {
    const auto place =
        to_picture(view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    const bool outside = place[0] < -0.5 || place[1] < -0.5 || place[0] > levels[0].width - 0.5 ||
                         place[1] > levels[0].height - 0.5;
    if (!outside) known.push_back({place[0], place[1], feature.code, feature.dark});
  }
  return known;
}

/// Some of what the bake describes: several scales, upright and tilted.
KnownFeatures known_features(const std::vector<ViewLevel>& levels, unsigned jobs) {
  std::vector<AffineView> views;
  double scale = 1;
  for (int k = 0; k < 4; ++k, scale *= 0.64) {
    for (const auto& [tilt, turn] : {std::pair{1.0, 0}, {2.0, 0}, {2.0, 3}}) {
      views.push_back(make_view(levels[0].width, levels[0].height, scale, tilt, kTurns[turn],
                                kTurns[(k + turn) % 6], kViewMargin));
    }
  }
  std::vector<std::vector<Describable>> found(views.size());
  parallel_rows(static_cast<std::uint32_t>(views.size()), jobs,
                [&](std::uint32_t i) { found[i] = describe_view(levels, views[i]); });
  KnownFeatures known;
  for (const auto& some : found) {
    for (const Describable& one : some) {
      known[one.dark].places.push_back({one.x, one.y});
      known[one.dark].codes.push_back(one.code);
    }
  }
  return known;
}

/// Views in which single features are tried.
std::vector<TestView> feature_views(const GrayPicture& picture) {
  return {test_view(picture, 104, 1.0, 0, 1), test_view(picture, 80, 1.1, 2, 4),
          test_view(picture, kEasySide, 2.0, 1, 3), test_view(picture, kEasySide, 2.4, 3, 0),
          test_view(picture, kEasySide, 2.4, 4, 2)};
}

/// Applies a lens's blur and a sensor's noise.
void blur_and_noise(std::uint64_t seed, GrayPicture& picture) {
  const GrayPicture sharp = picture;
  const int w = picture.width;
  Random random(seed);
  for (int y = 1; y + 1 < picture.height; ++y) {
    for (int x = 1; x + 1 < w; ++x) {
      const std::uint8_t* p = sharp.pixels.data() + std::ptrdiff_t{y} * w + x;
      const int around = p[-w - 1] + p[1 - w] + p[w - 1] + p[w + 1];
      const int beside = p[-w] + p[-1] + p[1] + p[w];
      const double seen = (around + 2 * beside + 4 * p[0]) * 0.05 + 16 + 3 * random.normal();
      picture.pixels[static_cast<std::size_t>(y * w + x)] =
          static_cast<std::uint8_t>(std::clamp(seen + 0.5, 0.0, 255.0));
    }
  }
}

Matched match_view(const std::vector<ViewLevel>& levels, const TestView& test,
                   const KnownFeatures& known, std::uint64_t seed) {
  GrayPicture picture = render_view(levels, test.view, nullptr);
  blur_and_noise(seed, picture);
  const auto extractor = FeatureExtractor::create(picture.width, picture.height, DetectOptions{});
  extractor->set_frame(picture.view());
  Matched found;
  std::vector<int> bits;
  for (const TrackerFeature& feature : extractor->features()) {
    const auto place =
        to_picture(test.view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    const double radius = kSamePlace * (1 << feature.level) / test.scale;
    int here = 256;
    int elsewhere = 256;
    const KnownSide& side = known[feature.dark];
    bits.resize(side.codes.size());
    code_distances(feature.code, side.codes.data(), nullptr, side.codes.size(), bits.data());
    for (std::size_t i = 0; i < bits.size(); ++i) {
      const double dx = side.places[i][0] - place[0];
      const double dy = side.places[i][1] - place[1];
      int& least = dx * dx + dy * dy <= radius * radius ? here : elsewhere;
      least = std::min(least, bits[i]);
    }
    if (here > kSameCode) continue;
    // As the device's matcher does: the second best counts only if it is elsewhere.
    (here * 10 < elsewhere * 9 ? found.held : found.ambiguous).push_back(place);
  }
  return found;
}

/// 0 to 100 for 0 to `enough`.
int share_of(double value, double enough) {
  return static_cast<int>(std::clamp(100.0 * value / enough + 0.5, 0.0, 100.0));
}

/// Mean over blocks of 16x16 pixels of the standard deviation of their gray values, weighted with
/// itself: empty blocks tell nothing of the ink.
double contrast_of(const GrayPicture& picture) {
  double sum = 0;
  double squares = 0;
  for (int y = 0; y + 16 <= picture.height; y += 8) {
    for (int x = 0; x + 16 <= picture.width; x += 8) {
      std::int64_t first = 0;
      std::int64_t second = 0;
      for (int k = 0; k < 256; ++k) {
        const int gray =
            picture.pixels[static_cast<std::size_t>((y + k / 16) * picture.width + x + k % 16)];
        first += gray;
        second += gray * gray;
      }
      const double variance = static_cast<double>(256 * second - first * first) / (256 * 256);
      squares += variance;
      sum += std::sqrt(variance);
    }
  }
  return sum > 0 ? squares / sum : 0;
}

/// Mean square of the differences of neighbours.
double edge_energy(const GrayPicture& picture) {
  std::int64_t sum = 0;
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* row = picture.pixels.data() + std::ptrdiff_t{y} * picture.width;
    for (int x = 0; x + 1 < picture.width; ++x)
      sum += (row[x + 1] - row[x]) * (row[x + 1] - row[x]);
  }
  return static_cast<double>(sum) / (1.0 * picture.width * picture.height);
}

/// Edge energy at full size relative to that at half size: near 1 in a sharp picture, far less in a
/// blurred one.
double sharpness_of(const std::vector<ViewLevel>& levels) {
  const double halved = levels.size() > 1 ? edge_energy(levels[1]) : 0;
  return halved > 0 ? edge_energy(levels[0]) / halved : 0;
}

/// Share of cells with features, those that repeat included: repetition is a cause of its own.
double spread_of(const GrayPicture& picture, const std::vector<Matched>& views) {
  std::array<bool, kSpreadGrid * kSpreadGrid> cells{};
  for (const Matched& found : views) {
    for (const auto* places : {&found.held, &found.ambiguous}) {
      for (const auto& place : *places) {
        const int column = static_cast<int>((place[0] + 0.5) * kSpreadGrid) / picture.width;
        const int row = static_cast<int>((place[1] + 0.5) * kSpreadGrid) / picture.height;
        cells[static_cast<std::size_t>(std::clamp(row, 0, kSpreadGrid - 1) * kSpreadGrid +
                                       std::clamp(column, 0, kSpreadGrid - 1))] = true;
      }
    }
  }
  return static_cast<double>(std::count(cells.begin(), cells.end(), true)) / cells.size();
}

/// Features of all test views, merged within 4 pixels of the picture.
std::vector<ScorePlace> places_of(const std::vector<Matched>& views) {
  std::vector<ScorePlace> places;
  for (const Matched& found : views) {
    for (const auto& p : found.held) {
      const auto x = static_cast<float>(p[0]);
      const auto y = static_cast<float>(p[1]);
      const auto near = std::find_if(places.begin(), places.end(), [&](const ScorePlace& other) {
        return std::abs(other.x - x) < 4 && std::abs(other.y - y) < 4;
      });
      if (near != places.end()) {
        ++near->held;
      } else {
        places.push_back({x, y, 1});
      }
    }
  }
  return places;
}

/// What a step of the test varies.
enum class Vary : std::uint8_t { kSize, kTilt, kClose, kCover, kMirror };

/// One step of the test: views of one size and tilt.
struct Step {
  Vary vary;
  double side;  ///< frame pixels: root of the area, were it not tilted
  double tilt;
  bool easier = false;  ///< than the first of its kind: tried where that one is not always right
};

/// Sizes from one that nearly every pattern is recognised at down by 7 % each, then tilts from 65
/// to 79 degrees; views that overflow the frame, half-covered ones, the mirror image; and for poor
/// patterns larger and less tilted views.
std::vector<Step> test_steps() {
  std::vector<Step> steps;
  for (const double side : {104, 97, 91, 85, 79, 74, 69, 64, 60, 56}) {
    steps.push_back({Vary::kSize, side, 1.1});
  }
  for (const double tilt : {2.4, 2.7, 3.0, 3.3, 3.7, 4.1, 4.6, 5.2}) {
    steps.push_back({Vary::kTilt, kEasySide, tilt});
  }
  for (const double side : {400, 560, 800}) steps.push_back({Vary::kClose, side, 1.1});
  for (const double tilt : {1.05, 1.15, 1.25, 1.4}) steps.push_back({Vary::kCover, 200, tilt});
  steps.push_back({Vary::kMirror, kEasySide, 1.1});
  for (const double side : {120, 140, 170, 200}) steps.push_back({Vary::kSize, side, 1.1, true});
  for (const double tilt : {2.0, 1.7, 1.4}) steps.push_back({Vary::kTilt, kEasySide, tilt, true});
  return steps;
}

/// A frame with the pattern in its middle over clutter.
GrayPicture step_frame(const std::vector<ViewLevel>& levels, const AffineView& view,
                       std::uint64_t seed) {
  Random random(seed);
  const GrayPicture background = made_clutter(random, view.width, view.height);
  GrayPicture frame = render_view(levels, view, &background);
  blur_and_noise(seed, frame);
  return frame;
}

/// Frame pixels on a side of the near steps: the height of a 1280x720 camera's frame, halved.
constexpr int kNearFrame = 360;

/// Side of a step's frames: the pattern fits in, however it is rotated; near ones overflow.
int frame_side(const Step& step) {
  return step.vary == Vary::kClose ? kNearFrame
                                   : static_cast<int>(1.6 * step.side) + 2 * kViewMargin;
}

AffineView centred(AffineView view, int side) {
  view.offset[0] += 0.5 * (side - view.width);
  view.offset[1] += 0.5 * (side - view.height);
  view.width = view.height = side;
  return view;
}

FrameTruth truth_of(const GrayPicture& picture, const AffineView& view) {
  const double right = picture.width - 0.5;
  const double bottom = picture.height - 0.5;
  const glm::dvec2 corners[4] = {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
  FrameTruth truth;
  truth.pattern = true;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2& c = corners[i];
    truth.corners[i] = {view.linear[0] * c.x + view.linear[1] * c.y + view.offset[0],
                        view.linear[2] * c.x + view.linear[3] * c.y + view.offset[1]};
  }
  return truth;
}

/// Replaces half of the pattern, on one of its four sides, by the background.
void cover_half(const GrayPicture& picture, const AffineView& view, int side,
                const GrayPicture& behind, GrayPicture& frame) {
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const auto place = to_picture(view, x, y);
      const double along = side % 2 == 0 ? place[0] / picture.width : place[1] / picture.height;
      if (side < 2 ? along > 0.5 : along < 0.5) continue;
      const auto i = static_cast<std::size_t>(y * frame.width + x);
      frame.pixels[i] = behind.pixels[i];
    }
  }
}

/// The view of that index of a step.
AffineView view_of(const GrayPicture& picture, const Step& step, int i) {
  const double own = std::sqrt(1.0 * picture.width * picture.height);
  const double scale = step.vary == Vary::kClose ? step.side / own : std::min(1.0, step.side / own);
  return centred(make_view(picture.width, picture.height, scale, step.tilt, kTurns[i],
                           kTurns[(i + 2) % 6], kViewMargin),
                 frame_side(step));
}

/// Root of the area that a step's size is of: the picture's, or that of a box's front.
double own_side(const GrayImage& picture, const PatternSurface& surface) {
  if (surface.faces().empty()) return std::sqrt(1.0 * picture.width * picture.height);
  const auto& front = surface.faces()[0].place;
  return std::sqrt(1.0 * front[2] * front[3]);
}

/// Degrees.
double angle_of(const Step& step) {
  return std::acos(1 / step.tilt) * 57.29577951308232;
}

/// The same view of a picture on a shape, from as far around it as others are tilted; truth: filled
/// in.
GrayPicture shape_frame(const GrayPicture& picture, const PatternSurface& surface,
                        const Camera& camera, const Step& step, int i, std::uint64_t seed,
                        FrameTruth& truth) {
  const double scale = step.side / own_side(picture.view(), surface);
  const double side = i % 2 == 0 ? 1 : -1;
  const Pose pose = surface_pose(picture.view(), surface, camera, side * angle_of(step), 5.0 * side,
                                 60.0 * i, scale, {0, 0});
  Random random(seed);
  GrayPicture frame = made_clutter(random, camera.width, camera.height);
  draw_surface(picture.view(), surface, camera, pose, step.vary == Vary::kCover ? 0.5 : 0, frame);
  blur_and_noise(seed, frame);
  truth = {true, surface_corners(picture.view(), surface, camera, pose)};
  return frame;
}

/// How many views of a step are right; of the mirror image, in how many anything is recognised.
Result<int> count_right(const std::vector<ViewLevel>& levels, const PatternSurface& surface,
                        const BundleView& bundle, const Step& step, std::uint64_t seed) {
  // From so far away that a view is affine.
  const int side = frame_side(step);
  Camera camera = default_camera(side, side);
  camera.fx = camera.fy = 20.0 * side;
  PoseLoopOptions options;
  options.track = false;
  MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, camera, options));
  int right = 0;
  for (int i = 0; i < kViewsOfStep; ++i) {
    const std::uint64_t seed_of_view = seed + static_cast<std::uint64_t>(i);
    const AffineView view = view_of(levels[0], step, i);
    FrameTruth truth = truth_of(levels[0], view);
    GrayPicture frame = surface.flat()
                            ? step_frame(levels, view, seed_of_view)
                            : shape_frame(levels[0], surface, camera, step, i, seed_of_view, truth);
    if (surface.flat() && step.vary == Vary::kCover) {
      Random random(seed + 500 + static_cast<std::uint64_t>(i));
      cover_half(levels[0], view, i % 4, made_clutter(random, side, side), frame);
    }
    MODAR_ASSIGN(const TrackResult seen, loop->step(frame.view()));
    if (seen.visible.empty()) continue;
    right += step.vary == Vary::kMirror || is_right(seen.visible[0], truth);
  }
  return right;
}

GrayPicture mirrored(const GrayPicture& picture) {
  GrayPicture out = picture;
  for (int y = 0; y < out.height; ++y) {
    const auto row = out.pixels.begin() + std::ptrdiff_t{y} * out.width;
    std::reverse(row, row + out.width);
  }
  return out;
}

/// Outcome of all steps: share of right views of each.
struct StepShares {
  std::vector<Step> steps;
  std::vector<double> shares;
};

/// The steps of a picture, in two rounds: the easier ones are right wherever the first of their
/// kind always was.
class StepTrial {
 public:
  StepTrial(const std::vector<ViewLevel>& levels, const PatternSurface& surface,
            const BundleView& bundle, unsigned jobs)
      : levels_(levels),
        turned_over_(mirrored(levels[0])),
        mirror_levels_(view_levels(turned_over_.view())),
        surface_(surface),
        bundle_(bundle),
        jobs_(jobs),
        shares_{test_steps(), {}} {
    shares_.shares.assign(shares_.steps.size(), 1.0);
  }

  Result<StepShares> run() {
    std::vector<std::uint32_t> round;
    for (std::uint32_t i = 0; i < shares_.steps.size(); ++i) {
      if (!shares_.steps[i].easier) round.push_back(i);
    }
    MODAR_TRY(try_steps(round));
    round.clear();
    for (std::uint32_t i = 0; i < shares_.steps.size(); ++i) {
      if (shares_.steps[i].easier && first_share(shares_.steps[i].vary) < 1) round.push_back(i);
    }
    MODAR_TRY(try_steps(round));
    return std::move(shares_);
  }

 private:
  [[nodiscard]] double first_share(Vary vary) const {
    std::size_t i = 0;
    while (shares_.steps[i].vary != vary) ++i;
    return shares_.shares[i];
  }

  Result<void> try_steps(const std::vector<std::uint32_t>& round) {
    std::vector<Result<int>> right(round.size(), 0);
    parallel_rows(static_cast<std::uint32_t>(round.size()), jobs_, [&](std::uint32_t k) {
      const Step& step = shares_.steps[round[k]];
      right[k] = count_right(step.vary == Vary::kMirror ? mirror_levels_ : levels_, surface_,
                             bundle_, step, 1000 * std::uint64_t{round[k]});
    });
    for (std::size_t k = 0; k < round.size(); ++k) {
      MODAR_ASSIGN(const int count, right[k]);
      shares_.shares[round[k]] = 1.0 * count / kViewsOfStep;
    }
    return {};
  }

  const std::vector<ViewLevel>& levels_;
  GrayPicture turned_over_;
  std::vector<ViewLevel> mirror_levels_;
  const PatternSurface& surface_;
  const BundleView& bundle_;
  unsigned jobs_;
  StepShares shares_;
};

Result<StepShares> run_steps(const std::vector<ViewLevel>& levels,
                             std::span<const std::byte> record, unsigned jobs,
                             const std::vector<std::byte>& shape) {
  MODAR_ASSIGN(const auto bytes,
               bundle_of_record(levels[0].view(), {record.begin(), record.end()}, shape));
  const PatternSurface surface = surface_of(shape, levels[0].width, levels[0].height);
  MODAR_ASSIGN(const auto bundle, BundleView::open(bytes));
  return StepTrial(levels, surface, bundle, jobs).run();
}

/// Mean share of the steps that vary the same.
double mean_share(const StepShares& all, Vary vary) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < all.steps.size(); ++i) {
    if (all.steps[i].vary != vary) continue;
    sum += all.shares[i];
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// Where along the values of its steps a pattern stops being right, from the easiest step on: each
/// step counts by its share. Half a step is added at both ends.
double range_end(const StepShares& all, Vary vary, double (*value)(const Step&)) {
  std::vector<std::pair<double, double>> steps;  // value, share
  for (std::size_t i = 0; i < all.steps.size(); ++i) {
    if (all.steps[i].vary == vary) steps.emplace_back(value(all.steps[i]), all.shares[i]);
  }
  std::sort(steps.begin(), steps.end());
  double end = steps[0].first - 0.5 * (steps[1].first - steps[0].first);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double before = i > 0 ? steps[i].first - steps[i - 1].first : 0;
    const double after = i + 1 < steps.size() ? steps[i + 1].first - steps[i].first : before;
    end += steps[i].second * 0.5 * ((i > 0 ? before : after) + after);
  }
  return end;
}

/// The range of a camera 1280 pixels wide: distances in widths are focal length over frame pixels.
/// aspect: the pattern's width by the size that its steps are of.
ScoreRange range_of_steps(const StepShares& all, double aspect) {
  constexpr double kFocal = 1280;
  ScoreRange range;
  if (mean_share(all, Vary::kSize) <= 0) return range;
  // Logarithms, since the sizes are a geometric sequence.
  const double far =
      range_end(all, Vary::kSize, [](const Step& step) { return -std::log(step.side); });
  range.farthest = kFocal / (std::exp(-far) * aspect);
  // Frames of the near steps have half of the camera's pixels.
  double near_side = 200;
  for (std::size_t i = 0; i < all.steps.size(); ++i) {
    const bool near = all.steps[i].vary == Vary::kClose && all.shares[i] >= 0.8;
    if (near) near_side = std::max(near_side, 2 * all.steps[i].side);
  }
  range.nearest = std::min(range.farthest, kFocal / (near_side * aspect));
  range.tilt_deg = range_end(all, Vary::kTilt, angle_of);
  range.covered_share = mean_share(all, Vary::kCover);
  return range;
}

/// "9 cm" or "1.3 m".
std::string distance_text(double mm) {
  char text[32];
  std::snprintf(text, sizeof text, mm < 995 ? "%.0f cm" : "%.1f m", mm < 995 ? mm / 10 : mm / 1000);
  return text;
}

/// How well single features are matched again.
struct FeatureTrial {
  std::vector<ScorePlace> places;
  int views = 0;
  double held = 0;  ///< mean of the views
  double ambiguous = 0;
  double spread = 0;
};

FeatureTrial try_features(const std::vector<ViewLevel>& levels, unsigned jobs) {
  const KnownFeatures known = known_features(levels, jobs);
  const std::vector<TestView> views = feature_views(levels[0]);
  std::vector<Matched> found(views.size());
  parallel_rows(static_cast<std::uint32_t>(views.size()), jobs,
                [&](std::uint32_t i) { found[i] = match_view(levels, views[i], known, 77 + i); });
  FeatureTrial trial;
  trial.views = static_cast<int>(views.size());
  trial.places = places_of(found);
  trial.spread = spread_of(levels[0], found);
  for (const Matched& each : found) {
    trial.held += static_cast<double>(each.held.size()) / trial.views;
    trial.ambiguous += static_cast<double>(each.ambiguous.size()) / trial.views;
  }
  return trial;
}

ScoreCause cause(const char* id, int value, const char* advice) {
  constexpr int kGood = 60;  // from here on no advice; the causes' scales are set for it
  return {id, value, value >= kGood ? "" : advice};
}

/// The advice of the worst cause, where none is bad.
void advise(const char* const (&advices)[9], PatternScore& score) {
  const bool advised = std::any_of(score.causes.begin(), score.causes.end(),
                                   [](const ScoreCause& one) { return *one.advice != 0; });
  if (advised) return;
  const auto worst =
      std::min_element(score.causes.begin(), score.causes.end(),
                       [](const ScoreCause& a, const ScoreCause& b) { return a.value < b.value; });
  worst->advice = advices[worst - score.causes.begin()];
}

constexpr int kOverlayCells = 12;  // on the longer side

/// Darkens cells without a feature.
void darken_empty_cells(cv::Mat& picture, const std::vector<ScorePlace>& places) {
  const int side = std::max(8, std::max(picture.cols, picture.rows) / kOverlayCells);
  for (int y = 0; y < picture.rows; y += side) {
    for (int x = 0; x < picture.cols; x += side) {
      const cv::Rect cell = cv::Rect(x, y, side, side) & cv::Rect(0, 0, picture.cols, picture.rows);
      const bool empty = std::none_of(places.begin(), places.end(), [&](const ScorePlace& place) {
        return cell.contains(cv::Point(cvRound(place.x), cvRound(place.y)));
      });
      if (!empty) continue;
      cv::Mat part = picture(cell);
      part = part * 0.45 + cv::Scalar(90, 10, 10, 140);
    }
  }
}

}  // namespace

Result<PatternScore> score_pattern(const GrayImage& pattern, std::span<const std::byte> record,
                                   unsigned jobs, const std::vector<std::byte>& shape) {
  const std::vector<ViewLevel> levels = view_levels(pattern);
  MODAR_ASSIGN(const StepShares steps, run_steps(levels, record, jobs, shape));
  FeatureTrial trial = try_features(levels, jobs);
  PatternScore out;
  const PatternSurface surface = surface_of(shape, pattern.width, pattern.height);
  out.range = range_of_steps(steps, pattern.width / own_side(pattern, surface));
  out.range.curved = !shape.empty();
  out.grade = grade_of(out.range);
  out.score = score_of(out.range);
  out.views = trial.views;
  out.places = std::move(trial.places);
  const double side = std::sqrt(1.0 * pattern.width * pattern.height);
  const double aspect =
      1.0 * std::min(pattern.width, pattern.height) / std::max(pattern.width, pattern.height);
  const char* const advices[9] = {
      "choose or add detail with corners: print, ornaments, photos of rough surfaces",
      "crop away empty margins, or put detail into the empty parts",
      "photograph it in even, brighter light, or print it with more contrast",
      "avoid grids, tiles and repeated letters: each part should look like no other",
      "crop it closer to a square: the pose of long strips is unstable",
      "give a larger picture: 300 pixels or more on each side",
      "take a sharper picture: hold still, focus, do not enlarge a small one",
      "make the two sides differ: it is confused with its mirror image",
      "choose larger print: lines this fine blur into gray at arm's length"};
  // Each cause's scale runs to what good patterns have: chosen on twelve pictures and on those
  // with one known fault that the tests make.
  const int values[9] = {share_of(trial.held + trial.ambiguous, 60),
                         share_of(trial.spread, 1.0),
                         share_of(contrast_of(levels[0]), 30),
                         share_of(trial.held / std::max(1.0, trial.held + trial.ambiguous), 0.5),
                         share_of(aspect, 0.6),
                         share_of(side, 300),
                         share_of(sharpness_of(levels) - 0.15, 0.35),
                         mean_share(steps, Vary::kMirror) > 0 ? 0 : 100,
                         share_of(kFinest - sharpness_of(levels), kFinest - kFine)};
  constexpr const char* kIds[9] = {"texture", "spread", "contrast", "repetition", "aspect",
                                   "size",    "blur",   "mirror",   "fine"};
  for (std::size_t i = 0; i < 9; ++i) out.causes.push_back(cause(kIds[i], values[i], advices[i]));
  if (out.grade != 'A') {
    advise(advices, out);
  } else {
    // The best needs no change; that its mirror image is taken for it is a fact of its own.
    for (ScoreCause& one : out.causes) {
      if (std::string_view(one.id) != "mirror") one.advice = "";
    }
  }
  return out;
}

double range_value(const ScoreRange& range) {
  // Root-area distance would favour no shape; widths are what a curator plans with.
  return range.farthest * range.tilt_deg / 70 * (0.5 + 0.5 * range.covered_share);
}

namespace {

int score_of_value(double value) {
  return static_cast<int>(std::lround(100 * (1 - std::exp(-value / kScoreScale))));
}

}  // namespace

int score_of(const ScoreRange& range) {
  return score_of_value(range_value(range));
}

int least_score(char grade) {
  return grade >= 'E' ? 0 : score_of_value(kGradeLimits[grade - 'A']);
}

char grade_of(const ScoreRange& range) {
  const double value = range_value(range);
  char grade = 'A';
  for (const double limit : kGradeLimits) {
    if (value >= limit) return grade;
    ++grade;
  }
  return grade;
}

std::string range_sentence(const ScoreRange& range, double width_mm) {
  if (range.farthest <= 0) return "not recognised at any distance";
  char reach[80];
  std::snprintf(reach, sizeof reach,
                range.curved ? "over %.0f degrees around it, %.0f %% right when half covered"
                             : "to %.0f degrees, %.0f %% right when half covered",
                (range.curved ? 2 : 1) * range.tilt_deg, 100 * range.covered_share);
  char text[160];
  if (width_mm > 0) {
    std::snprintf(text, sizeof text, "recognised from %s to %s, %s",
                  distance_text(range.nearest * width_mm).c_str(),
                  distance_text(range.farthest * width_mm).c_str(), reach);
  } else {
    std::snprintf(text, sizeof text, "recognised from %.2g to %.2g times its width, %s",
                  range.nearest, range.farthest, reach);
  }
  return text;
}

RgbaImage score_overlay(const GrayImage& pattern, const PatternScore& score) {
  RgbaImage image;
  image.width = static_cast<std::uint32_t>(pattern.width);
  image.height = static_cast<std::uint32_t>(pattern.height);
  image.pixels.resize(std::size_t{image.width} * image.height * 4);
  cv::Mat picture(pattern.height, pattern.width, CV_8UC4, image.pixels.data());
  cv::cvtColor(as_mat(pattern), picture, cv::COLOR_GRAY2RGBA);
  darken_empty_cells(picture, score.places);
  for (const ScorePlace& place : score.places) {
    const bool good = place.held * 4 >= score.views;
    cv::circle(picture, {cvRound(place.x), cvRound(place.y)}, good ? 3 : 2,
               good ? cv::Scalar(60, 230, 60, 255) : cv::Scalar(240, 150, 50, 255), cv::FILLED,
               cv::LINE_AA);
  }
  return image;
}

Result<ScoredPicture> score_file(const std::string& path, double width_mm,
                                 const ShapeRequest& request, unsigned jobs) {
  ScoredPicture out;
  MODAR_ASSIGN(out.shaped, load_shaped(path, width_mm, request));
  const GrayImage picture = out.shaped.picture.view();
  TrackerRecordOptions loop;
  loop.jobs = jobs;
  const PatternSurface surface = surface_of(out.shaped.section, picture.width, picture.height);
  auto scored = make_tracker_record(picture, loop, surface).and_then([&](auto&& record) {
    out.record = std::move(record);
    return score_pattern(picture, out.record, jobs, out.shaped.section);
  });
  if (!scored) {
    scored.error().where = path;
    return tl::unexpected(std::move(scored.error()));
  }
  out.score = std::move(*scored);
  return out;
}

}  // namespace modar
