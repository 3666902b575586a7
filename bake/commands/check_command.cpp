// `modar check`: is this bundle good? Verdict first, then one line an issue.
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "bake/commands/commands.hpp"
#include "bake/commands/json_output.hpp"
#include "bake/commands/terminal.hpp"
#include "bake/yml_rule.hpp"
#include "formats/check.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr std::size_t kMaxRepeats = 20;  ///< issues of one kind that are printed or listed

const char* severity_name(Severity severity) {
  return severity == Severity::kInfo      ? "info"
         : severity == Severity::kWarning ? "warning"
                                          : "error";
}

void print_issues(const std::string& path, bool good, const std::vector<Issue>& issues,
                  const std::map<std::string, std::size_t>& counts) {
  std::printf("%s: %s\n", path.c_str(), good ? "good" : "BAD");
  for (const Issue& issue : issues) {
    std::printf("%s %s %s (byte %llu): %s%s%s; %s\n", severity_name(issue.kind->severity),
                issue.kind->id, issue.where.c_str(), static_cast<unsigned long long>(issue.offset),
                issue.kind->message, issue.detail.empty() ? "" : ": ", issue.detail.c_str(),
                issue.kind->cure);
  }
  for (const auto& [id, count] : counts) {
    if (count > kMaxRepeats) {
      std::printf("... and %zu more of %s\n", count - kMaxRepeats, id.c_str());
    }
  }
}

}  // namespace

int run_check(const CheckCommand& command) {
  if (command.list_issues) {
    std::fputs(issues_markdown().c_str(), stdout);
    return static_cast<int>(ExitCode::kOk);
  }
  if (command.mutations > 0) return run_mutate(command);
  Result<MappedFile> file = MappedFile::open(command.bundle);
  if (!file) return print_error(file.error());

  std::vector<Issue> issues;
  std::map<std::string, std::size_t> counts;
  bool warned = false;
  const IssueSink sink = [&](const Issue& issue) {
    warned = warned || issue.kind->severity == Severity::kWarning;
    if (counts[issue.kind->id]++ < kMaxRepeats) issues.push_back(issue);
  };
  expect_reading(file->bytes());
  bool good = check_bundle(file->bytes(), sink, {.release = forget_read});
  // The text twin needs OpenCV's parser, so this rule stands outside of formats/.
  if (good) good = check_yml_twins(file->bytes(), sink);
  if (command.warnings_as_errors && warned) good = false;

  if (command.json) {
    std::fputs(check_json(good, issues).c_str(), stdout);
  } else {
    print_issues(command.bundle, good, issues, counts);
  }
  return static_cast<int>(good ? ExitCode::kOk : ExitCode::kInvalidInput);
}

}  // namespace modar
