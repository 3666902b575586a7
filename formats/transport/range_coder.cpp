#include "formats/transport/range_coder.hpp"

#include <algorithm>

namespace modar {

bool RangeCoder::code(bool decision, std::uint32_t probability) {
  const auto part = (std::uint64_t{high_ - low_} * probability) >> 16;
  const std::uint32_t middle = low_ + static_cast<std::uint32_t>(part);
  if (decodes_) decision = value_ <= middle;
  (decision ? high_ : low_) = decision ? middle : middle + 1;
  while (((low_ ^ high_) & 0xFF000000u) == 0) {
    if (decodes_) {
      value_ = value_ << 8 | next_byte();
    } else {
      out_.push_back(static_cast<std::byte>(high_ >> 24));
    }
    low_ <<= 8;
    high_ = high_ << 8 | 0xFF;
  }
  return decision;
}

bool RangeCoder::code(bool decision, AdaptiveBit& bit) {
  constexpr std::uint32_t kLeast = 48;  // of 65536
  const std::uint32_t mean = (std::uint32_t{bit.fast} + bit.slow) / 2;
  decision = code(decision, std::clamp(mean, kLeast, 65536 - kLeast));
  const int target = decision ? 65535 : 0;
  const int divisor = bit.count + 2;  // the first decisions say most
  bit.fast = static_cast<std::uint16_t>(bit.fast + (target - bit.fast) / std::min(divisor, 16));
  bit.slow = static_cast<std::uint16_t>(bit.slow + (target - bit.slow) / divisor);
  if (bit.count < 126) ++bit.count;
  return decision;
}

std::uint32_t RangeCoder::code_bits(std::uint32_t value, int count) {
  std::uint32_t coded = 0;
  for (int i = count; i-- > 0;) {
    coded |= (code((value >> i & 1) != 0, 32768) ? 1u : 0u) << i;
  }
  return coded;
}

}  // namespace modar
