// A GL driver is the judge of our decoder: it must show the same pixels for the same blocks.
#include <GLES2/gl2.h>
#include <GLES2/gl2ext.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "bake/texture/texture.hpp"
#include "modar/gl_context.hpp"
#include "tests/texture/etc1_block.hpp"

namespace modar {
namespace {

constexpr GLsizei kSide = 256;

GLuint compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  return shader;
}

void use_copy_program() {
  const GLuint program = glCreateProgram();
  glAttachShader(program, compile(GL_VERTEX_SHADER,
                                  "attribute vec2 at; varying vec2 uv;"
                                  "void main() { uv = at * 0.5 + 0.5;"
                                  " gl_Position = vec4(at, 0.0, 1.0); }"));
  glAttachShader(program, compile(GL_FRAGMENT_SHADER,
                                  "precision mediump float; varying highp vec2 uv;"
                                  "uniform sampler2D image;"
                                  "void main() { gl_FragColor = texture2D(image, uv); }"));
  glBindAttribLocation(program, 0, "at");
  glLinkProgram(program);
  glUseProgram(program);
}

void bind_texture() {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

/// Draws the blocks one texel a pixel, and reads them back.
std::vector<std::uint8_t> shown_by_gl(const std::vector<std::byte>& blocks) {
  bind_texture();  // of the frame buffer
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, kSide, kSide, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  GLint target = 0;
  glGetIntegerv(GL_TEXTURE_BINDING_2D, &target);
  GLuint frame = 0;
  glGenFramebuffers(1, &frame);
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                         static_cast<GLuint>(target), 0);
  bind_texture();
  glCompressedTexImage2D(GL_TEXTURE_2D, 0, GL_ETC1_RGB8_OES, kSide, kSide, 0,
                         static_cast<GLsizei>(blocks.size()), blocks.data());
  use_copy_program();
  glViewport(0, 0, kSide, kSide);
  glDisable(GL_DITHER);
  constexpr std::array<GLfloat, 8> kCorners = {-1, -1, 1, -1, -1, 1, 1, 1};
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, kCorners.data());
  glEnableVertexAttribArray(0);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  std::vector<std::uint8_t> pixels(std::size_t{kSide} * kSide * 4);
  glReadPixels(0, 0, kSide, kSide, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  return pixels;
}

/// Random blocks of all modes, tables and codes, some with bases at the ends of their range.
std::vector<std::byte> random_legal_blocks() {
  std::mt19937 random(17);
  const auto below = [&random](unsigned limit) { return static_cast<int>(random() % limit); };
  std::vector<std::byte> blocks;
  for (int i = 0; i < kSide / 4 * kSide / 4; ++i) {
    test::Etc1Block block;
    block.differential = below(2) != 0;
    block.flip = below(2) != 0;
    const int top = block.differential ? 31 : 15;
    for (std::size_t c = 0; c < 3; ++c) {
      block.base[0][c] = i % 3 == 0 ? below(2) * top : below(static_cast<unsigned>(top) + 1);
      block.base[1][c] =
          block.differential ? std::clamp(block.base[0][c] + below(8) - 4, 0, top) : below(16);
    }
    block.table = {below(8), below(8)};
    for (std::uint8_t& code : block.code) code = static_cast<std::uint8_t>(below(4));
    std::array<std::byte, 8> bytes{};
    test::pack_etc1(block, bytes);
    blocks.insert(blocks.end(), bytes.begin(), bytes.end());
  }
  return blocks;
}

TEST(MesaEtc1, ShowsThePixelsOfOurDecoder) {
  const Result<std::unique_ptr<GlContext>> context = GlContext::create_offscreen();
  if (!context) GTEST_SKIP() << to_line(context.error());
  if (!probe_gl_caps().reads(TextureFormat::kEtc1Rgb)) GTEST_SKIP() << "this driver has no ETC1";
  const std::vector<std::byte> blocks = random_legal_blocks();
  EXPECT_EQ(shown_by_gl(blocks),
            decode_texture(TextureFormat::kEtc1Rgb, blocks, kSide, kSide).pixels);
}

}  // namespace
}  // namespace modar
