// A reader sees the old file or the new one, and a failure leaves nothing behind.
#include "formats/base/atomic_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
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

TEST_F(AtomicFileTest, KeepsTheModeOfWhatItReplaces) {
  ASSERT_TRUE(modar::write_file(path(), "old"));
  fs::permissions(path(), fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(modar::write_file(path(), "new"));
  EXPECT_EQ(fs::status(path()).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(content(), "new");
}

TEST_F(AtomicFileTest, FollowsALinkAndLeavesIt) {
  fs::create_directory(folder_ / "there");
  ASSERT_TRUE(modar::write_file((folder_ / "there/real.bin").string(), "old"));
  fs::create_symlink("there/real.bin", folder_ / "link");
  fs::create_symlink("link", path());
  ASSERT_TRUE(modar::write_file(path(), "new"));
  EXPECT_TRUE(fs::is_symlink(path()));
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(content(), "new");
  EXPECT_FALSE(fs::is_symlink(folder_ / "there/real.bin"));
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  EXPECT_FALSE(modar::write_file((folder_ / "a").string(), "round and round"));
}

TEST_F(AtomicFileTest, WritesIntoAPipeAndKeepsIt) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  const int reader = ::open(path().c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  ASSERT_TRUE(modar::write_file(path(), "through"));
  char bytes[16] = {};
  EXPECT_EQ(::read(reader, bytes, sizeof bytes), 7);
  EXPECT_STREQ(bytes, "through");
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(path()));
  EXPECT_EQ(files(), 1);
  // A device of the system, as `-o /dev/null` names it.
  ASSERT_TRUE(modar::write_file("/dev/null", "gone"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(AtomicFileTest, NeverWritesIntoWhatLiesInItsTemporarysPlace) {
  ASSERT_TRUE(modar::write_file((folder_ / "victim").string(), "mine"));
  fs::create_symlink("victim", path() + "." + std::to_string(::getpid()) + ".tmp");
  ASSERT_TRUE(modar::write_file(path(), "new"));
  std::ifstream victim(folder_ / "victim");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(victim), {}), "mine");
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
