// FAST-9 with 3x3 suppression, the strongest few of each cell.
#include "corner_finder.hpp"

#include <algorithm>
#include <cstring>

#include "kernels.hpp"

namespace modar::tracker {

CornerFinder::CornerFinder(int width, const DetectOptions& options)
    : options_(options),
      pitch_(width + 2 * kSlack),
      rows_(static_cast<std::size_t>(pitch_) * 7),
      cells_(static_cast<std::size_t>((width / options.cell + 1) * options.per_cell)),
      counts_(static_cast<std::size_t>(width / options.cell + 1)) {}

void CornerFinder::keep(const Corner& corner, int cell) {
  Corner* slots = cells_.data() + cell * options_.per_cell;
  int& count = counts_[static_cast<std::size_t>(cell)];
  if (count < options_.per_cell) {
    slots[count++] = corner;
    return;
  }
  // The weakest goes; of equally weak ones the last, so that the order of rows decides ties.
  int weakest = 0;
  for (int i = 1; i < count; ++i) {
    if (slots[i].score <= slots[weakest].score) weakest = i;
  }
  if (corner.score > slots[weakest].score) slots[weakest] = corner;
}

void CornerFinder::flush(std::vector<Corner>& corners) {
  for (std::size_t cell = 0; cell < counts_.size(); ++cell) {
    const Corner* slots = cells_.data() + cell * static_cast<std::size_t>(options_.per_cell);
    for (int i = 0; i < counts_[cell]; ++i) {
      if (corners.size() < corners.capacity()) corners.push_back(slots[i]);
    }
    counts_[cell] = 0;
  }
}

void CornerFinder::find(const GrayImage& image, std::uint8_t level, std::vector<Corner>& corners) {
  const int count = image.width - 2 * kTrackerBorder;
  if (count <= 0 || image.height <= 2 * kTrackerBorder) return;
  const Kernels& run = kernels(options_.simd);
  // One pixel before the range is compared with too, and never is a corner.
  const auto row_at = [&](int slot) {
    return rows_.data() + static_cast<std::size_t>(slot) * static_cast<std::size_t>(pitch_) +
           kSlack;
  };
  std::uint8_t* peak = row_at(6);
  std::fill(rows_.begin(), rows_.end(), std::uint8_t{0});
  const int last = image.height - kTrackerBorder;
  for (int y = kTrackerBorder; y <= last; ++y) {
    std::uint8_t* score = row_at(y % 3);
    std::uint8_t* bright = row_at(3 + y % 3);
    if (y < last) {
      run.corner_scores(image.pixels + y * image.stride + kTrackerBorder, image.stride,
                        options_.threshold, count, bright, score);
      // Kernels write past the range: what lies there is no neighbour.
      std::memset(score + count, 0, kSlack);
    } else {
      std::memset(score, 0, static_cast<std::size_t>(count) + kSlack);
    }
    const int centre = y - 1;
    if (centre < kTrackerBorder) continue;
    const std::uint8_t* middle = row_at(centre % 3);
    const std::uint8_t* middle_bright = row_at(3 + centre % 3);
    run.peaks(row_at((centre + 2) % 3), middle, score, count, peak);
    const int cell_row = centre / options_.cell;
    for (int i = 0; i < count; i += 8) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, peak + i, sizeof eight);
      if (eight == 0) continue;
      for (int x = i; x < std::min(i + 8, count); ++x) {
        if (peak[x] == 0) continue;
        const int column = x + kTrackerBorder;
        keep({static_cast<std::int16_t>(column), static_cast<std::int16_t>(centre), peak[x],
              static_cast<std::uint8_t>(middle_bright[x] == middle[x] ? 0 : 1), level},
             column / options_.cell);
      }
    }
    if (y == last || (centre + 1) / options_.cell != cell_row) flush(corners);
  }
}

}  // namespace modar::tracker
