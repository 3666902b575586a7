// Patterns: features, the small picture and its colours against the picture of the tracker record.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/check/content/content_rules.hpp"
#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "formats/colour_grid.hpp"
#include "formats/component.hpp"
#include "formats/tracker_record.hpp"
#include "modar/packed_record.hpp"

namespace modar {
namespace {

/// Rms gray difference that WebP may make in a block. Lower: fine saturated patterns are refused;
/// higher: damaged blocks pass. [40, 80]
constexpr double kMostBlockRms = 60;
/// Difference of a cell's colour from the small picture's, as the root of linear light. Lower:
/// stripes of pure colours are refused. [0.2, 0.4]
constexpr double kMostColourOff = 0.3;

/// The record's finest level, as large as the small picture.
RgbaImage record_picture(const TrackerRecordView& record, const RgbaImage& like) {
  RgbaImage image{record.header.width, record.header.height, {}};
  image.pixels.resize(std::size_t{4} * image.width * image.height, 255);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    std::fill_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(i), 3, record.pixels[i / 4]);
  }
  return resize(image, like.width, like.height, {});
}

/// Greatest rms difference in luma of a block.
double worst_block(const RgbaImage& wanted, const RgbaImage& shown) {
  constexpr std::uint32_t kSide = 16;
  const std::uint32_t columns = (shown.width + kSide - 1) / kSide;
  const std::uint32_t rows = (shown.height + kSide - 1) / kSide;
  std::vector<std::array<double, 2>> sums(std::size_t{columns} * rows);  // of squares; pixels
  for (std::uint32_t y = 0; y < shown.height; ++y) {
    for (std::uint32_t x = 0; x < shown.width; ++x) {
      const std::uint8_t* p = &shown.pixels[4 * (std::size_t{y} * shown.width + x)];
      const double luma = 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
      const double off = wanted.pixels[4 * (std::size_t{y} * shown.width + x)] - luma;
      auto& sum = sums[std::size_t{y / kSide} * columns + x / kSide];
      sum = {sum[0] + off * off, sum[1] + 1};
    }
  }
  double worst = 0;
  for (const auto& [squares, pixels] : sums) worst = std::max(worst, squares / pixels);
  return std::sqrt(worst);
}

/// Greatest difference between a stored colour and the mean of its cell of the small picture.
double worst_colour(const RgbaImage& shown, std::span<const std::byte> colours) {
  const auto grid = load_number<ColourGridHeader>(colours.data());
  const LinearImage linear = to_linear(shown);
  std::vector<std::array<double, 4>> sums(std::size_t{grid.columns} * grid.rows);
  for (std::uint32_t y = 0; y < shown.height; ++y) {
    for (std::uint32_t x = 0; x < shown.width; ++x) {
      auto& sum = sums[std::size_t{y * grid.rows / shown.height} * grid.columns +
                       x * grid.columns / shown.width];
      const float* pixel = &linear.pixels[4 * (std::size_t{y} * shown.width + x)];
      for (std::size_t c = 0; c < 4; ++c) sum[c] += static_cast<double>(pixel[c]);
    }
  }
  double worst = 0;
  const std::byte* stored = colours.data() + sizeof grid;
  for (std::size_t cell = 0; cell < sums.size(); ++cell) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double code = load_number<std::uint16_t>(stored + 6 * cell + 2 * c) / 65535.0;
      // A picture of fewer pixels than cells leaves some without one.
      if (sums[cell][3] == 0) continue;
      const double mean = sums[cell][c] / sums[cell][3];
      worst = std::max(worst, std::abs(std::sqrt(code) - std::sqrt(mean)));
    }
  }
  return worst;
}

/// The fault of a flat pattern's small picture or colours; empty: none.
std::string preview_fault(const BundleView& bundle, std::uint32_t p) {
  const auto file = bundle.section(SectionType::kPatternPicture, p);
  TrackerRecordView record;
  if (file.empty() || !bundle.section(SectionType::kPatternShape, p).empty() ||
      view_tracker_record(bundle.section(SectionType::kTrackerRecord, p), record)) {
    return "";
  }
  const auto picture = decode_image(file, "WebP", Colours::kStored);
  if (!picture) return "its small picture cannot be decoded";
  if (worst_block(record_picture(record, *picture), *picture) > kMostBlockRms) {
    return "its small picture is not that of the tracker record";
  }
  const auto colours = bundle.section(SectionType::kPatternColours, p);
  if (!colours.empty() && worst_colour(*picture, colours) > kMostColourOff) {
    return "its colours are not those of its small picture";
  }
  return "";
}

}  // namespace

void check_pictures(ContentLog& log) {
  if (!log.concerns({SectionType::kTrackerRecord, SectionType::kPatternPicture,
                     SectionType::kPatternColours}))
    return;
  for (std::uint32_t p = 0; p < log.bundle.patterns().size() && !log.done(); ++p) {
    const std::string where = log.label("pattern", log.bundle.patterns()[p].name);
    if (const std::string fault = preview_fault(log.bundle, p); !fault.empty()) {
      log.tell(WorkstationRule::kPatternContent, where,
               log.bundle.section(SectionType::kPatternPicture, p).data(), fault);
    }
    const auto record = log.bundle.section(SectionType::kTrackerRecord, p);
    // Packing finds each feature in the picture again, and fails where one is not there.
    if (record.empty() || pack_tracker_record(record)) continue;
    log.tell(WorkstationRule::kPatternContent, where, record.data(),
             "its picture does not give the features, codes and patches that are stored");
  }
}

}  // namespace modar
