// Letters by OpenCV, which throws: caught here.
#include <algorithm>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "display.hpp"

namespace modar {

Result<void> draw_text_bar(const Canvas& canvas, const std::string& text) {
  try {
    cv::Mat picture(canvas.height, canvas.width, CV_8UC4, canvas.rgba.data());
    const double scale = std::max(0.4, canvas.width / 1600.0);
    const int height = std::min(canvas.height, cvRound(44 * scale));
    cv::Mat bar = picture(cv::Rect(0, 0, canvas.width, height));
    bar *= 0.35;
    bar |= cv::Scalar(0, 0, 0, 255);
    cv::putText(picture, text, cv::Point(cvRound(10 * scale), height - cvRound(13 * scale)),
                cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(255, 255, 255, 255),
                std::max(1, cvRound(1.6 * scale)), cv::LINE_AA);
  } catch (const std::exception& error) {
    return fail(ExitCode::kInternal, "display.opencv", "", std::string("OpenCV: ") + error.what(),
                "leave out --osd");
  }
  return {};
}

}  // namespace modar
