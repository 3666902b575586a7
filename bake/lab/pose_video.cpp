// Both methods on a real video, judged by corners from a file.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "bake/lab/pose_bench.hpp"
#include "bake/pattern/pose_subject.hpp"

namespace modar {
namespace {

using Truths = std::map<std::uint64_t, FrameTruth>;

tl::unexpected<Error> bad_truth(const std::string& path, std::size_t line, const char* cause) {
  return fail(ExitCode::kInvalidInput, "bench.truth", path + ":" + std::to_string(line), cause,
              "write a line a frame: its number, 1 or 0 for a pattern that shows or not, and at "
              "last the corners' eight coordinates");
}

Result<Truths> read_truth(const std::string& path) {
  Truths truths;
  if (path.empty()) return truths;
  std::ifstream file(path);
  if (!file) {
    return fail(ExitCode::kIo, "bench.truth", path, "the file cannot be read", "check its path");
  }
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    for (char& letter : line) letter = letter == ',' ? ' ' : letter;
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    std::vector<double> values;
    for (double value = 0; words >> value;) values.push_back(value);
    if (!words.eof() || values.size() < 2) return bad_truth(path, number, "this is no number");
    FrameTruth truth;
    truth.pattern = values[1] == 1.0;
    if (truth.pattern && values.size() < 10) return bad_truth(path, number, "corners are missing");
    for (std::size_t i = 0; i < 8 && truth.pattern; ++i) {
      truth.corners[i / 2][static_cast<int>(i % 2)] = values[values.size() - 8 + i];
    }
    truths[static_cast<std::uint64_t>(values[0])] = truth;
  }
  return truths;
}

std::vector<std::string> patterns_of(const PoseBenchOptions& options, const VideoBench& video) {
  if (!video.pattern.empty()) return {video.pattern};
  const auto beside = std::filesystem::path(video.video).parent_path() / "pattern.png";
  std::error_code failed;
  if (std::filesystem::is_regular_file(beside, failed)) return {beside.string()};
  return options.patterns;
}

Result<std::vector<PoseBenchRow>> run_video(const PoseBenchOptions& options,
                                            const VideoBench& video, const Truths& truths,
                                            const ProgressCallback& progress) {
  cv::setNumThreads(1);
  cv::VideoCapture capture(video.video, cv::CAP_FFMPEG);
  cv::Mat picture;
  if (!capture.isOpened() || !capture.read(picture)) {
    return fail(ExitCode::kIo, "bench.video", video.video, "the video cannot be read",
                "give a video that other players show");
  }
  const Camera camera = default_camera(picture.cols, picture.rows);
  auto subject = make_subject(patterns_of(options, video), options, camera, true);
  if (!subject) return tl::unexpected(subject.error());
  Tallies tallies(std::filesystem::path(video.video).filename().string(), true);
  const double count = capture.get(cv::CAP_PROP_FRAME_COUNT);
  cv::Mat gray;
  for (std::uint64_t frame = 0; !picture.empty(); ++frame) {
    cv::cvtColor(picture, gray, cv::COLOR_BGR2GRAY);
    const auto truth = truths.find(frame);
    // Frames that the truth does not tell of are played, not judged.
    const bool judged = truths.empty() || truth != truths.end();
    const GrayImage image{gray.data, gray.cols, gray.rows,
                          static_cast<std::ptrdiff_t>(gray.step[0])};
    Tallies unjudged("", true);
    auto done = (judged ? tallies : unjudged)
                    .measure(*subject, image, truth != truths.end() ? truth->second : FrameTruth{});
    if (!done) return tl::unexpected(done.error());
    if (progress && count > 0) progress("video", static_cast<double>(frame + 1) / count);
    if (!capture.read(picture)) break;
  }
  std::vector<PoseBenchRow> rows;
  tallies.finish(options, rows);
  return rows;
}

}  // namespace

Result<std::vector<PoseBenchRow>> bench_video(const PoseBenchOptions& options,
                                              const VideoBench& video,
                                              const ProgressCallback& progress) {
  const auto truths = read_truth(video.truth);
  if (!truths) return tl::unexpected(truths.error());
  try {
    return run_video(options, video, *truths, progress);
  } catch (const std::exception& error) {
    return fail(ExitCode::kIo, "bench.video", video.video, std::string("OpenCV: ") + error.what(),
                "give a video that other players show");
  }
}

}  // namespace modar
