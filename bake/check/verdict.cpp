// The table of workstation issues, and the weighing of issues.
#include "bake/check/verdict.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "bake/check/device/device_rules.hpp"
#include "bake/check/yml_rule.hpp"
#include "formats/bundle_view.hpp"
#include "formats/meta_text.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr const char* kRebake = "bake the bundle again; if that does not help, report it as a bug";

constexpr IssueKind kKinds[] = {
    {"DEVICE_TEXTURE_SIZE", Severity::kError, "A texture is larger than the device can hold",
     "bake with --device, or with a smaller --max-texture"},
    {"DEVICE_ATTRIBUTES", Severity::kError,
     "A vertex layout has more attributes than the device can fetch",
     "leave colours or texture coordinates out of the source"},
    {"DEVICE_UNIFORMS", Severity::kError,
     "The shaders need more uniform vectors than the device has",
     "this device cannot run the player; choose another"},
    {"DEVICE_GPU_MEMORY", Severity::kError,
     "Even the coarsest level of a model and the smallest textures exceed the GPU memory that one "
     "app "
     "should plan for",
     "bake with --tier phone, with levels of detail, or with smaller textures"},
    {"DEVICE_GPU_DETAIL", Severity::kWarning,
     "Models and textures do not fit the GPU memory that one app should plan for: the player draws "
     "smaller textures, and far parts at coarser levels",
     "none needed if that is fine; else bake with --tier phone, or fewer models in one bundle"},
    {"DEVICE_RAM", Severity::kError, "The bundle is larger than half of the device's RAM",
     "split it into several bundles"},
    {"DEVICE_STORAGE", Severity::kError, "The bundle takes more than half of the device's storage",
     "split it, or ship it compressed with smaller textures"},
    {"DEVICE_HALF_FLOAT", Severity::kInfo,
     "The device cannot read 16-bit floats: the player converts the model's coordinates when it "
     "loads them, which takes memory and loses nothing",
     "none needed; --positions int16 saves this memory"},
    {"DEVICE_ETC1", Severity::kInfo,
     "The device cannot read ETC1 textures: the player unpacks them when it loads them, which "
     "takes "
     "memory and loses nothing",
     "none needed; smaller textures (--max-texture) take less"},
    {"SOURCE_MISSING", Severity::kWarning, "No file of --source is this asset's source",
     "pass all files that the bundle was baked from"},
    {"SOURCE_BYTES", Severity::kInfo, "Baking this asset again gives different bytes",
     "none needed: another version of this program baked it; visible differences are reported"},
    {"SOURCE_SURFACE", Severity::kError,
     "A model's surface, vertices or levels differ from its source's",
     "bake it again from this source; if that does not help, report it as a bug"},
    {"SOURCE_COLOUR", Severity::kError, "Colours differ from those of the source",
     "bake it again from this source"},
    {"SOURCE_COUNTS", Severity::kError, "Counts differ from those of the source",
     "bake it again from this source"},
    {"SOURCE_PATTERN", Severity::kError,
     "A pattern's image, codes, shape, width or parameters differ from its source's",
     "bake it again from this source; give its width as FILE:WIDTHmm if it was baked with one"},
    {"SOURCE_SCENE", Severity::kError,
     "A scene differs from the one that the bundle was baked with",
     "bake it again from this source"},
    {"POSE_RANGE", Severity::kError,
     "A pattern is missed in easy views (a warning where only tilted ones are missed)",
     "`modar pattern score` names the cause; or use a larger print"},
    {"VISUAL_DIFFERS", Severity::kError, "A model does not look like its source",
     "look at the picture of the worst view; bake with larger textures or a smaller --max-error"},
    {"BUNDLE_PREVIEW", Severity::kWarning,
     "This is what can be shown of a bundle before all of it has come",
     "copy or download all of it: run modar-fetch again"},
    {"META_DIFFERS", Severity::kError,
     "The meta text describes other models, patterns, parameter sets or scenes than the bundle "
     "holds",
     kRebake},
    {"RECORD_UNUSED", Severity::kError, "Nothing uses a name, a layout, a texture or a media file",
     kRebake},
    {"NUMBER_TINY", Severity::kError, "A number is smaller than any that a bake writes", kRebake},
    {"MODEL_FIGURES", Severity::kError, "A model states figures that its chunks cannot have",
     kRebake},
    {"CHUNK_CONTENT", Severity::kError,
     "What follows from a chunk's vertices and triangles differs from the stored values", kRebake},
    {"TEXTURE_CONTENT", Severity::kError,
     "A texture's figures contradict each other, or a level is not the half of the one before",
     kRebake},
    {"PATTERN_CONTENT", Severity::kError,
     "A pattern's features, small picture or colours do not follow from its picture", kRebake},
    {"SCENE_CONTENT", Severity::kError,
     "A scene's shadow does not follow from its model and its place", kRebake},
    {"SOURCE_READER", Severity::kWarning, "One reader alone has read a model or its colours",
     "look at it in another viewer; the second reader is in the package of `modar-lab`"},
    {"PATTERN_UNSEEN", Severity::kWarning,
     "A pattern was recognised in no view of its score: nothing on it will be seen",
     "`modar pattern score` names the cause; choose another picture"},
    {"MODEL_UNSEEN", Severity::kWarning,
     "Nothing of a model is drawn for those who look at its pattern from the front: it shows them "
     "backs of one-sided materials, or is transparent",
     "turn it (turn=180, or turn=180:0:0), or make its materials two-sided or opaque"},
};
static_assert(std::size(kKinds) == static_cast<std::size_t>(WorkstationRule::kCount));

}  // namespace

std::span<const IssueKind> workstation_issue_kinds() {
  return kKinds;
}

const IssueKind& workstation_issue_kind(WorkstationRule rule) {
  return kKinds[static_cast<std::size_t>(rule)];
}

Verdict device_verdict(const BundleView& bundle, const DeviceProfile& device) {
  Verdict verdict;
  check_device(bundle, device, [&](const Issue& issue) { verdict.add(issue); });
  return verdict;
}

std::vector<const IssueKind*> all_issue_kinds() {
  std::vector<const IssueKind*> kinds;
  for (const auto part :
       {opening_issue_kinds(), content_issue_kinds(), workstation_issue_kinds()}) {
    for (const IssueKind& kind : part) kinds.push_back(&kind);
  }
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
    return fail(ExitCode::kUsage, "check.severity", text, "'" + id + "' is not a kind of issue",
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
  return fail(ExitCode::kUsage, "check.severity", text, "'" + word + "' is not a severity",
              "write ID=error, ID=warning, ID=info or ID=ignore");
}

void Verdict::add(const Issue& issue) {
  Severity severity = issue.severity.value_or(issue.kind->severity);
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

namespace {

void report_preview(const BundleView& bundle, const IssueSink& sink) {
  const std::string_view meta = bundle.meta();
  if (!meta.starts_with(kPreviewMeta)) return;
  const auto* begin = reinterpret_cast<const std::byte*>(meta.data());
  sink({&workstation_issue_kind(WorkstationRule::kPreview), "meta",
        static_cast<std::uint64_t>(begin - bundle.bytes().data()), "models and textures are coarse",
        std::nullopt});
}

void report_unseen_patterns(const BundleView& bundle, const IssueSink& sink) {
  for (const PatternRecord& pattern : bundle.patterns()) {
    if (pattern.score_version == 0 || pattern.score != 0) continue;
    const auto at = reinterpret_cast<const std::byte*>(&pattern) - bundle.bytes().data();
    sink({&workstation_issue_kind(WorkstationRule::kPatternUnseen),
          "pattern '" + std::string(bundle.name(pattern.name)) + "'",
          static_cast<std::uint64_t>(at), "", std::nullopt});
  }
}

}  // namespace

bool check_whole(std::span<const std::byte> bytes, const DeviceProfile* device,
                 const IssueSink& sink) {
  expect_reading(bytes);
  bool sound = check_bundle(bytes, sink, {.release = forget_read});
  // The text twin needs OpenCV's parser, so this rule stands outside of formats/.
  if (sound) sound = check_yml_twins(bytes, sink);
  if (!sound) return false;
  if (const auto bundle = BundleView::open(bytes)) {
    report_preview(*bundle, sink);
    report_unseen_patterns(*bundle, sink);
    if (device != nullptr) check_device(*bundle, *device, sink);
  }
  return true;
}

}  // namespace modar
