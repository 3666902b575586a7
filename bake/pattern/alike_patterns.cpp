#include "bake/pattern/alike_patterns.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "formats/tracker_record.hpp"

namespace modar {
namespace {

constexpr std::size_t kCellsOfSide = 32;  ///< cells: a title of a few letters is seen
/// Correlation of the cells above which two pictures are the same. Editions in two languages have
/// up to 0.98.
constexpr double kAlike = 0.99;
constexpr double kAspectShare = 0.05;  ///< by which the sides' ratios may differ

/// Mean gray of each cell, less their mean, of unit length.
struct Thumbnail {
  std::string name;
  double aspect = 0;
  std::array<double, kCellsOfSide * kCellsOfSide> cells{};
};

std::optional<Thumbnail> thumbnail_of(const TrackerRecordView& record) {
  const std::size_t width = record.header.width;
  const std::size_t height = record.header.height;
  if (width < kCellsOfSide || height < kCellsOfSide) return std::nullopt;
  Thumbnail thumbnail;
  thumbnail.aspect = static_cast<double>(width) / static_cast<double>(height);
  std::array<double, kCellsOfSide * kCellsOfSide> counts{};
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t cell = y * kCellsOfSide / height * kCellsOfSide + x * kCellsOfSide / width;
      thumbnail.cells[cell] += record.pixels[y * width + x];
      ++counts[cell];
    }
  }
  double mean = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) mean += thumbnail.cells[i] /= counts[i];
  mean /= static_cast<double>(counts.size());
  double square = 0;
  for (double& cell : thumbnail.cells) {
    cell -= mean;
    square += cell * cell;
  }
  if (!(square > 0)) return std::nullopt;
  for (double& cell : thumbnail.cells) cell /= std::sqrt(square);
  return thumbnail;
}

double correlation(const Thumbnail& a, const Thumbnail& b, bool mirrored) {
  double sum = 0;
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const std::size_t column = i % kCellsOfSide;
    sum += a.cells[i] * b.cells[mirrored ? i - column + (kCellsOfSide - 1 - column) : i];
  }
  return sum;
}

}  // namespace

std::vector<Diagnostic> alike_patterns(const BundleContent& content) {
  std::vector<Thumbnail> seen;
  std::vector<Diagnostic> findings;
  for (const ExtraSection& section : content.extra) {
    TrackerRecordView record;
    if (section.type != static_cast<std::uint32_t>(SectionType::kTrackerRecord) ||
        view_tracker_record(section.bytes, record)) {
      continue;
    }
    auto thumbnail = thumbnail_of(record);
    if (!thumbnail) continue;
    const NameRef& name = content.patterns[section.owner].name;
    thumbnail->name = content.names.substr(name.offset, name.length);
    for (const Thumbnail& other : seen) {
      if (std::fabs(other.aspect / thumbnail->aspect - 1) > kAspectShare) continue;
      const bool same = correlation(other, *thumbnail, false) >= kAlike;
      if (!same && correlation(other, *thumbnail, true) < kAlike) continue;
      findings.push_back({same ? "pattern.same" : "pattern.mirrored", DiagnosticSeverity::kWarning,
                          thumbnail->name, 0,
                          (same ? "it is the same picture as '" : "it is the mirror image of '") +
                              other.name + "'",
                          "leave one out: the tracker may take either for the other"});
    }
    seen.push_back(std::move(*thumbnail));
  }
  return findings;
}

}  // namespace modar
