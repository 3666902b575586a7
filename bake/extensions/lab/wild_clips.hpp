// Videos of real objects with their known data, in our form and in those of the benchmarks of
// planar tracking.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "bake/pattern/pattern.hpp"
#include "bake/video/video.hpp"
#include "formats/base/error.hpp"
#include "modar/image.hpp"

namespace modar {

using Corners = std::array<glm::dvec2, 4>;

struct WildClip {
  std::string name;
  std::string frames;                        ///< a video, or a folder of pictures
  std::vector<std::string> pictures;         ///< of what it shows; empty: its first frame shows it
  std::map<std::uint64_t, Corners> truth{};  ///< clockwise; by frame, from 0
  /// Judged as POT-210 and PlanarTrack are: the first frame with a truth tells what to look for,
  /// and is not judged.
  bool published = false;
};

/// The clips below a folder, by name. A clip NAME is a video NAME.* or a folder NAME (or NAME/img)
/// of pictures, and its truth next to it or elsewhere below the folder:
/// - NAME_corners.csv: lines "frame,x0,y0,...,x3,y3", corners clockwise from the picture's top
///   left; the pictures NAME.png and NAME_*.png (or .jpg) next to it show the print;
/// - POT-210, POT-280: NAME_gt_points.txt and NAME_flag.txt; PlanarTrack: NAME.txt and
///   NAME_flag.txt. A line a frame; eight zeros: no truth; another flag than 0: not judged.
/// A video without a truth shows nothing of what the other clips show.
/// Errors: kIo "pictures.folder"; kInvalidInput "bench.wild" (nothing there, a truth without
/// frames, lines that do not fit).
Result<std::vector<WildClip>> find_wild_clips(const std::string& folder);

/// Frames in order, of a video or of a folder's pictures.
class ClipFrames {
 public:
  /// Errors: those of Video::open() and pictures_of().
  static Result<ClipFrames> open(const std::string& path);
  /// The next frame, gray, valid until the next call; nothing after the last one. Errors: those of
  /// read_image().
  Result<std::optional<GrayImage>> next();

 private:
  std::shared_ptr<Video> video_;       ///< null: pictures
  std::vector<std::string> pictures_;  ///< in the order of their names
  std::size_t read_ = 0;
  GrayPicture picture_;
};

}  // namespace modar
