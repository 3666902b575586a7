// What a person sees on stderr.
#include "bake/terminal.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <new>

namespace modar {

namespace {

constexpr double kEstimateAfter = 5.0;  // seconds: shorter stages end before one has read it

}  // namespace

std::string time_left(double done, double elapsed_s) {
  if (elapsed_s < kEstimateAfter || done <= 0 || done >= 1) return "";
  const double left = elapsed_s * (1 - done) / done;
  char text[48];
  if (left < 100) {
    std::snprintf(text, sizeof text, ", about %.0f s left", left);
  } else {
    std::snprintf(text, sizeof text, ", about %.0f min left", left / 60);
  }
  return text;
}

ProgressBar::ProgressBar(bool quiet)
    : active_(!quiet), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now()) {}

ProgressBar::~ProgressBar() {
  clear();
}

void ProgressBar::show(const std::string& stage, double done) {
  if (!active_) return;
  const bool begins = stage != stage_;
  if (begins) {
    stage_ = stage;
    start_ = Clock::now();
    next_words_s_ = kEstimateAfter;
  }
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  const std::string left = time_left(done, elapsed);
  const int percent = static_cast<int>(done * 100 + 0.5);
  if (!terminal_) {
    if (begins) std::fprintf(stderr, "%s\n", stage.c_str());
    if (left.empty() || elapsed < next_words_s_) return;
    std::fprintf(stderr, "%s: %d %%%s\n", stage.c_str(), percent, left.c_str());
    next_words_s_ = 2 * elapsed;
    return;
  }
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(done * kWidth + 0.5);
  std::string bar(static_cast<std::size_t>(filled), '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r\x1b[K[%s] %3d %% %s%s", bar.c_str(), percent, stage.c_str(),
               left.c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::clear() {
  if (!drawn_) return;
  std::fputs("\r\x1b[K", stderr);
  drawn_ = false;
}

int print_error(const Error& error) {
  std::fprintf(stderr, "modar: error: %s\n", to_line(error).c_str());
  return static_cast<int>(error.exit);
}

int guarded(const std::function<int()>& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return print_error({ExitCode::kIo, "modar.memory", "",
                        "there is not enough memory, or not enough room on the disk for --memory",
                        "free some, or give `modar bake` a --memory below what the machine has"});
  } catch (const std::exception& error) {
    return print_error({ExitCode::kInternal, "modar.bug", "", error.what(),
                        "this is a bug of ours: please report it with the command line"});
  }
}

void print_diagnostic(const Diagnostic& diagnostic) {
  const char* severity = diagnostic.severity == DiagnosticSeverity::kInfo      ? "note"
                         : diagnostic.severity == DiagnosticSeverity::kWarning ? "warning"
                                                                               : "error";
  std::string line = std::string(severity) + ": " + diagnostic.file;
  if (diagnostic.line != 0) line += ":" + std::to_string(diagnostic.line);
  line += ": " + diagnostic.message;
  if (!diagnostic.cure.empty()) line += "; " + diagnostic.cure;
  std::fprintf(stderr, "%s [%s]\n", line.c_str(), diagnostic.id.c_str());
}

ProcessCost process_cost() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {seconds(usage.ru_utime) + seconds(usage.ru_stime),
          static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
}

std::string human_bytes(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < std::size(kUnits)) {
    value /= 1000;
    ++unit;
  }
  char text[32];
  const char* format = unit == 0 || value >= 99.95 ? "%.0f %s"
                       : value >= 9.995            ? "%.1f %s"
                                                   : "%.2f %s";
  std::snprintf(text, sizeof text, format, value, kUnits[unit]);
  return text;
}

}  // namespace modar
