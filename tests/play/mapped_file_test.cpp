// Files that other programs change while they are mapped, and whose SIGBUS is whose.
#include "modar/mapped_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

class MappedFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "modar_mapped_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    std::ofstream(path()) << std::string(kPages * page_, 'a');
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path() const { return (folder_ / "in.bin").string(); }
  char at(const MappedFile& file, std::size_t page) const {
    return static_cast<const volatile char*>(
        static_cast<const void*>(file.bytes().data()))[page * page_];
  }

  static constexpr std::size_t kPages = 8;
  std::size_t page_ = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  fs::path folder_;
};

/// A page behind the end of a file that is no MappedFile.
char read_foreign_page(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY);
  void* const bytes = ::mmap(nullptr, 1 << 16, PROT_READ, MAP_PRIVATE, file, 0);
  return static_cast<volatile char*>(bytes)[(1 << 16) - 1];
}

void exit_with_7(int) {
  std::_Exit(7);
}

TEST_F(MappedFileTest, AnAppKeepsItsOwnSignals) {
  auto file = MappedFile::open(path());
  ASSERT_TRUE(file);
  fs::resize_file(path(), page_);
  const auto unguarded = [&] {
    std::signal(SIGBUS, SIG_DFL);  // AddressSanitizer has its own
    at(*file, 3);
  };
  EXPECT_EXIT(unguarded(), ::testing::KilledBySignal(SIGBUS), "");
  const auto guarded = [&](void (*own)(int)) {
    std::signal(SIGBUS, own);
    guard_mapped_files();
    std::_Exit(at(*file, 3) == 0 ? read_foreign_page(path()) : 1);
  };
  EXPECT_EXIT(guarded(exit_with_7), ::testing::ExitedWithCode(7), "");
  EXPECT_EXIT(guarded(SIG_DFL), ::testing::KilledBySignal(SIGBUS), "");
}

TEST_F(MappedFileTest, LostPagesAreZerosAndAnError) {
  guard_mapped_files();
  auto opened = MappedFile::open(path());
  ASSERT_TRUE(opened);
  auto other = MappedFile::open(path());
  auto file = std::make_unique<MappedFile>(std::move(*opened));
  EXPECT_TRUE(file->intact());
  ASSERT_EQ(::truncate(path().c_str(), static_cast<off_t>(2 * page_)), 0);
  EXPECT_EQ(at(*file, 1), 'a');
  EXPECT_EQ(at(*file, 5), 0);
  EXPECT_EQ(at(*file, 3), 0);
  EXPECT_EQ(at(*file, 1), 'a');
  // The file's time may be set back: lost pages stay lost.
  fs::remove(path());
  EXPECT_TRUE(other->intact());
  EXPECT_EQ(file->intact().error().code, "io.changed");
  EXPECT_EQ(file->settle(Result<int>(3)).error().exit, ExitCode::kIo);

  const std::string out = (folder_ / "out.bin").string();
  EXPECT_EQ(write_file(out, std::string_view("made of zeros")).error().code, "io.changed");
  EXPECT_FALSE(fs::exists(out));
  file.reset();
  EXPECT_TRUE(write_file(out, std::string_view("made of something else")));
}

TEST_F(MappedFileTest, TellsWritingFromRenaming) {
  auto file = MappedFile::open(path());
  ASSERT_TRUE(file);
  std::ofstream(folder_ / "new.bin") << "another";
  fs::rename(folder_ / "new.bin", path());
  EXPECT_TRUE(file->intact());
  auto second = MappedFile::open(path());
  ::usleep(20'000);  // a tick of the file system's clock
  std::ofstream(path(), std::ios::in) << "written";
  EXPECT_EQ(second->intact().error().where, path());
  EXPECT_TRUE(file->intact());
}

}  // namespace
}  // namespace modar
