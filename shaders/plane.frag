// A picture that stands on a pattern: its texels as they are, in no light. Define: ALPHA_TWIN (alpha
// is the luminance of a second texture).
precision mediump float;
#ifdef GL_FRAGMENT_PRECISION_HIGH
varying highp vec2 v_uv;
#else
varying vec2 v_uv;
#endif
uniform sampler2D u_texture;
#ifdef ALPHA_TWIN
uniform sampler2D u_alpha;
#endif

void main() {
  float alpha = 1.0;
#ifdef ALPHA_TWIN
  alpha = texture2D(u_alpha, v_uv).g;
#endif
  gl_FragColor = vec4(texture2D(u_texture, v_uv).rgb, alpha);
}
