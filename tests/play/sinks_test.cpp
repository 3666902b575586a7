// Pictures and movies that the player writes, read back by OpenCV.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "files.hpp"
#include "runtime/play/frame_sink.hpp"

namespace modar {
namespace {

/// A picture whose red grows with the frame's number.
std::vector<std::uint8_t> picture(int width, int height, int number) {
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width * height * 4));
  for (std::size_t i = 0; i < rgba.size(); i += 4) {
    rgba[i] = static_cast<std::uint8_t>(40 + 20 * number);
    rgba[i + 1] = 90;
    rgba[i + 2] = 30;
    rgba[i + 3] = 255;
  }
  return rgba;
}

TEST(Sinks, AFolderTakesNumberedPngsWithTheirColours) {
  const test::Folder folder;
  auto sink = open_frame_sink(folder / "deep/er", 30);
  ASSERT_TRUE(sink) << to_line(sink.error());
  FrameReport report;
  report.frame = 7;
  ASSERT_TRUE((*sink)->picture({picture(5, 3, 2), 5, 3}, report));
  ASSERT_TRUE((*sink)->finish(""));
  const cv::Mat read = cv::imread(folder / "deep/er/frame_000007.png");
  ASSERT_EQ(read.size(), cv::Size(5, 3));
  EXPECT_EQ(read.at<cv::Vec3b>(1, 1), cv::Vec3b(30, 90, 80));
}

TEST(Sinks, AMovieHoldsEachFrame) {
  const test::Folder folder;
  const std::string path = folder / "a.mp4";
  auto sink = open_frame_sink(path, 25);
  ASSERT_TRUE(sink) << to_line(sink.error());
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE((*sink)->picture({picture(65, 49, i), 65, 49}, {})) << "odd sides";
  }
  ASSERT_TRUE((*sink)->finish(""));
  sink->reset();
  EXPECT_EQ(folder.count(), 1u) << "nothing half-made next to it";
  const std::string bytes = test::read_text(path);
  EXPECT_NE(bytes.find("avc1"), std::string::npos);

  cv::VideoCapture video(path);
  cv::Mat frame;
  int n = 0;
  for (; video.read(frame); ++n) {
    ASSERT_EQ(frame.size(), cv::Size(64, 48));
    EXPECT_NEAR(frame.at<cv::Vec3b>(20, 20)[2], 40 + 20 * n, 8) << n;
  }
  EXPECT_EQ(n, 10);
  EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), 25, 1e-6);
}

TEST(Sinks, TheSamePicturesGiveTheSameBytes) {
  const test::Folder folder;
  for (const char* name : {"a.mp4", "b.mp4"}) {
    auto sink = open_frame_sink(folder / name, 30);
    ASSERT_TRUE(sink);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE((*sink)->picture({picture(64, 48, i), 64, 48}, {}));
    ASSERT_TRUE((*sink)->finish(""));
  }
  EXPECT_EQ(test::read_text(folder / "a.mp4"), test::read_text(folder / "b.mp4"));
}

/// A limit on the size of files: writes fail as on a full disk.
TEST(Sinks, AFullDiskLeavesNoNewFolderWithoutAFile) {
  const test::Folder folder;
  PlayOptions options;
  options.out = folder / "deep/er";
  options.record = folder / "walk";
  options.report = folder / "kept";
  ASSERT_TRUE(make_folder(options.report));
  const NewFolders made(options);
  auto sink = open_frame_sink(options.out, 30);
  ASSERT_TRUE(sink);
  ASSERT_TRUE(make_folder(options.record + "/frames"));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  const auto written = (*sink)->picture({picture(5, 3, 2), 5, 3}, {});
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(written);
  test::write_text(options.record + "/frames/frame_000000.png", "");
  made.remove_empty();
  EXPECT_FALSE(std::filesystem::exists(folder / "deep"));
  EXPECT_EQ(folder.count(), 2u) << "the older folder, and the one with a file";
}

TEST(Sinks, SayWhatTheyCannotTake) {
  const test::Folder folder;
  EXPECT_EQ(open_frame_sink(folder / "a.avi", 30).error().code, "out.format");
  test::write_text(folder / "file", "");
  EXPECT_EQ(open_frame_sink(folder / "file", 30).error().code, "out.create");
  EXPECT_EQ(open_frame_sink(folder / "file/deeper", 30).error().code, "out.create");
  auto sink = open_frame_sink(folder / "a.mp4", 30);
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->picture({picture(64, 48, 0), 64, 48}, {}));
  EXPECT_EQ((*sink)->picture({picture(32, 48, 0), 32, 48}, {}).error().code, "out.size-changed");
  auto empty = open_frame_sink(folder / "b.mp4", 30);
  ASSERT_TRUE(empty);
  EXPECT_EQ((*empty)->finish("").error().code, "out.empty");
}

}  // namespace
}  // namespace modar
