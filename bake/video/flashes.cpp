// Flashes by WCAG 2.3.1: pairs of opposite changes of relative luminance by a tenth or more of the
// greatest, where the darker picture is below 0.8; dangerous are more than three in a second on a
// quarter of the visible area. A video on a picture fills a phone's screen at most.
#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <vector>

#include "bake/process/process.hpp"
#include "bake/video/encode_video.hpp"
#include "formats/base/colour.hpp"

namespace modar {
namespace {

constexpr int kColumns = 32;  // cells of which a quarter is counted, to a column: 3 %
constexpr int kRows = 18;
constexpr int kCells = kColumns * kRows;
// Videos of more are thinned: flashes above 15 a second may be missed.
constexpr int kFramesASecond = 30;
constexpr float kChange = 0.1f;  // WCAG's
constexpr float kBright = 0.8f;
constexpr std::size_t kMostChanges = 6;  // three flashes

/// A place of the picture over time.
struct Cell {
  float low = 1.0f;  ///< extremes since the last change
  float high = 0.0f;
  int direction = 0;         ///< of that change
  std::vector<int> changes;  ///< frames of the last second's

  void next(float luminance, int frame) {
    low = std::min(low, luminance);
    high = std::max(high, luminance);
    const bool up = direction <= 0 && luminance - low >= kChange && low < kBright;
    const bool down = direction >= 0 && high - luminance >= kChange && luminance < kBright;
    if (up || down) {
      direction = up ? 1 : -1;
      low = high = luminance;
      changes.push_back(frame);
    }
    std::erase_if(changes, [frame](int at) { return at <= frame - kFramesASecond; });
  }
};

}  // namespace

Result<bool> flashes(const std::string& path) {
  const TemporaryFolder folder;
  const std::string raw = folder.path() + "/gray";
  const std::string scale =
      "scale=" + std::to_string(kColumns) + ":" + std::to_string(kRows) + ":flags=area,format=gray";
  const int read =
      run_process({{"ffmpeg", "-loglevel", "quiet", "-nostdin", "-i", path, "-map", "0:v:0", "-r",
                    std::to_string(kFramesASecond), "-vf", scale, "-f", "rawvideo", raw},
                   {},
                   ""});
  std::ifstream frames(raw, std::ios::binary);
  if (read != 0 || !frames) {
    return fail(ExitCode::kInvalidInput, "video.decode", path, "FFmpeg reads no video from it",
                "`ffprobe FILE` reports its faults");
  }
  std::vector<Cell> cells(kCells);
  std::array<char, kCells> frame{};
  for (int at = 0; frames.read(frame.data(), frame.size()); ++at) {
    for (int i = 0; i < kCells; ++i) {
      const auto gray = static_cast<std::uint8_t>(frame[static_cast<std::size_t>(i)]);
      cells[static_cast<std::size_t>(i)].next(static_cast<float>(linear_of_srgb(gray / 255.0)), at);
    }
    const auto flashing = std::count_if(cells.begin(), cells.end(), [](const Cell& cell) {
      return cell.changes.size() > kMostChanges;
    });
    if (4 * flashing > kCells) return true;
  }
  return false;
}

}  // namespace modar
