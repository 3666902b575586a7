// Plays clips, judges the shown poses, and makes rows of them.
#include "bake/extensions/lab/wild_bench.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>

#include <glm/geometric.hpp>
#include <opencv2/core.hpp>

#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/feature_peer.hpp"
#include "bake/extensions/lab/wild_clips.hpp"
#include "formats/bundle_view.hpp"
#include "modar/features.hpp"
#include "modar/paper_tracker.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr double kCommonSide = 640;  // pixels: errors are given in those of such a frame
constexpr double kNear = 5;          // pixels: thresholds of POT-210 and PlanarTrack
constexpr double kFar = 15;

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return kNoFigure;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// The outline by pose and camera.
Corners outline(const GrayImage& picture, const Camera& camera, const Pose& pose,
                const glm::dmat4x3& stretch = glm::dmat4x3(1.0)) {
  Corners corners;
  const auto flat = pattern_corners(picture.width, picture.height);
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec3 drawn = stretch * glm::dvec4(flat[i], 0.0, 1.0);
    corners[i] = project(camera, pose.rotation * drawn + pose.translation);
  }
  return corners;
}

/// What one method showed of one clip.
struct WildTally {
  std::string method;  ///< "ours", "sift", "orb", "paper"
  int judged = 0;
  int near = 0;  ///< within kNear
  int far = 0;
  std::vector<double> errors{};        ///< of the frames in which it is shown
  std::vector<double> pose_errors{};   ///< the same, of the pose
  std::vector<double> drawn_errors{};  ///< and of the pose and its stretch
  std::map<std::string, int> hidden{};
  double frames = 0;  ///< all, judged or not: ours alone
  double shown = 0;   ///< of these

  /// scale: from the frame's pixels to those of a common one.
  void judge(const TrackResult& seen, const Corners& truth, double scale) {
    ++judged;
    if (seen.visible.empty()) {
      ++hidden[to_string(seen.reason)];
      return;
    }
    const Detection& shown_one = seen.visible[0];
    double square = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec2 miss = shown_one.corners[i] - truth[i];
      square += 0.25 * glm::dot(miss, miss);
    }
    near += std::sqrt(square) <= kNear ? 1 : 0;
    far += std::sqrt(square) <= kFar ? 1 : 0;
    errors.push_back(scale * corner_error(shown_one, {true, truth}));
  }
  [[nodiscard]] double shown_pct() const {
    return ratio(100.0 * static_cast<double>(errors.size()), judged);
  }
};

using Step = std::function<Result<TrackResult>(const GrayImage&)>;

/// Methods compared with ours on one pattern; their tallies come after ours.
struct Peers {
  std::vector<Step> steps;
  std::unique_ptr<FeaturePeer> sift;
  std::unique_ptr<FeaturePeer> orb;
  std::unique_ptr<PaperTracker> paper;
};

/// One pattern's clip, played.
struct Played {
  std::string name;
  bool published = false;
  std::vector<WildTally> tallies;  ///< ours first
  WildTally extended{"extended"};  ///< ours with PoseLoopOptions::extended
};

Result<Peers> make_peers(const GrayImage& picture, const BundleView& bundle, const Camera& camera,
                         std::uint32_t paper_set, std::vector<WildTally>& tallies) {
  Peers peers;
  if (paper_set == 0) return peers;
  peers.sift = FeaturePeer::create(picture, PeerMethod::kSiftRansac);
  peers.orb = FeaturePeer::create(picture, PeerMethod::kOrbRansac);
  MODAR_ASSIGN(peers.paper, PaperTracker::create(bundle, paper_set, camera));
  peers.steps = {[&peer = *peers.sift](const GrayImage& frame) { return peer.step(frame); },
                 [&peer = *peers.orb](const GrayImage& frame) { return peer.step(frame); },
                 [&peer = *peers.paper](const GrayImage& frame) { return peer.step(frame); }};
  for (const char* name : {"sift", "orb", "paper"}) tallies.push_back({name});
  return peers;
}

/// The pictures' bundle; paper_set: of the features compared with the records, 0: none.
Result<std::vector<std::byte>> bundle_of(const std::vector<GrayPicture>& pictures,
                                         const TrackerRecordOptions& bake,
                                         std::uint32_t paper_set) {
  std::vector<std::vector<std::byte>> records;
  for (const GrayPicture& picture : pictures) {
    MODAR_ASSIGN(records.emplace_back(), make_tracker_record(picture.view(), bake));
  }
  const ParameterSetRecord* set = nullptr;
  const auto sets = paper_parameter_sets();
  for (const ParameterSetRecord& each : sets) set = each.id == paper_set ? &each : set;
  return bundle_of_records(pictures, records, set);
}

/// The picture of what the first frame with a truth shows.
Result<GrayPicture> cut_out(const WildClip& clip) {
  MODAR_ASSIGN(ClipFrames frames, ClipFrames::open(clip.frames));
  std::optional<GrayImage> frame;
  for (std::uint64_t i = 0; i <= clip.truth.begin()->first; ++i) {
    MODAR_ASSIGN(frame, frames.next());
    if (!frame) {
      return fail(ExitCode::kInvalidInput, "bench.wild", clip.frames,
                  "it ends before the first frame with a truth", "give the whole clip");
    }
  }
  RgbaImage photo;
  photo.width = static_cast<std::uint32_t>(frame->width);
  photo.height = static_cast<std::uint32_t>(frame->height);
  for (int y = 0; y < frame->height; ++y) {
    const std::uint8_t* row = frame->pixels + static_cast<std::ptrdiff_t>(y) * frame->stride;
    for (int x = 0; x < frame->width; ++x) {
      photo.pixels.insert(photo.pixels.end(), {row[x], row[x], row[x], 255});
    }
  }
  RectifyOptions how;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 corner = clip.truth.begin()->second[i];
    how.corners[i] = {corner.x, corner.y};
  }
  auto cut = rectify(photo, how);
  if (!cut) {
    cut.error().where = clip.name;
    return tl::unexpected(cut.error());
  }
  return gray_of(cut->image);
}

/// A loop as people get it who set nothing.
Result<std::unique_ptr<PoseLoop>> default_loop(const BundleView& bundle, const Camera& camera,
                                               bool extended) {
  PoseLoopOptions how;
  how.estimate_camera = true;
  how.extended = extended;
  return PoseLoop::create(bundle, camera, how);
}

/// Plays one clip for one of its pictures.
Result<Played> play(const WildClip& clip, const GrayPicture& picture, const std::string& name,
                    const WildBenchOptions& options) {
  Played out{name, clip.published, {{"ours"}}};
  MODAR_ASSIGN(const auto bytes, bundle_of({picture}, options.bake, options.paper_set));
  MODAR_ASSIGN(const auto bundle, BundleView::open(bytes));
  MODAR_ASSIGN(ClipFrames frames, ClipFrames::open(clip.frames));
  std::unique_ptr<PoseLoop> loop;
  std::unique_ptr<PoseLoop> extended;
  Camera camera;
  Peers peers;
  TrackResult seen;
  TrackResult seen_extended;
  for (std::uint64_t i = 0;; ++i) {
    MODAR_ASSIGN(const auto frame, frames.next());
    if (!frame) break;
    if (!loop) {
      camera = default_camera(frame->width, frame->height);
      MODAR_ASSIGN(loop, default_loop(bundle, camera, false));
      MODAR_ASSIGN(extended, default_loop(bundle, camera, true));
      MODAR_ASSIGN(peers,
                   make_peers(picture.view(), bundle, camera, options.paper_set, out.tallies));
    }
    MODAR_TRY(loop->step(*frame, seen));
    MODAR_TRY(extended->step(*frame, seen_extended));
    ++out.tallies[0].frames;
    out.tallies[0].shown += seen.visible.empty() ? 0 : 1;
    const auto truth = clip.truth.find(i);
    if (truth == clip.truth.end() || (clip.published && truth == clip.truth.begin())) continue;
    const double scale = kCommonSide / std::max(frame->width, frame->height);
    out.tallies[0].judge(seen, truth->second, scale);
    out.extended.judge(seen_extended, truth->second, scale);
    if (!seen.visible.empty()) {
      Detection by_pose = seen.visible[0];
      camera.fx = camera.fy = seen.camera.focal;
      by_pose.corners = outline(picture.view(), camera, by_pose.pose);
      out.tallies[0].pose_errors.push_back(scale * corner_error(by_pose, {true, truth->second}));
      by_pose.corners = outline(picture.view(), camera, by_pose.pose, by_pose.stretch);
      out.tallies[0].drawn_errors.push_back(scale * corner_error(by_pose, {true, truth->second}));
    }
    for (std::size_t k = 0; k < peers.steps.size(); ++k) {
      MODAR_ASSIGN(const auto theirs, peers.steps[k](*frame));
      out.tallies[k + 1].judge(theirs, truth->second, scale);
    }
  }
  return out;
}

/// Frames of a clip that shows none of the pictures in which one is recognised, and all.
Result<BenchRow> play_without(const WildClip& clip, const std::vector<GrayPicture>& pictures,
                              const TrackerRecordOptions& bake) {
  MODAR_ASSIGN(const auto bytes, bundle_of(pictures, bake, 0));
  MODAR_ASSIGN(const auto bundle, BundleView::open(bytes));
  MODAR_ASSIGN(ClipFrames frames, ClipFrames::open(clip.frames));
  std::unique_ptr<PoseLoop> loop;
  TrackResult seen;
  double wrong = 0;
  double all = 0;
  for (;; ++all) {
    MODAR_ASSIGN(const auto frame, frames.next());
    if (!frame) break;
    if (!loop) {
      MODAR_ASSIGN(loop, default_loop(bundle, default_camera(frame->width, frame->height), false));
    }
    MODAR_TRY(loop->step(*frame, seen));
    wrong += seen.visible.empty() ? 0 : 1;
  }
  return BenchRow{"false_frames " + clip.name, wrong, all, ratio(wrong, all)};
}

/// Rows of one figure: ours alone, or compared with each of the others.
template <class Figure>
void add_beside(const Played& played, const std::string& what, const Figure& figure,
                std::vector<BenchRow>& rows) {
  const double ours = figure(played.tallies[0]);
  const std::string measure = what + " " + played.name;
  if (played.tallies.size() == 1) rows.push_back({measure, ours, kNoFigure, kNoFigure});
  for (std::size_t k = 1; k < played.tallies.size(); ++k) {
    const double theirs = figure(played.tallies[k]);
    rows.push_back(
        {measure + " with " + played.tallies[k].method, ours, theirs, ratio(ours, theirs)});
  }
}

void add_rows_of(const Played& played, std::vector<BenchRow>& rows) {
  const auto shown_pct = [](const WildTally& of) { return of.shown_pct(); };
  const auto median = [](const WildTally& of) { return percentile(of.errors, 0.5); };
  const auto p95 = [](const WildTally& of) { return percentile(of.errors, 0.95); };
  const WildTally& ours = played.tallies[0];
  add_beside(played, "shown_pct", shown_pct, rows);
  rows.push_back(
      {"shown_frames " + played.name, ours.shown, ours.frames, ratio(ours.shown, ours.frames)});
  add_beside(played, "error_px", median, rows);
  add_beside(played, "p95_px", p95, rows);
  const auto alone = [&](const std::string& what, double value) {
    rows.push_back({what + " " + played.name, value, kNoFigure, kNoFigure});
  };
  alone("pose_px", percentile(ours.pose_errors, 0.5));
  alone("pose_p95_px", percentile(ours.pose_errors, 0.95));
  alone("drawn_px", percentile(ours.drawn_errors, 0.5));
  alone("drawn_p95_px", percentile(ours.drawn_errors, 0.95));
  const auto with_extended = [&](const std::string& what, auto&& figure) {
    const double with = figure(played.extended);
    const double without = figure(ours);
    rows.push_back({"extended " + what + " " + played.name, with, without, ratio(with, without)});
  };
  with_extended("shown_pct", shown_pct);
  with_extended("p95_px", p95);
  for (const auto& [reason, count] : ours.hidden) alone("hidden " + reason, count);
  if (!played.published) return;
  add_beside(
      played, "P@5", [](const WildTally& of) { return ratio(100.0 * of.near, of.judged); }, rows);
  add_beside(
      played, "P@15", [](const WildTally& of) { return ratio(100.0 * of.far, of.judged); }, rows);
}

/// Means over the published clips, as their tables have them.
void add_means(const std::vector<Played>& all, std::vector<BenchRow>& rows) {
  Played mean{"all published clips", true, {}};
  for (const char* what : {"P@5", "P@15"}) {
    std::vector<double> sums;
    double clips = 0;
    for (const Played& one : all) {
      if (!one.published) continue;
      ++clips;
      sums.resize(one.tallies.size());
      for (std::size_t k = 0; k < sums.size(); ++k) {
        const WildTally& of = one.tallies[k];
        sums[k] += 100.0 * (what == std::string("P@5") ? of.near : of.far) / std::max(of.judged, 1);
      }
      mean.tallies = one.tallies;
    }
    if (clips == 0) return;
    add_beside(
        mean, what,
        [&](const WildTally& of) {
          std::size_t k = 0;
          while (mean.tallies[k].method != of.method) ++k;
          return sums[k] / clips;
        },
        rows);
  }
}

Result<std::vector<GrayPicture>> load_all(const std::vector<std::string>& paths) {
  std::vector<GrayPicture> pictures;
  for (const std::string& path : paths) {
    bool shrunk = false;
    MODAR_ASSIGN(auto picture, load_pattern(path, shrunk));
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

}  // namespace

Result<std::vector<BenchRow>> bench_wild(const WildBenchOptions& options,
                                         const ProgressCallback& progress) {
  cv::setNumThreads(1);
  MODAR_ASSIGN(auto clips, find_wild_clips(options.folder));
  std::erase_if(clips, [&](const WildClip& clip) {
    return clip.name.find(options.only) == std::string::npos;
  });
  std::vector<BenchRow> rows;
  std::vector<Played> all;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const WildClip& clip = clips[i];
    if (progress)
      progress(clip.name, 1.0 * static_cast<double>(i) / static_cast<double>(clips.size()));
    std::vector<std::string> names = clip.pictures;
    if (clip.truth.empty()) {
      names.insert(names.end(), options.more_patterns.begin(), options.more_patterns.end());
    }
    MODAR_ASSIGN(const auto pictures, load_all(names));
    if (clip.truth.empty()) {
      if (pictures.empty()) continue;
      MODAR_ASSIGN(rows.emplace_back(), play_without(clip, pictures, options.bake));
    } else if (pictures.empty()) {
      MODAR_ASSIGN(const GrayPicture cut, cut_out(clip));
      MODAR_ASSIGN(all.emplace_back(), play(clip, cut, clip.name, options));
      add_rows_of(all.back(), rows);
    }
    for (std::size_t k = 0; k < pictures.size() && !clip.truth.empty(); ++k) {
      const std::string name = std::filesystem::path(names[k]).stem().string();
      MODAR_ASSIGN(all.emplace_back(), play(clip, pictures[k], name, options));
      add_rows_of(all.back(), rows);
    }
  }
  add_means(all, rows);
  return rows;
}

}  // namespace modar
