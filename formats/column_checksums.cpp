// Sums of 16-bit words, eight and more lanes at a time.
#include "formats/column_checksums.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace modar {
namespace {

using Words [[gnu::vector_size(16)]] = std::uint16_t;
using Sums [[gnu::vector_size(32)]] = std::uint32_t;
constexpr std::size_t kLanes = 8;
constexpr std::size_t kMaxVectors = 4;
/// Rows whose words surely add up to less than 2^32.
constexpr std::size_t kRowsBetweenCarries = 65535;

std::uint64_t word_at(const std::byte* place) {
  std::uint16_t word;
  std::memcpy(&word, place, sizeof word);
  return word;
}

/// Sums of whole vectors from each row on; lanes beyond the row are for nobody. Answers the rows
/// that were read: the last ones, whose vectors would leave the bytes, are not.
template <std::size_t kVectors>
std::size_t sum_rows(std::span<const std::byte> bytes, std::size_t stride,
                     std::span<std::uint64_t> sums) {
  const std::size_t reach = kVectors * sizeof(Words);
  const std::size_t rows = bytes.size() < reach ? 0 : (bytes.size() - reach) / stride + 1;
  for (std::size_t first = 0; first < rows; first += kRowsBetweenCarries) {
    const std::size_t end = std::min(rows, first + kRowsBetweenCarries);
    std::array<Sums, kVectors> part{};
    for (std::size_t row = first; row < end; ++row) {
      const std::byte* at = bytes.data() + row * stride;
      for (std::size_t v = 0; v < kVectors; ++v) {
        Words words;
        std::memcpy(&words, at + v * sizeof words, sizeof words);
        part[v] += __builtin_convertvector(words, Sums);
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += part[i / kLanes][i % kLanes];
  }
  return rows;
}

}  // namespace

void add_column_checksums(std::span<const std::byte> bytes, std::span<std::uint64_t> sums) {
  const std::size_t stride = 2 * sums.size();
  std::size_t row = 0;
  if (sums.size() <= kLanes) {
    row = sum_rows<1>(bytes, stride, sums);
  } else if (sums.size() <= 2 * kLanes) {
    row = sum_rows<2>(bytes, stride, sums);
  } else if (sums.size() <= kMaxVectors * kLanes) {
    row = sum_rows<kMaxVectors>(bytes, stride, sums);
  }
  for (std::size_t at = row * stride; at < bytes.size(); at += stride) {
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += word_at(bytes.data() + at + 2 * i);
  }
}

void add_array_sums(std::span<const std::byte> bytes, std::span<std::uint64_t> sums) {
  const std::size_t whole = bytes.size() / sizeof(Words) * sizeof(Words);
  std::array<std::uint64_t, kLanes> lanes{};
  add_column_checksums(bytes.first(whole), lanes);
  for (std::size_t i = 0; i < kLanes; ++i) sums[i % sums.size()] += lanes[i];
  for (std::size_t at = whole; at < bytes.size(); at += 2) {
    sums[(at - whole) / 2 % sums.size()] += word_at(bytes.data() + at);
  }
}

}  // namespace modar
