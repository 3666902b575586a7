// Vertices and indices in GL buffers, straight from the mapped bytes: all of them in two buffers
// where they fit the budget, else those ranges that were drawn last, a buffer each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "runtime/render/gl.hpp"
#include "runtime/render/vertex_format.hpp"

namespace modar {

/// The places of a level's vertices and indices in GL.
struct LevelPlace {
  GLuint vertex_buffer = 0;
  GLuint index_buffer = 0;
  std::uintptr_t vertex_offset = 0;  ///< bytes
  std::uintptr_t index_offset = 0;   ///< bytes
};

class GeometryStore {
 public:
  /// formats: one a layout record. budget: bytes of GL memory, 0: no limit. Sets up the
  /// bookkeeping; no GL call.
  GeometryStore(const BundleView& bundle, std::span<const VertexFormat> formats,
                std::uint64_t budget);

  /// Uploads what fits (all, or nothing yet) into the current context. Errors: kInvalidInput
  /// "level.index" where an index refers to a vertex that its level lacks: GL need not bound what a
  /// draw call reads. Levels that are uploaded later are checked then, and not drawn.
  Result<void> upload();
  /// In place of upload(), where the bytes come later: makes the buffers for put(). Errors:
  /// kUnsupported "gl.halves" where vertices would have to be rewritten on their way.
  Result<void> expect();
  /// In place of upload(), where bytes come when want() asks for them: levels that shown_geometry()
  /// names are in the bundle's bytes, and uploaded when they are used; use() is for those that are
  /// there(). fits() is for two thirds of the budget, so that drawn levels leave room for requested
  /// ones. Errors: as expect().
  Result<void> expect_wanted();
  /// After expect_wanted(): whether these levels can be used.
  [[nodiscard]] bool there(std::span<const std::uint32_t> levels) const;
  /// Missing levels of these are requested from now on, in their order, and nothing else.
  void want(std::span<const std::uint32_t> levels);
  /// Makes room for the next range that is wanted; kNone: nothing is, or this frame uses the whole
  /// budget. The range's number is for have(), its bytes are counted from the start of their
  /// section.
  std::uint32_t open_wanted(GlState& gl, bool& indices, std::uint64_t& offset, std::uint64_t& size);
  /// All bytes of an open range were put().
  void have(std::uint32_t range);

  /// Bytes of the section of indices or vertices from `offset` on, once expect() has made room;
  /// after expect_wanted(), the part of them in open ranges.
  void put(bool indices, std::uint64_t offset, std::span<const std::byte> bytes);
  /// In place of upload(), where not all bytes are there: levels are uploaded when they are used.
  void upload_when_used();
  /// Deletes the GL buffers.
  void release(GlState& gl);

  /// From now on use() answers addresses in the mapped bytes, and 0 for the buffers.
  void set_client_arrays(bool wanted) { client_arrays_ = wanted && !rewrites_ && !streams_; }
  [[nodiscard]] bool client_arrays() const { return client_arrays_; }

  /// Starts a frame: levels used from here on are not evicted before the next one.
  void begin_frame() { ++frame_; }
  /// Makes a level resident and answers where; false if the budget has no room in addition to the
  /// levels of this frame. Uploads and evicts where need be.
  bool use(std::uint32_t level, GlState& gl, LevelPlace& place);

  /// True if the budget holds all these levels at once.
  [[nodiscard]] bool fits(std::span<const std::uint32_t> levels);

  [[nodiscard]] bool streams() const { return streams_; }
  /// It streams what the bundle's bytes do not hold: others load it as want() says.
  [[nodiscard]] bool arrives() const { return arrives_; }
  [[nodiscard]] std::uint64_t resident_bytes() const { return resident_bytes_; }
  [[nodiscard]] std::uint64_t total_bytes() const { return vertex_total_ + index_total_; }
  [[nodiscard]] std::uint64_t uploaded_bytes() const { return uploaded_bytes_; }
  [[nodiscard]] std::uint64_t evictions() const { return evictions_; }

 private:
  /// Bytes of the bundle that are uploaded together. Levels that use the same vertices share one.
  struct Range {
    std::uint64_t source = 0;  ///< bytes from the start of the section
    std::uint64_t size = 0;    ///< bytes in the section
    std::uint64_t gpu_size = 0;
    std::uint64_t gpu_offset = 0;
    std::uint32_t layout = kNone;  ///< kNone: indices
    GLuint buffer = 0;
    std::uint64_t last_used = 0;  ///< frame; kOpen: bytes of it still come
    bool kept = false;            ///< in the bundle's bytes, all of it
    std::uint64_t rank = 0;       ///< makes room after all of lower ones

    [[nodiscard]] std::uint64_t age() const { return last_used + rank; }
  };

  /// Ranks, more than all frames: of a chunk's coarsest level, of a proxy's.
  static constexpr std::uint64_t kCoarsest = std::uint64_t{1} << 61;
  static constexpr std::uint64_t kProxy = std::uint64_t{1} << 62;
  /// Later than all frames, so that it is not evicted.
  static constexpr std::uint64_t kOpen = ~std::uint64_t{0};

  /// Vertex ranges, then index ranges.
  [[nodiscard]] Range& range(std::uint32_t number) {
    const std::size_t vertices = vertex_ranges_.size();
    return number < vertices ? vertex_ranges_[number] : index_ranges_[number - vertices];
  }
  [[nodiscard]] static bool there(const Range& range) {
    return range.kept || (range.buffer != 0 && range.last_used != kOpen);
  }
  [[nodiscard]] static bool begin_alike(const Range& a, const Range& b) {
    return a.source == b.source && a.layout == b.layout;
  }
  [[nodiscard]] std::uint64_t copy_front(const Range& to) const;
  void find_kept(bool indices);
  void put_open(bool indices, std::uint64_t offset, std::span<const std::byte> bytes);
  void collect_ranges();
  void merge_vertex_ranges();
  [[nodiscard]] bool indices_valid(std::uint32_t level) const;
  void upload_whole();
  bool make_resident(Range& range, GlState& gl);
  bool evict(std::uint64_t bytes, GlState& gl);
  void fill(const Range& range, GLenum target, std::uint64_t offset);

  const BundleView& bundle_;
  std::vector<VertexFormat> formats_;
  std::vector<Range> vertex_ranges_;
  std::vector<Range> index_ranges_;            ///< one a level
  std::vector<std::uint32_t> level_vertices_;  ///< level to vertex range
  std::vector<std::uint32_t> counted_;         ///< of each vertex range: when fits() last saw it
  std::uint32_t counts_ = 0;
  std::vector<std::byte> scratch_;     ///< rewritten vertices on their way
  std::vector<std::uint32_t> wanted_;  ///< ranges, the next one last
  std::vector<std::uint32_t> open_;    ///< ranges
  CopyBuffer copy_buffer_ = nullptr;
  std::uint64_t budget_ = 0;
  std::uint64_t list_budget_ = 0;  ///< of fits()
  std::uint64_t vertex_total_ = 0;
  std::uint64_t index_total_ = 0;
  std::uint64_t resident_bytes_ = 0;
  std::uint64_t uploaded_bytes_ = 0;
  std::uint64_t evictions_ = 0;
  std::uint64_t frame_ = 1;
  GLuint whole_vertices_ = 0;
  GLuint whole_indices_ = 0;
  bool streams_ = false;
  bool arrives_ = false;
  bool rewrites_ = false;
  bool client_arrays_ = false;
};

}  // namespace modar
