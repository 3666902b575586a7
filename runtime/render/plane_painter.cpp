#include "runtime/render/plane_painter.hpp"

#include <glm/geometric.hpp>

#include "runtime/render/ground.hpp"
#include "runtime/render/program.hpp"

namespace modar {

Result<void> PlanePainter::create(const BundleView& bundle) {
  std::size_t pictures = 0;
  for (std::uint32_t i = 0; i < bundle.nodes().size(); ++i) pictures += is_picture(bundle, i);
  if (pictures == 0) return {};
  planes_.resize(pictures);
  videos_.resize(bundle.nodes().size());
  glGenBuffers(1, &buffer_);
  constexpr const char* kDefines[] = {"", "#define ALPHA_TWIN\n", "#define BESIDE\n",
                                      "#define KEY\n"};
  for (std::uint32_t i = 0; i < bundle.nodes().size(); ++i) {
    if (!is_picture(bundle, i)) continue;
    const Program kind = program_of(bundle, i);
    if (programs_[kind] != 0) continue;
    MODAR_ASSIGN(const GLuint program,
                 link_program(kDefines[kind], shadow_vertex_source(), plane_fragment_source()));
    programs_[kind] = program;
    glUseProgram(program);
    glUniform1i(glGetUniformLocation(program, "u_texture"), 0);
    glUniform1i(glGetUniformLocation(program, "u_alpha"), 1);
    glUniform1f(glGetUniformLocation(program, "u_depth"), 1.0f);
    if (kind == kKey) key_ = glGetUniformLocation(program, "u_key");
  }
  return {};
}

PlanePainter::Program PlanePainter::program_of(const BundleView& bundle, std::uint32_t node) {
  switch (static_cast<VideoAlpha>(bundle.nodes()[node].alpha)) {
    case VideoAlpha::kBeside:
      return kBeside;
    case VideoAlpha::kKey:
      return kKey;
    case VideoAlpha::kOpaque:
      break;
  }
  const TextureRecord& texture = bundle.textures()[picture_texture(bundle, node)];
  return (texture.flags & kTextureAlpha) != 0 ? kTwin : kOpaque;
}

void PlanePainter::release(GlState& gl) {
  gl.forget_buffer(buffer_);
  glDeleteBuffers(1, &buffer_);
  for (const GLuint program : programs_) glDeleteProgram(program);
  *this = PlanePainter();
}

void PlanePainter::choose(const Job& job, bool see_through) {
  drawn_ = 0;
  chosen_ = 0;
  for (std::uint32_t i = 0; i < job.items.size() && chosen_ < planes_.size(); ++i) {
    if (!is_picture(job.bundle, job.items[i].node)) continue;
    const Program program = program_of(job.bundle, job.items[i].node);
    if ((program != kOpaque) != see_through) continue;
    // From far to near; those of one depth, as on one pattern, in the order of the items.
    const Plane plane{-job.items[i].to_eye[3].z, i, program};
    std::size_t place = chosen_++;
    for (; place > 0 && planes_[place - 1].depth < plane.depth; --place) {
      planes_[place] = planes_[place - 1];
    }
    planes_[place] = plane;
  }
}

void PlanePainter::draw(const Job& job, const glm::vec3* point) {
  std::size_t end = chosen_;
  const auto behind = [&](const Plane& plane) {
    const glm::mat4& place = job.items[plane.item].to_eye;
    const glm::vec3 normal(place[2]);
    const glm::vec3 middle(place[3]);
    return glm::dot(normal, *point - middle) * glm::dot(normal, -middle) > 0.0f;
  };
  while (point != nullptr && end > drawn_ && !behind(planes_[end - 1])) --end;
  for (; drawn_ < end; ++drawn_) draw_plane(job, planes_[drawn_]);
}

void PlanePainter::draw_plane(const Job& job, const Plane& plane) {
  const bool see_through = plane.program != kOpaque;
  const std::uint32_t node = job.items[plane.item].node;
  const std::uint32_t texture = picture_texture(job.bundle, node);
  GlState& gl = job.gl;
  gl.use_program(programs_[plane.program]);
  gl.set_culling(false);
  gl.set_depth_test(true);
  gl.set_depth_writes(!see_through);
  gl.set_colour_writes(true);
  gl.set_blending(see_through);
  gl.bind_texture(0, videos_[node] != 0 ? videos_[node] : job.textures.colour(texture));
  if (plane.program == kTwin) gl.bind_texture(1, job.textures.alpha(texture));
  if (plane.program == kKey) {
    const NodeRecord& record = job.bundle.nodes()[node];
    glUniform4f(key_, record.key[0], record.key[1], record.key[2], record.reach);
  }
  const glm::mat4 to_clip = job.projection * job.items[plane.item].to_eye;
  std::array<ClipVertex, 4> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::vec2 uv(i % 2, i / 2);
    // The first row of a texture is the top one.
    corners[i] = {to_clip * glm::vec4(2.0f * uv.x - 1.0f, 1.0f - 2.0f * uv.y, 0.0f, 1.0f), uv};
  }
  draw_clip_vertices(corners, GL_TRIANGLE_STRIP, buffer_, gl, job.stats);
  job.stats.triangles += 2;
}

}  // namespace modar
