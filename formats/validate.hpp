// The parts of validation that BundleView::open() and check_bundle() share. Internal to formats/.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "formats/bundle_view.hpp"
#include "formats/component.hpp"
#include "formats/rules.hpp"

namespace modar {

/// Header and section table. False if the sections cannot be trusted to be inside the file;
/// otherwise fills parts.bytes and parts.sections.
bool validate_sections(std::span<const std::byte> bytes, FaultLog& log, BundleParts& parts);

/// Finds the tables and buffers behind the sections. False where a table cannot be walked.
bool validate_tables(FaultLog& log, BundleParts& parts);

/// Models, chunks, levels, materials, layouts. Time grows with the tables, not with what they
/// claim.
void validate_models(FaultLog& log, const BundleParts& parts);

/// Textures, patterns, parameter sets, features, scenes.
void validate_assets(FaultLog& log, const BundleParts& parts);

/// Clips, joints, bones, parts, and what scenes play (validate_clips.cpp).
void validate_clips(FaultLog& log, const BundleParts& parts);

/// Nodes and actions (validate_nodes.cpp).
void validate_nodes(FaultLog& log, const BundleParts& parts);

/// The specification gives the section type a meaning.
bool known_section_type(std::uint32_t type);

/// The minor version that added a section type; 0 for those that it does not know.
std::uint16_t section_since(std::uint32_t type);

/// The section with that key, or nullptr.
const SectionEntry* find_section(std::span<const SectionEntry> sections, SectionType type,
                                 std::uint32_t owner, std::uint32_t variant);

/// The index of the parameter set with that id, or kNone. Sets are sorted by id.
std::uint32_t find_parameter_set(const Table<ParameterSetRecord>& sets, std::uint32_t id);

inline std::span<const std::byte> section_bytes(const BundleParts& parts,
                                                const SectionEntry& entry) {
  return parts.bytes.subspan(static_cast<std::size_t>(entry.offset),
                             static_cast<std::size_t>(entry.size));
}

/// A file of a newer minor version may use reserved fields and flag bits in ways that can be
/// ignored.
inline bool newer_minor(const BundleParts& parts) {
  return reinterpret_cast<const FileHeader*>(parts.bytes.data())->minor > kMinorVersion;
}

/// A direction, or a quaternion that turns and does nothing else.
template <std::size_t N>
bool unit_length(const float (&parts)[N]) {
  double square = 0.0;
  for (const float part : parts) square += static_cast<double>(part) * static_cast<double>(part);
  return std::fabs(square - 1.0) <= 1e-4;
}

/// One record under test: tells faults where they are.
class RecordCheck {
 public:
  RecordCheck(FaultLog& log, const BundleParts& parts, const char* what, std::uint32_t index)
      : log_(log), parts_(parts), what_(what), index_(index) {}

  // Reports of faults are not inline: the player has a hundred calls of it.

  /// `field` points into the record.
  void fault(Rule rule, const void* field, std::string_view detail) const;
  /// detail, numbers: as with_numbers() takes them.
  void fault(Rule rule, const void* field, const char* detail,
             std::initializer_list<std::uint64_t> numbers = {}) const;

  /// Finite and within [low, high].
  template <class T>
  void number(const T& field, const char* name, double low = -std::numeric_limits<T>::max(),
              double high = std::numeric_limits<T>::max()) const {
    check_number(&field, name, static_cast<double>(field), low, high);
  }
  template <class T, std::size_t N>
  void numbers(const T (&fields)[N], const char* name, double low = -std::numeric_limits<T>::max(),
               double high = std::numeric_limits<T>::max()) const {
    for (const T& field : fields) number(field, name, low, high);
  }
  /// 0, which means an unknown size, or within [low, high].
  void size(const double& field, const char* name, double low, double high) const {
    if (field != 0.0) number(field, name, low, high);
  }

  void reserved(const void* field, std::size_t bytes) const;
  void flags(const std::uint32_t& field, std::uint32_t known) const;

  /// The name is inside the names section and starts and ends at characters.
  void name(const NameRef& ref) const;

  /// True if first == expected and first + count stays within size; ranges follow each other.
  [[nodiscard]] bool range(Rule rule, const std::uint32_t& first, std::uint32_t count,
                           std::uint64_t expected, std::uint32_t size, const char* name) const;

 private:
  void check_number(const void* field, const char* name, double value, double low,
                    double high) const;

  FaultLog& log_;
  const BundleParts& parts_;
  const char* what_;
  std::uint32_t index_;
};

}  // namespace modar
