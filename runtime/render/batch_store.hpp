// Copies of small meshes side by side in one buffer, each vertex with the number of its slot: one
// draw call draws many items on contexts without instancing (ModAR 4.2: uniform matrix array and
// index stream). Batches stay until their place is needed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "runtime/render/gl.hpp"
#include "runtime/render/vertex_format.hpp"

namespace modar {

/// A mesh, as a range of the bundle's indices that count from one vertex range.
struct MeshRange {
  std::uint32_t level = 0;  ///< the first one; its vertex and index offsets are the range's
  std::uint32_t vertex_count = 0;
  std::uint32_t index_count = 0;
  bool operator==(const MeshRange&) const = default;
};

/// A number of copies of a mesh.
struct BatchPart {
  MeshRange mesh;
  std::uint32_t copies = 0;
};

/// The place of a part in a batch's buffers.
struct BatchPlace {
  std::uint32_t first_slot = 0;
  std::uint32_t copies = 0;
  std::uintptr_t index_offset = 0;  ///< bytes from the batch's first index
  MeshRange mesh;
};

/// One batch in GL: vertices of format.stride bytes, the slot stream behind them, and indices.
/// Without GL buffers, the names are 0 and the offsets addresses in `client`.
struct Batch {
  GLuint vertices = 0;
  GLuint indices = 0;
  std::uintptr_t vertices_offset = 0;
  std::uintptr_t slots_offset = 0;  ///< 4 bytes a vertex, the slot in the first
  std::uintptr_t indices_offset = 0;
  std::vector<std::byte> client;
  std::uint32_t layout = 0;
  std::uint64_t bytes = 0;
  std::uint64_t last_used = 0;
  std::vector<BatchPlace> places;
};

inline constexpr std::uint32_t kBatchVertices = 65535;  ///< 16-bit indices

class BatchStore {
 public:
  /// budget: bytes of GL memory that all batches together may take.
  BatchStore(const BundleView& bundle, std::span<const VertexFormat> formats, std::uint64_t budget)
      : bundle_(bundle), formats_(formats), budget_(budget) {}

  /// From now on find() answers nullptr.
  void make_none() { budget_ = 0; }

  /// A batch that holds at least the asked copies of each part, made if none exists. The parts
  /// together have at most kBatchVertices vertices and `slots` copies. The answer lives until the
  /// next call; nullptr where the budget has no room for it.
  const Batch* find(std::uint32_t layout, std::span<const BatchPart> parts, std::uint32_t slots,
                    bool client_arrays, GlState& gl);
  void release(GlState& gl);

  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] std::uint64_t uploaded_bytes() const { return uploaded_bytes_; }

 private:
  Batch make(std::uint32_t layout, std::span<const BatchPart> parts);
  void upload(Batch& batch, GlState& gl);
  void keep_in_memory(Batch& batch) const;
  void write_part(const BatchPart& part, std::uint32_t layout, Batch& batch);
  bool make_room(std::uint64_t bytes, GlState& gl);
  void destroy_oldest(GlState& gl);

  const BundleView& bundle_;
  std::span<const VertexFormat> formats_;
  std::vector<Batch> batches_;
  std::vector<std::byte> vertex_bytes_;
  std::vector<std::uint8_t> slot_bytes_;
  std::vector<std::uint16_t> index_bytes_;
  std::uint64_t budget_ = 0;
  std::uint64_t uses_ = 0;
  std::uint64_t uploaded_bytes_ = 0;
};

}  // namespace modar
