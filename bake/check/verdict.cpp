// Weighs issues.
#include "bake/check/verdict.hpp"

#include <algorithm>

#include "bake/check/workstation_issues.hpp"

namespace modar {

std::vector<const IssueKind*> all_issue_kinds() {
  std::vector<const IssueKind*> kinds;
  for (const IssueKind& kind : issue_kinds()) kinds.push_back(&kind);
  for (const IssueKind& kind : workstation_issue_kinds()) kinds.push_back(&kind);
  return kinds;
}

const char* severity_name(Severity severity) {
  return severity == Severity::kInfo      ? "info"
         : severity == Severity::kWarning ? "warning"
                                          : "error";
}

Result<void> Verdict::override_severity(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string id = text.substr(0, equals);
  const std::string word = equals == std::string::npos ? "" : text.substr(equals + 1);
  const auto kinds = all_issue_kinds();
  const bool known = std::any_of(kinds.begin(), kinds.end(),
                                 [&id](const IssueKind* kind) { return id == kind->id; });
  if (!known) {
    return fail(ExitCode::kUsage, "check.severity", text, "'" + id + "' is no kind of issue",
                "modar check --list-issues shows all of them");
  }
  for (const Severity severity : {Severity::kError, Severity::kWarning, Severity::kInfo}) {
    if (word == severity_name(severity)) {
      overrides_[id] = severity;
      return {};
    }
  }
  if (word == "ignore") {
    overrides_[id] = std::nullopt;
    return {};
  }
  return fail(ExitCode::kUsage, "check.severity", text, "'" + word + "' is no severity",
              "write ID=error, ID=warning, ID=info or ID=ignore");
}

void Verdict::add(const Issue& issue) {
  Severity severity = issue.kind->severity;
  if (const auto found = overrides_.find(issue.kind->id); found != overrides_.end()) {
    if (!found->second) return;
    severity = *found->second;
  }
  if (warnings_as_errors_ && severity == Severity::kWarning) severity = Severity::kError;
  if (severity == Severity::kError) ++errors_;
  if (severity == Severity::kWarning) ++warnings_;
  if (counts_[issue.kind->id]++ < kMaxRepeats) issues_.push_back({issue, severity});
}

std::map<std::string, std::size_t> Verdict::left_out() const {
  std::map<std::string, std::size_t> more;
  for (const auto& [id, count] : counts_) {
    if (count > kMaxRepeats) more[id] = count - kMaxRepeats;
  }
  return more;
}

}  // namespace modar
