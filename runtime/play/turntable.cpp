// Pictures of each model turning, or of pictures and videos where there is no model: the renderer
// without the AR half.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include "frame_report.hpp"
#include "frame_sink.hpp"
#include "modar/camera.hpp"
#include "modar/renderer.hpp"
#include "pipeline.hpp"
#include "play.hpp"
#include "player.hpp"
#include "screen.hpp"

namespace modar {
namespace {

constexpr double kFps = 30;
constexpr double kTiltDegrees = 20;  ///< seen from a little above, as an object on a table

/// The ball round the origin that holds the model's chunks (model space).
double radius_of(const BundleView& bundle, std::uint32_t model) {
  double radius = 1e-3;
  visit_boxes(bundle, bundle.models()[model], [&](const auto& least, const auto& greatest) {
    glm::dvec3 far_corner(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      far_corner[axis] = std::max(std::abs(static_cast<double>(least[axis])),
                                  std::abs(static_cast<double>(greatest[axis])));
    }
    radius = std::max(radius, glm::length(far_corner));
  });
  return radius;
}

/// Eye distance at which a ball of that radius fills the smaller side of the picture.
double distance_of(const Camera& camera, double radius) {
  const double half_side = 0.5 * std::min(camera.width, camera.height);
  return 1.05 * radius / std::sin(std::atan(half_side / camera.fx));
}

/// A world whose z is up, seen from there.
glm::mat4 turned(double degrees, double distance) {
  const auto radians = [](double value) {
    return static_cast<float>(value * std::numbers::pi / 180.0);
  };
  const glm::mat4 back =
      glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -static_cast<float>(distance)));
  const glm::mat4 tilted = glm::rotate(back, radians(kTiltDegrees - 90), glm::vec3(1, 0, 0));
  return glm::rotate(tilted, radians(degrees), glm::vec3(0, 0, 1));
}

/// The first scene of a model; its own with y up, as most files have it, where it is in none.
struct Stand {
  std::uint32_t scene = kNone;
  SceneRecord record{};
};

Stand stand_of(const BundleView& bundle, std::uint32_t model) {
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    if (bundle.scenes()[s].model == model) return {s, bundle.scenes()[s]};
  }
  Stand upright;
  upright.record.scale = 1.0f;
  upright.record.rotation[0] = upright.record.rotation[3] = std::numbers::sqrt2_v<float> / 2;
  return upright;
}

DrawItem on_turntable(const Stand& stand, std::uint32_t model, const glm::mat4& turn) {
  const float* offset = stand.record.offset;
  const glm::mat4 plane = glm::translate(turn, -glm::vec3(offset[0], offset[1], offset[2]));
  return {model, plane * scene_matrix(stand.record), stand.scene, plane};
}

/// What turns about the origin of its own world.
struct Subject {
  std::string_view name;
  double radius = 0;            ///< of the ball round the origin that holds it
  std::vector<DrawItem> items;  ///< with to_eye and world_to_eye for an eye at the origin
  std::uint32_t clip = kNone;   ///< in which its one item moves
};

Subject model_subject(const BundleView& bundle, std::uint32_t model) {
  const Stand stand = stand_of(bundle, model);
  return {bundle.name(bundle.models()[model].name),
          radius_of(bundle, model) * static_cast<double>(stand.record.scale),
          {on_turntable(stand, model, glm::mat4(1.0f))},
          kNone};
}

/// The first pictures of a pattern, videos with their posters.
Subject pattern_subject(const BundleView& bundle, std::uint32_t pattern) {
  Subject subject{bundle.name(bundle.patterns()[pattern].name), 0, {}, kNone};
  add_items(bundle, ActionMachine(bundle), pattern, subject.items);
  for (const DrawItem& item : subject.items) {
    const glm::mat4& place = item.to_eye;  // of a square from -1 to 1
    const float half = glm::dot(place[0], place[0]) + glm::dot(place[1], place[1]);
    const float radius = glm::length(glm::vec3(place[3])) + std::sqrt(half);
    subject.radius = std::max(subject.radius, static_cast<double>(radius));
  }
  return subject;
}

/// Models, once for each of their clips; of a bundle without models its patterns.
std::vector<Subject> subjects_of(const BundleView& bundle) {
  std::vector<Subject> subjects;
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::size_t before = subjects.size();
    for (std::uint32_t c = 0; c < bundle.clips().size(); ++c) {
      if (bundle.clips()[c].model != m) continue;
      subjects.push_back(model_subject(bundle, m));
      subjects.back().clip = c;
    }
    if (subjects.size() == before) subjects.push_back(model_subject(bundle, m));
  }
  for (std::uint32_t p = 0; bundle.models().empty() && p < bundle.patterns().size(); ++p) {
    Subject subject = pattern_subject(bundle, p);
    if (!subject.items.empty()) subjects.push_back(std::move(subject));
  }
  return subjects;
}

/// Plays on in time, but faster where a turn would end before the clip.
double seconds_of_step(const BundleView& bundle, std::uint32_t clip, int steps) {
  return std::max(1 / kFps, static_cast<double>(bundle.clips()[clip].seconds) / steps);
}

}  // namespace

Result<void> play_turntable(const PlayOptions& options, const BundleView& bundle,
                            const MappedFile& file) {
  const std::vector<Subject> subjects = subjects_of(bundle);
  if (subjects.empty()) {
    return fail(ExitCode::kInvalidInput, "play.no-models", options.bundle,
                "it holds no model, and shows no picture at first", "bake it with --model FILE");
  }
  MODAR_ASSIGN(std::unique_ptr<Screen> screen, Screen::open(bundle, options));
  MODAR_ASSIGN(std::unique_ptr<FrameSink> sink, open_frame_sink(options.out, kFps));
  MODAR_TRY(screen->resize(options.width, options.height));

  const Camera camera = default_camera(options.width, options.height);
  TurntableReport turn;
  turn.pattern = bundle.models().empty();
  FrameReport report;
  catch_interrupts();
  for (const Subject& subject : subjects) {
    const double distance = distance_of(camera, subject.radius);
    turn.name = subject.name;
    turn.clip = subject.clip == kNone ? "" : bundle.name(bundle.clips()[subject.clip].name);
    std::vector<DrawItem> items = subject.items;
    std::optional<ClipPlayer> player;
    double step = 0;
    if (subject.clip != kNone) {
      step = seconds_of_step(bundle, subject.clip, options.turntable);
      player.emplace(bundle, items[0].model).play(subject.clip, true, 0);
      player->pose();
    }
    for (int i = 0; i < options.turntable; ++i) {
      turn.angle_deg = 360.0 * i / options.turntable;
      const glm::mat4 view = turned(turn.angle_deg, distance);
      for (std::size_t k = 0; k < items.size(); ++k) {
        items[k].to_eye = view * subject.items[k].to_eye;
        items[k].world_to_eye = view * subject.items[k].world_to_eye;
        if (player) items[k].bones = player->bones().data();
      }
      const std::int64_t before = now_ns();
      screen->draw({}, camera, items);
      const RgbaView picture = screen->picture();
      MODAR_TRY(file.intact());
      if (was_interrupted()) {
        return fail(ExitCode::kIo, "play.interrupted", options.out,
                    "the run was interrupted after frame " + std::to_string(turn.frame),
                    "start it again");
      }
      turn.render_ms = ms_since(before);
      turn.triangles = screen->stats().triangles;
      turn.draw_calls = screen->stats().draw_calls;
      report.frame = turn.frame;
      report.time_s = static_cast<double>(turn.frame) / kFps;
      MODAR_TRY(sink->picture(picture, report));
      if (options.json) {
        MODAR_TRY(print_line(turntable_line(turn)));
      }
      ++turn.frame;
      if (!player) continue;
      player->advance(step);
      player->pose();
    }
  }
  return sink->finish("");
}

}  // namespace modar
