// Triangles and normals of what the readers have read; text, files and pictures for them.
#include "bake/extensions/lab/second/second.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <span>
#include <system_error>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

namespace modar::second {
namespace {

/// Bytes of a file, which takes up to a hundred times as much memory.
constexpr std::uintmax_t kMostBytes = 64u << 20;

using glm::dvec2;
using glm::dvec3;

const dvec3& place(const Mesh& mesh, const Corner& corner) {
  return mesh.positions[static_cast<std::size_t>(corner.position)];
}

/// Twice the area, along the normal.
dvec3 area_vector(const Mesh& mesh, const Face& face) {
  dvec3 sum(0);
  const dvec3& first = place(mesh, face.corners[0]);
  for (std::size_t i = 2; i < face.corners.size(); ++i) {
    sum +=
        glm::cross(place(mesh, face.corners[i - 1]) - first, place(mesh, face.corners[i]) - first);
  }
  return sum;
}

dvec3 direction(const dvec3& v) {
  const double length = glm::length(v);
  return length > 0 && std::isfinite(length) ? v / length : dvec3(0);
}

/// Corners are off its plane by more than this part of its size. Less is not seen.
constexpr double kBent = 1e-3;

bool is_bent(const Mesh& mesh, const Face& face) {
  const dvec3 up = direction(area_vector(mesh, face));
  double off = 0;
  double size = 0;
  for (const Corner& corner : face.corners) {
    const dvec3 step = place(mesh, corner) - place(mesh, face.corners[0]);
    off = std::max(off, std::fabs(glm::dot(step, up)));
    size = std::max(size, glm::length(step));
  }
  return off > kBent * size;
}

/// Cuts off corners that contain no other one, until three are left.
template <class Add>
void triangulate(const Mesh& mesh, const Face& face, const Add& add) {
  std::vector<std::size_t> left;
  const auto again = [&](std::size_t round) {
    for (std::size_t i = round; i < face.corners.size(); ++i) {
      if (place(mesh, face.corners[i]) != place(mesh, face.corners[i - round])) return false;
    }
    return true;
  };
  do left.push_back(left.size());
  while (left.size() < 3 || !again(left.size()));  // a polygon may go around several times
  const dvec3 up = direction(area_vector(mesh, face));
  const auto at = [&](std::size_t i) { return place(mesh, face.corners[left[i % left.size()]]); };
  const auto side = [&](const dvec3& a, const dvec3& b, const dvec3& c) {
    return glm::dot(glm::cross(b - a, c - a), up);
  };
  while (left.size() > 3) {
    std::size_t ear = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const dvec3 a = at(i), b = at(i + 1), c = at(i + 2);
      bool free = side(a, b, c) > 0;
      for (std::size_t k = 3; free && k < left.size(); ++k) {
        const dvec3 p = at(i + k);
        free = side(a, b, p) <= 0 || side(b, c, p) <= 0 || side(c, a, p) <= 0;
      }
      if (!free) continue;
      ear = i;
      break;
    }
    const auto number = [&](std::size_t i) { return left[(ear + i) % left.size()]; };
    add(number(0), number(1), number(2));
    left.erase(left.begin() + static_cast<std::ptrdiff_t>((ear + 1) % left.size()));
  }
  add(left[0], left[1], left[2]);
}

/// A face's part in the normals of a position.
struct Share {
  const Face* face;
  dvec3 normal;
  double weight;
};

class Finisher {
 public:
  Finisher(const Mesh& mesh, double crease)
      : mesh_(mesh), least_cosine_(std::cos(glm::radians(crease))), shares_(mesh.positions.size()) {
    for (const Face& face : mesh.faces) {
      const dvec3 area = area_vector(mesh, face);
      const std::size_t count = face.corners.size();
      for (std::size_t i = 0; i < count; ++i) {
        const dvec3& at = place(mesh, face.corners[i]);
        const dvec3 next = direction(place(mesh, face.corners[(i + 1) % count]) - at);
        const dvec3 last = direction(place(mesh, face.corners[(i + count - 1) % count]) - at);
        const double angle = std::acos(std::clamp(glm::dot(next, last), -1.0, 1.0));
        shares_[static_cast<std::size_t>(face.corners[i].position)].push_back(
            {&face, direction(area), glm::length(area) * angle});
      }
    }
  }

  SecondModel run() {
    SecondModel model;
    model.knows_colours = mesh_.knows_colours;
    model.materials = mesh_.materials;
    for (const Face& face : mesh_.faces) {
      const dvec3 normal = direction(area_vector(mesh_, face));
      const std::size_t first = model.triangles.size();
      triangulate(mesh_, face, [&](std::size_t a, std::size_t b, std::size_t c) {
        std::array<SecondCorner, 3> triangle = {corner(face, a, normal), corner(face, b, normal),
                                                corner(face, c, normal)};
        const dvec3 area = glm::cross(triangle[1].position - triangle[0].position,
                                      triangle[2].position - triangle[0].position);
        const double edge = glm::distance(triangle[0].position, triangle[1].position) +
                            glm::distance(triangle[1].position, triangle[2].position);
        if (!(glm::length(area) > 1e-12 * edge * edge) || !std::isfinite(edge)) return;
        model.triangles.push_back(triangle);
        model.triangle_material.push_back(face.material);
      });
      const std::size_t count = face.corners.size();
      if (model.triangles.size() - first != count - 2 || count < 4 || !is_bent(mesh_, face))
        continue;
      model.polygons.push_back({static_cast<std::uint32_t>(first),
                                static_cast<std::uint32_t>(model.polygon_corners.size()),
                                static_cast<std::uint32_t>(count)});
      for (std::size_t i = 0; i < count; ++i)
        model.polygon_corners.push_back(corner(face, i, normal));
    }
    return model;
  }

 private:
  [[nodiscard]] SecondCorner corner(const Face& face, std::size_t index, const dvec3& flat) const {
    const Corner& from = face.corners[index];
    const auto position = static_cast<std::size_t>(from.position);
    SecondCorner to;
    to.position = mesh_.positions[position];
    to.colour = mesh_.colours.empty() ? face.colour : mesh_.colours[position];
    if (from.uv >= 0) {
      const dvec2& uv = mesh_.uvs[static_cast<std::size_t>(from.uv)];
      to.uv = {uv.x, 1 - uv.y};
    }
    if (from.normal >= 0)
      to.normal = direction(mesh_.normals[static_cast<std::size_t>(from.normal)]);
    if (to.normal != dvec3(0)) return to;
    const std::set<const Face*> sheet = sheet_of(face, shares_[position], from.position);
    for (const Share& share : shares_[position]) {
      const bool joined =
          face.smoothing < 0 ? glm::dot(share.normal, flat) >= least_cosine_ : face.smoothing > 0;
      if (joined && sheet.contains(share.face)) to.normal += share.weight * share.normal;
    }
    to.normal = direction(to.normal);
    if (to.normal == dvec3(0)) to.normal = flat;
    return to;
  }

  /// The same face, wound the other way.
  static bool twins(const Face& a, const Face& b) {
    std::vector<int> first, second;
    for (const Corner& corner : a.corners) first.push_back(corner.position);
    for (const Corner& corner : b.corners) second.insert(second.begin(), corner.position);
    const auto start = std::ranges::find(second, first[0]);
    std::rotate(second.begin(), start, second.end());
    return first == second;
  }

  /// Next to each other around a position, wound alike.
  static bool continues(const Face& a, const Face& b, int at) {
    const auto next = [at](const Face& face, std::size_t step) {
      const std::size_t count = face.corners.size();
      std::size_t i = 0;
      while (face.corners[i].position != at) ++i;
      return face.corners[(i + step) % count].position;
    };
    return next(a, 1) == next(b, b.corners.size() - 1) ||
           next(a, a.corners.size() - 1) == next(b, 1);
  }

  /// Faces of its group around a position: where sheets are written in both windings, of its own.
  static std::set<const Face*> sheet_of(const Face& face, const std::vector<Share>& shares,
                                        int at) {
    std::set<const Face*> group;
    bool doubled = false;
    for (const Share& share : shares) {
      if (share.face->smoothing != face.smoothing) continue;
      group.insert(share.face);
      doubled = doubled || twins(face, *share.face);
    }
    if (!doubled) return group;
    std::set<const Face*> sheet;
    for (std::vector<const Face*> left = {&face}; !left.empty();) {
      const Face& last = *left.back();
      left.pop_back();
      if (!sheet.insert(&last).second) continue;
      for (const Face* other : group) {
        if (continues(last, *other, at) && !twins(last, *other)) left.push_back(other);
      }
    }
    return sheet;
  }

  const Mesh& mesh_;
  double least_cosine_;
  std::vector<std::vector<Share>> shares_;
};

}  // namespace

std::optional<SecondModel> read(const std::string& path, double crease) {
  std::error_code error;
  if (!(std::filesystem::file_size(path, error) <= kMostBytes)) return std::nullopt;
  std::string ending = std::filesystem::path(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  std::optional<Mesh> mesh;
  if (ending == ".obj") mesh = read_obj(path);
  if (ending == ".ply") mesh = read_ply(path);
  if (ending == ".stl") mesh = read_stl(path);
  if (ending == ".gltf" || ending == ".glb") mesh = read_gltf(path);
  if (!mesh) return std::nullopt;
  const auto inside = [](int index, const auto& list) {
    return index < static_cast<int>(list.size());
  };
  std::erase_if(mesh->faces, [&](const Face& face) {
    return face.corners.size() < 3 || !std::ranges::all_of(face.corners, [&](const Corner& c) {
             return c.position >= 0 && inside(c.position, mesh->positions) &&
                    inside(c.uv, mesh->uvs) && inside(c.normal, mesh->normals);
           });
  });
  SecondModel model = Finisher(*mesh, crease).run();
  if (model.triangles.empty()) return std::nullopt;
  return model;
}

std::string file_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> words_of(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = line.find_first_not_of(kBlanks, at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.emplace_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

bool take_line(std::string_view& text, std::string& line) {
  if (text.empty()) return false;
  for (line.clear(); !text.empty(); line.back() = ' ') {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    line += text.substr(0, end);
    text.remove_prefix(end);
    text.remove_prefix(text.starts_with("\r\n") ? 2 : std::min<std::size_t>(text.size(), 1));
    if (!line.ends_with('\\') || line.starts_with('#')) break;
  }
  return true;
}

std::string named_file(const std::string& from, std::string name) {
  namespace fs = std::filesystem;
  std::ranges::replace(name, '\\', '/');
  const fs::path folder = fs::path(from).parent_path();
  const fs::path plain = fs::path(name).filename();
  std::error_code error;
  for (const fs::path& path : {folder / name, folder / plain, folder / "textures" / plain,
                               folder / ".." / "textures" / plain}) {
    if (!plain.empty() && fs::is_regular_file(path, error)) return path.string();
  }
  return {};
}

bool decode_picture(std::string_view bytes, RgbaImage& picture, Colours colours) {
  if (bytes.empty()) return false;
  Result<RgbaImage> decoded = decode_image(std::as_bytes(std::span(bytes)), "picture", colours);
  if (decoded) picture = std::move(*decoded);
  return decoded.has_value();
}

}  // namespace modar::second
