// Draws the commands of a list.
#include "runtime/render/model_painter.hpp"

#include <algorithm>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace modar {
namespace {

glm::vec4 colour(const float (&rgb)[3], float factor, float fourth) {
  return {rgb[0] * factor, rgb[1] * factor, rgb[2] * factor, fourth};
}

void set_vector(GLint place, const glm::vec4& value, RenderStats& stats) {
  glUniform4fv(place, 1, glm::value_ptr(value));
  stats.bytes_uploaded += sizeof value;
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

ModelPainter::ModelPainter(const BundleView& bundle, std::span<const VertexFormat> formats)
    : bundle_(bundle), formats_(formats) {
  setups_.resize(bundle.chunks().size());
  chunk_layouts_.assign(bundle.chunks().size(), kNone);
}

Result<void> ModelPainter::create(const TextureStore& textures) {
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
      setups_[c].blended = key.alpha_twin || material.opacity < 1.0f;
      chunk_layouts_[c] = model.layout;
    }
  }
  return {};
}

Result<std::uint32_t> ModelPainter::program_of(const ProgramKey& key) {
  for (std::uint32_t i = 0; i < programs_.size(); ++i) {
    if (programs_[i].program.key == key) return i;
  }
  const Result<ModelProgram> program = make_model_program(key);
  if (!program) return tl::unexpected<Error>(program.error());
  programs_.push_back({*program});
  return static_cast<std::uint32_t>(programs_.size() - 1);
}

void ModelPainter::release() {
  for (const ProgramState& state : programs_) glDeleteProgram(state.program.id);
  forget();
}

void ModelPainter::set_frame(ProgramState& state, const glm::mat4& projection,
                             const RenderOptions& options, RenderStats& stats) {
  if (state.frame == frame_) return;
  state.frame = frame_;
  state.material = kNone;
  state.item = kNone;
  glUniformMatrix4fv(state.program.projection, 1, GL_FALSE, glm::value_ptr(projection));
  stats.bytes_uploaded += sizeof projection;
  set_vector(state.program.light, glm::vec4(glm::normalize(options.light), 0.0f), stats);
}

void ModelPainter::set_material(ProgramState& state, std::uint32_t material,
                                const RenderOptions& options, RenderStats& stats) {
  if (state.material == material) return;
  state.material = material;
  const MaterialRecord& record = bundle_.materials()[material];
  // Many MTL files leave the ambient colour black: then the diffuse one stands for it.
  const bool black = record.ambient[0] + record.ambient[1] + record.ambient[2] <= 0.0f;
  const bool two_sided = (record.flags & kMaterialTwoSided) != 0;
  // An exponent of 0 would make the whole surface one highlight.
  const bool shines = record.shininess > 0.0f;
  set_vector(state.program.ambient,
             colour(black ? record.diffuse : record.ambient, options.ambient_strength, 0.0f),
             stats);
  set_vector(state.program.diffuse,
             colour(record.diffuse, options.light_strength, two_sided ? 1.0f : 0.0f), stats);
  set_vector(state.program.specular,
             colour(record.specular, shines ? options.light_strength : 0.0f,
                    shines ? record.shininess : 1.0f),
             stats);
  set_vector(state.program.emission, colour(record.emission, 1.0f, 0.0f), stats);
  glUniform1f(state.program.opacity, record.opacity);
  stats.bytes_uploaded += sizeof record.opacity;
}

bool ModelPainter::same_decoding(std::uint32_t a, std::uint32_t b) const {
  if (a == b) return true;
  const ChunkRecord& left = bundle_.chunks()[a];
  const ChunkRecord& right = bundle_.chunks()[b];
  return std::ranges::equal(left.position_offset, right.position_offset) &&
         left.position_step == right.position_step &&
         std::ranges::equal(left.uv_offset, right.uv_offset) &&
         std::ranges::equal(left.uv_scale, right.uv_scale);
}

void ModelPainter::set_slot(ProgramState& state, const DrawCommand& command,
                            const glm::mat4& to_eye, RenderStats& stats) {
  if (state.item == command.item && same_decoding(state.chunk, command.chunk)) return;
  state.item = command.item;
  state.chunk = command.chunk;
  const Slot slot = make_slot(to_eye, bundle_.chunks()[command.chunk]);
  glUniform4fv(state.program.slots, 4, glm::value_ptr(slot[0]));
  stats.bytes_uploaded += sizeof slot;
}

void ModelPainter::set_attributes(const VertexFormat& format, const LevelPlace& place,
                                  GlState& gl) const {
  for (GLuint i = 0; i < format.attributes.size(); ++i) {
    const VertexAttribute& attribute = format.attributes[i];
    if (attribute.components == 0) continue;
    gl.set_attribute(
        i, {place.vertex_buffer, attribute.components, attribute.type, attribute.normalised,
            static_cast<GLsizei>(format.stride), place.vertex_offset + attribute.offset});
  }
  gl.enable_attributes(format.enabled);
}

/// The next command's triangles follow the last one's in the buffer, and need nothing set anew.
bool ModelPainter::continues(const DrawCommand& last, const DrawCommand& next) const {
  const LevelRecord& before = bundle_.levels()[last.level];
  const LevelRecord& after = bundle_.levels()[next.level];
  return last.item == next.item && last.material == next.material && last.program == next.program &&
         before.vertex_offset == after.vertex_offset &&
         before.index_offset + std::uint64_t{before.index_count} * 2 == after.index_offset &&
         same_decoding(last.chunk, next.chunk);
}

void ModelPainter::draw(DrawList& list, std::span<const DrawItem> items,
                        const glm::mat4& projection, const RenderOptions& options,
                        GeometryStore& geometry, const TextureStore& textures, GlState& gl,
                        RenderStats& stats) {
  ++frame_;
  gl.set_depth_test(true);
  const std::vector<DrawCommand>& commands = list.commands();
  for (std::size_t i = 0; i < commands.size();) {
    const DrawCommand& command = commands[i];
    const MaterialRecord& material = bundle_.materials()[command.material];
    LevelPlace place;
    // Resident since this frame began: answers at once.
    if (!geometry.use(command.level, gl, place)) {
      ++i;
      continue;
    }
    ProgramState& state = programs_[command.program];
    gl.use_program(state.program.id);
    set_frame(state, projection, options, stats);
    set_material(state, command.material, options, stats);
    set_slot(state, command, items[command.item].to_eye, stats);
    set_attributes(formats_[chunk_layouts_[command.chunk]], place, gl);
    gl.bind_index_buffer(place.index_buffer);
    if (state.program.key.textured) gl.bind_texture(0, textures.colour(material.texture));
    if (state.program.key.alpha_twin) gl.bind_texture(1, textures.alpha(material.texture));
    gl.set_culling((material.flags & kMaterialTwoSided) == 0);
    gl.set_front_face(list.view(command.item).mirrored ? GL_CW : GL_CCW);
    gl.set_blending(command.blended);
    std::uint64_t count = bundle_.levels()[command.level].index_count;
    const std::size_t first = i++;
    while (!geometry.streams() && i < commands.size() && continues(commands[i - 1], commands[i])) {
      count += bundle_.levels()[commands[i].level].index_count;
      ++i;
    }
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_SHORT,
                   reinterpret_cast<const void*>(place.index_offset));
    ++stats.draw_calls;
    stats.triangles += count / 3;
    stats.chunks_drawn += static_cast<int>(i - first);
  }
}

}  // namespace modar
