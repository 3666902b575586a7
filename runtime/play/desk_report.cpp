// The report of a run: movie, poster, contact sheet, JSON lines and the page that shows them.
#include <algorithm>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "formats/base/atomic_file.hpp"
#include "frame_report.hpp"
#include "frame_sink.hpp"
#include "report_page.hpp"

namespace modar {
namespace {

/// About two dozen frames, evenly over a run whose length nobody knows beforehand: one frame in
/// `stride_` is kept; where they become too many, every second one goes and the stride doubles.
class ContactSheet {
 public:
  void add(const RgbaView& image, const FrameReport& report) {
    if (count_++ % stride_ != 0) return;
    cells_.push_back(cell(image, report));
    if (cells_.size() < 2 * kCells) return;
    for (std::size_t i = 1; 2 * i < cells_.size(); ++i) cells_[i] = cells_[2 * i];
    cells_.resize(cells_.size() / 2);
    stride_ *= 2;
  }

  /// All that was kept, thinned to kCells, in rows of kColumns.
  [[nodiscard]] cv::Mat sheet() const {
    const std::size_t shown = std::min(cells_.size(), kCells);
    if (shown == 0) return {};
    constexpr int kGap = 6;
    const int rows = static_cast<int>((shown + kColumns - 1) / kColumns);
    const int height = cells_[0].rows;
    cv::Mat sheet(rows * (height + kGap) + kGap,
                  static_cast<int>(kColumns) * (kCellWidth + kGap) + kGap, CV_8UC4,
                  cv::Scalar(24, 22, 20, 255));
    for (std::size_t i = 0; i < shown; ++i) {
      const cv::Mat& picture = cells_[i * cells_.size() / shown];
      const int x = kGap + static_cast<int>(i % kColumns) * (kCellWidth + kGap);
      const int y = kGap + static_cast<int>(i / kColumns) * (height + kGap);
      const cv::Rect part(0, 0, kCellWidth, std::min(height, picture.rows));
      picture(part).copyTo(sheet(cv::Rect(x, y, part.width, part.height)));
    }
    return sheet;
  }

 private:
  static constexpr std::size_t kCells = 24;
  static constexpr std::size_t kColumns = 4;
  static constexpr int kCellWidth = 320;
  static constexpr int kLabel = 18;  ///< pixels above the picture for its number and state

  static cv::Mat cell(const RgbaView& image, const FrameReport& report) {
    const cv::Mat whole(image.height, image.width, CV_8UC4,
                        const_cast<std::uint8_t*>(image.pixels.data()));
    const int height = std::max(1, image.height * kCellWidth / image.width);
    cv::Mat labelled(height + kLabel, kCellWidth, CV_8UC4);
    cv::resize(whole, labelled(cv::Rect(0, kLabel, kCellWidth, height)),
               cv::Size(kCellWidth, height), 0, 0, cv::INTER_AREA);
    cv::Scalar ink(207, 75, 69, 255);
    if (report.state == Shown::kShown) ink = cv::Scalar(47, 158, 95, 255);
    if (report.state == Shown::kHeld) ink = cv::Scalar(227, 162, 26, 255);
    std::string text = std::to_string(report.frame) + " " + to_string(report.state);
    if (report.state != Shown::kShown) {
      text += std::string(": ") + (report.visible.empty() ? to_string(report.reason) : "seen once");
    }
    labelled(cv::Rect(0, 0, kCellWidth, kLabel)) = ink;
    cv::putText(labelled, text, cv::Point(5, 13), cv::FONT_HERSHEY_SIMPLEX, 0.42,
                cv::Scalar(255, 255, 255, 255), 1, cv::LINE_AA);
    return labelled;
  }

  std::vector<cv::Mat> cells_;
  std::uint64_t stride_ = 1;
  std::uint64_t count_ = 0;
};

/// The picture shown until the movie is played: the first one with a model at or after
/// each power of two takes the place of the last, so that it comes from a run's second half where
/// it can, and few are copied.
class Poster {
 public:
  void add(const RgbaView& image, const FrameReport& report) {
    const bool model = report.state == Shown::kShown;
    if (++count_ >= next_ || (model && !has_model_)) due_ = true;
    while (next_ <= count_) next_ *= 2;
    if (!due_ || (has_model_ && !model)) return;
    pixels_.assign(image.pixels.begin(), image.pixels.end());
    width_ = image.width;
    height_ = image.height;
    due_ = false;
    has_model_ = model;
  }
  [[nodiscard]] RgbaView picture() const { return {pixels_, width_, height_}; }

 private:
  std::vector<std::uint8_t> pixels_;
  int width_ = 0;
  int height_ = 0;
  std::uint64_t count_ = 0;
  std::uint64_t next_ = 1;
  bool due_ = false;
  bool has_model_ = false;
};

class Report final : public FrameSink {
 public:
  Report(std::string folder, double fps, ReportTitle title, std::span<const std::string> names,
         std::unique_ptr<FrameSink> movie, AtomicFile lines)
      : folder_(std::move(folder)),
        fps_(fps),
        title_(std::move(title)),
        names_(names.begin(), names.end()),
        movie_(std::move(movie)),
        lines_(std::move(lines)) {}

  Result<void> picture(const RgbaView& image, const FrameReport& report) override {
    try {
      sheet_.add(image, report);
    } catch (const std::exception& error) {
      return failed(error.what());
    }
    poster_.add(image, report);
    return movie_->picture(image, report);
  }

  Result<void> line(const FrameReport& report, std::string_view json) override {
    stats_.add(report);
    frames_.push_back(page_frame(report));
    return write_line(json);
  }

  Result<void> finish(std::string_view summary) override {
    MODAR_TRY(movie_->finish(summary));
    MODAR_TRY(write_line(summary));
    MODAR_TRY(lines_.commit());
    MODAR_TRY(write_sheet());
    if (!frames_.empty()) {
      MODAR_TRY(write_png(folder_ + "/poster.png", poster_.picture()));
    }
    return write_file(folder_ + "/index.html", report_page(title_, fps_, frames_, stats_));
  }

 private:
  [[nodiscard]] tl::unexpected<Error> failed(const char* what) const {
    return fail(ExitCode::kInternal, "report.opencv", folder_, std::string("OpenCV: ") + what,
                "report this with the input that it happened on");
  }

  PageFrame page_frame(const FrameReport& report) const {
    PageFrame frame{report.frame,
                    report.time_s,
                    report.state,
                    report.reason,
                    !report.visible.empty(),
                    0,
                    0,
                    {}};
    for (const Detection& seen : report.visible) {
      frame.inliers = std::max(frame.inliers, seen.inliers);
      frame.matches = std::max(frame.matches, seen.matches);
      if (!frame.patterns.empty()) frame.patterns += ", ";
      if (seen.pattern < names_.size()) frame.patterns += names_[seen.pattern];
    }
    return frame;
  }

  Result<void> write_line(std::string_view json) {
    MODAR_TRY(lines_.write(std::as_bytes(std::span(json))));
    return lines_.write(std::as_bytes(std::span("\n", 1)));
  }

  Result<void> write_sheet() {
    try {
      const cv::Mat sheet = sheet_.sheet();
      if (sheet.empty()) return {};
      return write_png(folder_ + "/contact_sheet.png",
                       {{sheet.data, sheet.total() * 4}, sheet.cols, sheet.rows});
    } catch (const std::exception& error) {
      return failed(error.what());
    }
  }

  std::string folder_;
  double fps_;
  ReportTitle title_;
  std::vector<std::string> names_;
  std::unique_ptr<FrameSink> movie_;
  AtomicFile lines_;
  ContactSheet sheet_;
  Poster poster_;
  std::vector<PageFrame> frames_;
  RunStats stats_;
};

}  // namespace

Result<std::unique_ptr<FrameSink>> open_report(const std::string& folder, double fps,
                                               const ReportTitle& title,
                                               std::span<const std::string> pattern_names) {
  MODAR_TRY(make_folder(folder));
  MODAR_ASSIGN(auto movie, open_frame_sink(folder + "/overlay.mp4", fps));
  MODAR_ASSIGN(auto lines, AtomicFile::create(folder + "/frames.jsonl"));
  return std::make_unique<Report>(folder, fps, title, pattern_names, std::move(movie),
                                  std::move(lines));
}

}  // namespace modar
