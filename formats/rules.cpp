// The constant part of every rule, the log of what broke them, and the text of ISSUES.md.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <string_view>

#include "formats/check.hpp"
#include "formats/rules.hpp"

namespace modar {
namespace {

constexpr const char* kRebake = "bake the bundle again; if that does not help, report it as a bug";
constexpr const char* kFetch = "copy or download the file again, or bake it again";
constexpr const char* kUpdate = "update this program, or bake with a version that it supports";

constexpr IssueKind kIssueKinds[] = {
    {"BUNDLE_TRUNCATED", Severity::kError, "The file ends before the bundle does", kFetch},
    {"BUNDLE_MAGIC", Severity::kError, "The file is not a ModAR bundle",
     "pass a file that `modar bake` wrote"},
    {"BUNDLE_VERSION", Severity::kError, "The bundle has a different major version", kUpdate},
    {"BUNDLE_MINOR", Severity::kError,
     "The minor version is below what the contents need, or newer than this program", kUpdate},
    {"BUNDLE_FILE_SIZE", Severity::kError, "The file is longer than the bundle", kFetch},
    {"BUNDLE_HEADER", Severity::kError,
     "The section table is not at byte 64, or the bytes are not 8-byte aligned in memory", kFetch},
    {"BUNDLE_HEADER_HASH", Severity::kError, "The header or the section table is damaged", kFetch},
    {"BUNDLE_SECTION_COUNT", Severity::kError, "The section table does not fit into the file",
     kFetch},
    {"BUNDLE_SECTION_REQUIRED", Severity::kError, "A required section has an unknown type",
     kUpdate},
    {"BUNDLE_SECTION_VERSION", Severity::kError, "A section has an unknown version", kUpdate},
    {"BUNDLE_SECTION_FLAGS", Severity::kError, "A section's flags do not match its type", kRebake},
    {"BUNDLE_SECTION_ORDER", Severity::kError, "Sections are not sorted, or one is present twice",
     kRebake},
    {"BUNDLE_SECTION_OWNER", Severity::kError, "A section belongs to a record that does not exist",
     kRebake},
    {"BUNDLE_SECTION_ALIGNMENT", Severity::kError, "A section is not aligned", kRebake},
    {"BUNDLE_SECTION_RANGE", Severity::kError,
     "A section extends past the file or overlaps another", kFetch},
    {"BUNDLE_TABLE_SHAPE", Severity::kError, "A table's records do not fill its section", kRebake},
    {"BUNDLE_RESERVED", Severity::kError, "Reserved bytes or bits are not zero", kRebake},
    {"BUNDLE_ENUM", Severity::kError, "A field has an undefined value", kUpdate},
    {"BUNDLE_NUMBER", Severity::kError, "A number is not finite or out of range", kRebake},
    {"BUNDLE_NAME", Severity::kError, "A name is not printable UTF-8 inside the names", kRebake},
    {"BUNDLE_MODEL_RANGE", Severity::kError,
     "A model refers to chunks, materials or a layout that do not exist", kRebake},
    {"BUNDLE_CHUNK_RANGE", Severity::kError,
     "A chunk has no levels, levels of another chunk, or an impossible box", kRebake},
    {"BUNDLE_PROXY", Severity::kError,
     "A proxy has no model, chunks of another, or not one level of one error in each chunk",
     kRebake},
    {"BUNDLE_LEVEL_RANGE", Severity::kError,
     "A level of detail refers to vertices or indices that do not exist", kRebake},
    {"BUNDLE_MATERIAL_RANGE", Severity::kError,
     "A reference to a material or a texture that does not exist", kRebake},
    {"BUNDLE_LAYOUT", Severity::kError, "A vertex layout contradicts itself", kRebake},
    {"BUNDLE_TEXTURE_RANGE", Severity::kError,
     "A texture has an impossible size or refers to levels that do not exist", kRebake},
    {"BUNDLE_TEXTURE_LEVEL", Severity::kError,
     "A texture level has the wrong size or is outside its data", kRebake},
    {"BUNDLE_PATTERN", Severity::kError, "A pattern's sizes are inconsistent", kRebake},
    {"BUNDLE_PARAMETER_SET", Severity::kError,
     "A parameter set is out of order or has an impossible descriptor", kRebake},
    {"BUNDLE_FEATURES", Severity::kError, "A pattern's features do not fill their section",
     kRebake},
    {"BUNDLE_SCENE", Severity::kError,
     "A scene refers to a pattern or model that does not exist, its rotation is not a unit "
     "quaternion, or its light or shadow is not valid",
     kRebake},
    {"LIGHT_VALUES", Severity::kError, "A light is negative, or varies more than light can",
     kRebake},
    {"BUNDLE_NODE", Severity::kError,
     "A node or its media are not as their kind demands, or its name is there twice", kRebake},
    {"BUNDLE_ACTION", Severity::kError,
     "An action refers to a node that does not exist or cannot do that", kRebake},
    {"ACTION_LINK", Severity::kError, "A link does not lead to an https address",
     "write link https://museum.org/vase"},
    {"SECTION_HASH", Severity::kError, "A section's bytes do not match its hash", kFetch},
    {"SECTION_PADDING", Severity::kError, "Bytes between sections are not zero", kFetch},
    {"META_TEXT", Severity::kError,
     "The bundle's description is not a JSON object in UTF-8, or its members are not as specified",
     kRebake},
    {"MODEL_PLACEMENT", Severity::kError,
     "A model's scale and diagonal cannot describe one box, or its chunks do not fit into that "
     "box",
     kRebake},
    {"MODEL_COUNTS", Severity::kError, "A model's counts differ from its contents", kRebake},
    {"MODEL_ERRORS", Severity::kError, "A model's mean error is greater than its maximum", kRebake},
    {"CHUNK_BOUNDS", Severity::kError, "A vertex is outside its chunk's box", kRebake},
    {"CHUNK_LOOSE", Severity::kError, "A chunk's box is larger than its vertices need", kRebake},
    {"CHUNK_OUTSIDE", Severity::kError, "A chunk's box extends past the unit cube", kRebake},
    {"CHUNK_CONE", Severity::kError,
     "A chunk's cone axis does not have unit length, or triangles face out of the cone", kRebake},
    {"CHUNK_GRID", Severity::kWarning,
     "Chunks of a model store integer positions on different grids: their borders may crack",
     kRebake},
    {"LEVEL_ORDER", Severity::kError,
     "Levels of detail do not get coarser, or level 0 has a non-zero error", kRebake},
    {"LEVEL_INDEX", Severity::kError, "An index refers to a vertex that its level lacks", kRebake},
    {"VERTEX_NOT_FINITE", Severity::kError, "A vertex attribute is infinite or not a number",
     kRebake},
    {"VERTEX_NORMAL", Severity::kError, "A normal does not have unit length", kRebake},
    {"MATERIAL_VALUES", Severity::kError, "A material's colour, shininess or opacity is unusable",
     "correct the material in the source and bake again"},
    {"TEXTURE_SIDES", Severity::kError,
     "A texture that repeats or has mipmaps has sides that are not powers of two (OpenGL ES 2.0)",
     kRebake},
    {"TEXTURE_OVERLAP", Severity::kError, "Levels of a texture share bytes", kRebake},
    {"TEXTURE_UNREFERENCED", Severity::kWarning, "Bytes of a texture belong to no level", kRebake},
    {"PARAMETER_VALUES", Severity::kError,
     "A parameter set has values that its detector cannot run with", kRebake},
    {"KEYPOINT_OUTSIDE", Severity::kError, "A keypoint is outside its pattern", kRebake},
    {"KEYPOINT_VALUES", Severity::kError, "A keypoint's size, angle or octave is impossible",
     kRebake},
    {"DESCRIPTOR_LENGTH", Severity::kError, "Descriptors do not have their detector's length",
     kRebake},
    {"PATTERN_WITHOUT_FEATURES", Severity::kWarning, "A pattern has too few features to be found",
     "use a pattern with more texture"},
    {"FEATURE_TEXT", Severity::kError,
     "A feature text is not an OpenCV FileStorage or has no mapped twin", kRebake},
    {"LOOP_RECORD", Severity::kError, "A pattern's tracker record is invalid", kRebake},
    {"STATEMENT_DIFFERS", Severity::kError,
     "The content summary differs from the records or payloads", kRebake},
    {"MEDIA_FILE", Severity::kError,
     "A video or sound is not what its record says, or not what every phone plays", kRebake},
    {"CAPTIONS", Severity::kError, "Captions are not a WebVTT file of the kind that bundles hold",
     kRebake},
    {"VERTEX_PADDING", Severity::kError, "Padding bytes of a vertex are not zero", kRebake},
    {"VERTEX_OCCLUSION", Severity::kError, "A vertex's occlusion is above 127", kRebake},
    {"PATTERN_YML_DIFFERS", Severity::kError,
     "A feature text, read by OpenCV, differs from its mapped twin", kRebake},
    {"VERTICES_UNREFERENCED", Severity::kWarning, "Bytes of the vertex buffer belong to no level",
     kRebake},
    {"INDICES_UNREFERENCED", Severity::kWarning, "Bytes of the index buffer belong to no level",
     kRebake},
    {"TRIANGLE_DEGENERATE", Severity::kWarning, "A triangle uses one vertex twice", kRebake},
    {"LEVEL_EMPTY", Severity::kWarning, "A level of detail has no triangles", kRebake},
    {"BUNDLE_EMPTY", Severity::kWarning, "The bundle holds neither models nor patterns",
     "bake it with --model or --pattern"},
    {"NEVER_SHOWN", Severity::kWarning,
     "A model is on no pattern, or nothing is on a pattern: visitors download it and never see it",
     "add a scene of it, or leave it out"},
    {"NODE_TEXT", Severity::kWarning, "A label lacks a title in a language that others have",
     "write title.LANGUAGE for each language"},
    {"CAPTIONS_MISSING", Severity::kWarning,
     "Something is heard that has no captions, or none in a language that others have (WCAG 1.2.1, "
     "1.2.2)",
     "write captions.LANGUAGE = \"FILE.vtt\" for each language"},
    {"MEDIA_FLASHES", Severity::kWarning,
     "A video flashes more than three times in a second, which can cause seizures (WCAG 2.3.1)",
     "cut or darken what flashes, and bake again"},
    {"SECTION_UNKNOWN", Severity::kInfo, "An optional section of an unknown type is skipped",
     "update this program to use its contents"},
};
static_assert(std::size(kIssueKinds) == static_cast<std::size_t>(Rule::kCount));

const char* severity_word(Severity severity) {
  static constexpr char kWords[][8] = {"error", "warning", "info"};  // no pointers to relocate
  return kWords[static_cast<std::size_t>(severity)];
}

}  // namespace

std::span<const IssueKind> issue_kinds() {
  return kIssueKinds;
}

const IssueKind& issue_kind(Rule rule) {
  return kIssueKinds[static_cast<std::size_t>(rule)];
}

std::string error_code(const IssueKind& kind) {
  std::string code;
  bool first = true;
  for (const char* letter = kind.id; *letter != '\0'; ++letter) {
    if (*letter == '_') {
      code += first ? '.' : '-';
      first = false;
    } else {
      code += static_cast<char>(*letter - 'A' + 'a');
    }
  }
  return code;
}

void FaultLog::add(Rule rule, std::uint64_t offset, std::string where, std::string detail) {
  const IssueKind& kind = issue_kind(rule);
  const bool is_error = kind.severity == Severity::kError;
  if (sink_ != nullptr) {
    if (is_error) ++errors_;
    (*sink_)(Issue{&kind, std::move(where), offset, std::move(detail), std::nullopt});
    return;
  }
  if (!is_error || errors_++ > 0) return;
  const bool unsupported =
      rule == Rule::kVersion || rule == Rule::kSectionRequired || rule == Rule::kSectionVersion;
  first_ = Error{unsupported ? ExitCode::kUnsupported : ExitCode::kInvalidInput, error_code(kind),
                 "byte " + std::to_string(offset) + " (" + where + ")",
                 kind.message + (": " + detail), kind.cure};
}

std::string rough_number_text(double value) {
  if (value != value) return "nan";
  std::string text = value < 0 ? "-" : "";
  double left = value < 0 ? -value : value;
  if (left > std::numeric_limits<double>::max()) return text + "inf";
  if (left == 0) return "0";
  constexpr int kDigits = 9;
  constexpr double kOne = 1e8;  // of as many digits
  int exponent = kDigits - 1;
  for (; left >= 10 * kOne; left /= 10) ++exponent;
  for (; left < kOne; left *= 10) --exponent;
  std::string digits = std::to_string(static_cast<std::int64_t>(left + 0.5));
  if (digits.size() > kDigits) ++exponent;  // 999999999.9
  digits.erase(digits.find_last_not_of('0') + 1);
  if (exponent < -4 || exponent >= kDigits) {
    text += digits[0];
    if (digits.size() > 1) text += '.' + digits.substr(1);
    return text + (exponent < 0 ? "e-" : "e+") + (std::abs(exponent) < 10 ? "0" : "") +
           std::to_string(std::abs(exponent));
  }
  if (exponent < 0)
    return text + "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (digits.size() <= whole) return text + digits + std::string(whole - digits.size(), '0');
  return text + digits.substr(0, whole) + "." + digits.substr(whole);
}

#ifdef __EMSCRIPTEN__
std::string number_text(double value) {
  return rough_number_text(value);
}
#else
/// Not std::to_chars: its floating-point tables take 130 KB, a quarter of the player. printf and
/// strtod agree on the locale's decimal point, which becomes '.'.
std::string number_text(double value) {
  std::array<char, 40> text{};
  constexpr int kExact = 17;  // digits tell any double apart
  for (int digits = 1; digits <= kExact; ++digits) {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
    if (std::strtod(text.data(), nullptr) == value) break;
  }
  constexpr std::string_view kOurs = "0123456789+-einfa";
  std::string answer;
  bool in_point = false;
  for (const char letter : std::string_view(text.data())) {
    const bool ours = kOurs.find(letter) != std::string_view::npos;
    if (ours || !in_point) answer += ours ? letter : '.';
    in_point = !ours;
  }
  return answer;
}
#endif

std::string issue_rows(std::span<const IssueKind> kinds) {
  std::string text;
  for (const IssueKind& kind : kinds) {
    text += std::string("| ") + kind.id + " | " + severity_word(kind.severity) + " | " +
            kind.message + " | " + kind.cure + " |\n";
  }
  return text;
}

std::string issues_markdown() {
  return "# Issues that the checker reports\n\n"
         "Ids are stable. A bundle with an error fails validation; warnings do not matter for "
         "that.\n\n"
         "| id | severity | fault | what to do |\n|---|---|---|---|\n" +
         issue_rows(kIssueKinds);
}

}  // namespace modar
