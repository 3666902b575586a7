// A rectangle that fills the viewport; u_uv maps its corners (0 or 1) to texture coordinates.
attribute vec2 a_corner;
uniform vec4 u_uv;
varying vec2 v_uv;

void main() {
  gl_Position = vec4(a_corner * 2.0 - 1.0, 0.0, 1.0);
  v_uv = a_corner * u_uv.xy + u_uv.zw;
}
