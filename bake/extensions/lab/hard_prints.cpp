#include "bake/extensions/lab/hard_prints.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace modar {
namespace {

constexpr int kLonger = 480;  // pixels

int drawn(int least, int most, Random& random) {
  return least + static_cast<int>(random.next() % static_cast<std::uint64_t>(most - least + 1));
}

bool coin(Random& random) {
  return random.next() % 2 == 0;
}

cv::Mat paper(double aspect, int gray = 245) {
  const int width = static_cast<int>(aspect >= 1 ? kLonger : kLonger * aspect);
  const int height = static_cast<int>(aspect >= 1 ? kLonger / aspect : kLonger);
  return cv::Mat(height, width, CV_8UC1, cv::Scalar(gray));
}

void fill(cv::Mat& print, double x, double y, double width, double height, int gray) {
  const cv::Rect place(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)),
                       static_cast<int>(std::lround(x + width) - std::lround(x)),
                       static_cast<int>(std::lround(y + height) - std::lround(y)));
  print(place & cv::Rect({}, print.size())).setTo(gray);
}

void set_text(cv::Mat& print, const std::string& text, double x, double y, double height) {
  const double size = height / 30;
  cv::putText(print, text, {static_cast<int>(x), static_cast<int>(y)}, cv::FONT_HERSHEY_COMPLEX,
              size, cv::Scalar(30), std::max(1, static_cast<int>(2 * size)), cv::LINE_AA);
}

std::string letters(int count, const char* first, int kinds, Random& random) {
  std::string text;
  for (int i = 0; i < count; ++i) text += static_cast<char>(*first + drawn(0, kinds - 1, random));
  return text;
}

/// Random modules of `side` pixels, dark or white.
void modules(cv::Mat& print, double x, double y, int count, double side, Random& random) {
  for (int i = 0; i < count * count; ++i) {
    fill(print, x + i % count * side, y + static_cast<int>(i / count) * side, side, side,
         coin(random) ? 20 : 240);
  }
}

cv::Mat chessboard(Random& random) {
  const int columns = drawn(5, 10, random);
  const int rows = drawn(4, 8, random);
  cv::Mat print = paper((columns + 1.0) / (rows + 1));
  const double side = print.cols / (columns + 1.0);
  for (int i = 0; i < columns * rows; ++i) {
    const int x = i % columns;
    const int y = i / columns;
    if ((x + y) % 2 == 0) fill(print, (x + 0.5) * side, (y + 0.5) * side, side, side, 15);
  }
  return print;
}

cv::Mat marker_sheet(Random& random) {
  const int columns = drawn(3, 6, random);
  const int rows = drawn(2, 5, random);
  const int bits = drawn(4, 6, random);
  cv::Mat print = paper(1.0 * columns / rows);
  const double pitch = 1.0 * print.cols / columns;
  const double side = pitch * random.uniform(0.6, 0.85);
  for (int i = 0; i < columns * rows; ++i) {
    const double x = (i % columns + 0.5) * pitch - 0.5 * side;
    const double y = (static_cast<int>(i / columns) + 0.5) * pitch - 0.5 * side;
    fill(print, x, y, side, side, 15);
    const double module = side / (bits + 2);
    modules(print, x + module, y + module, bits, module, random);
  }
  return print;
}

/// A frame and what it holds, as codes have them in their corners or in the middle.
void rings(cv::Mat& print, double x, double y, double module, int count) {
  for (int k = count; k > 0; --k) {
    fill(print, x - (k - 0.5) * module, y - (k - 0.5) * module, (2 * k - 1) * module,
         (2 * k - 1) * module, (count - k) % 2 == 0 ? 20 : 240);
  }
}

cv::Mat qr_code(Random& random) {
  const int count = 17 + 4 * drawn(1, 4, random);
  cv::Mat print = paper(1);
  const double module = kLonger / (count + 8.0);
  const double edge = 4 * module;
  modules(print, edge, edge, count, module, random);
  for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {0, 1}}) {
    const double left = edge + x * (count - 7) * module;
    const double top = edge + y * (count - 7) * module;
    fill(print, left - module, top - module, 9 * module, 9 * module, 240);
    rings(print, left + 3.5 * module, top + 3.5 * module, module, 4);
    fill(print, left + 2 * module, top + 2 * module, 3 * module, 3 * module, 20);
  }
  return print;
}

cv::Mat aztec_code(Random& random) {
  const int count = 15 + 4 * drawn(0, 4, random);
  cv::Mat print = paper(1);
  const double module = kLonger / (count + 4.0);
  modules(print, 2 * module, 2 * module, count, module, random);
  rings(print, 0.5 * kLonger, 0.5 * kLonger, module, 5);
  return print;
}

/// Dark squares, empty or with a code of modules in each.
cv::Mat square_grid(bool coded, Random& random) {
  const int columns = drawn(3, 6, random);
  const int rows = drawn(3, 5, random);
  cv::Mat print = paper((columns + 0.5) / (rows + 0.5));
  const double pitch = print.cols / (columns + 0.5);
  const double side = pitch * random.uniform(0.45, 0.65);
  for (int i = 0; i < columns * rows; ++i) {
    const double x = (i % columns + 0.4) * pitch;
    const double y = (static_cast<int>(i / columns) + 0.4) * pitch;
    fill(print, x, y, side, side, 15);
    if (coded) modules(print, x + side / 5, y + side / 5, 3, side / 5, random);
  }
  return print;
}

cv::Mat squares(Random& random) {
  return square_grid(false, random);
}

cv::Mat coded_squares(Random& random) {
  return square_grid(true, random);
}

cv::Mat dots(Random& random) {
  const int columns = drawn(5, 11, random);
  const int rows = drawn(4, 9, random);
  const double shift = coin(random) ? 0.5 : 0.0;
  cv::Mat print = paper((columns + 0.5) / rows);
  const double pitch = print.cols / (columns + 0.5);
  const double radius = pitch * random.uniform(0.2, 0.35);
  for (int i = 0; i < columns * rows; ++i) {
    const int row = i / columns;
    cv::circle(print,
               {static_cast<int>((i % columns + 0.5 + row % 2 * shift) * pitch),
                static_cast<int>((row + 0.5) * pitch)},
               static_cast<int>(radius), cv::Scalar(20), cv::FILLED, cv::LINE_AA);
  }
  return print;
}

cv::Mat text_page(Random& random) {
  cv::Mat print = paper(random.uniform(0.65, 1.4));
  const double line = random.uniform(14, 24);
  for (double y = 2 * line; y < print.rows - line; y += 1.5 * line) {
    const double end = print.cols * (drawn(0, 5, random) == 0 ? random.uniform(0.3, 0.9) : 0.93);
    for (double x = 0.07 * print.cols; x < end;) {
      const int count = drawn(2, 8, random);
      set_text(print, letters(count, "a", 26, random), x, y, line);
      x += (count + 1) * 0.62 * line;
    }
  }
  return print;
}

cv::Mat table(Random& random) {
  cv::Mat print = paper(random.uniform(0.8, 1.5));
  const int columns = drawn(4, 7, random);
  const int rows = drawn(8, 14, random);
  const double wide = 1.0 * print.cols / columns;
  const double high = 1.0 * print.rows / rows;
  for (int i = 0; i < columns * rows; ++i) {
    const double x = i % columns * wide;
    const double y = static_cast<int>(i / columns) * high;
    fill(print, x, y, wide, 2, 90);
    fill(print, x, y, 2, high, 90);
    set_text(print, letters(drawn(2, 4, random), "0", 10, random), x + 0.15 * wide, y + 0.75 * high,
             0.6 * high);
  }
  return print;
}

cv::Mat bar_code(Random& random) {
  cv::Mat print = paper(random.uniform(1.2, 2.0));
  double x = 0.05 * print.cols;
  while (x < 0.93 * print.cols) {
    const double wide = drawn(1, 4, random) * print.cols / 110.0;
    fill(print, x, 0.08 * print.rows, wide, 0.7 * print.rows, 20);
    x += wide + drawn(1, 4, random) * print.cols / 110.0;
  }
  set_text(print, letters(12, "0", 10, random), 0.1 * print.cols, 0.93 * print.rows,
           0.12 * print.rows);
  return print;
}

cv::Mat landscape(Random& random) {
  GrayPicture cloud = made_background(kLonger, kLonger * 2 / 3, random);
  cv::Mat print(cloud.height, cloud.width, CV_8UC1, cloud.pixels.data());
  cv::Mat soft;
  cv::GaussianBlur(print, soft, {}, random.uniform(2, 4));
  for (int hill = 0; hill < 3; ++hill) {
    const double base = (0.4 + 0.2 * hill) * soft.rows;
    const double phase = random.uniform(0, 6.28);
    for (int x = 0; x < soft.cols; ++x) {
      const int top = static_cast<int>(base + 0.08 * soft.rows * std::sin(0.01 * x + phase) +
                                       0.03 * soft.rows * std::sin(0.037 * x + 2 * phase));
      for (int y = std::max(0, top); y < soft.rows; ++y) {
        std::uint8_t& pixel = soft.at<std::uint8_t>(y, x);
        pixel = static_cast<std::uint8_t>(0.75 * pixel);
      }
    }
  }
  cv::GaussianBlur(soft, soft, {}, 1.5);
  return soft;
}

cv::Mat street_map(Random& random) {
  cv::Mat print = paper(random.uniform(0.8, 1.4), 225);
  for (int road = drawn(20, 40, random); road > 0; --road) {
    cv::Point2d at(random.uniform(0, print.cols), random.uniform(0, print.rows));
    double angle = 1.57 * drawn(0, 3, random) + random.uniform(-0.3, 0.3);
    const int width = drawn(1, 6, random);
    const int gray = coin(random) ? 255 : drawn(90, 170, random);
    for (int part = drawn(3, 10, random); part > 0; --part) {
      const cv::Point2d next =
          at + random.uniform(20, 70) * cv::Point2d(std::cos(angle), std::sin(angle));
      cv::line(print, at, next, cv::Scalar(gray), width, cv::LINE_AA);
      at = next;
      angle += random.uniform(-0.5, 0.5);
    }
  }
  for (int name = 0; name < 12; ++name) {
    set_text(print, letters(drawn(4, 9, random), "a", 26, random),
             random.uniform(0, 0.8) * print.cols, random.uniform(0.05, 1) * print.rows, 13);
  }
  return print;
}

/// One motif, again and again.
cv::Mat wallpaper(Random& random) {
  const int side = drawn(40, 80, random);
  cv::Mat motif(side, side, CV_8UC1, cv::Scalar(drawn(150, 230, random)));
  for (int leaf = drawn(3, 7, random); leaf > 0; --leaf) {
    cv::ellipse(motif, {drawn(0, side, random), drawn(0, side, random)},
                {drawn(4, side / 3, random), drawn(3, side / 5, random)}, random.uniform(0, 360), 0,
                360, cv::Scalar(drawn(20, 140, random)), cv::FILLED, cv::LINE_AA);
  }
  cv::Mat print;
  cv::repeat(motif, drawn(4, 6, random), drawn(5, 7, random), print);
  cv::resize(print, print, {}, 1.0 * kLonger / print.cols, 1.0 * kLonger / print.cols,
             cv::INTER_AREA);
  return print;
}

cv::Mat brick_wall(Random& random) {
  cv::Mat print = paper(1.4, 200);
  const double high = random.uniform(22, 40);
  const double wide = high * random.uniform(1.8, 2.6);
  for (int row = 0; row * high < print.rows; ++row) {
    for (double x = row % 2 * -0.5 * wide; x < print.cols; x += wide) {
      fill(print, x + 2, row * high + 2, wide - 4, high - 4, drawn(90, 150, random));
    }
  }
  return print;
}

cv::Mat keyboard(Random& random) {
  const int columns = drawn(8, 13, random);
  const int rows = drawn(4, 6, random);
  cv::Mat print = paper(1.0 * columns / rows, 60);
  const double pitch = 1.0 * print.cols / columns;
  for (int i = 0; i < columns * rows; ++i) {
    const double x = i % columns * pitch;
    const double y = static_cast<int>(i / columns) * pitch;
    fill(print, x + 0.08 * pitch, y + 0.08 * pitch, 0.84 * pitch, 0.84 * pitch, 215);
    set_text(print, letters(1, "A", 26, random), x + 0.2 * pitch, y + 0.6 * pitch, 0.5 * pitch);
  }
  return print;
}

struct Kind {
  const char* name;
  cv::Mat (*draw)(Random&);
};

constexpr Kind kKinds[] = {{"chessboard", chessboard}, {"marker sheet", marker_sheet},
                           {"QR code", qr_code},       {"Aztec code", aztec_code},
                           {"square grid", squares},   {"binary grid", coded_squares},
                           {"dot grid", dots},         {"text", text_page},
                           {"table", table},           {"bar code", bar_code},
                           {"landscape", landscape},   {"map", street_map},
                           {"wallpaper", wallpaper},   {"brick wall", brick_wall},
                           {"keyboard", keyboard}};

}  // namespace

std::vector<HardPrint> hard_prints(Random& random) {
  std::vector<HardPrint> prints;
  for (const Kind& kind : kKinds) {
    for (int k = 0; k < 2; ++k) {
      const cv::Mat drawing = kind.draw(random);
      GrayPicture picture{drawing.cols, drawing.rows, {}};
      for (int y = 0; y < drawing.rows; ++y) {
        picture.pixels.insert(picture.pixels.end(), drawing.ptr(y), drawing.ptr(y) + drawing.cols);
      }
      prints.push_back({kind.name, std::move(picture)});
    }
  }
  return prints;
}

}  // namespace modar
