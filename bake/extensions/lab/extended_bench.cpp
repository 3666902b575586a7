// Drives the pose loop over rendered rooms and compares what it says of a pattern that is not seen
// with the truth.
#include "bake/extensions/lab/extended_bench.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "bake/extensions/lab/room_scene.hpp"
#include "bake/process/thread_clock.hpp"
#include "bake/video/video.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

using std::numbers::pi;

constexpr double kFrameRate = 30;
constexpr double kSeen = 4.0;    // seconds in which the pattern is seen, first and last
constexpr double kUnseen = 5.0;  // seconds in between
constexpr double kLength = 2 * kSeen + kUnseen - 2;

enum class Scene : std::uint8_t {
  kTurned,
  kCovered,
  kPasserBy,
  kFilled,
  kTurnedFilled,
  kPartly,
  kCarried
};
struct SceneName {
  Scene scene;
  const char* name;
};
constexpr SceneName kScenes[] = {{Scene::kTurned, "turned"},
                                 {Scene::kCovered, "covered"},
                                 {Scene::kPasserBy, "passer-by"},
                                 {Scene::kFilled, "filled by passer-by"},
                                 {Scene::kTurnedFilled, "filled by passer-by while turned"},
                                 {Scene::kPartly, "partly covered"},
                                 {Scene::kCarried, "carried"}};

/// 0 before `from`, 1 after `to`, smooth in between.
double ramp(double time, double from, double to) {
  const double t = std::clamp((time - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A hand-held camera in the room: its place looks at the pattern, sways, and turns away and back.
Pose camera_at(Scene scene, double time, const std::array<double, 8>& phase) {
  const auto wave = [&](std::size_t i, double hertz) {
    return std::sin(2 * pi * (hertz * time + phase[i]));
  };
  const bool still = scene == Scene::kCarried;
  const double sway = still ? 0.0 : 1.0;
  glm::dvec3 centre{sway * (0.7 * wave(0, 0.21) + 0.03 * wave(1, 1.3)),
                    sway * (0.35 * wave(2, 0.27) + 0.03 * wave(3, 1.1)),
                    4.6 + sway * 0.25 * wave(4, 0.18)};
  double yaw = sway * 0.02 * wave(5, 0.9);
  double pitch = sway * 0.02 * wave(6, 0.7);
  if (scene == Scene::kTurned || scene == Scene::kTurnedFilled) {
    const double away = ramp(time, kSeen - 0.4, kSeen + 1.8) -
                        ramp(time, kSeen + kUnseen - 1.8, kSeen + kUnseen + 0.4);
    yaw += away * pi / 3;
    centre.x += away;  // half a pattern's width
  }
  // Looks along -z of the world, y up; camera axes have y down and z forward.
  const glm::dmat3 upright{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  Pose pose;
  pose.rotation = rotation_matrix({pitch, 0, 0}) * rotation_matrix({0, -yaw, 0}) * upright;
  pose.translation = -(pose.rotation * centre);
  return pose;
}

/// Everything of one sequence that does not change from frame to frame.
struct Sequence {
  Scene scene;
  const Mipmap& pattern;
  const std::vector<Mipmap>& pictures;
  Camera camera;
  std::vector<Board> room;
  std::array<double, 8> phase{};

  [[nodiscard]] bool hidden(double time) const {
    return scene != Scene::kPartly && time > kSeen && time < kSeen + kUnseen;
  }

  /// Where the pattern is in the room.
  [[nodiscard]] Pose placed(double time) const {
    if (scene != Scene::kCarried) return {};
    return {rotation_matrix({0.0, 0.1 * std::sin(time), 0.0}),
            {0.9 * std::sin(1.4 * time), 0.3 * std::sin(1.9 * time), 0.4 + 0.3 * std::sin(time)}};
  }

  /// Someone who passes between the camera and all else, `gone` seconds after the pattern was
  /// hidden: at any speed, near or further away, narrower than the frame or much wider.
  [[nodiscard]] Board filling_passer_by(double gone) const {
    Pose eye = camera_at(scene, kSeen + 0.5 * kUnseen, phase);
    if (scene == Scene::kFilled) eye.rotation = glm::dmat3{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    const glm::dmat3 axes = glm::transpose(eye.rotation);
    const glm::dvec3 centre = -(axes * eye.translation);
    const double away = 1.2 + 1.6 * phase[6];
    const double wide = away * (0.9 + 1.3 * phase[7]);
    const double speed = away * (0.4 + 1.4 * phase[5]);
    const double x = speed * (gone - 0.5 * kUnseen) - 0.5 * wide;
    return {centre + axes * glm::dvec3(x, -1.5 * away, away), axes * glm::dvec3(wide, 0, 0.15),
            axes * glm::dvec3(0, 3.0 * away, 0), &pictures[2 % pictures.size()], 1};
  }

  [[nodiscard]] GrayPicture frame(double time, Random& random) const {
    std::vector<Board> boards = room;
    const Pose pose = camera_at(scene, time, phase);
    boards.push_back(board_of(pattern, placed(time)));
    const double gone = time - kSeen;
    if (hidden(time) && (scene == Scene::kFilled || scene == Scene::kTurnedFilled)) {
      boards.push_back(filling_passer_by(gone));
    } else if (scene == Scene::kPartly) {
      // Something slides to and fro over up to 65 % of it, from below right.
      const double slide = 1.15 - 0.65 * (1 - std::cos(2 * pi * time / 3.0));
      boards.push_back({{slide, 0.75 - 0.3 * std::sin(0.7 * time), 0.1},
                        {2.3, 0.2, 0.1},
                        {-0.1, -2.5, 0.1},
                        &pictures[1 % pictures.size()],
                        1});
    } else if (hidden(time) && scene != Scene::kTurned) {
      // Something slides before the pattern, half way to the camera, and away again.
      const double slide =
          4.0 * (1 - ramp(gone, -0.1, 0.5) + ramp(gone, kUnseen - 0.5, kUnseen + 0.1));
      const glm::dvec3 at = placed(kSeen + 0.5 * kUnseen).translation;
      boards.push_back({{at.x - 1.15 + slide, at.y + 0.95, at.z + 0.3},
                        {2.3, 0, 0.1},
                        {0, -1.9, 0},
                        &pictures[1 % pictures.size()],
                        1});
    }
    if (scene == Scene::kPasserBy && hidden(time)) {
      const double x = -7 + 14 * gone / kUnseen;
      boards.push_back(
          {{x - 0.5, 1.6, 1.2}, {1.0, 0, 0.2}, {0, -4.0, 0}, &pictures[2 % pictures.size()], 1});
    }
    return render_room(boards, camera, pose, 2.0, random);
  }
};

/// Sums of one row.
struct Sums {
  ExtendedRow row;
  std::vector<double> positions;
  std::vector<double> rotations;
  std::vector<double> seen_px;
  std::vector<double> direct_px;
  int honest = 0;
  double seconds = 0;
  int timed = 0;
};

std::array<glm::dvec2, 4> corners_of(const Mipmap& pattern, const Camera& camera,
                                     const Pose& pose) {
  std::array<glm::dvec2, 4> out;
  const auto flat = pattern_corners(pattern[0].width, pattern[0].height);
  for (std::size_t i = 0; i < 4; ++i) {
    out[i] = project(camera, pose.rotation * glm::dvec3(flat[i], 0.0) + pose.translation);
  }
  return out;
}

void judge(const Detection& seen, const Pose& truth, Sums& sums) {
  const double distance = glm::length(truth.translation);
  const double position = glm::length(seen.pose.translation - truth.translation);
  const double rotation =
      glm::length(rotation_vector(seen.pose.rotation * glm::transpose(truth.rotation)));
  sums.positions.push_back(100 * position / distance);
  sums.rotations.push_back(rotation * 180 / pi);
  sums.honest += position <= 2 * seen.position_sigma && rotation <= 2 * seen.rotation_sigma ? 1 : 0;
}

/// Greatest difference of the ways of the corners, seen and true, between two frames, of those that
/// the frame shows.
double jump_of(const std::array<glm::dvec2, 4>& seen, const std::array<glm::dvec2, 4>& seen_before,
               const std::array<glm::dvec2, 4>& truth,
               const std::array<glm::dvec2, 4>& truth_before, const Camera& camera) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 p = truth[i];
    if (p.x < 0 || p.y < 0 || p.x > camera.width || p.y > camera.height) continue;
    most = std::max(most, glm::length((seen[i] - seen_before[i]) - (truth[i] - truth_before[i])));
  }
  return most;
}

Result<void> run(const Sequence& sequence, std::span<const std::byte> bundle, bool gyroscope,
                 Random& random, Sums& sums) {
  PoseLoopOptions how;
  how.extended = true;
  MODAR_ASSIGN(const auto loop,
               PoseLoop::create(BundleView::open(bundle).value(), sequence.camera, how));
  MODAR_ASSIGN(const auto plain,
               PoseLoop::create(BundleView::open(bundle).value(), sequence.camera));
  std::optional<Pose> last;
  std::optional<std::array<glm::dvec2, 4>> seen_before;
  std::array<glm::dvec2, 4> truth_before{};
  TrackResult result;
  for (int i = 0; i < static_cast<int>(kLength * kFrameRate); ++i) {
    const double time = i / kFrameRate;
    const GrayPicture frame = sequence.frame(time, random);
    const Pose eye = camera_at(sequence.scene, time, sequence.phase);
    const Pose placed = sequence.placed(time);
    const Pose truth{eye.rotation * placed.rotation,
                     eye.rotation * placed.translation + eye.translation};
    if (gyroscope && last.has_value()) {
      // 0.02 degrees of noise in a frame.
      glm::dvec3 turn = -rotation_vector(eye.rotation * glm::transpose(last->rotation));
      for (int k = 0; k < 3; ++k) turn[k] += 0.02 * pi / 180 * random.normal();
      loop->set_turn(turn);
    }
    last = eye;
    const double start = thread_seconds();
    MODAR_TRY(loop->step(frame.view(), result));
    const double took = thread_seconds() - start;
    const Detection* seen = result.visible.empty() ? nullptr : &result.visible[0];
    const auto corners = corners_of(sequence.pattern, sequence.camera, truth);
    MODAR_ASSIGN(const auto direct, plain->step(frame.view()));
    if (!direct.visible.empty() && seen != nullptr) {
      sums.seen_px.push_back(corner_error(*seen, {true, corners}));
      sums.direct_px.push_back(corner_error(direct.visible[0], {true, corners}));
    }
    if (sequence.hidden(time)) {
      ++sums.row.unseen;
      if (seen != nullptr && seen->extended) {
        ++sums.row.followed;
        judge(*seen, truth, sums);
        sums.seconds += took;
        ++sums.timed;
      }
    }
    if (seen != nullptr && seen_before.has_value() && time > kSeen + kUnseen - 1.0) {
      sums.row.jump_px = std::max(sums.row.jump_px, jump_of(seen->corners, *seen_before, corners,
                                                            truth_before, sequence.camera));
    }
    if (seen != nullptr) {
      seen_before = seen->corners;
    } else {
      seen_before.reset();
    }
    truth_before = corners;
  }
  return {};
}

double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

ExtendedRow finish(Sums& sums) {
  ExtendedRow row = sums.row;
  row.worst_position_pct = percentile(sums.positions, 1.0);
  row.worst_rotation_deg = percentile(sums.rotations, 1.0);
  row.position_pct = percentile(sums.positions, 0.95);
  row.rotation_deg = percentile(sums.rotations, 0.95);
  row.seen_px = percentile(sums.seen_px, 0.95);
  row.direct_px = percentile(sums.direct_px, 0.95);
  if (row.followed > 0) row.honest_pct = 100.0 * sums.honest / row.followed;
  if (sums.timed > 0) row.ms = 1e3 * sums.seconds / sums.timed;
  return row;
}

/// Gray over the outline, a sixth larger than that, so that nothing of the pattern shows.
void blank(const std::array<glm::dvec2, 4>& corners, GrayPicture& frame) {
  constexpr double kLarger = 7.0 / 6;
  const glm::dvec2 middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const glm::dvec2 at = middle + (glm::dvec2(x, y) - middle) / kLarger;
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec2 side = corners[(i + 1) % 4] - corners[i];
        const glm::dvec2 way = at - corners[i];
        inside = inside && side.x * way.y - side.y * way.x > 0;
      }
      if (inside) frame.pixels[static_cast<std::size_t>(y * frame.width + x)] = 128;
    }
  }
}

/// What the loop says of each frame, and the time that it took.
Result<std::vector<std::optional<Detection>>> play(std::span<const GrayPicture> frames,
                                                   std::span<const std::byte> bundle, bool extended,
                                                   std::vector<double>& seconds) {
  PoseLoopOptions how;
  how.extended = extended;
  MODAR_ASSIGN(const auto loop,
               PoseLoop::create(BundleView::open(bundle).value(),
                                default_camera(frames[0].width, frames[0].height), how));
  std::vector<std::optional<Detection>> all;
  TrackResult result;
  for (const GrayPicture& frame : frames) {
    const double start = thread_seconds();
    MODAR_TRY(loop->step(frame.view(), result));
    seconds.push_back(thread_seconds() - start);
    all.emplace_back();
    if (!result.visible.empty()) all.back() = result.visible[0];
  }
  return all;
}

}  // namespace

Result<ExtendedRow> bench_extended_video(const VideoBench& video) {
  MODAR_ASSIGN(Video played, Video::open(video.video));
  std::vector<GrayPicture> frames;
  while (const auto picture = played.next()) {
    frames.push_back({picture->width, picture->height, {}});
    for (int y = 0; y < picture->height; ++y) {
      const std::uint8_t* row = picture->pixels + y * picture->stride;
      frames.back().pixels.insert(frames.back().pixels.end(), row, row + picture->width);
    }
  }
  if (frames.empty()) {
    return fail(ExitCode::kIo, "bench.video", video.video, "the video cannot be read",
                "give a video that other players show");
  }
  const auto beside = std::filesystem::path(video.video).parent_path() / "pattern.png";
  bool shrunk = false;
  MODAR_ASSIGN(const auto picture,
               load_pattern(video.pattern.empty() ? beside.string() : video.pattern, shrunk));
  MODAR_ASSIGN(const auto bundle, bundle_of_pattern(picture.view(), {}));
  std::vector<double> seconds;
  MODAR_ASSIGN(const auto truth, play(frames, bundle, false, seconds));
  const std::size_t third = frames.size() / 3;
  for (std::size_t i = third; i < 2 * third; ++i) {
    if (truth[i].has_value()) blank(truth[i]->corners, frames[i]);
  }
  seconds.clear();
  MODAR_ASSIGN(const auto seen, play(frames, bundle, true, seconds));
  Sums sums;
  sums.row.scene = std::filesystem::path(video.video).filename().string();
  for (std::size_t i = third; i < 2 * third; ++i) {
    if (!truth[i].has_value()) continue;
    ++sums.row.unseen;
    if (!seen[i].has_value() || !seen[i]->extended) continue;
    ++sums.row.followed;
    judge(*seen[i], truth[i]->pose, sums);
    sums.seconds += seconds[i];
    ++sums.timed;
  }
  return finish(sums);
}

Result<std::vector<ExtendedRow>> bench_extended(const PoseBenchOptions& options,
                                                const std::string& only,
                                                const ProgressCallback& progress) {
  std::vector<Mipmap> photos;
  for (const std::string& path : options.backgrounds) {
    MODAR_ASSIGN(auto photo, load_background(path, options.width, options.height));
    photos.push_back(make_mipmap(std::move(photo)));
  }
  std::vector<ExtendedRow> rows;
  for (const SceneName& scene : kScenes) {
    for (const bool gyroscope : {false, true}) {
      Sums sums;
      sums.row.scene = std::string(scene.name) + (gyroscope ? " gyroscope" : "");
      sums.row.gyroscope = gyroscope;
      if (sums.row.scene.find(only) == std::string::npos) continue;
      for (std::size_t i = 0; i < options.patterns.size(); ++i) {
        if (progress)
          progress(sums.row.scene,
                   1.0 * static_cast<double>(i) / static_cast<double>(options.patterns.size()));
        bool shrunk = false;
        MODAR_ASSIGN(auto picture, load_pattern(options.patterns[i], shrunk));
        MODAR_ASSIGN(const auto bundle, bundle_of_pattern(picture.view(), {}));
        const Mipmap pattern = make_mipmap(std::move(picture));
        Random random(options.seed + i);
        Sequence sequence{scene.scene,
                          pattern,
                          photos,
                          default_camera(options.width, options.height),
                          make_room(photos, random),
                          {}};
        for (double& phase : sequence.phase) phase = random.uniform(0, 1);
        MODAR_TRY(run(sequence, bundle, gyroscope, random, sums));
      }
      rows.push_back(finish(sums));
    }
  }
  return rows;
}

}  // namespace modar
