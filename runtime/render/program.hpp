// Shader programs: one variant a vertex layout, with the places of its uniforms.
#pragma once

#include <cstdint>
#include <string>

#include "formats/base/error.hpp"
#include "runtime/render/gl.hpp"

namespace modar {

enum class NormalKind : std::uint8_t { kAbsent, kXyz, kOctahedral };
/// Where the matrices of a draw come from.
enum class SlotKind : std::uint8_t { kSingle, kStream, kAttributes };

/// What distinguishes one variant of the model shaders from another.
struct ProgramKey {
  NormalKind normal = NormalKind::kAbsent;
  SlotKind slots = SlotKind::kSingle;
  bool textured = false;
  bool alpha_twin = false;
  bool cut_out = false;  ///< drawn where the twin's alpha is 1/2 and more, and opaque there
  bool coloured = false;
  bool shiny = false;    ///< has a highlight or emission, or mirrors
  bool skinned = false;  ///< bones turn its vertices
  bool morphed = false;  ///< skinned, and morph targets move them before
  int slot_count = 1;    ///< of kStream
  bool operator==(const ProgramKey&) const = default;
};

/// A linked program. Uniforms that a variant lacks are at -1, which GL ignores.
struct ModelProgram {
  ProgramKey key;
  GLuint id = 0;
  GLint slots = -1;
  GLint projection = -1;
  GLint to_clip = -1;  ///< of kSingle, and the next two
  GLint uv_map = -1;
  GLint eye = -1;
  GLint bones = -1;  ///< of skinned, and the next one
  GLint decode = -1;
  GLint morph = -1;  ///< of morphed
  GLint sky = -1;
  GLint to_key = -1;  ///< direction of the key light
  GLint key_colour = -1;
  GLint diffuse = -1;
  GLint specular = -1;
  GLint emission = -1;
  GLint mirror = -1;
  GLint share = -1;
  GLint opacity = -1;
};

/// Vertex uniform vectors that a model program needs in addition to its slots.
inline constexpr int kFixedUniformVectors = 4 + 7 + 2 + 5;

/// Links sources under "#version 100" and `defines` (each a line). Attribute locations are those of
/// AttributeSlot by name. Errors: kUnsupported "gl.shader", "gl.program" with the driver's log.
Result<GLuint> link_program(const std::string& defines, const char* vertex, const char* fragment);

/// The camera picture's shaders; their defines: see shaders/background.frag.
const char* background_vertex_source();
const char* background_fragment_source();

const char* shadow_vertex_source();
const char* shadow_fragment_source();
const char* plane_fragment_source();

/// Shader sources for models. A bench may replace them; affects programs compiled afterwards.
struct ModelSources {
  const char* vertex = nullptr;
  const char* fragment = nullptr;
};
ModelSources& model_sources();

/// Leaves the program in use, its samplers set to units 0 and 1.
Result<ModelProgram> make_model_program(const ProgramKey& key);

}  // namespace modar
