#include "bake/extensions/lab/unknown_view.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace modar {
namespace {

constexpr double kShortest = 0.65;  // focal lengths, of the longer side; see the header
constexpr double kLongest = 1.2;
constexpr double kBend = 0.05;     // k1 to either side
constexpr double kStretch = 0.04;  // of the aspect, to either side

}  // namespace

UnknownView draw_unknown(const GrayImage& picture, const Camera& assumed, bool known,
                         Random& random) {
  UnknownView view{assumed, {picture.width, picture.height, {}}};
  const cv::Mat flat(picture.height, picture.width, CV_8UC1,
                     const_cast<std::uint8_t*>(picture.pixels),
                     static_cast<std::size_t>(picture.stride));
  cv::Mat print = flat;
  if (!known) {
    view.lens.fx = view.lens.fy =
        std::max(assumed.width, assumed.height) * random.uniform(kShortest, kLongest);
    view.lens.distortion[0] = random.uniform(-kBend, kBend);
    const double wider = 1 + random.uniform(-kStretch, kStretch);
    view.print.width = static_cast<int>(std::lround(wider * picture.width));
    cv::resize(flat, print, {view.print.width, picture.height}, 0, 0, cv::INTER_CUBIC);
  }
  for (int y = 0; y < print.rows; ++y) {
    view.print.pixels.insert(view.print.pixels.end(), print.ptr(y), print.ptr(y) + print.cols);
  }
  return view;
}

}  // namespace modar
