// Pictures of each model turning, or of pictures and videos where there is no model: the renderer
// without the AR half.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include "frame_report.hpp"
#include "frame_sink.hpp"
#include "modar/camera.hpp"
#include "modar/renderer.hpp"
#include "pipeline.hpp"
#include "play.hpp"
#include "screen.hpp"

namespace modar {
namespace {

constexpr double kTiltDegrees = 20;  ///< seen from a little above; set by hand

/// The ball round the origin that holds the model's chunks (model space).
double radius_of(const BundleView& bundle, std::uint32_t model) {
  const ModelRecord& record = bundle.models()[model];
  double radius = 1e-3;
  for (std::uint32_t i = 0; i < record.chunk_count; ++i) {
    const ChunkRecord& chunk = bundle.chunks()[record.first_chunk + i];
    glm::dvec3 far_corner(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      far_corner[axis] = std::max(std::abs(static_cast<double>(chunk.bounds_min[axis])),
                                  std::abs(static_cast<double>(chunk.bounds_max[axis])));
    }
    radius = std::max(radius, glm::length(far_corner));
  }
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
};

Subject model_subject(const BundleView& bundle, std::uint32_t model) {
  const Stand stand = stand_of(bundle, model);
  return {bundle.name(bundle.models()[model].name),
          radius_of(bundle, model) * static_cast<double>(stand.record.scale),
          {on_turntable(stand, model, glm::mat4(1.0f))}};
}

/// The pictures of a pattern as they stand there at first, videos with their posters.
Subject pattern_subject(const BundleView& bundle, std::uint32_t pattern) {
  Subject subject{bundle.name(bundle.patterns()[pattern].name), 0, {}};
  add_items(bundle, ActionMachine(bundle), pattern, glm::mat4(1.0f), subject.items);
  for (const DrawItem& item : subject.items) {
    for (const float x : {-1.0f, 1.0f}) {
      for (const float y : {-1.0f, 1.0f}) {
        const glm::vec3 corner(item.to_eye * glm::vec4(x, y, 0.0f, 1.0f));
        subject.radius = std::max(subject.radius, static_cast<double>(glm::length(corner)));
      }
    }
  }
  return subject;
}

std::vector<Subject> subjects_of(const BundleView& bundle) {
  std::vector<Subject> subjects;
  for (std::uint32_t i = 0; i < bundle.models().size(); ++i) {
    subjects.push_back(model_subject(bundle, i));
  }
  if (!subjects.empty()) return subjects;
  for (std::uint32_t i = 0; i < bundle.patterns().size(); ++i) {
    Subject subject = pattern_subject(bundle, i);
    if (!subject.items.empty()) subjects.push_back(std::move(subject));
  }
  return subjects;
}

}  // namespace

Result<void> play_turntable(const PlayOptions& options, const BundleView& bundle) {
  constexpr double kFps = 30;
  const std::vector<Subject> subjects = subjects_of(bundle);
  if (subjects.empty()) {
    return fail(ExitCode::kInvalidInput, "play.no-models", options.bundle,
                "the bundle holds no model, and no picture or video that is shown at first",
                "bake it with --model FILE");
  }
  MODAR_ASSIGN(std::unique_ptr<Screen> screen, Screen::open(bundle, options));
  MODAR_ASSIGN(std::unique_ptr<FrameSink> sink, open_frame_sink(options.out, kFps));
  MODAR_TRY(screen->resize(options.width, options.height));

  const Camera camera = default_camera(options.width, options.height);
  TurntableReport turn;
  turn.pattern = bundle.models().empty();
  FrameReport report;
  for (const Subject& subject : subjects) {
    const double distance = distance_of(camera, subject.radius);
    turn.name = subject.name;
    for (int i = 0; i < options.turntable; ++i) {
      turn.angle_deg = 360.0 * i / options.turntable;
      const glm::mat4 view = turned(turn.angle_deg, distance);
      std::vector<DrawItem> items = subject.items;
      for (DrawItem& item : items) {
        item.to_eye = view * item.to_eye;
        item.world_to_eye = view * item.world_to_eye;
      }
      const std::int64_t before = now_ns();
      screen->draw({}, camera, items);
      const RgbaView picture = screen->picture();
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
    }
  }
  return sink->finish("");
}

}  // namespace modar
