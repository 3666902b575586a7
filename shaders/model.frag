// Lit surface: base colour (texture, vertex colour, or white) times light, plus the added light; both
// come from model.vert, as factors of sRGB and squares of sRGB.
// Defines: TEXTURED; ALPHA_TWIN (alpha is the luminance of a second texture), and with it
// CUT_OUT (there or not); COLOURED; SHINY.
precision mediump float;
varying vec3 v_light;
#ifdef SHINY
varying vec3 v_shine;
#endif
uniform float u_opacity;
#ifdef TEXTURED
// Not touched before the look-up: some GPUs keep more bits of a coordinate then.
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
  float alpha = texture2D(u_alpha, v_uv).g;
#ifdef CUT_OUT
  if (alpha < 0.5) discard;
#else
  base.a *= alpha;
  // Empty texels must not fill the depth buffer.
  if (base.a < 0.03) discard;
#endif
#endif
#ifdef COLOURED
  base *= vec4(sqrt(v_colour.rgb), v_colour.a);
#endif
  base.rgb *= v_light;
#ifdef SHINY
  // The sum in linear light, as stored: off by 3.6 of 255 at most and by 0.9 in the mean.
  base.rgb = sqrt(max(base.rgb * base.rgb + v_shine * (1.0 - 0.2 * base.rgb), 0.0));
#endif
  gl_FragColor = base;
}
