// What check.cpp, check_geometry.cpp and content_summary.cpp share. Internal to formats/.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "formats/bundle_view.hpp"
#include "formats/rules.hpp"

namespace modar {

/// The hash of one section, updated front to back in pieces of any size. Hashed bytes are released
/// to the system (CheckOptions::release).
class SectionHash {
 public:
  /// The section with that key may be missing. All arguments must outlive this.
  SectionHash(FaultLog& log, const BundleParts& parts, const CheckOptions& options,
              const SectionEntry* entry);
  SectionHash(const SectionHash&) = delete;
  SectionHash& operator=(const SectionHash&) = delete;
  ~SectionHash();
  /// Hashes up to the `end`th byte of the section, if that was not done yet.
  void read_to(std::uint64_t end);
  /// Hashes the rest and reports a hash that differs.
  void finish();

 private:
  struct State;
  void release(bool all);

  FaultLog& log_;
  const BundleParts& parts_;
  const CheckOptions& options_;
  const SectionEntry* entry_;
  std::unique_ptr<State> state_;
  std::uint64_t hashed_ = 0;
  std::uint64_t released_ = 0;
};

/// The two large buffers, hashed while their contents are checked.
struct BufferHashes {
  SectionHash vertices;
  SectionHash indices;
};

/// Media files are what their records say, and what every device plays (validate_nodes.cpp).
void check_media_files(FaultLog& log, const BundleParts& parts);

/// Labels have titles and sounds captions, in the same languages each, and captions keep their
/// grammar (validate_nodes.cpp).
void check_node_texts(FaultLog& log, const BundleParts& parts);

/// Compares the content summary with the bundle, line by line. Does nothing if absent.
void check_summary(FaultLog& log, const BundleParts& parts);

/// Every index and every vertex that one refers to. Time grows with the index buffer. Needs a
/// bundle whose structure is valid.
void check_geometry(FaultLog& log, const BundleParts& parts, BufferHashes& hashes);

/// Counts how often a rule is broken and remembers where first, so that a million bad vertices make
/// one line.
struct Tally {
  std::uint64_t count = 0;
  std::uint64_t first = 0;  ///< byte in the file
  void hit(std::uint64_t offset) {
    if (count++ == 0) first = offset;
  }
};

/// Where something is in the file.
inline std::uint64_t offset_of(const BundleParts& parts, const void* place) {
  return static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - parts.bytes.data());
}

/// "model 'spider'".
inline std::string label(const BundleParts& parts, const char* what, NameRef name) {
  const auto* text = reinterpret_cast<const char*>(parts.names.data());
  return what + (" '" + (name.length == 0 ? "" : std::string(text + name.offset, name.length))) +
         "'";
}

/// "model 'spider'", "model 'spider', proxy 2": whose chunks a group is.
inline std::string group_label(const BundleParts& parts, std::uint32_t group) {
  const std::uint32_t model = parts.chunk_group(group).model;
  std::string text = label(parts, "model", parts.models[model].name);
  if (group < parts.models.size()) return text;
  std::uint32_t number = 0;
  while (group > parts.models.size() + number &&
         parts.chunk_group(group - number - 1).model == model) {
    ++number;
  }
  return text + ", proxy " + std::to_string(number);
}

}  // namespace modar
