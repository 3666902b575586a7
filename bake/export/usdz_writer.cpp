// Writes the description itself: a subset of USD that needs none of its libraries.
#include "bake/export/model_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include "bake/image/image.hpp"
#include "formats/base/colour.hpp"
#include "formats/texture_format.hpp"

namespace modar {
namespace {

// ---- numbers ----

void append(std::string& text, double number) {
  // Six digits: of a model of a metre, a micrometre.
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.6g", number);
  text += digits;
}

template <class Vector>
std::string tuple(const Vector& v) {
  std::string text = "(";
  for (int i = 0; i < v.length(); ++i) {
    if (i != 0) text += ", ";
    append(text, v[i]);
  }
  return text + ")";
}

template <class List, class Write>
std::string array(const List& list, Write&& write) {
  std::string text = "[";
  for (const auto& each : list) {
    if (text.size() > 1) text += ", ";
    text += write(each);
  }
  return text + "]";
}

// ---- the archive ----

struct Entry {
  std::string name;
  std::vector<std::byte> bytes;
};

void put(std::vector<std::byte>& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}

/// What a ZIP's local and central headers have in common (APPNOTE 4.3.7 and 4.3.12), without a
/// time.
void put_header(std::vector<std::byte>& out, const Entry& entry, std::size_t padding) {
  const auto* data = reinterpret_cast<const Bytef*>(entry.bytes.data());
  put(out, 20, 2);    // version to extract with
  put(out, 0, 2);     // flags
  put(out, 0, 2);     // stored
  put(out, 0, 2);     // time
  put(out, 0x21, 2);  // date: 1980-01-01, the first that there is
  put(out, crc32_z(0, data, entry.bytes.size()), 4);
  put(out, entry.bytes.size(), 4);
  put(out, entry.bytes.size(), 4);
  put(out, entry.name.size(), 2);
  put(out, padding, 2);
}

void put_text(std::vector<std::byte>& out, std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> zip(const std::vector<Entry>& entries) {
  constexpr std::size_t kAlignment = 64;  // of a file's bytes: USDZ specification
  constexpr std::size_t kLocalHeader = 30;
  constexpr std::size_t kExtraHeader = 4;
  std::vector<std::byte> out;
  std::vector<std::byte> directory;
  for (const Entry& entry : entries) {
    const std::size_t start = out.size();
    const std::size_t plain = start + kLocalHeader + entry.name.size() + kExtraHeader;
    const std::size_t padding = kExtraHeader + (kAlignment - plain % kAlignment) % kAlignment;
    put(out, 0x04034b50, 4);
    put_header(out, entry, padding);
    put_text(out, entry.name);
    put(out, 0x1986, 2);  // a field that readers skip, as Pixar's own writer has it
    put(out, padding - kExtraHeader, 2);
    out.resize(out.size() + padding - kExtraHeader);
    out.insert(out.end(), entry.bytes.begin(), entry.bytes.end());
    put(directory, 0x02014b50, 4);
    put(directory, 20, 2);  // made by
    put_header(directory, entry, 0);
    put(directory, 0, 2 + 2 + 2 + 4);  // comment, disk, attributes
    put(directory, start, 4);
    put_text(directory, entry.name);
  }
  const std::size_t start = out.size();
  out.insert(out.end(), directory.begin(), directory.end());
  put(out, 0x06054b50, 4);
  put(out, 0, 4);  // disks
  put(out, entries.size(), 2);
  put(out, entries.size(), 2);
  put(out, directory.size(), 4);
  put(out, start, 4);
  put(out, 0, 2);
  return out;
}

// ---- the description ----

class Description {
 public:
  Description(const BundleView& bundle, std::span<const GlbImage> images)
      : bundle_(bundle), images_(images) {}

  Result<void> add_model(const RoomModel& placed);
  /// The description and its textures.
  std::vector<Entry> take_entries();

 private:
  Result<std::string> texture_file(std::uint32_t texture);
  Result<void> add_material(std::uint32_t index, bool coloured);
  Result<void> add_chunk(const RoomModel& placed, const ChunkRecord& chunk);

  const BundleView& bundle_;
  std::span<const GlbImage> images_;
  std::vector<Entry> textures_;
  std::vector<std::pair<std::uint32_t, std::string>> names_;  // of textures' files; empty: none
  std::vector<std::uint32_t> materials_;
  std::string material_text_;
  std::string mesh_text_;
  int meshes_ = 0;
};

/// The name of a texture's file in the archive; empty where its pixels are not there.
Result<std::string> Description::texture_file(std::uint32_t texture) {
  for (const auto& [known, name] : names_) {
    if (known == texture) return name;
  }
  names_.emplace_back(texture, "");
  for (const GlbImage& image : images_) {
    if (image.texture != texture) continue;
    constexpr int kQuality = 85;
    const bool opaque = is_opaque(image.pixels);
    Entry file;
    file.name = "textures/" + std::to_string(texture) + (opaque ? ".jpg" : ".png");
    MODAR_ASSIGN(file.bytes,
                 opaque ? encode_jpeg(image.pixels, kQuality) : encode_png(image.pixels));
    names_.back().second = file.name;
    textures_.push_back(std::move(file));
  }
  return names_.back().second;
}

/// A node of a material: what it is, and its lines.
std::string shader(const char* name, const char* id, const std::string& lines) {
  return std::string("            def Shader \"") + name +
         "\"\n            {\n                uniform token info:id = \"" + id + "\"\n" + lines +
         "            }\n";
}

std::string line(const std::string& text) {
  return "                " + text + "\n";
}

Result<void> Description::add_material(std::uint32_t index, bool coloured) {
  const MaterialRecord& source = bundle_.materials()[index];
  const std::string path = "/Model/Materials/m" + std::to_string(index);
  glm::dvec3 diffuse;
  glm::dvec3 emission;
  for (int i = 0; i < 3; ++i) {
    diffuse[i] = exported_diffuse(bundle_, source, static_cast<std::size_t>(i));
    emission[i] = std::clamp(linear_of_srgb(static_cast<double>(source.emission[i])), 0.0, 1.0);
  }
  std::string file;
  if (source.texture != kNone) {
    MODAR_ASSIGN(file, texture_file(source.texture));
  }
  std::string opacity = "float inputs:opacity = ";
  append(opacity, static_cast<double>(source.opacity));
  std::string surface;
  std::string others;
  if (!file.empty()) {
    const TextureRecord& texture = bundle_.textures()[source.texture];
    constexpr const char* kWays[] = {"clamp", "repeat", "mirror"};  // of Wrap
    const auto wrap = [&](std::size_t axis) {
      return kWays[static_cast<std::size_t>(texture_wrap(texture.flags)[axis])];
    };
    if ((texture.flags & kTextureAlpha) != 0) {
      opacity = "float inputs:opacity.connect = <" + path + "/Colour.outputs:a>";
    }
    if ((texture.flags & kTextureCutOut) != 0) {
      surface += line("float inputs:opacityThreshold = 0.5");
    }
    surface += line("color3f inputs:diffuseColor.connect = <" + path + "/Colour.outputs:rgb>");
    others = shader("Uv", "UsdPrimvarReader_float2",
                    line("string inputs:varname = \"st\"") + line("float2 outputs:result")) +
             shader("Colour", "UsdUVTexture",
                    line("asset inputs:file = @" + file + "@") +
                        line("float2 inputs:st.connect = <" + path + "/Uv.outputs:result>") +
                        line("float4 inputs:scale = " +
                             tuple(glm::dvec4(diffuse, static_cast<double>(source.opacity)))) +
                        line("token inputs:sourceColorSpace = \"sRGB\"") +
                        line(std::string("token inputs:wrapS = \"") + wrap(0) + "\"") +
                        line(std::string("token inputs:wrapT = \"") + wrap(1) + "\"") +
                        line("float3 outputs:rgb") + line("float outputs:a"));
  } else if (coloured) {
    surface += line("color3f inputs:diffuseColor.connect = <" + path + "/Colour.outputs:result>");
    others =
        shader("Colour", "UsdPrimvarReader_float3",
               line("string inputs:varname = \"displayColor\"") + line("float3 outputs:result"));
  } else {
    surface += line("color3f inputs:diffuseColor = " + tuple(diffuse));
  }
  if (emission != glm::dvec3(0.0)) {
    surface += line("color3f inputs:emissiveColor = " + tuple(emission));
  }
  std::string roughness = "float inputs:roughness = ";
  append(roughness, roughness_of(source.shininess));
  std::string metallic = "float inputs:metallic = ";
  append(metallic, static_cast<double>(material_share(source.flags, kMaterialMetalness)));
  surface += line(roughness) + line(metallic) + line(opacity) + line("token outputs:surface");
  material_text_ += "        def Material \"m" + std::to_string(index) +
                    "\"\n        {\n            token outputs:surface.connect = <" + path +
                    "/Surface.outputs:surface>\n" +
                    shader("Surface", "UsdPreviewSurface", surface) + others + "        }\n";
  return {};
}

Result<void> Description::add_chunk(const RoomModel& placed, const ChunkRecord& chunk) {
  const ModelRecord& model = bundle_.models()[placed.model];
  MODAR_ASSIGN(const DecodedLevel level,
               decode_level(bundle_, bundle_.layouts()[model.layout], chunk));
  if (level.indices.empty()) return {};
  const MaterialRecord& material = bundle_.materials()[chunk.material];
  if ((material.flags & kMaterialOccluder) != 0) return {};
  if (std::find(materials_.begin(), materials_.end(), chunk.material) == materials_.end()) {
    materials_.push_back(chunk.material);
    MODAR_TRY(add_material(chunk.material, !level.colours.empty()));
  }
  const glm::dmat3 turn(placed.place);
  std::string& text = mesh_text_;
  text += "    def Mesh \"c" + std::to_string(meshes_++) +
          "\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {\n";
  const std::vector<int> threes(level.indices.size() / 3, 3);
  const auto number = [](auto value) { return std::to_string(value); };
  text += "        int[] faceVertexCounts = " + array(threes, number) + "\n";
  text += "        int[] faceVertexIndices = " + array(level.indices, number) + "\n";
  text +=
      "        rel material:binding = </Model/Materials/m" + std::to_string(chunk.material) + ">\n";
  text += "        point3f[] points = " +
          array(level.positions,
                [&](const glm::dvec3& p) {
                  return tuple(glm::dvec3(placed.place * glm::dvec4(p, 1.0)));
                }) +
          "\n";
  text +=
      "        normal3f[] normals = " +
      array(level.normals, [&](const glm::dvec3& n) { return tuple(glm::normalize(turn * n)); }) +
      " (\n            interpolation = \"vertex\"\n        )\n";
  if (!level.uvs.empty()) {
    text +=
        "        texCoord2f[] primvars:st = " +
        array(level.uvs, [](const glm::dvec2& uv) { return tuple(glm::dvec2(uv.x, 1.0 - uv.y)); }) +
        " (\n            interpolation = \"vertex\"\n        )\n";
  }
  if (!level.colours.empty()) {
    text += "        color3f[] primvars:displayColor = " +
            array(level.colours,
                  [](const glm::dvec4& c) {
                    return tuple(
                        glm::dvec3(linear_of_srgb(c.r), linear_of_srgb(c.g), linear_of_srgb(c.b)));
                  }) +
            " (\n            interpolation = \"vertex\"\n        )\n";
  }
  text += "        uniform token subdivisionScheme = \"none\"\n";
  if ((material.flags & kMaterialTwoSided) != 0) text += "        uniform bool doubleSided = 1\n";
  text += "    }\n";
  return {};
}

Result<void> Description::add_model(const RoomModel& placed) {
  const ModelRecord& model = bundle_.models()[placed.model];
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    MODAR_TRY(add_chunk(placed, bundle_.chunks()[model.first_chunk + c]));
  }
  return {};
}

std::vector<Entry> Description::take_entries() {
  const std::string text =
      "#usda 1.0\n(\n    defaultPrim = \"Model\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
      "def Xform \"Model\" (\n    kind = \"component\"\n)\n{\n    def Scope \"Materials\"\n    "
      "{\n" +
      material_text_ + "    }\n" + mesh_text_ + "}\n";
  Entry description{"Model.usda", {}};
  put_text(description.bytes, text);
  std::vector<Entry> entries;
  entries.push_back(std::move(description));  // the first file is what viewers open
  for (Entry& texture : textures_) entries.push_back(std::move(texture));
  return entries;
}

}  // namespace

Result<std::vector<std::byte>> encode_usdz(const BundleView& bundle,
                                           std::span<const RoomModel> models,
                                           std::span<const GlbImage> images) {
  Description description(bundle, images);
  for (const RoomModel& placed : models) MODAR_TRY(description.add_model(placed));
  const std::vector<Entry> entries = description.take_entries();
  std::uint64_t bytes = 0;
  for (const Entry& entry : entries) bytes += entry.bytes.size() + 1024;
  if (bytes > 0xF0000000u) {
    return fail(ExitCode::kUnsupported, "usdz.too-large", "",
                "the models need more than the 4 GB that a USDZ file can hold",
                "bake smaller ones: --tier phone");
  }
  return zip(entries);
}

}  // namespace modar
