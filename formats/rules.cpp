// The rules that opening a bundle checks, the log of those that it breaks, and texts of numbers.
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

constexpr auto kOpeningKinds = std::to_array<IssueKind>({
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
    {"BUNDLE_CLIP", Severity::kError,
     "A clip, joint, bone or part refers to what does not exist, or tracks are damaged", kRebake},
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
});
static_assert(kOpeningKinds.size() == static_cast<std::size_t>(Rule::kPadding));

const char* severity_word(Severity severity) {
  static constexpr char kWords[][8] = {"error", "warning", "info"};  // no pointers to relocate
  return kWords[static_cast<std::size_t>(severity)];
}

}  // namespace

std::span<const IssueKind> opening_issue_kinds() {
  return kOpeningKinds;
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

void FaultLog::add(Rule rule, std::uint64_t offset, std::string_view where, const char* detail,
                   std::initializer_list<std::uint64_t> numbers) {
  add(rule, offset, where, std::string_view(with_numbers(detail, numbers)));
}

void FaultLog::add(Rule rule, std::uint64_t offset, std::string_view where,
                   std::string_view detail) {
  constexpr std::size_t kOpening = kOpeningKinds.size();
  const auto number = static_cast<std::size_t>(rule);
  const IssueKind& kind = number < kOpening ? kOpeningKinds[number] : content_[number - kOpening];
  const bool is_error = kind.severity == Severity::kError;
  if (sink_ != nullptr) {
    if (is_error) ++errors_;
    (*sink_)(Issue{&kind, std::string(where), offset, std::string(detail), std::nullopt});
    return;
  }
  if (!is_error || errors_++ > 0) return;
  const bool unsupported =
      rule == Rule::kVersion || rule == Rule::kSectionRequired || rule == Rule::kSectionVersion;
  first_ = Error{unsupported ? ExitCode::kUnsupported : ExitCode::kInvalidInput, error_code(kind),
                 with_numbers("byte {} (", {offset}) + std::string(where) + ")",
                 kind.message + (": " + std::string(detail)), kind.cure};
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
  // Fewer than 15 digits come back from 15, as %g writes no zeros at the end; 17 tell any double
  // apart.
  for (int digits = 15; digits <= 17; ++digits) {
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
         issue_rows(opening_issue_kinds()) + issue_rows(content_issue_kinds());
}

}  // namespace modar
