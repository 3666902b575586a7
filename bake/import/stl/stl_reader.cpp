// Reads binary and ASCII STL. The facets' own normals are not used: many programs write zeros.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fast_float/fast_float.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "bake/import/read_model.hpp"
#include "bake/import/text_words.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr std::size_t kHeaderBytes = 84;            ///< 80 of text and the count
constexpr std::size_t kFacetBytes = 50;             ///< normal, three corners, 16 bits of attribute
constexpr std::uint64_t kMostFacets = 0x15555555u;  ///< of a model: corners stay under 2^30

/// A corner as the file has it. Two are one position if all bits are the same.
struct StlCorner {
  std::array<float, 3> at{};
  std::uint32_t colour = 0;  ///< 0x00RRGGBB with bit 24 set; 0: none
};

/// Joins corners of equal place and colour: open addressing, doubled when two thirds are used.
class PositionIndex {
 public:
  explicit PositionIndex(SourceModel& model) : model_(model) { slots_.assign(1024, kNoIndex); }

  std::uint32_t index_of(StlCorner corner) {
    for (float& value : corner.at) value += 0.0f;  // -0 and 0 are one place
    if (3 * corners_.size() >= 2 * slots_.size()) grow();
    std::size_t slot = hash(corner) & (slots_.size() - 1);
    while (slots_[slot] != kNoIndex) {
      if (std::memcmp(&corners_[slots_[slot]], &corner, sizeof corner) == 0) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<std::uint32_t>(corners_.size());
    corners_.push_back(corner);
    model_.positions.push_back(glm::dvec3(corner.at[0], corner.at[1], corner.at[2]));
    return slots_[slot];
  }

  /// Gives the model its colours, where a corner has one; others are white.
  void finish() {
    const bool coloured = std::any_of(corners_.begin(), corners_.end(),
                                      [](const StlCorner& corner) { return corner.colour != 0; });
    for (std::size_t i = 0; coloured && i < corners_.size(); ++i) {
      const std::uint32_t colour = corners_[i].colour == 0 ? 0xFFFFFFu : corners_[i].colour;
      model_.colours.push_back(glm::vec3(static_cast<float>(colour >> 16 & 255),
                                         static_cast<float>(colour >> 8 & 255),
                                         static_cast<float>(colour & 255)) /
                               255.0f);
    }
  }

 private:
  static std::size_t hash(const StlCorner& corner) { return XXH64(&corner, sizeof corner, 0); }

  void grow() {
    std::vector<std::uint32_t> larger(2 * slots_.size(), kNoIndex);
    for (std::uint32_t i = 0; i < corners_.size(); ++i) {
      std::size_t slot = hash(corners_[i]) & (larger.size() - 1);
      while (larger[slot] != kNoIndex) slot = (slot + 1) & (larger.size() - 1);
      larger[slot] = i;
    }
    slots_.swap(larger);
  }

  SourceModel& model_;
  std::vector<StlCorner> corners_;
  std::vector<std::uint32_t> slots_;
};

/// Omitted parts of a file, for one finding each.
struct Skipped {
  std::uint64_t not_finite = 0;
};

/// Takes a facet unless a coordinate is not finite.
void add_facet(const std::array<StlCorner, 3>& corners, SourceModel& model, PositionIndex& index,
               Skipped& skipped) {
  for (const StlCorner& corner : corners) {
    for (const float value : corner.at) {
      if (std::isfinite(value)) continue;
      ++skipped.not_finite;
      return;
    }
  }
  for (const StlCorner& corner : corners) model.corner_positions.push_back(index.index_of(corner));
}

std::uint32_t colour_of_bits(std::uint16_t bits, bool red_first) {
  const auto wide = [](unsigned five) { return (five * 255 + 15) / 31; };
  const std::uint32_t low = wide(bits & 31u);
  const std::uint32_t middle = wide(bits >> 5 & 31u);
  const std::uint32_t high = wide(bits >> 10 & 31u);
  return 1u << 24 | (red_first ? low : high) << 16 | middle << 8 | (red_first ? high : low);
}

/// Materialise Magics writes "COLOR=" and the colour of the whole into the header; then facets with
/// bit 15 unset have a colour of their own, red in the low bits. Elsewhere bit 15 set means a
/// colour, blue in the low bits.
struct ColourRule {
  bool magics = false;
  std::uint32_t whole = 0;

  explicit ColourRule(std::string_view header) {
    const std::size_t at = header.find("COLOR=");
    magics = at != std::string_view::npos && at + 10 <= header.size();
    if (!magics) return;
    const auto byte = [&](std::size_t i) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(header[at + 6 + i]));
    };
    whole = 1u << 24 | byte(0) << 16 | byte(1) << 8 | byte(2);
  }

  [[nodiscard]] std::uint32_t of(std::uint16_t bits) const {
    const bool flag = (bits & 0x8000u) != 0;
    if (magics) return flag ? whole : colour_of_bits(bits, true);
    return flag ? colour_of_bits(bits, false) : 0;
  }
};

void read_binary(std::string_view bytes, std::uint64_t count, SourceModel& model,
                 PositionIndex& index, Skipped& skipped) {
  const ColourRule rule(bytes.substr(0, 80));
  for (std::uint64_t f = 0; f < count; ++f) {
    const char* const facet = bytes.data() + kHeaderBytes + f * kFacetBytes;
    std::uint16_t bits = 0;
    std::memcpy(&bits, facet + 48, sizeof bits);
    std::array<StlCorner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      std::memcpy(corners[k].at.data(), facet + 12 + 12 * k, 12);
      corners[k].colour = rule.of(bits);
    }
    add_facet(corners, model, index, skipped);
  }
}

bool same_word(std::string_view word, std::string_view lower) {
  return word.size() == lower.size() &&
         std::equal(word.begin(), word.end(), lower.begin(), [](char a, char b) {
           return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
         });
}

/// Three numbers. False where there are fewer.
bool parse_corner(std::string_view line, StlCorner& corner) {
  for (float& value : corner.at) {
    std::string_view word = next_word(line);
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = fast_float::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return false;
  }
  return true;
}

Result<void> read_text(std::string_view text, const std::string& label, SourceModel& model,
                       PositionIndex& index, Skipped& skipped) {
  std::vector<StlCorner> loop;
  bool ended = false;
  const auto close_loop = [&] {
    for (std::size_t i = 2; i < loop.size(); ++i) {
      add_facet({loop[0], loop[i - 1], loop[i]}, model, index, skipped);
    }
    loop.clear();
  };
  for (std::uint64_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view word = next_word(line);
    bool good = true;
    if (!word.empty()) ended = same_word(word, "endsolid");
    if (same_word(word, "vertex")) {
      good = parse_corner(line, loop.emplace_back());
    } else if (same_word(word, "endloop") || same_word(word, "endfacet")) {
      close_loop();
    } else {
      good = word.empty();
      for (const char* known : {"facet", "outer", "solid", "endsolid", "color"}) {
        good = good || same_word(word, known);
      }
    }
    if (good) continue;
    return fail(ExitCode::kInvalidInput, "stl.text", label + ":" + std::to_string(number),
                "'" + std::string(word.substr(0, 32)) + "' is not a line of an ASCII STL file",
                "export the model again, as binary STL, PLY or OBJ");
  }
  if (!ended) {
    model.diagnostics.push_back({"stl.unfinished", DiagnosticSeverity::kWarning, label, 0,
                                 "the file ends without 'endsolid': it may be truncated",
                                 "compare its size with the original, or export the model again"});
  }
  return {};
}

/// How many facets a binary file has; nothing where it is text.
std::optional<std::uint64_t> binary_count(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return std::nullopt;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  const std::uint64_t needed = kHeaderBytes + std::uint64_t{count} * kFacetBytes;
  // Binary files whose header begins with "solid" are common: their size shows what they are. Some
  // programs write a few bytes behind the facets; a text has no zeros there.
  const bool zeros = bytes.find('\0') != std::string_view::npos;
  std::string_view start = bytes.substr(0, 80);
  if (needed != bytes.size() && !zeros && same_word(next_word(start), "solid")) return std::nullopt;
  return count;
}

}  // namespace

Result<SourceModel> parse_stl(std::string_view bytes, const std::string& label) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  SourceModel model;
  model.name = std::filesystem::path(label).stem().string();
  model.up = {UpAxis::kZ, UpReason::kConvention};  // of CAD programs and printers
  PositionIndex index(model);
  Skipped skipped;
  if (const auto count = binary_count(bytes)) {
    const std::uint64_t there = (bytes.size() - kHeaderBytes) / kFacetBytes;
    if (*count > there || *count > kMostFacets) {
      return fail(ExitCode::kInvalidInput, "stl.short", label + ": byte 80",
                  "the file states " + std::to_string(*count) + " triangles and has room for " +
                      std::to_string(std::min(there, kMostFacets)),
                  "the file is truncated or not an STL file; copy or export it again");
    }
    read_binary(bytes, *count, model, index, skipped);
  } else {
    MODAR_TRY(read_text(bytes, label, model, index, skipped));
  }
  if (model.corner_positions.empty()) {
    return fail(ExitCode::kInvalidInput, "stl.no-faces", label, "the file has no triangle",
                "export the model again");
  }
  index.finish();
  model.lost_faces = skipped.not_finite;
  if (skipped.not_finite != 0) {
    model.diagnostics.push_back(
        {"stl.not-finite", DiagnosticSeverity::kWarning, label, 0,
         std::to_string(skipped.not_finite) + " triangles have coordinates that are not finite",
         "they are left out; export the model again"});
  }
  model.materials.emplace_back();
  model.material_runs = {{0, 0}};
  model.smoothing_runs = {{0, kUnstatedSmoothing}};
  return model;
}

Result<SourceModel> read_stl(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  return file.settle(
      parse_stl({reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()}, path));
}

}  // namespace modar
