// Every pattern asked for in views of every other and in photos.
#include "bake/pattern/confusion.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bake/parallel.hpp"
#include "bake/pattern/pattern_picture.hpp"
#include "bake/pattern/pose_subject.hpp"
#include "formats/bundle_view.hpp"
#include "formats/tracker_record.hpp"
#include "modar/mapped_file.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

Result<void> add_picture(const std::string& path, unsigned jobs, std::vector<NamedPattern>& out) {
  bool shrunk = false;
  auto picture = load_pattern(path, shrunk);
  if (!picture) return tl::unexpected(picture.error());
  TrackerRecordOptions options;
  options.jobs = jobs;
  auto bundle = bundle_of_pattern(picture->view(), options);
  if (!bundle) {
    bundle.error().where = path;
    return tl::unexpected(bundle.error());
  }
  out.push_back(
      {std::filesystem::path(path).stem().string(), std::move(*picture), std::move(*bundle)});
  return {};
}

Result<void> add_bundle(const std::string& path, std::vector<NamedPattern>& out) {
  const auto file = MappedFile::open(path);
  if (!file) return tl::unexpected(file.error());
  const auto bundle = BundleView::open(file->bytes());
  if (!bundle) return tl::unexpected(bundle.error());
  for (std::uint32_t i = 0; i < bundle->patterns().size(); ++i) {
    const auto bytes = bundle->section(SectionType::kTrackerRecord, i, 0);
    TrackerRecordView view;
    if (const auto fault = view_tracker_record(bytes, view)) {
      return fail(ExitCode::kInvalidInput, "confusion.record", path,
                  std::string("a pattern's loop record: ") + fault->cause, "bake it again");
    }
    NamedPattern pattern;
    pattern.name = bundle->name(bundle->patterns()[i].name);
    pattern.picture.width = static_cast<int>(view.header.width);
    pattern.picture.height = static_cast<int>(view.header.height);
    const std::size_t size = std::size_t{view.header.width} * view.header.height;
    pattern.picture.pixels.assign(view.pixels.begin(),
                                  view.pixels.begin() + static_cast<std::ptrdiff_t>(size));
    auto alone = bundle_of_record(pattern.picture.view(), {bytes.begin(), bytes.end()});
    if (!alone) return tl::unexpected(alone.error());
    pattern.bundle = std::move(*alone);
    out.push_back(std::move(pattern));
  }
  return {};
}

/// Views in which a pattern is easy to recognise.
std::vector<GrayPicture> easy_views(const NamedPattern& pattern, const ConfusionOptions& options,
                                    const GrayPicture& background, Random& random) {
  const Camera camera = default_camera(options.width, options.height);
  const double own = 1.0 * pattern.picture.width * pattern.picture.height;
  const double side = 0.5 * std::min(options.width, options.height);
  SceneBand band;
  band.area_low = 0.5 * side * side / own;
  band.area_high = 1.5 * side * side / own;
  band.tilt_high = 35;
  std::vector<GrayPicture> views;
  for (int i = 0; i < options.views; ++i) {
    const Pose pose = draw_pose(band, pattern.picture.view(), camera, random);
    views.push_back(
        render_scene(pattern.picture.view(), camera, pose, background, band, random).picture);
  }
  return views;
}

/// A photo in several lights and exposures.
std::vector<GrayPicture> photo_views(const GrayPicture& photo, int count, Random& random) {
  std::vector<GrayPicture> views(static_cast<std::size_t>(count));
  for (GrayPicture& view : views) expose(photo, draw_light(random), random, view);
  return views;
}

/// In how many of the views each pattern is recognised, asked for alone.
Result<std::vector<int>> ask_all(const std::vector<NamedPattern>& patterns,
                                 const std::vector<GrayPicture>& views,
                                 const ConfusionOptions& options) {
  PoseLoopOptions loop_options;
  loop_options.track = false;
  std::vector<Result<int>> counts(patterns.size(), 0);
  parallel_rows(static_cast<std::uint32_t>(patterns.size()), options.jobs, [&](std::uint32_t i) {
    const auto bundle = BundleView::open(patterns[i].bundle);
    if (!bundle) {
      counts[i] = tl::unexpected(bundle.error());
      return;
    }
    auto loop =
        PoseLoop::create(*bundle, default_camera(options.width, options.height), loop_options);
    if (!loop) {
      counts[i] = tl::unexpected(loop.error());
      return;
    }
    for (const GrayPicture& view : views) {
      const auto seen = (*loop)->step(view.view());
      if (seen && !seen->visible.empty()) ++*counts[i];
    }
  });
  std::vector<int> out;
  for (const auto& count : counts) {
    if (!count) return tl::unexpected(count.error());
    out.push_back(*count);
  }
  return out;
}

/// A bundle of all of them, as an app would have it.
Result<std::vector<std::byte>> project_of(const std::vector<NamedPattern>& patterns) {
  std::vector<GrayPicture> pictures;
  std::vector<std::vector<std::byte>> records;
  for (const NamedPattern& pattern : patterns) {
    const auto bundle = BundleView::open(pattern.bundle);
    if (!bundle) return tl::unexpected(bundle.error());
    const auto record = bundle->section(SectionType::kTrackerRecord, 0, 0);
    pictures.push_back(pattern.picture);
    records.emplace_back(record.begin(), record.end());
  }
  return bundle_of_records(pictures, records);
}

/// Recognitions of others than the one that is shown (nobody: patterns.size()).
Result<int> ask_together(PoseLoop& loop, const std::vector<GrayPicture>& views, std::size_t shown) {
  int others = 0;
  TrackResult seen;
  for (const GrayPicture& view : views) {
    if (auto done = loop.step(view.view(), seen); !done) return tl::unexpected(done.error());
    for (const Detection& each : seen.visible) others += each.pattern != shown ? 1 : 0;
  }
  return others;
}

}  // namespace

Result<std::vector<NamedPattern>> read_patterns(const std::vector<std::string>& paths,
                                                unsigned jobs) {
  std::vector<NamedPattern> patterns;
  for (const std::string& path : paths) {
    const bool bundle = std::filesystem::path(path).extension() == ".modar";
    auto added = bundle ? add_bundle(path, patterns) : add_picture(path, jobs, patterns);
    if (!added) return tl::unexpected(added.error());
  }
  return patterns;
}

int Confusion::false_recognitions() const {
  int sum = 0;
  for (std::size_t shown = 0; shown < names.size(); ++shown) {
    for (std::size_t asked = 0; asked < names.size(); ++asked) {
      if (asked != shown) sum += recognised[shown * names.size() + asked];
    }
    sum += in_photos[shown];
  }
  return sum;
}

Result<Confusion> measure_confusion(const std::vector<NamedPattern>& patterns,
                                    const ConfusionOptions& options,
                                    const ProgressCallback& progress) {
  Confusion confusion;
  confusion.views = options.views;
  confusion.photo_views = options.views * static_cast<int>(options.photos.size());
  confusion.in_photos.assign(patterns.size(), 0);
  const auto project = project_of(patterns);
  if (!project) return tl::unexpected(project.error());
  PoseLoopOptions how;
  how.track = false;
  auto loop = PoseLoop::create(BundleView::open(*project).value(),
                               default_camera(options.width, options.height), how);
  if (!loop) return tl::unexpected(loop.error());
  const auto ask = [&](const std::vector<GrayPicture>& views,
                       std::size_t shown) -> Result<std::vector<int>> {
    const auto others = ask_together(**loop, views, shown);
    if (!others) return tl::unexpected(others.error());
    confusion.together += *others;
    return ask_all(patterns, views, options);
  };
  Random random(options.seed);
  const GrayPicture background = made_background(options.width, options.height, random);
  const double all = static_cast<double>(patterns.size() + options.photos.size());
  double done = 0;
  const auto stepped = [&] {
    if (progress) progress("confusion", ++done / all);
  };
  for (const NamedPattern& shown : patterns) {
    confusion.names.push_back(shown.name);
    const std::size_t index = confusion.names.size() - 1;
    const auto counts = ask(easy_views(shown, options, background, random), index);
    if (!counts) return tl::unexpected(counts.error());
    confusion.recognised.insert(confusion.recognised.end(), counts->begin(), counts->end());
    stepped();
  }
  for (const std::string& path : options.photos) {
    const auto photo = load_background(path, options.width, options.height);
    if (!photo) return tl::unexpected(photo.error());
    const auto counts = ask(photo_views(*photo, options.views, random), patterns.size());
    if (!counts) return tl::unexpected(counts.error());
    for (std::size_t i = 0; i < counts->size(); ++i) confusion.in_photos[i] += (*counts)[i];
    stepped();
  }
  return confusion;
}

}  // namespace modar
