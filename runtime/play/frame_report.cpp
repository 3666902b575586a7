// Statistics, and their JSON.
#include "frame_report.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "formats/json_writer.hpp"
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

/// To three decimals, which times are worth.
void rounded(JsonWriter& writer, const char* key, double value) {
  writer.put(key, std::round(value * 1000.0) / 1000.0);
}

/// An object whose members fill(writer) writes, without a line's end.
template <class Fill>
std::string json_line(const Fill& fill) {
  JsonWriter writer;
  writer.object([&] { fill(writer); });
  return writer.str();
}

/// Of the unit square to the corners.
void homography(JsonWriter& writer, const std::array<glm::dvec2, 4>& corners) {
  constexpr std::array<glm::dvec2, 4> kSquare = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  const auto map = homography_from_points(kSquare, corners);
  if (!map) return writer.put("homography", NAN);
  writer.array("homography", [&] {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) writer.add((*map)[column][row]);
    }
  });
}

void detection(JsonWriter& writer, const Detection& seen, std::span<const std::string> names,
               bool numbered, bool homographies) {
  writer.put("pattern", seen.pattern < names.size() ? std::string_view(names[seen.pattern]) : "");
  if (numbered) writer.put("copy", seen.copy);
  writer.array("corners", [&] {
    for (const glm::dvec2& corner : seen.corners) {
      writer.array([&] {
        writer.add(corner.x);
        writer.add(corner.y);
      });
    }
  });
  writer.array("rotation", [&] {
    for (int row = 0; row < 3; ++row) {
      // GLM's first index is the column.
      for (int column = 0; column < 3; ++column) {
        writer.add(seen.pose.rotation[column][row]);
      }
    }
  });
  writer.array("translation", [&] {
    for (int i = 0; i < 3; ++i) writer.add(seen.pose.translation[i]);
  });
  if (seen.stretch != glm::dmat4x3(1.0)) {
    writer.array("stretch", [&] {
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) writer.add(seen.stretch[column][row]);
      }
    });
  }
  writer.put("inliers", seen.inliers);
  writer.put("matches", seen.matches);
  rounded(writer, "fit", seen.matches > 0 ? std::min(1.0, 1.0 * seen.inliers / seen.matches) : 0.0);
  rounded(writer, "agreeing", seen.agreeing);
  rounded(writer, "likeness", seen.likeness);
  if (seen.extended) {
    writer.put("extended", true);
    writer.put("position_sigma", seen.position_sigma);
    writer.put("rotation_sigma", seen.rotation_sigma);
  }
  if (homographies) homography(writer, seen.corners);
}

/// In pixels of the file, of a frame that was reduced.
FrameReport in_file(FrameReport report) {
  if (report.reduced == 1) return report;  // to the last bit
  for (Detection& seen : report.visible) {
    for (glm::dvec2& corner : seen.corners) corner = report.reduced * (corner + 0.5) - 0.5;
  }
  return report;
}

void camera(JsonWriter& writer, const CameraReport& camera) {
  writer.object("camera", [&] {
    rounded(writer, "focal_px", camera.focal.focal);
    if (camera.focal.estimated) rounded(writer, "sigma_px", camera.focal.sigma);
    writer.put("source", camera.given ? "given" : camera.focal.estimated ? "estimated" : "assumed");
  });
}

void times(JsonWriter& writer, const StageTimes& ms) {
  writer.object("ms", [&] {
    for (std::size_t i = 0; i < ms.size(); ++i) rounded(writer, kStageNames[i], ms[i]);
  });
}

/// Of frames, by the reason why nothing was visible.
void reasons(JsonWriter& writer, const RunStats& stats) {
  writer.object("reasons", [&] {
    for (const Reason reason : kReasons) {
      if (stats.count(reason) > 0) writer.put(to_string(reason), stats.count(reason));
    }
  });
}

void scene(JsonWriter& writer, const SceneState& log) {
  if (!log.commands.empty()) {
    writer.array("commands", [&] {
      for (const std::string& each : log.commands) writer.add(each);
    });
  }
  if (!log.caption.empty()) writer.put("caption", log.caption);
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
  static constexpr char kNames[][7] = {"shown", "held", "hidden"};  // no pointers to relocate
  return kNames[static_cast<std::size_t>(state)];
}

std::string frame_line(const FrameReport& frame, std::span<const std::string> pattern_names,
                       bool homographies) {
  const FrameReport report = in_file(frame);
  return json_line([&](JsonWriter& writer) {
    writer.put("frame", report.frame);
    writer.put("time_s", report.time_s);
    writer.array("visible", [&] {
      for (const Detection& seen : report.visible) {
        writer.object(
            [&] { detection(writer, seen, pattern_names, report.numbered, homographies); });
      }
    });
    writer.put("reason", to_string(report.reason));
    writer.put("state", to_string(report.state));
    if (report.scene != nullptr) scene(writer, *report.scene);
    camera(writer, report.camera);
    times(writer, report.ms);
  });
}

std::string summary_line(const RunStats& stats) {
  return json_line([&](JsonWriter& writer) {
    writer.object("summary", [&] {
      writer.put("frames", stats.frames());
      writer.put("dropped", stats.dropped());
      writer.put("skipped", stats.skipped());
      writer.put("visible", stats.visible());
      writer.put("recognised_percent", stats.recognised_percent());
      writer.object("states", [&] {
        for (const Shown state : {Shown::kShown, Shown::kHeld, Shown::kHidden}) {
          writer.put(to_string(state), stats.count(state));
        }
      });
      reasons(writer, stats);
      writer.put("late", stats.late());
      writer.object("uploads", [&] {
        writer.put("bytes", stats.uploads().bytes);
        writer.put("same", stats.uploads().same);
      });
      if (stats.camera()) camera(writer, *stats.camera());
      times(writer, stats.median_ms());
    });
  });
}

std::string turntable_line(const TurntableReport& report) {
  return json_line([&](JsonWriter& writer) {
    writer.put("frame", report.frame);
    writer.put(report.pattern ? "pattern" : "model", report.name);
    if (!report.clip.empty()) writer.put("clip", report.clip);
    writer.put("angle_deg", report.angle_deg);
    writer.put("triangles", report.triangles);
    writer.put("draw_calls", report.draw_calls);
    writer.object("ms", [&] { rounded(writer, "render", report.render_ms); });
  });
}

namespace {

/// Of a log: to three decimals, and 0 where it is not finite.
void figure(JsonWriter& writer, const char* key, double value) {
  rounded(writer, key, std::isfinite(value) ? value : 0);
}

void times(JsonWriter& writer, const RunStats& stats) {
  const StageTimes median = stats.quantile_ms(0.5);
  const StageTimes most = stats.quantile_ms(0.95);
  const StageTimes worst = stats.quantile_ms(1);
  writer.object("ms", [&] {
    for (std::size_t i = 0; i < median.size(); ++i) {
      writer.object(kStageNames[i], [&] {
        figure(writer, "median", median[i]);
        figure(writer, "p95", most[i]);
        figure(writer, "max", worst[i]);
      });
    }
  });
}

void memory_of(JsonWriter& writer, const MemoryByKind& memory) {
  writer.object("memory", [&] {
    writer.put("resident", memory.resident);
    writer.put("heap", memory.heap);
    writer.put("bundle", memory.bundle);
    writer.put("bundle_resident", memory.bundle_resident);
    writer.put("gpu_geometry", memory.gpu_geometry);
    writer.put("gpu_textures", memory.gpu_textures);
    writer.put("gpu_batches", memory.gpu_batches);
  });
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
  MODAR_TRY(log.write(json_line([&](JsonWriter& writer) {
    writer.object("qos", [&] {
      writer.put("version", 1);
      writer.put("bundle", head.bundle);
      writer.put("input", head.input);
      writer.put("method", head.method);
      writer.put("parameters", head.parameters);
      writer.put("gl_renderer", head.gl_renderer);
      writer.put("gl_version", head.gl_version);
      writer.put("device", head.device);
      figure(writer, "budget_ms", kFrameBudgetMs);
    });
  })));
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
    const std::string line = json_line([&](JsonWriter& writer) {
      writer.put("event", detection != nullptr ? "found" : "lost");
      writer.put("pattern", pattern_names[pattern]);
      writer.put("frame", report.frame);
      figure(writer, "time_s", report.time_s);
      figure(writer, "after_s", report.time_s - since_s_[pattern]);
      if (detection != nullptr) {
        writer.put("inliers", detection->inliers);
      } else {
        writer.put("reason", to_string(report.reason));
      }
    });
    seen_[pattern] = detection != nullptr;
    since_s_[pattern] = report.time_s;
    MODAR_TRY(write(line));
  }
  window_.add(report);
  return {};
}

Result<void> QosLog::window(const MemoryByKind& memory) {
  const std::string line = json_line([&](JsonWriter& writer) {
    writer.object("second", [&] {
      figure(writer, "from_s", window_start_s_);
      writer.put("frames", window_.frames());
      writer.put("visible", window_.visible());
      writer.put("held", window_.count(Shown::kHeld));
      writer.put("hidden", window_.count(Shown::kHidden));
      writer.put("late", window_.late());
      reasons(writer, window_);
      times(writer, window_);
      memory_of(writer, memory);
    });
  });
  window_ = RunStats();
  window_start_s_ = last_s_;
  return write(line);
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
