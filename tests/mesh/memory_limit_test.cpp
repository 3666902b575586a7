// Work out of core: what arrays hold, and how much of it is in the process.
#include "bake/memory/memory_limit.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "bake/memory/array.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

std::uint64_t resident() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t all = 0;
  std::uint64_t pages = 0;
  statm >> all >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::uint32_t pattern(std::size_t i) {
  return static_cast<std::uint32_t>(i * 2654435761u);
}

std::string folder() {
  return std::filesystem::temp_directory_path().string();
}

TEST(MemoryLimit, ArraysKeepTheirContentAndLeaveTheProcess) {
  Array<std::uint32_t> before(3u << 20);  // in memory, and stays good
  for (std::size_t i = 0; i < before.size(); ++i) before[i] = pattern(i);
  const std::uint64_t start = resident();
  Array<std::uint32_t> survivor;
  std::uint64_t greatest = 0;
  {
    const auto limit = MemoryLimit::start(folder(), start + (90u << 20));
    ASSERT_TRUE(limit) << to_line(limit.error());
    constexpr std::size_t kEach = 16u << 20;  // elements: 64 MiB
    Array<std::uint32_t> arrays[4];
    for (auto& array : arrays) {
      for (std::size_t i = 0; i < kEach; ++i) {
        array.push_back(pattern(i));
        if (i % (1u << 20) == 0) greatest = std::max(greatest, resident());
      }
    }
    before.resize(5u << 20);
    for (const auto& array : arrays) {
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < kEach; ++i) wrong += array[i] == pattern(i) ? 0u : 1u;
      EXPECT_EQ(wrong, 0u);
      greatest = std::max(greatest, resident());
    }
    arrays[1].resize(3u << 20);
    arrays[1].shrink();
    arrays[1].append(before.data(), 1000);
    EXPECT_EQ(arrays[1][(3u << 20) + 999], pattern(999));
    survivor = std::move(arrays[1]);
  }
  // 256 MiB were written; what the watch cannot have seen yet is let pass.
  EXPECT_LT(greatest, start + (160u << 20));
  for (std::size_t i = 0; i < (3u << 20); i += 997) {
    ASSERT_EQ(survivor[i], pattern(i));
    ASSERT_EQ(before[i], pattern(i));
  }
  survivor.resize(9u << 20);
  EXPECT_EQ(survivor[999], pattern(999));
}

TEST(Array, AppendingMakesLittleBeyondItsEndResident) {
  std::vector<std::uint32_t> part(5000);
  Array<std::uint32_t> all;
  all.reserve(kLargeBlock);  // four times as many bytes
  const auto resident_here = [&] {
    std::vector<unsigned char> pages(all.size() * 4 / 4096 + 1024);
    EXPECT_EQ(::mincore(all.data(), 4096 * pages.size(), pages.data()), 0);
    return static_cast<std::size_t>(std::count_if(
        pages.begin(), pages.end(), [](unsigned char page) { return (page & 1) != 0; }));
  };
  EXPECT_EQ(resident_here(), 0u);
  for (std::size_t k = 0; k < 300; ++k) {
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = pattern(k * part.size() + i);
    all.append(part.data(), part.size());
    const std::size_t written = (all.size() * 4 + 4095) / 4096;
    const std::size_t found = resident_here();
    ASSERT_GE(found, written) << k;
    ASSERT_LE(found, written + 64) << k;  // 256 KiB
  }
  for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i], pattern(i));
}

TEST(MemoryLimit, ModelsAreTheSame) {
  const std::string text = testing::grid(400, 3);  // arrays of several megabytes
  const auto pack_all = [&] {
    return testing::packed(testing::chunked(testing::welded(testing::parse(text)), 5000));
  };
  const PackedMesh plain = pack_all();
  const auto limit = MemoryLimit::start(folder(), MemoryLimit::kMinMemoryLimit);
  ASSERT_TRUE(limit);
  const PackedMesh out_of_core = pack_all();
  EXPECT_EQ(plain.vertices, out_of_core.vertices);
  EXPECT_EQ(plain.indices, out_of_core.indices);
}

TEST(MemoryLimit, SaysWhatIsWrong) {
  EXPECT_EQ(MemoryLimit::start(folder(), 1000).error().code, "memory.small");
  EXPECT_EQ(MemoryLimit::start("/no/such/folder", 1u << 30).error().code, "memory.folder");
}

}  // namespace
}  // namespace modar
