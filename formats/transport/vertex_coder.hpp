// The vertices of a chunk whose triangles are known: each value as its difference from what the
// vertices around it predict.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/layout.hpp"
#include "formats/transport/range_coder.hpp"
#include "formats/transport/triangle_coder.hpp"

namespace modar {

/// Semantic of a byte that names the group of a vertex; a layout has no such attribute.
inline constexpr std::uint8_t kTravellingGroup = 254;

/// Models of a signed number: whether it is zero, its sign, the count of its bits, the first two.
struct NumberModel {
  static constexpr int kMostBits = 20;
  AdaptiveBit zero, sign;
  std::array<AdaptiveBit, kMostBits> width{};
  std::array<std::array<AdaptiveBit, 3>, kMostBits> top{};
};

/// Codes vertices, both ways. Predicts in doubles that every processor rounds alike.
class VertexCoder {
 public:
  /// triangles: outlive this.
  VertexCoder(RangeCoder& coder, const CodedTriangles& triangles);

  /// One attribute of all vertices, which are in the order in which they travel, `stride` bytes
  /// each: encodes the values, or writes the decoded ones. The position comes first; it is the same
  /// in all vertices of a place. False where more was read than the coder has.
  bool code(const AttributeRecord& attribute, std::span<std::byte> vertices, std::size_t stride);

 private:
  /// What the known vertices around one say of its components.
  struct Guess {
    std::array<std::int64_t, 4> values{};
    std::array<int, 4> errors{};  ///< of the guesses there, bits, summed
    int known = 0;                ///< of how many
    std::size_t kind = 0;         ///< below 4: how sure it is
  };
  /// Corners by their place or vertex.
  struct Fans {
    Fans(std::span<const std::uint32_t> at, std::uint32_t count);
    [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t number) const {
      return std::span(corners).subspan(begin[number], begin[number + 1] - begin[number]);
    }
    std::vector<std::uint32_t> begin, corners;
  };
  /// Coded values of one attribute.
  struct Values {
    std::vector<std::array<std::int64_t, 4>> values;
    std::vector<std::array<std::uint8_t, 4>> errors;  ///< bits
  };

  Guess mean_around(std::uint32_t number, std::span<const std::uint32_t> corners,
                    std::span<const std::uint32_t> at) const;
  Guess guess_place(std::uint32_t place) const;
  Guess guess_other(std::uint32_t vertex) const;
  Guess guess_group(std::uint32_t vertex) const;
  Guess guess_normal(std::uint32_t vertex) const;
  Guess guess_uv(std::uint32_t vertex) const;
  struct Unfolded {
    std::array<double, 2> uv{};
    bool certain = false;
  };
  [[nodiscard]] Unfolded unfold(std::uint32_t vertex, std::uint32_t corner) const;
  void code_values(std::uint32_t number, const Guess& guess, std::byte* values);
  void code_normal(std::uint32_t number, Guess guess, std::byte* values);
  void code_value(std::uint32_t number, std::size_t component, std::size_t place,
                  const Guess& guess, std::byte* values);
  std::int32_t code_number(std::int32_t number, NumberModel& model);

  RangeCoder& coder_;
  const CodedTriangles& triangles_;
  const Fans places_;
  const Fans vertices_;
  std::vector<std::uint32_t> place_of_;  ///< of each vertex
  Values positions_;                     ///< of the places
  // Of the attribute that is coded:
  AttributeRecord attribute_{};
  Values coded_;
  std::vector<NumberModel> models_;
  int error_ = 0;  ///< of the vertex's components so far, half bits
};

}  // namespace modar
