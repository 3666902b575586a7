// Decodes a model's packed bytes and writes them through tinygltf.
#include "bake/export/glb_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "bake/import/gltf/tinygltf_library.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/atomic_file.hpp"
#include "formats/texture_format.hpp"

namespace modar {
namespace {

/// glTF colours are linear, ours are sRGB (IEC 61966-2-1).
double to_linear(double c) {
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

class GlbBuilder {
 public:
  GlbBuilder(const BundleView& bundle, const ModelRecord& model)
      : bundle_(bundle), model_(model), decoder_(bundle.layouts()[model.layout]) {
    gltf_.asset.version = "2.0";
    gltf_.asset.generator = "ModAR";
    gltf_.buffers.emplace_back();
  }

  void add_images(std::span<const GlbImage> images);
  void add_materials();
  Result<void> add_chunk(const ChunkRecord& chunk);
  void add_scene();
  [[nodiscard]] const tinygltf::Model& gltf() const { return gltf_; }

 private:
  int add_view(const void* data, std::size_t size, int target);
  int add_accessor(int view, int type, int component, std::size_t count);
  int add_floats(const std::vector<float>& values, int type, std::size_t components);

  const BundleView& bundle_;
  const ModelRecord& model_;
  VertexDecoder decoder_;
  tinygltf::Model gltf_;
  tinygltf::Mesh mesh_;
  std::vector<std::pair<std::uint32_t, int>> textures_;  // of the bundle, of the file
};

int GlbBuilder::add_view(const void* data, std::size_t size, int target) {
  std::vector<unsigned char>& bytes = gltf_.buffers[0].data;
  bytes.resize((bytes.size() + 3) / 4 * 4);
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = bytes.size();
  view.byteLength = size;
  view.target = target;
  bytes.resize(bytes.size() + size);
  std::memcpy(bytes.data() + view.byteOffset, data, size);
  gltf_.bufferViews.push_back(view);
  return static_cast<int>(gltf_.bufferViews.size() - 1);
}

int GlbBuilder::add_accessor(int view, int type, int component, std::size_t count) {
  tinygltf::Accessor accessor;
  accessor.bufferView = view;
  accessor.type = type;
  accessor.componentType = component;
  accessor.count = count;
  gltf_.accessors.push_back(accessor);
  return static_cast<int>(gltf_.accessors.size() - 1);
}

int GlbBuilder::add_floats(const std::vector<float>& values, int type, std::size_t components) {
  const int view =
      add_view(values.data(), values.size() * sizeof(float), TINYGLTF_TARGET_ARRAY_BUFFER);
  return add_accessor(view, type, TINYGLTF_COMPONENT_TYPE_FLOAT, values.size() / components);
}

void GlbBuilder::add_images(std::span<const GlbImage> images) {
  for (const GlbImage& source : images) {
    bool used = false;
    for (std::uint32_t m = 0; m < model_.material_count; ++m) {
      used = used || bundle_.materials()[model_.first_material + m].texture == source.texture;
    }
    if (!used) continue;
    const Result<std::vector<std::byte>> png = encode_png(source.pixels);
    if (!png) continue;
    tinygltf::Image image;
    image.mimeType = "image/png";
    image.bufferView = add_view(png->data(), png->size(), 0);
    const TextureRecord& record = bundle_.textures()[source.texture];
    image.name = std::string(bundle_.name(record.name));
    gltf_.images.push_back(image);
    tinygltf::Sampler sampler;
    const bool repeats = (record.flags & kTextureRepeat) != 0;
    sampler.wrapS = repeats ? TINYGLTF_TEXTURE_WRAP_REPEAT : TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    sampler.wrapT = sampler.wrapS;
    gltf_.samplers.push_back(sampler);
    tinygltf::Texture texture;
    texture.source = static_cast<int>(gltf_.images.size() - 1);
    texture.sampler = static_cast<int>(gltf_.samplers.size() - 1);
    gltf_.textures.push_back(texture);
    textures_.emplace_back(source.texture, static_cast<int>(gltf_.textures.size() - 1));
  }
}

void GlbBuilder::add_materials() {
  for (std::uint32_t m = 0; m < model_.material_count; ++m) {
    const MaterialRecord& source = bundle_.materials()[model_.first_material + m];
    tinygltf::Material material;
    material.name = std::string(bundle_.name(source.name));
    auto& pbr = material.pbrMetallicRoughness;
    pbr.metallicFactor = 0.0;
    // The roughness whose highlight is as wide as that of the Phong exponent.
    const double exponent = std::max(0.0, static_cast<double>(source.shininess));
    pbr.roughnessFactor = std::pow(2.0 / (exponent + 2.0), 0.25);
    material.emissiveFactor.assign(3, 0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      pbr.baseColorFactor[i] =
          std::clamp(to_linear(static_cast<double>(source.diffuse[i])), 0.0, 1.0);
      material.emissiveFactor[i] =
          std::clamp(to_linear(static_cast<double>(source.emission[i])), 0.0, 1.0);
    }
    pbr.baseColorFactor[3] = std::clamp(static_cast<double>(source.opacity), 0.0, 1.0);
    bool blend = source.opacity < 1.0f;
    bool cut_out = false;
    for (const auto& [texture, index] : textures_) {
      if (texture != source.texture) continue;
      pbr.baseColorTexture.index = index;
      const std::uint32_t flags = bundle_.textures()[texture].flags;
      cut_out = (flags & kTextureCutOut) != 0;
      blend = blend || ((flags & kTextureAlpha) != 0 && !cut_out);
    }
    if (blend || cut_out) material.alphaMode = blend ? "BLEND" : "MASK";
    material.doubleSided = (source.flags & kMaterialTwoSided) != 0;
    gltf_.materials.push_back(material);
  }
}

Result<void> GlbBuilder::add_chunk(const ChunkRecord& chunk) {
  const LevelRecord& level = bundle_.levels()[chunk.first_level];
  if (level.index_count == 0) return {};
  std::vector<std::uint16_t> indices(level.index_count);
  std::memcpy(indices.data(), bundle_.indices().data() + level.index_offset, 2 * indices.size());
  const auto [low, high] = std::minmax_element(indices.begin(), indices.end());
  const std::uint16_t first = *low;
  const std::size_t count = std::size_t{*high} - first + 1;
  if (*high >= level.vertex_count) {
    return fail(ExitCode::kInvalidInput, "glb.index", "", "an index exceeds its chunk's vertices",
                "run `modar check` on the bundle and bake it again");
  }
  for (std::uint16_t& index : indices) index = static_cast<std::uint16_t>(index - first);

  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<float> uvs;
  std::vector<float> colours;
  std::vector<double> least(3, std::numeric_limits<double>::infinity());
  std::vector<double> greatest(3, -std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < count; ++v) {
    const std::byte* vertex =
        bundle_.vertices().data() + level.vertex_offset + (first + v) * decoder_.stride();
    const glm::dvec3 p = decoder_.position(vertex, chunk) * model_.scale;
    const glm::dvec3 n = decoder_.normal(vertex);
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      positions.push_back(static_cast<float>(p[i]));
      normals.push_back(static_cast<float>(n[i]));
      least[axis] = std::min(least[axis], static_cast<double>(positions.back()));
      greatest[axis] = std::max(greatest[axis], static_cast<double>(positions.back()));
    }
    const glm::dvec2 uv = decoder_.uv(vertex, chunk);
    uvs.insert(uvs.end(), {static_cast<float>(uv.x), static_cast<float>(uv.y)});
    const glm::dvec4 c = decoder_.colour(vertex);
    colours.insert(colours.end(),
                   {static_cast<float>(to_linear(c.r)), static_cast<float>(to_linear(c.g)),
                    static_cast<float>(to_linear(c.b)), static_cast<float>(c.a)});
  }
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.material = static_cast<int>(chunk.material - model_.first_material);
  const int position = add_floats(positions, TINYGLTF_TYPE_VEC3, 3);
  gltf_.accessors[static_cast<std::size_t>(position)].minValues = least;
  gltf_.accessors[static_cast<std::size_t>(position)].maxValues = greatest;
  primitive.attributes["POSITION"] = position;
  primitive.attributes["NORMAL"] = add_floats(normals, TINYGLTF_TYPE_VEC3, 3);
  if (decoder_.has(Semantic::kUv)) {
    primitive.attributes["TEXCOORD_0"] = add_floats(uvs, TINYGLTF_TYPE_VEC2, 2);
  }
  if (decoder_.has(Semantic::kColour)) {
    primitive.attributes["COLOR_0"] = add_floats(colours, TINYGLTF_TYPE_VEC4, 4);
  }
  primitive.indices = add_accessor(
      add_view(indices.data(), 2 * indices.size(), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
      TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, indices.size());
  mesh_.primitives.push_back(primitive);
  return {};
}

void GlbBuilder::add_scene() {
  mesh_.name = std::string(bundle_.name(model_.name));
  gltf_.meshes.push_back(mesh_);
  tinygltf::Node node;
  node.name = mesh_.name;
  node.mesh = 0;
  node.translation = {model_.center[0], model_.center[1], model_.center[2]};
  gltf_.nodes.push_back(node);
  tinygltf::Scene scene;
  scene.nodes = {0};
  gltf_.scenes.push_back(scene);
  gltf_.defaultScene = 0;
}

}  // namespace

Result<void> write_glb(const BundleView& bundle, std::uint32_t model,
                       std::span<const GlbImage> images, const std::string& path) {
  const ModelRecord& record = bundle.models()[model];
  try {
    GlbBuilder builder(bundle, record);
    builder.add_images(images);
    builder.add_materials();
    for (std::uint32_t c = 0; c < record.chunk_count; ++c) {
      if (auto added = builder.add_chunk(bundle.chunks()[record.first_chunk + c]); !added) {
        added.error().where = path;
        return added;
      }
    }
    builder.add_scene();
    if (builder.gltf().buffers[0].data.size() > 0xF0000000u) {
      return fail(ExitCode::kUnsupported, "glb.too-large", path,
                  "the model needs more than the 4 GB that a GLB file can hold",
                  "bake a smaller part of it");
    }
    std::ostringstream out;
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&builder.gltf(), out, false, true)) {
      return fail(ExitCode::kInternal, "glb.write", path, "tinygltf cannot write the scene",
                  "report this with the bundle");
    }
    return write_file(path, std::string_view(std::move(out).str()));
  } catch (const std::exception& error) {
    return fail(ExitCode::kInternal, "glb.write", path, error.what(),
                "report this with the bundle");
  }
}

}  // namespace modar
