// glTF 2.0 and GLB: a scene's triangles as its nodes place them, with the colours of its materials.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include "bake/extensions/lab/second/second.hpp"
#include "bake/json.hpp"
#include "formats/base/colour.hpp"

namespace modar::second {
namespace {

using List = std::vector<Json>;

double number(const Json& json, std::string_view path, double otherwise) {
  return json.find(path).value_or(Json()).number().value_or(otherwise);
}

int index(const Json& json, std::string_view path) {
  return static_cast<int>(number(json, path, -1));
}

std::string text(const Json& json, std::string_view path) {
  return json.find(path).value_or(Json()).text().value_or("");
}

List list(const Json& json, std::string_view path) {
  const Json array = json.find(path).value_or(Json());
  List elements;
  for (std::size_t i = 0; array.is_array() && i < array.size(); ++i)
    elements.push_back(*array.at(i));
  return elements;
}

/// Numbers of an array, or `values` where it has fewer.
template <std::size_t kCount>
std::array<double, kCount> numbers(const Json& json, std::string_view path,
                                   std::array<double, kCount> values) {
  const List elements = list(json, path);
  for (std::size_t i = 0; i < kCount && elements.size() >= kCount; ++i) {
    values[i] = elements[i].number().value_or(0);
  }
  return values;
}

std::string decode_base64(std::string_view text) {
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) continue;
    bits = bits << 6 | static_cast<unsigned>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count);
  }
  return bytes;
}

class GltfReader {
 public:
  GltfReader(const std::string& path, Json json, const std::string& binary)
      : path_(path), json_(std::move(json)) {
    for (const Json& buffer : list(json_, "buffers")) {
      const std::string uri = text(buffer, "uri");
      buffers_.push_back(uri.empty() ? binary : uri_bytes(uri));
    }
    views_ = list(json_, "bufferViews");
    accessors_ = list(json_, "accessors");
    nodes_ = list(json_, "nodes");
    meshes_ = list(json_, "meshes");
  }

  /// Nothing where the file needs what this reader has not.
  std::optional<Mesh> run() {
    if (!text(json_, "asset/version").starts_with("2") || !list(json_, "skins").empty()) return {};
    for (const Json& extension : list(json_, "extensionsRequired")) {
      const std::string name = extension.text().value_or("");
      good_ = good_ && (name == "KHR_mesh_quantization" || name == "KHR_texture_transform" ||
                        name == "KHR_node_visibility" || name == "EXT_texture_webp" ||
                        name.starts_with("KHR_materials_"));
    }
    for (const Json& material : list(json_, "materials")) take_material(material);
    mesh_.materials.emplace_back();
    places_.emplace_back();
    std::vector<bool> child(nodes_.size());
    for (const Json& node : nodes_) {
      for (const Json& c : list(node, "children")) child.at(c.count().value_or(0)) = true;
    }
    const List scenes = list(json_, "scenes");
    const auto scene = static_cast<std::size_t>(number(json_, "scene", 0));
    if (scene < scenes.size()) {
      for (const Json& node : list(scenes[scene], "nodes")) walk(node, glm::dmat4(1), 0);
    }
    for (std::size_t n = 0; n < nodes_.size() && scenes.empty(); ++n) {
      if (!child[n]) walk(Json(n), glm::dmat4(1), 0);
    }
    if (!good_) return std::nullopt;
    if (!mesh_.colours.empty()) mesh_.materials.back().colour = glm::dvec4(1);
    return std::move(mesh_);
  }

 private:
  std::string uri_bytes(const std::string& uri) {
    if (uri.starts_with("data:")) return decode_base64(uri.substr(uri.find(',') + 1));
    return file_bytes(named_file(path_, uri));
  }

  /// `count` elements of `size` bytes, `stride` apart; empty where they exceed their buffer.
  std::string_view view_bytes(int view, std::size_t offset, std::size_t least,
                              std::size_t& stride) {
    const Json& json = views_.at(static_cast<std::size_t>(view));
    const std::string_view all = buffers_.at(static_cast<std::size_t>(index(json, "buffer")));
    const auto start = static_cast<std::size_t>(number(json, "byteOffset", 0));
    const auto length = static_cast<std::size_t>(number(json, "byteLength", 0));
    stride = static_cast<std::size_t>(number(json, "byteStride", 0));
    good_ = good_ && start + length <= all.size() && offset + least <= length &&
            list(json, "extensions").empty() && !json.find("extensions");
    return good_ ? all.substr(start + offset, length - offset) : std::string_view();
  }

  /// Rows of components, as numbers.
  std::vector<std::array<double, 4>> rows(int number_of) {
    const Json& json = accessors_.at(static_cast<std::size_t>(number_of));
    const int type = index(json, "componentType");
    const std::size_t size = type < 5122 ? 1 : (type < 5124 ? 2 : 4);
    const std::string shape = text(json, "type");
    const std::size_t columns =
        shape == "SCALAR" ? 1 : static_cast<std::size_t>(shape.back() - '0');
    const auto count = static_cast<std::size_t>(number(json, "count", 0));
    good_ = good_ && !json.find("sparse") && columns <= 4;
    std::vector<std::array<double, 4>> values;
    if (!good_ || index(json, "bufferView") < 0) return values;
    std::size_t stride = 0;
    const auto offset = static_cast<std::size_t>(number(json, "byteOffset", 0));
    const std::string_view bytes =
        view_bytes(index(json, "bufferView"), offset, columns * size, stride);
    if (stride == 0) stride = columns * size;
    good_ = good_ && (count - 1) * stride + columns * size <= bytes.size();
    const bool share = json.find("normalized").value_or(Json()).truth().value_or(false);
    for (std::size_t i = 0; good_ && i < count; ++i) {
      std::array<double, 4>& row = values.emplace_back();
      for (std::size_t c = 0; c < columns; ++c) {
        row[c] = component(bytes.data() + i * stride + c * size, type, share);
      }
    }
    return values;
  }

  static double component(const char* at, int type, bool share) {
    const auto of = [at, share](auto value) {
      std::memcpy(&value, at, sizeof value);
      const auto most = static_cast<double>(std::numeric_limits<decltype(value)>::max());
      return share ? std::max(static_cast<double>(value) / most, -1.0) : static_cast<double>(value);
    };
    if (type == 5120) return of(std::int8_t());
    if (type == 5121) return of(std::uint8_t());
    if (type == 5122) return of(std::int16_t());
    if (type == 5123) return of(std::uint16_t());
    if (type == 5125) return of(std::uint32_t());
    float value = 0;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }

  /// Where a material's colour is on the uvs.
  struct Place {
    std::string attribute = "TEXCOORD_0";
    glm::dvec2 scale{1};
    glm::dvec2 offset{0};
    double turn = 0;
  };

  /// The picture of a texture; false where there is one that cannot be read.
  bool take_picture(const Json& info, SecondMaterial& material) {
    const List textures = list(json_, "textures");
    const auto number_of = static_cast<std::size_t>(index(info, "index"));
    if (number_of >= textures.size()) return true;
    const Json& texture = textures[number_of];
    int source = index(texture, "source");
    if (source < 0) source = index(texture, "extensions/EXT_texture_webp/source");
    const List images = list(json_, "images");
    if (source < 0 || static_cast<std::size_t>(source) >= images.size()) return false;
    const Json& image = images[static_cast<std::size_t>(source)];
    const List samplers = list(json_, "samplers");
    const auto sampler = static_cast<std::size_t>(index(texture, "sampler"));
    for (std::size_t axis = 0; axis < 2 && sampler < samplers.size(); ++axis) {
      const int mode = index(samplers[sampler], axis == 0 ? "wrapS" : "wrapT");
      material.wrap[axis] = mode == 33071   ? Wrap::kClamp
                            : mode == 33648 ? Wrap::kMirror
                                            : Wrap::kRepeat;
    }
    std::size_t stride = 0;
    const int view = index(image, "bufferView");
    if (view < 0)
      return decode_picture(uri_bytes(text(image, "uri")), material.picture, Colours::kStored);
    const double length = number(views_.at(static_cast<std::size_t>(view)), "byteLength", 0);
    const std::string_view bytes = view_bytes(view, 0, static_cast<std::size_t>(length), stride);
    return decode_picture(bytes, material.picture, Colours::kStored);
  }

  void take_material(const Json& json) {
    SecondMaterial& material = mesh_.materials.emplace_back();
    const Json pbr = json.find("pbrMetallicRoughness").value_or(Json());
    const Json info = pbr.find("baseColorTexture").value_or(Json());
    Place& place = places_.emplace_back();
    const Json moved = info.find("extensions/KHR_texture_transform").value_or(Json());
    const double set = number(moved, "texCoord", number(info, "texCoord", 0));
    place.attribute = "TEXCOORD_" + std::to_string(static_cast<int>(set));
    const auto scale = numbers<2>(moved, "scale", {1, 1});
    const auto offset = numbers<2>(moved, "offset", {0, 0});
    place.scale = {scale[0], scale[1]};
    place.offset = {offset[0], offset[1]};
    place.turn = number(moved, "rotation", 0);
    const auto base = numbers<4>(pbr, "baseColorFactor", {1, 1, 1, 1});
    const auto light = numbers<3>(json, "emissiveFactor", {0, 0, 0});
    for (int i = 0; i < 3; ++i) {
      const auto c = static_cast<std::size_t>(i);
      material.colour[i] = srgb_of_linear(std::clamp(base[c], 0.0, 1.0));
      material.emission[i] = srgb_of_linear(std::clamp(light[c], 0.0, 1.0));
    }
    if (json.find("extensions/KHR_materials_unlit") && !pbr.find("baseColorTexture")) {
      material.emission = glm::dvec3(material.colour);
      material.colour = glm::dvec4(0, 0, 0, material.colour.a);
      unlit_ = true;
    }
    const std::string mode = text(json, "alphaMode");
    material.colour.a = mode == "BLEND" ? base[3] : 1;
    mesh_.knows_colours &= take_picture(info, material);
    for (const char* other :
         {"emissiveTexture", "occlusionTexture", "extensions/KHR_materials_transmission",
          "extensions/KHR_materials_pbrSpecularGlossiness"}) {
      mesh_.knows_colours &= !json.find(other);
    }
    const double cutoff = mode == "MASK" ? number(json, "alphaCutoff", 0.5) : 0;
    if (mode != "BLEND") cut_out(base[3], cutoff, material.picture);
  }

  /// Makes alpha 0 below the cutoff, 255 from it on.
  static void cut_out(double alpha, double cutoff, RgbaImage& picture) {
    for (std::size_t i = 3; i < picture.pixels.size(); i += 4) {
      picture.pixels[i] = picture.pixels[i] * alpha / 255 >= cutoff ? 255 : 0;
    }
  }

  void walk(const Json& number_of, const glm::dmat4& parent, int depth) {
    const Json& node = nodes_.at(number_of.count().value_or(nodes_.size()));
    good_ = good_ && depth < 100 && !node.find("extensions/EXT_mesh_gpu_instancing");
    const Json hidden = node.find("extensions/KHR_node_visibility/visible").value_or(Json(true));
    if (!good_ || !hidden.truth().value_or(true)) return;
    const auto move = numbers<3>(node, "translation", {0, 0, 0});
    const auto turn = numbers<4>(node, "rotation", {0, 0, 0, 1});
    const auto size = numbers<3>(node, "scale", {1, 1, 1});
    const auto matrix =
        numbers<16>(node, "matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    const glm::dmat4 own =
        glm::make_mat4(matrix.data()) * glm::translate(glm::dmat4(1), {move[0], move[1], move[2]}) *
        glm::mat4_cast(glm::normalize(glm::dquat(turn[3], turn[0], turn[1], turn[2]))) *
        glm::scale(glm::dmat4(1), {size[0], size[1], size[2]});
    const glm::dmat4 place = parent * own;
    if (const int mesh = index(node, "mesh"); mesh >= 0) {
      const Json& json = meshes_.at(static_cast<std::size_t>(mesh));
      for (const Json& weight : list(json, "weights")) good_ = good_ && weight.number() == 0;
      good_ = good_ && list(node, "weights").empty();
      for (const Json& primitive : list(json, "primitives")) take_primitive(primitive, place);
    }
    for (const Json& child : list(node, "children")) walk(child, place, depth + 1);
  }

  void take_primitive(const Json& json, const glm::dmat4& to_scene) {
    const int mode = static_cast<int>(number(json, "mode", 4));
    good_ = good_ && !json.find("extensions/KHR_draco_mesh_compression");
    const int positions = index(json, "attributes/POSITION");
    if (mode < 4 || !good_ || positions < 0) return;
    const int stated = index(json, "material");
    const auto material = stated < 0 ? places_.size() - 1 : static_cast<std::size_t>(stated);
    const Place& place = places_.at(material);
    const auto attribute = [&](const std::string& name) {
      const int accessor = index(json, "attributes/" + name);
      return accessor < 0 ? std::vector<std::array<double, 4>>() : rows(accessor);
    };
    const std::size_t first = mesh_.positions.size();
    const glm::dmat3 turn = glm::transpose(glm::inverse(glm::dmat3(to_scene)));
    for (const auto& p : rows(positions)) {
      mesh_.positions.push_back(glm::dvec3(to_scene * glm::dvec4(p[0], p[1], p[2], 1)));
    }
    const std::size_t count = mesh_.positions.size() - first;
    for (const auto& n : attribute("NORMAL"))
      mesh_.normals.push_back(turn * glm::dvec3(n[0], n[1], n[2]));
    for (const auto& t : attribute(place.attribute)) {
      const glm::dvec2 uv = place.scale * glm::dvec2(t[0], t[1]);
      const double c = std::cos(place.turn);
      const double s = std::sin(place.turn);
      const glm::dvec2 at = place.offset + glm::dvec2(c * uv.x + s * uv.y, c * uv.y - s * uv.x);
      mesh_.uvs.push_back({at.x, 1 - at.y});
    }
    const auto colours = attribute("COLOR_0");
    if (!colours.empty()) mesh_.colours.resize(first, glm::dvec3(1));
    mesh_.knows_colours &= colours.empty() || !unlit_;
    for (const auto& c : colours) {
      const auto stored = [](double light) { return srgb_of_linear(std::clamp(light, 0.0, 1.0)); };
      mesh_.colours.push_back({stored(c[0]), stored(c[1]), stored(c[2])});
    }
    if (!mesh_.colours.empty()) mesh_.colours.resize(first + count, glm::dvec3(1));
    // Each array that a primitive has is as long as its positions; those that it lacks follow it.
    const bool has_normals = mesh_.normals.size() == first + count;
    const bool has_uvs = mesh_.uvs.size() == first + count;
    mesh_.normals.resize(first + count);
    mesh_.uvs.resize(first + count);
    add_faces(json, mode, first, material, has_uvs, has_normals, glm::determinant(to_scene) < 0);
  }

  void add_faces(const Json& json, int mode, std::size_t first, std::size_t material, bool has_uvs,
                 bool has_normals, bool mirrored) {
    std::vector<int> corners;
    for (std::size_t v = first; v < mesh_.positions.size(); ++v)
      corners.push_back(static_cast<int>(v));
    if (const int accessor = index(json, "indices"); accessor >= 0) {
      corners.clear();
      for (const auto& row : rows(accessor))
        corners.push_back(static_cast<int>(row[0]) + static_cast<int>(first));
    }
    for (std::size_t i = 0; i + 2 < corners.size(); i += mode == 4 ? 3 : 1) {
      std::array<int, 3> of = {corners[mode == 6 ? 0 : i], corners[i + 1], corners[i + 2]};
      if (mirrored != (mode == 5 && i % 2 == 1)) std::swap(of[1], of[2]);
      Face face;
      face.material = static_cast<std::uint32_t>(material);
      face.smoothing = 0;
      for (const int v : of) face.corners.push_back({v, has_uvs ? v : -1, has_normals ? v : -1});
      mesh_.faces.push_back(std::move(face));
    }
  }

  const std::string& path_;
  Json json_;
  std::vector<std::string> buffers_;
  List views_, accessors_, nodes_, meshes_;
  std::vector<Place> places_;
  Mesh mesh_;
  bool good_ = true;
  bool unlit_ = false;  // a material without a picture is
};

}  // namespace

std::optional<Mesh> read_gltf(const std::string& path) {
  const std::string bytes = file_bytes(path);
  std::string json = bytes;
  std::string binary;
  if (bytes.starts_with("glTF") && bytes.size() > 20) {
    const auto length = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, sizeof value);
      return std::min<std::size_t>(value, bytes.size() - at);
    };
    const std::size_t end = std::min(20 + length(12), bytes.size());
    json = bytes.substr(20, end - 20);
    if (end + 8 <= bytes.size()) binary = bytes.substr(end + 8, length(end));
  }
  try {
    return GltfReader(path, Json::parse(json), binary).run();
  } catch (const std::exception&) {  // of at() and stoi(): the file refers to what it has not
    return std::nullopt;
  }
}

}  // namespace modar::second
