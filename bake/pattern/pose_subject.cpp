// Bakes patterns into a bundle in memory and judges what trackers say of frames.
#include "bake/pattern/pose_subject.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "bake/pattern/pattern_picture.hpp"
#include "bake/thread_clock.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/tracker_record.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

constexpr double kRight = 5.0;  // pixels

/// loop_record: of the pattern; empty: none.
void add_record(const GrayImage& pattern, std::vector<std::byte> loop_record,
                BundleContent& content) {
  PatternRecord record{};
  record.name = content.intern("pattern " + std::to_string(content.patterns.size()));
  record.width = static_cast<std::uint32_t>(pattern.width);
  record.height = static_cast<std::uint32_t>(pattern.height);
  const auto corners = pattern_corners(pattern.width, pattern.height);
  record.half_width = static_cast<float>(corners[1].x);
  record.half_height = static_cast<float>(corners[1].y);
  record.score = -1.0f;
  content.features.emplace_back();
  if (!loop_record.empty()) {
    ExtraSection section;
    section.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
    section.owner = static_cast<std::uint32_t>(content.patterns.size());
    section.bytes = std::move(loop_record);
    content.extra.push_back(std::move(section));
  }
  content.patterns.push_back(record);
}

/// loop: null for a pattern without a record of ours, which takes most of the time.
Result<void> add_pattern(const GrayImage& pattern, std::uint32_t set_id,
                         const TrackerRecordOptions* loop, BundleContent& content) {
  std::vector<std::byte> record;
  if (loop != nullptr) {
    auto baked = bake_tracker_record(pattern, *loop);
    if (!baked) return tl::unexpected(baked.error());
    record = std::move(*baked);
  }
  add_record(pattern, std::move(record), content);
  for (const ParameterSetRecord& set : content.parameter_sets) {
    auto features = describe_image(pattern, set);
    if (!features) return tl::unexpected(features.error());
    auto yml = features_to_yml(*features);
    if (!yml) return tl::unexpected(yml.error());
    content.features.back().push_back({set_id, features->descriptor_bytes,
                                       std::move(features->keypoints),
                                       std::move(features->descriptors), std::move(*yml)});
  }
  return {};
}

Result<std::vector<std::byte>> bytes_of(const BundleContent& content) {
  std::vector<std::byte> bytes;
  const auto written = write_bundle(content, [&](std::span<const std::byte> part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  });
  if (!written) return tl::unexpected(written.error());
  return bytes;
}

Result<std::vector<std::byte>> bundle_of(const std::vector<GrayPicture>& pictures,
                                         std::uint32_t set_id, bool ours) {
  const TrackerRecordOptions loop;
  BundleContent content;
  for (ParameterSetRecord set : paper_parameter_sets()) {
    if (set.id != set_id) continue;
    set.name = content.intern(parameter_set_name(set_id));
    content.parameter_sets.push_back(set);
  }
  for (const GrayPicture& picture : pictures) {
    if (auto added = add_pattern(picture.view(), set_id, ours ? &loop : nullptr, content); !added) {
      return tl::unexpected(added.error());
    }
  }
  return bytes_of(content);
}

template <class Method>
Result<void> run(Method& method, const GrayImage& frame, const FrameTruth& truth, Tally& tally) {
  const double start = thread_seconds();
  auto result = method.step(frame);
  const double ms = 1e3 * (thread_seconds() - start);
  if (!result) return tl::unexpected(result.error());
  tally.add(*result, truth, ms);
  return {};
}

/// Mean distance of the four corners.
double corner_error(const Detection& detection, const FrameTruth& truth) {
  double error = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    error += 0.25 * glm::length(detection.corners[i] - truth.corners[i]);
  }
  return error;
}

}  // namespace

Result<std::vector<std::byte>> bundle_of_pattern(const GrayImage& pattern,
                                                 const TrackerRecordOptions& options) {
  BundleContent content;
  if (auto added = add_pattern(pattern, 0, &options, content); !added) {
    return tl::unexpected(added.error());
  }
  return bytes_of(content);
}

Result<std::vector<std::byte>> bundle_of_record(const GrayImage& pattern,
                                                std::vector<std::byte> record) {
  BundleContent content;
  add_record(pattern, std::move(record), content);
  return bytes_of(content);
}

Result<std::vector<std::byte>> bundle_of_records(std::span<const GrayPicture> patterns,
                                                 std::span<const std::vector<std::byte>> records) {
  BundleContent content;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    add_record(patterns[i].view(), records[i], content);
  }
  return bytes_of(content);
}

Result<Subject> make_subject(const std::vector<std::string>& paths, const PoseBenchOptions& options,
                             const Camera& camera, bool track) {
  Subject subject;
  for (const std::string& path : paths) {
    bool shrunk = false;
    auto picture = load_pattern(path, shrunk);
    if (!picture) return tl::unexpected(picture.error());
    subject.pictures.push_back(std::move(*picture));
  }
  // Callers that want neither method run loops of their own over the bytes.
  const bool paper_alone = options.paper_set != 0 && !options.ours;
  auto bytes = bundle_of(subject.pictures, options.paper_set, !paper_alone);
  if (!bytes) return tl::unexpected(bytes.error());
  subject.bytes = std::move(*bytes);
  const auto bundle = BundleView::open(subject.bytes);
  if (!bundle) return tl::unexpected(bundle.error());
  if (options.paper_set != 0) {
    auto paper = PaperTracker::create(*bundle, options.paper_set, camera);
    if (!paper) return tl::unexpected(paper.error());
    subject.paper = std::move(*paper);
  }
  if (options.ours) {
    PoseLoopOptions loop;
    loop.track = track;
    auto ours = PoseLoop::create(*bundle, camera, loop);
    if (!ours) return tl::unexpected(ours.error());
    subject.ours = std::move(*ours);
  }
  return subject;
}

bool is_right(const Detection& detection, const FrameTruth& truth) {
  return corner_error(detection, truth) < kRight;
}

Tally::Tally(std::string band, const char* method, bool sequence) {
  row_.band = std::move(band);
  row_.method = method;
  row_.sequence = sequence;
}

void Tally::add(const TrackResult& result, const FrameTruth& truth, double ms) {
  ++row_.frames;
  row_.ms += ms;
  row_.stages_ms[0] += result.times.detect;
  row_.stages_ms[1] += result.times.describe;
  row_.stages_ms[2] += result.times.match;
  row_.stages_ms[3] += result.times.homography + result.times.pose;
  if (!truth.pattern) {
    ++row_.without_pattern;
    row_.false_found += result.visible.empty() ? 0 : 1;
  }
  if (!truth.pattern || result.visible.empty()) {
    have_last_ = false;
    return;
  }
  ++row_.recognised;
  const auto better = [&](const Detection& a, const Detection& b) {
    return corner_error(a, truth) < corner_error(b, truth);
  };
  const Detection& seen = *std::min_element(result.visible.begin(), result.visible.end(), better);
  const double error = corner_error(seen, truth);
  std::array<glm::dvec2, 4> miss;
  for (std::size_t i = 0; i < 4; ++i) miss[i] = seen.corners[i] - truth.corners[i];
  const bool right = error < kRight;
  if (right) {
    ++row_.right;
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

PoseBenchRow Tally::finish() {
  const double frames = std::max(row_.frames, 1);
  row_.ms /= frames;
  for (double& stage : row_.stages_ms) stage /= frames;
  if (!errors_.empty()) {
    const auto middle = errors_.begin() + static_cast<std::ptrdiff_t>(errors_.size() / 2);
    std::nth_element(errors_.begin(), middle, errors_.end());
    row_.error_px = *middle;
  }
  if (changes_ > 0) row_.jitter_px = std::sqrt(change_ / changes_);
  return row_;
}

Result<void> Tallies::measure(Subject& subject, const GrayImage& frame, const FrameTruth& truth) {
  if (subject.paper) {
    if (auto done = run(*subject.paper, frame, truth, paper); !done) return done;
  }
  if (subject.ours) {
    if (auto done = run(*subject.ours, frame, truth, ours); !done) return done;
  }
  return {};
}

void Tallies::finish(const PoseBenchOptions& options, std::vector<PoseBenchRow>& rows) {
  if (options.paper_set != 0) rows.push_back(paper.finish());
  if (options.ours) rows.push_back(ours.finish());
}

}  // namespace modar
