// Compiles and links the embedded shader sources.
#include "runtime/render/program.hpp"

#include <charconv>

namespace modar {
namespace {

#include "shader_sources.inc"

}  // namespace

const char* background_vertex_source() {
  return kBackgroundVertexSource;
}
const char* background_fragment_source() {
  return kBackgroundFragmentSource;
}

const char* shadow_vertex_source() {
  return kShadowVertexSource;
}
const char* shadow_fragment_source() {
  return kShadowFragmentSource;
}

const char* plane_fragment_source() {
  return kPlaneFragmentSource;
}

ModelSources& model_sources() {
  static ModelSources sources = {kModelVertexSource, kModelFragmentSource};
  return sources;
}

namespace {

std::string shader_log(GLuint shader) {
  char text[512] = "";
  glGetShaderInfoLog(shader, sizeof text, nullptr, text);
  return text;
}

/// Deletes the shader when the function ends: a program that it is attached to keeps it.
struct Shader {
  GLuint id = 0;
  ~Shader() { glDeleteShader(id); }
};

bool compile(GLuint shader, const std::string& defines, const char* source) {
  const char* parts[] = {"#version 100\n", defines.c_str(), source};
  glShaderSource(shader, 3, parts, nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  return compiled == GL_TRUE;
}

void name_attributes(GLuint program) {
  glBindAttribLocation(program, kAttributePosition, "a_position");
  glBindAttribLocation(program, kAttributePosition, "a_corner");
  glBindAttribLocation(program, kAttributeNormal, "a_normal");
  glBindAttribLocation(program, kAttributeUv, "a_uv");
  glBindAttribLocation(program, kAttributeColour, "a_colour");
  glBindAttribLocation(program, kAttributeSlot, "a_slot");
  glBindAttribLocation(program, kAttributeRows, "a_row0");
  glBindAttribLocation(program, kAttributeRows + 1, "a_row1");
  glBindAttribLocation(program, kAttributeRows + 2, "a_row2");
  glBindAttribLocation(program, kAttributeJoints, "a_joints");
  glBindAttribLocation(program, kAttributeJoints + 1, "a_weights");
  glBindAttribLocation(program, kAttributeMorphX, "a_morph_x");
  glBindAttribLocation(program, kAttributeMorphY, "a_morph_y");
  glBindAttribLocation(program, kAttributeMorphZ, "a_morph_z");
}

std::string model_defines(const ProgramKey& key) {
  std::string defines;
  const auto define = [&](const char* name) { defines += std::string("#define ") + name + "\n"; };
  if (key.normal == NormalKind::kXyz) define("NORMAL_XYZ");
  if (key.normal == NormalKind::kOctahedral) define("NORMAL_OCT");
  if (key.textured) define("TEXTURED");
  if (key.alpha_twin) define("ALPHA_TWIN");
  if (key.cut_out) define("CUT_OUT");
  if (key.coloured) define("COLOURED");
  if (key.shiny) define("SHINY");
  if (key.skinned) define("SKINNED");
  if (key.morphed) define("MORPHED");
  if (key.slots == SlotKind::kAttributes) define("SLOT_ATTRIBUTES");
  if (key.slots == SlotKind::kStream) {
    char digits[12] = "";
    std::to_chars(digits, digits + sizeof digits - 1, key.slot_count);
    define("SLOT_STREAM");
    define((std::string("SLOT_COUNT ") + digits).c_str());
  }
  return defines;
}

}  // namespace

Result<GLuint> link_program(const std::string& defines, const char* vertex, const char* fragment) {
  const Shader vertex_shader{glCreateShader(GL_VERTEX_SHADER)};
  const Shader fragment_shader{glCreateShader(GL_FRAGMENT_SHADER)};
  for (const auto& [shader, source] :
       {std::pair{vertex_shader.id, vertex}, std::pair{fragment_shader.id, fragment}}) {
    if (!compile(shader, defines, source)) {
      return fail(ExitCode::kUnsupported, "gl.shader", defines, shader_log(shader),
                  "report the driver and this message");
    }
  }
  const GLuint program = glCreateProgram();
  glAttachShader(program, vertex_shader.id);
  glAttachShader(program, fragment_shader.id);
  name_attributes(program);
  glLinkProgram(program);
  GLint linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return program;
  char text[512] = "";
  glGetProgramInfoLog(program, sizeof text, nullptr, text);
  glDeleteProgram(program);
  return fail(ExitCode::kUnsupported, "gl.program", defines, text,
              "report the driver and this message");
}

Result<ModelProgram> make_model_program(const ProgramKey& key) {
  MODAR_ASSIGN(const GLuint linked,
               link_program(model_defines(key), model_sources().vertex, model_sources().fragment));
  ModelProgram program;
  program.key = key;
  program.id = linked;
  const auto place = [&](const char* name) { return glGetUniformLocation(program.id, name); };
  program.slots = place("u_slots");
  program.projection = place("u_projection");
  program.to_clip = place("u_to_clip");
  program.uv_map = place("u_uv_map");
  program.eye = place("u_eye");
  program.bones = place("u_bones");
  program.decode = place("u_decode");
  program.morph = place("u_morph");
  program.sky = place("u_sky");
  program.to_key = place("u_key");
  program.key_colour = place("u_key_colour");
  program.diffuse = place("u_diffuse");
  program.specular = place("u_specular");
  program.emission = place("u_emission");
  program.mirror = place("u_mirror");
  program.share = place("u_share");
  program.opacity = place("u_opacity");
  glUseProgram(program.id);
  glUniform1i(place("u_texture"), 0);
  glUniform1i(place("u_alpha"), 1);
  return program;
}

}  // namespace modar
