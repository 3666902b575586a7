// Parses one block of OBJ text to plain arrays, independently of the text before it: the unit of
// work of the reader's threads. Internal to the OBJ reader.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"

namespace modar {

/// Oddities of a file that are worth a diagnostic. Counted, with the first line of each.
enum class ObjNote : std::uint8_t {
  kNotFinite,       ///< nan, inf, or a number too large for a double
  kBadNumber,       ///< not a number where one was expected
  kShortVertex,     ///< a v line with fewer than three numbers
  kWeight,          ///< a fourth coordinate that is not 1
  kLine,            ///< l element
  kPoint,           ///< p element
  kFreeForm,        ///< curves and surfaces
  kUnknown,         ///< a keyword that is in no OBJ specification
  kShortFace,       ///< fewer than three corners
  kZeroIndex,       ///< a corner with index 0
  kIndexRange,      ///< a corner that refers to no vertex of the file
  kNoPosition,      ///< a corner without a position
  kLostFace,        ///< a face that is left out; of those above, too
  kAttributeRange,  ///< a uv or normal index beyond the file: the attribute is left out
  kCount
};

struct NoteTally {
  std::uint64_t count = 0;
  std::uint64_t first_line = 0;  ///< counted from 1 in the text that was parsed
};
using NoteTallies = std::array<NoteTally, static_cast<std::size_t>(ObjNote::kCount)>;

/// An array whose capacity is reserved up front, so that push() checks nothing.
template <class T>
class Scratch {
 public:
  /// Reserves `capacity` elements in all and clears the array.
  void reset(std::size_t capacity) {
    if (capacity > capacity_) {
      data_.reset(new T[capacity]);
      capacity_ = capacity;
    }
    size_ = 0;
  }
  void push(const T& value) { data_[size_++] = value; }
  /// Adds `count` elements and returns where to write them: there and behind them is room for as
  /// many as FourIndices has.
  T* room(std::size_t count) { return data_.get() + std::exchange(size_, size_ + count); }
  void pop(std::size_t count) { size_ -= count; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] T* data() { return data_.get(); }
  [[nodiscard]] const T* data() const { return data_.get(); }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }

 private:
  std::unique_ptr<T[]> data_;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

/// Indices that one register holds.
using FourIndices = std::array<std::uint32_t, 4>;

namespace detail {
/// What a corner consists of: "v", "v/t", "v/t/n" or "v//n".
enum class CornerKind : std::uint8_t { kPosition, kUv, kUvNormal, kNormal };
}  // namespace detail

/// Expected layout of the next face line (fast path).
struct FaceShape {
  unsigned corners = 3;
  detail::CornerKind kind = detail::CornerKind::kPosition;
  friend bool operator==(const FaceShape&, const FaceShape&) = default;
};

/// A usemtl, s or mtllib statement, and the face of the block that follows it.
struct ObjStatement {
  enum class Kind : std::uint8_t { kMaterial, kSmoothing, kLibrary };
  Kind kind = Kind::kMaterial;
  std::uint64_t face = 0;
  std::uint64_t line = 0;
  std::uint32_t group = 0;  ///< of kSmoothing
  std::string text;         ///< of the others, trimmed
};

/// How many of each a file has, or had before some point.
struct ObjCounts {
  std::uint64_t positions = 0;
  std::uint64_t uvs = 0;
  std::uint64_t normals = 0;
};

struct ObjBlock {
  Scratch<glm::dvec3> positions;
  Scratch<glm::vec3> colours;  ///< empty, or one a position, NaN where the line had none
  Scratch<glm::dvec2> uvs;
  Scratch<glm::vec3> normals;
  Scratch<std::uint32_t> corner_positions;  ///< these three: see relative
  Scratch<std::uint32_t> corner_uvs;        ///< empty where no corner has one
  Scratch<std::uint32_t> corner_normals;    ///< empty where no corner has one
  Scratch<std::uint32_t> face_corners;      ///< number of corners of each face
  /// Entries (3 * corner + component) whose index counts from the start of the block (modulo 2^32).
  std::vector<std::uint32_t> relative;
  std::vector<ObjStatement> statements;
  std::vector<glm::vec3> painted;  ///< of ZBrush's comments, 0 to 1
  NoteTallies notes{};
  ObjCounts highest;                           ///< greatest absolute index of a corner, plus one
  std::array<FourIndices, 3> highest_short{};  ///< of faces that are read at once, by lanes
  std::uint64_t lines = 0;
  FaceShape likely;  ///< of the next face: what to try first
};

/// Set for the second, checked pass over a file with bad indices: every corner is checked against
/// these at once, so that the diagnostic can name the line.
struct ObjLimits {
  ObjCounts before;  ///< elements ahead of the block
  ObjCounts total;   ///< elements of the whole file
};

/// Parses whole statements; the last byte is a '\n'. kTextPadding bytes ahead of and behind the
/// text can be read. limits: nullptr in the fast pass, where indices are resolved later.
void parse_obj_block(const char* text, std::size_t size, const ObjLimits* limits, ObjBlock& block);

/// The first statement end whose last byte is in [from, size): one past a '\n' that is not
/// continued by a backslash; 0 if none.
std::size_t first_statement_end(std::string_view text, std::size_t from);

}  // namespace modar
