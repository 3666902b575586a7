// Which vertices the triangles of a chunk have, coded by growing a region over their edges: each
// triangle is next to one that is known, and most have their third corner in one of three places
// (after Gumhold and Strasser, "Real time compression of triangle mesh connectivity", 1998).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "formats/transport/range_coder.hpp"

namespace modar {

inline constexpr std::uint32_t kNoEdge = 0xFFFFFFFFu;

/// Triangles in the order in which they travel. An edge has the number of the corner that it
/// starts at. Places are distinct positions: several vertices may be at one.
struct CodedTriangles {
  std::vector<std::uint32_t> places;    ///< of each corner, numbered by first use
  std::vector<std::uint32_t> vertices;  ///< of each corner, numbered by first use
  std::vector<std::uint32_t> opposite;  ///< of each edge: the same edge of a neighbour, or kNoEdge
  std::uint32_t place_count = 0;
  std::uint32_t vertex_count = 0;
  std::vector<std::uint32_t> source_vertices;  ///< of each vertex; of an encoder alone
  std::vector<std::uint32_t> source_places;    ///< of each place; a decoder has them if they travel
};

constexpr std::uint32_t next_corner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}
constexpr std::uint32_t last_corner(std::uint32_t corner) {
  return corner % 3 == 0 ? corner + 2 : corner - 1;
}

/// What an encoder codes: of each corner its vertex, and the place of that vertex.
struct SourceTriangles {
  std::span<const std::uint16_t> vertices;
  std::span<const std::uint16_t> places;
};

/// Codes triangles. Any set of triangles travels; corners may be equal.
class TriangleCoder {
 public:
  /// place_count: of all places where each one's number travels too and is its only vertex's, or 0.
  TriangleCoder(RangeCoder& coder, std::uint32_t triangle_count, std::uint32_t place_count);
  ~TriangleCoder();

  CodedTriangles encode(const SourceTriangles& source);
  /// Nothing where more vertices come than `most_vertices`, or more was read than the coder has.
  std::optional<CodedTriangles> decode(std::uint32_t most_vertices);

 private:
  class Neighbours;
  /// Decisions about the third corner, by how many triangles an edge's ends have, and whether the
  /// edges before and after it are open.
  struct EdgeModel {
    AdaptiveBit border, fresh, before, after;
  };
  /// An open edge, and the triangle on its other side: the edge's end, its start, a third corner.
  struct Crossing {
    std::uint32_t edge, before, after;
    std::uint32_t first;        ///< corner of the triangle
    bool fresh = false;         ///< the third corner's place is new
    bool joins_before = false;  ///< the edge before is the triangle's too
    bool joins_after = false;
  };

  void run();
  void code_seed();
  void cross(std::uint32_t edge);
  bool code_border(std::uint32_t edge, EdgeModel& model, std::uint32_t& third);
  void code_third(Crossing& crossing, EdgeModel& model, std::uint32_t wanted);
  void code_corners(const Crossing& crossing);
  void link_border(const Crossing& crossing);
  void count_triangle(std::uint32_t first);
  void code_vertex(std::uint32_t corner, std::uint32_t likely, std::uint32_t other,
                   std::size_t kind);
  bool search_vertex(std::uint32_t corner, std::uint32_t wanted, std::uint32_t likely,
                     std::uint32_t other);
  void add_vertex(std::uint32_t corner);
  void add_place(std::uint32_t corner, std::uint32_t near);
  void know_place(std::uint32_t corner);
  std::uint32_t code_number(std::uint32_t number, std::uint32_t near);
  [[nodiscard]] std::uint32_t wanted_place(std::size_t k) const;
  [[nodiscard]] std::uint32_t wanted_vertex(std::size_t k) const;
  void open(std::uint32_t edge);
  void link(std::uint32_t before, std::uint32_t after);
  EdgeModel& model_of(std::uint32_t edge);
  [[nodiscard]] bool bad() const { return failed_ || coder_.overrun(); }

  RangeCoder& coder_;
  const std::uint32_t count_;
  const std::uint32_t numbered_;
  std::uint32_t most_vertices_ = 65536;
  bool failed_ = false;
  CodedTriangles out_;
  std::uint32_t coded_ = 0;  ///< triangles
  std::vector<std::uint32_t> queue_;
  std::size_t crossed_ = 0;            ///< of queue_
  std::vector<std::uint32_t> before_;  ///< of each open edge: those next to it on the border
  std::vector<std::uint32_t> after_;
  std::vector<std::uint8_t> open_;
  std::vector<std::uint8_t> degree_;          ///< of each place: triangles, up to 7
  std::vector<std::uint32_t> start_;          ///< of each place: the latest edge from there
  std::vector<std::uint32_t> newest_vertex_;  ///< of each place
  std::vector<std::uint32_t> older_vertex_;   ///< of each vertex: another of its place
  std::array<EdgeModel, 256> edges_{};
  std::array<AdaptiveBit, 3> seeds_{};
  std::array<std::array<AdaptiveBit, 2>, 4> vertices_{};
  std::array<AdaptiveBit, 17> searches_{};
  std::array<AdaptiveBit, 18> number_sizes_{};
  AdaptiveBit number_sign_;

  // Of an encoder:
  std::unique_ptr<Neighbours> neighbours_;
  SourceTriangles source_;
  std::array<std::uint32_t, 3> corners_{};     ///< of the source's triangle
  std::vector<std::uint32_t> coded_places_;    ///< of the source's places; kNoEdge: none yet
  std::vector<std::uint32_t> coded_vertices_;  ///< of the source's vertices
};

}  // namespace modar
