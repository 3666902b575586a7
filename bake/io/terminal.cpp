// What a person sees on stderr.
#include "bake/io/terminal.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <set>
#include <tuple>
#include <vector>

#include "bake/json.hpp"
#include "formats/base/ranges.hpp"

namespace modar {

namespace {

constexpr double kEstimateAfter = 5.0;     // seconds: shorter stages end before one has read it
constexpr std::size_t kWarningsShown = 3;  // of one kind
constexpr std::size_t kNotesShown = 4;     // kinds

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

ProgressBar::ProgressBar(bool quiet, bool as_json)
    : active_(!quiet || as_json),
      json_(as_json),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()) {}

ProgressBar::~ProgressBar() {
  clear();
}

void ProgressBar::show(const std::string& name, double done) {
  if (!active_) return;
  const std::string stage = printable(name);
  const bool begins = stage != stage_;
  if (begins) {
    stage_ = stage;
    start_ = Clock::now();
    next_words_s_ = kEstimateAfter;
    percent_ = -1;
  }
  if (json_) return print_json(done);
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  const std::string left = time_left(done, elapsed);
  const int percent = static_cast<int>(done * 100 + 0.5);
  if (!terminal_) {
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

void ProgressBar::print_json(double done) {
  const int percent = static_cast<int>(done * 100);
  if (percent == percent_) return;
  percent_ = percent;
  std::string line = Json{{"stage", stage_}, {"done", done}}.dump();
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "%s\n", line.c_str());
  std::fflush(stderr);
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

int finish_output(int code) {
  const bool failed = std::ferror(stdout) != 0;
  if (std::fflush(stdout) == 0 && !failed) return code;
  if (!failed && (errno == EPIPE || errno == EBADF)) return code;  // nobody wants it
  const char* cause = failed ? "it could not be written completely" : std::strerror(errno);
  const int told = print_error(
      {ExitCode::kIo, "io.stdout", "standard output", cause, "free space at its destination"});
  return code == 0 ? told : code;
}

int guarded(const std::function<int()>& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return print_error(
        {ExitCode::kIo, "modar.memory", "",
         "not enough memory, or not enough disk space for --memory",
         "free some, or use `modar bake --memory` with less than the machine's memory"});
  } catch (const std::exception& error) {
    return print_error({ExitCode::kInternal, "modar.bug", "", error.what(),
                        "internal error: please report it with the command line"});
  }
}

namespace {

/// The colour of warnings and errors on a terminal, and its end.
const char* colour_of(DiagnosticSeverity severity) {
  if (isatty(STDERR_FILENO) != 1) return "";
  return severity == DiagnosticSeverity::kInfo      ? ""
         : severity == DiagnosticSeverity::kWarning ? "\x1b[1;33m"
                                                    : "\x1b[1;31m";
}

const char* severity_word(DiagnosticSeverity severity) {
  return severity == DiagnosticSeverity::kInfo      ? "note"
         : severity == DiagnosticSeverity::kWarning ? "warning"
                                                    : "error";
}

/// Findings of one kind: printed whole up to `whole` of them, then counted.
void print_group(const std::vector<const Diagnostic*>& group, std::size_t whole) {
  const std::size_t shown = group.size() > whole ? std::max<std::size_t>(whole, 1) : group.size();
  for (std::size_t i = 0; i < shown; ++i) {
    Diagnostic one = *group[i];
    if (i + 1 == shown && shown < group.size()) {
      one.cure += (one.cure.empty() ? "" : "; ") + std::to_string(group.size() - shown) +
                  " more of this kind: --notes shows them";
    }
    print_diagnostic(one);
  }
}

}  // namespace

void print_losses(const std::vector<Diagnostic>& findings) {
  std::set<std::string> said;
  for (const Diagnostic& d : findings) {
    constexpr std::array<std::string_view, 4> kEnds = {"missing-map", "missing-image",
                                                       "missing-texture", "missing-mtl"};
    const bool lost = d.id == "model.lost" || d.id.starts_with("image.") ||
                      ranges::any_of(kEnds, [&](auto end) { return d.id.ends_with(end); });
    if (!lost || d.severity == DiagnosticSeverity::kInfo) continue;
    const std::string what = d.id.starts_with("image.") ? "'" + d.file + "': " : "";
    if (!said.insert(what + d.message).second) continue;
    std::fprintf(stderr, "not complete: %s\n", printable(what + d.message).c_str());
  }
}

void print_findings(const std::vector<Diagnostic>& findings, bool all) {
  // A warning is the same one however often it is found in a file.
  std::vector<const Diagnostic*> once;
  std::set<std::tuple<std::string, std::string, std::uint64_t, std::string>> seen;
  for (const Diagnostic& one : findings) {
    if (seen.insert({one.id, one.file, one.line, one.message}).second) once.push_back(&one);
  }
  for (const auto severity :
       {DiagnosticSeverity::kInfo, DiagnosticSeverity::kWarning, DiagnosticSeverity::kError}) {
    std::vector<std::vector<const Diagnostic*>> groups;  // by id, in the order of the first
    for (const Diagnostic* one : once) {
      if (one->severity != severity) continue;
      auto group = std::find_if(groups.begin(), groups.end(),
                                [&](const auto& known) { return known[0]->id == one->id; });
      if (group == groups.end()) group = groups.emplace(group);
      group->push_back(one);
    }
    const bool notes = severity == DiagnosticSeverity::kInfo;
    const std::size_t whole = all ? findings.size() : notes ? 1 : kWarningsShown;
    std::size_t left_out = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (notes && !all && g >= kNotesShown) {
        left_out += groups[g].size();
      } else {
        print_group(groups[g], whole);
      }
    }
    if (left_out != 0) {
      std::fprintf(stderr, "note: %zu more %s; --notes shows them\n", left_out,
                   left_out == 1 ? "note" : "notes");
    }
  }
}

void print_diagnostic(const Diagnostic& diagnostic) {
  const char* colour = colour_of(diagnostic.severity);
  const std::string severity =
      colour + std::string(severity_word(diagnostic.severity)) + (*colour == '\0' ? "" : "\x1b[0m");
  std::string line = diagnostic.file;
  if (diagnostic.line != 0) line += ":" + std::to_string(diagnostic.line);
  line += ": " + diagnostic.message;
  if (!diagnostic.cure.empty()) line += "; " + diagnostic.cure;
  std::fprintf(stderr, "%s: %s [%s]\n", severity.c_str(), printable(line).c_str(),
               diagnostic.id.c_str());
}

void warn_of_readers(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return;
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) == 0) return;
  std::fprintf(
      stderr,
      "modar: warning: %s: other users can read this secret key: chmod 600, or move it to a "
      "disk that has permissions [key.mode]\n",
      printable(path).c_str());
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
