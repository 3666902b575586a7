// Asks the device's loop for a pattern in ever harder views, and its features what holds them.
#include "bake/pattern/score.hpp"

#include <algorithm>
#include <cmath>

#include "bake/parallel.hpp"
#include "bake/pattern/described_view.hpp"
#include "bake/pattern/pose_subject.hpp"
#include "bake/pattern/view_kernel.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kMargin = 24;        // view pixels around the pattern
constexpr double kNear = 3;        // view pixels within which two features are the same place
constexpr int kRepeats = 64;       // bits within which one feature repeats another
constexpr int kGrid = 6;           // cells on a side that features are spread over
constexpr double kEasySide = 240;  // frame pixels: root of the area at which tilts are tried

constexpr int kViewsOfRung = 6;
constexpr double kBest = 0.75;  // share of the ladder that patterns climb at most

/// A feature that the bake could keep.
struct Known {
  double x;
  double y;
  TrackerCode code;
  std::uint8_t dark;
};

/// Turns by rational numbers, so that no machine rounds them another way.
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
                    kMargin),
          scale};
}

/// What a test view gave.
struct Found {
  std::vector<std::array<double, 2>> held;  ///< picture pixels of features that were told apart
  int ambiguous = 0;                        ///< repeated, but elsewhere just as well
};

std::vector<Known> describe(const std::vector<ViewLevel>& levels, const AffineView& view) {
  const GrayPicture picture = render_view(levels, view, nullptr);
  const auto describer =
      FeatureExtractor::create(picture.width, picture.height, generous_detection());
  describer->set_frame(picture.view());
  std::vector<Known> known;
  for (const TrackerFeature& feature : describer->features()) {
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
                                kTurns[(k + turn) % 6], kMargin));
    }
  }
  std::vector<std::vector<Known>> found(views.size());
  parallel_rows(static_cast<std::uint32_t>(views.size()), jobs,
                [&](std::uint32_t i) { found[i] = describe(levels, views[i]); });
  KnownFeatures known;
  for (const auto& some : found) {
    for (const Known& one : some) {
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

/// What a lens and a sensor add.
void disturb(std::uint64_t seed, GrayPicture& picture) {
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

Found find_again(const std::vector<ViewLevel>& levels, const TestView& test,
                 const KnownFeatures& known, std::uint64_t seed) {
  GrayPicture picture = render_view(levels, test.view, nullptr);
  disturb(seed, picture);
  const auto describer = FeatureExtractor::create(picture.width, picture.height, DetectOptions{});
  describer->set_frame(picture.view());
  Found found;
  std::vector<int> bits;
  for (const TrackerFeature& feature : describer->features()) {
    const auto place =
        to_picture(test.view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    const double radius = kNear * (1 << feature.level) / test.scale;
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
    if (here > kRepeats) continue;
    // As the device's matcher: the second best counts where it lies elsewhere.
    if (here * 10 < elsewhere * 9) {
      found.held.push_back(place);
    } else {
      ++found.ambiguous;
    }
  }
  return found;
}

/// 0 to 100 for 0 to `enough`.
int share_of(double value, double enough) {
  return static_cast<int>(std::clamp(100.0 * value / enough + 0.5, 0.0, 100.0));
}

/// Mean over blocks of 16x16 pixels of the standard deviation of their gray values.
double contrast_of(const GrayPicture& picture) {
  double sum = 0;
  int blocks = 0;
  for (int y = 0; y + 16 <= picture.height; y += 16) {
    for (int x = 0; x + 16 <= picture.width; x += 16, ++blocks) {
      std::int64_t first = 0;
      std::int64_t second = 0;
      for (int k = 0; k < 256; ++k) {
        const int gray =
            picture.pixels[static_cast<std::size_t>((y + k / 16) * picture.width + x + k % 16)];
        first += gray;
        second += gray * gray;
      }
      sum += std::sqrt(static_cast<double>(256 * second - first * first)) / 256;
    }
  }
  return blocks > 0 ? sum / blocks : 0;
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

/// A sharp picture has nearly as much to show at its own size as halved; a blurred one far less.
double sharpness_of(const std::vector<ViewLevel>& levels) {
  const double halved = levels.size() > 1 ? edge_energy(levels[1]) : 0;
  return halved > 0 ? edge_energy(levels[0]) / halved : 0;
}

double spread_of(const GrayPicture& picture, const std::vector<ScorePlace>& places) {
  std::array<bool, kGrid * kGrid> cells{};
  for (const ScorePlace& place : places) {
    const int column = static_cast<int>((place.x + 0.5f) * kGrid) / picture.width;
    const int row = static_cast<int>((place.y + 0.5f) * kGrid) / picture.height;
    cells[static_cast<std::size_t>(std::clamp(row, 0, kGrid - 1) * kGrid +
                                   std::clamp(column, 0, kGrid - 1))] = true;
  }
  return static_cast<double>(std::count(cells.begin(), cells.end(), true)) / cells.size();
}

/// Features of all test views, one for each few pixels of the picture.
std::vector<ScorePlace> places_of(const std::vector<Found>& views) {
  std::vector<ScorePlace> places;
  for (const Found& found : views) {
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

/// A rung of the ladder that patterns climb: ever smaller, or ever more tilted.
struct Rung {
  double side;  ///< frame pixels: root of the area, were it not tilted
  double tilt;
};

std::vector<Rung> ladder() {
  std::vector<Rung> rungs;
  for (const double side : {104, 97, 91, 85, 79, 74, 69, 64, 60, 56}) rungs.push_back({side, 1.1});
  for (const double tilt : {2.4, 2.7, 3.0, 3.3, 3.7, 4.1, 4.6, 5.2}) {
    rungs.push_back({kEasySide, tilt});
  }
  return rungs;
}

/// A frame with the pattern in its middle over clutter.
GrayPicture climb_frame(const std::vector<ViewLevel>& levels, const AffineView& view,
                        std::uint64_t seed) {
  Random random(seed);
  const GrayPicture background = made_clutter(random, view.width, view.height);
  GrayPicture frame = render_view(levels, view, &background);
  disturb(seed, frame);
  return frame;
}

/// Side of the frames of a rung: the pattern fits in, whatever its turn.
int frame_side(const Rung& rung) {
  return static_cast<int>(1.6 * rung.side) + 2 * kMargin;
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

/// How many views of a rung are right.
Result<int> climb(const std::vector<ViewLevel>& levels, const BundleView& bundle, const Rung& rung,
                  std::uint64_t seed) {
  // From so far away that a view is affine.
  const int side = frame_side(rung);
  Camera camera = default_camera(side, side);
  camera.fx = camera.fy = 20.0 * side;
  PoseLoopOptions options;
  options.track = false;
  auto loop = PoseLoop::create(bundle, camera, options);
  if (!loop) return tl::unexpected(loop.error());
  int right = 0;
  for (int i = 0; i < kViewsOfRung; ++i) {
    const AffineView view =
        centred(test_view(levels[0], rung.side, rung.tilt, i, (i + 2) % 6).view, side);
    const GrayPicture frame = climb_frame(levels, view, seed + static_cast<std::uint64_t>(i));
    const auto seen = (*loop)->step(frame.view());
    if (!seen) return tl::unexpected(seen.error());
    if (!seen->visible.empty() && is_right(seen->visible[0], truth_of(levels[0], view))) ++right;
  }
  return right;
}

/// Share of the ladder's views that are right.
Result<double> climbed(const std::vector<ViewLevel>& levels, std::span<const std::byte> loop_record,
                       unsigned jobs) {
  const auto bytes = bundle_of_record(levels[0].view(), {loop_record.begin(), loop_record.end()});
  if (!bytes) return tl::unexpected(bytes.error());
  const auto bundle = BundleView::open(*bytes);
  if (!bundle) return tl::unexpected(bundle.error());
  const std::vector<Rung> rungs = ladder();
  std::vector<Result<int>> right(rungs.size(), 0);
  parallel_rows(static_cast<std::uint32_t>(rungs.size()), jobs, [&](std::uint32_t i) {
    right[i] = climb(levels, *bundle, rungs[i], 1000 * std::uint64_t{i});
  });
  double sum = 0;
  for (const auto& one : right) {
    if (!one) return tl::unexpected(one.error());
    sum += *one;
  }
  return sum / static_cast<double>(rungs.size() * kViewsOfRung);
}

/// How well single features hold.
struct FeatureTrial {
  std::vector<ScorePlace> places;
  int views = 0;
  double held = 0;  ///< mean of the views
  double ambiguous = 0;
};

FeatureTrial try_features(const std::vector<ViewLevel>& levels, unsigned jobs) {
  const KnownFeatures known = known_features(levels, jobs);
  const std::vector<TestView> views = feature_views(levels[0]);
  std::vector<Found> found(views.size());
  parallel_rows(static_cast<std::uint32_t>(views.size()), jobs,
                [&](std::uint32_t i) { found[i] = find_again(levels, views[i], known, 77 + i); });
  FeatureTrial trial;
  trial.views = static_cast<int>(views.size());
  trial.places = places_of(found);
  for (const Found& each : found) {
    trial.held += static_cast<double>(each.held.size()) / trial.views;
    trial.ambiguous += 1.0 * each.ambiguous / trial.views;
  }
  return trial;
}

ScoreCause cause(const char* id, int value, const char* advice) {
  constexpr int kGood = 60;
  return {id, value, value >= kGood ? "" : advice};
}

}  // namespace

Result<PatternScore> score_pattern(const GrayImage& pattern, std::span<const std::byte> loop_record,
                                   unsigned jobs) {
  const std::vector<ViewLevel> levels = view_levels(pattern);
  const auto share = climbed(levels, loop_record, jobs);
  if (!share) return tl::unexpected(share.error());
  FeatureTrial trial = try_features(levels, jobs);
  PatternScore out;
  out.score = share_of(*share, kBest);
  out.views = trial.views;
  out.places = std::move(trial.places);
  const double side = std::sqrt(1.0 * pattern.width * pattern.height);
  const double aspect =
      1.0 * std::min(pattern.width, pattern.height) / std::max(pattern.width, pattern.height);
  out.causes = {
      cause("texture", share_of(trial.held, 60),
            "choose or add detail with corners: print, ornaments, photos of rough things"),
      cause("spread", share_of(spread_of(levels[0], out.places), 1.0),
            "crop away empty margins, or put detail into the empty parts"),
      cause("contrast", share_of(contrast_of(levels[0]), 30),
            "photograph it in even, brighter light, or print it with more contrast"),
      cause("repetition", share_of(trial.held / std::max(1.0, trial.held + trial.ambiguous), 0.5),
            "avoid grids, tiles and repeated letters: each part should look like no other"),
      cause("aspect", share_of(aspect, 0.6),
            "crop it closer to a square: long strips hold a pose badly"),
      cause("size", share_of(side, 300), "give a larger picture: 300 pixels or more on each side"),
      cause("blur", share_of(sharpness_of(levels) - 0.15, 0.35),
            "take a sharper picture: hold still, focus, do not enlarge a small one")};
  return out;
}

}  // namespace modar
