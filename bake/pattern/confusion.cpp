// Runs the tracker for every pattern on views of every other and on photos.
#include "bake/pattern/confusion.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "formats/base/parallel.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

/// Views in which a pattern is easy to recognise.
std::vector<GrayPicture> easy_views(const NamedPattern& pattern, const ConfusionOptions& options,
                                    const GrayPicture& background, Random& random) {
  const Camera camera = default_camera(options.width, options.height);
  const double own = 1.0 * pattern.picture.width * pattern.picture.height;
  // The pattern fills about half of the frame's height and is tilted by up to 35 degrees: easy
  // views, in which a likeness shows.
  const double side = 0.5 * std::min(options.width, options.height);
  SceneBand band;
  band.area_low = 0.5 * side * side / own;
  band.area_high = 1.5 * side * side / own;
  band.tilt_high = 35;
  const PatternSurface surface =
      surface_of(pattern.shape, pattern.picture.width, pattern.picture.height);
  if (!surface.flat()) band.surface = &surface;
  std::vector<GrayPicture> views;
  for (int i = 0; i < options.views; ++i) {
    const Pose pose = draw_pose(band, pattern.picture.view(), camera, random);
    views.push_back(
        render_scene(pattern.picture.view(), camera, pose, background, band, random).picture);
  }
  return views;
}

/// A photo in several exposures.
std::vector<GrayPicture> photo_views(const GrayPicture& photo, int count, Random& random) {
  std::vector<GrayPicture> views(static_cast<std::size_t>(count));
  for (GrayPicture& view : views) expose(photo, draw_light(random), random, view);
  return views;
}

/// In how many of the views each pattern is recognised by a device that knows it alone.
Result<std::vector<int>> count_alone(std::span<const NamedPattern> patterns,
                                     const std::vector<GrayPicture>& views,
                                     const ConfusionOptions& options) {
  PoseLoopOptions loop_options;
  loop_options.track = false;
  std::vector<Result<int>> counts(patterns.size(), 0);
  const auto count = [&](const NamedPattern& pattern) -> Result<int> {
    MODAR_ASSIGN(const auto bundle, BundleView::open(pattern.bundle));
    const Camera camera = default_camera(options.width, options.height);
    MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, camera, loop_options));
    int recognised = 0;
    for (const GrayPicture& view : views) {
      MODAR_ASSIGN(const TrackResult seen, loop->step(view.view()));
      recognised += seen.visible.empty() ? 0 : 1;
    }
    return recognised;
  };
  parallel_rows(static_cast<std::uint32_t>(patterns.size()), options.jobs,
                [&](std::uint32_t i) { counts[i] = count(patterns[i]); });
  std::vector<int> out;
  for (const auto& one : counts) {
    MODAR_ASSIGN(const int recognised, one);
    out.push_back(recognised);
  }
  return out;
}

/// A bundle of all of them, as an app would have it.
Result<std::vector<std::byte>> project_of(const std::vector<NamedPattern>& patterns) {
  std::vector<GrayPicture> pictures;
  std::vector<std::vector<std::byte>> records;
  std::vector<std::vector<std::byte>> shapes;
  for (const NamedPattern& pattern : patterns) {
    MODAR_ASSIGN(const auto bundle, BundleView::open(pattern.bundle));
    const auto record = bundle.section(SectionType::kTrackerRecord, 0, 0);
    pictures.push_back(pattern.picture);
    records.emplace_back(record.begin(), record.end());
    shapes.push_back(pattern.shape);
  }
  return bundle_of_records(pictures, records, nullptr, shapes);
}

/// Recognitions of each pattern.
Result<std::vector<int>> count_together(PoseLoop& loop, const std::vector<GrayPicture>& views,
                                        std::size_t patterns) {
  std::vector<int> counts(patterns, 0);
  TrackResult seen;
  for (const GrayPicture& view : views) {
    MODAR_TRY(loop.step(view.view(), seen));
    for (const Detection& each : seen.visible) ++counts[each.pattern];
  }
  return counts;
}

/// Counts of patterns in views of another one.
int sum_of_others(const std::vector<int>& counts, std::size_t patterns) {
  int sum = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) sum += i % (patterns + 1) != 0 ? counts[i] : 0;
  return sum;
}

}  // namespace

int Confusion::false_recognitions() const {
  return sum_of_others(recognised, names.size()) +
         std::accumulate(in_photos.begin(), in_photos.end(), 0);
}

int Confusion::false_together() const {
  return sum_of_others(together, names.size()) + photos_together;
}

std::vector<AlikePair> Confusion::alike_pairs() const {
  std::vector<AlikePair> pairs;
  for (std::size_t a = 0; a < names.size(); ++a) {
    for (std::size_t b = a + 1; b < names.size(); ++b) {
      const auto times = [&](const std::vector<int>& counts) {
        return counts[a * names.size() + b] + counts[b * names.size() + a];
      };
      if (times(recognised) > 0) pairs.push_back({a, b, times(together) == 0});
    }
  }
  return pairs;
}

Result<Confusion> measure_confusion(const std::vector<NamedPattern>& patterns,
                                    const ConfusionOptions& options,
                                    const ProgressCallback& progress) {
  Confusion confusion;
  confusion.views = options.views;
  confusion.photo_views = options.views * static_cast<int>(options.photos.size());
  confusion.in_photos.assign(patterns.size(), 0);
  MODAR_ASSIGN(const auto project, project_of(patterns));
  MODAR_ASSIGN(const auto bundle, BundleView::open(project));
  PoseLoopOptions detect_only;
  detect_only.track = false;
  MODAR_ASSIGN(
      const auto loop,
      PoseLoop::create(bundle, default_camera(options.width, options.height), detect_only));
  Random random(options.seed);
  const GrayPicture background = made_background(options.width, options.height, random);
  const double all = static_cast<double>(2 * patterns.size() + options.photos.size());
  double done = 0;
  const auto step_done = [&] {
    if (progress) progress("confusion", ++done / all);
  };
  for (const NamedPattern& shown : patterns) {
    confusion.names.push_back(shown.name);
    const std::vector<GrayPicture> views = easy_views(shown, options, background, random);
    MODAR_ASSIGN(const auto together, count_together(*loop, views, patterns.size()));
    confusion.together.insert(confusion.together.end(), together.begin(), together.end());
    MODAR_ASSIGN(const auto counts, count_alone(patterns, views, options));
    confusion.recognised.insert(confusion.recognised.end(), counts.begin(), counts.end());
    step_done();
  }
  Random mirror_random(options.seed + 1);
  for (const NamedPattern& pattern : patterns) {
    NamedPattern mirror{pattern.name, pattern.picture, {}, pattern.shape};
    for (int y = 0; y < mirror.picture.height; ++y) {
      const auto row = mirror.picture.pixels.begin() + std::ptrdiff_t{y} * mirror.picture.width;
      std::reverse(row, row + mirror.picture.width);
    }
    MODAR_ASSIGN(const auto counts,
                 count_alone({&pattern, 1}, easy_views(mirror, options, background, mirror_random),
                             options));
    confusion.mirrored.push_back(counts[0]);
    step_done();
  }
  for (const std::string& path : options.photos) {
    MODAR_ASSIGN(const auto photo, load_background(path, options.width, options.height));
    const std::vector<GrayPicture> views = photo_views(photo, options.views, random);
    MODAR_ASSIGN(const auto together, count_together(*loop, views, patterns.size()));
    confusion.photos_together += std::accumulate(together.begin(), together.end(), 0);
    MODAR_ASSIGN(const auto counts, count_alone(patterns, views, options));
    for (std::size_t i = 0; i < counts.size(); ++i) confusion.in_photos[i] += counts[i];
    step_done();
  }
  return confusion;
}

}  // namespace modar
