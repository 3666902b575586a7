// Binary arithmetic coding: decisions by their probabilities. Integers only: the same bytes on
// every processor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace modar {

/// Probability of a decision, of 65536, adapted by each decision: at a fast and a slow rate.
struct AdaptiveBit {
  std::uint16_t fast = 32768;
  std::uint16_t slow = 32768;
  std::uint16_t count = 0;  ///< of decisions, up to 126
};

/// Encodes decisions, or decodes them: a model that calls code() in the same order serves both
/// ways.
class RangeCoder {
 public:
  /// An encoder.
  RangeCoder() = default;
  /// A decoder of those bytes, which must outlive it.
  explicit RangeCoder(std::span<const std::byte> coded) : decodes_(true), coded_(coded) {
    for (int i = 0; i < 4; ++i) value_ = value_ << 8 | next_byte();
  }

  /// Encodes the decision and answers it, or answers the decoded one. probability: that it holds,
  /// 1 to 65535, of 65536.
  bool code(bool decision, std::uint32_t probability);
  /// The same by a probability that learns.
  bool code(bool decision, AdaptiveBit& bit);
  /// `count` equally likely bits, at most 31.
  std::uint32_t code_bits(std::uint32_t value, int count);
  /// Coded bytes that decisions so far depend on.
  [[nodiscard]] std::size_t read() const { return read_; }
  /// More was decoded than the bytes hold.
  [[nodiscard]] bool overrun() const { return read_ > coded_.size(); }
  /// All bytes were decoded, as after the last decision that finish() knew of.
  [[nodiscard]] bool used_up() const { return read_ == coded_.size(); }
  /// The encoded bytes; nothing may be coded after.
  std::vector<std::byte> finish() {
    for (int i = 0; i < 4; ++i, low_ <<= 8) out_.push_back(static_cast<std::byte>(low_ >> 24));
    return std::move(out_);
  }

 private:
  std::uint32_t next_byte() {
    const std::size_t at = read_++;
    return at < coded_.size() ? std::to_integer<std::uint32_t>(coded_[at]) : 0;
  }

  bool decodes_ = false;
  std::span<const std::byte> coded_;
  std::size_t read_ = 0;
  std::vector<std::byte> out_;
  std::uint32_t low_ = 0;
  std::uint32_t high_ = 0xFFFFFFFFu;
  std::uint32_t value_ = 0;
};

}  // namespace modar
