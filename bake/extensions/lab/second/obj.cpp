// OBJ and MTL.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

#include "bake/extensions/lab/second/second.hpp"

namespace modar::second {
namespace {

double number(const std::vector<std::string>& words, std::size_t i, double otherwise = 0) {
  return i < words.size() ? std::strtod(words[i].c_str(), nullptr) : otherwise;
}

bool is_number(const std::string& word) {
  char* end = nullptr;
  std::strtod(word.c_str(), &end);
  return !word.empty() && *end == '\0';
}

/// A material, and where its picture is on the uvs.
struct Material {
  SecondMaterial look;
  bool known = true;
  glm::dvec2 scale{1};
  glm::dvec2 offset{0};
};

/// "-s 2 2 1 a picture.png" and the like.
void take_map(const std::string& from, const std::vector<std::string>& words, Material& material) {
  std::size_t i = 1;
  while (i < words.size() && words[i].starts_with('-')) {
    const std::string& option = words[i++];
    if (option == "-s" || option == "-o") {
      (option == "-s" ? material.scale : material.offset) = {number(words, i),
                                                             number(words, i + 1)};
    }
    const bool word = option != "-s" && option != "-o" && option != "-t" && option != "-mm";
    while (i < words.size() && is_number(words[i])) ++i;
    if (word && !is_number(words[i - 1])) ++i;
  }
  std::string name;
  for (; i < words.size(); ++i) name += (name.empty() ? "" : " ") + words[i];
  material.known = decode_picture(file_bytes(named_file(from, name)), material.look.picture);
}

/// In the order of the file. Maps of other kinds than of the colour make a material unknown where
/// it has no such map.
std::vector<std::pair<std::string, Material>> read_mtl(const std::string& path) {
  std::vector<std::pair<std::string, Material>> materials;
  std::set<std::string> maps;
  const std::string bytes = file_bytes(path);
  std::string_view text = bytes;
  for (std::string line; take_line(text, line);) {
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    if (words[0] == "newmtl") {
      materials.push_back({line.substr(line.find("newmtl") + 6), {}});
      maps.clear();
    }
    if (materials.empty()) continue;
    Material& material = materials.back().second;
    SecondMaterial& look = material.look;
    const auto colour = [&] {
      return words.size() < 4 ? glm::dvec3(number(words, 1))
                              : glm::dvec3(number(words, 1), number(words, 2), number(words, 3));
    };
    if (words[0] == "Kd" && words.size() > 1 && is_number(words[1]))
      look.colour = {colour(), look.colour.a};
    if (words[0] == "Ke") look.emission = colour();
    if (words[0] == "d" && number(words, 1) > 0) look.colour.a = number(words, 1);
    if (words[0] == "Tr" && look.colour.a == 1 && number(words, 1) < 1)
      look.colour.a = 1 - number(words, 1);
    if (words[0] == "map_Kd") take_map(path, words, material);
    if (words[0] == "map_Kd" || words[0] == "map_d") maps.insert(words.back());
    if (maps.size() > 1) material.known = false;  // opacity of its own
    if (words[0].starts_with("map_K") && look.picture.pixels.empty()) material.known = false;
  }
  for (auto& [name, material] : materials) {
    glm::dvec4& kd = material.look.colour;
    const double range = std::max({kd.r, kd.g, kd.b}) - std::min({kd.r, kd.g, kd.b});
    // Exporters write a gray next to pictures that they do not multiply.
    if (!material.look.picture.pixels.empty() && range <= 0.01) kd = {1, 1, 1, kd.a};
  }
  return materials;
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
}

class ObjReader {
 public:
  explicit ObjReader(const std::string& path) : path_(path) {}

  std::optional<Mesh> run() {
    const std::string bytes = file_bytes(path_);
    std::string_view text = bytes;
    for (std::string line; take_line(text, line);) {
      const std::vector<std::string> words = words_of(line);
      if (!words.empty() && !take(words, line)) return std::nullopt;
    }
    resolve();
    return std::move(mesh_);
  }

 private:
  bool take(const std::vector<std::string>& words, const std::string& line) {
    const std::string& key = words[0];
    const auto three = [&](std::size_t i) {
      return glm::dvec3(number(words, i), number(words, i + 1), number(words, i + 2));
    };
    if (key == "v" || key == "vt" || key == "vn") {
      if (!std::all_of(words.begin() + 1, words.end(), is_number)) return false;
      if (key == "v") mesh_.positions.push_back(three(1));
      if (key == "v" && words.size() >= 7) mesh_.colours.push_back(three(4));
      if (key == "vt") mesh_.uvs.push_back({number(words, 1), number(words, 2)});
      if (key == "vn") mesh_.normals.push_back(three(1));
    } else if (key == "#MRGB" && words.size() > 1) {
      for (std::size_t i = 0; i + 8 <= words[1].size(); i += 8) {
        const auto rgb = std::strtoul(words[1].substr(i, 8).c_str(), nullptr, 16);
        mesh_.colours.emplace_back(rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255);
        mesh_.colours.back() /= 255.0;
      }
    } else if (key == "f") {
      return add_face(words);
    } else if (key == "s") {
      smoothing_ = words.size() > 1 && is_number(words[1]) ? static_cast<int>(number(words, 1)) : 0;
    } else if (key == "usemtl" || key == "mtllib") {
      const std::string name = trimmed(line.substr(line.find(key) + 6));
      if (key == "mtllib") libraries_.push_back(name);
      if (key == "usemtl")
        material_ = numbers_.try_emplace(name, numbers_.size() + 1).first->second;
    }
    return true;
  }

  bool add_face(const std::vector<std::string>& words) {
    Face face;
    face.smoothing = smoothing_;
    face.material = static_cast<std::uint32_t>(material_);
    const auto index = [](const char*& text, std::size_t count) {
      char* end = nullptr;
      const long value = std::strtol(text, &end, 10);
      text = end;
      const long from_zero = value < 0 ? static_cast<long>(count) + value : value - 1;
      return value == 0 || from_zero < 0 ? -1 : static_cast<int>(from_zero);
    };
    for (std::size_t i = 1; i < words.size(); ++i) {
      const char* text = words[i].c_str();
      Corner& corner = face.corners.emplace_back();
      corner.position = index(text, mesh_.positions.size());
      if (*text == '/') corner.uv = index(++text, mesh_.uvs.size());
      if (*text == '/') corner.normal = index(++text, mesh_.normals.size());
      if (*text != '\0') return false;
    }
    mesh_.faces.push_back(std::move(face));
    return true;
  }

  void resolve() {
    std::vector<std::pair<std::string, Material>> defined;
    for (const std::string& library : libraries_) {
      for (auto& material : read_mtl(named_file(path_, library))) {
        material.first = trimmed(material.first);
        defined.push_back(std::move(material));
      }
    }
    if (mesh_.colours.size() != mesh_.positions.size()) mesh_.colours.clear();
    double most = 0;
    for (const glm::dvec3& c : mesh_.colours) most = std::max({most, c.r, c.g, c.b});
    for (glm::dvec3& c : mesh_.colours) c /= most > 1 ? 255 : 1;
    std::vector<Material> used(numbers_.size() + 1);
    // Some programs name the picture as the model.
    used[0].known = mesh_.uvs.empty() || !mesh_.colours.empty() || !numbers_.empty();
    if (numbers_.empty() && !defined.empty()) used[0] = defined[0].second;
    if (!mesh_.colours.empty() && used[0].look.picture.pixels.empty())
      used[0].look.colour = glm::dvec4(1);
    for (const auto& [name, number] : numbers_) {
      const auto same = [&wanted = name](const auto& entry) { return entry.first == wanted; };
      const auto found = std::ranges::find_if(defined, same);
      used[number].known = found != defined.end();
      if (found != defined.end()) used[number] = found->second;
    }
    for (Face& face : mesh_.faces) {
      const Material& material = used[face.material];
      mesh_.knows_colours = mesh_.knows_colours && material.known;
      for (Corner& corner : face.corners) {
        if (corner.uv >= static_cast<int>(mesh_.uvs.size())) corner.uv = -1;
        if (corner.normal >= static_cast<int>(mesh_.normals.size())) corner.normal = -1;
        if (corner.uv < 0 ||
            (material.scale == glm::dvec2(1) && material.offset == glm::dvec2(0))) {
          continue;
        }
        const glm::dvec2 uv = mesh_.uvs[static_cast<std::size_t>(corner.uv)];
        corner.uv = static_cast<int>(mesh_.uvs.size());
        mesh_.uvs.push_back(uv * material.scale + material.offset);
      }
    }
    for (Material& material : used) mesh_.materials.push_back(std::move(material.look));
  }

  const std::string& path_;
  Mesh mesh_;
  std::vector<std::string> libraries_;
  std::map<std::string, std::size_t> numbers_;  // of the materials in use, by name, from 1 on
  std::size_t material_ = 0;
  int smoothing_ = -1;
};

}  // namespace

std::optional<Mesh> read_obj(const std::string& path) {
  return ObjReader(path).run();
}

}  // namespace modar::second
