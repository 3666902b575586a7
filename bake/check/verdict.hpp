// The kinds of issues that only a workstation can find, and the verdict: what a check found, with
// severities as the user changed them and repeats counted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "modar/device_profile.hpp"

namespace modar {

/// In the order of workstation_issue_kinds().
enum class WorkstationRule : std::uint8_t {
  kDeviceTextureSize,
  kDeviceAttributes,
  kDeviceUniforms,
  kDeviceGpuMemory,
  kDeviceGpuDetail,
  kDeviceRam,
  kDeviceStorage,
  kDeviceHalfFloat,
  kDeviceEtc1,
  kSourceMissing,
  kSourceBytes,
  kSourceSurface,
  kSourceColour,
  kSourceCounts,
  kSourcePattern,
  kSourceScene,
  kPoseRange,
  kVisualDiffers,
  kPreview,
  kMetaDiffers,
  kUnused,
  kNumberTiny,
  kModelFigures,
  kChunkContent,
  kTextureContent,
  kPatternContent,
  kSceneContent,
  kSourceReader,
  kPatternUnseen,
  kModelUnseen,
  kCount
};

std::span<const IssueKind> workstation_issue_kinds();
const IssueKind& workstation_issue_kind(WorkstationRule rule);

/// An issue with the severity that it has in this run.
struct WeighedIssue {
  Issue issue;
  Severity severity = Severity::kError;
};

class Verdict {
 public:
  static constexpr std::size_t kMaxRepeats = 20;  ///< issues of one kind that are listed

  /// "ID=error", "ID=warning", "ID=info" or "ID=ignore". Errors: kUsage "check.severity".
  Result<void> override_severity(const std::string& text);
  void set_warnings_as_errors() { warnings_as_errors_ = true; }

  void add(const Issue& issue);

  [[nodiscard]] bool good() const { return errors_ == 0; }
  [[nodiscard]] std::size_t errors() const { return errors_; }  ///< all, listed or not
  [[nodiscard]] std::size_t warnings() const { return warnings_; }
  [[nodiscard]] const std::vector<WeighedIssue>& issues() const { return issues_; }
  /// How many of a kind were found but not listed, by id.
  [[nodiscard]] std::map<std::string, std::size_t> left_out() const;

 private:
  std::map<std::string, std::optional<Severity>> overrides_;  // nothing: ignored
  bool warnings_as_errors_ = false;
  std::vector<WeighedIssue> issues_;
  std::map<std::string, std::size_t> counts_;
  std::size_t errors_ = 0;
  std::size_t warnings_ = 0;
};

/// All rules on a bundle's bytes, and those of a device where one is named: what `modar check` runs
/// without sources. Gives back what it has read of a mapping. Answers true if the bytes are sound;
/// what a device lacks is reported to the sink alone.
bool check_whole(std::span<const std::byte> bytes, const DeviceProfile* device,
                 const IssueSink& sink);

/// What check_whole() says of a device alone. One verdict: `modar check`, the report and the studio
/// call a device fit where it has no errors.
Verdict device_verdict(const BundleView& bundle, const DeviceProfile& device);

/// Every kind of issue that `modar check` knows: those of formats/, then those of the workstation.
std::vector<const IssueKind*> all_issue_kinds();

/// "error", "warning", "info".
const char* severity_name(Severity severity);

}  // namespace modar
