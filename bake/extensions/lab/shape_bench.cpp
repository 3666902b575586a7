// Rendered frames of curved patterns.
#include "bake/extensions/lab/shape_bench.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <glm/geometric.hpp>

#include "bake/pattern/box_edges.hpp"
#include "bake/process/thread_clock.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

using std::numbers::pi;

struct BenchShape {
  const char* name;
  ShapeRequest request;
  bool cropped = false;  ///< by someone whose hand was unsteady; see crop_roughly()
};

std::vector<BenchShape> bench_shapes_of() {
  ShapeRequest cylinder{ShapeRequest::Kind::kCylinder, 66, 66, 120, {}, {}, "cylinder"};
  // Of a square picture, the side leans by 8 degrees.
  ShapeRequest cone{ShapeRequest::Kind::kCone, 76, 56, 120, {}, {}, "cone"};
  ShapeRequest box;
  box.kind = ShapeRequest::Kind::kBox;
  box.box_mm = {120, 150, 80};
  return {{"cylinder", cylinder}, {"cone", cone}, {"box", box}, {"roughly cut box", box, true}};
}

/// A pattern on a shape, as a device has it.
struct ShapedPattern {
  GrayPicture picture;
  GrayPicture print;  ///< what frames show; the picture, unless that was cropped
  std::vector<std::byte> section;
  PatternSurface surface;
  std::vector<std::byte> record;
  std::vector<std::byte> bytes;
  std::unique_ptr<PoseLoop> loop;

  [[nodiscard]] Result<void> open(const Camera& camera, bool track) {
    MODAR_ASSIGN(const auto bundle, BundleView::open(bytes));
    PoseLoopOptions how;
    how.track = track;
    MODAR_ASSIGN(loop, PoseLoop::create(bundle, camera, how));
    return {};
  }
};

/// The middle of a picture with the proportions of a side of a box.
GrayPicture cut_to(const GrayPicture& picture, double width, double height) {
  GrayPicture out;
  out.width = std::min(picture.width, static_cast<int>(picture.height * width / height));
  out.height = std::min(picture.height, static_cast<int>(picture.width * height / width));
  const int left = (picture.width - out.width) / 2;
  const int top = (picture.height - out.height) / 2;
  for (int y = top; y < top + out.height; ++y) {
    const auto row = picture.pixels.begin() + std::ptrdiff_t{y} * picture.width + left;
    out.pixels.insert(out.pixels.end(), row, row + out.width);
  }
  return out;
}

/// Lets a photo run over the edges of a box's sides, as bands and borders of cartons do: at an edge
/// it is all that shows, from kBand of a side's length inwards nothing of it does. The place of a
/// point of the box in the photo depends on its place in space, so that sides which share an
/// edge show the same there.
void run_around(const GrayPicture& photo, const std::array<double, 3>& box_mm,
                std::array<GrayPicture, 6>& sides) {
  constexpr double kBand = 0.12;
  const auto [w, h, d] = box_mm;
  const glm::dvec3 corners[] = {{0, 0, 0}, {w, 0, 0}, {w, 0, d}, {0, 0, d}, {0, 0, d}, {0, h, 0}};
  const glm::dvec3 rights[] = {{w, 0, 0}, {0, 0, d}, {-w, 0, 0}, {0, 0, -d}, {w, 0, 0}, {w, 0, 0}};
  const glm::dvec3 downs[] = {{0, h, 0}, {0, h, 0}, {0, h, 0}, {0, h, 0}, {0, 0, -d}, {0, 0, d}};
  const double whole = w + h + d;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    GrayPicture& side = sides[i];
    for (int y = 0; y < side.height; ++y) {
      for (int x = 0; x < side.width; ++x) {
        const double u = (x + 0.5) / side.width;
        const double v = (y + 0.5) / side.height;
        const double inside = std::min({u, v, 1 - u, 1 - v}) / kBand;
        if (inside >= 1) continue;
        const glm::dvec3 p = corners[i] + u * rights[i] + v * downs[i];
        const double across = (p.x + 0.7 * p.y + 0.4 * p.z) / whole;
        const double down = (0.3 * p.x + 0.8 * p.y + p.z) / whole;
        const auto at = static_cast<std::size_t>(down * (photo.height - 1)) *
                            static_cast<std::size_t>(photo.width) +
                        static_cast<std::size_t>(across * (photo.width - 1));
        std::uint8_t& pixel = side.pixels[static_cast<std::size_t>(y * side.width + x)];
        pixel = static_cast<std::uint8_t>(inside * pixel + (1 - inside) * photo.pixels[at]);
      }
    }
  }
}

/// A side of a box cut from its photo with each edge 3 to 10 pixels too far in or out; pixels
/// beyond the side are grey.
GrayPicture crop_roughly(const GrayPicture& side, Random& random) {
  const auto off = [&] {
    const double pixels = random.uniform(3, 10);
    return static_cast<int>(std::lround(random.uniform(-1, 1) < 0 ? -pixels : pixels));
  };
  const int left = off();
  const int top = off();
  GrayPicture out{side.width - left + off(), side.height - top + off(), {}};
  for (int y = top; y < top + out.height; ++y) {
    for (int x = left; x < left + out.width; ++x) {
      const bool inside = x >= 0 && y >= 0 && x < side.width && y < side.height;
      out.pixels.push_back(inside ? side.pixels[static_cast<std::size_t>(y * side.width + x)]
                                  : std::uint8_t{120});
    }
  }
  return out;
}

/// The pattern of that number on a shape; a box has the next five around.
Result<ShapedPattern> bake_on(const BenchShape& bench, const PoseBenchOptions& options,
                              std::size_t number) {
  const ShapeRequest& shape = bench.request;
  ShapedPattern pattern;
  bool shrunk = false;
  double width_mm = 0;
  if (shape.kind == ShapeRequest::Kind::kBox) {
    const auto [w, h, d] = shape.box_mm;
    const double widths[] = {w, d, w, d, w, w};
    const double heights[] = {h, h, h, h, d, d};
    std::array<GrayPicture, 6> sides;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const auto& path = options.patterns[(number + i) % options.patterns.size()];
      MODAR_ASSIGN(const GrayPicture whole, load_pattern(path, shrunk));
      sides[i] = cut_to(whole, widths[i], heights[i]);
    }
    const auto& around = options.patterns[(number + sides.size()) % options.patterns.size()];
    MODAR_ASSIGN(const GrayPicture photo, load_pattern(around, shrunk));
    run_around(photo, shape.box_mm, sides);
    ShapedPicture box = assemble_box(sides, shape.box_mm);
    pattern.picture = std::move(box.picture);
    pattern.section = std::move(box.section);
    pattern.print = pattern.picture;
    if (bench.cropped) {
      Random random(options.seed + number);
      for (GrayPicture& side : sides) side = crop_roughly(side, random);
      pattern.picture = assemble_box(correct_crops(sides).pictures, shape.box_mm).picture;
    }
  } else {
    MODAR_ASSIGN(pattern.picture, load_pattern(options.patterns[number], shrunk));
    pattern.print = pattern.picture;
    MODAR_ASSIGN(pattern.section,
                 shape_section(shape, pattern.picture.width, pattern.picture.height, width_mm));
  }
  pattern.surface = surface_of(pattern.section, pattern.picture.width, pattern.picture.height);
  MODAR_ASSIGN(pattern.record, make_tracker_record(pattern.picture.view(), {}, pattern.surface));
  MODAR_ASSIGN(pattern.bytes,
               bundle_of_record(pattern.picture.view(), pattern.record, pattern.section));
  return pattern;
}

/// Mean distance in the frame of the picture's places that face the camera, between two poses.
double shown_error(const ShapedPattern& pattern, const Camera& camera, const Pose& truth,
                   const Pose& seen) {
  constexpr int kPlacesAcross = 16;  // places across and down
  const auto vector_of = [](const std::array<double, 3>& v) {
    return glm::dvec3(v[0], v[1], v[2]);
  };
  double sum = 0;
  int count = 0;
  for (int i = 0; i < kPlacesAcross * kPlacesAcross; ++i) {
    const SurfacePoint point = pattern.surface.at(
        (i % kPlacesAcross + 0.5) / kPlacesAcross * pattern.picture.width - 0.5,
        (static_cast<int>(i / kPlacesAcross) + 0.5) / kPlacesAcross * pattern.picture.height - 0.5);
    const glm::dvec3 at = truth.rotation * vector_of(point.at) + truth.translation;
    const glm::dvec3 normal =
        truth.rotation * glm::cross(vector_of(point.down), vector_of(point.right));
    if (!(glm::dot(normal, at) < 0)) continue;
    const glm::dvec3 there = seen.rotation * vector_of(point.at) + seen.translation;
    sum += glm::length(project(camera, at) - project(camera, there));
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

class Row {
 public:
  Row(const std::string& band, bool sequence) {
    row_.band = band;
    row_.method = "ours";
    row_.sequence = sequence;
  }
  void cut() { poses_.cut(); }
  Result<void> run(const ShapedPattern& pattern, const Camera& camera, const SceneFrame& scene,
                   bool shown) {
    const double start = thread_seconds();
    MODAR_ASSIGN(const TrackResult result, pattern.loop->step(scene.picture.view()));
    row_.ms += 1e3 * (thread_seconds() - start);
    const FrameTruth truth{shown, scene.corners};
    poses_.add(result, truth);
    if (shown && !result.visible.empty()) {
      const double error = shown_error(pattern, camera, scene.pose, result.visible[0].pose);
      row_.beside += error > kBeside ? 1 : 0;
      if (is_right(result.visible[0], truth)) errors_.push_back(error);
    }
    return {};
  }
  PoseBenchRow finish() {
    if (!errors_.empty()) {
      const auto middle = errors_.begin() + static_cast<std::ptrdiff_t>(errors_.size() / 2);
      std::nth_element(errors_.begin(), middle, errors_.end());
      row_.shown_px = *middle;
    }
    static_cast<PoseFigures&>(row_) = poses_.figures();
    row_.ms /= std::max(row_.frames, 1);
    return row_;
  }

 private:
  static constexpr double kBeside = 10;  // pixels of 1280: no model stands like that
  PoseBenchRow row_;
  PoseTally poses_;
  std::vector<double> errors_;
};

/// A camera's way around a thing: 70 degrees to either side, nearer and farther, in eight seconds.
Pose pose_on_way(const ShapedPattern& pattern, const Camera& camera, double time_s, double phase) {
  const auto sway = [&](double seconds, double shift) {
    return std::sin(2 * pi * time_s / seconds + phase + shift);
  };
  return surface_pose(pattern.picture.view(), pattern.surface, camera, 70 * sway(8, 0),
                      10 + 10 * sway(5, 1), 15 * sway(7, 2), 1.0 + 0.25 * sway(6, 3),
                      {0.06 * sway(4, 4), 0.05 * sway(3, 5)});
}

class ShapeBench {
 public:
  ShapeBench(const PoseBenchOptions& options, const std::vector<GrayPicture>& backgrounds)
      : options_(options),
        backgrounds_(backgrounds),
        camera_(default_camera(options.width, options.height)) {}

  Result<void> detect(ShapedPattern& pattern, double low, double high, std::uint64_t seed,
                      Row& row) {
    MODAR_TRY(pattern.open(camera_, false));
    Random random(seed);
    SceneBand band;
    band.surface = &pattern.surface;
    band.area_low = 0.4;
    band.area_high = 2.0;
    band.tilt_high = 25;
    band.around_low = low;
    band.around_high = high;
    for (int i = 0; i < options_.frames; ++i) {
      const auto& photo =
          backgrounds_[static_cast<std::size_t>(random.next() % backgrounds_.size())];
      const Pose pose = draw_pose(band, pattern.picture.view(), camera_, random);
      const SceneFrame scene =
          render_scene(pattern.print.view(), camera_, pose, photo, band, random);
      MODAR_TRY(row.run(pattern, camera_, scene, true));
    }
    return {};
  }

  Result<void> track(ShapedPattern& pattern, std::uint64_t seed, Row& row) {
    MODAR_TRY(pattern.open(camera_, true));
    Random random(seed);
    const auto& photo = backgrounds_[static_cast<std::size_t>(random.next() % backgrounds_.size())];
    const SceneLight light = draw_light(random);
    const double phase = random.uniform(0, 2 * pi);
    SceneBand band;
    band.surface = &pattern.surface;
    row.cut();
    for (int i = 0; i < options_.frames; ++i) {
      const Pose pose = pose_on_way(pattern, camera_, i / 30.0, phase);
      const SceneFrame scene =
          render_scene(pattern.print.view(), camera_, pose, photo, band, random, &light);
      MODAR_TRY(row.run(pattern, camera_, scene, true));
    }
    return {};
  }

  /// Photos with nothing to be found, looked through for all of the patterns at once.
  Result<void> clutter(const std::vector<ShapedPattern>& patterns, int frames, Row& row) {
    std::vector<GrayPicture> pictures;
    std::vector<std::vector<std::byte>> records;
    std::vector<std::vector<std::byte>> shapes;
    for (const ShapedPattern& one : patterns) {
      pictures.push_back(one.picture);
      records.push_back(one.record);
      shapes.push_back(one.section);
    }
    ShapedPattern all;
    MODAR_ASSIGN(all.bytes, bundle_of_records(pictures, records, nullptr, shapes));
    MODAR_TRY(all.open(camera_, false));
    Random random(options_.seed);
    SceneBand band;
    band.pattern = false;
    for (int i = 0; i < frames; ++i) {
      const auto& photo =
          backgrounds_[static_cast<std::size_t>(random.next() % backgrounds_.size())];
      const SceneFrame scene = render_scene(pictures.front().view(), camera_, {},
                                            another_view(photo, random), band, random);
      MODAR_TRY(row.run(all, camera_, scene, false));
    }
    return {};
  }

 private:
  const PoseBenchOptions& options_;
  const std::vector<GrayPicture>& backgrounds_;
  Camera camera_;
};

}  // namespace

Result<std::vector<PoseBenchRow>> bench_shapes(const PoseBenchOptions& options,
                                               const std::string& only,
                                               const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto backgrounds,
               load_backgrounds(options.backgrounds, options.width, options.height));
  if (backgrounds.empty() || options.patterns.empty()) {
    return fail(ExitCode::kUsage, "bench.input", "", "the bench needs patterns and backgrounds",
                "give folders with pictures");
  }
  ShapeBench bench(options, backgrounds);
  const auto wanted = [&](const std::string& row) { return row.find(only) != std::string::npos; };
  const std::string none = "none of all shapes";
  const double bakes = static_cast<double>(bench_shapes_of().size() * options.patterns.size());
  std::vector<ShapedPattern> baked;
  std::vector<PoseBenchRow> rows;
  double done = 0;
  for (const BenchShape& shape : bench_shapes_of()) {
    const std::string name = shape.name;
    const std::array<std::string, 3> names = {name + " around 0-35", name + " around 35-70",
                                              "tracking " + name};
    std::array<bool, 3> wants{};
    for (std::size_t i = 0; i < 3; ++i) wants[i] = wanted(names[i]);
    if (!wants[0] && !wants[1] && !wants[2] && !wanted(none)) continue;
    std::array<Row, 3> found = {Row(names[0], false), Row(names[1], false), Row(names[2], true)};
    for (std::size_t p = 0; p < options.patterns.size(); ++p) {
      if (progress) progress(name, done++ / bakes);
      MODAR_ASSIGN(ShapedPattern pattern, bake_on(shape, options, p));
      const std::uint64_t seed = options.seed + 1000003 * p;
      if (wants[0]) MODAR_TRY(bench.detect(pattern, 0, 35, seed, found[0]));
      if (wants[1]) MODAR_TRY(bench.detect(pattern, 35, 70, seed + 1, found[1]));
      if (wants[2]) MODAR_TRY(bench.track(pattern, seed + 2, found[2]));
      if (wanted(none)) baked.push_back(std::move(pattern));
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (wants[i]) rows.push_back(found[i].finish());
    }
  }
  if (wanted(none)) {
    Row row(none, false);
    const int frames = options.frames * static_cast<int>(options.patterns.size());
    MODAR_TRY(
        bench.clutter(baked, options.clutter_frames > 0 ? options.clutter_frames : frames, row));
    rows.push_back(row.finish());
  }
  return rows;
}

}  // namespace modar
