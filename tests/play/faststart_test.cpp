// Moving an MP4's index to the front, on files laid out by hand after ISO 14496-12.
#include "runtime/play/faststart.hpp"

#include <gtest/gtest.h>

#include "files.hpp"

namespace modar {
namespace {

std::string big(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>((value >> (8 * i)) & 0xFF);
  return text;
}

std::string box(const std::string& type, const std::string& content) {
  return big(content.size() + 8, 4) + type + content;
}

/// moov/trak/mdia/minf/stbl/(table), the way a chunk offset table lies in a movie.
std::string index_of(const std::string& table) {
  return box("moov", box("mvhd", std::string(20, 'h')) +
                         box("trak", box("mdia", box("minf", box("stbl", table)))));
}

std::string table32(std::uint32_t a, std::uint32_t b) {
  return box("stco", big(0, 4) + big(2, 4) + big(a, 4) + big(b, 4));
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::string moved(const std::string& movie) {
  const std::vector<std::byte> index = leading_index(bytes_of(movie));
  return {reinterpret_cast<const char*>(index.data()), index.size()};
}

const std::string kType = box("ftyp", "isom0000");
const std::string kMedia = box("mdat", "0123456789");

TEST(Faststart, RaisesBothKindsOfOffsetsByTheIndexsSize) {
  const std::string index = index_of(table32(30, 34));
  const auto size = static_cast<std::uint32_t>(index.size());
  EXPECT_EQ(moved(kType + kMedia + index), index_of(table32(30 + size, 34 + size)));

  const std::string wide = index_of(box("co64", big(0, 4) + big(1, 4) + big(5'000'000'000, 8)));
  EXPECT_EQ(moved(kType + kMedia + wide),
            index_of(box("co64", big(0, 4) + big(1, 4) + big(5'000'000'000 + wide.size(), 8))));
}

TEST(Faststart, LeavesAloneWhatItDoesNotKnow) {
  const std::string index = index_of(table32(30, 34));
  EXPECT_EQ(moved(kType + index + kMedia), "") << "first already";
  EXPECT_EQ(moved(kMedia + index), "") << "no type";
  EXPECT_EQ(moved(kType + kMedia), "") << "no index";
  EXPECT_EQ(moved(kType + kMedia + index + box("free", "")), "") << "something behind it";
  EXPECT_EQ(moved(kType + kMedia + index_of(table32(30, 0xFFFFFFF0u))), "") << "overflow";
  EXPECT_EQ(moved(kType + kMedia + index_of(box("stco", big(0, 4) + big(9, 4)))), "") << "count";
  EXPECT_EQ(moved(""), "");
  std::string deep = table32(1, 2);
  for (int i = 0; i < 50; ++i) deep = box("trak", deep);
  EXPECT_EQ(moved(kType + kMedia + box("moov", deep)), "") << "too deep";
}

TEST(Faststart, AnyTruncationIsRefusedAndNothingIsReadOutside) {
  const std::string movie = kType + kMedia + index_of(table32(30, 34));
  for (std::size_t size = 0; size < movie.size(); ++size) {
    EXPECT_EQ(moved(std::string(movie.data(), size)), "") << size;
  }
}

TEST(Faststart, WritesTheWholeFileWithTheIndexInFront) {
  const test::Folder folder;
  const std::string index = index_of(table32(30, 34));
  test::write_text(folder / "a.mp4", kType + kMedia + index);
  ASSERT_TRUE(write_faststart(folder / "a.mp4", folder / "b.mp4"));
  EXPECT_EQ(test::read_text(folder / "b.mp4"), kType + moved(kType + kMedia + index) + kMedia);
  test::write_text(folder / "c.mp4", kMedia);
  ASSERT_TRUE(write_faststart(folder / "c.mp4", folder / "d.mp4"));
  EXPECT_EQ(test::read_text(folder / "d.mp4"), kMedia);
}

}  // namespace
}  // namespace modar
