// The camera's picture. Defines: CHROMA_PAIR (luma, and a second texture of interleaved chroma: its
// order is in u_swap) or CHROMA_PLANES (luma, and one texture for each chroma); neither: RGB.
precision mediump float;
#ifdef GL_FRAGMENT_PRECISION_HIGH
varying highp vec2 v_uv;
#else
varying vec2 v_uv;
#endif
uniform sampler2D u_texture;
#ifdef CHROMA_PAIR
uniform sampler2D u_second;
uniform float u_swap;
#endif
#ifdef CHROMA_PLANES
uniform sampler2D u_second;
uniform sampler2D u_third;
#endif
#if defined(CHROMA_PAIR) || defined(CHROMA_PLANES)
// Luma's scale and offset, the scale of chroma: full or limited range.
uniform vec3 u_range;

vec3 from_yuv(float luma, vec2 chroma) {
  float y = luma * u_range.x + u_range.y;
  // ITU-R BT.601; 128 means no chroma.
  vec2 uv = (chroma - 0.50196078) * u_range.z;
  return vec3(y + 1.402 * uv.y, y - 0.344136 * uv.x - 0.714136 * uv.y, y + 1.772 * uv.x);
}
#endif

void main() {
#ifdef CHROMA_PAIR
  vec4 pair = texture2D(u_second, v_uv);
  vec2 chroma = mix(vec2(pair.r, pair.a), vec2(pair.a, pair.r), u_swap);
  gl_FragColor = vec4(from_yuv(texture2D(u_texture, v_uv).r, chroma), 1.0);
#else
#ifdef CHROMA_PLANES
  vec2 chroma = vec2(texture2D(u_second, v_uv).r, texture2D(u_third, v_uv).r);
  gl_FragColor = vec4(from_yuv(texture2D(u_texture, v_uv).r, chroma), 1.0);
#else
  gl_FragColor = vec4(texture2D(u_texture, v_uv).rgb, 1.0);
#endif
#endif
}
