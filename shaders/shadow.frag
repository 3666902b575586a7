// Darkens the picture behind it to the remaining share of light: linear in the texture, and the
// picture behind is sRGB, where the root of a factor multiplies.
precision mediump float;
varying vec2 v_uv;
uniform sampler2D u_texture;

void main() {
  gl_FragColor = vec4(0.0, 0.0, 0.0, 1.0 - sqrt(texture2D(u_texture, v_uv).r));
}
