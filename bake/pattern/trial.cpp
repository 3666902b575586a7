// Bakes patterns into bundles in memory, judges trackers' answers, and runs the device's tracker on
// rendered views.
#include "bake/pattern/trial.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <glm/geometric.hpp>

#include "formats/base/parallel.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/tracker_record.hpp"
#include "modar/features.hpp"
#include "modar/mapped_file.hpp"
#include "modar/pattern_views.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

using std::numbers::pi;

constexpr double kRight = 5.0;   // pixels; every figure of the tracker was measured with it
constexpr int kExposures = 2;    // of a view: the first is detected, the second tracked
constexpr int kSampleScale = 4;  // frame pixels in one of the sample

void add_record(const GrayImage& pattern, std::vector<std::byte> record, BundleContent& content) {
  PatternRecord entry{};
  entry.name = content.intern("pattern " + std::to_string(content.patterns.size()));
  entry.width = static_cast<std::uint32_t>(pattern.width);
  entry.height = static_cast<std::uint32_t>(pattern.height);
  const auto corners = pattern_corners(pattern.width, pattern.height);
  entry.half_width = static_cast<float>(corners[1].x);
  entry.half_height = static_cast<float>(corners[1].y);
  entry.score = -1.0f;
  content.features.emplace_back();
  if (!record.empty()) {
    ExtraSection section;
    section.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
    section.owner = static_cast<std::uint32_t>(content.patterns.size());
    section.bytes = std::move(record);
    content.extra.push_back(std::move(section));
  }
  content.patterns.push_back(entry);
}

/// Of the pattern that was added last.
void add_shape(const std::vector<std::byte>& shape, BundleContent& content) {
  if (shape.empty()) return;
  ExtraSection section;
  section.type = static_cast<std::uint32_t>(SectionType::kPatternShape);
  section.owner = static_cast<std::uint32_t>(content.patterns.size() - 1);
  section.bytes = shape;
  content.extra.push_back(std::move(section));
}

/// Of the pattern that was added last.
Result<void> add_features(const GrayImage& pattern, const ParameterSetRecord& set,
                          BundleContent& content) {
  MODAR_ASSIGN(auto features, describe_image(pattern, set));
  content.features.back().push_back({set.id, features.descriptor_bytes,
                                     std::move(features.keypoints), std::move(features.descriptors),
                                     ""});
  return {};
}

Result<std::vector<std::byte>> bytes_of(const BundleContent& content) {
  std::vector<std::byte> bytes;
  MODAR_TRY(write_bundle(content, [&](std::span<const std::byte> part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  }));
  return bytes;
}

Result<void> read_picture(const std::string& path, const ShapeRequest& shape, unsigned jobs,
                          std::vector<NamedPattern>& out) {
  MODAR_ASSIGN(ShapedPicture shaped, load_shaped(path, 0, shape));
  const GrayImage gray = shaped.picture.view();
  TrackerRecordOptions options;
  options.jobs = jobs;
  auto record =
      make_tracker_record(gray, options, surface_of(shaped.section, gray.width, gray.height));
  if (!record) {
    record.error().where = path;
    return tl::unexpected(record.error());
  }
  MODAR_ASSIGN(auto bundle, bundle_of_record(gray, std::move(*record), shaped.section));
  out.push_back({std::filesystem::path(path).stem().string(), std::move(shaped.picture),
                 std::move(bundle), std::move(shaped.section)});
  return {};
}

Result<void> read_bundle(const std::string& path, std::vector<NamedPattern>& out) {
  MODAR_ASSIGN(const auto file, MappedFile::open(path));
  MODAR_ASSIGN(const auto bundle, file.settle(BundleView::open(file.bytes())));
  for (std::uint32_t i = 0; i < bundle.patterns().size(); ++i) {
    const auto bytes = bundle.section(SectionType::kTrackerRecord, i, 0);
    TrackerRecordView view;
    if (const auto fault = view_tracker_record(bytes, view)) {
      return fail(ExitCode::kInvalidInput, "confusion.record", path,
                  std::string("a pattern's loop record: ") + fault->cause, "bake it again");
    }
    NamedPattern pattern;
    pattern.name = bundle.name(bundle.patterns()[i].name);
    pattern.picture.width = static_cast<int>(view.header.width);
    pattern.picture.height = static_cast<int>(view.header.height);
    const std::size_t size = std::size_t{view.header.width} * view.header.height;
    pattern.picture.pixels.assign(view.pixels.begin(),
                                  view.pixels.begin() + static_cast<std::ptrdiff_t>(size));
    const auto shape = bundle.section(SectionType::kPatternShape, i);
    pattern.shape.assign(shape.begin(), shape.end());
    MODAR_ASSIGN(pattern.bundle, bundle_of_record(pattern.picture.view(),
                                                  {bytes.begin(), bytes.end()}, pattern.shape));
    out.push_back(std::move(pattern));
  }
  return file.intact();
}

void keep_sample(const SceneFrame& scene, const GrayPicture& frame, const TrackResult& result,
                 TrialOutcome& outcome) {
  const auto levels = halved(frame.view());
  outcome.sample = levels[std::min<std::size_t>(2, levels.size() - 1)];
  const auto scaled = [](const std::array<glm::dvec2, 4>& corners) {
    std::array<glm::dvec2, 4> out;
    for (std::size_t i = 0; i < 4; ++i) out[i] = corners[i] / static_cast<double>(kSampleScale);
    return out;
  };
  outcome.truth = scaled(scene.corners);
  if (result.visible.empty()) return;
  outcome.seen = scaled(result.visible[0].corners);
  outcome.sample_right = is_right(result.visible[0], {true, scene.corners});
}

Result<TrialOutcome> try_setting(const TrialSetup& setup, const TrialSetting& setting,
                                 std::uint64_t seed) {
  MODAR_ASSIGN(const auto bundle, BundleView::open(setup.bundle));
  MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, setup.camera));
  Random random(seed);
  PoseTally tally;
  TrialOutcome outcome;
  TrackResult result;
  GrayPicture frame;
  SceneBand band = setting.band;
  band.surface = setup.surface;
  for (int view = 0; view < setup.views; ++view) {
    const GrayPicture& background = setup.backgrounds[random.next() % setup.backgrounds.size()];
    const Pose pose = draw_pose(band, setup.picture, setup.camera, random);
    const SceneLight light = setting.light ? *setting.light : draw_light(random);
    const SceneFrame scene =
        render_still(setup.picture, setup.camera, pose, background, band, random, light.focus,
                     {setting.motion_px, random.uniform(0, pi)});
    loop->reset();
    tally.cut();
    for (int i = 0; i < kExposures; ++i) {
      expose(scene.picture, light, random, frame);
      MODAR_TRY(loop->step(frame.view(), result));
      tally.add(result, {true, scene.corners});
      if (view == 0 && i == 0) keep_sample(scene, frame, result, outcome);
    }
  }
  outcome.figures = tally.figures();
  return outcome;
}

}  // namespace

Result<std::vector<std::byte>> bundle_of_pattern(const GrayImage& pattern,
                                                 const TrackerRecordOptions& options) {
  MODAR_ASSIGN(auto record, make_tracker_record(pattern, options));
  return bundle_of_record(pattern, std::move(record));
}

Result<std::vector<std::byte>> bundle_of_record(const GrayImage& pattern,
                                                std::vector<std::byte> record,
                                                const std::vector<std::byte>& shape) {
  BundleContent content;
  add_record(pattern, std::move(record), content);
  add_shape(shape, content);
  return bytes_of(content);
}

Result<std::vector<std::byte>> bundle_of_records(std::span<const GrayPicture> patterns,
                                                 std::span<const std::vector<std::byte>> records,
                                                 const ParameterSetRecord* set,
                                                 std::span<const std::vector<std::byte>> shapes) {
  BundleContent content;
  if (set != nullptr) {
    content.parameter_sets.push_back(*set);
    content.parameter_sets.back().name = content.intern(parameter_set_name(set->id));
  }
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    add_record(patterns[i].view(), records[i], content);
    if (i < shapes.size()) add_shape(shapes[i], content);
    if (set != nullptr) MODAR_TRY(add_features(patterns[i].view(), *set, content));
  }
  return bytes_of(content);
}

Result<std::vector<NamedPattern>> read_patterns(const std::string& path, const ShapeRequest& shape,
                                                unsigned jobs) {
  std::vector<NamedPattern> patterns;
  const bool bundle = std::filesystem::path(path).extension() == ".modar";
  MODAR_TRY(bundle ? read_bundle(path, patterns) : read_picture(path, shape, jobs, patterns));
  return patterns;
}

double corner_error(const Detection& detection, const FrameTruth& truth) {
  double error = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    error += 0.25 * glm::length(detection.corners[i] - truth.corners[i]);
  }
  return error;
}

bool is_right(const Detection& detection, const FrameTruth& truth) {
  return corner_error(detection, truth) < kRight;
}

void PoseTally::add(const TrackResult& result, const FrameTruth& truth) {
  ++figures_.frames;
  if (!truth.pattern) {
    ++figures_.without_pattern;
    figures_.false_found += result.visible.empty() ? 0 : 1;
  }
  if (!truth.pattern || result.visible.empty()) {
    cut();
    return;
  }
  ++figures_.recognised;
  const auto better = [&](const Detection& a, const Detection& b) {
    return corner_error(a, truth) < corner_error(b, truth);
  };
  const Detection& seen = *std::min_element(result.visible.begin(), result.visible.end(), better);
  std::array<glm::dvec2, 4> miss;
  for (std::size_t i = 0; i < 4; ++i) miss[i] = seen.corners[i] - truth.corners[i];
  const double error = corner_error(seen, truth);
  const bool right = is_right(seen, truth);
  figures_.within_15 += error < 15 ? 1 : 0;
  figures_.worst_px = std::max(figures_.worst_px, error);
  wrong_ = right ? 0 : wrong_ + 1;
  figures_.held_wrong = std::max(figures_.held_wrong, wrong_);
  if (right) {
    ++figures_.right;
    errors_.push_back(error);
  }
  for (std::size_t i = 0; i < 4 && right && have_last_; ++i) {
    const glm::dvec2 d = miss[i] - last_[i];
    change_ += 0.5 * glm::dot(d, d);
    ++changes_;
  }
  have_last_ = right;
  last_ = miss;
}

PoseFigures PoseTally::figures() {
  if (!errors_.empty()) {
    const auto middle = errors_.begin() + static_cast<std::ptrdiff_t>(errors_.size() / 2);
    std::nth_element(errors_.begin(), middle, errors_.end());
    figures_.error_px = *middle;
  }
  if (changes_ > 0) figures_.jitter_px = std::sqrt(change_ / changes_);
  return figures_;
}

Result<std::vector<TrialOutcome>> try_views(const TrialSetup& setup,
                                            std::span<const TrialSetting> settings,
                                            const std::function<void()>& setting_done) {
  std::vector<Result<TrialOutcome>> all(settings.size(), TrialOutcome{});
  parallel_rows(static_cast<std::uint32_t>(settings.size()), setup.jobs, [&](std::uint32_t i) {
    // Any step between seeds that keeps the settings' random sequences apart.
    all[i] = try_setting(setup, settings[i], setup.seed + 1000003 * i);
    if (setting_done) setting_done();
  });
  std::vector<TrialOutcome> outcomes;
  for (auto& one : all) {
    MODAR_ASSIGN(TrialOutcome outcome, std::move(one));
    outcomes.push_back(std::move(outcome));
  }
  return outcomes;
}

}  // namespace modar
