// A rectangle of a pattern's plane; its corners (0 or 1) become texture coordinates.
attribute vec2 a_corner;
uniform mat4 u_matrix;
// The corner with the least x and y, and the sides.
uniform vec4 u_rectangle;
// 1: as deep as it lies; 0: never cut off by the planes that enclose the models.
uniform float u_depth;
varying vec2 v_uv;

void main() {
  gl_Position = u_matrix * vec4(u_rectangle.xy + a_corner * u_rectangle.zw, 0.0, 1.0);
  gl_Position.z *= u_depth;
  v_uv = vec2(a_corner.x, 1.0 - a_corner.y);
}
