// Least squares for one over the squared focal length, over homographies of detected patterns.
#include "modar/focal_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "kernels.hpp"
#include "modar/camera.hpp"
#include "modar/tracker_features.hpp"
#include "pattern_matching.hpp"
#include "pose_refinement.hpp"
#include "tracked_pattern.hpp"

namespace modar {
namespace {

using tracker::TrackedPattern;

// Inliers of a hypothesis that is aligned: without the photometric check of a search, so more of
// them.
constexpr int kMinInliers = 15;
// Perspective terms of the homography per half pattern: below, noise decides. Both by hand.
constexpr double kMinPerspective = 0.06;
constexpr int kMaxViews = 256;  // bounds the memory

/// a * x = b for x = 1 / f^2: the axes of the plane are equally long, or orthogonal.
struct Constraint {
  double a = 0;
  double b = 0;
};

/// Both constraints of a view. homography: world (ModAR Eq. 1) to pixels from the frame's centre.
std::array<Constraint, 2> constraints_of(const glm::dmat3& homography, double unit) {
  // In units of the frame's width all three rows are of one magnitude.
  glm::dvec3 h1 = homography[0];
  glm::dvec3 h2 = homography[1];
  for (glm::dvec3* h : {&h1, &h2}) {
    h->x /= unit;
    h->y /= unit;
  }
  const double scale = 1.0 / std::sqrt(h1.x * h1.x + h1.y * h1.y + h2.x * h2.x + h2.y * h2.y);
  h1 *= scale;
  h2 *= scale;
  return {{{h1.x * h2.x + h1.y * h2.y, -h1.z * h2.z},
           {0.5 * (h1.x * h1.x + h1.y * h1.y - h2.x * h2.x - h2.y * h2.y),
            0.5 * (h2.z * h2.z - h1.z * h1.z)}}};
}

}  // namespace

struct FocalFinder::State {
  double unit = 0;  ///< frame width
  Camera camera;    ///< the default: only its principal point matters
  std::vector<TrackedPattern> patterns;
  std::unique_ptr<FeatureExtractor> extractor;
  std::unique_ptr<tracker::PlaneMatcher> matcher;
  tracker::PatchCache patches;
  std::vector<Constraint> constraints;  ///< two a view
  std::vector<glm::dvec3> horizons;     ///< of the views: vanishing lines, pixels from the centre
  int frames = 0;
  int frontal = 0;

  /// x = 1 / f^2 in squared units, and its standard deviation.
  [[nodiscard]] bool solve(double& x, double& deviation) const;
  [[nodiscard]] double scatter_deg(double focal) const;
};

/// As FocalProgress defines it.
double FocalFinder::State::scatter_deg(double focal) const {
  glm::dvec2 sum(0);
  double xx = 0;
  double xy = 0;
  double yy = 0;
  for (const glm::dvec3& line : horizons) {
    // K maps a vanishing line to the normal of its plane.
    glm::dvec3 normal = glm::normalize(glm::dvec3(line.x * focal, line.y * focal, line.z));
    if (normal.z < 0) normal = -normal;
    sum += glm::dvec2(normal);
    xx += normal.x * normal.x;
    xy += normal.x * normal.y;
    yy += normal.y * normal.y;
  }
  const double share = 1.0 / static_cast<double>(horizons.size());
  xx = share * xx - share * share * sum.x * sum.x;
  xy = share * xy - share * share * sum.x * sum.y;
  yy = share * yy - share * share * sum.y * sum.y;
  const double largest = 0.5 * (xx + yy) + glm::length(glm::dvec2(0.5 * (xx - yy), xy));
  return glm::degrees(std::sqrt(std::max(0.0, largest)));
}

bool FocalFinder::State::solve(double& x, double& deviation) const {
  // Twice: the second time without views more than 2.5 standard deviations off.
  double limit = 1e9;
  for (int pass = 0; pass < 2; ++pass) {
    double aa = 0;
    double ab = 0;
    int count = 0;
    for (const Constraint& c : constraints) {
      if (pass > 0 && std::abs(c.a * x - c.b) > limit) continue;
      aa += c.a * c.a;
      ab += c.a * c.b;
      ++count;
    }
    if (count < FocalProgress::kMinViews || !(aa > 0)) return false;
    const double best = ab / aa;
    double rest = 0;
    for (const Constraint& c : constraints) {
      const double off = c.a * best - c.b;
      if (pass == 0 || std::abs(c.a * x - c.b) <= limit) rest += off * off;
    }
    x = best;
    deviation = std::sqrt(rest / (count - 1) / aa);
    limit = 2.5 * std::sqrt(rest / count);
  }
  return x > 0;
}

FocalFinder::FocalFinder(std::unique_ptr<State> state) : state_(std::move(state)) {}
FocalFinder::~FocalFinder() = default;

Result<std::unique_ptr<FocalFinder>> FocalFinder::create(const BundleView& bundle, int width,
                                                         int height) {
  if (width < 1 || height < 1 || width > 16384 || height > 16384) {
    return fail(ExitCode::kInvalidInput, "tracker.frame-size", "", "the frames have no size",
                "give 1 to 16384 pixels a side");
  }
  auto state = std::make_unique<State>();
  state->unit = width;
  state->camera = default_camera(width, height);
  std::size_t max_codes = 0;
  bool any = false;
  for (std::uint32_t i = 0; i < bundle.patterns().size(); ++i) {
    const auto bytes = bundle.section(SectionType::kTrackerRecord, i);
    if (bytes.empty()) continue;
    MODAR_ASSIGN(const TrackedPattern pattern, tracker::view_tracked_pattern(bytes, i));
    any = true;
    // A homography shows no curved pattern.
    if (!bundle.section(kPatternShape, i).empty()) continue;
    max_codes = std::max(max_codes, pattern.features.size());
    state->patterns.push_back(pattern);
  }
  if (!any) {
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle holds no pattern with a record for this loop",
                "bake it with a pattern");
  }
  const DetectOptions detect;
  state->extractor = FeatureExtractor::create(width, height, detect);
  state->matcher = std::make_unique<tracker::PlaneMatcher>(
      state->camera, tracker::kernels(), static_cast<std::size_t>(detect.max_features), max_codes);
  state->constraints.reserve(2 * kMaxViews);
  state->horizons.reserve(kMaxViews);
  return std::unique_ptr<FocalFinder>(new FocalFinder(std::move(state)));
}

bool FocalFinder::add_frame(const GrayImage& frame) {
  State& state = *state_;
  ++state.frames;
  state.extractor->set_frame(frame);
  const auto features = state.extractor->features();
  const tracker::FrameView view{state.camera, state.extractor->pyramid(), tracker::kernels(),
                                state.patches};
  bool added = false;
  for (const TrackedPattern& pattern : state.patterns) {
    if (state.horizons.size() == kMaxViews) return added;
    const auto hypotheses = state.matcher->find(pattern, features);
    if (hypotheses.empty() || hypotheses[0].inliers < kMinInliers) continue;
    tracker::PlaneMap map{hypotheses[0].homography};
    tracker::PatchFit fit;
    if (!tracker::refine_map(pattern, view, map, fit)) continue;
    glm::dmat3 centre(1.0);
    centre[2] = {-state.camera.cx, -state.camera.cy, 1.0};
    const glm::dmat3 from_world =
        centre * map.homography * glm::inverse(pattern.world_from_pixels());
    const glm::dmat3 homography = from_world * (1.0 / from_world[2][2]);
    if (glm::length(glm::dvec2(homography[0].z, homography[1].z)) < kMinPerspective) {
      ++state.frontal;
      continue;
    }
    for (const Constraint& constraint : constraints_of(homography, state.unit)) {
      state.constraints.push_back(constraint);
    }
    state.horizons.push_back(glm::cross(homography[0], homography[1]));
    added = true;
  }
  return added;
}

FocalProgress FocalFinder::progress() const {
  FocalProgress progress{state_->frames, state_->frontal,
                         static_cast<int>(state_->horizons.size())};
  double x = 0;
  double deviation = 0;
  // f = x^(-1/2): its relative deviation is half of that of x.
  if (!state_->solve(x, deviation)) return progress;
  progress.deviation = 0.5 * deviation / x;
  progress.scatter_deg = state_->scatter_deg(state_->unit / std::sqrt(x));
  return progress;
}

std::optional<double> FocalFinder::focal() const {
  double x = 0;
  double deviation = 0;
  if (state_->horizons.size() < FocalProgress::kMinViews || !state_->solve(x, deviation) ||
      !(0.5 * deviation < FocalProgress::kMaxDeviation * x)) {
    return std::nullopt;
  }
  const double focal = state_->unit / std::sqrt(x);
  if (state_->scatter_deg(focal) < FocalProgress::kMinScatterDeg) return std::nullopt;
  const bool plausible = focal > 0.3 * state_->unit && focal < 6 * state_->unit;
  return plausible ? std::optional<double>(focal) : std::nullopt;
}

}  // namespace modar
