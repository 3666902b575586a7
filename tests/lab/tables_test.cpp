// What benches of modar-lab compute besides what they print.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/extensions/lab/etc1_bench.hpp"
#include "bake/extensions/lab/score_bench.hpp"
#include "bake/image/image.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

TEST(ScoreBench, RankCorrelation) {
  EXPECT_NEAR(rank_correlation({106, 100, 86, 101, 99, 103, 97, 113, 112, 110},
                               {7, 27, 2, 50, 28, 29, 20, 12, 6, 17}),
              -29.0 / 165.0, 1e-12);
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 2, 3}, {10, 20, 20, 30}), 1.0);
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 3}, {5, 5, 5}), 0.0);
}

TEST(Etc1Bench, HasItsSixRows) {
  const test::ScratchFolder folder;
  ASSERT_TRUE(write_png(test::synthetic_photo(40, 36), folder.file("photo.png")));
  const auto rows = bench_etc1({folder.file("photo.png")}, 32);
  ASSERT_TRUE(rows) << to_line(rows.error());
  const std::vector<std::string> names = {"fast_db",     "fast_mpix_s", "good_db",
                                          "good_mpix_s", "best_db",     "best_mpix_s"};
  ASSERT_EQ(rows->size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ((*rows)[i].measure, names[i]);
    EXPECT_GT((*rows)[i].ours, 0);
  }
  EXPECT_GT((*rows)[2].ours, (*rows)[0].ours);
  EXPECT_EQ(bench_etc1({}, 0).error().exit, ExitCode::kUsage);
  EXPECT_EQ(bench_etc1({folder.file("photo.png")}, 30).error().code, "bench.crop");
}

}  // namespace
}  // namespace modar
