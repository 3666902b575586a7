// Small bundles to test on, and what it takes to damage them with intent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/bundle_writer.hpp"
#include "formats/check.hpp"
#include "formats/layout.hpp"

namespace modar::test {

using Bytes = std::vector<std::byte>;

/// A pattern with two described parameter sets, no model: under 6 KB.
BundleContent pattern_content();

/// An octahedron in two chunks, one of them with two levels; two GPU sections.
BundleContent model_content();

/// A texture of 8 x 4 pixels with four levels and alpha twins; one GPU section.
BundleContent texture_content();

/// All of the format: 3 models of 3 layouts, 2 materials, a texture with mipmaps and alpha twins, 2
/// patterns, 2 scenes, an unknown optional section.
BundleContent golden_content();

/// Adds what version 1.2 added to a golden_content(): lights, occlusion, a shadow, a material that
/// hides, its first pattern on a cone and its second on two faces of a box.
void add_looks(BundleContent& content);

/// An MP4 file of some pixels and seconds without a picture in it: boxes alone, with what they
/// state. index_first: moov before mdat.
Bytes small_mp4(std::uint16_t width, std::uint16_t height, std::uint32_t seconds,
                bool index_first = true, std::uint8_t profile = 66);
/// The same with a track of AAC alone.
Bytes small_sound(std::uint32_t seconds);

/// Adds what version 1.3 added to that: nodes of each kind, actions of each event and command.
void add_nodes(BundleContent& content);
/// Two clips of the third model of golden_content(), which share their tracks; a scene plays one.
void add_clips(BundleContent& content);
/// Adds what version 1.3 added to a content of three octahedra: two proxies of the first, of
/// which one has two chunks, and one of the third.
void add_proxies(BundleContent& content);

/// A golden_content() with all that version 1.2 added, and no section of an unknown type.
BundleContent lit_content();

/// A model_content() whose vertices name two bones.
BundleContent skinned_content();
/// A lit_content() with nodes and actions.
BundleContent acting_content();

/// Encodes or ends the program: test contents are never wrong.
Bytes encode(const BundleContent& content);

/// The table's entry for a section; ends the program if it is not there.
SectionEntry& entry_of(Bytes& bytes, SectionType type);

/// Record `index` of a table, to be damaged.
template <class T>
T& record_of(Bytes& bytes, SectionType type, std::uint32_t index = 0) {
  return *reinterpret_cast<T*>(bytes.data() + entry_of(bytes, type).offset + sizeof(TableHeader) +
                               index * sizeof(T));
}

/// Makes all hashes and the stated file size true again.
void rehash(Bytes& bytes);

/// "error BUNDLE_MAGIC header (byte 0): detail", one for each issue.
std::vector<std::string> report(std::span<const std::byte> bytes);

Bytes read_file(const std::string& path);
std::string source_path(const std::string& relative);

/// Of opening and of contents, in the order of ISSUES.md.
std::vector<IssueKind> issue_kinds();

}  // namespace modar::test
