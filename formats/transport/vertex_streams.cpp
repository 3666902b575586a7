#include "formats/transport/vertex_streams.hpp"

#include <algorithm>
#include <cstring>

#include "formats/base/bits.hpp"

namespace modar {
namespace {

constexpr int kFineBits = 13;
constexpr std::int64_t kUnit = std::int64_t{1} << 24;  // 1.0 in steps of the smallest half

/// Largest integer whose square is at most n.
std::uint64_t square_root(std::uint64_t n) {
  std::uint64_t root = 0;
  for (std::uint64_t bit = std::uint64_t{1} << 31; bit != 0; bit >>= 1) {
    const std::uint64_t next = root | bit;
    if (next * next <= n) root = next;
  }
  return root;
}

std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  return a / b - (a % b != 0 && (a < 0) != (b < 0) ? 1 : 0);
}

}  // namespace

std::optional<HalfParts> split_half(std::uint16_t half) {
  if (half == 0x8000u) return std::nullopt;
  const int exponent = half >> 10 & 31;
  const std::int64_t mantissa = half & 1023;
  if (exponent > 15) return std::nullopt;
  const std::int64_t magnitude = exponent == 0 ? mantissa : (mantissa + 1024) << (exponent - 1);
  if (magnitude > kUnit) return std::nullopt;
  const std::int64_t value = (half & 0x8000u) != 0 ? -magnitude : magnitude;
  HalfParts parts;
  parts.coarse = static_cast<std::int32_t>(value >> kFineBits);
  parts.fine = static_cast<std::uint32_t>(value & ((1 << kFineBits) - 1));
  return parts;
}

std::uint16_t join_half(HalfParts parts) {
  const std::int64_t value =
      (std::int64_t{parts.coarse} << kFineBits) + static_cast<std::int64_t>(parts.fine);
  const auto magnitude = static_cast<std::uint32_t>(value < 0 ? -value : value);
  const std::uint32_t sign = value < 0 ? 0x8000u : 0u;
  if (magnitude < 1024) return static_cast<std::uint16_t>(sign | magnitude);
  const int exponent = bit_width(magnitude) - 11;  // at least 0: the implied bit is bit 10
  return static_cast<std::uint16_t>(sign | static_cast<std::uint32_t>(exponent + 1) << 10 |
                                    (magnitude >> exponent & 1023u));
}

int fine_bits(std::int32_t coarse) {
  const std::int32_t least = coarse >= 0 ? coarse : -coarse - 1;
  if (least == 0) return kFineBits;
  return std::max(0, 11 - bit_width(static_cast<std::uint32_t>(least)));
}

std::array<std::int32_t, 3> octahedral_direction(std::int32_t s, std::int32_t t, int bits) {
  const std::int32_t centre = (1 << (bits - 1)) - 1;
  std::int32_t y = s - centre;
  std::int32_t z = t - centre;
  const std::int32_t x = centre - std::abs(y) - std::abs(z);
  if (x < 0) {
    const std::int32_t folded = centre - std::abs(z);
    z = z < 0 ? -(centre - std::abs(y)) : centre - std::abs(y);
    y = y < 0 ? -folded : folded;
  }
  return {x, y, z};
}

std::array<std::int8_t, 3> snorm8_of_direction(const std::array<std::int32_t, 3>& direction) {
  std::uint64_t squares = 0;
  for (const std::int64_t d : direction) squares += static_cast<std::uint64_t>(d * d);
  const auto length = static_cast<std::int64_t>(square_root(squares << 16));
  std::array<std::int8_t, 3> bytes{};
  for (std::size_t c = 0; c < 3; ++c) {
    // As float_to_snorm8 rounds: the nearest under the mean of the two decodings of GL.
    const std::int64_t value = floor_divide(std::int64_t{509 * 256} * direction[c] + length,
                                            4 * std::max<std::int64_t>(length, 1));
    bytes[c] = static_cast<std::int8_t>(std::clamp<std::int64_t>(value, -128, 127));
  }
  return bytes;
}

std::array<std::int8_t, 3> snorm8_of_octahedral(std::int32_t s, std::int32_t t, int bits) {
  return snorm8_of_direction(octahedral_direction(s, t, bits));
}

std::array<std::int32_t, 3> octahedral_of_snorm8(std::array<std::int8_t, 3> bytes, int bits) {
  // (x, y, z) in quarters of a step, as the mean of GL's decodings has its zero at -1/4.
  std::array<std::int64_t, 3> n{};
  for (std::size_t c = 0; c < 3; ++c) n[c] = 4 * std::int64_t{bytes[c]} + 1;
  const std::int64_t sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  const std::int32_t centre = (1 << (bits - 1)) - 1;
  std::int64_t y = n[1] * centre / sum;
  std::int64_t z = n[2] * centre / sum;
  if (n[0] < 0) {
    const std::int64_t folded = (centre - std::abs(z)) * (y < 0 ? -1 : 1);
    z = (centre - std::abs(y)) * (z < 0 ? -1 : 1);
    y = folded;
  }
  std::array<std::int32_t, 3> best = {};
  std::int64_t least = -1;
  for (std::int64_t ds = -2; ds <= 2; ++ds) {
    for (std::int64_t dt = -2; dt <= 2; ++dt) {
      const std::int64_t s = y + ds + centre;
      const std::int64_t t = z + dt + centre;
      if (s < 0 || t < 0 || s > 2 * centre || t > 2 * centre) continue;
      const auto map =
          snorm8_of_octahedral(static_cast<std::int32_t>(s), static_cast<std::int32_t>(t), bits);
      std::int64_t miss = 0;
      for (std::size_t c = 0; c < 3; ++c) miss += std::abs(map[c] - bytes[c]);
      const std::int64_t cost = 64 * miss + ds * ds + dt * dt;
      if (least >= 0 && cost >= least) continue;
      least = cost;
      best = octahedral_direction(static_cast<std::int32_t>(s), static_cast<std::int32_t>(t), bits);
    }
  }
  return best;
}

std::int32_t VertexStream::load(const std::byte* vertex, std::uint32_t c) const {
  const std::byte* at = vertex + attribute.offset + c * component_bytes(attribute.type);
  switch (static_cast<ComponentType>(attribute.type)) {
    case ComponentType::kI8:
      return load_number<std::int8_t>(at);
    case ComponentType::kU8:
      return load_number<std::uint8_t>(at);
    case ComponentType::kI16:
      return load_number<std::int16_t>(at);
    default:
      return load_number<std::uint16_t>(at);
  }
}

bool VertexStream::store(std::byte* vertex, std::uint32_t c, std::int32_t value) const {
  std::byte* at = vertex + attribute.offset + c * component_bytes(attribute.type);
  const auto write = [&]<class T>(T narrow) {
    narrow = static_cast<T>(value);
    std::memcpy(at, &narrow, sizeof narrow);
    return narrow == value;
  };
  switch (static_cast<ComponentType>(attribute.type)) {
    case ComponentType::kI8:
      return write(std::int8_t{});
    case ComponentType::kU8:
      return write(std::uint8_t{});
    case ComponentType::kI16:
      return write(std::int16_t{});
    default:
      return write(std::uint16_t{});
  }
}

std::optional<std::vector<VertexStream>> plan_streams(std::uint32_t stride,
                                                      std::span<const AttributeRecord> attributes) {
  using Kind = VertexStream::Kind;
  std::vector<VertexStream> streams;
  for (const AttributeRecord& a : attributes) {
    const auto type = static_cast<ComponentType>(a.type);
    if (type < ComponentType::kHalf || type > ComponentType::kU8) return std::nullopt;
    VertexStream stream{Kind::kOther, a};
    if (a.components == 0 || a.components > 4 ||
        a.offset + a.components * component_bytes(a.type) > stride) {
      return std::nullopt;
    }
    switch (static_cast<Semantic>(a.semantic)) {
      case Semantic::kPosition:
        if (type != ComponentType::kHalf && type != ComponentType::kI16) return std::nullopt;
        stream.kind = type == ComponentType::kHalf ? Kind::kHalfPosition : Kind::kPosition;
        break;
      case Semantic::kNormal:
        if (type == ComponentType::kI8 && a.components == 3) stream.kind = Kind::kNormal;
        break;
      case Semantic::kUv:
        if (type == ComponentType::kU16 && a.components == 2) stream.kind = Kind::kUv;
        break;
      default:
        break;
    }
    streams.push_back(stream);
  }
  const auto position = std::find_if(streams.begin(), streams.end(), [](const VertexStream& s) {
    return s.kind == Kind::kHalfPosition || s.kind == Kind::kPosition;
  });
  if (position == streams.end()) return std::nullopt;
  std::rotate(streams.begin(), position, position + 1);
  return streams;
}

}  // namespace modar
