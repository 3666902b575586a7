// Segments to lines, lines to four-sided figures, and the best one's sides to sub-pixels.
#include "bake/pattern/find_corners.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "formats/base/ranges.hpp"

namespace modar {
namespace {

// Longer side, in pixels, at which figures are searched. Larger takes time and finds more texture;
// corners are measured on the photo itself.
constexpr double kSearchSide = 800;
constexpr double kRefineSide = 4096;    // of the photo then: larger takes 40 bytes a pixel
constexpr std::size_t kMostLines = 60;  // the longest; their pairs of pairs are tried
constexpr double kJoinDegrees = 2.0;    // segments of one line: a photo bends lines by as much
constexpr double kJoinPixels = 3.0;
// Gradient of an edge, steps of a colour channel per pixel. Higher loses weak sides, lower finds
// more wrong figures.
constexpr double kEdge = 3;
constexpr double kFaintEdge = 1.5;  // the same of white paper on a white wall
constexpr double kDetail = 12;      // the same of detail
// Share of an edge's strength that is left 3 pixels to either side: more is a shadow's.
constexpr double kShadow = 0.6;
// A figure: of the photo's area at least so much, and each corner so far from straight and closed.
constexpr double kLeastArea = 0.04;
constexpr double kLeastCornerDegrees = 35;
// Share of a side along which an edge is visible. Fingers, shadows and glare hide the rest.
constexpr double kLeastSupport = 0.62;
constexpr double kLeastSide = 0.5;  // below, a side is not even tried
// Of a figure around the best one, and its area at most, times the best one's.
constexpr double kOutlineSupport = 0.9;
constexpr double kOutlineScore = 0.25;
constexpr double kMostMargin = 1.7;
// How far outside of a printed frame the object's own edge is looked for, times the figure's size.
constexpr double kMostFrame = 0.06;
// Share of a side that is sharp for an object's own edge. Higher refuses soft photos, lower accepts
// shadows.
constexpr double kSharpOutline = 0.9;
// Share of a side that is sharp, below which a figure is refused.
constexpr double kLeastSharp = 0.6;
// Of a figure around the one that was chosen, which makes that doubtful.
constexpr double kSheetSupport = 0.6;
constexpr double kSheetLeast = 1.04;
// Share of its own edges that is sharp.
constexpr double kSheetSharp = 0.5;
// Share of a figure that another object on it has. A print's own picture has more, a logo less.
constexpr double kLeastHeld = 0.05;
constexpr double kMostHeld = 0.52;
// Share of it that has detail at least: a printed box has none.
constexpr double kLeastDetail = 0.05;
// Share of all its sides that is sharp.
constexpr double kSharpHeld = 0.82;
// Of figures that are printed on a sheet: sine of a side against the sheet's, margin of those that
// reach its edge, and share of detail around.
constexpr double kParallel = 0.03;
constexpr double kLeastMargin = 0.05;
constexpr double kLeastPrint = 0.08;
// Of a figure in the middle of another one: difference of margins, or turn, times its size.
constexpr double kCentred = 0.06;
// From a figure to the edges of a border around it, times its size.
constexpr double kNearBorder = 0.02;
constexpr double kFarBorder = 0.3;
// Pixels beyond a corner in which continuing edges are looked for.
constexpr double kBeyondFrom = 4;
constexpr double kBeyondTo = 24;
// Share of a photo from which it may be the picture, and the figure in it a printed frame.
constexpr double kFilled = 0.8;
// Longer side, in pixels, of the photo in which the foreground is searched.
constexpr double kForegroundSide = 320;
// Smallest share of the photo that the foreground has.
constexpr double kMinForeground = 0.03;
// Largest share of the photo that the foreground has.
constexpr double kMaxForeground = 0.97;
// Share of the four-sided figure around the foreground that the foreground fills.
constexpr double kFourSided = 0.85;
// Area, relative to the foreground's, of another object that makes it doubtful.
constexpr double kLeastRival = 0.4;
// Shares of the photo that an object of any shape on a background has.
constexpr double kLeastObject = 0.03;
constexpr double kMostObject = 0.9;
// Share of its hull that it fills. Lower: pictures of any content are doubted. [0.88, 0.95]
constexpr double kSolid = 0.9;
// Area of the next object, relative to it, at most. Higher: as above. [0.05, 0.2]
constexpr double kAlone = 0.1;
// From a side to the places that are compared, times the figure's size.
constexpr double kApart = 0.02;
// Of sharpness and division together: what another figure has to be better by.
constexpr double kBetter = 0.1;
// Share of the photo below which a figure that is not sharp all around is a part of a scan.
constexpr double kLeastShare = 0.25;
// The same for sharp figures.
constexpr double kLeastPicture = 0.08;
// Longer side of a photo, in pixels, at least: smaller files are pictures.
constexpr double kLeastPhoto = 640;
// Of the file: a larger upright figure is a frame that is printed on the picture.
constexpr double kLeastFrontal = 0.4;
constexpr double kUpright = 0.007;  // sine of 0.4 degrees

using Point = cv::Point2d;

struct Line {
  Point origin;              // nearest to the first segment's middle
  Point along;               // of length 1
  double length = 0;         // of all its segments
  std::vector<int> covered;  // before each pixel from `first`: those that show an edge
  double first = 0;
};

struct Figure {
  std::array<Point, 4> corners;
  double support = 0;
  double score = 0;
};

double cross(const Point& a, const Point& b) {
  return a.x * b.y - a.y * b.x;
}

double norm_of(const Point& a) {
  return std::sqrt(a.x * a.x + a.y * a.y);
}

/// Gradients across all colours: of each pixel that of the channel which changes most.
struct Gradients {
  cv::Mat dx;
  cv::Mat dy;
  cv::Mat detail;  // where they are strong

  explicit Gradients(const cv::Mat& rgb) {
    std::array<cv::Mat, 3> channels;
    cv::split(rgb, channels.data());
    for (const cv::Mat& channel : channels) {
      cv::Mat x;
      cv::Mat y;
      cv::Sobel(channel, x, CV_32F, 1, 0, 3, 0.125);
      cv::Sobel(channel, y, CV_32F, 0, 1, 3, 0.125);
      if (dx.empty()) {
        dx = x;
        dy = y;
        continue;
      }
      cv::Mat stronger = x.mul(x) + y.mul(y) > dx.mul(dx) + dy.mul(dy);
      x.copyTo(dx, stronger);
      y.copyTo(dy, stronger);
    }
    detail = dx.mul(dx) + dy.mul(dy) > kDetail * kDetail;
  }

  /// Across a line of that normal; 0 outside of the photo.
  [[nodiscard]] double across(const Point& at, const Point& normal) const {
    const int x = static_cast<int>(std::lround(at.x));
    const int y = static_cast<int>(std::lround(at.y));
    if (x < 1 || y < 1 || x >= dx.cols - 1 || y >= dx.rows - 1) return 0;
    const double gx = static_cast<double>(dx.at<float>(y, x));
    const double gy = static_cast<double>(dy.at<float>(y, x));
    const double strength = gx * normal.x + gy * normal.y;
    // A gradient that points elsewhere by more than 30 degrees belongs to something else.
    return std::fabs(strength) > 0.87 * std::sqrt(gx * gx + gy * gy) ? strength : 0;
  }
};

/// Collinear segments become one line. The longest come first.
std::vector<Line> join_segments(std::vector<cv::Vec4f> segments) {
  const auto size = [](const cv::Vec4f& s) {
    return std::hypot(static_cast<double>(s[2] - s[0]), static_cast<double>(s[3] - s[1]));
  };
  std::sort(segments.begin(), segments.end(),
            [&](const cv::Vec4f& a, const cv::Vec4f& b) { return size(a) > size(b); });
  std::vector<Line> lines;
  for (const cv::Vec4f& s : segments) {
    const Point from(static_cast<double>(s[0]), static_cast<double>(s[1]));
    const Point to(static_cast<double>(s[2]), static_cast<double>(s[3]));
    const double long_as = norm_of(to - from);
    if (long_as < 12) break;
    const Point along = (to - from) / long_as;
    const auto same = std::find_if(lines.begin(), lines.end(), [&](const Line& line) {
      return std::fabs(cross(line.along, along)) < std::sin(kJoinDegrees * CV_PI / 180) &&
             std::fabs(cross(line.along, from - line.origin)) < kJoinPixels &&
             std::fabs(cross(line.along, to - line.origin)) < kJoinPixels;
    });
    if (same != lines.end()) {
      same->length += long_as;
    } else {
      lines.push_back({(from + to) / 2, along, long_as, {}, 0});
    }
  }
  ranges::sort(lines, std::greater(), &Line::length);
  if (lines.size() > kMostLines) lines.resize(kMostLines);
  return lines;
}

/// Counts where along a line an edge is seen, one place a pixel.
void cover(Line& line, const Gradients& gradients, double threshold) {
  const Point normal(-line.along.y, line.along.x);
  const double reach = std::hypot(gradients.dx.cols, gradients.dx.rows);
  line.first = -reach;
  line.covered.assign(1, 0);
  for (double s = -reach; s < reach; s += 1) {
    bool seen = false;
    for (const double off : {0.0, -1.0, 1.0, -2.0, 2.0}) {
      const Point at = line.origin + s * line.along + off * normal;
      seen = seen || std::fabs(gradients.across(at, normal)) > threshold;
    }
    line.covered.push_back(line.covered.back() + (seen ? 1 : 0));
  }
}

/// Share of the line between two of its points that shows an edge.
double support(const Line& line, const Point& a, const Point& b) {
  double from = (a - line.origin).dot(line.along) - line.first;
  double to = (b - line.origin).dot(line.along) - line.first;
  if (from > to) std::swap(from, to);
  const auto last = static_cast<double>(line.covered.size() - 1);
  const auto begin = static_cast<std::size_t>(std::clamp(from, 0.0, last));
  const auto end = static_cast<std::size_t>(std::clamp(to, 0.0, last));
  return end > begin ? (line.covered[end] - line.covered[begin]) / static_cast<double>(end - begin)
                     : 0;
}

bool intersect(const Line& a, const Line& b, Point& at) {
  const double turn = cross(a.along, b.along);
  if (std::fabs(turn) < std::sin(kLeastCornerDegrees * CV_PI / 180)) return false;
  at = a.origin + cross(b.origin - a.origin, b.along) / turn * a.along;
  return true;
}

/// Clockwise on the screen, the corner nearest to the photo's top-left first.
std::array<Point, 4> clockwise(std::array<Point, 4> corners) {
  if (cross(corners[1] - corners[0], corners[2] - corners[1]) < 0) {
    std::swap(corners[1], corners[3]);
  }
  const auto first =
      std::min_element(corners.begin(), corners.end(),
                       [](const Point& a, const Point& b) { return a.x + a.y < b.x + b.y; });
  std::rotate(corners.begin(), first, corners.end());
  return corners;
}

double area_of(const std::array<Point, 4>& c) {
  return std::fabs(cross(c[2] - c[0], c[3] - c[1])) / 2;
}

bool convex(const std::array<Point, 4>& c) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Point side = c[(i + 1) % 4] - c[i];
    const Point next = c[(i + 2) % 4] - c[(i + 1) % 4];
    if (cross(side, next) <=
        std::sin(kLeastCornerDegrees * CV_PI / 180) * norm_of(side) * norm_of(next)) {
      return false;
    }
  }
  return true;
}

/// Sides of a photo's border, for those that do not show the background. They can be joined.
enum BorderSide : unsigned { kAtTop = 1, kAtRight = 2, kAtBottom = 4, kAtLeft = 8 };

/// The object on the background that the photo's border shows: its outline, coarsely.
class Foreground {
 public:
  /// without: sides that the object may be beyond.
  explicit Foreground(const cv::Mat& rgb, unsigned without = 0)
      : scale_(kForegroundSide / std::max(rgb.cols, rgb.rows)) {
    cv::Mat small;
    cv::resize(rgb, small, cv::Size(), scale_, scale_, cv::INTER_AREA);
    learn_ground(small, without);
    // Ground is what the border's ground reaches: the same colours within the object are the
    // object's.
    cv::Mat ground(small.rows + 2, small.cols + 2, CV_8U, cv::Scalar(255));
    small.forEach<cv::Vec3b>([&](const cv::Vec3b& colour, const int* at) {
      ground.at<std::uint8_t>(at[0] + 1, at[1] + 1) = is_ground(colour) ? 255 : 0;
    });
    cv::floodFill(ground, cv::Point(0, 0), 128);
    cv::Mat rest = ground(cv::Rect(1, 1, small.cols, small.rows)) != 128;
    cv::morphologyEx(rest, rest, cv::MORPH_OPEN, cv::Mat::ones(5, 5, CV_8U));
    keep_largest(rest);
  }

  /// Whether it is four-sided; otherwise nothing here says anything.
  [[nodiscard]] bool known() const { return known_; }
  /// Whether it is solid and alone, of whatever shape.
  [[nodiscard]] bool solitary() const { return solitary_; }
  /// Whether something else of its kind is there.
  [[nodiscard]] bool rivalled() const { return known_ && rival_ > kLeastRival; }
  [[nodiscard]] const std::array<Point, 4>& corners() const { return corners_; }

  /// How far a side divides it from the background: of the places that far to both sides of the
  /// line, the share that is on the right one. to: clockwise of from.
  [[nodiscard]] double divided(const Point& from, const Point& to, double apart) const {
    const Point along = (to - from) / norm_of(to - from);
    const Point off = std::max(apart, 1.5 / scale_) * Point(along.y, -along.x);
    int inside = 0;
    int outside = 0;
    constexpr int kPlaces = 60;
    for (int i = 0; i < kPlaces; ++i) {
      const Point at = from + (0.05 + 0.9 * i / (kPlaces - 1)) * (to - from);
      inside += covers(at - off) ? 1 : 0;
      outside += covers(at + off) ? 0 : 1;
    }
    return static_cast<double>(std::min(inside, outside)) / kPlaces;
  }
  /// Of a figure, its worst side.
  [[nodiscard]] double divided(const std::array<Point, 4>& corners) const {
    double least = known_ ? 1 : 0;
    const double apart = kApart * std::sqrt(area_of(corners));
    for (std::size_t i = 0; i < 4 && known_; ++i) {
      least = std::min(least, divided(corners[i], corners[(i + 1) % 4], apart));
    }
    return least;
  }

 private:
  static constexpr std::size_t kBins = 12;  // of a channel

  static std::size_t bin(double r, double g, double b) {
    const auto one = [](double value) {
      return static_cast<std::size_t>(std::clamp(value * kBins / 256, 0.0, kBins - 1.0));
    };
    return (one(r) * kBins + one(g)) * kBins + one(b);
  }

  void learn_ground(const cv::Mat& small, unsigned without) {
    constexpr int kRing = 4;      // pixels
    constexpr double kBlur = 10;  // steps of a channel: a colour counts for its neighbours, too
    constexpr double kMinColourShare = 0.004;  // of the ring: rarer colours are chance
    ground_.assign(kBins * kBins * kBins, 0);
    int count = 0;
    for (int y = 0; y < small.rows; ++y) {
      for (int x = 0; x < small.cols; ++x) {
        const unsigned sides =
            (y < kRing ? kAtTop : 0U) | (y >= small.rows - kRing ? kAtBottom : 0U) |
            (x < kRing ? kAtLeft : 0U) | (x >= small.cols - kRing ? kAtRight : 0U);
        if (sides == 0 || (sides & without) != 0) continue;
        const auto& c = small.at<cv::Vec3b>(y, x);
        for (int k = 0; k < 27; ++k) {
          ground_[bin(c[0] + kBlur * (k % 3 - 1), c[1] + kBlur * (k / 3 % 3 - 1),
                      c[2] + kBlur * (k / 9 - 1))] += 1;
        }
        ++count;
      }
    }
    least_ = 27 * kMinColourShare * count;
  }

  /// In the light or in a shadow.
  [[nodiscard]] bool is_ground(const cv::Vec3b& c) const {
    constexpr double kShades[] = {1.0, 1.15, 1.35, 1.6, 2.0};
    return ranges::any_of(kShades, [&](double lit) {
      return ground_[bin(lit * c[0], lit * c[1], lit * c[2])] >= least_;
    });
  }

  void keep_largest(const cv::Mat& rest) {
    cv::Mat labels;
    cv::Mat stats;
    cv::Mat centres;
    const int parts = cv::connectedComponentsWithStats(rest, labels, stats, centres, 4);
    std::vector<std::pair<int, int>> areas;  // with their labels
    for (int i = 1; i < parts; ++i) areas.emplace_back(stats.at<int>(i, cv::CC_STAT_AREA), i);
    ranges::sort(areas, std::greater());
    if (areas.empty()) return;
    mask_ = labels == areas[0].second;
    rival_ = areas.size() > 1 ? 1.0 * areas[1].first / areas[0].first : 0;
    const double share = 1.0 * areas[0].first / static_cast<double>(rest.total());
    std::vector<std::vector<cv::Point>> outlines;
    cv::findContours(mask_, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    std::vector<cv::Point> hull;
    cv::convexHull(outlines.front(), hull);
    const double whole = cv::contourArea(outlines.front());
    const double filled = whole / static_cast<double>(rest.total());
    solitary_ = filled > kLeastObject && filled < kMostObject && rival_ <= kAlone &&
                whole >= kSolid * cv::contourArea(hull);
    known_ = share > kMinForeground && share < kMaxForeground && fit_corners(hull);
  }

  /// The four-sided figure of its hull.
  bool fit_corners(const std::vector<cv::Point>& hull) {
    std::vector<cv::Point> four;
    for (double off = 1; off < kForegroundSide / 8 && (four.empty() || four.size() > 4); off += 1) {
      cv::approxPolyDP(hull, four, off, true);
    }
    if (four.size() != 4) return false;
    cv::Mat figure = cv::Mat::zeros(mask_.size(), CV_8U);
    cv::fillConvexPoly(figure, four, 255);
    for (std::size_t i = 0; i < 4; ++i) {
      corners_[i] = (Point(four[i]) + Point(0.5, 0.5)) / scale_ - Point(0.5, 0.5);
    }
    corners_ = clockwise(corners_);
    return convex(corners_) &&
           cv::countNonZero(figure & mask_) > kFourSided * cv::countNonZero(figure | mask_);
  }

  [[nodiscard]] bool covers(const Point& at) const {
    const auto x = static_cast<int>(std::lround((at.x + 0.5) * scale_ - 0.5));
    const auto y = static_cast<int>(std::lround((at.y + 0.5) * scale_ - 0.5));
    return x >= 0 && y >= 0 && x < mask_.cols && y < mask_.rows &&
           mask_.at<std::uint8_t>(y, x) != 0;
  }

  double scale_;
  std::vector<double> ground_;  ///< how often each colour is on the border
  double least_ = 0;
  cv::Mat mask_;
  std::array<Point, 4> corners_;
  bool known_ = false;
  bool solitary_ = false;
  double rival_ = 0;
};

class Search {
 public:
  Search(const cv::Mat& rgb, std::vector<Line> lines)
      : size_(rgb.size()), lines_(std::move(lines)) {}

  /// Every two lines with every two of those that cross both and show an edge between them.
  std::vector<Figure> figures() {
    for (std::size_t a = 0; a < lines_.size(); ++a) {
      for (std::size_t c = a + 1; c < lines_.size(); ++c) {
        if (std::fabs(lines_[a].along.dot(lines_[c].along)) < 0.7) continue;
        std::vector<std::size_t> across;
        for (std::size_t b = 0; b < lines_.size(); ++b) {
          Point from;
          Point to;
          if (b != a && b != c && intersect(lines_[a], lines_[b], from) &&
              intersect(lines_[b], lines_[c], to) && within(from) && within(to) &&
              support(lines_[b], from, to) >= kLeastSide) {
            across.push_back(b);
          }
        }
        for (std::size_t i = 0; i < across.size(); ++i) {
          for (std::size_t k = i + 1; k < across.size(); ++k) {
            try_figure(a, across[i], c, across[k]);
          }
        }
      }
    }
    ranges::sort(found_, std::greater(), &Figure::score);
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool within(const Point& at) const {
    return at.x >= 1 && at.y >= 1 && at.x <= size_.width - 2 && at.y <= size_.height - 2;
  }

  void try_figure(std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
    std::array<Point, 4> corners;
    const std::array<std::size_t, 4> sides = {a, b, c, d};
    for (std::size_t i = 0; i < 4; ++i) {
      if (!intersect(lines_[sides[i]], lines_[sides[(i + 1) % 4]], corners[i])) return;
    }
    const double share = area_of(corners) / (static_cast<double>(size_.width) * size_.height);
    if (share < kLeastArea) return;
    double weakest = 1;
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double one = support(lines_[sides[(i + 1) % 4]], corners[i], corners[(i + 1) % 4]);
      weakest = std::min(weakest, one);
      sum += one;
      if (one < kLeastSide) return;
    }
    corners = clockwise(corners);
    if (!convex(corners)) return;
    // An edge that continues beyond a corner belongs to something larger.
    double beyond = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Point& from = corners[i];
      for (std::size_t k = 0; k < 4; ++k) {
        const Line& line = lines_[sides[k]];
        if (std::fabs(cross(line.along, from - line.origin)) > 1e-6) continue;
        const bool forward = line.along.dot(from - (corners[0] + corners[2]) / 2) > 0;
        const Point outward = (forward ? 1.0 : -1.0) * line.along;
        beyond += support(line, from + 4 * outward, from + 24 * outward) / 8;
      }
    }
    found_.push_back(
        {corners, weakest, sum / 4 + weakest - 0.6 * beyond + 0.35 * std::sqrt(share)});
  }

  cv::Size size_;
  std::vector<Line> lines_;
  std::vector<Figure> found_;
};

/// The edge nearest to a side, as a line through places along it: to sub-pixels.
bool fit_side(const Gradients& gradients, const Point& from, const Point& to, double reach,
              Line& out) {
  const double long_as = norm_of(to - from);
  const Point along = (to - from) / long_as;
  const Point normal(-along.y, along.x);
  std::vector<cv::Point2f> places;
  constexpr int kPlaces = 160;
  const double window = std::min(2.0, reach);
  for (int i = 0; i < kPlaces; ++i) {
    const Point at = from + (0.04 + 0.92 * i / (kPlaces - 1)) * (to - from);
    double best = 0;
    double where = 0;
    const auto strength = [&](double off) {
      // The nearer edge counts more: a printed frame may be within reach.
      return std::fabs(gradients.across(at + off * normal, normal)) *
             std::exp(-off * off / (reach * reach));
    };
    for (double off = -reach; off <= reach; off += 1) {
      if (strength(off) > best) {
        best = strength(off);
        where = off;
      }
    }
    if (best < 2) continue;
    // The middle of the edge, as the gradients around it weigh.
    double weight = 0;
    double moment = 0;
    for (double off = where - window; off <= where + window; off += window / 2) {
      weight += strength(off);
      moment += strength(off) * off;
    }
    const Point place = at + moment / weight * normal;
    places.emplace_back(static_cast<float>(place.x), static_cast<float>(place.y));
  }
  if (places.size() < kPlaces / 4) return false;
  cv::Vec4f line;
  cv::fitLine(places, line, cv::DIST_WELSCH, 0, 1e-3, 1e-4);
  out.along = {static_cast<double>(line[0]), static_cast<double>(line[1])};
  out.origin = {static_cast<double>(line[2]), static_cast<double>(line[3])};
  return true;
}

/// The share of places along a side where an edge is seen that is sharpest there. alone: with
/// nothing on either side, as the edge of paper around a printed frame; shadows fade slowly.
double sharp_along(const Gradients& gradients, const Point& from, const Point& to,
                   bool alone = false, double edge = kEdge) {
  const Point along = (to - from) / norm_of(to - from);
  const Point normal(-along.y, along.x);
  int sharp = 0;
  constexpr int kPlaces = 120;
  for (int i = 0; i < kPlaces; ++i) {
    const Point at = from + (0.06 + 0.88 * i / (kPlaces - 1)) * (to - from);
    const auto strength = [&](double off) {
      return std::fabs(gradients.across(at + off * normal, normal));
    };
    const double here = std::max({strength(0), strength(-0.7), strength(0.7)});
    if (here <= edge) continue;
    const bool lone = !alone || std::max(strength(-3), strength(3)) < kShadow * here;
    if (here >= std::max(strength(-2), strength(-3)) && lone) ++sharp;
  }
  return static_cast<double>(sharp) / kPlaces;
}

/// Of that many parts of each side, the least.
double least_sharp(const Gradients& gradients, const std::array<Point, 4>& corners, int parts = 1) {
  double least = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    const Point part = (corners[(i + 1) % 4] - corners[i]) / parts;
    for (int k = 0; k < parts; ++k) {
      const Point from = corners[i] + k * part;
      least = std::min(least, sharp_along(gradients, from, from + part));
    }
  }
  return least;
}

/// Of the corners, the least share of the end of a side that is sharp: the better of its two sides.
double least_ends(const Gradients& gradients, const std::array<Point, 4>& corners) {
  constexpr double kEnd = 0.12;  // of a side
  double least = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto end = [&](const Point& to) {
      return sharp_along(gradients, corners[i], corners[i] + kEnd * (to - corners[i]));
    };
    least = std::min(least, std::max(end(corners[(i + 1) % 4]), end(corners[(i + 3) % 4])));
  }
  return least;
}

/// Sides that stopped at a printed frame, with one end or both, continue to the object's own edge:
/// the outermost that is sharp all along.
std::array<Point, 4> push_out(const Gradients& gradients, const std::array<Point, 4>& corners) {
  const double reach = kMostFrame * std::sqrt(area_of(corners));
  std::array<Line, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) {
    const Point& from = corners[i];
    const Point& to = corners[(i + 1) % 4];
    const double long_as = norm_of(to - from);
    const Point along = (to - from) / long_as;
    const Point outward(along.y, -along.x);
    double farthest = 0;
    sides[i] = {from, along, long_as, {}, 0};
    for (double a = -1; a <= reach; a += 1) {
      for (double b = -1; b <= reach; b += 1) {
        if (a + b <= farthest) continue;
        const Point start = from + a * outward;
        const Point end = to + b * outward;
        if (sharp_along(gradients, start, end, true) < kSharpOutline) continue;
        farthest = a + b;
        sides[i] = {start, (end - start) / norm_of(end - start), long_as, {}, 0};
      }
    }
  }
  std::array<Point, 4> next = corners;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!intersect(sides[(i + 3) % 4], sides[i], next[i])) return corners;
  }
  return next;
}

/// Whether sharp edges are next to a figure, as those of the paper are around a printed frame.
bool is_inner(const Gradients& gradients, const std::array<Point, 4>& corners) {
  constexpr double kMoved = 4;  // pixels; the other edge of the same line is nearer
  const std::array<Point, 4> outer = push_out(gradients, corners);
  double moved = 0;
  for (std::size_t i = 0; i < 4; ++i) moved = std::max(moved, norm_of(outer[i] - corners[i]));
  return moved > kMoved;
}

/// Moves sides that stopped at a shadow or a printed frame to the edge that divides the object from
/// its background.
std::array<Point, 4> settle(const Gradients& gradients, const Foreground& object,
                            const std::array<Point, 4>& corners) {
  constexpr double kSharp = 0.3;   // weight of an edge's sharpness against the division
  constexpr double kWorth = 0.15;  // a side moves for more than that
  const double size = std::sqrt(area_of(corners));
  const double reach = kMostFrame * size;
  const double step = std::max(1.0, reach / 16);
  std::array<Line, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) {
    const Point& from = corners[i];
    const Point& to = corners[(i + 1) % 4];
    const Point along = (to - from) / norm_of(to - from);
    const Point outward(along.y, -along.x);
    sides[i] = {from, along, 0, {}, 0};
    double best = object.divided(from, to, kApart * size) +
                  kSharp * sharp_along(gradients, from, to) + kWorth;
    for (double a = -reach; a <= reach && best < 1 + kSharp; a += step) {
      for (double b = -reach; b <= reach; b += step) {
        const Point start = from + a * outward;
        const Point end = to + b * outward;
        const double division = object.divided(start, end, kApart * size);
        if (division + kSharp <= best) continue;
        const double here = division + kSharp * sharp_along(gradients, start, end);
        if (here <= best) continue;
        best = here;
        sides[i] = {start, (end - start) / norm_of(end - start), 0, {}, 0};
      }
    }
  }
  std::array<Point, 4> next = corners;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!intersect(sides[(i + 3) % 4], sides[i], next[i])) return corners;
  }
  return next;
}

/// Fits each side to the edges that are nearer than each of the reaches, one after the other.
std::array<Point, 4> refine(const Gradients& gradients, std::array<Point, 4> corners,
                            std::initializer_list<double> reaches) {
  for (const double reach : reaches) {
    std::array<Line, 4> sides;
    std::array<Point, 4> next = corners;
    bool good = true;
    for (std::size_t i = 0; i < 4; ++i) {
      good = good && fit_side(gradients, corners[i], corners[(i + 1) % 4], reach, sides[i]);
    }
    for (std::size_t i = 0; i < 4 && good; ++i) {
      good = intersect(sides[(i + 3) % 4], sides[i], next[i]) &&
             norm_of(next[i] - corners[i]) < 3 * reach + 4;
    }
    if (!good) break;
    corners = next;
  }
  return corners;
}

/// Whether all corners of a figure are within another's, or at most two pixels beyond.
bool around(const std::array<Point, 4>& outer, const std::array<Point, 4>& inner) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Point side = outer[(i + 1) % 4] - outer[i];
    for (const Point& corner : inner) {
      if (cross(side, corner - outer[i]) <= -2 * norm_of(side)) return false;
    }
  }
  return true;
}

/// Of the edges that a figure around another has for itself, the share of the worst that is sharp.
/// The edges of a table and the print's own, continued, make figures around a print: there the
/// continued parts show nothing.
double own_edges(const Gradients& gradients, const std::array<Point, 4>& outer,
                 std::array<Point, 4> inner) {
  constexpr double kShared = 3;  // pixels, of one edge that is a side of both figures
  const auto nearest =
      std::min_element(inner.begin(), inner.end(), [&](const Point& a, const Point& b) {
        return norm_of(a - outer[0]) < norm_of(b - outer[0]);
      });
  std::rotate(inner.begin(), nearest, inner.end());
  double least = 1;
  bool own = false;
  for (std::size_t i = 0; i < 4; ++i) {
    const Point& from = outer[i];
    const Point& to = outer[(i + 1) % 4];
    const Point& start = inner[i];
    const Point& end = inner[(i + 1) % 4];
    const Point along = (to - from) / norm_of(to - from);
    const double off =
        std::max(std::fabs(cross(along, start - from)), std::fabs(cross(along, end - from)));
    const auto look = [&](const Point& one, const Point& other) {
      if ((other - one).dot(along) <= kBeyondFrom) return;
      own = true;
      least = std::min(least, sharp_along(gradients, one, other));
    };
    if (off > kShared) {
      look(from, to);
    } else {
      look(from, start);
      look(end, to);
    }
  }
  return own ? least : 0;
}

/// Whether another figure of edges, with less contrast, surrounds one: the sheet, perhaps, on
/// which that is printed.
bool framed(const Gradients& gradients, const std::vector<Figure>& figures,
            const std::array<Point, 4>& corners) {
  constexpr int kMost = 100;  // figures that are measured, the best first
  const double area = area_of(corners);
  int measured = 0;
  for (const Figure& other : figures) {
    const double larger = area_of(other.corners) / area;
    if (other.support < kSheetSupport || larger < kSheetLeast || larger > kMostMargin ||
        !around(other.corners, corners)) {
      continue;
    }
    const std::array<Point, 4> outer = refine(gradients, other.corners, {2.5, 1.2});
    if (own_edges(gradients, outer, corners) > kSheetSharp) return true;
    if (++measured == kMost) break;
  }
  return false;
}

/// Whether the two edges that end at a side continue beyond it, as those of a longer object do.
bool goes_on(const Gradients& gradients, const std::array<Point, 4>& corners) {
  const auto beyond = [&](const Point& from, const Point& corner) {
    const Point along = (corner - from) / norm_of(corner - from);
    return sharp_along(gradients, corner + kBeyondFrom * along, corner + kBeyondTo * along);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const Point& one = corners[i];
    const Point& other = corners[(i + 1) % 4];
    if (beyond(corners[(i + 3) % 4], one) > kSheetSupport &&
        beyond(corners[(i + 2) % 4], other) > kSheetSupport)
      return true;
  }
  return false;
}

/// From the unit square to the photo.
cv::Matx33d plane_of(const std::array<Point, 4>& corners) {
  const std::array<cv::Point2f, 4> unit = {
      {cv::Point2f(0, 0), cv::Point2f(1, 0), cv::Point2f(1, 1), cv::Point2f(0, 1)}};
  std::array<cv::Point2f, 4> to;
  std::copy(corners.begin(), corners.end(), to.begin());
  return cv::getPerspectiveTransform(unit.data(), to.data());
}

Point on_plane(const cv::Matx33d& plane, double x, double y) {
  const cv::Vec3d at = plane * cv::Vec3d(x, y, 1);
  return {at[0] / at[2], at[1] / at[2]};
}

/// The share of a figure that has detail, without the part of it that another figure covers.
double detail_in(const Gradients& gradients, const std::array<Point, 4>& figure,
                 const std::optional<std::array<Point, 4>>& without = std::nullopt) {
  const std::vector<cv::Point> outline(figure.begin(), figure.end());
  const cv::Rect box = cv::boundingRect(outline) & cv::Rect(cv::Point(), gradients.detail.size());
  if (box.empty()) return 0;
  cv::Mat mask = cv::Mat::zeros(box.size(), CV_8U);
  const auto fill = [&](std::vector<cv::Point> corners, int value) {
    for (cv::Point& corner : corners) corner -= box.tl();
    cv::fillConvexPoly(mask, corners, value);
  };
  fill(outline, 255);
  if (without) fill({without->begin(), without->end()}, 0);
  return cv::countNonZero(gradients.detail(box) & mask) /
         std::max(1.0, 1.0 * cv::countNonZero(mask));
}

/// Larger or smaller about its middle.
std::array<Point, 4> grown(const std::array<Point, 4>& figure, double times) {
  const Point middle = (figure[0] + figure[1] + figure[2] + figure[3]) / 4;
  std::array<Point, 4> out;
  ranges::transform(figure, out.begin(),
                    [&](const Point& corner) { return middle + times * (corner - middle); });
  return out;
}

/// The place of a figure within another one, on their plane, where the other is 1 by 1.
struct Placement {
  std::array<double, 4> margins{};  // of each side, from the other figure's
  std::array<double, 4> turns{};    // of each side against the other figure's: sines, ascending

  /// back: from the photo to that plane.
  Placement(const cv::Matx33d& back, const std::array<Point, 4>& inner) {
    std::array<double, 4> x{};
    std::array<double, 4> y{};
    for (std::size_t i = 0; i < 4; ++i) {
      const Point at = on_plane(back, inner[i].x, inner[i].y);
      const Point next = on_plane(back, inner[(i + 1) % 4].x, inner[(i + 1) % 4].y);
      const Point side = next - at;
      turns[i] = std::min(std::fabs(side.x), std::fabs(side.y)) / norm_of(side);
      x[i] = at.x;
      y[i] = at.y;
    }
    ranges::sort(turns);
    ranges::sort(x);
    ranges::sort(y);
    margins = {x[1], y[1], 1 - x[2], 1 - y[2]};
  }

  /// As the picture within a border is.
  [[nodiscard]] bool centred() const {
    return std::max({std::fabs(margins[0] - margins[2]), std::fabs(margins[1] - margins[3]),
                     turns[2]}) < kCentred;
  }
  /// Along three of the other figure's sides at least: a fourth may be another line's.
  [[nodiscard]] bool parallel() const { return turns[2] < kParallel; }
  /// Up to one of the other figure's sides.
  [[nodiscard]] bool flush() const {
    return *std::min_element(margins.begin(), margins.end()) < kLeastMargin;
  }
  /// How many sides are those of another figure.
  [[nodiscard]] int shared(const Placement& other) const {
    int same = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      same += std::fabs(margins[i] - other.margins[i]) < kLeastMargin ? 1 : 0;
    }
    return same;
  }
};

/// Whether a figure within another one is printed on it: up to its edge or along its sides, with
/// other print around. Tables and mats have little detail, and objects on them are askew.
bool is_printed(const Gradients& gradients, const std::array<Point, 4>& sheet,
                const std::array<Point, 4>& inner) {
  const Placement place(plane_of(sheet).inv(), inner);
  return (place.flush() || place.parallel()) &&
         detail_in(gradients, grown(sheet, 0.96), grown(inner, 1.06)) > kLeastPrint;
}

/// Of all sides of a figure, the share that is sharp.
double sharp_around(const Gradients& gradients, const std::array<Point, 4>& figure) {
  double sharp = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    sharp += sharp_along(gradients, figure[i], figure[(i + 1) % 4]) / 4;
  }
  return sharp;
}

/// Whether a figure within another one is an object on it, by its size, its edges and its detail.
bool is_held(const Gradients& gradients, const std::array<Point, 4>& ground,
             const std::array<Point, 4>& held) {
  const double share = area_of(held) / area_of(ground);
  if (share < kLeastHeld || share > kMostHeld || !around(ground, held)) return false;
  return sharp_around(gradients, held) > kSharpHeld &&
         detail_in(gradients, grown(held, 0.92)) > kLeastDetail &&
         !is_printed(gradients, ground, held);
}

/// The figures in the middle of another one, as the picture within a border is.
std::vector<Placement> centred_in(const Gradients& gradients, const std::vector<Figure>& figures,
                                  const cv::Matx33d& back) {
  std::vector<Placement> out;
  for (const Figure& figure : figures) {
    const Placement place(back, figure.corners);
    if (place.centred() && !place.flush() &&
        ranges::none_of(out, [&](const Placement& other) { return place.shared(other) == 4; }) &&
        sharp_around(gradients, figure.corners) > kSharpHeld) {
      out.push_back(place);
    }
  }
  return out;
}

/// Whether a figure of edges is on a ground that has few on each of its sides, unlike the figure.
bool holds_a_figure(const Gradients& gradients, const std::vector<Figure>& figures,
                    const std::array<Point, 4>& corners) {
  constexpr double kTimesMore = 3;    // share of the figure that has detail against the ground's
  constexpr std::size_t kMost = 400;  // figures that are measured, the best first
  const cv::Matx33d back = plane_of(corners).inv();
  const std::vector<Placement> centred = centred_in(gradients, figures, back);
  std::size_t seen = 0;
  for (const Figure& figure : figures) {
    const std::array<Point, 4>& c = figure.corners;
    const double share = area_of(c) / area_of(corners);
    if (share < kLeastHeld || share > kMostHeld) continue;
    const Placement place(back, c);
    if (place.centred() ||
        ranges::any_of(centred, [&](const Placement& one) { return place.shared(one) > 2; })) {
      continue;
    }
    if (++seen > kMost) break;
    if (!is_held(gradients, corners, c)) continue;
    const std::array<Point, 4> near = grown(c, 1.06);
    const std::array<Point, 4> far = grown(c, 1.2);
    double ground = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t k = (i + 1) % 4;
      ground = std::max(ground, detail_in(gradients, {near[i], near[k], far[k], far[i]}));
    }
    if (detail_in(gradients, grown(c, 0.92)) > kTimesMore * ground) return true;
  }
  return false;
}

/// Whether a figure is the ground of another object, as a table is a print's.
bool holds_another(const cv::Mat& rgb, const Gradients& gradients,
                   const std::array<Point, 4>& corners) {
  constexpr double kInset = 0.02;  // of the figure: its edges are left out
  const double side = kForegroundSide;
  const double scale = (1 - 2 * kInset) / side;
  const cv::Matx33d plane =
      plane_of(corners) * cv::Matx33d(scale, 0, kInset, 0, scale, kInset, 0, 0, 1);
  cv::Mat inside;
  cv::warpPerspective(rgb, inside, plane, cv::Size(kForegroundSide, kForegroundSide),
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  const Foreground object(inside);
  if (!object.known()) return false;
  std::array<Point, 4> held;
  ranges::transform(object.corners(), held.begin(),
                    [&](const Point& at) { return on_plane(plane, at.x, at.y); });
  return is_held(gradients, corners, refine(gradients, held, {4, 2.5, 1.2}));
}

/// Whether edges are at equal distances to both sides of a figure, and above and below it, as
/// those of a border are around the picture in it.
bool bordered(const Gradients& gradients, const std::array<Point, 4>& corners) {
  constexpr std::size_t kSteps = 160;   // a pixel each
  constexpr double kEqualRatio = 1.5;   // most ratio of two distances that are equal
  constexpr double kSameRatio = 1.1;    // the same where one of the edges is weak
  constexpr double kWeakSupport = 0.3;  // share of a side that shows such an edge, at least
  const cv::Matx33d plane = plane_of(corners);
  const auto distance = [](std::size_t k) {
    return kNearBorder + (kFarBorder - kNearBorder) * static_cast<double>(k) / kSteps;
  };
  // Of each side, the share that has an edge that far from it.
  std::array<std::array<double, kSteps>, 4> seen{};
  for (std::size_t k = 0; k < kSteps; ++k) {
    const double off = distance(k);
    const std::array<std::array<Point, 2>, 4> sides = {
        {{on_plane(plane, 0, -off), on_plane(plane, 1, -off)},
         {on_plane(plane, 1 + off, 0), on_plane(plane, 1 + off, 1)},
         {on_plane(plane, 1, 1 + off), on_plane(plane, 0, 1 + off)},
         {on_plane(plane, -off, 1), on_plane(plane, -off, 0)}}};
    for (std::size_t i = 0; i < 4; ++i) {
      seen[i][k] = sharp_along(gradients, sides[i][0], sides[i][1], true, kFaintEdge);
    }
  }
  const auto both = [&](std::size_t one, std::size_t other, double least, double ratio) {
    const auto equal = [&](std::size_t k, std::size_t m) {
      const auto [low, high] = std::minmax(seen[one][k], seen[other][m]);
      return low >= least && high >= kSheetSupport;
    };
    for (std::size_t k = 0; k < kSteps; ++k) {
      for (std::size_t m = k; m < kSteps && distance(m) < ratio * distance(k); ++m) {
        if (equal(k, m) || equal(m, k)) return true;
      }
    }
    return false;
  };
  // The fourth edge may be the weakest, and is where it has to be.
  const bool across = both(0, 2, kSheetSupport, kEqualRatio);
  const bool down = both(1, 3, kSheetSupport, kEqualRatio);
  return (across && down) || (across && both(1, 3, kWeakSupport, kSameRatio)) ||
         (down && both(0, 2, kWeakSupport, kSameRatio));
}

/// Whether a band of one colour is around a figure, as wide above it as below and as wide on its
/// left as on its right: a border or a margin. A table's colour reaches further.
bool within_band(const cv::Mat& rgb, const std::array<Point, 4>& corners) {
  constexpr int kPlaces = 40;          // of a side
  constexpr double kSame = 16;         // steps of a colour channel
  constexpr double kUniform = 0.9;     // share of a side's places next to it with the band's colour
  constexpr double kEnded = 0.4;       // the same where the band has ended
  constexpr double kEqualRatio = 1.5;  // most ratio of two widths that are equal
  const cv::Matx33d plane = plane_of(corners);
  const auto colour = [&](std::size_t side, double off, int place) {
    const double along = 0.05 + 0.9 * place / (kPlaces - 1);
    const double x = side % 2 == 0 ? along : side == 1 ? 1 + off : -off;
    const double y = side % 2 == 1 ? along : side == 2 ? 1 + off : -off;
    const Point at = on_plane(plane, x, y);
    const int column = std::clamp(static_cast<int>(std::lround(at.x)), 0, rgb.cols - 1);
    const int row = std::clamp(static_cast<int>(std::lround(at.y)), 0, rgb.rows - 1);
    return cv::Vec3d(rgb.at<cv::Vec3b>(row, column));
  };
  cv::Vec3d mean;
  for (std::size_t i = 0; i < 4; ++i) {
    for (int k = 0; k < kPlaces; ++k) mean += colour(i, kNearBorder, k) / (4.0 * kPlaces);
  }
  const auto share = [&](std::size_t side, double off) {
    int same = 0;
    for (int k = 0; k < kPlaces; ++k) {
      same += cv::norm(colour(side, off, k) - mean, cv::NORM_INF) < kSame ? 1 : 0;
    }
    return 1.0 * same / kPlaces;
  };
  std::array<double, 4> width{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (share(i, kNearBorder) < kUniform) return false;
    width[i] = kNearBorder;
    while (width[i] < kFarBorder && share(i, width[i]) > kEnded) width[i] += 0.005;
    if (width[i] >= kFarBorder) return false;
  }
  const auto equal = [&](double one, double other) {
    return std::max(one, other) < kEqualRatio * std::min(one, other);
  };
  return equal(width[0], width[2]) && equal(width[1], width[3]);
}

/// Printed frames are inside an object's own edges: the largest figure around the best one that has
/// nearly its contrast.
const Figure& outermost(const std::vector<Figure>& figures) {
  const Figure& best = figures.front();
  const Figure* chosen = &best;
  for (const Figure& other : figures) {
    if (other.score < best.score - kOutlineScore) break;
    if (other.support < kOutlineSupport || area_of(other.corners) <= area_of(chosen->corners) ||
        area_of(other.corners) > kMostMargin * area_of(best.corners)) {
      continue;
    }
    if (around(other.corners, best.corners)) chosen = &other;
  }
  return *chosen;
}

tl::unexpected<Error> not_found(const char* cause) {
  return fail(
      ExitCode::kInvalidInput, "rectify.not-found", "", cause,
      "pass the pixels of the four corners with --corners (`modar studio` shows the photo, to set "
      "them on it), or take a photo that shows all edges on a plain background; a scan or a "
      "frontal picture is baked unchanged");
}

/// Another figure of about the same score that is neither within the best one nor nearly it.
bool rivalled(const std::vector<Figure>& figures) {
  const Figure& best = figures.front();
  const double side = std::sqrt(area_of(best.corners));
  for (const Figure& other : figures) {
    if (other.score < best.score - 0.08) break;
    double apart = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      apart = std::max(apart, norm_of(other.corners[i] - best.corners[i]));
    }
    const Point middle = (other.corners[0] + other.corners[2]) / 2;
    const Point centre = (best.corners[0] + best.corners[2]) / 2;
    if (apart > 0.5 * side && norm_of(middle - centre) > 0.35 * side) return true;
  }
  return false;
}

/// Lines of the photo in all colours, the longest first.
std::vector<Line> lines_of(const cv::Mat& rgb, const Gradients& gradients) {
  std::vector<cv::Vec4f> segments;
  const auto detector = cv::createLineSegmentDetector(cv::LSD_REFINE_STD);
  std::array<cv::Mat, 3> channels;
  cv::split(rgb, channels.data());
  for (const cv::Mat& channel : channels) {
    std::vector<cv::Vec4f> some;
    detector->detect(channel, some);
    segments.insert(segments.end(), some.begin(), some.end());
  }
  std::vector<Line> lines = join_segments(std::move(segments));
  for (Line& line : lines) cover(line, gradients, kEdge);
  return lines;
}

/// The figure of edges that divides an object best from its background, or else the object's
/// outline.
std::array<Point, 4> figure_of(const std::vector<Figure>& figures, const Foreground& object) {
  constexpr std::size_t kMost = 400;  // of the best figures
  const auto worth = [&](const Figure& one) { return one.score + object.divided(one.corners); };
  const Figure* best = nullptr;
  for (std::size_t i = 0; i < std::min(kMost, figures.size()); ++i) {
    if (best == nullptr || worth(figures[i]) > worth(*best)) best = &figures[i];
  }
  const bool good = best != nullptr && object.divided(best->corners) > 0;
  return good ? best->corners : object.corners();
}

/// Takes the corners where they are sharper and divide the object better than those found before.
void keep_better(const Gradients& gradients, const Foreground& object,
                 const std::array<Point, 4>& corners, std::array<Point, 4>& best,
                 FoundCorners& found) {
  const double sharpness = least_sharp(gradients, corners);
  const double divided = object.divided(corners);
  if (sharpness + divided <= found.sharpness + found.divided + kBetter) return;
  best = corners;
  found.sharpness = sharpness;
  found.divided = divided;
}

/// A place in pixels whose centres are whole numbers, in a picture that is larger by a factor.
Point magnified(const Point& place, double factor) {
  return (place + Point(0.5, 0.5)) * factor - Point(0.5, 0.5);
}

bool is_within(const Point& at, const RgbaImage& photo) {
  return at.x >= -0.5 && at.y >= -0.5 && at.x <= photo.width - 0.5 && at.y <= photo.height - 0.5;
}

Result<FoundCorners> search(const RgbaImage& photo) {
  const cv::Mat rgba(static_cast<int>(photo.height), static_cast<int>(photo.width), CV_8UC4,
                     const_cast<std::uint8_t*>(photo.pixels.data()));
  cv::Mat rgb;
  cv::cvtColor(rgba, rgb, cv::COLOR_RGBA2RGB);
  const double scale = std::max(1.0, std::max(rgb.cols, rgb.rows) / kSearchSide);
  cv::Mat small;
  cv::resize(rgb, small, cv::Size(), 1 / scale, 1 / scale, cv::INTER_AREA);
  const Gradients gradients(small);
  const std::vector<Figure> figures = Search(small, lines_of(small, gradients)).figures();
  const Foreground object(small);
  const bool seen = !figures.empty() && figures.front().support >= kLeastSupport;
  const bool several = seen && rivalled(figures);
  FoundCorners found;
  std::array<Point, 4> corners;
  if (seen && !several) {
    const auto outline = refine(gradients, outermost(figures).corners, {2.5, 3.0});
    keep_better(gradients, object, refine(gradients, push_out(gradients, outline), {1.2, 1.2}),
                corners, found);
  }
  if (object.known()) {
    for (const auto& start : {figure_of(figures, object), object.corners()}) {
      const auto outline = settle(gradients, object, refine(gradients, start, {2.5, 3.0}));
      keep_better(gradients, object, refine(gradients, outline, {2.5, 1.2, 1.2}), corners, found);
    }
  }
  if (found.sharpness < kLeastSharp) {
    return not_found(several ? "several four-sided figures stand out in the photo"
                     : seen  ? "no four-sided figure stands out sharply in the photo"
                             : "no four-sided figure stands out in the photo");
  }
  found.quarter = least_sharp(gradients, corners, 4);
  found.ends = least_ends(gradients, corners);
  found.fills = area_of(corners) > kFilled * small.cols * small.rows;
  found.framed =
      framed(gradients, figures, corners) || (!found.fills && goes_on(gradients, corners));
  found.rivalled = object.rivalled();
  found.holds =
      holds_another(small, gradients, corners) || holds_a_figure(gradients, figures, corners);
  found.bordered =
      bordered(gradients, corners) || within_band(small, corners) || is_inner(gradients, corners);
  const double fine = std::max(1.0, std::max(rgb.cols, rgb.rows) / kRefineSide);
  if (fine > 1) cv::resize(rgb, rgb, cv::Size(), 1 / fine, 1 / fine, cv::INTER_AREA);
  const double step = scale / fine;
  for (Point& corner : corners) corner = magnified(corner, step);
  corners = refine(Gradients(rgb), corners, {1.2 * step, 1.2, 1.2});
  for (std::size_t i = 0; i < 4; ++i) {
    const Point corner = magnified(corners[i], fine);
    if (!is_within(corner, photo))
      return not_found("a corner of what stands out is outside the photo");
    found.corners[i] = {corner.x, corner.y};
  }
  return found;
}

/// Sides parallel to those of the photo, as in a scan and in no hand-held photo.
bool is_upright(const std::array<Point, 4>& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Point side = corners[(i + 1) % 4] - corners[i];
    if (std::min(std::fabs(side.x), std::fabs(side.y)) > kUpright * norm_of(side)) return false;
  }
  return true;
}

}  // namespace

Result<FoundCorners> find_corners(const RgbaImage& photo) {
  try {
    return search(photo);
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "rectify.opencv", "", thrown.what(), "report this as a bug");
  }
}

namespace {

/// Pixels between the ends of a side, across it, in layouts of programs. Higher takes photos for
/// layouts, lower reports their frames as corners. [0.2, 0.5]
constexpr double kDrawnOff = 0.3;
/// Share of pixels around a figure that are edges of print. [0.0005, 0.01]
constexpr double kPrintAround = 0.001;
/// Gray values from a pixel to the next at an edge of print. [20, 80]
constexpr double kPrintStep = 40;

/// Sides along the pixels' rows and columns: no camera is held so.
bool is_drawn(const std::array<Point, 4>& corners) {
  const std::array<double, 4> off = {corners[0].y - corners[1].y, corners[3].y - corners[2].y,
                                     corners[0].x - corners[3].x, corners[1].x - corners[2].x};
  return std::all_of(off.begin(), off.end(), [](double one) { return std::abs(one) <= kDrawnOff; });
}

/// Text or other pictures next to the figure: both are parts of one layout.
bool has_print_around(const RgbaImage& image, const std::array<Point, 4>& corners) {
  if (image.pixels.empty()) return false;
  const cv::Mat rgba(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4,
                     const_cast<std::uint8_t*>(image.pixels.data()));
  cv::Mat gray;
  cv::cvtColor(rgba, gray, cv::COLOR_RGBA2GRAY);
  cv::Mat across;
  cv::Mat down;
  cv::Sobel(gray, across, CV_16S, 1, 0, 1);
  cv::Sobel(gray, down, CV_16S, 0, 1, 1);
  cv::Mat print = cv::abs(across) + cv::abs(down) > 2 * kPrintStep;
  const double margin =
      0.03 * std::max(norm_of(corners[1] - corners[0]), norm_of(corners[3] - corners[0]));
  const cv::Rect figure = cv::Rect(cv::Point2d(corners[0].x - margin, corners[0].y - margin),
                                   cv::Point2d(corners[2].x + margin, corners[2].y + margin)) &
                          cv::Rect(0, 0, print.cols, print.rows);
  print(figure) = 0;
  const double around = static_cast<double>(print.total()) - figure.area();
  return cv::countNonZero(print) > kPrintAround * around;
}

/// Share of equal neighbours on the border from which a background is drawn, not photographed.
constexpr double kDrawnGround = 0.9;

bool has_drawn_ground(const cv::Mat& rgb) {
  int equal = 0;
  int all = 0;
  for (const int y : {0, rgb.rows - 1}) {
    for (int x = 1; x < rgb.cols; ++x, ++all) {
      if (rgb.at<cv::Vec3b>(y, x) == rgb.at<cv::Vec3b>(y, x - 1)) ++equal;
    }
  }
  return equal >= kDrawnGround * all;
}

/// Whether a photo shows a single thing on a background, perhaps cut off by one or two of the
/// photo's sides: the file is hardly the picture itself.
bool shows_an_object(const RgbaImage& image) {
  if (image.pixels.empty() || std::max(image.width, image.height) < kLeastPhoto) return false;
  const cv::Mat rgba(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4,
                     const_cast<std::uint8_t*>(image.pixels.data()));
  cv::Mat rgb;
  cv::cvtColor(rgba, rgb, cv::COLOR_RGBA2RGB);
  constexpr unsigned kCutOff[] = {
      0, kAtTop, kAtRight, kAtBottom, kAtLeft, kAtTop | kAtBottom, kAtLeft | kAtRight};
  return !has_drawn_ground(rgb) &&
         ranges::any_of(kCutOff, [&](unsigned sides) { return Foreground(rgb, sides).solitary(); });
}

}  // namespace

FoundPicture find_picture(const Photo& photo, const Result<FoundCorners>& found) {
  const double width = photo.image.width;
  const double height = photo.image.height;
  const bool is_photo = std::max(width, height) >= kLeastPhoto && has_camera_shape(width, height);
  FoundPicture picture;
  picture.doubt = photo.focal_px > 0 || is_photo ? "not-found" : "";
  const auto whole = [&] {
    if (shows_an_object(photo.image)) picture.doubt = "object";
    return picture;
  };
  if (!found) return whole();
  std::array<Point, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = {found->corners[i].x, found->corners[i].y};
  const double share = area_of(corners) / (width * height);
  RectifyOptions cut;
  cut.corners = found->corners;
  const bool unsharp = found->sharpness < kDoubtfulSharpness && !found->clear();
  const bool part = share < (unsharp ? kLeastShare : kLeastPicture) || !cut.validate();
  if (part) {
    if (!is_drawn(corners) && !is_upright(corners) && share >= kLeastPicture)
      picture.doubt = "part";
    return whole();
  }
  const bool frontal = share > kLeastFrontal && is_upright(corners);
  // A scan has such edges within it; the photo of a print from straight above has them around it.
  const bool filled = found->fills && !unsharp;
  if (filled || (!found->fills && (!frontal || !found->clear()))) picture.doubt = "";
  if (found->fills || frontal) {
    if (*picture.doubt != 0 && !found->fills) picture.doubt = "upright";
    return picture;
  }
  if (is_drawn(corners) && has_print_around(photo.image, corners)) {
    picture.doubt = "";
    return picture;
  }
  picture.doubt = found->doubt();
  picture.corners = found->corners;
  for (PixelPoint& corner : *picture.corners) {
    corner = {std::round(100 * corner.x) / 100, std::round(100 * corner.y) / 100};
  }
  return picture;
}

std::string_view doubt_words(std::string_view doubt) {
  if (doubt == "rivalled") return "there are several flat objects in the photo";
  if (doubt == "part") return "something flat stands out in it, which may be the picture";
  if (doubt == "object")
    return "it shows an object on a background, and not all its four edges stand out";
  return doubt == "blurred"  ? "an edge is hidden or blurred"
         : doubt == "framed" ? "there are edges around or beyond them, perhaps those of the sheet"
         : doubt == "upright"
             ? "edges parallel to the photo's stand out, perhaps those of the picture"
         : doubt == "fills" ? "they fill the photo, which may already be the picture"
                            : "no edges of a flat object stand out";
}

Result<RgbaImage> corners_picture(const RgbaImage& photo,
                                  const std::array<PixelPoint, 4>& corners) {
  try {
    const cv::Mat source(static_cast<int>(photo.height), static_cast<int>(photo.width), CV_8UC4,
                         const_cast<std::uint8_t*>(photo.pixels.data()));
    const double scale = std::min(1.0, 1200.0 / photo.width);
    cv::Mat shown;
    cv::resize(source, shown, cv::Size(), scale, scale, cv::INTER_AREA);
    std::vector<cv::Point> outline;
    for (const PixelPoint& c : corners) {
      outline.emplace_back(static_cast<int>(std::lround((c.x + 0.5) * scale - 0.5)),
                           static_cast<int>(std::lround((c.y + 0.5) * scale - 0.5)));
    }
    const cv::Scalar ink(255, 48, 96, 255);
    cv::polylines(shown, outline, true, ink, 2, cv::LINE_AA);
    for (std::size_t i = 0; i < 4; ++i) {
      cv::circle(shown, outline[i], 7, ink, 2, cv::LINE_AA);
      cv::putText(shown, std::to_string(i + 1), outline[i] + cv::Point(10, 22),
                  cv::FONT_HERSHEY_SIMPLEX, 0.8, ink, 2, cv::LINE_AA);
    }
    RgbaImage out{
        static_cast<std::uint32_t>(shown.cols), static_cast<std::uint32_t>(shown.rows), {}};
    out.pixels.assign(shown.data, shown.data + shown.total() * 4);
    return out;
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "rectify.opencv", "", thrown.what(), "report this as a bug");
  }
}

}  // namespace modar
