// PLY and STL.
#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <map>
#include <utility>

#include "bake/extensions/lab/second/second.hpp"

namespace modar::second {
namespace {

struct Property {
  std::string type;
  std::string name;
  std::string count_type;  ///< of lists
};

/// Numbers in the order of the file.
class Values {
 public:
  std::string_view rest;
  bool text = false;
  bool big = false;
  bool good = true;

  double take(const std::string& type) {
    if (text) {
      const std::size_t start = std::min(rest.find_first_not_of(" \t\r\n"), rest.size());
      const std::size_t end = std::min(rest.find_first_of(" \t\r\n", start), rest.size());
      good = good && start < end;
      const std::string word(rest.substr(start, end - start));
      rest.remove_prefix(end);
      return std::strtod(word.c_str(), nullptr);
    }
    if (type == "char" || type == "int8") return raw<std::int8_t>();
    if (type == "uchar" || type == "uint8") return raw<std::uint8_t>();
    if (type == "short" || type == "int16") return raw<std::int16_t>();
    if (type == "ushort" || type == "uint16") return raw<std::uint16_t>();
    if (type == "int" || type == "int32") return raw<std::int32_t>();
    if (type == "uint" || type == "uint32") return raw<std::uint32_t>();
    if (type == "float" || type == "float32") return static_cast<double>(raw<float>());
    return raw<double>();
  }

 private:
  template <class T>
  T raw() {
    std::array<char, sizeof(T)> bytes{};
    good = good && rest.size() >= sizeof(T);
    if (!good) return T();
    std::memcpy(bytes.data(), rest.data(), sizeof(T));
    if (big) std::ranges::reverse(bytes);
    rest.remove_prefix(sizeof(T));
    return std::bit_cast<T>(bytes);
  }
};

/// The values of one element by the names of its properties; lists apart.
struct Element {
  std::map<std::string, double> one;
  std::map<std::string, std::vector<double>> lists;

  [[nodiscard]] double get(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      if (const auto found = one.find(name); found != one.end()) return found->second;
    }
    return 0;
  }
  [[nodiscard]] bool has(const char* name) const { return one.contains(name); }
};

class PlyReader {
 public:
  std::optional<Mesh> run(const std::string& path, std::string_view bytes) {
    values_.rest = bytes;
    std::vector<std::pair<std::string, double>> elements;
    std::vector<std::vector<Property>> properties;
    for (std::string line; take_line(values_.rest, line) && line != "end_header";) {
      std::vector<std::string> words = words_of(line);
      if (words.size() < 2) continue;
      if (words[0] == "format") values_.text = words[1] == "ascii";
      if (words[0] == "format") values_.big = words[1] == "binary_big_endian";
      if (words[0] == "comment" && words[1] == "TextureFile" && words.size() > 2) {
        SecondMaterial& material = mesh_.materials.emplace_back();
        material.colour = glm::dvec4(1);
        const std::string file = named_file(path, line.substr(line.find(words[2])));
        mesh_.knows_colours &= decode_picture(file_bytes(file), material.picture);
      }
      if (words[0] == "element" && words.size() > 2) {
        elements.push_back({words[1], std::strtod(words[2].c_str(), nullptr)});
        properties.emplace_back();
      }
      if (words[0] != "property" || properties.empty()) continue;
      const bool list = words[1] == "list" && words.size() > 4;
      properties.back().push_back({words[list ? 3 : 1], words.back(), list ? words[2] : ""});
    }
    const bool pictured = !mesh_.materials.empty();
    if (!pictured) mesh_.materials.emplace_back();
    for (std::size_t e = 0; e < elements.size(); ++e) {
      for (double i = 0; i < elements[e].second && values_.good; ++i) {
        take(elements[e].first, parse(properties[e]));
      }
    }
    if (!values_.good || mesh_.faces.empty()) return std::nullopt;
    if (coloured_) mesh_.materials[0].colour = glm::dvec4(1);
    mesh_.knows_colours &= pictured || coloured_ || mesh_.uvs.empty();
    return std::move(mesh_);
  }

 private:
  Element parse(const std::vector<Property>& properties) {
    Element element;
    std::string line;
    if (values_.text && !properties.empty()) {  // an element a line
      do line.clear();
      while (take_line(values_.rest, line) && words_of(line).empty());
      std::swap(rest_, values_.rest);
      values_.rest = line;
    }
    for (const Property& property : properties) {
      if (property.count_type.empty()) {
        const double value = values_.take(property.type);
        const bool colour = property.name.find("red") != std::string::npos ||
                            property.name.find("green") != std::string::npos ||
                            property.name.find("blue") != std::string::npos;
        const bool byte = property.type == "uchar" || property.type == "uint8";
        element.one[property.name] = colour && byte ? value / 255 : value;
        mesh_.knows_colours &= !colour || byte;
        continue;
      }
      const double count = values_.take(property.count_type);
      std::vector<double>& list = element.lists[property.name];
      for (double i = 0; i < count && values_.good; ++i)
        list.push_back(values_.take(property.type));
    }
    if (values_.text && !properties.empty()) {
      if (!words_of(values_.rest).empty())
        mesh_.knows_colours = false;  // more than the header says
      std::swap(rest_, values_.rest);
    }
    return element;
  }

  void take(const std::string& name, const Element& element) {
    if (name == "vertex") {
      mesh_.positions.push_back({element.get({"x"}), element.get({"y"}), element.get({"z"})});
      if (element.has("nx")) {
        mesh_.normals.push_back({element.get({"nx"}), element.get({"ny"}), element.get({"nz"})});
      }
      if (element.has("u") || element.has("s") || element.has("texture_u")) {
        mesh_.uvs.push_back(
            {element.get({"u", "s", "texture_u"}), element.get({"v", "t", "texture_v"})});
      }
      if (element.has("red") || element.has("diffuse_red")) {
        mesh_.colours.push_back(colour_of(element));
      }
    } else if (name == "face") {
      take_face(element);
    } else if (name == "tristrips") {
      values_.good = false;
    }
  }

  glm::dvec3 colour_of(const Element& element) {
    coloured_ = true;
    return {element.get({"red", "diffuse_red"}), element.get({"green", "diffuse_green"}),
            element.get({"blue", "diffuse_blue"})};
  }

  void take_face(const Element& element) {
    Face face;
    if (element.has("red")) face.colour = colour_of(element);
    mesh_.knows_colours &= !element.has("red") || mesh_.colours.empty();
    mesh_.knows_colours &= element.get({"texnumber"}) >= 0;
    const double last = static_cast<double>(mesh_.materials.size() - 1);
    face.material = static_cast<std::uint32_t>(std::clamp(element.get({"texnumber"}), 0.0, last));
    const auto uvs = element.lists.find("texcoord");
    for (const auto& [name, list] : element.lists) {
      if (!name.starts_with("vertex_ind")) continue;
      for (std::size_t i = 0; i < list.size(); ++i) {
        Corner corner;
        corner.position = static_cast<int>(list[i]);
        if (!mesh_.normals.empty()) corner.normal = corner.position;
        if (uvs != element.lists.end() && uvs->second.size() == 2 * list.size()) {
          corner.uv = static_cast<int>(mesh_.uvs.size());
          mesh_.uvs.push_back({uvs->second[2 * i], uvs->second[2 * i + 1]});
        } else if (mesh_.uvs.size() == mesh_.positions.size()) {
          corner.uv = corner.position;
        }
        face.corners.push_back(corner);
      }
    }
    mesh_.faces.push_back(std::move(face));
  }

  Values values_;
  std::string_view rest_;
  Mesh mesh_;
  bool coloured_ = false;
};

}  // namespace

std::optional<Mesh> read_ply(const std::string& path) {
  const std::string bytes = file_bytes(path);
  return PlyReader().run(path, bytes);
}

std::optional<Mesh> read_stl(const std::string& path) {
  Mesh mesh;
  mesh.materials.emplace_back();
  std::map<std::array<float, 3>, int> known;
  std::vector<Corner> corners;
  const auto add = [&](const std::array<float, 3>& at) {
    const auto [found, added] = known.try_emplace(at, static_cast<int>(mesh.positions.size()));
    if (added) mesh.positions.push_back({at[0], at[1], at[2]});
    Corner& corner = corners.emplace_back();
    corner.position = found->second;
    if (corners.size() == 3)
      mesh.faces.push_back({std::exchange(corners, {}), 0, -1, glm::dvec3(1)});
  };
  const std::string bytes = file_bytes(path);
  std::uint32_t count = 0;
  if (bytes.size() >= 84) std::memcpy(&count, bytes.data() + 80, sizeof count);
  if (bytes.size() >= 84 + std::size_t{50} * count && count > 0) {
    mesh.knows_colours = bytes.substr(0, 80).find("COLOR=") == std::string::npos;
    for (std::size_t facet = 84; count-- > 0; facet += 50) {
      std::array<float, 3> at{};
      for (std::size_t i = 1; i <= 3; ++i) {
        std::memcpy(at.data(), bytes.data() + facet + 12 * i, sizeof at);
        add(at);
      }
      mesh.knows_colours &= bytes[facet + 49] >= 0;
    }
    return mesh;
  }
  std::string_view text = bytes;
  for (std::string line; take_line(text, line);) {
    const std::vector<std::string> words = words_of(line);
    if (words.size() < 4 || words[0] != "vertex") continue;
    add({std::strtof(words[1].c_str(), nullptr), std::strtof(words[2].c_str(), nullptr),
         std::strtof(words[3].c_str(), nullptr)});
  }
  return mesh;
}

}  // namespace modar::second
