// Statistics, and JSON by RapidJSON: shortest digits that read back the same, in any locale.
#include "frame_report.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#define RAPIDJSON_NOMEMBERITERATORCLASS
#include <rapidjson/stringbuffer.h>
#include <rapidjson/writer.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "modar/pose.hpp"

namespace modar {

void RunStats::add(const FrameReport& report) {
  std::array<float, kStageNames.size()> times{};
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<float>(report.ms[i]);
  times_.push_back(times);
  ++states_[static_cast<std::size_t>(report.state)];
  ++reasons_[static_cast<std::size_t>(report.reason)];
  if (!report.visible.empty()) ++visible_;
  camera_ = report.camera;
  if (report.at(Stage::kLatency) > kFrameBudgetMs) ++late_;
}

double RunStats::recognised_percent() const {
  if (times_.empty()) return 0;
  return 100.0 * static_cast<double>(visible_) / static_cast<double>(times_.size());
}

StageTimes RunStats::quantile_ms(double share) const {
  StageTimes result{};
  if (times_.empty()) return result;
  std::vector<float> column(times_.size());
  const double last = static_cast<double>(column.size() - 1);
  const auto place = static_cast<std::ptrdiff_t>(share * last);
  for (std::size_t stage = 0; stage < result.size(); ++stage) {
    for (std::size_t i = 0; i < times_.size(); ++i) column[i] = times_[i][stage];
    std::nth_element(column.begin(), column.begin() + place, column.end());
    result[stage] = static_cast<double>(column[static_cast<std::size_t>(place)]);
  }
  return result;
}

namespace {

using Writer = rapidjson::Writer<rapidjson::StringBuffer>;

void text(Writer& writer, std::string_view value) {
  writer.String(value.data(), static_cast<rapidjson::SizeType>(value.size()));
}

void number(Writer& writer, double value) {
  if (std::isfinite(value)) {
    writer.Double(value);
  } else {
    writer.Null();
  }
}

/// Times are worth three decimals.
void rounded(Writer& writer, double value) {
  number(writer, std::round(value * 1000.0) / 1000.0);
}

/// Of the unit square to the corners.
void homography(Writer& writer, const std::array<glm::dvec2, 4>& corners) {
  constexpr std::array<glm::dvec2, 4> kSquare = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  writer.Key("homography");
  const auto map = homography_from_points(kSquare, corners);
  if (!map) {
    writer.Null();
    return;
  }
  writer.StartArray();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) number(writer, (*map)[column][row]);
  }
  writer.EndArray();
}

void detection(Writer& writer, const Detection& seen, std::span<const std::string> names,
               bool homographies) {
  writer.StartObject();
  writer.Key("pattern");
  text(writer, seen.pattern < names.size() ? std::string_view(names[seen.pattern]) : "");
  writer.Key("corners");
  writer.StartArray();
  for (const glm::dvec2& corner : seen.corners) {
    writer.StartArray();
    number(writer, corner.x);
    number(writer, corner.y);
    writer.EndArray();
  }
  writer.EndArray();
  writer.Key("rotation");
  writer.StartArray();
  for (int row = 0; row < 3; ++row) {
    // GLM's first index is the column.
    for (int column = 0; column < 3; ++column) number(writer, seen.pose.rotation[column][row]);
  }
  writer.EndArray();
  writer.Key("translation");
  writer.StartArray();
  for (int i = 0; i < 3; ++i) number(writer, seen.pose.translation[i]);
  writer.EndArray();
  if (seen.stretch != glm::dmat4x3(1.0)) {
    writer.Key("stretch");
    writer.StartArray();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) number(writer, seen.stretch[column][row]);
    }
    writer.EndArray();
  }
  writer.Key("inliers");
  writer.Int(seen.inliers);
  writer.Key("matches");
  writer.Int(seen.matches);
  writer.Key("fit");
  rounded(writer, seen.matches > 0 ? std::min(1.0, 1.0 * seen.inliers / seen.matches) : 0.0);
  writer.Key("agreeing");
  rounded(writer, seen.agreeing);
  writer.Key("likeness");
  rounded(writer, seen.likeness);
  if (seen.extended) {
    writer.Key("extended");
    writer.Bool(true);
    writer.Key("position_sigma");
    number(writer, seen.position_sigma);
    writer.Key("rotation_sigma");
    number(writer, seen.rotation_sigma);
  }
  if (homographies) homography(writer, seen.corners);
  writer.EndObject();
}

void camera(Writer& writer, const CameraReport& camera) {
  writer.Key("camera");
  writer.StartObject();
  writer.Key("focal_px");
  rounded(writer, camera.focal.focal);
  if (camera.focal.estimated) {
    writer.Key("sigma_px");
    rounded(writer, camera.focal.sigma);
  }
  writer.Key("source");
  writer.String(camera.given ? "given" : camera.focal.estimated ? "estimated" : "assumed");
  writer.EndObject();
}

void times(Writer& writer, const StageTimes& ms) {
  writer.Key("ms");
  writer.StartObject();
  for (std::size_t i = 0; i < ms.size(); ++i) {
    writer.Key(kStageNames[i]);
    rounded(writer, ms[i]);
  }
  writer.EndObject();
}

void scene(Writer& writer, const SceneLog& log) {
  if (!log.commands.empty()) {
    writer.Key("commands");
    writer.StartArray();
    for (const std::string& each : log.commands) text(writer, each);
    writer.EndArray();
  }
  if (!log.caption.empty()) {
    writer.Key("caption");
    text(writer, log.caption);
  }
}

}  // namespace

bool draws_in_software(std::string_view gl_renderer) {
  constexpr std::array<std::string_view, 5> kNames = {"llvmpipe", "softpipe", "swrast",
                                                      "Software Rasterizer", "SwiftShader"};
  return std::any_of(kNames.begin(), kNames.end(), [&](std::string_view name) {
    return gl_renderer.find(name) != std::string_view::npos;
  });
}

const char* to_string(Shown state) {
  switch (state) {
    case Shown::kShown:
      return "shown";
    case Shown::kHeld:
      return "held";
    case Shown::kHidden:
      break;
  }
  return "hidden";
}

std::string frame_line(const FrameReport& report, std::span<const std::string> pattern_names,
                       bool homographies) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("frame");
  writer.Uint64(report.frame);
  writer.Key("time_s");
  number(writer, report.time_s);
  writer.Key("visible");
  writer.StartArray();
  for (const Detection& seen : report.visible) {
    detection(writer, seen, pattern_names, homographies);
  }
  writer.EndArray();
  writer.Key("reason");
  writer.String(to_string(report.reason));
  writer.Key("state");
  writer.String(to_string(report.state));
  if (report.scene != nullptr) scene(writer, *report.scene);
  camera(writer, report.camera);
  times(writer, report.ms);
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

std::string summary_line(const RunStats& stats) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("summary");
  writer.StartObject();
  writer.Key("frames");
  writer.Uint64(stats.frames());
  writer.Key("dropped");
  writer.Uint64(stats.dropped());
  writer.Key("visible");
  writer.Uint64(stats.visible());
  writer.Key("recognised_percent");
  number(writer, stats.recognised_percent());
  writer.Key("states");
  writer.StartObject();
  for (const Shown state : {Shown::kShown, Shown::kHeld, Shown::kHidden}) {
    writer.Key(to_string(state));
    writer.Uint64(stats.count(state));
  }
  writer.EndObject();
  writer.Key("reasons");
  writer.StartObject();
  for (const Reason reason : kReasons) {
    if (stats.count(reason) == 0) continue;
    writer.Key(to_string(reason));
    writer.Uint64(stats.count(reason));
  }
  writer.EndObject();
  writer.Key("late");
  writer.Uint64(stats.late());
  if (stats.camera()) camera(writer, *stats.camera());
  times(writer, stats.median_ms());
  writer.EndObject();
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

std::string turntable_line(const TurntableReport& report) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("frame");
  writer.Uint64(report.frame);
  writer.Key(report.pattern ? "pattern" : "model");
  text(writer, report.name);
  writer.Key("angle_deg");
  number(writer, report.angle_deg);
  writer.Key("triangles");
  writer.Uint64(report.triangles);
  writer.Key("draw_calls");
  writer.Int(report.draw_calls);
  writer.Key("ms");
  writer.StartObject();
  writer.Key("render");
  rounded(writer, report.render_ms);
  writer.EndObject();
  writer.EndObject();
  return {buffer.GetString(), buffer.GetSize()};
}

namespace {

void text(Writer& writer, const char* key, std::string_view value) {
  writer.Key(key);
  writer.String(value.data(), static_cast<rapidjson::SizeType>(value.size()));
}

void count(Writer& writer, const char* key, std::uint64_t value) {
  writer.Key(key);
  writer.Uint64(value);
}

void number(Writer& writer, const char* key, double value) {
  writer.Key(key);
  writer.Double(std::isfinite(value) ? std::round(value * 1000) / 1000 : 0);
}

void times(Writer& writer, const RunStats& stats) {
  const StageTimes median = stats.quantile_ms(0.5);
  const StageTimes most = stats.quantile_ms(0.95);
  const StageTimes worst = stats.quantile_ms(1);
  writer.Key("ms");
  writer.StartObject();
  for (std::size_t i = 0; i < median.size(); ++i) {
    writer.Key(kStageNames[i]);
    writer.StartObject();
    number(writer, "median", median[i]);
    number(writer, "p95", most[i]);
    number(writer, "max", worst[i]);
    writer.EndObject();
  }
  writer.EndObject();
}

void reasons(Writer& writer, const RunStats& stats) {
  writer.Key("reasons");
  writer.StartObject();
  for (const Reason reason : kReasons) {
    if (stats.count(reason) > 0) count(writer, to_string(reason), stats.count(reason));
  }
  writer.EndObject();
}

void memory_of(Writer& writer, const MemoryByKind& memory) {
  writer.Key("memory");
  writer.StartObject();
  count(writer, "resident", memory.resident);
  count(writer, "heap", memory.heap);
  count(writer, "bundle", memory.bundle);
  count(writer, "bundle_resident", memory.bundle_resident);
  count(writer, "gpu_geometry", memory.gpu_geometry);
  count(writer, "gpu_textures", memory.gpu_textures);
  count(writer, "gpu_batches", memory.gpu_batches);
  writer.EndObject();
}

std::string_view view(const rapidjson::StringBuffer& buffer) {
  return {buffer.GetString(), buffer.GetSize()};
}

/// Second number of /proc/self/statm: resident pages.
std::uint64_t resident_pages() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  char line[128] = {};
  const std::size_t size = std::fread(line, 1, sizeof line - 1, file);
  std::fclose(file);
  const char* end = line + size;
  std::uint64_t pages = 0;
  const auto first = std::from_chars(line, end, pages);
  if (first.ptr == end) return 0;
  std::from_chars(first.ptr + 1, end, pages);
  return pages;
}

}  // namespace

MemoryByKind measure_memory(std::span<const std::byte> mapped) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  MemoryByKind memory;
  memory.resident = resident_pages() * page;
#ifdef __GLIBC__
  const struct mallinfo2 heap = mallinfo2();
  memory.heap = heap.uordblks + heap.hblkhd;
#endif
  memory.bundle = mapped.size();
  std::vector<unsigned char> pages((mapped.size() + page - 1) / page);
  void* start = const_cast<std::byte*>(mapped.data());
  if (!mapped.empty() && mincore(start, mapped.size(), pages.data()) == 0) {
    for (const unsigned char state : pages) memory.bundle_resident += (state & 1u) * page;
  }
  return memory;
}

Result<QosLog> QosLog::create(const std::string& path, const QosHead& head, double every_s) {
  MODAR_ASSIGN(AtomicFile file, AtomicFile::create(path));
  QosLog log(std::move(file), every_s);
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("qos");
  writer.StartObject();
  writer.Key("version");
  writer.Int(1);
  text(writer, "bundle", head.bundle);
  text(writer, "input", head.input);
  text(writer, "method", head.method);
  text(writer, "parameters", head.parameters);
  text(writer, "gl_renderer", head.gl_renderer);
  text(writer, "gl_version", head.gl_version);
  text(writer, "device", head.device);
  number(writer, "budget_ms", kFrameBudgetMs);
  writer.EndObject();
  writer.EndObject();
  MODAR_TRY(log.write(view(buffer)));
  return log;
}

bool QosLog::due(const FrameReport& report) const {
  return report.time_s - window_start_s_ >= every_s_ && window_.frames() > 0;
}

Result<void> QosLog::add(const FrameReport& report, std::span<const std::string> pattern_names) {
  seen_.resize(pattern_names.size());
  since_s_.resize(pattern_names.size());
  last_s_ = report.time_s;
  for (std::size_t pattern = 0; pattern < seen_.size(); ++pattern) {
    const Detection* detection = nullptr;
    for (const Detection& each : report.visible) {
      if (each.pattern == pattern) detection = &each;
    }
    if (seen_[pattern] == (detection != nullptr)) continue;
    rapidjson::StringBuffer buffer;
    Writer writer(buffer);
    writer.StartObject();
    text(writer, "event", detection != nullptr ? "found" : "lost");
    text(writer, "pattern", pattern_names[pattern]);
    count(writer, "frame", report.frame);
    number(writer, "time_s", report.time_s);
    number(writer, "after_s", report.time_s - since_s_[pattern]);
    if (detection != nullptr) {
      count(writer, "inliers", static_cast<std::uint64_t>(detection->inliers));
    } else {
      text(writer, "reason", to_string(report.reason));
    }
    writer.EndObject();
    seen_[pattern] = detection != nullptr;
    since_s_[pattern] = report.time_s;
    MODAR_TRY(write(view(buffer)));
  }
  window_.add(report);
  return {};
}

Result<void> QosLog::window(const MemoryByKind& memory) {
  rapidjson::StringBuffer buffer;
  Writer writer(buffer);
  writer.StartObject();
  writer.Key("second");
  writer.StartObject();
  number(writer, "from_s", window_start_s_);
  count(writer, "frames", window_.frames());
  count(writer, "visible", window_.visible());
  count(writer, "held", window_.count(Shown::kHeld));
  count(writer, "hidden", window_.count(Shown::kHidden));
  count(writer, "late", window_.late());
  reasons(writer, window_);
  times(writer, window_);
  memory_of(writer, memory);
  writer.EndObject();
  writer.EndObject();
  window_ = RunStats();
  window_start_s_ = last_s_;
  return write(view(buffer));
}

Result<void> QosLog::finish(std::string_view summary) {
  MODAR_TRY(write(summary));
  return file_.commit();
}

Result<void> QosLog::write(std::string_view line) {
  MODAR_TRY(file_.write(std::as_bytes(std::span(line))));
  return file_.write(std::as_bytes(std::span("\n", 1)));
}

}  // namespace modar
