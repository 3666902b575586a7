// Scans of vertices as rows of 16-bit lanes: one minimum and one maximum a lane tell of all halves
// and integers at once, since their bits sort like their values after one exclusive or.
#include "formats/vertex_scan.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "formats/component.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

constexpr std::size_t kLaneBytes = 2;
constexpr std::size_t kVectorBytes = 16;
constexpr std::size_t kLanesOfVector = kVectorBytes / kLaneBytes;
/// Turns the order of unsigned numbers into that of signed ones.
constexpr std::int16_t kTopBit = -0x8000;
using Lanes [[gnu::vector_size(16)]] = std::int16_t;
/// Sort keys of half floats: infinities and NaN are at these and beyond.
constexpr std::int16_t kInfinityKey = 0x7C00;

/// (2c + 1)^2 for a byte c that holds a signed number.
constexpr std::array<std::uint32_t, 256> make_squares() {
  std::array<std::uint32_t, 256> squares{};
  for (int i = 0; i < 256; ++i) {
    const int c = i < 128 ? i : i - 256;
    squares[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>((2 * c + 1) * (2 * c + 1));
  }
  return squares;
}
constexpr std::array<std::uint32_t, 256> kSquares = make_squares();
// Square of the shortest normal, a little inside the limit.
constexpr std::uint32_t kLeastSquare = 62451;
constexpr std::uint32_t kGreatestSquare = 67651;

/// Takes back what made a sort key of the bits.
double lane_value(std::int16_t key, const AttributeRecord& position) {
  auto bits = static_cast<std::uint16_t>(key);
  const auto type = static_cast<ComponentType>(position.type);
  if (type == ComponentType::kHalf && key < 0) bits ^= 0x7FFFu;
  if (type == ComponentType::kU16) bits ^= 0x8000u;
  std::array<std::byte, 4> bytes{};  // as wide as the widest type
  std::memcpy(bytes.data(), &bits, sizeof bits);
  return decode_component(bytes.data(), position.type, position.normalised != 0);
}

}  // namespace

IndexScan scan_indices(std::span<const std::uint16_t> indices) {
  // Eight triangles are three vectors: index i is held against i + 1 and i + 2 where these are of
  // its triangle.
  constexpr std::size_t kVectors = 3;
  constexpr std::size_t kBlock = kVectors * kLanesOfVector;
  constexpr Lanes kNext[kVectors] = {
      {-1, -1, 0, -1, -1, 0, -1, -1}, {0, -1, -1, 0, -1, -1, 0, -1}, {-1, 0, -1, -1, 0, -1, -1, 0}};
  constexpr Lanes kAfter[kVectors] = {
      {-1, 0, 0, -1, 0, 0, -1, 0}, {0, -1, 0, 0, -1, 0, 0, -1}, {0, 0, -1, 0, 0, -1, 0, 0}};
  const auto load = [&](std::size_t at) {
    Lanes lanes;
    std::memcpy(&lanes, indices.data() + at, sizeof lanes);
    return lanes;
  };
  Lanes greatest = Lanes{} - 0x7FFF - 1;
  Lanes least = Lanes{} + 0x7FFF;
  Lanes equal{};
  std::size_t i = 0;
  for (; i + kBlock + 2 <= indices.size(); i += kBlock) {
    for (std::size_t v = 0; v < kVectors; ++v) {
      const Lanes at = load(i + v * kLanesOfVector);
      equal |= ((at == load(i + v * kLanesOfVector + 1)) & kNext[v]) |
               ((at == load(i + v * kLanesOfVector + 2)) & kAfter[v]);
      const Lanes key = at ^ kTopBit;
      greatest = key > greatest ? key : greatest;
      least = key < least ? key : least;
    }
  }
  IndexScan scan;
  for (std::size_t lane = 0; lane < kLanesOfVector; ++lane) {
    const auto most = static_cast<std::uint16_t>(greatest[lane] ^ kTopBit);
    scan.greatest = std::max(scan.greatest, most);
    scan.least = std::min(scan.least, static_cast<std::uint16_t>(least[lane] ^ kTopBit));
    scan.degenerate = scan.degenerate || equal[lane] != 0;
  }
  for (; i < indices.size(); i += 3) {
    const std::uint16_t* at = indices.data() + i;
    scan.greatest = std::max({scan.greatest, at[0], at[1], at[2]});
    scan.least = std::min({scan.least, at[0], at[1], at[2]});
    scan.degenerate = scan.degenerate || at[0] == at[1] || at[1] == at[2] || at[0] == at[2];
  }
  return scan;
}

VertexScan::VertexScan(const LayoutRecord& layout, std::uint32_t used)
    : stride_(layout.stride), vectors_((layout.stride + kVectorBytes - 1) / kVectorBytes) {
  if (vectors_ > kMaxVectors) {
    possible_ = false;
    return;
  }
  std::array<std::byte, kMaxVectors * kVectorBytes> padding{};
  std::fill_n(padding.begin(), stride_, std::byte{0xFF});
  for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
    const AttributeRecord& attribute = layout.attributes[i];
    std::fill_n(padding.begin() + attribute.offset,
                component_bytes(attribute.type) * attribute.components, std::byte{0});
    plan(attribute);
  }
  if (used < stride_) padding[used] = std::byte{0xFF & ~kMaxOcclusion};
  std::memcpy(padding_, padding.data(), padding.size());
}

void VertexScan::plan(const AttributeRecord& attribute) {
  const auto semantic = static_cast<Semantic>(attribute.semantic);
  const auto type = static_cast<ComponentType>(attribute.type);
  const bool bytes = type == ComponentType::kI8 || type == ComponentType::kU8;
  if (type == ComponentType::kF32 || (semantic == Semantic::kPosition && bytes)) possible_ = false;
  if (semantic == Semantic::kPosition) position_ = attribute;
  if (semantic == Semantic::kNormal) {
    if (type != ComponentType::kI8 || attribute.normalised == 0) possible_ = false;
    normal_offset_ = attribute.offset;
  }
  if (!possible_ || bytes) return;
  for (std::uint32_t c = 0; c < attribute.components; ++c) {
    const std::size_t lane = attribute.offset / kLaneBytes + c;
    Lanes& half = half_[lane / kLanesOfVector];
    Lanes& flip = flip_[lane / kLanesOfVector];
    if (type == ComponentType::kHalf) half[lane % kLanesOfVector] = 0x7FFF;
    if (type == ComponentType::kHalf) half_lanes_ |= 1u << lane;
    if (type == ComponentType::kU16) flip[lane % kLanesOfVector] = kTopBit;
  }
}

template <std::size_t kVectors>
void VertexScan::scan_lanes(std::span<const std::byte> bytes, Range& range) const {
  Range r;
  for (std::size_t v = 0; v < kVectors; ++v) {
    r.low[v] = Lanes{} + 0x7FFF;
    r.high[v] = Lanes{} - 0x7FFF - 1;
    r.dirt[v] = Lanes{};
  }
  const auto take = [&](const std::byte* vertex) {
    for (std::size_t v = 0; v < kVectors; ++v) {
      Lanes lanes;
      std::memcpy(&lanes, vertex + v * kVectorBytes, sizeof lanes);
      const Lanes key = lanes ^ flip_[v] ^ ((lanes >> 15) & half_[v]);
      r.low[v] = key < r.low[v] ? key : r.low[v];
      r.high[v] = key > r.high[v] ? key : r.high[v];
      r.dirt[v] |= lanes & padding_[v];
    }
  };
  // Vectors reach into the next vertices, whose lanes nobody asks for; the last ones are copied.
  constexpr std::size_t kReach = kVectors * kVectorBytes;
  std::size_t at = 0;
  for (; at + kReach <= bytes.size(); at += stride_) take(bytes.data() + at);
  for (; at < bytes.size(); at += stride_) {
    std::array<std::byte, kReach> last{};
    std::memcpy(last.data(), bytes.data() + at, std::min(kReach, bytes.size() - at));
    take(last.data());
  }
  range = r;
}

bool VertexScan::normals_good(std::span<const std::byte> bytes) const {
  if (normal_offset_ == kNone) return true;
  std::uint32_t least = kLeastSquare;
  std::uint32_t greatest = kGreatestSquare;
  for (std::size_t at = normal_offset_; at < bytes.size(); at += stride_) {
    const auto* n = reinterpret_cast<const std::uint8_t*>(bytes.data() + at);
    const std::uint32_t square = kSquares[n[0]] + kSquares[n[1]] + kSquares[n[2]];
    least = std::min(least, square);
    greatest = std::max(greatest, square);
  }
  return least == kLeastSquare && greatest == kGreatestSquare;
}

VertexScan::Extent VertexScan::scan(std::span<const std::byte> bytes) const {
  Range range;
  switch (vectors_) {
    case 1:
      scan_lanes<1>(bytes, range);
      break;
    case 2:
      scan_lanes<2>(bytes, range);
      break;
    default:
      std::memset(&range, 0, sizeof range);
      scan_lanes<kMaxVectors>(bytes, range);
  }
  Extent extent;
  for (std::size_t lane = 0; lane < vectors_ * kLanesOfVector; ++lane) {
    const std::size_t v = lane / kLanesOfVector;
    const std::size_t l = lane % kLanesOfVector;
    if (range.dirt[v][l] != 0) extent.clean_padding = false;
    if ((half_lanes_ >> lane & 1u) != 0 &&
        (range.high[v][l] >= kInfinityKey || range.low[v][l] < -kInfinityKey)) {
      extent.finite = false;
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t lane = position_.offset / kLaneBytes + axis;
    const std::size_t v = lane / kLanesOfVector;
    const std::size_t l = lane % kLanesOfVector;
    extent.low[axis] = lane_value(range.low[v][l], position_);
    extent.high[axis] = lane_value(range.high[v][l], position_);
  }
  extent.unit_normals = normals_good(bytes);
  return extent;
}

}  // namespace modar
