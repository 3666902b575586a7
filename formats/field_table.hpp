// Every field of the bundle's records by name, for code that walks over all of them (the content
// summary, `modar-lab mutate`). A test compares the table with bundle.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/layout.hpp"

namespace modar {

enum class FieldType : std::uint8_t { kU8, kU16, kU32, kU64, kI32, kF32, kF64, kName, kAttributes };

/// Bytes of one element: 8 for a NameRef and an AttributeRecord.
constexpr std::size_t field_element_bytes(FieldType type) {
  switch (type) {
    case FieldType::kU8:
      return 1;
    case FieldType::kU16:
      return 2;
    case FieldType::kU32:
    case FieldType::kI32:
    case FieldType::kF32:
      return 4;
    default:
      return 8;
  }
}

struct FieldInfo {
  const char* name;  ///< as in bundle.md
  std::uint16_t offset = 0;
  FieldType type = FieldType::kU32;
  std::uint8_t count = 1;  ///< elements of an array
  bool reserved = false;   ///< zero in a file
};

struct RecordInfo {
  const char* name;   ///< of the struct, as in bundle.md
  const char* table;  ///< of the table in content summaries: "models"; nullptr: no table of records
  SectionType section = SectionType::kNames;  ///< that holds the table
  std::size_t size = 0;
  std::span<const FieldInfo> fields;
};

/// All structs of bundle.md but NameRef and those of tracker records; those of tables come first,
/// by section type.
std::span<const RecordInfo> record_infos();

/// The one of that name, which must be there.
const RecordInfo& record_info(const char* name);

}  // namespace modar
