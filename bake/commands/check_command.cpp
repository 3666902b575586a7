// `modar check`: is this bundle good? Verdict first, then one line an issue.
#include <cstdio>
#include <string>

#include "bake/check/device_rules.hpp"
#include "bake/check/verdict.hpp"
#include "bake/check/workstation_issues.hpp"
#include "bake/commands/check_json.hpp"
#include "bake/commands/commands.hpp"
#include "bake/commands/terminal.hpp"
#include "bake/yml_rule.hpp"
#include "formats/bundle_view.hpp"
#include "modar/device_profile.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

void print_issues(const std::string& path, const Verdict& verdict) {
  std::printf("%s: %s\n", path.c_str(), verdict.good() ? "good" : "BAD");
  for (const WeighedIssue& weighed : verdict.issues()) {
    const Issue& issue = weighed.issue;
    std::printf("%s %s %s (byte %llu): %s%s%s; %s\n", severity_name(weighed.severity),
                issue.kind->id, issue.where.c_str(), static_cast<unsigned long long>(issue.offset),
                issue.kind->message, issue.detail.empty() ? "" : ": ", issue.detail.c_str(),
                issue.kind->cure);
  }
  for (const auto& [id, count] : verdict.left_out()) {
    std::printf("... and %zu more of %s\n", count, id.c_str());
  }
}

void print_all_kinds() {
  std::fputs(issues_markdown().c_str(), stdout);
  std::fputs(issue_rows(workstation_issue_kinds()).c_str(), stdout);
}

Result<void> weigh(const CheckCommand& command, Verdict& verdict) {
  for (const std::string& text : command.severities) {
    if (auto done = verdict.override_severity(text); !done) return done;
  }
  if (command.warnings_as_errors) verdict.set_warnings_as_errors();
  return {};
}

Result<const DeviceProfile*> named_device(const std::string& name) {
  const DeviceProfile* device = name.empty() ? nullptr : find_device_profile(name);
  if (device == nullptr && !name.empty()) {
    return fail(ExitCode::kUsage, "device.unknown", name, "there is no profile of that name",
                "choose one of " + device_profile_names());
  }
  return device;
}

}  // namespace

int run_check(const CheckCommand& command) {
  if (command.list_issues) {
    print_all_kinds();
    return static_cast<int>(ExitCode::kOk);
  }
  if (command.mutations > 0) return run_mutate(command);
  Verdict verdict;
  if (auto weighed = weigh(command, verdict); !weighed) return print_error(weighed.error());
  const Result<const DeviceProfile*> device = named_device(command.device);
  if (!device) return print_error(device.error());
  Result<MappedFile> file = MappedFile::open(command.bundle);
  if (!file) return print_error(file.error());

  const IssueSink sink = [&verdict](const Issue& issue) { verdict.add(issue); };
  expect_reading(file->bytes());
  bool sound = check_bundle(file->bytes(), sink, {.release = forget_read});
  // The text twin needs OpenCV's parser, so this rule stands outside of formats/.
  if (sound) sound = check_yml_twins(file->bytes(), sink);
  if (sound && *device != nullptr) {
    check_device(*BundleView::open(file->bytes()), **device, sink);
  }

  if (command.sarif) {
    std::fputs(check_sarif(verdict, command.bundle, command.tool_version).c_str(), stdout);
  } else if (command.json) {
    std::fputs(check_json(verdict, command.device).c_str(), stdout);
  } else {
    print_issues(command.bundle, verdict);
  }
  return static_cast<int>(verdict.good() ? ExitCode::kOk : ExitCode::kInvalidInput);
}

}  // namespace modar
