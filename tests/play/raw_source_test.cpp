// Raw frames from files and pipes; colours against OpenCV's conversion and against the definition.
#include "runtime/play/raw_source.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <opencv2/imgproc.hpp>
#include <thread>

#include "files.hpp"

namespace modar {
namespace {

/// Values from 16 to 235: outside, video has no meaning and converters differ.
std::string video_bytes(std::size_t count, unsigned seed) {
  std::string bytes(count, '\0');
  for (char& byte : bytes) {
    seed = seed * 1664525u + 1013904223u;
    byte = static_cast<char>(16 + (seed >> 24) % 220);
  }
  return bytes;
}

std::span<const std::uint8_t> view(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

TEST(Yuv, VideoRangeFramesAreWhatOpenCvMakesOfThem) {
  constexpr int kW = 16;
  constexpr int kH = 12;
  const std::pair<YuvLayout, int> layouts[] = {{YuvLayout::kNv21, cv::COLOR_YUV2RGB_NV21},
                                               {YuvLayout::kNv12, cv::COLOR_YUV2RGB_NV12},
                                               {YuvLayout::kI420, cv::COLOR_YUV2RGB_I420},
                                               {YuvLayout::kYuyv, cv::COLOR_YUV2RGB_YUYV}};
  for (const auto& [layout, code] : layouts) {
    const YuvFormat format{layout, kW, kH, false};
    std::string bytes = video_bytes(frame_bytes(format), 7);
    Frame frame;
    fill_frame(frame, format, view(bytes));
    const bool packed = layout == YuvLayout::kYuyv;
    const cv::Mat raw(packed ? kH : kH * 3 / 2, kW, packed ? CV_8UC2 : CV_8UC1, bytes.data());
    cv::Mat rgb;
    cv::cvtColor(raw, rgb, code);
    for (std::size_t i = 0; i < frame.rgb.size(); ++i) {
      ASSERT_NEAR(frame.rgb[i], rgb.data[i], 2) << "layout " << static_cast<int>(layout);
    }
  }
}

TEST(Yuv, WhatTheGpuDrawsIsHandedOnUntouched) {
  const std::pair<YuvLayout, PictureFormat> layouts[] = {{YuvLayout::kNv21, PictureFormat::kNv21},
                                                         {YuvLayout::kNv12, PictureFormat::kNv12},
                                                         {YuvLayout::kI420, PictureFormat::kI420}};
  for (const auto& [layout, drawn] : layouts) {
    for (const bool full : {true, false}) {
      const YuvFormat format{layout, 16, 12, full};
      const std::string text = video_bytes(frame_bytes(format), 7);
      std::vector<std::uint8_t> bytes(text.begin(), text.end());
      const std::uint8_t* const at = bytes.data();
      Frame frame;
      frame.rgb.assign(5, 1);  // of an earlier frame
      frame.gray.assign(5, 1);
      take_frame(frame, format, bytes);
      EXPECT_EQ(frame.yuv.data(), at) << "the planes are not copied";
      const CameraPicture picture = frame.picture();
      EXPECT_EQ(picture.format, drawn);
      EXPECT_EQ(picture.full_range, full);
      EXPECT_EQ(picture.planes[0], at);
      EXPECT_EQ(picture.planes[1], at + 16 * 12);
      EXPECT_EQ(picture.strides[1], drawn == PictureFormat::kI420 ? 8 : 16);
      if (drawn == PictureFormat::kI420) {
        EXPECT_EQ(picture.planes[2], at + 16 * 12 + 8 * 6);
      }
      EXPECT_EQ(frame.gray_image().pixels == at, full) << "full-range luma is the gray";
      Frame converted;
      fill_frame(converted, format, view(text));
      for (std::size_t i = 0; i < converted.gray.size(); ++i) {
        ASSERT_EQ(frame.gray_image().pixels[i], converted.gray[i]);
      }
      make_rgb(frame);
      EXPECT_EQ(frame.rgb, converted.rgb);
    }
  }
}

TEST(Yuv, OddSidesAndOtherLayoutsAreConverted) {
  for (const YuvFormat& format :
       {YuvFormat{YuvLayout::kNv21, 15, 12, true}, YuvFormat{YuvLayout::kYuyv, 16, 12, false}}) {
    const std::string text = video_bytes(frame_bytes(format), 7);
    std::vector<std::uint8_t> bytes(text.begin(), text.end());
    Frame frame;
    take_frame(frame, format, bytes);
    EXPECT_EQ(frame.picture().format, PictureFormat::kRgb);
    EXPECT_EQ(frame.picture().planes[0], frame.rgb.data());
    EXPECT_EQ(frame.gray_image().pixels, frame.gray.data());
    EXPECT_EQ(frame.rgb.size(), 3u * static_cast<unsigned>(format.width * format.height));
  }
}

TEST(Yuv, FullRangeFollowsTheDefinitionOfJpeg) {
  // JFIF: R = Y + 1.402 (Cr - 128), G = Y - 0.344136 (Cb - 128) - 0.714136 (Cr - 128), ...
  const std::uint8_t y = 120;
  const std::uint8_t u = 90;
  const std::uint8_t v = 160;
  const YuvFormat format{YuvLayout::kI444, 1, 1, true};
  Frame frame;
  const std::uint8_t bytes[] = {y, u, v};
  fill_frame(frame, format, bytes);
  EXPECT_NEAR(frame.rgb[0], 120 + 1.402 * 32, 0.51);
  EXPECT_NEAR(frame.rgb[1], 120 + 0.344136 * 38 - 0.714136 * 32, 0.51);
  EXPECT_NEAR(frame.rgb[2], 120 - 1.772 * 38, 0.51);
  EXPECT_EQ(frame.gray[0], 120);
}

TEST(Yuv, GrayIsBroughtToTheFullRange) {
  const YuvFormat format{YuvLayout::kGray, 3, 1, false};
  Frame frame;
  const std::uint8_t bytes[] = {16, 235, 5};
  fill_frame(frame, format, bytes);
  EXPECT_EQ(frame.gray, (std::vector<std::uint8_t>{0, 255, 0}));
  EXPECT_EQ(frame.rgb[3], 255);
}

TEST(Yuv, OddSidesReadNothingOutside) {
  for (const YuvLayout layout : {YuvLayout::kI420, YuvLayout::kNv12, YuvLayout::kNv21,
                                 YuvLayout::kI422, YuvLayout::kYuyv, YuvLayout::kI444}) {
    for (int w = 1; w <= 5; ++w) {
      for (int h = 1; h <= 5; ++h) {
        const YuvFormat format{layout, w, h, true};
        const std::vector<std::uint8_t> exact(frame_bytes(format), 128);
        Frame frame;
        fill_frame(frame, format, exact);
        for (const std::uint8_t value : frame.rgb) ASSERT_EQ(value, 128);
      }
    }
  }
}

TEST(Yuv, GrayOfRgbHasTheWeightsOfBt601) {
  Frame frame;
  frame.rgb = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 10, 20, 30};
  gray_from_rgb(frame);
  EXPECT_EQ(frame.gray, (std::vector<std::uint8_t>{76, 150, 29, 255, 18}));
}

TEST(RawSource, KnowsItsInputs) {
  for (const char* input : {"-", "a.y4m", "y4m:b", "nv21:2x2:a", "grey:8x8@10:-"}) {
    EXPECT_TRUE(is_raw_input(input)) << input;
  }
  for (const char* input : {"a.mp4", "folder", "camera:1", "c:\\x", "rgb:2x2:a"}) {
    EXPECT_FALSE(is_raw_input(input)) << input;
  }
  const auto raw = parse_raw_input("nv21:640x480@25:/a:b.raw");
  ASSERT_TRUE(raw);
  EXPECT_EQ(raw->format.width, 640);
  EXPECT_EQ(raw->format.height, 480);
  EXPECT_EQ(raw->fps, 25);
  EXPECT_EQ(raw->path, "/a:b.raw");
  EXPECT_EQ(parse_raw_input("i420:8x4:-")->fps, 30);
  for (const char* bad : {"nv21:", "nv21:640:f", "nv21:0x4:f", "nv21:9000x4:f", "nv21:4x4@0:f",
                          "nv21:4x4:", "nv21:4x4", "nv21:ax4:f", "nv21:4x4@:f", "nv21:4@3x4:f"}) {
    EXPECT_FALSE(parse_raw_input(bad)) << bad;
  }
}

TEST(RawSource, ReadsHeadersOfY4m) {
  const auto raw = parse_y4m_header("YUV4MPEG2 W640 H480 F30000:1001 Ip A1:1 C420jpeg XYSCSS=420");
  ASSERT_TRUE(raw) << to_line(raw.error());
  EXPECT_EQ(raw->format.width, 640);
  EXPECT_NEAR(raw->fps, 29.97003, 1e-5);
  EXPECT_EQ(parse_y4m_header("YUV4MPEG2 W4 H4 Cmono")->format.layout, YuvLayout::kGray);
  EXPECT_TRUE(parse_y4m_header("YUV4MPEG2 W4 H4 XCOLORRANGE=FULL")->format.full_range);
  EXPECT_EQ(parse_y4m_header("YUV4MPEG2 W4 H4 C420p10").error().exit, ExitCode::kUnsupported);
  for (const char* bad : {"", "RIFF", "YUV4MPEG2", "YUV4MPEG2 W0 H4", "YUV4MPEG2 W4 H99999",
                          "YUV4MPEG2 Wx H4", "YUV4MPEG2 W4 H4 F0:3", "YUV4MPEG2 W4 H4 F1:0"}) {
    EXPECT_FALSE(parse_y4m_header(bad)) << bad;
  }
}

const std::string kHead = "YUV4MPEG2 W4 H2 F10:1 Cmono\n";

TEST(RawSource, PlaysAFileOfY4m) {
  const test::Folder folder;
  test::write_text(folder / "a.y4m",
                   kHead + "FRAME\n" + std::string(8, 16) + "FRAME Ip\n" + std::string(8, 100));
  auto source = open_raw_source(folder / "a.y4m");
  ASSERT_TRUE(source) << to_line(source.error());
  EXPECT_EQ((*source)->info().fps, 10);
  EXPECT_EQ((*source)->info().frames, 2u);
  Frame frame;
  ASSERT_TRUE(*(*source)->next(frame));
  EXPECT_EQ(frame.gray[0], 0);
  ASSERT_TRUE(*(*source)->next(frame));
  EXPECT_EQ(frame.index, 1u);
  EXPECT_DOUBLE_EQ(frame.time_s, 0.1);
  EXPECT_FALSE(*(*source)->next(frame));
}

TEST(RawSource, SaysWhereAFileBreaksOff) {
  const test::Folder folder;
  const std::string whole = kHead + "FRAME\n" + std::string(8, 16);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    test::write_text(folder / "a.y4m", whole.substr(0, size));
    auto source = open_raw_source(folder / "a.y4m");
    Frame frame;
    if (size < kHead.size()) {
      EXPECT_FALSE(source) << size;
    } else if (size > kHead.size()) {
      EXPECT_FALSE((*source)->next(frame)) << size;
    } else {
      EXPECT_FALSE(*(*source)->next(frame));
    }
  }
  test::write_text(folder / "b.y4m", kHead + "FRAMX\n" + std::string(8, 16));
  Frame frame;
  EXPECT_EQ((*open_raw_source(folder / "b.y4m"))->next(frame).error().code, "input.y4m");
  test::write_text(folder / "c.raw", std::string(7, 1));
  EXPECT_EQ((*open_raw_source("grey:4x2:" + (folder / "c.raw")))->next(frame).error().code,
            "input.truncated");
  EXPECT_EQ(open_raw_source("grey:4x2:" + (folder / "none")).error().code, "input.open");
}

TEST(RawSource, APipeIsReadAsItComesAndStopEndsTheWait) {
  const test::Folder folder;
  const std::string path = folder / "pipe";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  std::thread writer([&path] {
    std::ofstream pipe(path, std::ios::binary);
    pipe << std::string(5, 16) << std::flush;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    pipe << std::string(3, 16) << std::flush;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // the pipe stays open
  });
  auto source = open_raw_source("grey:4x2:" + path);
  ASSERT_TRUE(source);
  Frame frame;
  ASSERT_TRUE(*(*source)->next(frame));
  std::thread stopper([&source] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    (*source)->stop();
  });
  const auto more = (*source)->next(frame);
  ASSERT_TRUE(more);
  EXPECT_FALSE(*more);
  EXPECT_FALSE(*(*source)->next(frame));
  stopper.join();
  writer.join();
}

}  // namespace
}  // namespace modar
