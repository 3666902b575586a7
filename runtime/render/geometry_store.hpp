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

/// Where a level's vertices and indices lie in GL.
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
  /// Bytes of the section of indices or vertices from `offset` on, once expect() has made room.
  void put(bool indices, std::uint64_t offset, std::span<const std::byte> bytes);
  /// In place of upload(), where not all bytes are there: levels are uploaded when they are used.
  void upload_when_used();
  /// Deletes the GL buffers.
  void release(GlState& gl);

  /// From now on use() answers addresses in the mapped bytes, and 0 for the buffers.
  void set_client_arrays(bool wanted) { client_arrays_ = wanted && !rewrites_ && !streams_; }
  [[nodiscard]] bool client_arrays() const { return client_arrays_; }

  /// Starts a frame: what is used from here on is not evicted before the next one.
  void begin_frame() { ++frame_; }
  /// Makes a level resident and answers where; false if the budget holds no room beside what this
  /// frame uses already. Uploads and evicts where need be.
  bool use(std::uint32_t level, GlState& gl, LevelPlace& place);

  /// True if the budget holds all these levels at once.
  [[nodiscard]] bool fits(std::span<const std::uint32_t> levels);

  [[nodiscard]] bool streams() const { return streams_; }
  [[nodiscard]] std::uint64_t resident_bytes() const { return resident_bytes_; }
  [[nodiscard]] std::uint64_t total_bytes() const { return vertex_total_ + index_total_; }
  [[nodiscard]] std::uint64_t uploaded_bytes() const { return uploaded_bytes_; }
  [[nodiscard]] std::uint64_t evictions() const { return evictions_; }

 private:
  /// Bytes of the bundle that are uploaded together. Levels that start at the same vertex share
  /// one.
  struct Range {
    std::uint64_t source = 0;  ///< bytes from the start of the section
    std::uint64_t size = 0;    ///< bytes in the section
    std::uint64_t gpu_size = 0;
    std::uint64_t gpu_offset = 0;
    std::uint32_t layout = kNone;  ///< kNone: indices
    GLuint buffer = 0;
    std::uint64_t last_used = 0;  ///< frame
  };

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
  std::vector<std::byte> scratch_;  ///< rewritten vertices on their way
  std::uint64_t budget_ = 0;
  std::uint64_t vertex_total_ = 0;
  std::uint64_t index_total_ = 0;
  std::uint64_t resident_bytes_ = 0;
  std::uint64_t uploaded_bytes_ = 0;
  std::uint64_t evictions_ = 0;
  std::uint64_t frame_ = 1;
  GLuint whole_vertices_ = 0;
  GLuint whole_indices_ = 0;
  bool streams_ = false;
  bool rewrites_ = false;
  bool client_arrays_ = false;
};

}  // namespace modar
