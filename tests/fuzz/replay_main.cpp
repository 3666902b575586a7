// Replaces libFuzzer where it is not linked: runs a target over files, and over copies of them
// that are damaged in a repeatable way.
//   fuzz_replay NAME COPIES[:SOAK] FILE|FOLDER...
// SOAK: copies of each file under `scripts/test.sh --soak`.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "tests/soak.hpp"

using Target = int(const std::uint8_t* data, std::size_t size);
/// The LLVMFuzzerTestOneInput() of NAME.cpp, or null; CMakeLists.txt writes it.
Target* fuzz_target(std::string_view name);

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

/// Great seeds would take the time that many small ones need.
constexpr std::uintmax_t kMaxBytes = 256u << 10;

std::vector<fs::path> files_of(int count, char** arguments) {
  std::vector<fs::path> files;
  for (int i = 3; i < count; ++i) {
    if (!fs::is_directory(arguments[i])) {
      files.emplace_back(arguments[i]);
      continue;
    }
    for (const auto& entry : fs::directory_iterator(arguments[i])) {
      if (entry.is_regular_file() && entry.file_size() <= kMaxBytes) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Flips, overwrites, cuts, repeats and moves bytes, a few at a time.
Bytes damaged(Bytes bytes, std::mt19937_64& random) {
  const auto draw = [&random](std::size_t below) {
    return static_cast<std::ptrdiff_t>(random() % std::max<std::size_t>(below, 1));
  };
  for (std::size_t edits = 1 + random() % 4; edits > 0 && !bytes.empty(); --edits) {
    const auto at = bytes.begin() + draw(bytes.size());
    const auto end =
        at + draw(std::min<std::size_t>(64, static_cast<std::size_t>(bytes.end() - at)));
    switch (random() % 6) {
      case 0:
        *at = static_cast<std::uint8_t>(*at ^ (1u << (random() % 8)));
        break;
      case 1:
        *at = static_cast<std::uint8_t>(random());
        break;
      case 2:
        bytes.erase(at, end);
        break;
      case 3: {
        const Bytes part(at, end);
        bytes.insert(bytes.begin() + draw(bytes.size()), part.begin(), part.end());
        break;
      }
      case 4:
        std::fill(at, end, static_cast<std::uint8_t>(random() % 2 == 0 ? 0xFF : 0));
        break;
      default:
        bytes.resize(static_cast<std::size_t>(draw(bytes.size())));
    }
  }
  return bytes;
}

void run(Target& target, const Bytes& bytes) {
  // A copy of exactly that size, so that the sanitizer sees the first byte beyond.
  const Bytes exact(bytes.begin(), bytes.end());
  target(exact.data(), exact.size());
}

}  // namespace

int main(int count, char** arguments) {
  Target* target = count < 4 ? nullptr : fuzz_target(arguments[1]);
  if (target == nullptr) {
    std::fprintf(stderr, "usage: %s NAME COPIES[:SOAK] FILE|FOLDER...\n", arguments[0]);
    return 1;
  }
  char* end = nullptr;
  unsigned long copies = std::strtoul(arguments[2], &end, 10);
  if (*end == ':' && modar::testing::soak()) {
    copies = std::strtoul(end + 1, nullptr, 10);
  }
  const std::vector<fs::path> files = files_of(count, arguments);
  std::mt19937_64 random(1);
  for (const fs::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    const Bytes bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    run(*target, bytes);
    for (unsigned long i = 0; i < copies; ++i) run(*target, damaged(bytes, random));
  }
  std::printf("%zu files and %lu damaged copies of each\n", files.size(), copies);
  return files.empty() ? 2 : 0;
}
