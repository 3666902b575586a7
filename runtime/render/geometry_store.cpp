// Vertices and indices in GL buffers, straight from the mapped bytes.
#include "runtime/render/geometry_store.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "formats/transport/stages.hpp"
#include "formats/vertex_scan.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// Vertices widened at a time. More take memory, fewer need more calls of glBufferSubData.
constexpr std::size_t kScratchVertices = 4096;

/// The fault if vertices cannot be uploaded unchanged.
Result<void> rewritten() {
  return fail(ExitCode::kUnsupported, "gl.halves", "vertices",
              "this context reads no half floats, and vertices are rewritten for it",
              "keep the whole bundle in memory");
}

constexpr GLenum kCopyReadBuffer = 0x8F36;  ///< of ES 3, which gl2.h does not name

GLuint make_buffer(GLenum target) {
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(target, buffer);
  return buffer;
}

}  // namespace

GeometryStore::GeometryStore(const BundleView& bundle, std::span<const VertexFormat> formats,
                             std::uint64_t budget)
    : bundle_(bundle), formats_(formats.begin(), formats.end()), budget_(budget) {
  std::uint32_t widest = 0;
  for (const VertexFormat& format : formats_) {
    rewrites_ = rewrites_ || format.widened;
    if (format.widened) widest = std::max(widest, format.stride);
  }
  scratch_.resize(kScratchVertices * widest);
  collect_ranges();
  list_budget_ = budget_;
  streams_ = budget_ != 0 && total_bytes() > budget_;
}

void GeometryStore::collect_ranges() {
  const Table<LevelRecord> levels = bundle_.levels();
  index_ranges_.resize(levels.size());
  level_vertices_.assign(levels.size(), 0);
  vertex_ranges_.assign(levels.size(), Range{});
  // A level's layout is its model's. Levels that no model has are never drawn.
  for (std::uint32_t g = 0; g < bundle_.chunk_groups(); ++g) {
    const ChunkGroup group = bundle_.chunk_group(g);
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle_.chunks()[group.first_chunk + c];
      for (std::uint32_t i = 0; i < chunk.level_count; ++i) {
        Range& vertices = vertex_ranges_[chunk.first_level + i];
        vertices.layout = bundle_.models()[group.model].layout;
        const bool coarsest = i + 1 == chunk.level_count;
        vertices.rank = index_ranges_[chunk.first_level + i].rank = g >= bundle_.models().size()
                                                                        ? kProxy
                                                                    : coarsest ? kCoarsest
                                                                               : 0;
      }
    }
  }
  for (std::uint32_t i = 0; i < levels.size(); ++i) {
    Range& vertices = vertex_ranges_[i];
    if (vertices.layout == kNone) continue;
    const VertexFormat& format = formats_[vertices.layout];
    vertices.source = levels[i].vertex_offset;
    vertices.size = std::uint64_t{levels[i].vertex_count} * format.source_stride;
    Range& indices = index_ranges_[i];
    indices.source = levels[i].index_offset;
    indices.size = std::uint64_t{levels[i].index_count} * 2;
    indices.gpu_size = indices.size;
    index_total_ += indices.size;
  }
  merge_vertex_ranges();
}

/// One range a distinct start and size: a coarser level may use the first vertices of a finer one.
void GeometryStore::merge_vertex_ranges() {
  std::vector<std::uint32_t> order(vertex_ranges_.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const Range& left = vertex_ranges_[a];
    const Range& right = vertex_ranges_[b];
    return std::tie(left.layout, left.source, left.size) <
           std::tie(right.layout, right.source, right.size);
  };
  // Once a bundle: std::sort() is four times as long.
  std::make_heap(order.begin(), order.end(), before);
  std::sort_heap(order.begin(), order.end(), before);
  std::vector<Range> merged;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Range& range = vertex_ranges_[order[i]];
    if (i == 0 || before(order[i - 1], order[i])) merged.push_back(range);
    merged.back().rank = std::max(merged.back().rank, range.rank);
    level_vertices_[order[i]] = static_cast<std::uint32_t>(merged.size() - 1);
  }
  // From the end: of those that begin alike, the largest holds the others where all are uploaded.
  for (std::size_t i = merged.size(); i-- > 0;) {
    Range& range = merged[i];
    if (range.layout == kNone) continue;
    const VertexFormat& format = formats_[range.layout];
    range.gpu_size = range.size / format.source_stride * format.stride;
    const bool held = i + 1 < merged.size() && begin_alike(range, merged[i + 1]);
    range.gpu_offset = held ? merged[i + 1].gpu_offset : rewrites_ ? vertex_total_ : range.source;
    if (!held) vertex_total_ += range.gpu_size;
  }
  vertex_ranges_ = std::move(merged);
  counted_.assign(vertex_ranges_.size(), 0);
  for (Range& range : index_ranges_) range.gpu_offset = range.source;
}

bool GeometryStore::indices_valid(std::uint32_t level) const {
  const LevelRecord& record = bundle_.levels()[level];
  const auto* first =
      reinterpret_cast<const std::uint16_t*>(bundle_.indices().data() + record.index_offset);
  return record.index_count == 0 ||
         scan_indices({first, record.index_count}).greatest < record.vertex_count;
}

Result<void> GeometryStore::upload() {
  if (streams_) return {};
  for (std::uint32_t level = 0; level < bundle_.levels().size(); ++level) {
    if (indices_valid(level)) continue;
    return fail(ExitCode::kInvalidInput, "level.index", "level " + std::to_string(level),
                "an index refers to a vertex that its level lacks",
                "run modar check on the bundle");
  }
  upload_whole();
  return {};
}

void GeometryStore::upload_whole() {
  const std::span<const std::byte> vertices = bundle_.vertices();
  const std::span<const std::byte> indices = bundle_.indices();
  expect_reading(vertices);
  expect_reading(indices);
  whole_vertices_ = make_buffer(GL_ARRAY_BUFFER);
  if (rewrites_) {
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertex_total_), nullptr, GL_STATIC_DRAW);
    for (const Range& range : vertex_ranges_) {
      if (range.layout != kNone) fill(range, GL_ARRAY_BUFFER, range.gpu_offset);
    }
  } else {
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size()), vertices.data(),
                 GL_STATIC_DRAW);
    uploaded_bytes_ += vertices.size();
  }
  whole_indices_ = make_buffer(GL_ELEMENT_ARRAY_BUFFER);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size()), indices.data(),
               GL_STATIC_DRAW);
  uploaded_bytes_ += indices.size();
  resident_bytes_ = (rewrites_ ? vertex_total_ : vertices.size()) + indices.size();
}

Result<void> GeometryStore::expect() {
  if (rewrites_) return rewritten();
  resident_bytes_ = bundle_.vertices().size() + bundle_.indices().size();
  whole_vertices_ = make_buffer(GL_ARRAY_BUFFER);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bundle_.vertices().size()), nullptr,
               GL_STATIC_DRAW);
  whole_indices_ = make_buffer(GL_ELEMENT_ARRAY_BUFFER);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(bundle_.indices().size()), nullptr,
               GL_STATIC_DRAW);
  return {};
}

Result<void> GeometryStore::expect_wanted() {
  if (rewrites_) return rewritten();
  copy_buffer_ = look_up_copy_buffer();
  streams_ = arrives_ = true;
  // A level that is drawn until a finer one of the same chunks has come has half its triangles and
  // some of its vertices at most: both fit.
  list_budget_ = budget_ / 3 * 2;
  find_kept(false);
  find_kept(true);
  return {};
}

/// Ranges inside one of shown_geometry().
void GeometryStore::find_kept(bool indices) {
  const std::vector<StageRange> shown = shown_geometry(bundle_, indices);
  for (Range& range : indices ? index_ranges_ : vertex_ranges_) {
    range.kept = range.size == 0;
    for (const StageRange& part : shown) {
      range.kept = range.kept || (part.offset <= range.source &&
                                  range.source + range.size <= part.offset + part.size);
    }
  }
}

bool GeometryStore::there(std::span<const std::uint32_t> levels) const {
  return std::all_of(levels.begin(), levels.end(), [this](std::uint32_t level) {
    return there(vertex_ranges_[level_vertices_[level]]) && there(index_ranges_[level]);
  });
}

void GeometryStore::want(std::span<const std::uint32_t> levels) {
  wanted_.clear();
  const auto add = [this](std::uint32_t number) {
    if (!there(range(number))) wanted_.push_back(number);
  };
  for (std::size_t i = levels.size(); i-- > 0;) {
    add(static_cast<std::uint32_t>(vertex_ranges_.size()) + levels[i]);
    add(level_vertices_[levels[i]]);
  }
}

std::uint32_t GeometryStore::open_wanted(GlState& gl, bool& indices, std::uint64_t& offset,
                                         std::uint64_t& size) {
  for (; !wanted_.empty(); wanted_.pop_back()) {
    const std::uint32_t number = wanted_.back();
    Range& next = range(number);
    if (next.buffer != 0) continue;
    if (resident_bytes_ + next.size > budget_ && !evict(next.size, gl)) return kNone;
    indices = next.layout == kNone;
    const GLenum target = indices ? GL_ELEMENT_ARRAY_BUFFER : GL_ARRAY_BUFFER;
    next.buffer = make_buffer(target);
    glBufferData(target, static_cast<GLsizeiptr>(next.size), nullptr, GL_STATIC_DRAW);
    next.last_used = kOpen;
    resident_bytes_ += next.gpu_size;
    const std::uint64_t copied = indices ? 0 : copy_front(next);
    offset = next.source + copied;
    size = next.size - copied;
    if (size == 0) {
      next.last_used = frame_;
      continue;
    }
    open_.push_back(number);
    return number;
  }
  return kNone;
}

/// Copies to an open range, whose buffer is bound, what others have that begin alike; answers how
/// many bytes.
std::uint64_t GeometryStore::copy_front(const Range& to) const {
  const Range* from = nullptr;
  for (const Range& range : vertex_ranges_) {
    if (range.buffer == 0 || range.last_used == kOpen || !begin_alike(range, to)) continue;
    if (from == nullptr || range.size > from->size) from = &range;
  }
  if (from == nullptr || copy_buffer_ == nullptr) return 0;
  const std::uint64_t bytes = std::min(from->size, to.size);
  glBindBuffer(kCopyReadBuffer, from->buffer);
  copy_buffer_(kCopyReadBuffer, GL_ARRAY_BUFFER, 0, 0, static_cast<GLsizeiptr>(bytes));
  return bytes;
}

void GeometryStore::have(std::uint32_t number) {
  const auto found = std::find(open_.begin(), open_.end(), number);
  if (found == open_.end()) return;
  open_.erase(found);
  range(number).last_used = frame_;
}

void GeometryStore::put_open(bool indices, std::uint64_t offset, std::span<const std::byte> bytes) {
  const GLenum target = indices ? GL_ELEMENT_ARRAY_BUFFER : GL_ARRAY_BUFFER;
  for (const std::uint32_t number : open_) {
    const Range& to = range(number);
    if ((to.layout == kNone) != indices) continue;
    const Overlap part = overlap(to.source, to.size, offset, bytes);
    if (part.bytes.empty()) continue;
    glBindBuffer(target, to.buffer);
    glBufferSubData(target, static_cast<GLintptr>(part.at),
                    static_cast<GLsizeiptr>(part.bytes.size()), part.bytes.data());
    uploaded_bytes_ += part.bytes.size();
  }
}

void GeometryStore::put(bool indices, std::uint64_t offset, std::span<const std::byte> bytes) {
  if (streams_) return put_open(indices, offset, bytes);
  const GLenum target = indices ? GL_ELEMENT_ARRAY_BUFFER : GL_ARRAY_BUFFER;
  glBindBuffer(target, indices ? whole_indices_ : whole_vertices_);
  glBufferSubData(target, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes.size()),
                  bytes.data());
  uploaded_bytes_ += bytes.size();
}

void GeometryStore::upload_when_used() {
  streams_ = true;
  if (budget_ == 0) budget_ = ~std::uint64_t{0};
}

/// Copies a range to `offset` of the buffer that is bound to `target`.
void GeometryStore::fill(const Range& range, GLenum target, std::uint64_t offset) {
  const bool is_vertices = range.layout != kNone;
  const std::span<const std::byte> section = is_vertices ? bundle_.vertices() : bundle_.indices();
  const std::span<const std::byte> source =
      section.subspan(static_cast<std::size_t>(range.source), static_cast<std::size_t>(range.size));
  uploaded_bytes_ += range.gpu_size;
  if (!is_vertices || !formats_[range.layout].widened) {
    glBufferSubData(target, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(source.size()),
                    source.data());
    return;
  }
  const VertexFormat& format = formats_[range.layout];
  const std::size_t step = kScratchVertices * format.source_stride;
  for (std::size_t at = 0; at < source.size(); at += step) {
    const std::span<const std::byte> part = source.subspan(at, std::min(step, source.size() - at));
    const std::size_t bytes = part.size() / format.source_stride * format.stride;
    const std::span<std::byte> rewritten(scratch_.data(), bytes);
    widen_vertices(format, part, rewritten);
    glBufferSubData(target, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes),
                    rewritten.data());
    offset += bytes;
  }
}

bool GeometryStore::fits(std::span<const std::uint32_t> levels) {
  ++counts_;
  std::uint64_t bytes = 0;
  for (const std::uint32_t level : levels) {
    const std::uint32_t range = level_vertices_[level];
    if (std::exchange(counted_[range], counts_) != counts_) {
      bytes += vertex_ranges_[range].gpu_size;
    }
    bytes += index_ranges_[level].gpu_size;
  }
  return bytes <= list_budget_;
}

bool GeometryStore::use(std::uint32_t level, GlState& gl, LevelPlace& place) {
  Range& vertices = vertex_ranges_[level_vertices_[level]];
  Range& indices = index_ranges_[level];
  if (client_arrays_) {
    const auto address = [](std::span<const std::byte> section, std::uint64_t offset) {
      return reinterpret_cast<std::uintptr_t>(section.data() + offset);
    };
    place = {0, 0, address(bundle_.vertices(), vertices.source),
             address(bundle_.indices(), indices.source)};
    return true;
  }
  if (!streams_) {
    // GL's offsets are pointers: on a 32-bit device, what a buffer holds fits them too.
    place = {whole_vertices_, whole_indices_, static_cast<std::uintptr_t>(vertices.gpu_offset),
             static_cast<std::uintptr_t>(indices.gpu_offset)};
    return true;
  }
  // Stamped before room is made, so that making room for one does not throw out the other.
  vertices.last_used = frame_;
  indices.last_used = frame_;
  if (indices.buffer == 0 && !indices_valid(level)) return false;
  if (!make_resident(vertices, gl) || !make_resident(indices, gl)) return false;
  place = {vertices.buffer, indices.buffer, 0, 0};
  return true;
}

bool GeometryStore::make_resident(Range& range, GlState& gl) {
  if (range.buffer != 0) return true;
  if (resident_bytes_ + range.gpu_size > budget_ && !evict(range.gpu_size, gl)) return false;
  const bool is_vertices = range.layout != kNone;
  const GLenum target = is_vertices ? GL_ARRAY_BUFFER : GL_ELEMENT_ARRAY_BUFFER;
  glGenBuffers(1, &range.buffer);
  if (is_vertices) {
    gl.bind_array_buffer(range.buffer);
  } else {
    gl.bind_index_buffer(range.buffer);
  }
  if (is_vertices && formats_[range.layout].widened) {
    glBufferData(target, static_cast<GLsizeiptr>(range.gpu_size), nullptr, GL_STATIC_DRAW);
    fill(range, target, 0);
  } else {
    const std::span<const std::byte> section = is_vertices ? bundle_.vertices() : bundle_.indices();
    glBufferData(target, static_cast<GLsizeiptr>(range.size), section.data() + range.source,
                 GL_STATIC_DRAW);
    uploaded_bytes_ += range.gpu_size;
  }
  resident_bytes_ += range.gpu_size;
  return true;
}

/// Deletes the ranges that were used longest ago until `bytes` fit, of each chunk its coarsest
/// level and proxies last: where one chunk of a view is missing, a proxy is drawn.
/// Nothing of this frame.
bool GeometryStore::evict(std::uint64_t bytes, GlState& gl) {
  while (resident_bytes_ + bytes > budget_) {
    Range* oldest = nullptr;
    for (std::vector<Range>* ranges : {&vertex_ranges_, &index_ranges_}) {
      for (Range& range : *ranges) {
        if (range.buffer == 0 || range.last_used >= frame_) continue;
        if (oldest == nullptr || range.age() < oldest->age()) oldest = &range;
      }
    }
    if (oldest == nullptr) return false;
    gl.forget_buffer(oldest->buffer);
    glDeleteBuffers(1, &oldest->buffer);
    oldest->buffer = 0;
    resident_bytes_ -= oldest->gpu_size;
    ++evictions_;
  }
  return true;
}

void GeometryStore::release(GlState& gl) {
  for (std::vector<Range>* ranges : {&vertex_ranges_, &index_ranges_}) {
    for (Range& range : *ranges) {
      if (range.buffer == 0) continue;
      gl.forget_buffer(range.buffer);
      glDeleteBuffers(1, &range.buffer);
    }
  }
  const GLuint whole[] = {whole_vertices_, whole_indices_};
  for (const GLuint buffer : whole) gl.forget_buffer(buffer);
  glDeleteBuffers(2, whole);
}

}  // namespace modar
