// Files of a gyroscope's turns.
#include "runtime/play/gyroscope.hpp"

#include "tests/play/files.hpp"

namespace modar {
namespace {

TEST(Gyroscope, ReadsThreeNumbersALine) {
  const test::Folder folder;
  std::ofstream(folder / "turns.txt") << "# a phone\n0 0 0\n\n-0.5, 0.25\t1.5 # a turn\r\n.5 -2 0";
  const auto turns = read_gyroscope(folder / "turns.txt");
  ASSERT_TRUE(turns);
  ASSERT_EQ(turns->size(), 3u);
  EXPECT_EQ((*turns)[0], glm::dvec3(0, 0, 0));
  EXPECT_EQ((*turns)[1], glm::dvec3(-0.5, 0.25, 1.5));
  EXPECT_EQ((*turns)[2], glm::dvec3(0.5, -2, 0));
}

TEST(Gyroscope, NamesTheLineThatItCannotRead) {
  const test::Folder folder;
  for (const char* line : {"1 2", "1 2 3 4", "1 2 x", "1 2 --3", "1e-3 0 0", "nan 0 0"}) {
    std::ofstream(folder / "turns.txt") << "0 0 0\n" << line << "\n";
    const auto turns = read_gyroscope(folder / "turns.txt");
    ASSERT_FALSE(turns) << line;
    EXPECT_EQ(turns.error().code, "gyro.line");
    EXPECT_EQ(turns.error().where, (folder / "turns.txt") + ":2");
  }
  EXPECT_EQ(read_gyroscope(folder / "none.txt").error().exit, ExitCode::kIo);
}

}  // namespace
}  // namespace modar
