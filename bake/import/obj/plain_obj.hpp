// The fast way through the lines that nearly all of a large OBJ consists of. Internal to obj_block.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>

#include "bake/import/obj/number_parser.hpp"
#include "bake/import/obj/obj_block.hpp"

namespace modar {

inline constexpr std::uint32_t kMaxFaceCorners = 0x00FFFFFFu;

/// Vertices of the block that have no colour before one that has.
inline void fill_colours(ObjBlock& block) {
  while (block.colours.size() + 1 < block.positions.size()) {
    block.colours.push(glm::vec3(std::numeric_limits<float>::quiet_NaN()));
  }
}

inline void pop_corners(ObjBlock& block, std::uint32_t count) {
  block.corner_positions.pop(count);
  block.corner_uvs.pop(count);
  block.corner_normals.pop(count);
}

namespace detail {

/// One past the line end at p, nullptr where the line goes on.
inline const char* take_line_end(const char* p) {
  p += static_cast<int>(*p == '\r');
  return *p == '\n' ? p + 1 : nullptr;
}

/// Plain numbers, a blank ahead of each, then the line's end. Returns what follows it and how many
/// there were; nullptr where it is not so or they are more than kMost.
template <unsigned kMost>
inline const char* take_plain_reals(const char* p, double (&values)[kMost], unsigned& count) {
  count = 0;
  while (*p == ' ') {
    if (count == kMost) return nullptr;
    p = take_plain_real(p + 1, values[count]);
    if (p == nullptr) return nullptr;
    ++count;
  }
  return take_line_end(p);
}

/// An index of 1 to 8 digits, not 0; nullptr where there is none.
inline const char* take_plain_index(const char* p, std::uint32_t& value) {
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, p, sizeof bytes);
  const unsigned n = count_digits(bytes);
  if (n == 0) return nullptr;
  value = static_cast<std::uint32_t>(digits_value(bytes, n));
  return value == 0 ? nullptr : p + n;
}

inline const char* take_plain_position(const char* p, ObjBlock& block) {
  double v[6] = {};
  unsigned n = 0;
  p = take_plain_reals(p, v, n);
  if (p == nullptr || (n == 3 && block.colours.size() != 0) || (n != 3 && n != 6)) return nullptr;
  block.positions.push({v[0], v[1], v[2]});
  if (n == 6) {
    fill_colours(block);
    block.colours.push(glm::vec3(glm::dvec3(v[3], v[4], v[5])));
  }
  return p;
}

inline const char* take_plain_uv(const char* p, ObjBlock& block) {
  double v[3] = {};
  unsigned n = 0;
  p = take_plain_reals(p, v, n);
  if (p == nullptr || n < 2) return nullptr;
  block.uvs.push({v[0], v[1]});
  return p;
}

inline const char* take_plain_normal(const char* p, ObjBlock& block) {
  double v[3] = {};
  unsigned n = 0;
  p = take_plain_reals(p, v, n);
  if (p == nullptr || n != 3) return nullptr;
  block.normals.push(glm::vec3(glm::dvec3(v[0], v[1], v[2])));
  return p;
}

/// Text of an index and what it says.
struct IndexText {
  std::uint64_t bytes = 0;
  unsigned digits = 0;
  std::uint32_t value = 0;
};

inline const char* take_first_index(const char* p, IndexText& index) {
  std::memcpy(&index.bytes, p, sizeof index.bytes);
  index.digits = count_digits(index.bytes);
  if (index.digits == 0) return nullptr;
  index.value = static_cast<std::uint32_t>(digits_value(index.bytes, index.digits));
  return index.value == 0 ? nullptr : p + index.digits;
}

/// An index that mostly repeats the first one of its corner: then no digit needs to be counted.
inline const char* take_next_index(const char* p, const IndexText& first, std::uint32_t& value) {
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, p, sizeof bytes);
  const unsigned bits = 8 * first.digits;
  if (first.digits < 8 && ((bytes ^ first.bytes) << (64 - bits)) == 0 &&
      static_cast<unsigned char>((bytes >> bits) - '0') > 9) {
    value = first.value;
    return p + first.digits;
  }
  return take_plain_index(p, value);
}

/// One corner "v", "v/t", "v//n" or "v/t/n" of positive indices; nullptr where it is anything else.
inline const char* take_plain_corner(const char* p, ObjBlock& block) {
  IndexText first;
  std::uint32_t t = 0;
  std::uint32_t n = 0;
  p = take_first_index(p, first);
  if (p == nullptr) return nullptr;
  if (*p == '/') {
    ++p;
    if (*p != '/') p = take_next_index(p, first, t);
    if (p == nullptr) return nullptr;
    if (*p == '/') p = take_next_index(p + 1, first, n);
    if (p == nullptr) return nullptr;
  }
  const std::uint32_t v = first.value;
  // No index is 0, which wraps to kNoIndex where there is none.
  static_assert(kNoIndex == static_cast<std::uint32_t>(-1));
  block.corner_positions.push(v - 1);
  block.corner_uvs.push(t - 1);
  block.corner_normals.push(n - 1);
  ObjCounts& highest = block.highest;
  highest.positions = v > highest.positions ? v : highest.positions;
  highest.uvs = t > highest.uvs ? t : highest.uvs;
  highest.normals = n > highest.normals ? n : highest.normals;
  return p;
}

inline const char* take_plain_face(const char* p, ObjBlock& block) {
  std::uint32_t count = 0;
  while (*p == ' ') {
    p = take_plain_corner(p + 1, block);
    if (p == nullptr) break;
    ++count;
  }
  if (p != nullptr && count >= 3 && count <= kMaxFaceCorners)
    p = take_line_end(p);
  else
    p = nullptr;
  if (p == nullptr) {
    pop_corners(block, count);
    return nullptr;
  }
  block.face_corners.push(count);
  return p;
}

}  // namespace detail

/// Parses the v, vt, vn or f line at p where it is as plain as exporters write them: single blanks,
/// plain numbers, positive indices, nothing else. Returns the start of the next line; nullptr, with
/// nothing done, for any other line.
inline const char* take_plain_statement(const char* p, ObjBlock& block) {
  if (p[0] == 'f' && p[1] == ' ') return detail::take_plain_face(p + 1, block);
  if (p[0] != 'v') return nullptr;
  if (p[1] == ' ') return detail::take_plain_position(p + 1, block);
  if (p[1] == 't') return detail::take_plain_uv(p + 2, block);
  if (p[1] == 'n') return detail::take_plain_normal(p + 2, block);
  return nullptr;
}

}  // namespace modar
