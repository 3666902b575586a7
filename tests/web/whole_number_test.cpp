#include "runtime/extensions/web/whole_number.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace modar {
namespace {

TEST(WholeNumbers, AreThoseThatDoublesHaveExactly) {
  EXPECT_EQ(whole_number(0), std::uint64_t{0});
  EXPECT_EQ(whole_number(7.9), std::uint64_t{7});
  EXPECT_EQ(whole_number(9007199254740991.0), (std::uint64_t{1} << 53) - 1);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double wrong : {9007199254740992.0, 1e300, infinity, -infinity, -1.0, -0.5,
                             std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(whole_number(wrong)) << wrong;
  }
  EXPECT_EQ(whole_number(4294967295.0, 4294967295.0), std::uint64_t{4294967295});
  EXPECT_FALSE(whole_number(4294967296.0, 4294967295.0));
}

}  // namespace
}  // namespace modar
