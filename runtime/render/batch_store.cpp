// Copies of small meshes side by side in one buffer, each vertex with the number of its slot.
#include "runtime/render/batch_store.hpp"

#include <algorithm>
#include <cstring>

namespace modar {
namespace {

/// More batches keep more mixes of models from being copied again; each call looks through them
/// all. Their bytes have a bound of their own.
constexpr std::size_t kMostBatches = 16;

bool holds(const Batch& batch, std::span<const BatchPart> parts) {
  return std::all_of(parts.begin(), parts.end(), [&](const BatchPart& part) {
    return std::any_of(batch.places.begin(), batch.places.end(), [&](const BatchPlace& place) {
      return place.mesh == part.mesh && place.copies >= part.copies;
    });
  });
}

}  // namespace

const Batch* BatchStore::find(std::uint32_t layout, std::span<const BatchPart> parts,
                              std::uint32_t slots, bool client_arrays, GlState& gl) {
  ++uses_;
  for (Batch& batch : batches_) {
    // A batch made for more slots than this program has would name slots that it lacks.
    if (batch.layout != layout || batch.client.empty() == client_arrays) continue;
    if (!holds(batch, parts)) continue;
    if (batch.places.back().first_slot + batch.places.back().copies > slots) continue;
    batch.last_used = uses_;
    return &batch;
  }
  std::uint64_t bytes = 0;
  for (const BatchPart& part : parts) {
    const std::uint64_t one =
        std::uint64_t{part.mesh.vertex_count} * (formats_[layout].stride + 4) +
        std::uint64_t{part.mesh.index_count} * 2;
    bytes += one * part.copies;
  }
  if (!make_room(bytes, gl)) return nullptr;
  batches_.push_back(make(layout, parts));
  if (client_arrays) {
    keep_in_memory(batches_.back());
  } else {
    upload(batches_.back(), gl);
  }
  batches_.back().last_used = uses_;
  return &batches_.back();
}

bool BatchStore::make_room(std::uint64_t bytes, GlState& gl) {
  if (bytes > budget_) return false;
  while (batches_.size() >= kMostBatches || this->bytes() + bytes > budget_) destroy_oldest(gl);
  return true;
}

Batch BatchStore::make(std::uint32_t layout, std::span<const BatchPart> parts) {
  vertex_bytes_.clear();
  slot_bytes_.clear();
  index_bytes_.clear();
  Batch batch;
  batch.layout = layout;
  for (const BatchPart& part : parts) write_part(part, layout, batch);
  batch.bytes =
      vertex_bytes_.size() + slot_bytes_.size() + index_bytes_.size() * sizeof index_bytes_[0];
  return batch;
}

void BatchStore::upload(Batch& batch, GlState& gl) {
  const GLsizeiptr vertex_size = static_cast<GLsizeiptr>(vertex_bytes_.size());
  const GLsizeiptr slot_size = static_cast<GLsizeiptr>(slot_bytes_.size());
  batch.slots_offset = vertex_bytes_.size();
  glGenBuffers(1, &batch.vertices);
  gl.bind_array_buffer(batch.vertices);
  glBufferData(GL_ARRAY_BUFFER, vertex_size + slot_size, nullptr, GL_STATIC_DRAW);
  glBufferSubData(GL_ARRAY_BUFFER, 0, vertex_size, vertex_bytes_.data());
  glBufferSubData(GL_ARRAY_BUFFER, vertex_size, slot_size, slot_bytes_.data());
  glGenBuffers(1, &batch.indices);
  gl.bind_index_buffer(batch.indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(index_bytes_.size() * sizeof index_bytes_[0]),
               index_bytes_.data(), GL_STATIC_DRAW);
  uploaded_bytes_ += batch.bytes;
}

void BatchStore::keep_in_memory(Batch& batch) const {
  batch.client = vertex_bytes_;
  const auto slots = std::as_bytes(std::span(slot_bytes_));
  batch.client.insert(batch.client.end(), slots.begin(), slots.end());
  const auto indices = std::as_bytes(std::span(index_bytes_));
  batch.client.insert(batch.client.end(), indices.begin(), indices.end());
  batch.vertices_offset = reinterpret_cast<std::uintptr_t>(batch.client.data());
  batch.slots_offset = batch.vertices_offset + vertex_bytes_.size();
  batch.indices_offset = batch.slots_offset + slot_bytes_.size();
}

void BatchStore::write_part(const BatchPart& part, std::uint32_t layout, Batch& batch) {
  const VertexFormat& format = formats_[layout];
  const LevelRecord& level = bundle_.levels()[part.mesh.level];
  const std::size_t count = part.mesh.vertex_count;
  const std::span<const std::byte> source = bundle_.vertices().subspan(
      static_cast<std::size_t>(level.vertex_offset), count * format.source_stride);
  BatchPlace place;
  place.mesh = part.mesh;
  place.copies = part.copies;
  place.index_offset = index_bytes_.size() * sizeof index_bytes_[0];
  if (!batch.places.empty()) {
    place.first_slot = batch.places.back().first_slot + batch.places.back().copies;
  }
  std::vector<std::uint16_t> indices(part.mesh.index_count);
  std::memcpy(indices.data(), bundle_.indices().data() + level.index_offset,
              indices.size() * sizeof indices[0]);
  for (std::uint32_t copy = 0; copy < part.copies; ++copy) {
    const std::size_t first_vertex = vertex_bytes_.size() / format.stride;
    const std::size_t at = vertex_bytes_.size();
    vertex_bytes_.resize(at + count * format.stride);
    const std::span<std::byte> target(vertex_bytes_.data() + at, count * format.stride);
    if (format.widened) {
      widen_vertices(format, source, target);
    } else {
      std::memcpy(target.data(), source.data(), source.size());
    }
    // Four bytes a vertex: attributes at multiples of 4 are what every GPU reads.
    const std::size_t slots_at = slot_bytes_.size();
    slot_bytes_.resize(slots_at + count * 4);
    for (std::size_t v = 0; v < count; ++v) {
      slot_bytes_[slots_at + v * 4] = static_cast<std::uint8_t>(place.first_slot + copy);
    }
    for (const std::uint16_t index : indices) {
      index_bytes_.push_back(static_cast<std::uint16_t>(first_vertex + index));
    }
  }
  batch.places.push_back(place);
}

void BatchStore::destroy_oldest(GlState& gl) {
  const auto oldest =
      std::min_element(batches_.begin(), batches_.end(),
                       [](const Batch& a, const Batch& b) { return a.last_used < b.last_used; });
  const GLuint names[] = {oldest->vertices, oldest->indices};
  for (const GLuint name : names) gl.forget_buffer(name);
  glDeleteBuffers(2, names);
  batches_.erase(oldest);
}

void BatchStore::release(GlState& gl) {
  while (!batches_.empty()) destroy_oldest(gl);
}

std::uint64_t BatchStore::bytes() const {
  std::uint64_t sum = 0;
  for (const Batch& batch : batches_) sum += batch.bytes;
  return sum;
}

}  // namespace modar
