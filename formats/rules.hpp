// The names of all rules and the log that validation writes to. Internal to formats/.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "formats/base/error.hpp"
#include "formats/check.hpp"

namespace modar {

/// In the order of opening_issue_kinds() and content_issue_kinds(); a new rule is appended to its
/// group here and there.
enum class Rule : std::uint8_t {
  kTruncated,
  kMagicBytes,
  kVersion,
  kMinor,
  kFileSize,
  kHeader,
  kHeaderHash,
  kSectionCount,
  kSectionRequired,
  kSectionVersion,
  kSectionFlags,
  kSectionOrder,
  kSectionOwner,
  kSectionUnaligned,
  kSectionRange,
  kTableShape,
  kReserved,
  kEnum,
  kNumber,
  kName,
  kModelRange,
  kChunkRange,
  kProxy,
  kClip,
  kLevelRange,
  kMaterialRange,
  kLayout,
  kTextureRange,
  kTextureLevel,
  kPattern,
  kParameterSet,
  kFeatures,
  kScene,
  kLightValues,
  kNode,
  kAction,
  kActionLink,
  kSectionHash,
  kPadding,  ///< from here on found by checks of the contents alone
  kMetaText,
  kModelPlacement,
  kModelCounts,
  kModelErrors,
  kChunkBounds,
  kChunkLoose,
  kChunkOutside,
  kChunkCone,
  kChunkGrid,
  kLevelOrder,
  kIndexRange,
  kNotFinite,
  kNormalLength,
  kMaterialValues,
  kTextureSides,
  kTextureOverlap,
  kTextureUnreferenced,
  kParameterValues,
  kKeypointOutside,
  kKeypointValues,
  kDescriptorLength,
  kFeaturesMissing,
  kFeatureYml,
  kTrackerRecord,
  kContentSummary,
  kMediaFile,
  kCaptions,
  kVertexPadding,
  kVertexOcclusion,
  kVertexBones,
  kYmlDiffers,  ///< found by `modar check` on a workstation: it needs OpenCV
  kUnreferencedVertices,
  kUnreferencedIndices,
  kDegenerateTriangles,
  kEmptyLevel,
  kNoContent,
  kNeverShown,
  kNodeText,
  kCaptionsMissing,
  kMediaFlashes,
  kUnknownSection,
  kCount
};

/// "bundle.section-order" for BUNDLE_SECTION_ORDER.
std::string error_code(const IssueKind& kind);

/// What validation finds. Without a sink it keeps the first fault and asks to stop there; with one
/// it hands every fault on. Allocates nothing while there is nothing to tell.
class FaultLog {
 public:
  /// For the rules before Rule::kPadding alone, which opening checks.
  FaultLog() = default;
  /// `sink` must outlive the log.
  explicit FaultLog(const IssueSink& sink) : sink_(&sink), content_(content_issue_kinds()) {}

  void add(Rule rule, std::uint64_t offset, std::string_view where, std::string_view detail);
  /// detail, numbers: as with_numbers() takes them.
  void add(Rule rule, std::uint64_t offset, std::string_view where, const char* detail,
           std::initializer_list<std::uint64_t> numbers = {});
  /// True once there is nothing more to be gained from looking on.
  [[nodiscard]] bool stop() const { return sink_ == nullptr && errors_ > 0; }
  [[nodiscard]] bool clean() const { return errors_ == 0; }
  [[nodiscard]] std::uint64_t errors() const { return errors_; }
  /// The first fault as an error; only without a sink and after a fault.
  [[nodiscard]] const Error& first() const { return first_; }

 private:
  const IssueSink* sink_ = nullptr;
  std::span<const IssueKind> content_;
  std::uint64_t errors_ = 0;
  Error first_;
};

/// Shortest text that reads back as the same number, in no locale. In a page: rough_number_text().
std::string number_text(double value);
/// Nine digits or fewer, by sums and products only: printf of such numbers and strtod would be 17
/// KB of a page's engine, where damaged bundles alone call them.
std::string rough_number_text(double value);

}  // namespace modar
