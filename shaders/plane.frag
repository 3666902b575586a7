// A picture on a pattern: its texels unchanged, without light. Defines: ALPHA_TWIN (alpha
// is the luminance of a second texture); of videos BESIDE (the right half is the left half's alpha) or
// KEY (a colour is not seen).
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

#ifdef KEY
// Red, green, blue; how far from them a colour may be.
uniform vec4 u_key;
#endif

void main() {
  float alpha = 1.0;
#ifdef BESIDE
  vec2 half_uv = vec2(0.5 * v_uv.x, v_uv.y);
  vec3 colour = texture2D(u_texture, half_uv).rgb;
  alpha = texture2D(u_texture, half_uv + vec2(0.5, 0.0)).g;
#else
  vec3 colour = texture2D(u_texture, v_uv).rgb;
#endif
#ifdef ALPHA_TWIN
  alpha = texture2D(u_alpha, v_uv).g;
#endif
#ifdef KEY
  vec3 far = abs(colour - u_key.rgb);
  float reach = max(u_key.a, 0.004);
  alpha = clamp(max(far.r, max(far.g, far.b)) / (0.5 * reach) - 1.0, 0.0, 1.0);
#endif
  gl_FragColor = vec4(colour, alpha);
}
