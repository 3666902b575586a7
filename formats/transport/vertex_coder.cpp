#include "formats/transport/vertex_coder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "formats/base/bits.hpp"
#include "formats/component.hpp"

namespace modar {
namespace {

constexpr int kContexts = 32;
constexpr std::size_t kKinds = 4;

/// Numbers of component values in their order, so that neighbours differ by 1.
std::int32_t load_ordinal(ComponentType type, const std::byte* at) {
  switch (type) {
    case ComponentType::kI8:
      return load_number<std::int8_t>(at);
    case ComponentType::kU8:
      return load_number<std::uint8_t>(at);
    case ComponentType::kI16:
      return load_number<std::int16_t>(at);
    case ComponentType::kHalf: {
      const std::int32_t bits = load_number<std::uint16_t>(at);
      return (bits & 0x8000) != 0 ? ~(bits & 0x7FFF) : bits;
    }
    default:
      return load_number<std::uint16_t>(at);
  }
}

void store_ordinal(ComponentType type, std::int32_t ordinal, std::byte* at) {
  if (type == ComponentType::kHalf && ordinal < 0) ordinal = 0x8000 | (~ordinal & 0x7FFF);
  const auto bits = static_cast<std::uint16_t>(ordinal);
  if (component_bytes(static_cast<std::uint8_t>(type)) == 1) {
    *at = static_cast<std::byte>(bits & 0xFF);
  } else {
    std::memcpy(at, &bits, sizeof bits);
  }
}

/// The value of an ordinal: of halves in steps of the smallest one.
std::int64_t value_of(ComponentType type, std::int32_t ordinal) {
  if (type != ComponentType::kHalf) return ordinal;
  const std::int32_t bits = ordinal < 0 ? ~ordinal & 0x7FFF : ordinal & 0x7FFF;
  const int exponent = bits >> 10;
  const std::int64_t value =
      exponent == 0 ? bits : std::int64_t{(bits & 1023) + 1024} << (exponent - 1);
  return ordinal < 0 ? -value : value;
}

/// Bits that halves of this size leave out.
int lost_bits(ComponentType type, std::int64_t value) {
  if (type != ComponentType::kHalf) return 0;
  return std::max(0, bit_width(static_cast<std::uint64_t>(std::abs(value))) - 11);
}

std::int32_t nearest_ordinal(ComponentType type, std::int64_t value) {
  const auto clamped = [&](std::int64_t least, std::int64_t most) {
    return static_cast<std::int32_t>(std::clamp(value, least, most));
  };
  switch (type) {
    case ComponentType::kI8:
      return clamped(-128, 127);
    case ComponentType::kU8:
      return clamped(0, 255);
    case ComponentType::kI16:
      return clamped(-32768, 32767);
    case ComponentType::kHalf: {
      constexpr std::int64_t kMost = std::int64_t{2047} << 30;
      const std::int64_t size = std::min(std::abs(value), kMost);
      const int lost = lost_bits(type, size);
      const std::int64_t kept = lost == 0 ? size : (size + (std::int64_t{1} << (lost - 1))) >> lost;
      const auto bits = static_cast<std::int32_t>((std::int64_t{lost} << 10) + kept);
      return value < 0 ? ~bits : bits;
    }
    default:
      return clamped(0, 65535);
  }
}

std::int64_t mean_of(std::int64_t sum, std::int64_t count) {
  const std::int64_t twice = 2 * sum + count;
  return twice / (2 * count) - (twice % (2 * count) < 0 ? 1 : 0);
}

std::uint8_t bits_of(std::int64_t difference) {
  return static_cast<std::uint8_t>(bit_width(static_cast<std::uint64_t>(std::abs(difference))));
}

}  // namespace

VertexCoder::Fans::Fans(std::span<const std::uint32_t> at, std::uint32_t count)
    : begin(count + std::size_t{1}), corners(at.size()) {
  for (const std::uint32_t number : at) ++begin[number + 1];
  for (std::size_t i = 0; i < count; ++i) begin[i + 1] += begin[i];
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t c = 0; c < at.size(); ++c) corners[next[at[c]]++] = c;
}

VertexCoder::VertexCoder(RangeCoder& coder, const CodedTriangles& triangles)
    : coder_(coder),
      triangles_(triangles),
      places_(triangles.places, triangles.place_count),
      vertices_(triangles.vertices, triangles.vertex_count),
      place_of_(triangles.vertex_count) {
  for (std::size_t c = 0; c < triangles.places.size(); ++c) {
    place_of_[triangles.vertices[c]] = triangles.places[c];
  }
}

bool VertexCoder::code(const AttributeRecord& attribute, std::span<std::byte> vertices,
                       std::size_t stride) {
  const auto semantic = static_cast<Semantic>(attribute.semantic);
  const auto type = static_cast<ComponentType>(attribute.type);
  const bool position = semantic == Semantic::kPosition;
  const bool normal =
      semantic == Semantic::kNormal && type == ComponentType::kI8 && attribute.components == 3;
  const bool uv = semantic == Semantic::kUv && attribute.components == 2;
  const bool group = attribute.semantic == kTravellingGroup;
  attribute_ = attribute;
  models_.assign(std::size_t{4} * kContexts * kKinds, NumberModel());
  const std::uint32_t count = position ? triangles_.place_count : triangles_.vertex_count;
  coded_.values.assign(count, {});
  coded_.errors.assign(count, {});
  const auto at = [&](std::uint32_t vertex) {
    return vertices.data() + vertex * stride + attribute.offset;
  };
  for (std::uint32_t i = 0; i < count && !coder_.overrun(); ++i) {
    if (position) {
      code_values(i, guess_place(i), at(triangles_.vertices[places_.of(i).front()]));
    } else if (normal) {
      code_normal(i, guess_normal(i), at(i));
    } else {
      code_values(i, uv ? guess_uv(i) : group ? guess_group(i) : guess_other(i), at(i));
    }
  }
  if (coder_.overrun()) return false;
  if (!position) return true;
  const std::size_t size = std::size_t{attribute.components} * component_bytes(attribute.type);
  for (std::uint32_t v = 0; v < triangles_.vertex_count; ++v) {
    const std::uint32_t first = triangles_.vertices[places_.of(place_of_[v]).front()];
    if (v != first) std::memcpy(at(v), at(first), size);
  }
  positions_ = std::move(coded_);
  return true;
}

/// The mean of the known neighbours; without any, the previous one. at: number at each corner.
VertexCoder::Guess VertexCoder::mean_around(std::uint32_t number,
                                            std::span<const std::uint32_t> corners,
                                            std::span<const std::uint32_t> at) const {
  Guess guess;
  for (const std::uint32_t corner : corners) {
    for (const std::uint32_t other : {at[next_corner(corner)], at[last_corner(corner)]}) {
      if (other >= number) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        guess.values[c] += coded_.values[other][c];
        guess.errors[c] += coded_.errors[other][c];
      }
      ++guess.known;
    }
  }
  guess.kind = guess.known > 0 ? 1 : 0;
  if (guess.known > 0) {
    for (std::int64_t& value : guess.values) value = mean_of(value, guess.known);
  } else if (number > 0) {
    guess.values = coded_.values[number - 1];
  }
  return guess;
}

/// The mean of what completes a parallelogram with two neighbouring triangles.
VertexCoder::Guess VertexCoder::guess_place(std::uint32_t place) const {
  const auto& at = triangles_.places;
  Guess guess = mean_around(place, places_.of(place), at);
  std::array<std::int64_t, 3> sums{};
  int count = 0;
  for (const std::uint32_t corner : places_.of(place)) {
    const std::uint32_t edge = next_corner(corner);
    const std::uint32_t across = triangles_.opposite[edge];
    if (across == kNoEdge) continue;
    const std::uint32_t a = at[edge];
    const std::uint32_t b = at[next_corner(edge)];
    const std::uint32_t far = at[last_corner(across)];
    if (a >= place || b >= place || far >= place) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      sums[c] += coded_.values[a][c] + coded_.values[b][c] - coded_.values[far][c];
    }
    ++count;
  }
  if (count == 0) return guess;
  for (std::size_t c = 0; c < 3; ++c) guess.values[c] = mean_of(sums[c], count);
  guess.kind = count > 1 ? 3 : 2;
  return guess;
}

/// What the first vertex of its place has; for that one, the mean around.
VertexCoder::Guess VertexCoder::guess_other(std::uint32_t vertex) const {
  Guess guess = mean_around(vertex, vertices_.of(vertex), triangles_.vertices);
  const std::uint32_t first = triangles_.vertices[places_.of(place_of_[vertex]).front()];
  if (first >= vertex) return guess;
  guess.values = coded_.values[first];
  guess.kind = 2;
  return guess;
}

/// A group is a name, no quantity: those around only say how likely each is.
VertexCoder::Guess VertexCoder::guess_group(std::uint32_t vertex) const {
  const Guess around = mean_around(vertex, vertices_.of(vertex), triangles_.vertices);
  Guess guess;
  guess.kind = static_cast<std::size_t>(std::min<std::int64_t>(around.values[0], kKinds - 1));
  return guess;
}

/// The normal of the vertex's own triangles, weighted by their areas.
VertexCoder::Guess VertexCoder::guess_normal(std::uint32_t vertex) const {
  Guess guess = mean_around(vertex, vertices_.of(vertex), triangles_.vertices);
  std::array<double, 3> sum{};
  for (const std::uint32_t corner : vertices_.of(vertex)) {
    const auto& from = positions_.values[triangles_.places[corner]];
    const auto& to = positions_.values[triangles_.places[next_corner(corner)]];
    const auto& last = positions_.values[triangles_.places[last_corner(corner)]];
    std::array<double, 3> a{};
    std::array<double, 3> b{};
    for (std::size_t c = 0; c < 3; ++c) {
      a[c] = static_cast<double>(to[c] - from[c]);
      b[c] = static_cast<double>(last[c] - from[c]);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t d = (c + 1) % 3;
      const std::size_t e = (c + 2) % 3;
      sum[c] += a[d] * b[e] - a[e] * b[d];
    }
  }
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  if (!(length > 0)) return guess;
  // As float_to_snorm8() rounds.
  for (std::size_t c = 0; c < 3; ++c) {
    guess.values[c] = static_cast<std::int64_t>(std::floor(sum[c] / length * 127.25 + 0.25));
  }
  guess.kind = 2;
  return guess;
}

/// The texture coordinates that a triangle of the vertex has if the texture keeps its shape. Its
/// other corners are known, and differ; `certain` if a known triangle says on which side of them
/// it is.
VertexCoder::Unfolded VertexCoder::unfold(std::uint32_t vertex, std::uint32_t corner) const {
  const std::uint32_t edge = next_corner(corner);
  const std::uint32_t a = triangles_.vertices[edge];
  const std::uint32_t b = triangles_.vertices[next_corner(edge)];
  const auto& from = positions_.values[triangles_.places[edge]];
  const auto& to = positions_.values[triangles_.places[next_corner(edge)]];
  const auto& third = positions_.values[triangles_.places[corner]];
  double squared = 0;
  double along = 0;
  double away = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto side = static_cast<double>(to[c] - from[c]);
    const auto other = static_cast<double>(third[c] - from[c]);
    squared += side * side;
    along += side * other;
    away += other * other;
  }
  const auto coordinate = [&](std::uint32_t of, std::size_t c) {
    return static_cast<double>(coded_.values[of][c]);
  };
  const double u = coordinate(b, 0) - coordinate(a, 0);
  const double v = coordinate(b, 1) - coordinate(a, 1);
  Unfolded out;
  double turn = -1;
  const std::uint32_t across = triangles_.opposite[edge];
  if (across != kNoEdge && triangles_.vertices[across] == b &&
      triangles_.vertices[next_corner(across)] == a) {
    const std::uint32_t far = triangles_.vertices[last_corner(across)];
    out.certain = far < vertex;
    if (out.certain) {
      const double far_u = coordinate(far, 0) - coordinate(a, 0);
      const double far_v = coordinate(far, 1) - coordinate(a, 1);
      turn = u * far_v - v * far_u > 0 ? -1 : 1;
    }
  }
  if (squared > 0) {
    along /= squared;
    away = turn * std::sqrt(std::max(0.0, away / squared - along * along));
  }
  out.uv = {coordinate(a, 0) + along * u - away * v, coordinate(a, 1) + along * v + away * u};
  return out;
}

VertexCoder::Guess VertexCoder::guess_uv(std::uint32_t vertex) const {
  Guess guess = mean_around(vertex, vertices_.of(vertex), triangles_.vertices);
  std::array<double, 2> sum{};
  double count = 0;
  bool certain = false;
  for (const std::uint32_t corner : vertices_.of(vertex)) {
    if (triangles_.vertices[next_corner(corner)] >= vertex ||
        triangles_.vertices[last_corner(corner)] >= vertex) {
      continue;
    }
    const Unfolded unfolded = unfold(vertex, corner);
    if (certain && !unfolded.certain) continue;
    if (unfolded.certain && !certain) {
      certain = true;
      sum = {};
      count = 0;
    }
    sum[0] += unfolded.uv[0];
    sum[1] += unfolded.uv[1];
    ++count;
  }
  if (count == 0) return guess;
  constexpr double kMost = 1e12;
  for (std::size_t c = 0; c < 2; ++c) {
    const double mean = std::clamp(sum[c] / count, -kMost, kMost);
    guess.values[c] = static_cast<std::int64_t>(std::floor(mean + 0.5));
  }
  guess.kind = certain ? 3 : 2;
  return guess;
}

void VertexCoder::code_values(std::uint32_t number, const Guess& guess, std::byte* values) {
  for (std::size_t c = 0; c < attribute_.components; ++c) code_value(number, c, c, guess, values);
}

/// The component that is largest comes last: the other two all but tell it.
void VertexCoder::code_normal(std::uint32_t number, Guess guess, std::byte* values) {
  std::size_t largest = 0;
  for (std::size_t c = 1; c < 3; ++c) {
    if (std::abs(guess.values[c]) > std::abs(guess.values[largest])) largest = c;
  }
  double rest = 127.25 * 127.25;  // of the squared length, in codes from -1/4 on
  for (std::size_t i = 1; i < 3; ++i) {
    const std::size_t c = (largest + i) % 3;
    code_value(number, c, i - 1, guess, values);
    const double code = static_cast<double>(coded_.values[number][c]) + 0.25;
    rest -= code * code;
  }
  const double length = rest > 0 ? std::sqrt(rest) : 0;
  guess.values[largest] =
      static_cast<std::int64_t>(std::floor((guess.values[largest] < 0 ? -length : length) + 0.25));
  guess.kind = 3;
  code_value(number, largest, 2, guess, values);
}

/// place: of the component in the order in which they are coded.
void VertexCoder::code_value(std::uint32_t number, std::size_t component, std::size_t place,
                             const Guess& guess, std::byte* values) {
  const auto type = static_cast<ComponentType>(attribute_.type);
  std::byte* at = values + component * component_bytes(attribute_.type);
  const std::int32_t guessed = nearest_ordinal(type, guess.values[component]);
  const int lost = 2 * lost_bits(type, guess.values[component]);
  // How large errors are: around here, and of this vertex so far.
  constexpr int kUnknown = 12;
  const int around = guess.known > 0 ? 2 * guess.errors[component] / guess.known : kUnknown;
  const int own = std::max(error_ - lost, -1) + 1;
  const int context = std::max(around - lost, 0);
  const int mixed = std::min((place == 0 ? context : (2 * context + own) / 3) / 2, kContexts - 1);
  NumberModel& model =
      models_[(place * kContexts + static_cast<std::size_t>(mixed)) * kKinds + guess.kind];
  const std::int32_t ordinal = guessed + code_number(load_ordinal(type, at) - guessed, model);
  store_ordinal(type, ordinal, at);
  const std::int64_t value = value_of(type, load_ordinal(type, at));
  coded_.values[number][component] = value;
  const std::uint8_t error = bits_of(value - guess.values[component]);
  coded_.errors[number][component] = error;
  error_ = place == 0 ? 2 * error : (error_ + 2 * error) / 2;
}

std::int32_t VertexCoder::code_number(std::int32_t number, NumberModel& model) {
  if (coder_.code(number == 0, model.zero)) return 0;
  const bool negative = coder_.code(number < 0, model.sign);
  const auto size = static_cast<std::uint32_t>(std::abs(number));
  const int wanted = bit_width(size) - 1;
  int width = 0;
  while (width + 1 < NumberModel::kMostBits &&
         coder_.code(wanted > width, model.width[static_cast<std::size_t>(width)])) {
    ++width;
  }
  auto& top = model.top[static_cast<std::size_t>(width)];
  std::uint32_t coded = 1;
  for (int bit = width; bit-- > 0;) {
    const bool one = (size >> bit & 1) != 0;
    const bool known = bit == width - 1   ? coder_.code(one, top[0])
                       : bit == width - 2 ? coder_.code(one, top[1 + (coded & 1)])
                                          : coder_.code(one, 32768);
    coded = coded * 2 + (known ? 1 : 0);
  }
  return negative ? -static_cast<std::int32_t>(coded) : static_cast<std::int32_t>(coded);
}

}  // namespace modar
