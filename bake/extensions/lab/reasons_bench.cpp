// Renders half a hand-held second of each cause, and compares the last frame's reason with it.
#include "bake/extensions/lab/reasons_bench.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/field_scene.hpp"
#include "bake/extensions/lab/hard_prints.hpp"
#include "bake/extensions/lab/unknown_view.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kFrames = 14;  // of a view; those before kHidden show the print, where it was tracked
constexpr int kHidden = 5;
constexpr int kHardest = 4;   // attempts, each harder, until the tracker shows nothing
constexpr int kAttempts = 8;  // the rest are as hard, of other views

enum class Cause : std::uint8_t {
  kSmall,
  kDark,
  kBlurred,
  kOverexposed,
  kGlare,
  kEdge,
  kCurved,
  kOtherPrint,
  kOutOfView,
  kNotThere,
};

struct CauseCase {
  Cause cause;
  const char* name;
  std::vector<std::string> right;  ///< reasons that say it
};

std::vector<CauseCase> cause_cases() {
  return {{Cause::kSmall, "too small", {"too small"}},
          {Cause::kDark, "too dark", {"too dark"}},
          {Cause::kBlurred, "blurred", {"blurred", "lost by blur"}},
          {Cause::kOverexposed, "overexposed", {"overexposed"}},
          {Cause::kGlare, "glare", {"glare"}},
          {Cause::kEdge, "at the edge", {"at the edge"}},
          {Cause::kCurved, "curved", {"curved"}},
          {Cause::kOtherPrint, "another print", {"another print"}},
          {Cause::kOutOfView, "out of view", {"out of view"}},
          {Cause::kNotThere, "not in view", {"not in view", "few matches", "no features"}}};
}

/// What all views are made of.
struct ReasonPrint {
  GrayPicture picture;
  GrayPicture other;  ///< of another pattern
  std::vector<std::byte> bundle;
};

/// One view. hardness: 0 to 1.
class HiddenView {
 public:
  HiddenView(const ReasonPrint& print, const GrayPicture& behind, Cause cause, double hardness,
             int number, Random& random)
      : cause_(cause),
        second_(number % 2 == 1),
        fourth_(number % 4 == 2),
        hardness_(hardness),
        behind_(behind),
        random_(random) {
    const Camera assumed = default_camera(kWidth, kHeight);
    unknown_ = draw_unknown(shown_print(print).view(), assumed, cause == Cause::kCurved, random);
    light_ = draw_light(random);
    set_light();
    const GrayImage shown = unknown_.print.view();
    // Pixels along a side of a square of the print's area.
    const double side =
        cause == Cause::kSmall ? 80 - (second_ ? 60 : 44) * hardness : random.uniform(170, 330);
    band_.area_low = band_.area_high = side * side / (1.0 * shown.width * shown.height);
    band_.tilt_high = 30;
    blur_.angle = random.uniform(0, std::numbers::pi);
    pose_ = draw_pose(band_, shown, unknown_.lens, random);
    size_ = side / unknown_.lens.fx * pose_.translation.z;
    direction_ = random.uniform(0, 2 * std::numbers::pi);
    side_ = random.next();
  }

  /// Another edition shows from several directions only.
  [[nodiscard]] int frames() const { return cause_ == Cause::kOtherPrint ? 3 * kFrames : kFrames; }

  GrayPicture frame(int number) {
    const GrayImage print = unknown_.print.view();
    if (number == 0) path_ = std::make_unique<HandPath>(pose_, random_);
    const bool hidden = !follows() || number >= kHidden;
    Pose pose = path_->at(number / 30.0, 0.7);
    if (hidden) move(number, pose);
    Random same(side_);
    const bool blurred = hidden && cause_ == Cause::kBlurred;
    const bool defocused = blurred && !second_;
    const int frames_away = cause_ == Cause::kSmall && second_ ? kFrames - 1 - number : 0;
    pose.translation.z *= std::pow(0.85, frames_away);
    SceneBand band = band_;
    band.pattern = cause_ != Cause::kCurved && (cause_ != Cause::kNotThere || second_);
    const MotionBlur blur =
        blurred && second_ ? MotionBlur{30 + 60 * hardness_, blur_.angle} : MotionBlur{};
    SceneFrame scene =
        render_still(print, unknown_.lens, pose, behind_, band, same, light_.focus, blur);
    if (cause_ == Cause::kCurved) bend(print, number, scene.picture);
    if (defocused) {
      for (const double turn : {0.0, 0.25, 0.5, 0.75}) {
        blur_motion({10 + 20 * hardness_, turn * std::numbers::pi}, scene.picture);
      }
    }
    GrayPicture out;
    expose(scene.picture, light_, random_, out);
    if (cause_ == Cause::kGlare) shine(scene.corners, out);
    return out;
  }

 private:
  /// Half of the blurred prints and of those at the edge, and all that leave the view, were tracked
  /// before.
  [[nodiscard]] bool follows() const {
    const bool half = cause_ == Cause::kBlurred || cause_ == Cause::kEdge;
    return cause_ == Cause::kOutOfView || (half && second_);
  }

  [[nodiscard]] GrayPicture shown_print(const ReasonPrint& print) const {
    if (cause_ == Cause::kNotThere) return print.other;
    if (cause_ != Cause::kOtherPrint) return print.picture;
    if (second_) return edition_of(print.picture.view(), print.other.view());
    if (fourth_) return language_of(print.picture.view());
    GrayPicture mirrored = print.picture;
    for (int y = 0; y < mirrored.height; ++y) {
      const auto row = mirrored.pixels.begin() + std::ptrdiff_t{y} * mirrored.width;
      std::reverse(row, row + mirrored.width);
    }
    return mirrored;
  }

  void set_light() {
    if (cause_ == Cause::kDark) {
      light_ = {0.07 * (1 - 0.85 * hardness_), 0, 0, 0, light_.focus, 4};
    } else if (cause_ == Cause::kOverexposed) {
      light_ = {4 + 16 * hardness_, 60, 0, 0, light_.focus, light_.noise};
    }
  }

  void move(int number, Pose& pose) const {
    if (cause_ == Cause::kEdge) {
      // Across a border, until this share of the print's side is left in the frame.
      const double left = 0.5 - 0.34 * hardness_;
      const double half = 0.5 * pose.translation.z / unknown_.lens.fx;
      const double way = (1.0 * number - kHidden + 1) / (kFrames - 2 - kHidden);
      const double share = second_ ? std::min(1.0, 0.6 + 0.4 * way) : 1.0;
      const bool aside = direction_ < std::numbers::pi;
      double& place = aside ? pose.translation.x : pose.translation.y;
      place += share * (half * (aside ? kWidth : kHeight) + (0.5 - left) * size_ - place);
    } else if (cause_ == Cause::kOutOfView) {
      const double far = 0.11 * (number - kHidden + 1) * pose.translation.z;
      pose.translation.x += far * std::cos(direction_);
      pose.translation.y += far * std::sin(direction_);
    }
  }

  /// On a cylinder.
  void bend(const GrayImage& print, int number, GrayPicture& frame) {
    const auto surface = PatternSurface::round(print.width, print.height, 0.9 + 1.3 * hardness_, 0);
    const double scale = std::sqrt(band_.area_high);
    const double sway = 4 * std::sin(0.3 * number + direction_);
    draw_surface(print, surface, unknown_.lens,
                 surface_pose(print, surface, unknown_.lens, sway + 8 * std::cos(direction_),
                              10 * std::sin(direction_) + 0.5 * sway, 0.2 * std::cos(direction_),
                              scale, {0.01 * sway, 0}),
                 0, frame);
  }

  /// A lamp's image on the print: an ellipse with a soft edge.
  void shine(const std::array<glm::dvec2, 4>& c, GrayPicture& frame) const {
    const glm::dvec2 centre = 0.25 * (c[0] + c[1] + c[2] + c[3]);
    const glm::dvec2 across = 0.5 * (c[1] - c[0]);
    const glm::dvec2 down = 0.5 * (c[3] - c[0]);
    const double size = 0.75 + 0.6 * hardness_;  // of the print's half sides
    const glm::dmat2 to_unit = glm::inverse(glm::dmat2(across * size, down * size));
    const glm::dvec2 at = centre + 0.25 * std::cos(direction_) * across;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double distance = glm::length(to_unit * (glm::dvec2(x, y) - at));
        const double light = 500 * std::clamp((1.05 - distance) / 0.15, 0.0, 1.0);
        std::uint8_t& pixel = frame.pixels[static_cast<std::size_t>(y * kWidth + x)];
        pixel = static_cast<std::uint8_t>(std::min(255.0, pixel + light));
      }
    }
  }

  Cause cause_;
  bool second_;  ///< the other of a cause's two kinds
  bool fourth_;  ///< of the first kind, the other half
  double hardness_;
  const GrayPicture& behind_;
  Random& random_;
  UnknownView unknown_;
  SceneLight light_;
  SceneBand band_;
  MotionBlur blur_;
  Pose pose_;
  double size_ = 0;  ///< of the print's side, pattern units
  double direction_ = 0;
  std::uint64_t side_ = 0;
  std::unique_ptr<HandPath> path_;
};

Result<Reason> reason_of(PoseLoop& loop, HiddenView& view) {
  Reason reason = Reason::kVisible;
  loop.reset();
  for (int i = 0; i < view.frames(); ++i) {
    const GrayPicture frame = view.frame(i);
    MODAR_ASSIGN(const TrackResult seen, loop.step(frame.view()));
    reason = seen.visible.empty() ? seen.reason : Reason::kVisible;
  }
  return reason;
}

Result<std::vector<ReasonPrint>> reason_prints(const PoseBenchOptions& options) {
  std::vector<ReasonPrint> prints;
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    MODAR_ASSIGN(auto picture, load_pattern(path, shrunk));
    MODAR_ASSIGN(const auto record, make_tracker_record(picture.view(), {}));
    MODAR_ASSIGN(auto bundle, bundle_of_record(picture.view(), record));
    prints.push_back({std::move(picture), {}, std::move(bundle)});
  }
  for (std::size_t i = 0; i < prints.size(); ++i) {
    prints[i].other = prints[(i + 1) % prints.size()].picture;
  }
  return prints;
}

}  // namespace

Result<std::vector<BenchRow>> bench_reasons(const PoseBenchOptions& options,
                                            const std::string& only,
                                            const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto photos, load_backgrounds(options.backgrounds, kWidth, kHeight));
  MODAR_ASSIGN(const auto prints, reason_prints(options));
  if (photos.empty() || prints.size() < 2) {
    return fail(ExitCode::kUsage, "bench.input", "", "the bench needs patterns and backgrounds",
                "give folders with two pictures or more");
  }
  std::vector<BenchRow> rows;
  int right = 0;
  int all = 0;
  for (const CauseCase& one : cause_cases()) {
    // Bent paper is hidden from a camera that is known.
    PoseLoopOptions how;
    how.estimate_camera = one.cause != Cause::kCurved;
    if (std::string(one.name).find(only) == std::string::npos) continue;
    std::map<std::string, int> reasons;
    for (int i = 0; i < options.frames; ++i) {
      if (progress) progress(one.name, 1.0 * i / options.frames);
      Random random(options.seed + 7919 * static_cast<std::uint64_t>(i) +
                    1000003 * static_cast<std::uint64_t>(one.cause));
      const ReasonPrint& print = prints[static_cast<std::size_t>(i) % prints.size()];
      MODAR_ASSIGN(const auto bundle, BundleView::open(print.bundle));
      MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, default_camera(kWidth, kHeight), how));
      Reason reason = Reason::kVisible;
      for (int attempt = 0; attempt < kAttempts && reason == Reason::kVisible; ++attempt) {
        const GrayPicture behind = another_view(photos[random.next() % photos.size()], random);
        HiddenView view(print, behind, one.cause, std::min(1.0, (attempt + 1.0) / kHardest), i,
                        random);
        MODAR_ASSIGN(reason, reason_of(*loop, view));
      }
      ++reasons[to_string(reason)];
    }
    for (const auto& [name, count] : reasons) {
      rows.push_back({std::string(one.name) + ": " + name, 1.0 * count, 1.0 * options.frames,
                      ratio(count, options.frames)});
      if (std::find(one.right.begin(), one.right.end(), name) != one.right.end()) right += count;
    }
    all += options.frames;
  }
  rows.push_back({"right", 1.0 * right, 1.0 * all, ratio(right, all)});
  return rows;
}

}  // namespace modar
