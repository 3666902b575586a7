// What a person sees on stderr: a progress bar on a terminal, errors with their cure.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Shows what a command is at. On a terminal one line that is overwritten; elsewhere a line a
/// stage. A stage that has run for 5 seconds gets an estimate of the remaining time, from the
/// finished part. as_json: a line {"stage", "done"} for each percent, for programs.
class ProgressBar {
 public:
  explicit ProgressBar(bool quiet, bool as_json = false);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  /// done: 0 to 1.
  void show(const std::string& name, double done);
  /// Wipes the line, before other words are printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  void print_json(double done);

  bool active_;
  bool json_;
  bool terminal_;
  int percent_ = -1;  ///< that was printed last as JSON
  bool drawn_ = false;
  std::string stage_;
  Clock::time_point start_;
  double next_words_s_ = 0;  ///< elsewhere: when the stage's next estimate is due
};

/// ", about 40 s left" from the part done after this time; empty before 5 s, and where nothing is
/// done.
std::string time_left(double done, double elapsed_s);

/// "modar: error: where: cause; cure [code]" on stderr. Answers the exit code.
int print_error(const Error& error);
/// What a program does between its first and last line. An exception that nobody caught is reported
/// as a bug of ModAR.
int guarded(const std::function<int()>& work);
/// The rest of the output goes to stdout; `code`, or that of an error where it does not arrive
/// there (a full disk, kIo "io.stdout"). The last thing that a program does.
int finish_output(int code);
/// All findings of a bake on stderr, each once: notes first, warnings after them, errors last. Of
/// many of one kind the first are shown and the others counted, unless `all` are wanted.
void print_findings(const std::vector<Diagnostic>& findings, bool all);
/// What of the files is not in a bundle and would be missed, on stderr, as a bake's last lines:
/// many faces, or a texture or material file that is missing or cannot be read.
void print_losses(const std::vector<Diagnostic>& findings);
/// "warning: file:line: message; cure [id]" on stderr.
void print_diagnostic(const Diagnostic& diagnostic);

/// A word on stderr where others than its owner may read a secret key. ssh refuses such keys; in a
/// container they may be mounted readable to all.
void warn_of_readers(const std::string& path);

/// CPU time of the process (user and system) and its greatest resident size.
struct ProcessCost {
  double cpu_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
};
ProcessCost process_cost();

/// "1.2 MB": powers of 1000, three significant digits.
std::string human_bytes(std::uint64_t bytes);

}  // namespace modar
