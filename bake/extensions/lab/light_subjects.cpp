// Models that no package has at hand: leaves on cards, and a glass.
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "bake/extensions/lab/light_bench.hpp"
#include "bake/image/image.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

constexpr double kFullTurn = 6.283185307179586;

/// The text of an OBJ file as it grows.
class ObjText {
 public:
  explicit ObjText(const std::string& materials)
      : text_(materials.empty() ? "" : "mtllib " + materials + "\n") {}

  void material(const std::string& name) { text_ += "usemtl " + name + "\n"; }

  /// A surface of revolution about z; rings from below to above as seen from outside: radius, z.
  void lathe(const std::vector<glm::dvec2>& rings) {
    constexpr int kSectors = 48;
    const int first = vertices_ + 1;
    for (const glm::dvec2& ring : rings) {
      for (int i = 0; i < kSectors; ++i) {
        const double angle = kFullTurn * i / kSectors;
        vertex(ring.x * std::cos(angle), ring.x * std::sin(angle), ring.y);
      }
    }
    for (int r = 0; r + 1 < static_cast<int>(rings.size()); ++r) {
      for (int i = 0; i < kSectors; ++i) {
        const int a = first + r * kSectors + i;
        const int b = first + r * kSectors + (i + 1) % kSectors;
        face({a, b, b + kSectors, a + kSectors}, false);
      }
    }
  }

  /// A standing card through the z axis, seen from both sides, with all of a picture on it.
  void card(double angle, double half_width, double low, double high) {
    const double x = half_width * std::cos(angle);
    const double y = half_width * std::sin(angle);
    const int first = vertices_ + 1;
    vertex(-x, -y, low);
    vertex(x, y, low);
    vertex(x, y, high);
    vertex(-x, -y, high);
    if (!pictured_) text_ += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    pictured_ = true;
    face({first, first + 1, first + 2, first + 3}, true);
    // Vertices of its own, so that the normals of both sides do not cancel out.
    vertex(-x, -y, low);
    vertex(x, y, low);
    vertex(x, y, high);
    vertex(-x, -y, high);
    face({first + 4, first + 7, first + 6, first + 5}, true, true);
  }

  /// A vase with flutes next to a ball: convex, hollow and creased.
  void vase() {
    std::vector<glm::dvec2> rings;
    for (int i = 0; i <= 64; ++i) {
      const double t = i / 64.0;
      rings.emplace_back(0.32 + 0.22 * std::sin(5.2 * t) + 0.03 * std::sin(60 * t), 1.6 * t);
    }
    for (int i = 0; i <= 16; ++i) {
      rings.emplace_back(0.02 + (rings[64].x - 0.05) * (1 - i / 16.0), 1.6 - 0.04 * i);
    }
    lathe(rings);
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void vertex(double x, double y, double z) {
    std::array<char, 96> line{};
    std::snprintf(line.data(), line.size(), "v %.6f %.6f %.6f\n", x, y, z);
    text_ += line.data();
    ++vertices_;
  }

  void face(const std::array<int, 4>& corners, bool pictured, bool reversed = false) {
    text_ += "f";
    for (int i = 0; i < 4; ++i) {
      text_ += " " + std::to_string(corners[static_cast<std::size_t>(i)]);
      if (pictured) text_ += "/" + std::to_string(reversed ? (4 - i) % 4 + 1 : i + 1);
    }
    text_ += "\n";
  }

  std::string text_;
  int vertices_ = 0;
  bool pictured_ = false;
};

struct Leaf {
  glm::dvec2 root{0.0};  ///< of the picture's sides, y up
  glm::dvec2 along{0.0};
  double width = 0;
};

/// Leaves in pairs up a bent stem, on nothing: alpha is 1 in leaves, and falls to 0 in a texel.
RgbaImage leaves() {
  constexpr std::uint32_t kLeafSide = 256;
  std::vector<Leaf> all;
  const auto stem = [](double t) { return glm::dvec2(0.5 + 0.06 * std::sin(4 * t), 0.95 * t); };
  for (int i = 0; i < 9; ++i) {
    const double t = 0.12 + 0.095 * i;
    const double length = 0.36 * std::sin(2.6 * (t + 0.12)) + 0.06;
    for (const double side : {-1.0, 1.0}) {
      const double lift = 0.35 + 0.5 * t + 0.06 * side;
      all.push_back({stem(t), length * glm::dvec2(side * std::cos(lift), std::sin(lift)), 0.3});
    }
  }
  RgbaImage image{kLeafSide, kLeafSide, std::vector<std::uint8_t>(4 * kLeafSide * kLeafSide)};
  for (std::uint32_t row = 0; row < kLeafSide; ++row) {
    for (std::uint32_t column = 0; column < kLeafSide; ++column) {
      const glm::dvec2 p((column + 0.5) / kLeafSide, 1 - (row + 0.5) / kLeafSide);
      double inside = 0.012 - std::fabs(p.x - stem(p.y).x);  // distance from the edge, of the sides
      double shade = 0.75;
      for (std::size_t i = 0; i < all.size(); ++i) {
        const double length = glm::length(all[i].along);
        const glm::dvec2 axis = all[i].along / length;
        const glm::dvec2 from = p - all[i].root;
        const double u = glm::dot(from, axis) / length;
        const double v = glm::dot(from, glm::dvec2(-axis.y, axis.x));
        const double half =
            u > 0 && u < 1 ? all[i].width * length * std::sin(kFullTurn / 2 * u) : -1.0;
        if (half - std::fabs(v) < inside) continue;
        inside = half - std::fabs(v);
        shade = 0.7 + 0.04 * static_cast<double>(i % 7) + (std::fabs(v) < 0.005 ? 0.12 : 0.0);
      }
      const double alpha = std::clamp(0.5 + inside * kLeafSide, 0.0, 1.0);
      const std::array<double, 4> colour = {88 * shade, 168 * shade, 62 * shade, 255 * alpha};
      for (std::size_t c = 0; c < 4; ++c) {
        image.pixels[4 * (std::size_t{row} * kLeafSide + column) + c] =
            static_cast<std::uint8_t>(std::lround(colour[c]));
      }
    }
  }
  return image;
}

/// A room of 6 by 8 by 3 metres as seen from a table in it, as a panorama in Radiance's format: a
/// window, two ceiling lamps and a standing one, gray walls with a dark cupboard, a wooden floor.
std::string room_panorama() {
  constexpr int kRows = 128;
  std::string text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 128 +X 256\n";
  const glm::dvec3 low(-2.5, -5, -0.8);
  const glm::dvec3 high(3.5, 3, 2.2);
  const auto inside = [](double x, double y, const glm::dvec4& box) {
    return x > box.x && x < box.z && y > box.y && y < box.w;
  };
  const auto radiance = [&](const glm::dvec3& d) {
    const glm::dvec3 far = glm::max(low / d, high / d);
    const double t = std::min({far.x, far.y, far.z});
    const glm::dvec3 p = t * d;
    if (t == far.z) {
      if (d.z < 0) return glm::dvec3(0.9, 0.7, 0.5);
      const bool lamp =
          inside(p.x, p.y, {-1.5, -2.5, -0.9, -0.9}) || inside(p.x, p.y, {1.4, -2.5, 2.0, -0.9});
      return lamp ? glm::dvec3(14, 13, 11) : glm::dvec3(0.9);
    }
    if (t == far.x && d.x < 0 && inside(p.y, p.z, {-1.8, -0.1, 0.8, 1.6}))
      return glm::dvec3(7, 8, 9.5);
    if (t == far.y && d.y > 0 && inside(p.x, p.z, {0.8, -0.8, 2.6, 1.2})) return glm::dvec3(0.06);
    if (t == far.x && d.x > 0 && inside(p.y, p.z, {-0.2, 0.2, 0.5, 0.9}))
      return glm::dvec3(20, 14, 8);
    return (0.7 + 0.1 * p.z) * glm::dvec3(0.97, 0.95, 0.9);
  };
  for (int row = 0; row < kRows; ++row) {
    const double polar = kFullTurn / 2 * (row + 0.5) / kRows;
    for (int column = 0; column < 2 * kRows; ++column) {
      const double azimuth = kFullTurn * ((column + 0.5) / (2 * kRows) - 0.5);
      const glm::dvec3 light = radiance({std::sin(polar) * std::sin(azimuth),
                                         std::sin(polar) * std::cos(azimuth), std::cos(polar)});
      int exponent = 0;
      std::frexp(std::max({light.r, light.g, light.b}), &exponent);
      for (int c = 0; c < 3; ++c)
        text += static_cast<char>(static_cast<int>(std::ldexp(light[c], 8 - exponent)));
      text += static_cast<char>(exponent + 128);
    }
  }
  return text;
}

Result<void> write_text(const std::filesystem::path& path, const std::string& text) {
  return write_file(path.string(), std::as_bytes(std::span(text)));
}

}  // namespace

Result<std::vector<std::string>> make_reflecting_subjects(const std::string& folder) {
  const std::filesystem::path in(folder);
  MODAR_TRY(write_text(in / "room.hdr", room_panorama()));
  MODAR_TRY(write_text(in / "gloss.mtl", "newmtl black\nKd 0.12 0.12 0.13\nPr 0.3\nPm 0\n"));
  MODAR_TRY(write_text(in / "metal.mtl", "newmtl brass\nKd 0.92 0.80 0.56\nPr 0.4\nPm 1\n"));
  std::vector<std::string> paths = {(in / "room.hdr").string()};
  for (const std::string name : {"gloss", "metal", "clay"}) {
    ObjText text(name == "clay" ? "" : name + ".mtl");
    if (name != "clay") text.material(name == "gloss" ? "black" : "brass");
    text.vase();
    paths.push_back((in / (name + ".obj")).string());
    MODAR_TRY(write_text(paths.back(), text.text()));
  }
  return paths;
}

Result<std::vector<std::string>> make_light_subjects(const std::string& folder) {
  const std::filesystem::path in(folder);
  MODAR_TRY(write_png(leaves(), (in / "leaves.png").string()));
  MODAR_TRY(write_text(in / "plant.mtl",
                       "newmtl leaves\nKd 1 1 1\nKs 0 0 0\nmap_Kd leaves.png\n"
                       "newmtl pot\nKd 0.72 0.45 0.32\nKs 0 0 0\n"));
  ObjText plant("plant.mtl");
  plant.material("pot");
  plant.lathe({{0.0, 0.0}, {0.30, 0.0}, {0.42, 0.55}, {0.46, 0.55}, {0.46, 0.62}, {0.0, 0.58}});
  plant.material("leaves");
  for (int i = 0; i < 3; ++i) plant.card(kFullTurn * i / 6 + 0.3, 0.8, 0.55, 2.1);
  MODAR_TRY(write_text(in / "plant.obj", plant.text()));
  MODAR_TRY(write_text(in / "glass.mtl",
                       "newmtl glass\nKd 0.55 0.72 0.78\nKs 0.9 0.9 0.9\nNs 60\nd 0.35\n"
                       "newmtl ball\nKd 0.85 0.35 0.2\nKs 0.3 0.3 0.3\nNs 30\n"));
  ObjText glass("glass.mtl");
  glass.material("ball");
  std::vector<glm::dvec2> ball;
  for (int i = 0; i <= 24; ++i) {
    const double angle = kFullTurn / 2 * i / 24;
    ball.emplace_back(0.4 * std::sin(angle), 0.5 - 0.4 * std::cos(angle));
  }
  glass.lathe(ball);
  glass.material("glass");
  std::vector<glm::dvec2> bowl;
  for (int i = 0; i <= 24; ++i) {
    const double t = i / 24.0;
    bowl.emplace_back(0.9 * std::sin(kFullTurn / 4 * std::min(1.0, 0.03 + 1.3 * t)), 1.3 * t * t);
  }
  glass.lathe(bowl);
  MODAR_TRY(write_text(in / "glass.obj", glass.text()));
  return std::vector<std::string>{(in / "plant.obj").string(), (in / "glass.obj").string()};
}

}  // namespace modar
