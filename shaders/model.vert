// Any vertex layout of a bundle, one variant a layout. One item has one matrix to clip space, and its
// light comes in its model's space, so that normals are taken unchanged. Where a call draws several
// items, a slot is three rows of the affine matrix from attribute space to eye space, and the scale
// and offset of uv; light comes in eye space.
// Defines: NORMAL_XYZ or NORMAL_OCT; TEXTURED; COLOURED; SHINY (adds a highlight, what it mirrors, emission);
// SKINNED (bones turn vertices in model space, which is attribute space then), with it MORPHED;
// SLOT_STREAM with SLOT_COUNT (a vertex chooses its slot), or SLOT_ATTRIBUTES (rows step once an
// instance), or neither: one item, whose matrix keeps angles.
//
// Light is summed here in linear light. A fragment multiplies stored colours (sRGB):
// that equals a product in linear light where the transfer function is a power, so the sum is
// handed over encoded, and the fragment's work is that of one product.
attribute vec3 a_position;
#ifdef SKINNED
// Bones of the part, three rows each; from a_position to model space: an offset, and a step in w.
attribute vec4 a_joints;
attribute vec4 a_weights;
uniform vec4 u_bones[96];
uniform vec4 u_decode;
#ifdef MORPHED
// Of four targets: a vertex's way along an axis, and how much of each.
attribute vec4 a_morph_x;
attribute vec4 a_morph_y;
attribute vec4 a_morph_z;
uniform vec4 u_morph;
#endif
vec4 bone0 = vec4(0.0);
vec4 bone1 = vec4(0.0);
vec4 bone2 = vec4(0.0);
void add_bone(float joint, float weight) {
  int row = 3 * int(joint + 0.5);
  bone0 += weight * u_bones[row];
  bone1 += weight * u_bones[row + 1];
  bone2 += weight * u_bones[row + 2];
}
#endif
#ifdef NORMAL_XYZ
// w: the share of the light from all around that reaches the vertex; 1 where nobody measured it.
attribute vec4 a_normal;
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
uniform mat4 u_to_clip;
uniform vec4 u_uv_map;
// The camera in attribute space, which is model space but for its origin and scale.
uniform vec4 u_eye;
#endif
#endif
#if defined(SLOT_ATTRIBUTES) || defined(SLOT_STREAM)
#define SLOTS
uniform mat4 u_projection;
#endif
// What reaches a white surface from all around, as polynomials of its normal in light's space: the
// linear parts of red, green and blue (constant in w), the quadratic ones in xy, yz, z^2, zx, and
// all three in x^2 - y^2. Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance
// Environment Maps", 2001.
uniform vec4 u_sky[7];
// The key light: its direction in that space; its colour, and in w what surfaces without normals get.
uniform vec4 u_key;
uniform vec4 u_key_colour;
// As stored (sRGB); w: 1 for a material that is lit on both sides.
uniform vec4 u_diffuse;
varying vec3 v_light;
#ifdef SHINY
// In linear light; w: the square of GGX's alpha.
uniform vec4 u_specular;
// w: metalness.
uniform vec4 u_emission;
// Of the reflection: factors on the linear and quadratic parts of the sky, the share straight on and the increase at a grazing angle.
uniform vec4 u_mirror;
// The share of the highlight that the surface shows besides its own light.
uniform float u_share;
// Squares of added light in sRGB.
varying vec3 v_shine;
#endif
#ifdef TEXTURED
attribute vec2 a_uv;
varying vec2 v_uv;
#endif
#ifdef COLOURED
attribute vec4 a_colour;
// Squares of sRGB, near linear light, in which colours are mixed.
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
vec3 model_normal() { return a_normal.xyz; }
#endif

// Linear light to sRGB, as a factor on a colour in sRGB: 1.05 x^(1/2) - 0.05 x. Colour times factor
// is off by 6.6 of 255 at most and by 1.5 in the mean, over all colours and light of 0.02 to 1.5
// (1.05 and -0.05 have the least greatest error; the root alone: 9.5 and 2.1).
vec3 encode(vec3 light) { return 1.05 * sqrt(light) - 0.05 * light; }

// The sky's light along n; band: factors on its linear and quadratic parts.
vec3 sky_along(vec3 n, vec2 band) {
  vec4 line = vec4(band.x * n, 1.0);
  vec4 square = band.y * n.xyzz * n.yzzx;
  square.z += (1.0 - band.y) / 3.0;
  return max(vec3(dot(u_sky[0], line), dot(u_sky[1], line), dot(u_sky[2], line)) +
                 vec3(dot(u_sky[3], square), dot(u_sky[4], square), dot(u_sky[5], square)) +
                 u_sky[6].rgb * (band.y * (n.x * n.x - n.y * n.y)), 0.0);
}

void main() {
#ifdef SLOT_ATTRIBUTES
  vec4 row0 = a_row0;
  vec4 row1 = a_row1;
  vec4 row2 = a_row2;
  vec4 uv_map = u_slots[3];
#endif
#ifdef SLOT_STREAM
#ifdef SKINNED
  int base = 0;
#else
  int base = 4 * int(a_slot + 0.5);
#endif
  vec4 row0 = u_slots[base];
  vec4 row1 = u_slots[base + 1];
  vec4 row2 = u_slots[base + 2];
  vec4 uv_map = u_slots[base + 3];
#endif
#ifdef SKINNED
  add_bone(a_joints.x, a_weights.x);
  add_bone(a_joints.y, a_weights.y);
  add_bone(a_joints.z, a_weights.z);
  add_bone(a_joints.w, a_weights.w);
  vec4 rest = vec4(u_decode.xyz + u_decode.w * a_position, 1.0);
#ifdef MORPHED
  rest.xyz += vec3(dot(a_morph_x, u_morph), dot(a_morph_y, u_morph), dot(a_morph_z, u_morph));
#endif
  vec4 point = vec4(dot(bone0, rest), dot(bone1, rest), dot(bone2, rest), 1.0);
#else
  vec4 point = vec4(a_position, 1.0);
#endif
  // From the camera to the vertex.
#ifdef SLOTS
  vec3 ray = vec3(dot(row0, point), dot(row1, point), dot(row2, point));
  gl_Position = u_projection * vec4(ray, 1.0);
#else
  vec4 uv_map = u_uv_map;
  vec3 ray = point.xyz - u_eye.xyz;
  gl_Position = u_to_clip * point;
#endif

#if defined(NORMAL_XYZ) || defined(NORMAL_OCT)
  vec3 n = model_normal();
#ifdef SKINNED
  n = vec3(dot(bone0.xyz, n), dot(bone1.xyz, n), dot(bone2.xyz, n));
#endif
#ifdef SLOTS
  // Normals go by the cofactors of the matrix; a mirror turns their sign with the determinant.
  vec3 cofactor0 = cross(row1.xyz, row2.xyz);
  vec3 cofactor1 = cross(row2.xyz, row0.xyz);
  vec3 cofactor2 = cross(row0.xyz, row1.xyz);
  n = vec3(dot(cofactor0, n), dot(cofactor1, n), dot(cofactor2, n));
  n = normalize(n) * sign(dot(row0.xyz, cofactor0));
#else
  n = normalize(n);
#endif
  if (u_diffuse.w > 0.5) n = faceforward(n, ray, n);
  vec3 sky = sky_along(n, vec2(1.0));
#ifdef NORMAL_XYZ
  sky *= a_normal.w;
#endif
  vec3 light = sky + u_key_colour.rgb * max(dot(n, u_key.xyz), 0.0);
#else
  // Nothing tells which way the surface looks: its colours are shown.
  vec3 light = vec3(u_key_colour.w);
#endif
#ifdef SHINY
  vec3 added = u_emission.rgb;
#if defined(NORMAL_XYZ) || defined(NORMAL_OCT)
  ray = normalize(ray);
  float alpha = sqrt(u_specular.w);
  // Rough surfaces mirror the room nearer to their normal.
  vec3 mirrored = sky_along(normalize(mix(reflect(ray, n), n, alpha)), u_mirror.xy);
#ifdef NORMAL_XYZ
  mirrored *= 0.5 + 0.5 * a_normal.w;
#endif
  // Schlick's approximation of Fresnel's equations.
  float view = abs(dot(n, ray));
  float e = 1.0 - view;
  added += mirrored * (u_mirror.z + u_mirror.w * e * e * e * e * e);
  // GGX's lobe, 1 where all directions are one, and Hammon's approximation of its masking.
  float to_key = max(dot(n, u_key.xyz), 0.0);
  float halfway = max(dot(n, normalize(u_key.xyz - ray)), 0.0);
  float lobe = u_specular.w / (1.0 - (1.0 - u_specular.w) * halfway * halfway);
  vec3 shine = u_specular.rgb * (lobe * lobe * 2.0 * to_key /
                                 max(mix(2.0 * to_key * view, to_key + view, alpha), 0.05));
  added += u_share * shine;
  light = mix(light, mirrored * (1.0 - 0.25 * alpha) + shine, u_emission.w);
#endif
  vec3 stored = max(1.055 * pow(max(added, 0.0001), vec3(1.0 / 2.4)) - 0.055, 0.0);
  v_shine = stored * stored;
#endif
  v_light = u_diffuse.rgb * encode(light);
#ifdef TEXTURED
  v_uv = a_uv * uv_map.xy + uv_map.zw;
#endif
#ifdef COLOURED
  v_colour = vec4(a_colour.rgb * a_colour.rgb, a_colour.a);
#endif
}
