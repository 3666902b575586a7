// Set-up of the painter, and what every piece needs set: surface, slot, attributes.
#include "runtime/render/model_painter.hpp"

#include <algorithm>
#include <cstring>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace modar {
namespace {

/// More slots than this bring nothing: a call for so many is no cost any more.
constexpr int kMostSlots = 64;

glm::vec4 colour(const float (&rgb)[3], float factor, float fourth) {
  return {rgb[0] * factor, rgb[1] * factor, rgb[2] * factor, fourth};
}

void set_vector(GLint place, const glm::vec4& value, RenderStats& stats) {
  glUniform4fv(place, 1, glm::value_ptr(value));
  stats.bytes_uploaded += sizeof value;
}

bool equal_surface(const MaterialRecord& a, const MaterialRecord& b) {
  return std::ranges::equal(a.ambient, b.ambient) && std::ranges::equal(a.diffuse, b.diffuse) &&
         std::ranges::equal(a.specular, b.specular) && std::ranges::equal(a.emission, b.emission) &&
         a.shininess == b.shininess && a.opacity == b.opacity && a.texture == b.texture &&
         a.flags == b.flags;
}

bool equal_layout(const LayoutRecord& a, const LayoutRecord& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

Slot make_slot(const glm::mat4& to_eye, const ChunkRecord& chunk) {
  Slot slot;
  const glm::vec4 offset(chunk.position_offset[0], chunk.position_offset[1],
                         chunk.position_offset[2], 1.0f);
  for (int row = 0; row < 3; ++row) {
    const glm::vec4 line(to_eye[0][row], to_eye[1][row], to_eye[2][row], to_eye[3][row]);
    slot[static_cast<std::size_t>(row)] =
        glm::vec4(glm::vec3(line) * chunk.position_step, glm::dot(line, offset));
  }
  slot[3] = {chunk.uv_scale[0], chunk.uv_scale[1], chunk.uv_offset[0], chunk.uv_offset[1]};
  return slot;
}

ModelPainter::ModelPainter(const BundleView& bundle, std::span<const VertexFormat> formats,
                           std::uint64_t batch_budget)
    : bundle_(bundle), formats_(formats), batches_(bundle, formats, batch_budget) {
  setups_.resize(bundle.chunks().size());
  chunk_layouts_.assign(bundle.chunks().size(), kNone);
  find_equals();
}

/// Items of different models can share a draw call where their materials and layouts are equal.
void ModelPainter::find_equals() {
  for (std::uint32_t i = 0; i < bundle_.materials().size(); ++i) {
    std::uint32_t first = 0;
    while (!equal_surface(bundle_.materials()[first], bundle_.materials()[i])) ++first;
    equal_material_.push_back(first);
  }
  for (std::uint32_t i = 0; i < bundle_.layouts().size(); ++i) {
    std::uint32_t first = 0;
    while (!equal_layout(bundle_.layouts()[first], bundle_.layouts()[i])) ++first;
    equal_layout_.push_back(first);
  }
}

Result<void> ModelPainter::create(const TextureStore& textures, const GlExtensions& extensions,
                                  const GlCaps& caps) {
  extensions_ = extensions;
  slot_count_ = std::min(kMostSlots, (caps.max_vertex_uniform_vectors - kFixedUniformVectors) / 4);
  for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) {
    const ModelRecord& model = bundle_.models()[m];
    const VertexFormat& format = formats_[model.layout];
    for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
      const MaterialRecord& material = bundle_.materials()[bundle_.chunks()[c].material];
      ProgramKey key;
      key.normal = format.normal;
      key.coloured = format.attributes[kAttributeColour].components != 0;
      key.textured = material.texture != kNone && format.attributes[kAttributeUv].components != 0;
      key.alpha_twin = key.textured && textures.alpha(material.texture) != 0;
      const Result<std::uint32_t> program = program_of(key);
      if (!program) return tl::unexpected<Error>(program.error());
      setups_[c].program = *program;
      setups_[c].material = equal_material_[bundle_.chunks()[c].material];
      setups_[c].blended = key.alpha_twin || material.opacity < 1.0f;
      chunk_layouts_[c] = equal_layout_[model.layout];
    }
  }
  if (extensions_.instancing()) glGenBuffers(1, &row_buffer_);
  return {};
}

Result<std::uint32_t> ModelPainter::program_of(const ProgramKey& key) {
  for (std::uint32_t i = 0; i < programs_.size(); ++i) {
    if (programs_[i].by_slots[0].program.key == key) return i;
  }
  const Result<ModelProgram> program = make_model_program(key);
  if (!program) return tl::unexpected<Error>(program.error());
  programs_.emplace_back();
  programs_.back().by_slots[0].program = *program;
  return static_cast<std::uint32_t>(programs_.size() - 1);
}

/// nullptr where the driver cannot link it: the caller has another way.
ModelPainter::ProgramState* ModelPainter::program(std::uint32_t index, SlotKind slots,
                                                  GlState& gl) {
  ProgramSet& set = programs_[index];
  const std::size_t kind = static_cast<std::size_t>(slots);
  ProgramState& state = set.by_slots[kind];
  if (set.failed[kind]) return nullptr;
  if (state.program.id != 0) return &state;
  ProgramKey key = set.by_slots[0].program.key;
  key.slots = slots;
  key.slot_count = slots == SlotKind::kStream ? slot_count_ : 1;
  const Result<ModelProgram> linked = make_model_program(key);
  gl.forget_program();
  set.failed[kind] = !linked.has_value();
  if (!linked) return nullptr;
  state.program = *linked;
  return &state;
}

void ModelPainter::release(GlState& gl) {
  for (const ProgramSet& set : programs_) {
    for (const ProgramState& state : set.by_slots) glDeleteProgram(state.program.id);
  }
  gl.forget_buffer(row_buffer_);
  glDeleteBuffers(1, &row_buffer_);
  batches_.release(gl);
}

bool ModelPainter::same_decoding(std::uint32_t a, std::uint32_t b) const {
  if (a == b) return true;
  if (a == kNone || b == kNone) return false;
  const ChunkRecord& left = bundle_.chunks()[a];
  const ChunkRecord& right = bundle_.chunks()[b];
  return std::ranges::equal(left.position_offset, right.position_offset) &&
         left.position_step == right.position_step &&
         std::ranges::equal(left.uv_offset, right.uv_offset) &&
         std::ranges::equal(left.uv_scale, right.uv_scale);
}

/// Program, uniforms but for slots, textures and switches.
void ModelPainter::set_surface(const PaintJob& job, ProgramState& state, const Piece& piece) {
  const MaterialRecord& material = bundle_.materials()[piece.material];
  job.gl.use_program(state.program.id);
  set_frame(job, state);
  set_material(job, state, piece.material);
  if (state.program.key.textured) job.gl.bind_texture(0, job.textures.colour(material.texture));
  if (state.program.key.alpha_twin) job.gl.bind_texture(1, job.textures.alpha(material.texture));
  job.gl.set_culling((material.flags & kMaterialTwoSided) == 0);
  job.gl.set_front_face(piece.mirrored ? GL_CW : GL_CCW);
  job.gl.set_blending(piece.blended);
}

void ModelPainter::set_frame(const PaintJob& job, ProgramState& state) {
  if (state.frame == frame_) return;
  state.frame = frame_;
  state.material = kNone;
  state.item = kNone;
  glUniformMatrix4fv(state.program.projection, 1, GL_FALSE, glm::value_ptr(job.projection));
  job.stats.bytes_uploaded += sizeof job.projection;
  set_vector(state.program.light, glm::vec4(glm::normalize(job.options.light), 0.0f), job.stats);
}

void ModelPainter::set_material(const PaintJob& job, ProgramState& state, std::uint32_t material) {
  if (state.material == material) return;
  state.material = material;
  const MaterialRecord& record = bundle_.materials()[material];
  const float strength = job.options.light_strength;
  // Many MTL files leave the ambient colour black: then the diffuse one stands for it.
  const bool black = record.ambient[0] + record.ambient[1] + record.ambient[2] <= 0.0f;
  const bool two_sided = (record.flags & kMaterialTwoSided) != 0;
  // An exponent of 0 would make the whole surface one highlight.
  const bool shines = record.shininess > 0.0f;
  const ModelProgram& program = state.program;
  set_vector(program.ambient,
             colour(black ? record.diffuse : record.ambient, job.options.ambient_strength, 0.0f),
             job.stats);
  set_vector(program.diffuse, colour(record.diffuse, strength, two_sided ? 1.0f : 0.0f), job.stats);
  set_vector(program.specular,
             colour(record.specular, shines ? strength : 0.0f, shines ? record.shininess : 1.0f),
             job.stats);
  set_vector(program.emission, colour(record.emission, 1.0f, 0.0f), job.stats);
  glUniform1f(program.opacity, record.opacity);
  job.stats.bytes_uploaded += sizeof record.opacity;
}

void ModelPainter::set_slot(const PaintJob& job, ProgramState& state, const Piece& piece) {
  if (state.item == piece.item && same_decoding(state.chunk, piece.chunk)) return;
  state.item = piece.item;
  state.chunk = piece.chunk;
  const Slot slot = make_slot(matrix(job, piece), bundle_.chunks()[piece.chunk]);
  glUniform4fv(state.program.slots, 4, glm::value_ptr(slot[0]));
  job.stats.bytes_uploaded += sizeof slot;
}

void ModelPainter::set_attributes(std::uint32_t layout, GLuint buffer, std::uintptr_t offset,
                                  std::uint32_t more, GlState& gl) const {
  const VertexFormat& format = formats_[layout];
  for (GLuint i = 0; i < format.attributes.size(); ++i) {
    const VertexAttribute& attribute = format.attributes[i];
    if (attribute.components == 0) continue;
    gl.set_attribute(i, {buffer, attribute.components, attribute.type, attribute.normalised,
                         static_cast<GLsizei>(format.stride), offset + attribute.offset});
  }
  gl.enable_attributes(format.enabled | more);
}

}  // namespace modar
