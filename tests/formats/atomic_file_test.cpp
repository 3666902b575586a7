// A reader sees the old file or the new one, and a failure leaves nothing behind.
#include "formats/base/atomic_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "formats/base/folder_lock.hpp"

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

TEST_F(AtomicFileTest, SignalsLeaveNothing) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const pid_t child = fork();
    if (child == 0) {
      modar::remove_leftovers_at_signals();
      fs::create_directory(folder_ / "made");
      const modar::Leftover folder((folder_ / "made").string());
      auto file = modar::AtomicFile::create((folder_ / "made" / "file").string());
      auto done = modar::AtomicFile::create(path());
      if (!file || !done || !done->commit()) _exit(1);
      raise(signal);
      _exit(2);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << status;
    EXPECT_EQ(files(), 1) << "a committed file stays";
  }
}

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

/// A limit on the size of files imitates a full disk.
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
  EXPECT_NE(written.error().cure.find("files of this size"), std::string::npos);
  EXPECT_EQ(content(), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(AtomicFileTest, NamesTheDiskThatDoesNotTakeTheName) {
  const auto written = modar::write_file((folder_ / std::string(300, 'x')).string(), "new");
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().cure.find("rename the file"), std::string::npos);
}

/// From now on flock() fails in this process, as on a network share without locks.
bool take_locks_away() {
  std::array<sock_filter, 4> program = {
      sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_flock, 0, 1),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOLCK),
      sock_filter BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
  const sock_fprog whole = {program.size(), program.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &whole) == 0;
}

TEST_F(AtomicFileTest, LocksAFolderOnceWhereTheFileSystemHasLocks) {
  const modar::Error busy{modar::ExitCode::kIo, "busy", "", "", ""};
  {
    const auto first = modar::FolderLock::take(path(), busy);
    ASSERT_TRUE(first);
    const auto second = modar::FolderLock::take(path(), busy);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, "busy");
  }
  const pid_t child = ::fork();
  if (child == 0) ::_exit(!take_locks_away() ? 2 : modar::FolderLock::take(path(), busy) ? 0 : 1);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "seccomp is not allowed here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
