// Parses OBJ statements in a single pass over the bytes, without searching for line ends first.
#include "bake/import/obj/obj_block.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "bake/import/obj/line_window.hpp"
#include "bake/import/obj/number_parser.hpp"

namespace modar {
namespace {

using detail::count_digits;
using detail::digits_value;

// The lines that nearly all of a large OBJ consists of, as exporters write them.

constexpr std::uint32_t kMaxFaceCorners = 0x00FFFFFFu;

/// Marks the block's vertices before the first coloured one as uncoloured.
void fill_colours(ObjBlock& block) {
  while (block.colours.size() + 1 < block.positions.size()) {
    block.colours.push(glm::vec3(std::numeric_limits<float>::quiet_NaN()));
  }
}

/// Says of all corners so far that they have no such index, where none had one.
void fill_plane(const ObjBlock& block, Scratch<std::uint32_t>& plane) {
  while (plane.size() < block.corner_positions.size()) plane.push(kNoIndex);
}

/// has_uv, has_normal: the file has one, and be it one that is left out.
void push_corner(ObjBlock& block, const Corner& corner, bool has_uv, bool has_normal) {
  if (has_uv || block.corner_uvs.size() != 0) {
    fill_plane(block, block.corner_uvs);
    block.corner_uvs.push(corner.uv);
  }
  if (has_normal || block.corner_normals.size() != 0) {
    fill_plane(block, block.corner_normals);
    block.corner_normals.push(corner.normal);
  }
  block.corner_positions.push(corner.position);
}

void pop_corners(ObjBlock& block, std::uint32_t count) {
  block.corner_positions.pop(count);
  if (block.corner_uvs.size() != 0) block.corner_uvs.pop(count);
  if (block.corner_normals.size() != 0) block.corner_normals.pop(count);
}

/// One past the line end at p; nullptr where the line continues.
const char* parse_line_end(const char* p) {
  // Branches, which a file's lines all take alike: the next line need not wait for this byte.
  if (*p == '\n') return p + 1;
  return *p == '\r' && p[1] == '\n' ? p + 2 : nullptr;
}

/// Plain numbers, each after one blank, up to the end of the line. Returns the byte after them and
/// their count; nullptr for anything else, or for more than kMost.
template <unsigned kMost>
const char* parse_plain_reals(const char* p, double (&values)[kMost], unsigned& count) {
  count = 0;
  while (*p == ' ') {
    if (count == kMost) return nullptr;
    p = parse_plain_real(p + 1, values[count]);
    if (p == nullptr) return nullptr;
    ++count;
  }
  return p;
}

/// As parse_plain_reals(): the three numbers of a position or a normal, or six with a colour.
const char* parse_triples(const char* p, double (&values)[6], unsigned& count) {
#ifdef __SSE2__
  if (*p == ' ') {
    if (const char* const end = detail::parse_three_or_six(p + 1, values, count)) return end;
  }
#endif
  return parse_plain_reals(p, values, count);
}

/// As parse_plain_reals(): the two or three numbers of a uv.
const char* parse_pair(const char* p, double (&values)[3], unsigned& count) {
#ifdef __SSE2__
  if (*p == ' ') {
    count = 2;
    const char* const end = detail::parse_two(p + 1, values);
    if (end != nullptr && *end != ' ') return end;
  }
#endif
  return parse_plain_reals(p, values, count);
}

/// An index of 1 to 8 digits, not 0; nullptr if none.
const char* parse_plain_index(const char* p, std::uint32_t& value) {
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, p, sizeof bytes);
  const unsigned n = count_digits(bytes);
  if (n == 0) return nullptr;
  value = static_cast<std::uint32_t>(digits_value(bytes, n));
  return value == 0 ? nullptr : p + n;
}

const char* parse_plain_position(const char* p, ObjBlock& block) {
  double v[6];
  unsigned n = 0;
  p = parse_triples(p, v, n);
  if (p != nullptr) p = parse_line_end(p);
  if (p == nullptr || (n == 3 && block.colours.size() != 0) || (n != 3 && n != 6)) return nullptr;
  block.positions.push({v[0], v[1], v[2]});
  if (n == 6) {
    fill_colours(block);
    block.colours.push(glm::vec3(glm::dvec3(v[3], v[4], v[5])));
  }
  return p;
}

const char* parse_plain_uv(const char* p, ObjBlock& block) {
  double v[3];
  unsigned n = 0;
  p = parse_pair(p, v, n);
  if (p != nullptr) p = parse_line_end(p);
  if (p == nullptr || n < 2) return nullptr;
  block.uvs.push({v[0], v[1]});
  return p;
}

const char* parse_plain_normal(const char* p, ObjBlock& block) {
  double v[6];
  unsigned n = 0;
  p = parse_triples(p, v, n);
  if (p != nullptr) p = parse_line_end(p);
  if (p == nullptr || n != 3) return nullptr;
  block.normals.push(glm::vec3(glm::dvec3(v[0], v[1], v[2])));
  return p;
}

/// An index as text and as a value.
struct IndexText {
  std::uint64_t bytes = 0;
  unsigned digits = 0;
  std::uint32_t value = 0;
};

const char* parse_first_index(const char* p, IndexText& index) {
  std::memcpy(&index.bytes, p, sizeof index.bytes);
  index.digits = count_digits(index.bytes);
  if (index.digits == 0) return nullptr;
  index.value = static_cast<std::uint32_t>(digits_value(index.bytes, index.digits));
  return index.value == 0 ? nullptr : p + index.digits;
}

/// An index that mostly repeats the first one of its corner: then no digits need counting.
const char* parse_next_index(const char* p, const IndexText& first, std::uint32_t& value) {
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, p, sizeof bytes);
  const unsigned bits = 8 * first.digits;
  if (first.digits < 8 && ((bytes ^ first.bytes) << (64 - bits)) == 0 &&
      static_cast<unsigned char>((bytes >> bits) - '0') > 9) {
    value = first.value;
    return p + first.digits;
  }
  return parse_plain_index(p, value);
}

/// One corner "v", "v/t", "v//n" or "v/t/n" of positive indices; nullptr for anything else.
const char* parse_plain_corner(const char* p, ObjBlock& block) {
  IndexText first;
  std::uint32_t t = 0;
  std::uint32_t n = 0;
  p = parse_first_index(p, first);
  if (p == nullptr) return nullptr;
  if (*p == '/') {
    ++p;
    if (*p != '/') p = parse_next_index(p, first, t);
    if (p == nullptr) return nullptr;
    if (*p == '/') p = parse_next_index(p + 1, first, n);
    if (p == nullptr) return nullptr;
  }
  const std::uint32_t v = first.value;
  // No index is 0, which wraps to kNoIndex if none.
  static_assert(kNoIndex == static_cast<std::uint32_t>(-1));
  push_corner(block, {v - 1, t - 1, n - 1}, t != 0, n != 0);
  ObjCounts& highest = block.highest;
  highest.positions = v > highest.positions ? v : highest.positions;
  highest.uvs = t > highest.uvs ? t : highest.uvs;
  highest.normals = n > highest.normals ? n : highest.normals;
  return p;
}

#ifdef __SSE2__
using detail::CornerKind;

/// Adds indices, which count from 0 there; highest: of those that count from 1.
template <std::size_t kCorners>
void push_corners(Scratch<std::uint32_t>& plane, FourIndices& highest,
                  const detail::CornerIndices& indices) {
  auto* const lanes = reinterpret_cast<__m128i*>(highest.data());
  _mm_storeu_si128(lanes, detail::greater(_mm_loadu_si128(lanes), indices.four));
  const __m128i from_zero = _mm_add_epi32(indices.four, _mm_set1_epi32(-1));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(plane.room(kCorners)), from_zero);
}

/// A triangle or a quadrangle of a kind of corners; nullptr for anything else.
template <std::size_t kCorners, CornerKind kKind>
const char* parse_short_face(const char* p, ObjBlock& block) {
  constexpr bool kUv = kKind == CornerKind::kUv || kKind == CornerKind::kUvNormal;
  constexpr bool kNormal = kKind == CornerKind::kNormal || kKind == CornerKind::kUvNormal;
  std::array<detail::CornerIndices, detail::indices_of(kKind)> indices;
  p = detail::take_corners<kCorners, kKind>(p, indices);
  if (p != nullptr) p = parse_line_end(p);
  if (p == nullptr) return nullptr;
  if constexpr (kUv) {
    fill_plane(block, block.corner_uvs);
    push_corners<kCorners>(block.corner_uvs, block.highest_short[1], indices[1]);
  }
  if constexpr (kNormal) {
    fill_plane(block, block.corner_normals);
    push_corners<kCorners>(block.corner_normals, block.highest_short[2], indices.back());
  }
  push_corners<kCorners>(block.corner_positions, block.highest_short[0], indices[0]);
  if (!kUv && block.corner_uvs.size() != 0) fill_plane(block, block.corner_uvs);
  if (!kNormal && block.corner_normals.size() != 0) fill_plane(block, block.corner_normals);
  block.face_corners.push(kCorners);
  return p;
}

/// What the face at p seems to be.
FaceShape shape_of(const char* p) {
  unsigned slashes = 0;
  unsigned corners = 1;
  const char* const start = p;
  bool pair = false;  // of slashes
  for (; is_digit(*p) || *p == '/'; ++p) {
    pair = pair || (*p == '/' && p > start && p[-1] == '/');
    slashes += *p == '/' ? 1 : 0;
  }
  for (; is_digit(*p) || *p == '/' || *p == ' '; ++p) corners += *p == ' ' ? 1 : 0;
  const CornerKind kind = pair           ? CornerKind::kNormal
                          : slashes == 0 ? CornerKind::kPosition
                          : slashes == 1 ? CornerKind::kUv
                                         : CornerKind::kUvNormal;
  return {corners, kind};
}

template <std::size_t kCorners>
const char* parse_face_of(CornerKind kind, const char* p, ObjBlock& block) {
  switch (kind) {
    case CornerKind::kPosition:
      return parse_short_face<kCorners, CornerKind::kPosition>(p, block);
    case CornerKind::kUv:
      return parse_short_face<kCorners, CornerKind::kUv>(p, block);
    case CornerKind::kUvNormal:
      return parse_short_face<kCorners, CornerKind::kUvNormal>(p, block);
    case CornerKind::kNormal:
      return parse_short_face<kCorners, CornerKind::kNormal>(p, block);
  }
  return nullptr;
}

const char* parse_face_of(FaceShape shape, const char* p, ObjBlock& block) {
  if (shape.corners == 3) return parse_face_of<3>(shape.kind, p, block);
  return shape.corners == 4 ? parse_face_of<4>(shape.kind, p, block) : nullptr;
}

/// Tries the shape of the face before, then what this one seems to be.
const char* parse_likely_face(const char* p, ObjBlock& block) {
  if (const char* const next = parse_face_of(block.likely, p, block)) return next;
  const FaceShape shape = shape_of(p);
  if (shape == block.likely) return nullptr;
  block.likely = shape;
  return parse_face_of(shape, p, block);
}
#endif

const char* parse_plain_face(const char* p, ObjBlock& block) {
#ifdef __SSE2__
  if (const char* const next = parse_likely_face(p + 1, block)) return next;
#endif
  std::uint32_t count = 0;
  while (*p == ' ') {
    p = parse_plain_corner(p + 1, block);
    if (p == nullptr) break;
    ++count;
  }
  if (p != nullptr && count >= 3 && count <= kMaxFaceCorners)
    p = parse_line_end(p);
  else
    p = nullptr;
  if (p == nullptr) {
    pop_corners(block, count);
    return nullptr;
  }
  block.face_corners.push(count);
  return p;
}

/// Parses the v, vt, vn or f line at p if it is as plain as exporters write them: single blanks,
/// plain numbers, positive indices, nothing else. Returns the start of the next line; nullptr for
/// any other line, which leaves the block unchanged.
const char* parse_plain_statement(const char* p, ObjBlock& block) {
  if (p[0] == 'f' && p[1] == ' ') return parse_plain_face(p + 1, block);
  if (p[0] != 'v') return nullptr;
  if (p[1] == ' ') return parse_plain_position(p + 1, block);
  if (p[1] == 't') return parse_plain_uv(p + 2, block);
  if (p[1] == 'n') return parse_plain_normal(p + 2, block);
  return nullptr;
}

constexpr std::uint32_t kTooLarge = 0x7FFFFFFFu;  // beyond kMaxElements of obj_reader.cpp

class BlockParser {
 public:
  BlockParser(const char* text, std::size_t size, const ObjLimits* limits, ObjBlock& block)
      : p_(text), end_(text + size), limits_(limits), block_(block) {}

  void run() {
    while (p_ < end_) {
      if (limits_ == nullptr) plain_statements();
      if (p_ < end_) statement();
    }
    block_.lines = line_ - 1;
  }

 private:
  void note(ObjNote id) {
    NoteTally& tally = block_.notes[static_cast<std::size_t>(id)];
    if (tally.count++ == 0) tally.first_line = line_;
  }

  /// Size of a backslash and the line end it continues (a lone '\r' counts); else 0.
  [[nodiscard]] std::size_t continuation() const {
    if (*p_ != '\\' || !is_line_end(p_[1]) || p_ + 1 >= end_) return 0;
    return p_[1] == '\r' && p_[2] == '\n' ? 3 : 2;
  }

  /// Skips blanks and continued line ends.
  void skip_blanks() {
    while (true) {
      while (is_blank(*p_) && p_ < end_) ++p_;
      const std::size_t bytes = continuation();
      if (bytes == 0) return;
      p_ += bytes;
      ++line_;
    }
  }

  [[nodiscard]] bool at_end() const { return p_ >= end_ || is_line_end(*p_) || *p_ == '#'; }

  /// Goes past the line end. A lone '\r' ends a line as well (very old files).
  void end_statement() {
    if (*p_ == '\n' && p_ < end_) {
      ++p_;
      ++line_;
      return;
    }
    // A comment's backslash continues nothing.
    while (p_ < end_ && !is_line_end(*p_)) ++p_;
    if (p_ >= end_) return;
    if (*p_ == '\r' && p_[1] == '\n') ++p_;
    ++p_;
    ++line_;
  }

  /// Skips the rest of a statement, continued lines with it.
  void skip_statement() {
    while (true) {
      skip_blanks();
      if (at_end()) break;
      ++p_;
    }
    end_statement();
  }

  void skip_token() {
    while (p_ < end_ && !is_blank(*p_) && !is_line_end(*p_)) {
      if (continuation() > 0) return;
      ++p_;
    }
  }

  /// The next number of the line; false at the end of the line.
  bool real(double& value) {
    skip_blanks();
    if (at_end()) return false;
    NumberKind kind = NumberKind::kNone;
    p_ = parse_real(p_, end_, value, kind);
    if (kind == NumberKind::kNotFinite) {
      note(ObjNote::kNotFinite);
      value = std::numeric_limits<double>::quiet_NaN();
    } else if (kind == NumberKind::kNone) {
      note(ObjNote::kBadNumber);
      value = 0.0;
      skip_token();
      return true;
    }
    if (!is_blank(*p_) && !at_end() && *p_ != '\\') {
      note(ObjNote::kBadNumber);
      skip_token();
    }
    return true;
  }

  /// As many as there are before one that is not plain.
  void plain_statements() {
    const char* p = p_;
    std::uint64_t lines = 0;
    while (p < end_) {
      const char* const next = parse_plain_statement(p, block_);
      if (next == nullptr) break;
      p = next;
      ++lines;
    }
    p_ = p;
    line_ += lines;
  }

  void statement() {
    skip_blanks();
    const char c = *p_;
    const char next = p_[1];
    if (c == 'v') {
      if (is_blank(next)) return position(1);
      if (next == 't' && is_blank(p_[2])) return uv();
      if (next == 'n' && is_blank(p_[2])) return normal();
    } else if (c == 'f' && is_blank(next)) {
      return face();
    }
    if (c == '#') paint();
    if (at_end()) return end_statement();
    other();
  }

  /// ZBrush's colours of vertices, in their order: "#MRGB " and eight hexadecimal digits of each,
  /// two of them its mask.
  void paint() {
    if (std::string_view(p_, 6) != "#MRGB ") return;
    const auto byte = [](const char* digits, std::uint8_t& value) {
      return std::from_chars(digits, digits + 2, value, 16).ptr == digits + 2;
    };
    std::array<std::uint8_t, 4> mrgb{};
    for (const char* p = p_ + 6;; p += 8) {
      for (std::size_t i = 0; i < mrgb.size(); ++i) {
        if (!byte(p + 2 * i, mrgb[i])) return;
      }
      block_.painted.push_back(glm::vec3(mrgb[1], mrgb[2], mrgb[3]) / 255.0f);
    }
  }

  void position(std::ptrdiff_t keyword) {
    p_ += keyword;
    double v[8];
    unsigned n = 0;
    while (n < 8 && real(v[n])) ++n;
    if (n < 3) {
      note(ObjNote::kShortVertex);
      for (unsigned i = n; i < 3; ++i) v[i] = 0.0;
    }
    block_.positions.push({v[0], v[1], v[2]});
    if (n == 4 && v[3] != 1.0) note(ObjNote::kWeight);
    if (n >= 6) {
      colour({v[3], v[4], v[5]});
    } else if (block_.colours.size() != 0) {
      block_.colours.push(glm::vec3(std::numeric_limits<float>::quiet_NaN()));
    }
    skip_statement();
  }

  void colour(const glm::dvec3& rgb) {
    fill_colours(block_);
    const auto finite = [](double x) { return std::isfinite(x) ? static_cast<float>(x) : 0.0f; };
    block_.colours.push({finite(rgb.x), finite(rgb.y), finite(rgb.z)});
  }

  void uv() {
    p_ += 2;
    glm::dvec2 value(0.0);
    if (real(value.x)) real(value.y);
    block_.uvs.push(value);
    skip_statement();
  }

  void normal() {
    p_ += 2;
    glm::dvec3 value(0.0);
    if (real(value.x) && real(value.y)) real(value.z);
    block_.normals.push(glm::vec3(value));
    skip_statement();
  }

  /// An index as written in the file: 0 if none, kTooLarge beyond what we hold.
  std::int64_t index() {
    const bool negative = *p_ == '-';
    if (negative) ++p_;
    std::uint64_t value = 0;
    unsigned digits = 0;
    p_ = detail::parse_digits(p_, value, digits);
    if (digits > 10 || value > kTooLarge) value = kTooLarge;
    const auto index = static_cast<std::int64_t>(value);
    return negative ? -index : index;
  }

  /// Converts an index of the file (from 1, or negative and relative) to one from 0. local:
  /// elements of the block so far. Returns false where it refers to nothing.
  bool resolve(std::int64_t index, std::uint64_t local, std::uint64_t before, std::uint64_t total,
               std::uint32_t component, std::uint64_t& highest, std::uint32_t& out) {
    if (limits_ != nullptr) {
      const std::int64_t here = static_cast<std::int64_t>(before + local);
      const std::int64_t value = index > 0 ? index - 1 : here + index;
      if (index == 0 || value < 0 || value >= static_cast<std::int64_t>(total)) return false;
      out = static_cast<std::uint32_t>(value);
      return true;
    }
    if (index > 0) {
      const auto value = static_cast<std::uint64_t>(index);
      highest = value > highest ? value : highest;
      out = static_cast<std::uint32_t>(value - 1);
    } else {
      // Whether it exists is known once the previous blocks are counted.
      block_.relative.push_back(static_cast<std::uint32_t>(3 * block_.corner_positions.size()) +
                                component);
      out = static_cast<std::uint32_t>(
          static_cast<std::uint64_t>(static_cast<std::int64_t>(local) + index));
    }
    return true;
  }

  /// One corner "v", "v/t", "v//n" or "v/t/n". Returns false where the face cannot be kept.
  bool corner() {
    const std::int64_t v = index();
    std::int64_t t = 0;
    std::int64_t n = 0;
    bool has_t = false;
    bool has_n = false;
    if (*p_ == '/') {
      ++p_;
      has_t = is_digit(*p_) || *p_ == '-';
      if (has_t) t = index();
      if (*p_ == '/') {
        ++p_;
        has_n = is_digit(*p_) || *p_ == '-';
        if (has_n) n = index();
      }
    }
    if (v == 0) return note(ObjNote::kZeroIndex), false;
    Corner result;
    const ObjLimits none{};
    const ObjLimits& limits = limits_ != nullptr ? *limits_ : none;
    if (!resolve(v, block_.positions.size(), limits.before.positions, limits.total.positions, 0,
                 block_.highest.positions, result.position)) {
      return note(ObjNote::kIndexRange), false;
    }
    if (has_t && (t == 0 || !resolve(t, block_.uvs.size(), limits.before.uvs, limits.total.uvs, 1,
                                     block_.highest.uvs, result.uv))) {
      note(ObjNote::kAttributeRange);
      result.uv = kNoIndex;
    }
    if (has_n &&
        (n == 0 || !resolve(n, block_.normals.size(), limits.before.normals, limits.total.normals,
                            2, block_.highest.normals, result.normal))) {
      note(ObjNote::kAttributeRange);
      result.normal = kNoIndex;
    }
    push_corner(block_, result, has_t, has_n);
    return true;
  }

  void face() {
    ++p_;
    std::uint32_t count = 0;
    const std::size_t relative = block_.relative.size();
    bool keep = true;
    while (true) {
      skip_blanks();
      if (at_end()) break;
      if (is_digit(*p_) || *p_ == '-') {
        const char* const start = p_;
        if (corner()) {
          ++count;
        } else {
          keep = false;
        }
        if (p_ > start && (is_blank(*p_) || at_end() || *p_ == '\\')) continue;
      } else if (*p_ == '/') {
        note(ObjNote::kNoPosition);
        keep = false;
        skip_token();
        continue;
      }
      note(ObjNote::kBadNumber);
      keep = false;
      skip_token();
    }
    if (keep && (count < 3 || count > kMaxFaceCorners)) {
      note(ObjNote::kShortFace);
      keep = false;
    }
    if (keep) {
      block_.face_corners.push(count);
    } else {
      note(ObjNote::kLostFace);
      pop_corners(block_, count);
      block_.relative.resize(relative);
    }
    end_statement();
  }

  /// The rest of the statement as text: blanks trimmed, continued lines joined.
  std::string rest() {
    std::string text;
    skip_blanks();
    while (p_ < end_ && !is_line_end(*p_)) {
      if (continuation() > 0) {
        skip_blanks();
        text += ' ';
        continue;
      }
      text += *p_++;
    }
    while (!text.empty() && is_blank(text.back())) text.pop_back();
    return text;
  }

  void add(ObjStatement::Kind kind, std::uint32_t group) {
    ObjStatement s{kind, block_.face_corners.size(), line_, group, {}};
    if (kind != ObjStatement::Kind::kSmoothing) s.text = rest();
    block_.statements.push_back(std::move(s));
  }

  void smoothing() {
    skip_blanks();
    std::int64_t group = 0;
    if (is_digit(*p_)) {
      group = index();
    } else if ((*p_ | 0x20) == 'o' && (p_[1] | 0x20) == 'n') {
      group = 1;
    }
    add(ObjStatement::Kind::kSmoothing, static_cast<std::uint32_t>(group));
  }

  void other() {
    const char* const start = p_;
    skip_token();
    const std::string_view word(start, static_cast<std::size_t>(p_ - start));
    if (word == "usemtl") {
      add(ObjStatement::Kind::kMaterial, 0);
    } else if (word == "mtllib") {
      add(ObjStatement::Kind::kLibrary, 0);
    } else if (word == "s") {
      smoothing();
    } else if (word == "l") {
      note(ObjNote::kLine);
    } else if (word == "p") {
      note(ObjNote::kPoint);
    } else if (word == "v") {
      return position(0);
    } else if (is_free_form(word)) {
      note(ObjNote::kFreeForm);
    } else if (!is_harmless(word)) {
      note(ObjNote::kUnknown);
    }
    skip_statement();
  }

  static bool is_free_form(std::string_view word) {
    for (const char* known : {"vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf",
                              "parm", "trim", "hole", "scrv", "sp", "end", "con"}) {
      if (word == known) return true;
    }
    return false;
  }

  static bool is_harmless(std::string_view word) {
    for (const char* known :
         {"g", "o", "vt", "vn", "f", "mg", "bevel", "c_interp", "d_interp", "lod", "usemap",
          "maplib", "shadow_obj", "trace_obj", "ctech", "stech", "vw"}) {
      if (word == known) return true;
    }
    return false;
  }

  const char* p_;
  const char* end_;
  const ObjLimits* limits_;
  ObjBlock& block_;
  std::uint64_t line_ = 1;
};

}  // namespace

void parse_obj_block(const char* text, std::size_t size, const ObjLimits* limits, ObjBlock& block) {
  // The shortest element is two bytes long ("v\n", "1 ").
  const std::size_t most = size / 2 + 2 + std::tuple_size_v<FourIndices>;
  block.positions.reset(most);
  block.colours.reset(most);
  block.uvs.reset(most);
  block.normals.reset(most);
  block.corner_positions.reset(most);
  block.corner_uvs.reset(most);
  block.corner_normals.reset(most);
  block.face_corners.reset(most);
  block.relative.clear();
  block.statements.clear();
  block.painted.clear();
  block.notes = {};
  block.highest = {};
  block.highest_short = {};
  block.likely = {};
  BlockParser(text, size, limits, block).run();
  const auto raise = [](std::uint64_t& highest, const FourIndices& others) {
    highest = std::max<std::uint64_t>(highest, *std::max_element(others.begin(), others.end()));
  };
  raise(block.highest.positions, block.highest_short[0]);
  raise(block.highest.uvs, block.highest_short[1]);
  raise(block.highest.normals, block.highest_short[2]);
}

std::size_t first_statement_end(std::string_view text, std::size_t from) {
  while (true) {
    const std::size_t at = text.find('\n', from);
    if (at == std::string_view::npos) return 0;
    std::size_t before = at;
    if (before > 0 && text[before - 1] == '\r') --before;
    if (before == 0 || text[before - 1] != '\\') return at + 1;
    from = at + 1;
  }
}

}  // namespace modar
