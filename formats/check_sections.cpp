// Rules on sections as bytes: hashes and padding.
#include <algorithm>
#include <cstring>

#include "formats/check_rules.hpp"
#include "formats/utf8.hpp"
#include "formats/validate.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

void check_zero(FaultLog& log, std::span<const std::byte> bytes, std::uint64_t first,
                std::uint64_t end, const std::string& where) {
  const auto gap =
      bytes.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(end - first));
  // All bytes are zero if the first one is and each equals the one before it.
  if (gap.empty() ||
      (gap[0] == std::byte{0} && std::memcmp(gap.data(), gap.data() + 1, gap.size() - 1) == 0)) {
    return;
  }
  const auto found =
      std::find_if(gap.begin(), gap.end(), [](std::byte b) { return b != std::byte{0}; });
  log.add(Rule::kPadding, first + static_cast<std::uint64_t>(found - gap.begin()), where,
          "a byte of padding is not zero");
}

void check_meta(FaultLog& log, const BundleParts& parts, const SectionEntry& entry) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!rest.empty()) {
    const bool space = rest[0] == '\n' || rest[0] == '\r' || rest[0] == '\t';
    const std::size_t length = space ? 1 : utf8_character(rest);
    if (length == 0) {
      log.add(Rule::kMetaText, entry.offset + bytes.size() - rest.size(), "meta",
              "a byte belongs to no printable character of UTF-8");
      return;
    }
    rest.remove_prefix(length);
  }
}

}  // namespace

void check_section_bytes(FaultLog& log, const BundleParts& parts) {
  std::uint64_t end = sizeof(FileHeader) + parts.sections.size_bytes();
  for (std::uint32_t i = 0; i < parts.sections.size(); ++i) {
    const SectionEntry& entry = parts.sections[i];
    const std::string where = "section " + std::to_string(i);
    check_zero(log, parts.bytes, end, entry.offset, "before " + where);
    end = entry.offset + entry.size;
    const std::span<const std::byte> bytes = section_bytes(parts, entry);
    if (XXH64(bytes.data(), bytes.size(), 0) != entry.hash) {
      log.add(Rule::kSectionHash, entry.offset, where,
              "the hash of its " + std::to_string(entry.size) + " bytes of type " +
                  std::to_string(entry.type) + " differs from the stated one");
    }
    if (entry.type == static_cast<std::uint32_t>(SectionType::kMeta)) check_meta(log, parts, entry);
    if (!known_section_type(entry.type) && (entry.flags & kSectionRequired) == 0) {
      log.add(Rule::kUnknownSection, entry.offset, where,
              "type " + std::to_string(entry.type) + ", " + std::to_string(entry.size) + " bytes");
    }
  }
}

}  // namespace modar
