// Frames from pictures, folders and videos.
#include "runtime/play/frame_source.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "files.hpp"

namespace modar {
namespace {

cv::Mat flat(int width, int height, cv::Scalar bgr) {
  return {height, width, CV_8UC3, bgr};
}

TEST(Source, APictureIsOneFrameInRgbAndGray) {
  const test::Folder folder;
  cv::imwrite(folder / "a.png", flat(7, 5, {10, 100, 200}));
  auto source = open_frame_source(folder / "a.png");
  ASSERT_TRUE(source) << to_line(source.error());
  EXPECT_EQ((*source)->info().frames, 1u);
  EXPECT_FALSE((*source)->info().live);
  Frame frame;
  ASSERT_TRUE(*(*source)->next(frame));
  EXPECT_EQ(frame.width, 7);
  EXPECT_EQ(frame.height, 5);
  EXPECT_EQ(std::vector(frame.rgb.begin(), frame.rgb.begin() + 3),
            (std::vector<std::uint8_t>{200, 100, 10}));
  // ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B = 119.64.
  EXPECT_NEAR(frame.gray[3], 120, 1);
  EXPECT_FALSE(*(*source)->next(frame));
}

TEST(Source, AFolderComesInTheOrderOfItsNames) {
  const test::Folder folder;
  cv::imwrite(folder / "b.PNG", flat(4, 4, {0, 0, 20}));
  cv::imwrite(folder / "a.jpg", flat(8, 4, {0, 0, 10}));
  cv::imwrite(folder / "c.png", flat(4, 4, {0, 0, 30}));
  test::write_text(folder / "notes.txt", "no picture");
  auto source = open_frame_source(folder.path());
  ASSERT_TRUE(source) << to_line(source.error());
  Frame frame;
  for (const int red : {10, 20, 30}) {
    ASSERT_TRUE(*(*source)->next(frame));
    EXPECT_NEAR(frame.rgb[0], red, 3);
    EXPECT_EQ(frame.index, static_cast<std::uint64_t>(red / 10 - 1));
  }
  EXPECT_FALSE(*(*source)->next(frame));
}

/// The first bytes of a picture of noise, which the decoder complains about on stderr.
void write_torn(const std::string& path) {
  cv::Mat noise(64, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  cv::imwrite(path, noise);
  test::write_text(path, test::read_text(path).substr(0, 4000));
}

TEST(Source, PicturesOfAFolderThatCannotBeReadAreSkippedByName) {
  const test::Folder folder;
  write_torn(folder / "a.png");
  cv::imwrite(folder / "b.png", flat(4, 4, {0, 0, 20}));
  test::write_text(folder / "c.jpg", "");
  test::write_text(folder / "d.bmp", "no picture");
  cv::imwrite(folder / "e.png", flat(4, 4, {0, 0, 30}));
  testing::internal::CaptureStderr();
  auto source = open_frame_source(folder.path());
  Frame frame;
  for (const std::size_t index : {1U, 4U}) {
    const auto more = (*source)->next(frame);
    ASSERT_TRUE(more && *more);
    EXPECT_EQ(frame.index, index);
  }
  const auto end = (*source)->next(frame);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "what a codec prints";
  ASSERT_TRUE(end) << to_line(end.error());
  EXPECT_FALSE(*end);
  ASSERT_EQ((*source)->skipped().size(), 3u);
  EXPECT_EQ((*source)->skipped()[0].where, folder / "a.png");
  EXPECT_EQ((*source)->skipped()[1].cause, "the file is empty");
  EXPECT_EQ((*source)->skipped()[2].where, folder / "d.bmp");
}

TEST(Source, AFolderWithoutAReadablePictureIsAnError) {
  const test::Folder folder;
  write_torn(folder / "a.png");
  write_torn(folder / "b.png");
  auto source = open_frame_source(folder.path());
  Frame frame;
  const auto none = (*source)->next(frame);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().exit, ExitCode::kInvalidInput);
  EXPECT_NE(none.error().cause.find("none of the 2 pictures"), std::string::npos);
}

/// What reading the picture prints.
std::string said_of(const std::string& path, Frame& frame) {
  testing::internal::CaptureStderr();
  auto source = open_frame_source(path);
  EXPECT_TRUE(*(*source)->next(frame));
  return testing::internal::GetCapturedStderr();
}

TEST(Source, AJpegOfWhichAPartIsMissingIsSaid) {
  const test::Folder folder;
  cv::Mat noise(64, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  for (const int progressive : {0, 1}) {
    cv::imwrite(folder / "a.jpg", noise, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive});
    const std::string whole = test::read_text(folder / "a.jpg");
    Frame frame;
    EXPECT_EQ(said_of(folder / "a.jpg", frame), "");
    const std::vector<std::uint8_t> pixels = frame.rgb;
    test::write_text(folder / "b.jpg", whole.substr(0, whole.size() - 2));  // no end marker
    EXPECT_EQ(said_of(folder / "b.jpg", frame), "");
    EXPECT_EQ(frame.rgb, pixels);
    test::write_text(folder / "c.jpg", whole.substr(0, whole.size() * 2 / 3));
    EXPECT_EQ(said_of(folder / "c.jpg", frame),
              "modar-play: " + (folder / "c.jpg") +
                  ": a part of the picture is missing; copy it again\n");
    EXPECT_EQ(frame.height, 64);
  }
}

TEST(Source, AProgressiveJpegOfWhichAScanIsMissingIsSaid) {
  const test::Folder folder;
  cv::Mat noise(64, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  cv::imwrite(folder / "a.jpg", noise, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  const std::string whole = test::read_text(folder / "a.jpg");
  int scans = 0;
  for (auto at = whole.find("\xFF\xDA"); at != whole.npos; at = whole.find("\xFF\xDA", at + 2)) {
    if (++scans == 1) continue;
    // libjpeg does not say that the file ends here, between two scans.
    test::write_text(folder / "b.jpg", whole.substr(0, at));
    Frame frame;
    EXPECT_NE(said_of(folder / "b.jpg", frame).find("a part of the picture is missing"), whole.npos)
        << scans;
  }
  EXPECT_GT(scans, 5);
}

TEST(Source, AVideoOfWhichAPartIsMissingIsSaid) {
  const test::Folder folder;
  const std::string path = folder / "v.avi";
  {
    cv::VideoWriter writer(path, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, cv::Size(64, 48));
    cv::Mat noise(48, 64, CV_8UC3);
    cv::randu(noise, 0, 255);
    for (int i = 0; i < 20; ++i) writer.write(noise);
  }
  const auto play = [&] {
    testing::internal::CaptureStderr();
    auto source = open_frame_source(path);
    Frame frame;
    while ((*source)->next(frame).value_or(false)) {
    }
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(play(), "");
  const std::string whole = test::read_text(path);
  test::write_text(path, whole.substr(0, whole.size() / 2));
  const std::string said = play();
  EXPECT_NE(said.find("v.avi: it ends after "), said.npos) << said;
  EXPECT_NE(said.find(" of 20 frames; copy it again\n"), said.npos) << said;
}

TEST(Source, AHugeStillIsReduced) {
  const test::Folder folder;
  cv::Mat halves = flat(6000, 4000, {0, 0, 40});
  halves.colRange(0, 3000).setTo(cv::Scalar(0, 0, 240));
  cv::imwrite(folder / "a.png", halves);
  Frame frame;
  EXPECT_EQ(said_of(folder / "a.png", frame),
            "modar-play: " + (folder / "a.png") + ": reduced from 6000x4000 to 4330x2887 pixels\n");
  ASSERT_EQ(frame.width, 4330);  // the sides keep their ratio: 12.5 million pixels at 3:2
  ASSERT_EQ(frame.height, 2887);
  EXPECT_NEAR(frame.reduced, 6000.0 / 4330, 1e-3);
  const std::uint8_t* row = &frame.rgb[std::size_t{3} * 4330 * 1000];
  EXPECT_NEAR(row[3 * 2160], 240, 1);
  EXPECT_NEAR(row[3 * 2169], 40, 1);
}

TEST(Source, AVideoGivesEachFrameAtItsTime) {
  const test::Folder folder;
  {
    cv::VideoWriter writer(folder / "v.avi", cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20,
                           cv::Size(64, 48));
    ASSERT_TRUE(writer.isOpened());
    for (int i = 0; i < 5; ++i) writer.write(flat(64, 48, {0, 0, 40.0 * i}));
  }
  auto source = open_frame_source(folder / "v.avi");
  ASSERT_TRUE(source) << to_line(source.error());
  EXPECT_EQ((*source)->info().fps, 20);
  EXPECT_EQ((*source)->info().frames, 5u);
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(*(*source)->next(frame));
    EXPECT_NEAR(frame.rgb[3 * 100], 40 * i, 6);
    EXPECT_DOUBLE_EQ(frame.time_s, i / 20.0);
  }
  EXPECT_FALSE(*(*source)->next(frame));
  (*source)->stop();
  EXPECT_FALSE(*(*source)->next(frame));
}

TEST(Source, SaysWhatIsWrongWithAnInput) {
  const test::Folder folder;
  EXPECT_EQ(open_frame_source(folder / "none.mp4").error().code, "input.open");
  EXPECT_EQ(open_frame_source(folder.path()).error().code, "input.empty");
  EXPECT_EQ(open_frame_source("camera:x").error().code, "input.camera");
  EXPECT_EQ(open_frame_source("camera:77").error().code, "input.open");
  test::write_text(folder / "text.mp4", "this is no video");
  EXPECT_EQ(open_frame_source(folder / "text.mp4").error().code, "input.damaged");
  test::write_text(folder / "torn.png", std::string("\x89PNG\r\n\x1a\n torn", 13));
  auto torn = open_frame_source(folder / "torn.png");
  ASSERT_TRUE(torn);
  Frame frame;
  EXPECT_EQ((*torn)->next(frame).error().code, "input.damaged");
}

}  // namespace
}  // namespace modar
