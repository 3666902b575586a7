// A rectangle that fills the viewport; its corners (0 or 1) become texture coordinates by an affine map: the columns
// of its matrix in u_turn, the texture coordinate of corner (0, 0) in u_start.
attribute vec2 a_corner;
uniform vec4 u_turn;
uniform vec2 u_start;
varying vec2 v_uv;

void main() {
  gl_Position = vec4(a_corner * 2.0 - 1.0, 0.0, 1.0);
  v_uv = a_corner.x * u_turn.xy + a_corner.y * u_turn.zw + u_start;
}
