// Maps glTF's metallic-roughness materials to what our shader has; image files; uv transforms.
#include "bake/import/gltf/gltf_materials.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "bake/image/image.hpp"
#include "bake/import/conversion.hpp"
#include "bake/import/gltf/gltf_pictures.hpp"
#include "bake/import/gltf/tinygltf_library.hpp"
#include "bake/import/name_form.hpp"
#include "bake/import/obj/mtl_reader.hpp"
#include "bake/import/read_model.hpp"
#include "bake/import/reflection.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/colour.hpp"
#include "formats/base/leftover.hpp"

namespace modar {
namespace {

/// A temporary folder, removed with the last material that needs it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    // Not only where TMPDIR says: it may be full or read-only.
    std::error_code error;
    for (const std::string& base :
         {std::filesystem::temp_directory_path(error).string(), std::string("/tmp"),
          std::string("/var/tmp"), std::string("/dev/shm")}) {
      std::string name = base + "/modar-gltf-XXXXXX";
      if (base.empty() || ::mkdtemp(name.data()) == nullptr) continue;
      path_ = name;
      leftovers_.emplace_back(path_);
      return;
    }
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Of a file or folder in it.
  std::string with(std::string path) {
    leftovers_.emplace_back(path);
    return path;
  }

 private:
  std::string path_;
  std::vector<Leftover> leftovers_;
};

/// The letters, digits, '-' and '_' of a name; `other` if nothing is left.
std::string plain_name(const std::string& name, const std::string& other) {
  std::string plain;
  for (const char c : name) {
    const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '-' || c == '_';
    if (good && plain.size() < 64) plain += c;
  }
  return plain.empty() ? other : plain;
}

/// The ending of a picture's file, by its first bytes, else by the type that is stated.
const char* picture_ending(const std::vector<unsigned char>& bytes, const std::string& stated) {
  const std::string_view start(reinterpret_cast<const char*>(bytes.data()),
                               std::min<std::size_t>(bytes.size(), 12));
  if (start.starts_with("\xFF\xD8")) return ".jpg";
  if (start.starts_with("RIFF")) return ".webp";
  return stated == "image/ktx2" ? ".ktx2" : ".png";
}

/// Mean of a picture in linear light; black where it cannot be read.
glm::dvec3 mean_light(const std::string& path) {
  const Result<RgbaImage> image = read_texture(path);
  glm::dvec3 sum(0.0);
  if (!image) return sum;
  for (std::size_t i = 0; i < image->pixels.size(); ++i) {
    if (i % 4 != 3) sum[static_cast<int>(i % 4)] += linear_of_srgb(image->pixels[i] / 255.0);
  }
  return sum / (static_cast<double>(image->pixels.size()) / 4);
}

/// The part of opacity that a material gives up where all light goes through it. By eye: clear
/// glass keeps its outline and its reflections, tinted glass its tint.
constexpr float kClear = 0.8f;

/// KHR_materials_transmission's factor, 0 to 1. Its map is ignored.
float transmission_of(const tinygltf::Material& material) {
  const auto found = material.extensions.find("KHR_materials_transmission");
  if (found == material.extensions.end() || !found->second.IsObject()) return 0.0f;
  const tinygltf::Value& factor = found->second.Get("transmissionFactor");
  const double value = factor.IsNumber() ? factor.GetNumberAsDouble() : 0.0;
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

/// KHR_materials_pbrSpecularGlossiness, or null.
const tinygltf::Value* glossiness_of(const tinygltf::Material& material) {
  const auto found = material.extensions.find("KHR_materials_pbrSpecularGlossiness");
  const bool is_there = found != material.extensions.end() && found->second.IsObject();
  return is_there ? &found->second : nullptr;
}

/// Numbers of an array, or `others` where it has not as many.
std::vector<double> numbers_of(const tinygltf::Value& gloss, const char* key,
                               std::vector<double> others) {
  const tinygltf::Value& value = gloss.Get(key);
  if (!value.IsArray() || value.ArrayLen() != others.size()) return others;
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (value.Get(static_cast<int>(i)).IsNumber()) {
      others[i] = value.Get(static_cast<int>(i)).GetNumberAsDouble();
    }
  }
  return others;
}

/// A texture that an extension refers to, as the core's materials do.
tinygltf::TextureInfo texture_info(const tinygltf::Value& value) {
  tinygltf::TextureInfo info;
  if (!value.IsObject()) return info;
  if (value.Get("index").IsInt()) info.index = value.Get("index").GetNumberAsInt();
  if (value.Get("texCoord").IsInt()) info.texCoord = value.Get("texCoord").GetNumberAsInt();
  const tinygltf::Value& extensions = value.Get("extensions");
  if (extensions.IsObject()) {
    for (const std::string& name : extensions.Keys()) info.extensions[name] = extensions.Get(name);
  }
  return info;
}

/// The metallic-roughness material nearest to a specular-glossiness one. What reflects more than it
/// scatters, as metals do, has its colour from the reflection.
tinygltf::PbrMetallicRoughness metallic_roughness_of(const tinygltf::Value& gloss) {
  constexpr double kHalf = 0.5;  // of the glossiness where a map, which is not read, lowers it
  tinygltf::PbrMetallicRoughness pbr;
  pbr.baseColorFactor = numbers_of(gloss, "diffuseFactor", {1, 1, 1, 1});
  pbr.baseColorTexture = texture_info(gloss.Get("diffuseTexture"));
  const bool mapped = gloss.Has("specularGlossinessTexture");
  const tinygltf::Value& stated = gloss.Get("glossinessFactor");
  const double glossiness = stated.IsNumber() ? stated.GetNumberAsDouble() : 1.0;
  pbr.roughnessFactor = std::clamp(1 - (mapped ? kHalf : 1.0) * glossiness, 0.0, 1.0);
  pbr.metallicFactor = 0;
  const std::vector<double> specular = numbers_of(gloss, "specularFactor", {1, 1, 1});
  const double reflected = *std::max_element(specular.begin(), specular.end());
  const auto colour_end = pbr.baseColorFactor.begin() + 3;
  const double scattered = *std::max_element(pbr.baseColorFactor.begin(), colour_end);
  if (!mapped && pbr.baseColorTexture.index < 0 && reflected > scattered) {
    pbr.metallicFactor = 1;
    std::copy(specular.begin(), specular.end(), pbr.baseColorFactor.begin());
  }
  return pbr;
}

// Scales, turns, moves: the order and the sense of Khronos' sample viewer. (The matrix in the
// extension's text turns the other way; viewers, and the extension's test model, turn this way.)

void parse_pair(const tinygltf::Value& transform, const char* key, glm::dvec2& pair) {
  if (!transform.Has(key)) return;
  const tinygltf::Value& value = transform.Get(key);
  if (!value.IsArray() || value.ArrayLen() != 2) return;
  const tinygltf::Value& x = value.Get(0);
  const tinygltf::Value& y = value.Get(1);
  if (x.IsNumber() && y.IsNumber()) pair = {x.GetNumberAsDouble(), y.GetNumberAsDouble()};
}

/// Info: a texture of a material, with `texCoord` and `extensions`.
template <class Info>
GltfUv uv_of(const Info& texture) {
  GltfUv uv;
  int set = texture.texCoord;
  const auto found = texture.extensions.find("KHR_texture_transform");
  if (found != texture.extensions.end() && found->second.IsObject()) {
    const tinygltf::Value& transform = found->second;
    parse_pair(transform, "offset", uv.offset);
    parse_pair(transform, "scale", uv.scale);
    if (transform.Has("rotation") && transform.Get("rotation").IsNumber()) {
      uv.rotation = transform.Get("rotation").GetNumberAsDouble();
    }
    if (transform.Has("texCoord") && transform.Get("texCoord").IsInt()) {
      set = transform.Get("texCoord").GetNumberAsInt();
    }
  }
  uv.attribute = "TEXCOORD_" + std::to_string(set);
  return uv;
}

/// GltfUv::apply() as a matrix.
glm::dmat3 matrix_of(const GltfUv& uv) {
  const glm::dvec2 origin = uv.apply({0, 0});
  return {glm::dvec3(uv.apply({1, 0}) - origin, 0.0), glm::dvec3(uv.apply({0, 1}) - origin, 0.0),
          glm::dvec3(origin, 1.0)};
}

class MaterialReader {
 public:
  MaterialReader(const tinygltf::Model& gltf, const ModelFolder& folder, std::string label,
                 std::vector<Diagnostic>& diagnostics)
      : gltf_(gltf),
        folder_(folder),
        label_(std::move(label)),
        diagnostics_(diagnostics),
        paths_(gltf.images.size()) {}

  SourceMaterial read(const tinygltf::Material& source) {
    SourceMaterial m;
    m.name = source.name;
    const auto& pbr = source.pbrMetallicRoughness;
    for (int i = 0; i < 3; ++i) {
      m.diffuse[i] = channel(pbr.baseColorFactor, i, 1.0);
      m.emission[i] = channel(source.emissiveFactor, i, 0.0);
    }
    m.two_sided = source.doubleSided;
    set_reflection_of(source, m);
    set_pictures(source, m);
    m.beyond = beyond(picture_of(source));
    set_normal_map(source, m);
    if (source.extensions.count("KHR_materials_unlit") != 0) set_unlit(m);
    m.opacity *= 1 - kClear * transmission_of(source);
    m.ambient = m.diffuse;
    if (folder_of_images_ != nullptr) m.keeper = folder_of_images_;
    return m;
  }

  /// Images of the file: of base colours, in other maps that were merged, and those not read.
  [[nodiscard]] Fate images() const {
    std::vector<bool> shown(paths_.size(), false);
    for (const tinygltf::Material& m : gltf_.materials) {
      const int image = image_of(m.pbrMetallicRoughness.baseColorTexture.index);
      if (image >= 0) shown[static_cast<std::size_t>(image)] = true;
    }
    Fate fate;
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      const bool read = paths_[i] && !paths_[i]->empty();
      ++(!read ? fate.left_out : shown[i] ? fate.used : fate.changed);
    }
    return fate;
  }

  /// Adds one finding for each kind of thing that was folded or left out.
  void report() {
    const auto add = [&](const char* id, int count, const char* what) {
      if (count == 0) return;
      diagnostics_.push_back({id, DiagnosticSeverity::kInfo, label_, 0,
                              std::to_string(count) + " materials " + what, ""});
    };
    add("gltf.emissive-map", emissive_.folded,
        "have an emissive map, which is added to the base colour and then lit");
    add("gltf.emissive-map", emissive_.left_out,
        "have an emissive map with other texture coordinates than the base colour, whose mean is "
        "emitted");
    add("gltf.occlusion-map", occlusion_.folded,
        "have an occlusion map; the base colour is darkened by half of it");
    add("gltf.occlusion-map", occlusion_.left_out,
        "have an occlusion map with other texture coordinates than the base colour, which is "
        "ignored");
    add("gltf.normal-map", normals_left_out_,
        "have a normal map with another set of texture coordinates than the base colour, which is "
        "ignored");
    add("gltf.glossiness-map",
        static_cast<int>(std::count_if(gltf_.materials.begin(), gltf_.materials.end(),
                                       [](const tinygltf::Material& material) {
                                         const tinygltf::Value* gloss = glossiness_of(material);
                                         return gloss && gloss->Has("specularGlossinessTexture");
                                       })),
        "have a specular-glossiness map; half of their glossiness sets the highlight of the whole "
        "material");
    add("gltf.unlit", lit_,
        "are stated as unlit (KHR_materials_unlit), and their pictures are lit by the scene");
    add("gltf.alpha-mask", cut_out_,
        "are cut out at an alpha value: lower values are transparent, the others opaque");
  }

  [[nodiscard]] const std::vector<MetalMap>& metal_maps() const { return metal_maps_; }

 private:
  struct Count {
    int folded = 0;
    int left_out = 0;
  };

  void set_reflection_of(const tinygltf::Material& source, SourceMaterial& m) {
    const std::uint32_t number = count_++;
    if (source.extensions.count("KHR_materials_unlit") != 0) return;
    const auto& pbr = source.pbrMetallicRoughness;
    MetalMap map{number, image_path(pbr.metallicRoughnessTexture.index), pbr.roughnessFactor,
                 pbr.metallicFactor};
    for (int i = 0; i < 3; ++i) map.base[i] = factor(pbr.baseColorFactor, std::size_t(i), 1.0);
    map.pictured = pbr.baseColorTexture.index >= 0;
    map.on_its_uvs = pbr.metallicRoughnessTexture.texCoord == pbr.baseColorTexture.texCoord &&
                     pbr.metallicRoughnessTexture.extensions == pbr.baseColorTexture.extensions;
    if (map.path.empty()) {
      set_reflection(map.roughness, map.metalness, map.base, map.pictured, m);
    } else {
      metal_maps_.push_back(map);
    }
  }

  /// A plain colour is emitted; pictures and colours of vertices are lit.
  void set_unlit(SourceMaterial& m) {
    const int number = static_cast<int>(count_) - 1;
    bool plain = m.diffuse_map.empty();
    for (const tinygltf::Mesh& mesh : gltf_.meshes) {
      for (const tinygltf::Primitive& primitive : mesh.primitives) {
        plain = plain && (primitive.material != number || !primitive.attributes.count("COLOR_0"));
      }
    }
    if (plain) {
      m.emission = std::exchange(m.diffuse, glm::vec3(0.0f));
    } else {
      ++lit_;
    }
  }

  void set_pictures(const tinygltf::Material& source, SourceMaterial& m) {
    const auto& pbr = source.pbrMetallicRoughness;
    GltfPictures pictures;
    pictures.colour = image_path(pbr.baseColorTexture.index);
    const auto take = [&](const auto& info, std::string& path, Count& count) {
      if (info.index < 0) return;
      const tinygltf::TextureInfo& colour = pbr.baseColorTexture;
      if (info.texCoord == colour.texCoord && info.extensions == colour.extensions) {
        path = image_path(info.index);
      }
      ++(path.empty() ? count.left_out : count.folded);
    };
    take(source.emissiveTexture, pictures.emissive, emissive_);
    if (pictures.emissive.empty() && source.emissiveTexture.index >= 0) {
      const glm::dvec3 mean = mean_light(image_path(source.emissiveTexture.index));
      for (int i = 0; i < 3; ++i) {
        m.emission[i] = static_cast<float>(
            stored_light(mean[i] * factor(source.emissiveFactor, std::size_t(i), 0.0)));
      }
    }
    take(source.occlusionTexture, pictures.occlusion, occlusion_);
    if (!pictures.occlusion.empty()) {
      pictures.occlusion_strength = source.occlusionTexture.strength;
    }
    for (std::size_t i = 0; i < 3 && !pictures.emissive.empty(); ++i) {
      pictures.colour_factor[i] = factor(pbr.baseColorFactor, i, 1.0);
      pictures.emissive_factor[i] = factor(source.emissiveFactor, i, 0.0);
    }
    const double alpha = std::clamp(factor(pbr.baseColorFactor, 3, 1.0), 0.0, 1.0);
    pictures.alpha = GltfPictures::Alpha::kIgnored;
    if (source.alphaMode == "BLEND") {
      pictures.alpha = GltfPictures::Alpha::kKept;
      m.opacity = static_cast<float>(alpha);
    } else if (source.alphaMode == "MASK") {
      ++cut_out_;
      pictures.alpha = GltfPictures::Alpha::kCutOff;
      pictures.cutoff = source.alphaCutoff;
      pictures.colour_factor[3] = alpha;
      if (pictures.colour.empty() && alpha < pictures.cutoff) m.opacity = 0;
    }
    m.diffuse_map = folded(pictures);
    if (pictures.emissive.empty() || m.diffuse_map == pictures.colour) return;
    m.diffuse = glm::vec3(1.0f);  // it is in the picture
    m.emission = glm::vec3(0.0f);
  }

  /// Nothing is lit of an unlit material.
  void set_normal_map(const tinygltf::Material& source, SourceMaterial& m) {
    const tinygltf::NormalTextureInfo& info = source.normalTexture;
    if (info.index < 0 || source.extensions.count("KHR_materials_unlit") != 0) return;
    const GltfUv colour = uv_of(source.pbrMetallicRoughness.baseColorTexture);
    const GltfUv normal = uv_of(info);
    const glm::dmat3 to_colour = matrix_of(colour);
    if (colour.attribute != normal.attribute || !(std::fabs(glm::determinant(to_colour)) > 1e-12)) {
      ++normals_left_out_;
      return;
    }
    m.normal.path = image_path(info.index);
    m.normal.scale = static_cast<float>(info.scale);
    m.normal.wrap = texture_wrap(beyond(info.index));
    if (colour.offset != normal.offset || colour.scale != normal.scale ||
        colour.rotation != normal.rotation) {
      m.normal.uv = matrix_of(normal) * glm::inverse(to_colour);
    }
  }

  /// The path of what the shader draws: the picture itself, or a new one in the temporary folder.
  std::string folded(const GltfPictures& pictures) {
    const auto [found, added] = folded_.try_emplace(pictures, pictures.colour);
    if (!added) return found->second;
    const auto image = fold_pictures(pictures);
    if (!image) {
      // Where it is the colour, whoever reads it for the bundle says so.
      if (image.error().where != pictures.colour) note(image.error());
      return found->second;
    }
    if (!*image) return found->second;
    const std::filesystem::path first = pictures.first();
    const std::string path = new_picture(first.stem().string() + ".png");
    if (const auto written = write_png(**image, path)) {
      found->second = path;
    } else {
      note(written.error());
    }
    return found->second;
  }

  /// A path of this name that nothing has yet: in a folder of its own below the temporary one where
  /// the name is taken there, as textures are called by it.
  std::string new_picture(const std::string& name) {
    if (folder_of_images_ == nullptr) folder_of_images_ = std::make_shared<TemporaryFolder>();
    std::error_code error;
    std::string folder = folder_of_images_->path();
    for (int i = 2; std::filesystem::exists(folder + "/" + name, error); ++i) {
      folder = folder_of_images_->with(folder_of_images_->path() + "/" + std::to_string(i));
      std::filesystem::create_directory(folder, error);
    }
    return folder_of_images_->with(folder + "/" + name);
  }

  /// A picture that cannot be read is left out.
  void note(const Error& error) {
    diagnostics_.push_back(
        {error.code, DiagnosticSeverity::kWarning, error.where, 0, error.cause, error.cure});
  }

  static double factor(const std::vector<double>& factors, std::size_t i, double other) {
    return i < factors.size() ? factors[i] : other;
  }
  static float channel(const std::vector<double>& factors, int i, double other) {
    return static_cast<float>(stored_light(factor(factors, static_cast<std::size_t>(i), other)));
  }

  /// A texture's image; -1 if none.
  [[nodiscard]] int image_of(int texture) const {
    if (texture < 0 || static_cast<std::size_t>(texture) >= gltf_.textures.size()) return -1;
    const int source = source_of(gltf_.textures[static_cast<std::size_t>(texture)]);
    return source < 0 || static_cast<std::size_t>(source) >= gltf_.images.size() ? -1 : source;
  }

  std::string image_path(int texture) {
    const int source = image_of(texture);
    if (source < 0) return {};
    const auto index = static_cast<std::size_t>(source);
    if (!paths_[index]) paths_[index] = as_stored(find_image(gltf_.images[index], index));
    return *paths_[index];
  }

  /// The texture that the others of a material are drawn into.
  static int picture_of(const tinygltf::Material& material) {
    for (const int texture :
         {material.pbrMetallicRoughness.baseColorTexture.index, material.emissiveTexture.index}) {
      if (texture >= 0) return texture;
    }
    return material.occlusionTexture.index;
  }

  /// What a texture's sampler says, as SourceMaterial::beyond.
  std::uint32_t beyond(int texture) const {
    if (texture < 0 || static_cast<std::size_t>(texture) >= gltf_.textures.size()) {
      return kTextureRepeat;
    }
    const int sampler = gltf_.textures[static_cast<std::size_t>(texture)].sampler;
    if (sampler < 0 || static_cast<std::size_t>(sampler) >= gltf_.samplers.size()) {
      return kTextureRepeat;
    }
    const tinygltf::Sampler& stated = gltf_.samplers[static_cast<std::size_t>(sampler)];
    const auto along = [](int mode, std::uint32_t mirror, std::uint32_t clamp) -> std::uint32_t {
      if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return clamp;
      return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? mirror : 0;
    };
    return kTextureRepeat | along(stated.wrapS, kTextureMirrorU, kTextureClampU) |
           along(stated.wrapT, kTextureMirrorV, kTextureClampV);
  }

  /// The image of a texture: its PNG or JPEG, or else its WebP (EXT_texture_webp), or its KTX 2
  /// file, which the reader of images reports as unsupported.
  static int source_of(const tinygltf::Texture& texture) {
    if (texture.source >= 0) return texture.source;
    for (const char* const name : {"EXT_texture_webp", kBasisTextures}) {
      const auto found = texture.extensions.find(name);
      if (found == texture.extensions.end() || !found->second.IsObject()) continue;
      const tinygltf::Value& source = found->second.Get("source");
      if (source.IsInt()) return source.GetNumberAsInt();
    }
    return -1;
  }

  /// glTF 2.0, 3.8.2: what files state of their colours is ignored. A path of the stored pixels.
  std::string as_stored(const std::string& path) {
    if (path.empty() || !states_other_colours(path)) return path;
    const auto image = read_texture(path, Colours::kStored);
    if (!image) return path;
    const std::string copy = new_picture(std::filesystem::path(path).stem().string() + ".png");
    return write_png(*image, copy) ? copy : path;
  }

  std::string find_image(const tinygltf::Image& image, std::size_t index) {
    const std::string decoded = percent_decoded(image.uri);
    if (image.image.empty() || !image.uri.starts_with("data:")) {
      if (std::string found = find_named_file(image.uri, folder_); !found.empty()) {
        note_place(image.uri, found, folder_, label_, 0, diagnostics_);
        return found;
      }
    }
    if (!image.image.empty()) {
      const std::string path = new_picture(plain_name(image.name, "image" + std::to_string(index)) +
                                           picture_ending(image.image, image.mimeType));
      const auto bytes = std::as_bytes(std::span(image.image));
      if (!folder_of_images_->path().empty() && write_file(path, bytes)) return path;
    }
    diagnostics_.push_back(not_read("gltf.missing-image", label_, 0,
                                    "image '" + short_name(image.uri) + "'", decoded, folder_,
                                    "put the image next to the file under that name"));
    return {};
  }

  const tinygltf::Model& gltf_;
  const ModelFolder& folder_;
  std::string label_;
  std::vector<Diagnostic>& diagnostics_;
  std::vector<std::optional<std::string>> paths_;
  std::shared_ptr<TemporaryFolder> folder_of_images_;
  std::map<GltfPictures, std::string> folded_;
  std::vector<MetalMap> metal_maps_;
  std::uint32_t count_ = 0;
  Count emissive_;
  int lit_ = 0;  // of unlit ones
  Count occlusion_;
  int normals_left_out_ = 0;
  int cut_out_ = 0;
};

}  // namespace

void use_metallic_roughness(tinygltf::Model& gltf) {
  for (tinygltf::Material& material : gltf.materials) {
    if (const tinygltf::Value* gloss = glossiness_of(material)) {
      material.pbrMetallicRoughness = metallic_roughness_of(*gloss);
    }
  }
}

bool keep_image_bytes(tinygltf::Image* image, int, std::string*, std::string*, int, int,
                      const unsigned char* bytes, int size, void*) {
  image->image.assign(bytes, bytes + std::max(size, 0));
  return true;
}

std::vector<SourceMaterial> gltf_materials(const tinygltf::Model& gltf, const ModelFolder& folder,
                                           const std::string& label,
                                           std::vector<Diagnostic>& diagnostics,
                                           std::vector<MetalMap>& metal_maps, Fate& images) {
  MaterialReader reader(gltf, folder, label, diagnostics);
  std::vector<SourceMaterial> materials;
  for (const tinygltf::Material& m : gltf.materials) materials.push_back(reader.read(m));
  materials.emplace_back();
  reader.report();
  images = reader.images();
  metal_maps = reader.metal_maps();
  return materials;
}

glm::dvec2 GltfUv::apply(const glm::dvec2& uv) const {
  const glm::dvec2 scaled = scale * uv;
  const double c = std::cos(rotation);
  const double s = std::sin(rotation);
  return offset + glm::dvec2(c * scaled.x + s * scaled.y, c * scaled.y - s * scaled.x);
}

GltfUv gltf_uv(const tinygltf::Model& gltf, int material) {
  if (material < 0 || static_cast<std::size_t>(material) >= gltf.materials.size()) return {};
  return uv_of(
      gltf.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorTexture);
}

}  // namespace modar
