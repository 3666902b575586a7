// Rectangles of the patterns' planes: all shadows of a page in one call, all that hides in another.
#include "runtime/render/ground.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

#include <glm/gtc/matrix_inverse.hpp>

#include "runtime/render/program.hpp"

namespace modar {
namespace {

/// Largest side of a page of shadows, which are at most 256 x 256 texels each: what the smallest
/// device of assets/devices can hold.
constexpr std::uint32_t kPageSide = 1024;

const ShadowHeader& header_of(std::span<const std::byte> section) {
  return *reinterpret_cast<const ShadowHeader*>(section.data());
}

/// The shadow goes with the model where a visitor has turned, moved or enlarged that, and stays in
/// the plane.
glm::mat4 shadow_to_eye(const DrawItem& item, const SceneRecord& scene) {
  // In double precision, as others invert matrices: one function fewer.
  const glm::dmat4 to_world = glm::affineInverse(glm::dmat4(item.world_to_eye));
  const glm::dmat4 to_model = glm::affineInverse(glm::dmat4(scene_matrix(scene)));
  glm::mat4 moved(to_world * glm::dmat4(item.to_eye) * to_model);
  for (int column = 0; column < 4; ++column) moved[column][2] = 0.0f;
  return item.world_to_eye * moved;
}

/// Texels of the filled part of a page. Each shadow has a border of its own outermost texels,
/// which linear filtering reads.
struct Page {
  std::uint32_t side = 0;  ///< texels from row to row
  std::vector<std::uint8_t> texels;
  std::uint32_t x = 0;       ///< where the next shadow of the shelf begins
  std::uint32_t top = 0;     ///< of the shelf
  std::uint32_t bottom = 0;  ///< of the highest shadow of the shelf

  /// Where the shadow's own texels begin; false where the page is full.
  bool place(const ShadowHeader& header, std::uint32_t& left, std::uint32_t& first_row) {
    const std::uint32_t width = header.width + 2;
    if (x + width > side) {
      x = 0;
      top = bottom;
    }
    if (top + header.height + 2 > kPageSide) return false;
    left = x + 1;
    first_row = top + 1;
    x += width;
    bottom = std::max(bottom, top + header.height + 2);
    texels.resize(std::size_t{side} * bottom);
    return true;
  }

  void fill(std::span<const std::byte> section, std::uint32_t left, std::uint32_t first_row) {
    const ShadowHeader& header = header_of(section);
    const auto* from = reinterpret_cast<const std::uint8_t*>(section.data() + sizeof header);
    for (std::uint32_t y = 0; y < header.height + 2; ++y) {
      const std::uint32_t row = std::clamp(y, 1u, header.height) - 1;
      std::uint8_t* to = &texels[std::size_t{side} * (first_row - 1 + y) + left - 1];
      to[0] = from[std::size_t{header.width} * row];
      std::memcpy(to + 1, from + std::size_t{header.width} * row, header.width);
      to[header.width + 1] = to[header.width];
    }
  }

  [[nodiscard]] GLuint upload() const {
    GLuint texture = 0;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_LUMINANCE, static_cast<GLsizei>(side),
                 static_cast<GLsizei>(bottom), 0, GL_LUMINANCE, GL_UNSIGNED_BYTE, texels.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
  }
};

}  // namespace

void draw_clip_vertices(std::span<const ClipVertex> vertices, GLenum mode, GLuint buffer,
                        GlState& gl, RenderStats& stats) {
  gl.bind_array_buffer(buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data(),
               GL_STREAM_DRAW);
  constexpr GLsizei kStride = sizeof(ClipVertex);
  gl.set_attribute(kAttributePosition, {buffer, 4, GL_FLOAT, GL_FALSE, kStride, 0});
  gl.set_attribute(kAttributeUv,
                   {buffer, 2, GL_FLOAT, GL_FALSE, kStride, offsetof(ClipVertex, uv)});
  gl.enable_attributes(1u << kAttributePosition | 1u << kAttributeUv);
  glDrawArrays(mode, 0, static_cast<GLsizei>(vertices.size()));
  ++stats.draw_calls;
  stats.bytes_uploaded += vertices.size_bytes();
}

Result<void> Ground::create(const BundleView& bundle) {
  if (bundle.scenes().empty()) return {};
  glGenBuffers(1, &buffer_);
  MODAR_ASSIGN(program_, link_program("", shadow_vertex_source(), shadow_fragment_source()));
  depth_ = glGetUniformLocation(program_, "u_depth");
  glUseProgram(program_);
  glUniform1i(glGetUniformLocation(program_, "u_texture"), 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  vertices_.reserve(6 * bundle.scenes().size());
  lay_out(bundle);
  return {};
}

void Ground::lay_out(const BundleView& bundle) {
  // As wide as all shadows side by side, where that is less: a single one takes no more than
  // itself.
  std::uint32_t side = 0;
  for (std::uint32_t scene = 0; scene < bundle.scenes().size() && side < kPageSide; ++scene) {
    const auto section = bundle.section(SectionType::kShadow, scene);
    if (!section.empty()) side = std::min(side + header_of(section).width + 2, kPageSide);
  }
  std::vector<Page> pages;
  for (std::uint32_t scene = 0; scene < bundle.scenes().size(); ++scene) {
    shadows_.emplace_back();
    const auto section = bundle.section(SectionType::kShadow, scene);
    if (section.empty()) continue;
    const ShadowHeader& header = header_of(section);
    std::uint32_t left = 0;
    std::uint32_t first_row = 0;
    if (pages.empty() || !pages.back().place(header, left, first_row)) {
      pages.push_back({side, {}, 0, 0, 0});
      pages.back().place(header, left, first_row);
    }
    pages.back().fill(section, left, first_row);
    shadows_.back() = {static_cast<std::uint32_t>(pages.size()), left, first_row};
  }
  for (const Page& page : pages) {
    pages_.push_back(
        {page.upload(), static_cast<float>(page.side), static_cast<float>(page.bottom)});
  }
}

void Ground::release(GlState& gl) {
  for (const ShadowPage& page : pages_) {
    gl.forget_texture(page.texture);
    glDeleteTextures(1, &page.texture);
  }
  gl.forget_buffer(buffer_);
  glDeleteBuffers(1, &buffer_);
  glDeleteProgram(program_);
  *this = Ground();
}

void Ground::add_rectangle(const glm::mat4& matrix, const Rectangle& plane,
                           const Rectangle& texels) {
  const auto corner = [&](float x, float y) {
    const glm::vec2 place = glm::mix(plane.low, plane.high, glm::vec2(x, y));
    vertices_.push_back({matrix * glm::vec4(place, 0.0f, 1.0f),
                         glm::mix(texels.low, texels.high, glm::vec2(x, y))});
  };
  for (const auto& [x, y] : {std::pair{0.0f, 0.0f},
                             {1.0f, 0.0f},
                             {0.0f, 1.0f},
                             {0.0f, 1.0f},
                             {1.0f, 0.0f},
                             {1.0f, 1.0f}}) {
    corner(x, y);
  }
}

void Ground::draw_rectangles(float depth, GlState& gl, RenderStats& stats) {
  if (vertices_.empty()) return;
  gl.use_program(program_);
  gl.set_culling(false);
  glUniform1f(depth_, depth);
  draw_clip_vertices(vertices_, GL_TRIANGLES, buffer_, gl, stats);
}

void Ground::draw_shadows(const BundleView& bundle, const glm::mat4& projection,
                          std::span<const DrawItem> items, GlState& gl, RenderStats& stats) {
  for (std::uint32_t p = 0; p < pages_.size(); ++p) {
    vertices_.clear();
    for (const DrawItem& item : items) {
      if (item.scene >= shadows_.size() || shadows_[item.scene].page != p + 1) continue;
      const Shadow& shadow = shadows_[item.scene];
      const ShadowHeader& header = header_of(bundle.section(SectionType::kShadow, item.scene));
      const glm::vec2 scale(1.0f / pages_[p].width, 1.0f / pages_[p].height);
      const glm::vec2 first(shadow.left, shadow.first_row);
      const glm::vec2 end = first + glm::vec2(header.width, header.height);
      // The first row is the one of the greatest y.
      add_rectangle(projection * shadow_to_eye(item, bundle.scenes()[item.scene]),
                    {{header.low[0], header.low[1]}, {header.high[0], header.high[1]}},
                    {glm::vec2(first.x, end.y) * scale, glm::vec2(end.x, first.y) * scale});
    }
    if (vertices_.empty()) continue;
    gl.bind_texture(0, pages_[p].texture);
    gl.set_depth_test(false);
    gl.set_blending(true);
    draw_rectangles(0.0f, gl, stats);
  }
}

void Ground::hide_below(const BundleView& bundle, const glm::mat4& projection,
                        std::span<const DrawItem> items, GlState& gl, RenderStats& stats) {
  vertices_.clear();
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].scene >= bundle.scenes().size()) continue;
    const std::uint32_t pattern = bundle.scenes()[items[i].scene].pattern;
    // Once for all models of a pattern.
    const bool known = std::any_of(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const DrawItem& before) {
                                     return before.scene < bundle.scenes().size() &&
                                            bundle.scenes()[before.scene].pattern == pattern &&
                                            before.world_to_eye == items[i].world_to_eye;
                                   });
    if (known) continue;
    const PatternRecord& record = bundle.patterns()[pattern];
    const glm::vec2 half(record.half_width, record.half_height);
    add_rectangle(projection * items[i].world_to_eye, {-half, half}, {});
  }
  gl.set_colour_writes(false);
  gl.bind_texture(0, pages_.empty() ? 0 : pages_[0].texture);
  gl.set_depth_test(true);
  gl.set_blending(false);
  draw_rectangles(1.0f, gl, stats);
  gl.set_colour_writes(true);
}

}  // namespace modar
