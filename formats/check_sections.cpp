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

/// Bytes that are hashed between two releases.
constexpr std::uint64_t kReleaseStep = 1u << 20;

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

struct SectionHash::State {
  XXH64_state_t xxh;
};

SectionHash::SectionHash(FaultLog& log, const BundleParts& parts, const CheckOptions& options,
                         const SectionEntry* entry)
    : log_(log), parts_(parts), options_(options), entry_(entry), state_(new State) {
  XXH64_reset(&state_->xxh, 0);
}

SectionHash::~SectionHash() = default;

void SectionHash::read_to(std::uint64_t end) {
  if (entry_ == nullptr) return;
  const std::span<const std::byte> bytes = section_bytes(parts_, *entry_);
  while (hashed_ < end) {
    const std::uint64_t step = std::min(end - hashed_, kReleaseStep);
    XXH64_update(&state_->xxh, bytes.data() + hashed_, static_cast<std::size_t>(step));
    hashed_ += step;
    if (hashed_ - released_ >= kReleaseStep) release(false);
  }
}

void SectionHash::finish() {
  if (entry_ == nullptr) return;
  read_to(entry_->size);
  // Small sections stay: what is checked next reads them.
  if (released_ > 0) release(true);
  if (XXH64_digest(&state_->xxh) == entry_->hash) return;
  log_.add(Rule::kSectionHash, entry_->offset,
           "section " + std::to_string(entry_ - parts_.sections.data()),
           "the hash of its " + std::to_string(entry_->size) + " bytes of type " +
               std::to_string(entry_->type) + " differs from the stated one");
}

/// Gives back whole pages; the last one may hold the start of what is read next.
void SectionHash::release(bool all) {
  const std::uint64_t end = all ? hashed_ : hashed_ / kGpuAlignment * kGpuAlignment;
  if (options_.release && end > released_) {
    options_.release(section_bytes(parts_, *entry_)
                         .subspan(static_cast<std::size_t>(released_),
                                  static_cast<std::size_t>(end - released_)));
  }
  released_ = end;
}

void check_section_bytes(FaultLog& log, const BundleParts& parts, const CheckOptions& options) {
  const auto great = [&parts](SectionType type) {
    return find_section(parts.sections, type, kNone, 0);
  };
  std::uint64_t end = sizeof(FileHeader) + parts.sections.size_bytes();
  for (std::uint32_t i = 0; i < parts.sections.size(); ++i) {
    const SectionEntry& entry = parts.sections[i];
    const std::string where = "section " + std::to_string(i);
    check_zero(log, parts.bytes, end, entry.offset, "before " + where);
    end = entry.offset + entry.size;
    if (&entry != great(SectionType::kVertices) && &entry != great(SectionType::kIndices)) {
      SectionHash(log, parts, options, &entry).finish();
    }
    if (entry.type == static_cast<std::uint32_t>(SectionType::kMeta)) check_meta(log, parts, entry);
    if (!known_section_type(entry.type) && (entry.flags & kSectionRequired) == 0) {
      log.add(Rule::kUnknownSection, entry.offset, where,
              "type " + std::to_string(entry.type) + ", " + std::to_string(entry.size) + " bytes");
    }
  }
}

}  // namespace modar
