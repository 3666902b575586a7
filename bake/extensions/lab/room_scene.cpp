// Boards are drawn by scan lines: depth and picture coordinates are linear in the pixel up to a
// common divisor.
#include "bake/extensions/lab/room_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace modar {
namespace {

double mirrored(double t, int repeat) {
  const double scaled = t * repeat;
  const double whole = std::floor(scaled);
  const double part = scaled - whole;
  return static_cast<int>(whole) % 2 == 0 ? part : 1 - part;
}

double sample(const GrayPicture& picture, double u, double v) {
  const double x = std::clamp(u * picture.width - 0.5, 0.0, picture.width - 1.001);
  const double y = std::clamp(v * picture.height - 0.5, 0.0, picture.height - 1.001);
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const double fx = x - column;
  const double fy = y - row;
  const std::uint8_t* p = picture.pixels.data() + row * picture.width + column;
  const std::uint8_t* q = p + picture.width;
  return (p[0] * (1 - fx) + p[1] * fx) * (1 - fy) + (q[0] * (1 - fx) + q[1] * fx) * fy;
}

/// A board before a camera: a pixel's ray (x, y, 1) meets it at depth 1 / dot(closeness, ray), and
/// there its coordinates are dot(u, ray) and dot(v, ray) by dot(closeness, ray).
struct Facing {
  glm::dvec3 closeness;
  glm::dvec3 u;
  glm::dvec3 v;
  const Mipmap* levels;
  int repeat;
  double texels;  ///< of the finest level, a unit of length

  Facing(const Board& board, const Pose& pose) : levels(board.picture), repeat(board.repeat) {
    const glm::dvec3 corner = pose.rotation * board.corner + pose.translation;
    const glm::dmat3 basis(pose.rotation * board.right, pose.rotation * board.down, corner);
    const glm::dmat3 back = glm::transpose(glm::inverse(basis));
    // A point s * ray = right * u + down * v + corner: back's columns give u / s, v / s, 1 / s.
    u = back[0];
    v = back[1];
    closeness = back[2];
    texels = levels->front().width * repeat / glm::length(board.right);
  }
};

}  // namespace

Mipmap make_mipmap(GrayPicture picture) {
  Mipmap levels{std::move(picture)};
  while (levels.back().width >= 4 && levels.back().height >= 4) {
    const GrayPicture& from = levels.back();
    GrayPicture half{from.width / 2, from.height / 2, {}};
    for (int y = 0; y < half.height; ++y) {
      for (int x = 0; x < half.width; ++x) {
        const std::uint8_t* p = from.pixels.data() + (2 * y) * from.width + 2 * x;
        half.pixels.push_back(
            static_cast<std::uint8_t>((p[0] + p[1] + p[from.width] + p[from.width + 1] + 2) / 4));
      }
    }
    levels.push_back(std::move(half));
  }
  return levels;
}

std::vector<Board> make_room(std::span<const Mipmap> pictures, Random& random) {
  std::vector<Board> boards;
  std::size_t next = 0;
  const auto add = [&](glm::dvec3 corner, glm::dvec3 right, glm::dvec3 down, int repeat) {
    boards.push_back({corner, right, down, &pictures[next++ % pictures.size()], repeat});
  };
  // Walls, floor and ceiling.
  add({-8, 6, -0.05}, {16, 0, 0}, {0, -11, 0}, 4);
  add({-8, 6, 12}, {0, 0, -12.05}, {0, -11, 0}, 2);
  add({8, 6, -0.05}, {0, 0, 12.05}, {0, -11, 0}, 2);
  add({-8, -5, -0.05}, {16, 0, 0}, {0, 0, 12.05}, 2);
  add({-8, 6, 12}, {16, 0, 0}, {0, 0, -12.05}, 2);
  // Boards between the pattern and the walls, off the line of sight to the pattern.
  for (int i = 0; i < 10; ++i) {
    const double side = i % 2 == 0 ? -1 : 1;
    const double x = side * random.uniform(1.9, 6.0);
    const double y = random.uniform(-3.5, 2.5);
    const double z = random.uniform(0.2, 2.5);
    const double turn = random.uniform(-0.7, 0.7);
    const double size = random.uniform(0.5, 1.3);
    const glm::dvec3 right{size * std::cos(turn), 0, size * std::sin(turn)};
    add({x, y, z}, right, {0, -size, 0}, 1);
  }
  return boards;
}

Board board_of(const Mipmap& pattern, const Pose& placed) {
  const auto corners = pattern_corners(pattern[0].width, pattern[0].height);
  const auto at = [&](std::size_t i) {
    return placed.rotation * glm::dvec3(corners[i], 0.0) + placed.translation;
  };
  return {at(0), at(1) - at(0), at(3) - at(0), &pattern, 1};
}

GrayPicture render_room(std::span<const Board> boards, const Camera& camera, const Pose& pose,
                        double noise, Random& random) {
  std::vector<Facing> facing;
  for (const Board& board : boards) facing.emplace_back(board, pose);
  GrayPicture frame{camera.width, camera.height, {}};
  frame.pixels.resize(static_cast<std::size_t>(camera.width) *
                      static_cast<std::size_t>(camera.height));
  constexpr double kSubpixels[] = {-0.25, 0.25};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (const double dy : kSubpixels) {
        for (const double dx : kSubpixels) {
          const glm::dvec3 ray((x + dx - camera.cx) / camera.fx, (y + dy - camera.cy) / camera.fy,
                               1);
          double nearest = 1e-6;
          const Facing* hit = nullptr;
          glm::dvec2 where(0.0);
          for (const Facing& one : facing) {
            const double closeness = glm::dot(one.closeness, ray);
            if (closeness <= nearest) continue;
            const double u = glm::dot(one.u, ray) / closeness;
            const double v = glm::dot(one.v, ray) / closeness;
            if (u < 0 || u >= 1 || v < 0 || v >= 1) continue;
            nearest = closeness;
            hit = &one;
            where = {u, v};
          }
          if (hit == nullptr) {
            sum += 128;
            continue;
          }
          // Half a pixel's width at that depth, in texels.
          const double footprint = 0.5 * hit->texels / (nearest * camera.fx);
          const auto level =
              static_cast<std::size_t>(std::clamp(std::lround(std::log2(std::max(footprint, 1.0))),
                                                  0L, static_cast<long>(hit->levels->size()) - 1));
          sum += sample((*hit->levels)[level], mirrored(where.x, hit->repeat),
                        mirrored(where.y, hit->repeat));
        }
      }
      const double seen = 0.25 * sum + noise * random.normal();
      frame.pixels[static_cast<std::size_t>(y * camera.width + x)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(seen), 0L, 255L));
    }
  }
  return frame;
}

}  // namespace modar
