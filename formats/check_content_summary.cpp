// The rule that the statement says what the other sections hold.
#include <algorithm>
#include <cstring>

#include "formats/check_rules.hpp"
#include "formats/content_summary.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

/// Characters of a line that are shown from where two differ.
constexpr std::size_t kShown = 48;

std::string_view from_difference(std::string_view line, std::size_t at) {
  return line.substr(std::min(at, line.size()), kShown);
}

}  // namespace

StatementCheck::StatementCheck(FaultLog& log, const BundleParts& parts)
    : log_(log),
      parts_(parts),
      entry_(find_section(parts.sections, SectionType::kStatement, kNone, 0)) {
  if (entry_ == nullptr) return;
  const std::span<const std::byte> bytes = section_bytes(parts, *entry_);
  text_ = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void StatementCheck::expect(std::string_view line, const char* subject, std::uint32_t index) {
  const std::string_view rest = text_.substr(std::min(read_, text_.size()));
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  const std::string_view told = rest.substr(0, end);
  // The last line has its end, too.
  if (told != line || end == rest.size()) {
    const auto [a, b] = std::mismatch(told.begin(), told.end(), line.begin(), line.end());
    const auto at = static_cast<std::size_t>(a - told.begin());
    const std::size_t shown = at - std::min<std::size_t>(at, kShown / 2);
    log_.add(Rule::kStatement, entry_->offset + read_ + at,
             std::string(subject) + " " + std::to_string(index),
             "it says '" + std::string(from_difference(told, shown)) + "', the bundle holds '" +
                 std::string(from_difference(line, shown)) + "'");
  }
  read_ += end + 1;
}

void StatementCheck::records() {
  if (entry_ == nullptr) return;
  const std::uint16_t minor = reinterpret_cast<const FileHeader*>(parts_.bytes.data())->minor;
  state_records(parts_, minor,
                [this](std::string_view line, const char* subject, std::uint32_t index) {
                  expect(line, subject, index);
                });
  for (const SectionEntry& twin : parts_.sections) {
    if (twin.type != static_cast<std::uint32_t>(SectionType::kMappedFeatures)) continue;
    const SectionEntry* text =
        find_section(parts_.sections, SectionType::kFeatureYml, twin.owner, twin.variant);
    const auto& header =
        *reinterpret_cast<const FeatureHeader*>(section_bytes(parts_, twin).data());
    expect(feature_line({twin.owner, twin.variant, header.count, text != nullptr ? text->size : 0}),
           "features", twin.owner);
  }
  loop_records();
}

void StatementCheck::loop_records() {
  for (const SectionEntry& entry : parts_.sections) {
    if (entry.type != static_cast<std::uint32_t>(SectionType::kTrackerRecord)) continue;
    expect(loop_line(entry.owner, section_bytes(parts_, entry)), "loop record", entry.owner);
  }
}

void StatementCheck::level(std::uint32_t index, std::uint32_t stride) {
  if (entry_ != nullptr) expect(level_line(parts_, index, stride), "payload of level", index);
}

void StatementCheck::texture_level(std::uint32_t index, std::span<const std::byte> data) {
  if (entry_ != nullptr) {
    expect(texture_level_line(parts_, index, data), "payload of texture level", index);
  }
}

void StatementCheck::finish() {
  if (entry_ == nullptr || read_ >= text_.size()) return;
  log_.add(Rule::kStatement, entry_->offset + read_, "statement",
           std::to_string(text_.size() - read_) + " bytes tell of nothing");
}

}  // namespace modar
