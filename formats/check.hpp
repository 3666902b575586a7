// The rules that a good bundle keeps, checked from its bytes alone. `modar check` prints what they
// find; the installer on the device runs the same ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "formats/base/error.hpp"

namespace modar {

class BundleView;
struct SectionEntry;

enum class Severity : std::uint8_t { kError, kWarning, kInfo };

/// A rule's constant part. The table kIssueKinds is the source of ISSUES.md.
struct IssueKind {
  const char* id;  ///< stable: "BUNDLE_TRUNCATED"
  Severity severity;
  const char* message;  ///< the fault, as a sentence without names
  const char* cure;
};

/// The kinds of issues that opening a bundle finds, and those that only check_bundle() does, in the
/// order of ISSUES.md.
std::span<const IssueKind> opening_issue_kinds();
std::span<const IssueKind> content_issue_kinds();

/// The text of ISSUES.md, made from both, to which issue_rows() of other kinds may be
/// added.
std::string issues_markdown();

/// A row of its table for each kind.
std::string issue_rows(std::span<const IssueKind> kinds);

/// One finding: `where` names the asset ("model 'spider', chunk 3"), `offset` is the byte in the
/// file, `detail` the numbers that were found.
struct Issue {
  const IssueKind* kind = nullptr;
  std::string where;
  std::uint64_t offset = 0;
  std::string detail;
  std::optional<Severity> severity = {};  ///< where it differs from the kind's
};

using IssueSink = std::function<void(const Issue&)>;

struct CheckOptions {
  /// Receives bytes that are not read again, whole pages front to back, so that a mapping can give
  /// them back (forget_read() in modar/mapped_file.hpp). None: nobody is notified.
  std::function<void(std::span<const std::byte>)> release;
  /// A newer minor version is no error: what it adds can be skipped, as devices do, and is not
  /// checked.
  bool accept_newer = false;
};

/// Runs every rule over the bytes, about in file order; calls `sink` for each finding. Memory does
/// not grow with the bundle. Answers true if no finding was an error.
bool check_bundle(std::span<const std::byte> bytes, const IssueSink& sink,
                  const CheckOptions& options = {});

/// The first error that check_bundle() finds, as "ID where"; empty for a good bundle.
std::string first_error(std::span<const std::byte> bytes, const CheckOptions& options = {});

/// The rule NEVER_SHOWN alone.
void check_shown(const BundleView& bundle, const IssueSink& sink);

/// Checks the hash of every section, and nothing else: finds bytes that the storage has changed
/// since the bundle was written, which BundleView::open() does not look at. Reads the whole file.
/// Errors: kInvalidInput "section.hash".
Result<void> verify_sections(const BundleView& bundle);
/// What verify_sections() says of a section whose bytes have another hash.
Error wrong_section(const BundleView& bundle, const SectionEntry& entry);

}  // namespace modar
