// Models of a structure that a few bytes name: what scans and exporters rarely write, and what
// makes stages slow or leaves them nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace modar::test {

/// Polygons over corners that have a position, and a uv or kNone each.
struct MadeModel {
  struct Corner {
    std::uint32_t position = 0;
    std::uint32_t uv = 0;
  };
  struct Face {
    std::vector<Corner> corners;
    std::uint32_t material = 0;
  };
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec2> uvs;
  std::vector<Face> faces;
};

/// The structures, and how corners share their uvs.
enum class Structure : std::uint8_t {
  kSame,       // one triangle again and again
  kCopies,     // the same with corners of their own
  kBothSides,  // each triangle turned over as well
  kFan,        // around one vertex, open
  kCone,       // around two, closed
  kBook,       // around one edge
  kSlivers,    // long and hardly wide
  kLine,       // without area
  kIslands,    // that share nothing
  kGrid,
  kRough,
  kBoxes,    // small closed pieces at one place
  kPolygon,  // one face of many corners
  kSoup,     // any three of few vertices
  kStrip,    // of a grid, two rows
  kStacked,  // sheets so close that they are one as stored
  kCount
};
enum class Seams : std::uint8_t { kNone, kSmooth, kEverywhere, kOnePoint, kCount };

/// A part of a model: about `triangles` of a structure.
struct Part {
  Structure structure = Structure::kSame;
  Seams seams = Seams::kNone;
  std::uint32_t triangles = 100;
  std::uint32_t materials = 1;
  double scale = 1;
  double away = 0;
};

class ModelMaker {
 public:
  MadeModel model;

  void add(const Part& part) {
    part_ = part;
    random_.seed(part.triangles);
    switch (const std::uint32_t n = part.triangles; part.structure) {
      case Structure::kSame:
      case Structure::kBothSides: {
        const auto v = vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        for (std::uint32_t i = 0; i < n; ++i) {
          const bool turned = part.structure == Structure::kBothSides && i % 2 == 1;
          turned ? face({v, v + 2, v + 1}) : face({v, v + 1, v + 2});
        }
        break;
      }
      case Structure::kCopies:
      case Structure::kIslands:
      case Structure::kSlivers:
      case Structure::kLine:
        for (std::uint32_t i = 0; i < n; ++i) piece(i);
        break;
      case Structure::kFan:
      case Structure::kCone:
      case Structure::kBook:
        wheel(n);
        break;
      case Structure::kBoxes:
        for (std::uint32_t i = 0; i < n; i += 4) {
          const auto v = vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
          for (const auto& t : {std::array{0u, 2u, 1u}, {0u, 1u, 3u}, {1u, 2u, 3u}, {0u, 3u, 2u}}) {
            face({v + t[0], v + t[1], v + t[2]});
          }
        }
        break;
      case Structure::kPolygon: {
        std::vector<std::uint32_t> corners;
        for (std::uint32_t i = 0; i < n + 2; ++i) {
          const double r = i % 2 == 0 ? 1 : 0.9;
          corners.push_back(vertex(round(i, n + 2, r)));
        }
        face(corners);
        break;
      }
      case Structure::kSoup: {
        const auto count = static_cast<std::uint32_t>(std::sqrt(n)) + 3;
        const auto v = static_cast<std::uint32_t>(model.positions.size());
        for (std::uint32_t i = 0; i < count; ++i) vertex({unit(), unit(), unit()});
        for (std::uint32_t i = 0; i < n; ++i)
          face({v + draw(count), v + draw(count), v + draw(count)});
        break;
      }
      default:
        grid(part.structure == Structure::kStrip
                 ? 2
                 : static_cast<std::uint32_t>(std::sqrt(n / 2)) + 1);
    }
  }

 private:
  double unit() { return static_cast<double>(random_()) / 4294967296.0; }
  std::uint32_t draw(std::uint32_t below) { return static_cast<std::uint32_t>(random_() % below); }
  static glm::dvec3 round(std::uint32_t i, std::uint32_t n, double radius, double z = 0) {
    const double angle = 6.283185307179586 * i / n;
    return {radius * std::cos(angle), radius * std::sin(angle), z};
  }
  std::uint32_t vertex(const glm::dvec3& p) {
    model.positions.push_back((p + part_.away) * part_.scale);
    if (part_.seams == Seams::kSmooth) model.uvs.emplace_back(p.x, p.y);
    return static_cast<std::uint32_t>(model.positions.size() - 1);
  }
  std::uint32_t vertices(const std::vector<glm::dvec3>& all) {
    const auto first = static_cast<std::uint32_t>(model.positions.size());
    for (const glm::dvec3& p : all) vertex(p);
    return first;
  }
  void face(const std::vector<std::uint32_t>& corners) {
    MadeModel::Face& made = model.faces.emplace_back();
    made.material = static_cast<std::uint32_t>(model.faces.size() % part_.materials);
    for (const std::uint32_t v : corners) {
      std::uint32_t uv = v;
      if (part_.seams == Seams::kEverywhere) model.uvs.emplace_back(unit(), unit());
      if (part_.seams == Seams::kOnePoint && model.uvs.empty()) model.uvs.emplace_back(0.5, 0.5);
      if (part_.seams != Seams::kSmooth) uv = static_cast<std::uint32_t>(model.uvs.size()) - 1;
      made.corners.push_back({v, part_.seams == Seams::kNone ? ~0u : uv});
    }
  }
  void piece(std::uint32_t i) {
    const double x = static_cast<double>(i);
    std::uint32_t v = 0;
    if (part_.structure == Structure::kCopies) v = vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    if (part_.structure == Structure::kLine)
      v = vertices({{x, 0, 0}, {x + 1, 0, 0}, {x + 2, 0, 0}});
    if (part_.structure == Structure::kSlivers) {
      v = vertices({{0, x, 0}, {1e6, x, 0}, {unit() * 1e6, x + 1e-9, 0}});
    }
    if (part_.structure == Structure::kIslands) {
      const glm::dvec3 at{100 * unit(), 100 * unit(), 100 * unit()};
      v = vertices({at, at + glm::dvec3(1, unit(), 0), at + glm::dvec3(0, 1, unit())});
    }
    face({v, v + 1, v + 2});
  }
  /// A fan, its closed form with a second hub, or pages around the edge between two hubs.
  void wheel(std::uint32_t n) {
    const std::uint32_t hub = vertices({{0, 0, 1}, {0, 0, -1}});
    const bool cone = part_.structure == Structure::kCone;
    const std::uint32_t rim = cone ? std::max(3u, n / 2) : n;
    for (std::uint32_t i = 0; i <= rim; ++i) vertex(round(i, rim, 1));
    for (std::uint32_t i = 0; i < rim; ++i) {
      const std::uint32_t a = hub + 2 + i;
      const std::uint32_t b = cone && i + 1 == rim ? hub + 2 : a + 1;
      if (part_.structure == Structure::kBook) {
        face({hub, hub + 1, a});
        continue;
      }
      face({hub, a, b});
      if (cone) face({hub + 1, b, a});
    }
  }
  void grid(std::uint32_t rows) {
    const std::uint32_t columns = part_.triangles / (2 * rows) + 1;
    const bool stacked = part_.structure == Structure::kStacked;
    const auto first = static_cast<std::uint32_t>(model.positions.size());
    for (std::uint32_t y = 0; y <= rows; ++y) {
      for (std::uint32_t x = 0; x <= columns; ++x) {
        const double z = part_.structure == Structure::kRough ? unit() : stacked ? 1e-7 * y : 0;
        vertex({x, stacked ? y % 2 : y, z});
      }
    }
    for (std::uint32_t y = 0; y < rows; ++y) {
      for (std::uint32_t x = 0; x < columns; ++x) {
        const std::uint32_t v = first + y * (columns + 1) + x;
        face({v, v + 1, v + columns + 2});
        face({v, v + columns + 2, v + columns + 1});
      }
    }
  }

  Part part_;
  std::mt19937 random_;
};

/// Every third material has a picture, which the OBJ text names.
inline std::string mtl_of(std::uint32_t materials) {
  std::string text;
  for (std::uint32_t m = 0; m < materials; ++m) {
    text += "newmtl m" + std::to_string(m) + "\nKd 0.5 0.5 0.5\n";
    if (m % 3 == 0) text += "map_Kd picture.bmp\n";
  }
  return text;
}

/// 8 by 8 pixels, no two alike.
inline std::string bmp() {
  std::string bytes = {'B', 'M', '\xF6', 0, 0, 0, 0, 0, 0, 0, 54, 0, 0, 0, 40, 0, 0, 0,
                       8,   0,   0,      0, 8, 0, 0, 0, 1, 0, 24, 0, 0, 0, 0,  0, 0, 0};
  bytes.resize(54, 0);
  for (int i = 0; i < 192; ++i) bytes += static_cast<char>(i * 97);
  return bytes;
}

inline std::string obj_of(const MadeModel& model) {
  std::string text = "mtllib made.mtl\n";
  char line[128];
  for (const glm::dvec3& p : model.positions) {
    std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", p.x, p.y, p.z);
    text += line;
  }
  for (const glm::dvec2& uv : model.uvs) {
    std::snprintf(line, sizeof line, "vt %.9g %.9g\n", uv.x, uv.y);
    text += line;
  }
  std::uint32_t material = ~0u;
  for (const MadeModel::Face& face : model.faces) {
    if (face.material != material)
      text += "usemtl m" + std::to_string(material = face.material) + "\n";
    text += "f";
    for (const auto& [position, uv] : face.corners) {
      text += " " + std::to_string(position + 1);
      if (uv != ~0u) text += "/" + std::to_string(uv + 1);
    }
    text += "\n";
  }
  return text;
}

inline std::string ply_of(const MadeModel& model) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex " + std::to_string(model.positions.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
      std::to_string(model.faces.size()) + "\nproperty list uint int vertex_indices\nend_header\n";
  char line[128];
  for (const glm::dvec3& p : model.positions) {
    std::snprintf(line, sizeof line, "%.17g %.17g %.17g\n", p.x, p.y, p.z);
    text += line;
  }
  for (const MadeModel::Face& face : model.faces) {
    text += std::to_string(face.corners.size());
    for (const auto& corner : face.corners) text += " " + std::to_string(corner.position);
    text += "\n";
  }
  return text;
}

inline std::string floats(std::span<const glm::dvec3> all) {
  std::string bytes;
  for (const glm::dvec3& p : all) {
    const std::array<float, 3> values = {static_cast<float>(p.x), static_cast<float>(p.y),
                                         static_cast<float>(p.z)};
    bytes.append(reinterpret_cast<const char*>(values.data()), sizeof values);
  }
  return bytes;
}

inline std::string words(std::uint32_t value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

/// The first three corners of each face.
inline std::string stl_of(const MadeModel& model) {
  std::string bytes(80, ' ');
  bytes += words(static_cast<std::uint32_t>(model.faces.size()));
  for (const MadeModel::Face& face : model.faces) {
    bytes.append(12, 0);
    for (std::size_t k = 0; k < 3; ++k) {
      bytes += floats({&model.positions[face.corners[k].position], 1});
    }
    bytes.append(2, 0);
  }
  return bytes;
}

/// A GLB whose mesh `instances` nodes show, `apart` from each other.
inline std::string glb_of(const MadeModel& model, std::uint32_t instances, double apart) {
  std::string indices;
  for (const MadeModel::Face& face : model.faces) {
    for (std::size_t k = 0; k < 3; ++k) indices += words(face.corners[k].position);
  }
  const std::string bin = floats(model.positions) + indices;
  const auto number = [](std::size_t value) { return std::to_string(value); };
  const std::string at = number(12 * model.positions.size());
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"buffers":[{"byteLength":)" + number(bin.size()) +
      R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + at + R"(},{"buffer":0,"byteOffset":)" +
      at + R"(,"byteLength":)" + number(indices.size()) +
      R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
      number(model.positions.size()) +
      R"(},{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" +
      number(indices.size() / 4) +
      R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)";
  std::string nodes;
  std::string roots;
  for (std::uint32_t i = 0; i < instances; ++i) {
    const std::string comma = i == 0 ? "" : ",";
    nodes += comma + R"({"mesh":0,"translation":[)" + std::to_string(apart * i) + ",0,0]}";
    roots += comma + std::to_string(i);
  }
  json += R"("nodes":[)" + nodes + R"(],"scenes":[{"nodes":[)" + roots + "]}]}";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto size = [](const std::string& text) {
    return words(static_cast<std::uint32_t>(text.size()));
  };
  const std::string body = size(json) + "JSON" + json + size(bin) + std::string("BIN\0", 4) + bin;
  return "glTF" + words(2) + words(static_cast<std::uint32_t>(body.size()) + 12) + body;
}

}  // namespace modar::test
