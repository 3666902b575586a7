#include "bake/ship/limited_process.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <stdexcept>
#include <thread>

namespace modar {
namespace {

TEST(LimitedProcess, GivesResultsInOrderWhateverHappensToTheOthers) {
  ProcessLimits limits;
  limits.seconds = 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto results = run_limited(6, 3, limits, [](std::size_t i) -> TaskResult {
    if (i == 1) std::this_thread::sleep_for(std::chrono::hours(1));  // frozen
    if (i == 2) ::raise(SIGKILL);
    if (i == 3) throw std::runtime_error("thrown");
    if (i == 4) return std::nullopt;
    return std::vector<std::byte>(100'000 * (i + 1), static_cast<std::byte>(i));
  });
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  ASSERT_EQ(results.size(), 6u);
  for (const std::size_t i : {1u, 2u, 3u, 4u}) EXPECT_FALSE(results[i]) << i;
  for (const std::size_t i : {0u, 5u}) {
    ASSERT_TRUE(results[i]);
    EXPECT_EQ(*results[i], std::vector<std::byte>(100'000 * (i + 1), static_cast<std::byte>(i)));
  }
}

TEST(LimitedProcess, HoldsTheMemoryLimit) {
#ifdef MODAR_SANITIZED
  GTEST_SKIP() << "a sanitizer needs terabytes of addresses";
#else
  ProcessLimits limits;
  limits.memory_bytes = 256u << 20;
  const auto results = run_limited(1, 1, limits, [](std::size_t) -> TaskResult {
    return std::vector<std::byte>(std::size_t{1} << 30);
  });
  EXPECT_FALSE(results[0]);
#endif
}

}  // namespace
}  // namespace modar
