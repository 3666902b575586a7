// Rectangles of the patterns' planes, placed by the processor: of n copies all in one call.
attribute vec4 a_position;
attribute vec2 a_uv;
// 1: at its depth; 0: never cut off by the planes that enclose the models.
uniform float u_depth;
varying vec2 v_uv;

void main() {
  gl_Position = a_position;
  gl_Position.z *= u_depth;
  v_uv = a_uv;
}
