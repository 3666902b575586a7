// A reader sees the old file or the new one, and a failure leaves nothing behind.
#include "formats/atomic_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace {

namespace fs = std::filesystem;

class AtomicFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "modar_atomic_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path() const { return (folder_ / "out.bin").string(); }
  [[nodiscard]] std::string content() const {
    std::ifstream file(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] long files() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  fs::path folder_;
};

TEST_F(AtomicFileTest, ReplacesOnlyAtCommit) {
  ASSERT_TRUE(modar::write_file(path(), "old"));
  auto file = modar::AtomicFile::create(path());
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write(std::as_bytes(std::span("new", 3))));
  EXPECT_EQ(content(), "old");
  EXPECT_EQ(files(), 2);
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(content(), "new");
  EXPECT_EQ(files(), 1);
  EXPECT_EQ(file->commit().error().code, "io.commit");
}

TEST_F(AtomicFileTest, LeavesNothingWithoutCommit) {
  {
    auto file = modar::AtomicFile::create(path());
    ASSERT_TRUE(file);
    const modar::AtomicFile moved = std::move(*file);
    EXPECT_EQ(files(), 1);
  }
  EXPECT_EQ(files(), 0);
}

TEST_F(AtomicFileTest, TellsWhatCannotBeCreated) {
  const auto file = modar::AtomicFile::create((folder_ / "no" / "such" / "folder").string());
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, "io.create");
  EXPECT_EQ(file.error().exit, modar::ExitCode::kIo);
  EXPECT_NE(file.error().cause.find("No such file"), std::string::npos) << file.error().cause;
}

/// A limit on the size of files stands in for a full disk.
TEST_F(AtomicFileTest, KeepsTheOldFileWhenTheDiskIsFull) {
  ASSERT_TRUE(modar::write_file(path(), "old"));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto written = modar::write_file(path(), std::string(5000, 'x'));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, "io.write");
  EXPECT_EQ(content(), "old");
  EXPECT_EQ(files(), 1);
}

}  // namespace
