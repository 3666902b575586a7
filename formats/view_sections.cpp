// Validation of the header, the section table and the shape of the tables.
#include <algorithm>
#include <cstring>
#include <tuple>

#include "formats/utf8.hpp"
#include "formats/validate.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

/// What version 1.0 says about a section type.
struct KnownType {
  SectionType type;
  std::uint16_t flags;
  bool owned;  ///< owner and variant are used
};

constexpr KnownType kKnownTypes[] = {
    {SectionType::kNames, kSectionRequired, false},
    {SectionType::kMeta, 0, false},
    {SectionType::kStatement, 0, false},
    {SectionType::kModels, kSectionRequired, false},
    {SectionType::kChunks, kSectionRequired, false},
    {SectionType::kLevels, kSectionRequired, false},
    {SectionType::kMaterials, kSectionRequired, false},
    {SectionType::kLayouts, kSectionRequired, false},
    {SectionType::kTextures, kSectionRequired, false},
    {SectionType::kTextureLevels, kSectionRequired, false},
    {SectionType::kPatterns, kSectionRequired, false},
    {SectionType::kParameterSets, kSectionRequired, false},
    {SectionType::kScenes, kSectionRequired, false},
    {SectionType::kMappedFeatures, kSectionRequired, true},
    {SectionType::kFeatureYml, 0, true},
    {SectionType::kTrackerRecord, 0, true},
    {SectionType::kVertices, kSectionRequired | kSectionGpu, false},
    {SectionType::kIndices, kSectionRequired | kSectionGpu, false},
    {SectionType::kTextureData, kSectionRequired | kSectionGpu, true},
};

const KnownType* known_type(std::uint32_t type) {
  for (const KnownType& known : kKnownTypes) {
    if (static_cast<std::uint32_t>(known.type) == type) return &known;
  }
  return nullptr;
}

auto key(const SectionEntry& entry) {
  return std::make_tuple(entry.type, entry.owner, entry.variant);
}

std::uint64_t header_hash(std::span<const std::byte> bytes, const FileHeader& header) {
  XXH64_state_t state;
  XXH64_reset(&state, 0);
  XXH64_update(&state, bytes.data(), offsetof(FileHeader, hash));
  XXH64_update(&state, bytes.data() + header.table_offset,
               std::size_t{header.section_count} * sizeof(SectionEntry));
  return XXH64_digest(&state);
}

/// The fields that decide whether the rest of the file can be looked at. False: it cannot.
bool readable(std::span<const std::byte> bytes, FaultLog& log) {
  const auto refuse = [&log](Rule rule, std::uint64_t offset, std::string detail) {
    log.add(rule, offset, "header", std::move(detail));
    return false;
  };
  if (bytes.size() < sizeof(FileHeader)) {
    return refuse(Rule::kTruncated, bytes.size(),
                  "the file has " + std::to_string(bytes.size()) + " bytes, a header has 64");
  }
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) != 0) {
    return refuse(Rule::kHeader, 0, "the first byte is at an address that 8 does not divide");
  }
  const auto& header = *reinterpret_cast<const FileHeader*>(bytes.data());
  if (std::memcmp(header.magic, kMagic.data(), kMagic.size()) != 0) {
    return refuse(Rule::kMagicBytes, 0, "the first eight bytes are not those of a bundle");
  }
  if (header.major != kMajorVersion) {
    return refuse(Rule::kVersion, offsetof(FileHeader, major),
                  "the file has version " + std::to_string(header.major) + "." +
                      std::to_string(header.minor) + ", this program reads 1.x");
  }
  const auto sizes = [&] {
    return "the header states " + std::to_string(header.file_size) + " bytes, the file has " +
           std::to_string(bytes.size());
  };
  if (bytes.size() < header.file_size) return refuse(Rule::kTruncated, bytes.size(), sizes());
  if (bytes.size() > header.file_size) {
    return refuse(Rule::kFileSize, offsetof(FileHeader, file_size), sizes());
  }
  if (header.table_offset != sizeof(FileHeader) || header.entry_size != sizeof(SectionEntry)) {
    return refuse(Rule::kHeader, offsetof(FileHeader, table_offset),
                  "the section table is not at byte 64 with entries of 48 bytes");
  }
  if (header.section_count > kMaxSections ||
      header.section_count > (bytes.size() - sizeof(FileHeader)) / sizeof(SectionEntry)) {
    return refuse(Rule::kSectionCount, offsetof(FileHeader, section_count),
                  std::to_string(header.section_count) + " sections do not fit");
  }
  return true;
}

/// Type, version, flags and owner of one entry.
void check_kind(const RecordCheck& check, const SectionEntry& entry, bool newer) {
  if (!newer && (entry.flags & ~(kSectionRequired | kSectionGpu)) != 0) {
    check.fault(Rule::kReserved, &entry.flags,
                "flags " + std::to_string(entry.flags) + " have unknown bits");
  }
  check.reserved(&entry.reserved, sizeof(entry.reserved));
  const KnownType* known = known_type(entry.type);
  if (known == nullptr) {
    if ((entry.flags & kSectionRequired) != 0) {
      check.fault(Rule::kSectionRequired, &entry.type,
                  "section type " + std::to_string(entry.type) + " is required and unknown");
    }
    return;
  }
  if (entry.version != 1) {
    check.fault(Rule::kSectionVersion, &entry.version,
                "section type " + std::to_string(entry.type) + " has version " +
                    std::to_string(entry.version) + ", this program reads 1");
  }
  if ((entry.flags & (kSectionRequired | kSectionGpu)) != known->flags) {
    check.fault(Rule::kSectionFlags, &entry.flags,
                "section type " + std::to_string(entry.type) + " has flags " +
                    std::to_string(entry.flags) + ", not " + std::to_string(known->flags));
  }
  if (!known->owned && (entry.owner != kNone || entry.variant != 0)) {
    check.fault(Rule::kSectionOwner, &entry.owner,
                "section type " + std::to_string(entry.type) + " belongs to no record");
  }
}

/// True if the section lies inside the file, behind `end`.
bool check_place(const RecordCheck& check, const SectionEntry& entry, std::uint64_t end,
                 std::uint64_t file_size) {
  const std::uint64_t alignment =
      (entry.flags & kSectionGpu) != 0 ? kGpuAlignment : kSectionAlignment;
  if (entry.offset % alignment != 0) {
    check.fault(Rule::kSectionUnaligned, &entry.offset,
                "offset " + std::to_string(entry.offset) + " is no multiple of " +
                    std::to_string(alignment));
    return false;
  }
  if (entry.offset < end || entry.offset > file_size || entry.size > file_size - entry.offset) {
    check.fault(Rule::kSectionRange, &entry.offset,
                std::to_string(entry.size) + " bytes at " + std::to_string(entry.offset) +
                    " do not lie between byte " + std::to_string(end) + " and the end, " +
                    std::to_string(file_size));
    return false;
  }
  return true;
}

/// The header of a table whose records have `size` bytes, if it has the right shape; its records
/// follow it. nullptr and true: the bundle has no such table.
bool find_header(FaultLog& log, const BundleParts& parts, SectionType type, std::size_t size,
                 const TableHeader*& found) {
  const SectionEntry* entry = find_section(parts.sections, type, kNone, 0);
  if (entry == nullptr) return true;
  const std::span<const std::byte> bytes = section_bytes(parts, *entry);
  const auto refuse = [&](std::string detail) {
    log.add(Rule::kTableShape, entry->offset, "section type " + std::to_string(entry->type),
            std::move(detail));
    return false;
  };
  if (bytes.size() < sizeof(TableHeader)) return refuse("it is too small for a table's header");
  const auto& header = *reinterpret_cast<const TableHeader*>(bytes.data());
  if (header.stride < size || header.stride % 8 != 0 ||
      (header.stride != size && !newer_minor(parts))) {
    return refuse("its records have " + std::to_string(header.stride) + " bytes, not " +
                  std::to_string(size));
  }
  // Neither factor exceeds 32 bits, so the product cannot overflow.
  if (std::uint64_t{header.count} * header.stride != bytes.size() - sizeof(TableHeader)) {
    return refuse(std::to_string(header.count) + " records of " + std::to_string(header.stride) +
                  " bytes do not fill " + std::to_string(bytes.size()) + " bytes");
  }
  if (header.reserved != 0 && !newer_minor(parts)) {
    log.add(Rule::kReserved, entry->offset + offsetof(TableHeader, reserved),
            "section type " + std::to_string(entry->type), "a reserved field is not zero");
  }
  found = &header;
  return true;
}

template <class T>
bool find_table(FaultLog& log, const BundleParts& parts, SectionType type, Table<T>& table) {
  const TableHeader* header = nullptr;
  if (!find_header(log, parts, type, sizeof(T), header)) return false;
  if (header != nullptr) {
    table = Table<T>(reinterpret_cast<const std::byte*>(header + 1), header->count, header->stride);
  }
  return true;
}

void check_names(FaultLog& log, const BundleParts& parts) {
  std::string_view rest(reinterpret_cast<const char*>(parts.names.data()), parts.names.size());
  while (!rest.empty()) {
    const std::size_t length = utf8_character(rest);
    if (length == 0) {
      const auto* at = reinterpret_cast<const std::byte*>(rest.data());
      log.add(Rule::kName, static_cast<std::uint64_t>(at - parts.bytes.data()), "names",
              "a byte belongs to no printable character of UTF-8");
      return;
    }
    rest.remove_prefix(length);
  }
}

}  // namespace

bool known_section_type(std::uint32_t type) {
  return known_type(type) != nullptr;
}

const SectionEntry* find_section(std::span<const SectionEntry> sections, SectionType type,
                                 std::uint32_t owner, std::uint32_t variant) {
  const auto wanted = std::make_tuple(static_cast<std::uint32_t>(type), owner, variant);
  const auto found = std::lower_bound(
      sections.begin(), sections.end(), wanted,
      [](const SectionEntry& entry, const auto& value) { return key(entry) < value; });
  return found != sections.end() && key(*found) == wanted ? &*found : nullptr;
}

bool validate_sections(std::span<const std::byte> bytes, FaultLog& log, BundleParts& parts) {
  if (!readable(bytes, log)) return false;
  const auto& header = *reinterpret_cast<const FileHeader*>(bytes.data());
  parts.bytes = bytes;
  parts.sections = {reinterpret_cast<const SectionEntry*>(bytes.data() + header.table_offset),
                    header.section_count};
  if (header_hash(bytes, header) != header.hash) {
    log.add(Rule::kHeaderHash, offsetof(FileHeader, hash), "header",
            "the hash of header and section table differs from the stated one");
  }
  const RecordCheck header_check(log, parts, "header", 0);
  header_check.reserved(&header.reserved0, sizeof(header.reserved0));
  header_check.reserved(header.reserved1, sizeof(header.reserved1));
  bool placed = true;
  std::uint64_t end =
      header.table_offset + std::uint64_t{header.section_count} * sizeof(SectionEntry);
  for (std::uint32_t i = 0; i < header.section_count && !log.stop(); ++i) {
    const SectionEntry& entry = parts.sections[i];
    const RecordCheck check(log, parts, "section", i);
    if (i > 0 && !(key(parts.sections[i - 1]) < key(entry))) {
      check.fault(Rule::kSectionOrder, &entry.type,
                  "it does not sort behind the one before by type, owner and variant");
      placed = false;
    }
    check_kind(check, entry, newer_minor(parts));
    if (check_place(check, entry, end, header.file_size)) {
      end = entry.offset + entry.size;
    } else {
      placed = false;
    }
  }
  if (placed && !log.stop() && end != header.file_size) {
    log.add(Rule::kFileSize, end, "header",
            "the last section ends at byte " + std::to_string(end) + ", the file at " +
                std::to_string(header.file_size));
  }
  return placed && !log.stop();
}

bool validate_tables(FaultLog& log, BundleParts& parts) {
  const auto blob = [&parts](SectionType type) {
    const SectionEntry* entry = find_section(parts.sections, type, kNone, 0);
    return entry != nullptr ? section_bytes(parts, *entry) : std::span<const std::byte>();
  };
  parts.names = blob(SectionType::kNames);
  parts.vertices = blob(SectionType::kVertices);
  parts.indices = blob(SectionType::kIndices);
  check_names(log, parts);
  bool walkable = find_table(log, parts, SectionType::kModels, parts.models);
  walkable &= find_table(log, parts, SectionType::kChunks, parts.chunks);
  walkable &= find_table(log, parts, SectionType::kLevels, parts.levels);
  walkable &= find_table(log, parts, SectionType::kMaterials, parts.materials);
  walkable &= find_table(log, parts, SectionType::kLayouts, parts.layouts);
  walkable &= find_table(log, parts, SectionType::kTextures, parts.textures);
  walkable &= find_table(log, parts, SectionType::kTextureLevels, parts.texture_levels);
  walkable &= find_table(log, parts, SectionType::kPatterns, parts.patterns);
  walkable &= find_table(log, parts, SectionType::kParameterSets, parts.parameter_sets);
  walkable &= find_table(log, parts, SectionType::kScenes, parts.scenes);
  return walkable && !log.stop();
}

void RecordCheck::name(const NameRef& ref) const {
  const std::uint64_t end = std::uint64_t{ref.offset} + ref.length;
  const auto starts_character = [this](std::uint64_t at) {
    return at == parts_.names.size() ||
           !utf8_continues(static_cast<char>(parts_.names[static_cast<std::size_t>(at)]));
  };
  if (ref.length > kMaxNameBytes || end > parts_.names.size() || !starts_character(ref.offset) ||
      !starts_character(end)) {
    fault(Rule::kName, &ref,
          std::to_string(ref.length) + " bytes at " + std::to_string(ref.offset) +
              " are no whole characters of the " + std::to_string(parts_.names.size()) +
              " bytes of names");
  }
}

bool RecordCheck::range(Rule rule, const std::uint32_t& first, std::uint32_t count,
                        std::uint64_t expected, std::uint32_t size, const char* name) const {
  if (first == expected && std::uint64_t{first} + count <= size) return true;
  fault(rule, &first,
        std::string(name) + " " + std::to_string(first) + " and " + std::to_string(count) +
            " in all do not follow the " + std::to_string(expected) + " before them within " +
            std::to_string(size));
  return false;
}

}  // namespace modar
