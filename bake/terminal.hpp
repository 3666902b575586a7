// What a person sees on stderr: a progress bar on a terminal, errors with their cure.
#pragma once

#include <functional>
#include <string>

#include "bake/report.hpp"
#include "formats/error.hpp"

namespace modar {

/// Draws one line that is overwritten. Silent where stderr is no terminal or quiet is set.
class ProgressBar {
 public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  /// done: 0 to 1.
  void show(const std::string& stage, double done);
  /// Wipes the line, before other words are printed.
  void clear();

 private:
  bool active_;
  bool drawn_ = false;
};

/// "modar: error: where: cause; cure [code]" on stderr. Answers the exit code.
int print_error(const Error& error);
/// What a program does between its first and last line. An exception that nobody caught is told as
/// a bug of ours.
int guarded(const std::function<int()>& work);
/// "warning: file:line: message; cure [id]" on stderr.
void print_diagnostic(const Diagnostic& diagnostic);

/// CPU time of the process (user and system) and its greatest resident size.
struct ProcessCost {
  double cpu_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
};
ProcessCost process_cost();

/// "1.2 MB": powers of 1000, three significant digits.
std::string human_bytes(std::uint64_t bytes);

}  // namespace modar
