// MP4 files: what they state, and every length that they can be cut to.
#include "formats/mp4.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/formats/support.hpp"

namespace {

using namespace modar;
using namespace modar::test;

std::string fault_of(const Bytes& bytes) {
  Mp4Info info;
  const auto fault = view_mp4(bytes, info);
  return fault ? fault->cause : "";
}

TEST(Mp4, StatesWhatItHolds) {
  Mp4Info info;
  ASSERT_FALSE(view_mp4(small_mp4(640, 360, 12), info));
  EXPECT_EQ(info.video_tracks, 1);
  EXPECT_EQ(info.sound_tracks, 0);
  EXPECT_STREQ(info.video_codec.data(), "avc1");
  EXPECT_EQ(info.profile, kBaselineProfile);
  EXPECT_EQ(info.level, 30);
  EXPECT_EQ(info.width, 640u);
  EXPECT_EQ(info.height, 360u);
  EXPECT_EQ(info.seconds, 12.0);
  EXPECT_TRUE(info.index_first);
  ASSERT_FALSE(view_mp4(small_mp4(1, 1, 0, false, 100), info));
  EXPECT_FALSE(info.index_first);
  EXPECT_EQ(info.profile, 100);
}

TEST(Mp4, RefusesWhatIsCutOff) {
  const Bytes whole = small_mp4(640, 360, 12);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(fault_of(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))), "")
        << size;
  }
}

TEST(Mp4, RefusesBoxesThatDoNotFit) {
  Bytes bytes = small_mp4(640, 360, 12);
  bytes[0] = std::byte{0xFF};  // the size of the first box
  EXPECT_EQ(fault_of(bytes), "a box extends past the one that contains it");
  bytes = small_mp4(640, 360, 12);
  bytes[3] = std::byte{7};
  EXPECT_EQ(fault_of(bytes), "a box extends past the one that contains it");
  bytes = small_mp4(640, 360, 12);
  bytes[4] = std::byte{'x'};
  EXPECT_EQ(fault_of(bytes), "it does not begin as an MP4 file (ftyp)");
  EXPECT_EQ(fault_of({}), "there is no index (moov)");
  // A size of 64 bits, and one up to the file's end.
  const auto ends_with = [](const std::string& box) {
    Bytes all = small_mp4(640, 360, 12);
    for (const char c : box) all.push_back(static_cast<std::byte>(c));
    return fault_of(all);
  };
  using namespace std::string_literals;
  EXPECT_EQ(ends_with("\0\0\0\1free\0\0\0\0\0\0\0\x10"s), "");
  EXPECT_EQ(ends_with("\0\0\0\1free\0\0\0\0\0\0\0\x0F"s),
            "a box extends past the one that contains it");
  EXPECT_EQ(ends_with("\0\0\0\1free\0\0\0\0\0\0\0"s), "a box has no room for its size");
  EXPECT_EQ(ends_with("\0\0\0\0free12"s), "");
  // Empty boxes without end.
  bytes = Bytes(8 * 5000);
  for (std::size_t i = 0; i < bytes.size(); i += 8) {
    bytes[i + 3] = std::byte{8};
    for (std::size_t c = 0; c < 4; ++c) bytes[i + 4 + c] = static_cast<std::byte>("ftyp"[c]);
  }
  EXPECT_EQ(fault_of(bytes), "there are too many boxes");
}

}  // namespace
