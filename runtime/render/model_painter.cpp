// Programs and uniforms of a bundle's surfaces; pieces, groups of equal state, and the three ways
// to draw a group.
#include "runtime/render/model_painter.hpp"
#include "formats/texture_format.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace modar {
namespace {

/// Copies that one call draws at most; 59 fit into the uniforms that every ES 3 has.
constexpr int kMostSlots = 64;

/// Of a stored colour (sRGB); above 1 it continues.
float linear(float stored) {
  return stored <= 0.04045f ? stored / 12.92f : std::pow((stored + 0.055f) / 1.055f, 2.4f);
}

glm::vec3 linear(const glm::vec3& stored) {
  return {linear(stored.x), linear(stored.y), linear(stored.z)};
}

glm::vec4 linear_colour(const float (&rgb)[3], float factor, float fourth) {
  return {linear(rgb[0]) * factor, linear(rgb[1]) * factor, linear(rgb[2]) * factor, fourth};
}

void set_vector(GLint place, const glm::vec4& value, RenderStats& stats) {
  glUniform4fv(place, 1, glm::value_ptr(value));
  stats.bytes_uploaded += sizeof value;
}

// Loops of our own below and in batch_store.cpp: libc++ 14 has no algorithms of std::ranges.
template <std::size_t kSize>
bool equal(const float (&a)[kSize], const float (&b)[kSize]) {
  return std::equal(a, a + kSize, b);
}

template <class Parts>
auto find_mesh(Parts& parts, const MeshRange& mesh) {
  return std::find_if(parts.begin(), parts.end(),
                      [&](const auto& each) { return each.mesh == mesh; });
}

bool equal_surface(const MaterialRecord& a, const MaterialRecord& b) {
  return equal(a.ambient, b.ambient) && equal(a.diffuse, b.diffuse) &&
         equal(a.specular, b.specular) && equal(a.emission, b.emission) &&
         a.shininess == b.shininess && a.opacity == b.opacity && a.texture == b.texture &&
         a.flags == b.flags;
}

bool dark(const float (&colour)[3]) {
  return colour[0] + colour[1] + colour[2] <= 0.0f;
}

/// An exponent of 0 would make the whole surface one highlight.
bool shines(const MaterialRecord& material) {
  return material.shininess > 0.0f && !dark(material.specular);
}

bool glows(const MaterialRecord& material) {
  return !dark(material.emission);
}

bool mirrors(const MaterialRecord& material) {
  return (material.flags & (kMaterialReflectance | kMaterialMetalness)) != 0;
}

/// Share of its brightest channel by which an ambient colour's darkest is less, at least: exporters
/// write grays that mean nothing.
constexpr float kColoured = 0.05f;

/// Colour under the light from all around, at most as bright as diffuse: ambient has its part, and
/// diffuse what it leaves, so that neither 0 nor a weak ambient darkens a surface.
glm::vec3 ambient_colour(const MaterialRecord& material) {
  const glm::vec3 diffuse = glm::make_vec3(material.diffuse);
  const glm::vec3 ambient = glm::make_vec3(material.ambient);
  const auto [least, most] = std::minmax({ambient.x, ambient.y, ambient.z});
  if (most - least <= kColoured * most || material_share(material.flags, kMaterialMetalness) > 0.0f)
    return diffuse;
  const float bright = std::max({diffuse.x, diffuse.y, diffuse.z});
  if (bright <= 0.0f) return ambient;
  return ambient * std::min(1.0f, bright / most) + diffuse * std::max(0.0f, 1.0f - most / bright);
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
  find_orders();
}

/// Items of different models can share a draw call where their materials and layouts are equal.
void ModelPainter::find_equals() {
  for (const MaterialRecord& material : bundle_.materials()) {
    std::uint32_t first = 0;
    while (!equal_surface(bundle_.materials()[first], material)) ++first;
    equal_material_.push_back(first);
  }
  for (const LayoutRecord& layout : bundle_.layouts()) {
    std::uint32_t first = 0;
    while (!equal_layout(bundle_.layouts()[first], layout)) ++first;
    equal_layout_.push_back(first);
  }
}

/// Makes room for the largest order: nothing is allocated in a frame.
void ModelPainter::find_orders() {
  std::size_t most = 0;
  for (const SectionEntry& section : bundle_.sections()) {
    if (section.type != static_cast<std::uint32_t>(SectionType::kDrawOrder)) continue;
    const auto bytes = bundle_.section(SectionType::kDrawOrder, section.owner);
    const auto* first = reinterpret_cast<const DrawOrderRecord*>(bytes.data());
    orders_.resize(bundle_.chunks().size());
    orders_[section.owner] = {first, bytes.size() / sizeof *first};
    most = std::max(most, orders_[section.owner].size());
  }
  waiting_.reserve(draw_order_depth(most));
  sorted_.reserve(3 * most);
}

Result<void> ModelPainter::create(const TextureStore& textures, const GlExtensions& extensions,
                                  const GlCaps& caps) {
  extensions_ = extensions;
  slot_count_ = std::min(kMostSlots, (caps.max_vertex_uniform_vectors - kFixedUniformVectors) / 4);
  for (std::uint32_t g = 0; g < bundle_.chunk_groups(); ++g) {
    const ChunkGroup group = bundle_.chunk_group(g);
    const ModelRecord& model = bundle_.models()[group.model];
    const VertexFormat& format = formats_[model.layout];
    for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
      const MaterialRecord& material = bundle_.materials()[bundle_.chunks()[c].material];
      ProgramKey key;
      key.normal = format.normal;
      key.coloured = (format.enabled >> kAttributeColour & 1) != 0;
      key.textured = material.texture != kNone && format.attributes[kAttributeUv].components != 0;
      key.alpha_twin = key.textured && textures.alpha(material.texture) != 0;
      key.cut_out = key.alpha_twin && material.opacity >= 1.0f &&
                    (bundle_.textures()[material.texture].flags & kTextureCutOut) != 0;
      key.shiny = shines(material) || glows(material) || mirrors(material);
      setups_[c].part = part_of(bundle_, bundle_.chunks()[c].material);
      const bool bends =
          setups_[c].part != kNone && !bundle_.moving_parts()[setups_[c].part].rigid();
      for (const bool skinned : {false, true}) {
        key.skinned = skinned;
        key.morphed = skinned && (format.moving >> kAttributeMorphX & 1) != 0;
        if (skinned && !bends) continue;
        MODAR_ASSIGN((skinned ? setups_[c].skinned : setups_[c].program), program_of(key));
      }
      setups_[c].material = equal_material_[bundle_.chunks()[c].material];
      setups_[c].hides = (material.flags & kMaterialOccluder) != 0;
      setups_[c].blended =
          !setups_[c].hides && !key.cut_out && (key.alpha_twin || material.opacity < 1.0f);
      chunk_layouts_[c] = equal_layout_[model.layout];
    }
  }
  if (extensions_.instancing()) glGenBuffers(1, &row_buffer_);
  if (!orders_.empty()) glGenBuffers(1, &sorted_buffer_);
  return {};
}

Result<std::uint32_t> ModelPainter::program_of(const ProgramKey& key) {
  for (std::uint32_t i = 0; i < programs_.size(); ++i) {
    if (programs_[i].by_slots[0].program.key == key) return i;
  }
  MODAR_ASSIGN(const ModelProgram program, make_model_program(key));
  programs_.emplace_back();
  programs_.back().by_slots[0].program = program;
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
  key.slot_count = slots == SlotKind::kStream && !key.skinned ? slot_count_ : 1;
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
  gl.forget_buffer(sorted_buffer_);
  glDeleteBuffers(1, &sorted_buffer_);
  batches_.release(gl);
}

bool ModelPainter::same_decoding(std::uint32_t a, std::uint32_t b) const {
  if (a == b) return true;
  if (a == kNone || b == kNone) return false;
  const ChunkRecord& left = bundle_.chunks()[a];
  const ChunkRecord& right = bundle_.chunks()[b];
  return equal(left.position_offset, right.position_offset) &&
         left.position_step == right.position_step && equal(left.uv_offset, right.uv_offset) &&
         equal(left.uv_scale, right.uv_scale);
}

/// Program, uniforms but for slots, textures and switches.
void ModelPainter::set_surface(const PaintJob& job, ProgramState& state, const Piece& piece) {
  const MaterialRecord& material = bundle_.materials()[piece.material];
  job.gl.use_program(state.program.id);
  set_frame(job, state);
  set_light(job, state, piece);
  set_material(job, state, piece);
  if (state.program.key.textured) job.gl.bind_texture(0, job.textures.colour(material.texture));
  if (state.program.key.alpha_twin) job.gl.bind_texture(1, job.textures.alpha(material.texture));
  job.gl.set_culling((material.flags & kMaterialTwoSided) == 0);
  job.gl.set_front_face(piece.mirrored ? GL_CW : GL_CCW);
  job.gl.set_blending(piece.blended);
  // Transparent parts must not hide later, nearer ones.
  job.gl.set_depth_writes(!piece.blended);
  job.gl.set_colour_writes((material.flags & kMaterialOccluder) == 0);
}

void ModelPainter::set_frame(const PaintJob& job, ProgramState& state) {
  if (state.frame == frame_) return;
  state.frame = frame_;
  state.light = kNone;
  state.material = kNone;
  state.item = kNone;
  if (state.program.projection < 0) return;
  glUniformMatrix4fv(state.program.projection, 1, GL_FALSE, glm::value_ptr(job.projection));
  job.stats.bytes_uploaded += sizeof job.projection;
}

void ModelPainter::set_light(const PaintJob& job, ProgramState& state, const Piece& piece) {
  const bool own = state.program.to_clip >= 0;
  const std::uint32_t whose = own ? piece.item : piece.light;
  if (state.light == whose) return;
  state.light = whose;
  state.material = kNone;  // a highlight has the light's colour
  TurnedLight& light = state.turned;
  light = own ? lights_.in_model_space(job.items[piece.item], piece.light)
              : lights_.in_eye_space(piece.light);
  state.coloured = false;
  glUniform4fv(state.program.sky, static_cast<GLsizei>(light.sky.size()),
               glm::value_ptr(light.sky[0]));
  job.stats.bytes_uploaded += sizeof light.sky;
  set_vector(state.program.to_key, light.key, job.stats);
  set_vector(state.program.key_colour, light.key_colour, job.stats);
}

/// Where ambient and diffuse differ, both lights are coloured, and the surface gets the brighter of
/// both colours: the return value.
glm::vec3 ModelPainter::set_ambient(const PaintJob& job, ProgramState& state,
                                    const MaterialRecord& record) {
  const glm::vec3 diffuse = glm::make_vec3(record.diffuse);
  const glm::vec3 ambient = ambient_colour(record);
  const bool coloured = ambient != diffuse;
  const glm::vec3 both = glm::max(ambient, diffuse);
  if (!coloured && !state.coloured) return both;
  state.coloured = coloured;
  const glm::vec3 under = glm::max(linear(both), 1e-6f);
  std::array<glm::vec4, 7> sky = state.turned.sky;
  for (std::size_t c = 0; c < 3; ++c) {
    const int at = static_cast<int>(c);
    const float factor = linear(ambient[at]) / under[at];
    sky[c] *= factor;
    sky[3 + c] *= factor;
    sky[6][at] *= factor;
  }
  glUniform4fv(state.program.sky, static_cast<GLsizei>(sky.size()), glm::value_ptr(sky[0]));
  job.stats.bytes_uploaded += sizeof sky;
  const glm::vec4 key(linear(diffuse) / under, 1.0f);
  set_vector(state.program.key_colour, state.turned.key_colour * key, job.stats);
  return both;
}

void ModelPainter::set_material(const PaintJob& job, ProgramState& state, const Piece& piece) {
  const std::uint32_t material = piece.material;
  const float opacity = job.items[piece.item].opacity;
  if (state.material == material && state.opacity == opacity) return;
  state.material = material;
  state.opacity = opacity;
  const MaterialRecord& record = bundle_.materials()[material];
  const bool two_sided = (record.flags & kMaterialTwoSided) != 0;
  const ModelProgram& program = state.program;
  const glm::vec3 colour = set_ambient(job, state, record);
  set_vector(program.diffuse, glm::vec4(colour, two_sided ? 1.0f : 0.0f), job.stats);
  if (program.key.shiny) {
    const bool shining = shines(record);
    const float metalness = material_share(record.flags, kMaterialMetalness);
    glm::vec4 specular = linear_colour(record.specular, shining ? 1.0f : 0.0f, 0.0f) *
                         lights_.key_colour(piece.light);
    specular.w = 2.0f / (std::min(record.shininess, kMostShininess) + 2.0f);
    set_vector(program.specular, specular, job.stats);
    set_vector(program.emission, linear_colour(record.emission, 1.0f, metalness), job.stats);
    const float reflectance = material_share(record.flags, kMaterialReflectance);
    set_vector(program.mirror, mirror_factors(record.shininess, reflectance, metalness), job.stats);
    glUniform1f(program.share, metalness > 0.0f ? reflectance * (1.0f - metalness) : 1.0f);
    job.stats.bytes_uploaded += sizeof metalness;
  }
  glUniform1f(program.opacity, record.opacity * opacity);
  job.stats.bytes_uploaded += sizeof record.opacity;
}

void ModelPainter::set_slot(const PaintJob& job, ProgramState& state, const Piece& piece) {
  if (state.item == piece.item && same_decoding(state.chunk, piece.chunk)) return;
  state.item = piece.item;
  state.chunk = piece.chunk;
  ChunkRecord decoded;
  const bool skinned = state.program.key.skinned;
  if (skinned) {
    set_bones(job, state, piece);
    decoded = bundle_.chunks()[piece.chunk];
    std::fill_n(decoded.position_offset, 3, 0.0f);
    decoded.position_step = 1.0f;
  }
  const ChunkRecord& chunk = skinned ? decoded : bundle_.chunks()[piece.chunk];
  if (state.program.to_clip < 0) {
    const Slot slot = make_slot(matrix(job, piece), chunk);
    glUniform4fv(state.program.slots, 4, glm::value_ptr(slot[0]));
    job.stats.bytes_uploaded += sizeof slot;
    return;
  }
  const glm::vec3 offset(chunk.position_offset[0], chunk.position_offset[1],
                         chunk.position_offset[2]);
  glm::mat4 to_clip = job.projection * matrix(job, piece);
  to_clip[3] = to_clip * glm::vec4(offset, 1.0f);
  for (int axis = 0; axis < 3; ++axis) to_clip[axis] *= chunk.position_step;
  glUniformMatrix4fv(state.program.to_clip, 1, GL_FALSE, glm::value_ptr(to_clip));
  job.stats.bytes_uploaded += sizeof to_clip;
  const glm::vec3 eye = (job.list.view(piece.item).eye - offset) / chunk.position_step;
  set_vector(state.program.eye, glm::vec4(eye, 1.0f), job.stats);
  const glm::vec4 uv_map(chunk.uv_scale[0], chunk.uv_scale[1], chunk.uv_offset[0],
                         chunk.uv_offset[1]);
  set_vector(state.program.uv_map, uv_map, job.stats);
}

void ModelPainter::set_bones(const PaintJob& job, const ProgramState& state, const Piece& piece) {
  const ChunkRecord& chunk = bundle_.chunks()[piece.chunk];
  const PartRecord& part = bundle_.moving_parts()[setups_[piece.chunk].part];
  const BoneMatrix* const matrices = job.items[piece.item].bones;
  const std::uint32_t bones = part.bone_count;
  glUniform4fv(state.program.bones, static_cast<GLsizei>(3 * bones),
               glm::value_ptr((*matrices)[0]));
  job.stats.bytes_uploaded += bones * sizeof(BoneMatrix);
  set_vector(state.program.decode,
             {chunk.position_offset[0], chunk.position_offset[1], chunk.position_offset[2],
              chunk.position_step},
             job.stats);
  if (!state.program.key.morphed) return;
  glm::vec4 weights(0.0f);
  for (std::uint32_t t = 0; t < part.target_count; ++t)
    weights[static_cast<int>(t)] = matrices[bones + t][0].w / kMorphUnits;
  set_vector(state.program.morph, weights, job.stats);
}

void ModelPainter::set_attributes(std::uint32_t layout, GLuint buffer, std::uintptr_t offset,
                                  std::uint32_t more, GlState& gl, bool moving) const {
  const VertexFormat& format = formats_[layout];
  const std::uint32_t own = format.enabled | (moving ? format.moving : 0);
  for (GLuint i = 0; i < kAttributeCount; ++i) {
    const VertexAttribute& attribute = format.attributes[i];
    if ((own >> i & 1) == 0) continue;
    gl.set_attribute(i, {buffer, attribute.components, attribute.type, attribute.normalised,
                         static_cast<GLsizei>(format.stride), offset + attribute.offset});
  }
  gl.enable_attributes(own | more);
}

namespace {

/// With more vertices, two copies do not fit one batch.
constexpr std::uint32_t kMostMeshVertices = kBatchVertices / 2;

const void* index_pointer(std::uintptr_t offset) {
  return reinterpret_cast<const void*>(offset);
}

}  // namespace

void ModelPainter::draw(const PaintJob& job) {
  ++frame_;
  job.gl.set_depth_test(true);
  lights_.build(bundle_, job.items, job.options, job.estimator);
  make_pieces(job);
  for (std::size_t i = 0; i < pieces_.size();) {
    const auto same_state = [&](const Piece& a, const Piece& b) {
      return a.program == b.program && a.material == b.material && a.layout == b.layout &&
             a.mirrored == b.mirrored && a.light == b.light && !a.blended && !b.blended;
    };
    std::size_t end = i + 1;
    while (end < pieces_.size() && same_state(pieces_[i], pieces_[end])) ++end;
    if (pieces_[i].blended) draw_behind(job, pieces_[i]);
    draw_group(job, std::span(pieces_).subspan(i, end - i));
    i = end;
  }
}

/// The pictures behind a blended piece, by its box's middle.
void ModelPainter::draw_behind(const PaintJob& job, const Piece& piece) {
  const ChunkRecord& chunk = bundle_.chunks()[piece.chunk];
  const glm::vec3 middle =
      0.5f * (glm::make_vec3(chunk.bounds_min) + glm::make_vec3(chunk.bounds_max));
  const glm::vec3 point(job.items[piece.item].to_eye * glm::vec4(middle, 1.0f));
  job.planes.draw(job.pictures, &point);
}

void ModelPainter::make_pieces(const PaintJob& job) {
  pieces_.clear();
  for (const DrawCommand& command : job.list.commands()) {
    const LevelRecord& level = bundle_.levels()[command.level];
    if (!pieces_.empty() && !job.geometry.streams() && continues(pieces_.back(), command)) {
      Piece& piece = pieces_.back();
      piece.mesh.index_count += level.index_count;
      piece.mesh.vertex_count = std::max(piece.mesh.vertex_count, level.vertex_count);
      ++piece.chunks;
      continue;
    }
    Piece piece;
    piece.item = command.item;
    piece.chunk = command.chunk;
    piece.program = command.program;
    piece.material = command.material;
    piece.layout = chunk_layouts_[command.chunk];
    piece.light = lights_.of_item(command.item);
    piece.mesh = {command.level, level.vertex_count, level.index_count};
    piece.chunks = 1;
    piece.blended = command.blended;
    piece.mirrored = job.list.view(command.item).mirrored;
    pieces_.push_back(piece);
  }
}

/// The command's triangles follow the piece's in the buffer, and need nothing set anew.
bool ModelPainter::continues(const Piece& piece, const DrawCommand& next) const {
  const LevelRecord& before = bundle_.levels()[piece.mesh.level];
  const LevelRecord& after = bundle_.levels()[next.level];
  if (!order_of(piece.chunk, piece.mesh.level).empty()) return false;
  if (!order_of(next.chunk, next.level).empty()) return false;
  return piece.item == next.item && piece.material == next.material &&
         piece.program == next.program && before.vertex_offset == after.vertex_offset &&
         before.index_offset + std::uint64_t{piece.mesh.index_count} * 2 == after.index_offset &&
         same_decoding(piece.chunk, next.chunk);
}

void ModelPainter::draw_group(const PaintJob& job, std::span<Piece> group) {
  const bool several_items = group.front().item != group.back().item;
  if (!several_items || !job.options.instancing || skinned(group.front())) {
    for (const Piece& piece : group) draw_piece(job, piece);
    return;
  }
  const auto before = [](const Piece& a, const Piece& b) {
    return std::tie(a.mesh.level, a.mesh.index_count, a.item) <
           std::tie(b.mesh.level, b.mesh.index_count, b.item);
  };
  // std::sort() would be four times as long.
  std::make_heap(group.begin(), group.end(), before);
  std::sort_heap(group.begin(), group.end(), before);
  // Copies of one mesh by instances, where the context has them; the rest side by side in batches,
  // and meshes too large for those alone.
  std::size_t waiting = 0;
  for (std::size_t i = 0; i < group.size();) {
    std::size_t end = i + 1;
    while (end < group.size() && group[end].mesh == group[i].mesh) ++end;
    const std::span<Piece> copies = group.subspan(i, end - i);
    i = end;
    if (copies.size() > 1 && draw_instances(job, copies)) continue;
    if (copies[0].mesh.vertex_count > kMostMeshVertices || job.geometry.streams()) {
      for (const Piece& piece : copies) draw_piece(job, piece);
      continue;
    }
    std::copy(copies.begin(), copies.end(), group.begin() + static_cast<std::ptrdiff_t>(waiting));
    waiting += copies.size();
  }
  const std::span<const Piece> rest = group.first(waiting);
  if (rest.size() > 1 && draw_batches(job, rest)) return;
  for (const Piece& piece : rest) draw_piece(job, piece);
}

void ModelPainter::draw_piece(const PaintJob& job, const Piece& piece) {
  LevelPlace place;
  if (!job.geometry.use(piece.mesh.level, job.gl, place)) return;
  ProgramState& state = single_state(job, piece);
  set_surface(job, state, piece);
  set_slot(job, state, piece);
  const bool bends = skinned(piece);
  // Rows of instances may have been there.
  for (GLuint i = 0; i < 3 && bends && extensions_.instancing(); ++i)
    extensions_.vertex_attrib_divisor(kAttributeJoints + i, 0);
  set_attributes(piece.layout, place.vertex_buffer, place.vertex_offset, 0, job.gl, bends);
  const auto order = order_of(piece.chunk, piece.mesh.level);
  const bool ordered = !order.empty() && job.list.view(piece.item).perspective;
  if (ordered) {
    send_in_order(job, piece, order);
  } else {
    job.gl.bind_index_buffer(place.index_buffer);
  }
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(piece.mesh.index_count), GL_UNSIGNED_SHORT,
                 index_pointer(ordered ? 0 : place.index_offset));
  if (job.geometry.client_arrays()) {
    job.stats.bytes_uploaded +=
        std::uint64_t{piece.mesh.index_count} * 2 +
        std::uint64_t{piece.mesh.vertex_count} * formats_[piece.layout].stride;
  }
  ++job.stats.draw_calls;
  job.stats.triangles += piece.mesh.index_count / 3;
  job.stats.chunks_drawn += piece.chunks;
}

std::span<const DrawOrderRecord> ModelPainter::order_of(std::uint32_t chunk,
                                                        std::uint32_t level) const {
  if (orders_.empty() || bundle_.chunks()[chunk].first_level != level) return {};
  return orders_[chunk];
}

void ModelPainter::send_in_order(const PaintJob& job, const Piece& piece,
                                 std::span<const DrawOrderRecord> order) {
  const std::byte* indices =
      bundle_.indices().data() + bundle_.levels()[piece.mesh.level].index_offset;
  const glm::vec3& eye = job.list.view(piece.item).eye;
  sorted_.clear();
  walk_draw_order(order, {eye.x, eye.y, eye.z}, waiting_, [&](std::uint32_t triangle) {
    sorted_.resize(sorted_.size() + 3);
    std::memcpy(&sorted_[sorted_.size() - 3], indices + 6 * std::size_t{triangle}, 6);
  });
  job.gl.bind_index_buffer(sorted_buffer_);
  const std::size_t bytes = sorted_.size() * sizeof sorted_[0];
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), sorted_.data(),
               GL_STREAM_DRAW);
  job.stats.bytes_uploaded += bytes;
}

/// One item whose matrix turns normals otherwise than a rotation is drawn as a batch of one, whose
/// slot's number is the attribute's value where no array gives it.
ModelPainter::ProgramState& ModelPainter::single_state(const PaintJob& job, const Piece& piece) {
  ProgramState& single = programs_[piece.program].by_slots[0];
  if (job.list.view(piece.item).keeps_angles) return single;
  ProgramState* general = program(piece.program, SlotKind::kStream, job.gl);
  if (general == nullptr) return single;
  glVertexAttrib1f(kAttributeSlot, 0.0f);
  return *general;
}

bool ModelPainter::draw_instances(const PaintJob& job, std::span<const Piece> pieces) {
  if (!extensions_.instancing() || job.geometry.client_arrays()) return false;
  ProgramState* state = program(pieces[0].program, SlotKind::kAttributes, job.gl);
  LevelPlace place;
  if (state == nullptr || !job.geometry.use(pieces[0].mesh.level, job.gl, place)) return false;
  rows_.clear();
  for (const Piece& piece : pieces) {
    const Slot slot = make_slot(matrix(job, piece), bundle_.chunks()[piece.chunk]);
    rows_.insert(rows_.end(), slot.begin(), slot.begin() + 3);
  }
  set_surface(job, *state, pieces[0]);
  set_slot(job, *state, pieces[0]);  // its uv map is every copy's
  job.gl.bind_array_buffer(row_buffer_);
  const std::size_t bytes = rows_.size() * sizeof rows_[0];
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), rows_.data(), GL_STREAM_DRAW);
  job.stats.bytes_uploaded += bytes;
  constexpr GLsizei kStride = 3 * sizeof(glm::vec4);
  for (GLuint row = 0; row < 3; ++row) {
    job.gl.set_attribute(kAttributeRows + row,
                         {row_buffer_, 4, GL_FLOAT, GL_FALSE, kStride, row * sizeof(glm::vec4)});
    extensions_.vertex_attrib_divisor(kAttributeRows + row, 1);
  }
  set_attributes(pieces[0].layout, place.vertex_buffer, place.vertex_offset, 7u << kAttributeRows,
                 job.gl);
  job.gl.bind_index_buffer(place.index_buffer);
  extensions_.draw_elements_instanced(
      GL_TRIANGLES, static_cast<GLsizei>(pieces[0].mesh.index_count), GL_UNSIGNED_SHORT,
      index_pointer(place.index_offset), static_cast<GLsizei>(pieces.size()));
  ++job.stats.draw_calls;
  for (const Piece& piece : pieces) {
    job.stats.triangles += piece.mesh.index_count / 3;
    job.stats.chunks_drawn += piece.chunks;
  }
  return true;
}

/// Draws all, or nothing and answers false.
bool ModelPainter::draw_batches(const PaintJob& job, std::span<const Piece> pieces) {
  if (slot_count_ < 2) return false;
  ProgramState* state = program(pieces[0].program, SlotKind::kStream, job.gl);
  if (state == nullptr) return false;
  for (std::size_t i = 0; i < pieces.size();) {
    std::size_t end = i;
    std::uint32_t vertices = 0;
    while (end < pieces.size() && end - i < static_cast<std::size_t>(slot_count_) &&
           vertices + pieces[end].mesh.vertex_count <= kBatchVertices) {
      vertices += pieces[end++].mesh.vertex_count;
    }
    const std::span<const Piece> batch = pieces.subspan(i, end - i);
    if (batch.size() < 2 || !draw_batch(job, *state, batch)) {
      for (const Piece& piece : batch) draw_piece(job, piece);
    }
    i = end;
  }
  return true;
}

/// pieces: sorted by mesh, within the limits of one batch.
bool ModelPainter::draw_batch(const PaintJob& job, ProgramState& state,
                              std::span<const Piece> pieces) {
  parts_.clear();
  for (const Piece& piece : pieces) {
    if (parts_.empty() || parts_.back().mesh != piece.mesh) parts_.push_back({piece.mesh, 0});
    ++parts_.back().copies;
  }
  const std::uint64_t before = batches_.uploaded_bytes();
  const Batch* batch =
      batches_.find(pieces[0].layout, parts_, static_cast<std::uint32_t>(slot_count_),
                    job.geometry.client_arrays(), job.gl);
  if (batch == nullptr) return false;
  job.stats.bytes_uploaded += batches_.uploaded_bytes() - before;
  slots_.clear();
  for (const Piece& piece : pieces) {
    const auto place = find_mesh(batch->places, piece.mesh);
    const auto part = find_mesh(parts_, piece.mesh);
    // Copies of a part take its slots one after the other.
    const std::size_t slot = place->first_slot + static_cast<std::size_t>(--part->copies);
    slots_.resize(std::max(slots_.size(), slot + 1));
    slots_[slot] = make_slot(matrix(job, piece), bundle_.chunks()[piece.chunk]);
    job.stats.triangles += piece.mesh.index_count / 3;
    job.stats.chunks_drawn += piece.chunks;
  }
  for (const Piece& piece : pieces) ++find_mesh(parts_, piece.mesh)->copies;
  set_surface(job, state, pieces[0]);
  state.item = kNone;  // slot 0 is no single item's any more
  glUniform4fv(state.program.slots, static_cast<GLsizei>(slots_.size() * 4),
               glm::value_ptr(slots_[0][0]));
  job.stats.bytes_uploaded += slots_.size() * sizeof(Slot);
  set_attributes(pieces[0].layout, batch->vertices, batch->vertices_offset, 1u << kAttributeSlot,
                 job.gl);
  job.gl.set_attribute(kAttributeSlot,
                       {batch->vertices, 1, GL_UNSIGNED_BYTE, GL_FALSE, 4, batch->slots_offset});
  job.gl.bind_index_buffer(batch->indices);
  // Without a buffer, the driver takes all of them again.
  job.stats.bytes_uploaded += batch->client.size();
  draw_runs(job, *batch);
  return true;
}

/// One call for neighbours in the batch: parts_ has the requested copies of each.
void ModelPainter::draw_runs(const PaintJob& job, const Batch& batch) {
  std::uintptr_t start = 0;
  std::uint32_t count = 0;
  const auto flush = [&] {
    if (count == 0) return;
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_SHORT,
                   index_pointer(start));
    ++job.stats.draw_calls;
    count = 0;
  };
  for (const BatchPlace& place : batch.places) {
    const auto part = find_mesh(parts_, place.mesh);
    if (part == parts_.end()) {
      flush();
      continue;
    }
    if (count == 0) start = batch.indices_offset + place.index_offset;
    count += part->copies * place.mesh.index_count;
    if (part->copies < place.copies) flush();
  }
  flush();
}

}  // namespace modar
