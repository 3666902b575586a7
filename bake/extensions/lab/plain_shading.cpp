// The shading that ours is compared with: Lambert and Blinn-Phong at vertices, as the ModAR
// paper's OpenGL ES programs have it, in stored colours (no linear light), ambient 0.2 (what
// exporters write as Ka) times 0.3, and a light that turns with the camera. What this project drew
// with before it had light of the room.
#include "bake/extensions/lab/render_bench.hpp"
#include "runtime/render/program.hpp"

namespace modar {
namespace {

/// Attributes and defines are those of shaders/model.vert.
constexpr const char* kPlainVertexSource = R"glsl(
attribute vec3 a_position;
#ifdef NORMAL_XYZ
attribute vec3 a_normal;
#endif
#ifdef NORMAL_OCT
attribute vec2 a_normal;
#endif
#ifdef SLOT_ATTRIBUTES
attribute vec4 a_row0;
attribute vec4 a_row1;
attribute vec4 a_row2;
uniform vec4 u_slots[4];
#else
#ifdef SLOT_STREAM
attribute float a_slot;
uniform vec4 u_slots[4 * SLOT_COUNT];
#else
uniform vec4 u_slots[4];
#endif
#endif
uniform mat4 u_projection;
uniform vec4 u_diffuse;
uniform vec4 u_specular;
uniform vec4 u_emission;
varying vec3 v_light;
varying vec3 v_shine;
#ifdef TEXTURED
attribute vec2 a_uv;
varying vec2 v_uv;
#endif
#ifdef COLOURED
attribute vec4 a_colour;
varying vec4 v_colour;
#endif
#ifdef NORMAL_OCT
vec3 model_normal() {
  vec3 n = vec3(a_normal, 1.0 - abs(a_normal.x) - abs(a_normal.y));
  float fold = max(-n.z, 0.0);
  n.x += n.x >= 0.0 ? -fold : fold;
  n.y += n.y >= 0.0 ? -fold : fold;
  return n;
}
#endif
#ifdef NORMAL_XYZ
vec3 model_normal() { return a_normal; }
#endif
const vec3 kLight = vec3(0.2516, 0.4528, 0.8554);
void main() {
#ifdef SLOT_ATTRIBUTES
  vec4 row0 = a_row0;
  vec4 row1 = a_row1;
  vec4 row2 = a_row2;
  vec4 uv_map = u_slots[3];
#else
#ifdef SLOT_STREAM
  int base = 4 * int(a_slot + 0.5);
#else
  const int base = 0;
#endif
  vec4 row0 = u_slots[base];
  vec4 row1 = u_slots[base + 1];
  vec4 row2 = u_slots[base + 2];
  vec4 uv_map = u_slots[base + 3];
#endif
  vec4 point = vec4(a_position, 1.0);
  vec3 eye = vec3(dot(row0, point), dot(row1, point), dot(row2, point));
  gl_Position = u_projection * vec4(eye, 1.0);
  float diffuse = 1.0;
  float shine = 0.0;
#if defined(NORMAL_XYZ) || defined(NORMAL_OCT)
  vec3 cofactor0 = cross(row1.xyz, row2.xyz);
  vec3 cofactor1 = cross(row2.xyz, row0.xyz);
  vec3 cofactor2 = cross(row0.xyz, row1.xyz);
  vec3 n = model_normal();
  n = vec3(dot(cofactor0, n), dot(cofactor1, n), dot(cofactor2, n));
  n = normalize(n) * sign(dot(row0.xyz, cofactor0));
  vec3 halfway = normalize(kLight - normalize(eye));
  vec2 cosines = vec2(dot(n, kLight), dot(n, halfway));
  cosines = max(mix(cosines, abs(cosines), u_diffuse.w), 0.0);
  diffuse = cosines.x;
  shine = pow(cosines.y + 0.0001, 2.0 / u_specular.w - 2.0);
#endif
  v_light = vec3(0.06) + 0.7 * u_diffuse.rgb * diffuse;
  v_shine = sqrt(u_emission.rgb) + sqrt(u_specular.rgb) * shine;
#ifdef TEXTURED
  v_uv = a_uv * uv_map.xy + uv_map.zw;
#endif
#ifdef COLOURED
  v_colour = a_colour;
#endif
}
)glsl";

constexpr const char* kPlainFragmentSource = R"glsl(
precision mediump float;
varying vec3 v_light;
varying vec3 v_shine;
uniform float u_opacity;
#ifdef TEXTURED
#ifdef GL_FRAGMENT_PRECISION_HIGH
varying highp vec2 v_uv;
#else
varying vec2 v_uv;
#endif
uniform sampler2D u_texture;
#endif
#ifdef ALPHA_TWIN
uniform sampler2D u_alpha;
#endif
#ifdef COLOURED
varying vec4 v_colour;
#endif
void main() {
  vec4 base = vec4(1.0, 1.0, 1.0, u_opacity);
#ifdef TEXTURED
  base.rgb = texture2D(u_texture, v_uv).rgb;
#endif
#ifdef ALPHA_TWIN
  base.a *= texture2D(u_alpha, v_uv).g;
#ifdef CUT_OUT
  if (base.a < 0.5) discard;
  base.a = 1.0;
#else
  if (base.a < 0.03) discard;
#endif
#endif
#ifdef COLOURED
  base *= v_colour;
#endif
  gl_FragColor = vec4(base.rgb * v_light + v_shine, base.a);
}
)glsl";

}  // namespace

PlainShading::PlainShading() {
  before_ = {model_sources().vertex, model_sources().fragment};
  model_sources() = {kPlainVertexSource, kPlainFragmentSource};
}

PlainShading::~PlainShading() {
  model_sources() = {before_[0], before_[1]};
}

}  // namespace modar
