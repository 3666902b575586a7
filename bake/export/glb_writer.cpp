// Decodes a model's packed bytes and writes them through tinygltf.
#include "bake/export/model_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "bake/import/gltf/tinygltf_library.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/base/colour.hpp"
#include "formats/component.hpp"
#include "formats/texture_format.hpp"

namespace modar {
namespace {

class GlbBuilder {
 public:
  explicit GlbBuilder(const BundleView& bundle) : bundle_(bundle) {
    gltf_.asset.version = "2.0";
    gltf_.asset.generator = "ModAR";
    gltf_.buffers.emplace_back();
    gltf_.scenes.emplace_back();
    gltf_.defaultScene = 0;
  }

  /// factor: on the positions of its own space. node: where it goes.
  Result<void> add_model(std::uint32_t index, std::span<const GlbImage> images, double factor,
                         tinygltf::Node node);
  Result<std::vector<std::byte>> file();

 private:
  void add_images(const ModelRecord& model, std::span<const GlbImage> images);
  void add_materials(const ModelRecord& model);
  Result<void> add_chunk(const LayoutRecord& layout, const ChunkRecord& chunk, int material,
                         double factor, tinygltf::Mesh& mesh);
  int add_view(const void* data, std::size_t size, int target);
  int add_accessor(int view, int type, int component, std::size_t count);
  int add_floats(const std::vector<float>& values, int type, std::size_t components,
                 int target = TINYGLTF_TARGET_ARRAY_BUFFER);
  int add_node(tinygltf::Node node, int parent);

  // What moves.
  /// The moving part of a material; nullptr: none.
  [[nodiscard]] const PartRecord* part_of(std::uint32_t material) const;
  /// The joint that weighs a part's morph target.
  [[nodiscard]] std::uint32_t weight_of(const PartRecord& part, std::uint32_t target) const {
    return bundle_.bones()[part.first_bone + part.bone_count + target].joint;
  }
  [[nodiscard]] bool weighs(std::uint32_t joint) const;
  void add_joints(std::uint32_t model, int root);
  int add_skin(const PartRecord& part);
  void add_bones(const LayoutRecord& layout, const PartRecord& part, const DecodedLevel& level,
                 tinygltf::Primitive& primitive);
  std::vector<float> add_targets(const LayoutRecord& layout, const PartRecord& part,
                                 const DecodedLevel& level, tinygltf::Primitive& primitive);
  void add_clips(std::uint32_t model);
  void add_channel(int node, const char* path, const std::vector<float>& times,
                   const std::vector<float>& values, int type, std::size_t components,
                   tinygltf::Animation& animation);
  void add_weights(const PartRecord& part, int node, const ClipTracksView& view, float step,
                   std::uint32_t first, tinygltf::Animation& animation);

  const BundleView& bundle_;
  tinygltf::Model gltf_;
  std::vector<std::pair<std::uint32_t, int>> textures_;  // of the bundle, of the file
  std::vector<int> joint_nodes_;                         // of each joint of the bundle
  std::map<std::uint32_t, int> part_nodes_;  // of the material of each part of the model at hand
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

int GlbBuilder::add_floats(const std::vector<float>& values, int type, std::size_t components,
                           int target) {
  const int view = add_view(values.data(), values.size() * sizeof(float), target);
  return add_accessor(view, type, TINYGLTF_COMPONENT_TYPE_FLOAT, values.size() / components);
}

void GlbBuilder::add_images(const ModelRecord& model, std::span<const GlbImage> images) {
  for (const GlbImage& source : images) {
    const auto there = [&](const auto& pair) { return pair.first == source.texture; };
    if (std::any_of(textures_.begin(), textures_.end(), there)) continue;
    if (!shows_texture(bundle_, model, source.texture)) continue;
    const Result<std::vector<std::byte>> png = encode_png(source.pixels);
    if (!png) continue;
    tinygltf::Image image;
    image.mimeType = "image/png";
    image.bufferView = add_view(png->data(), png->size(), 0);
    const TextureRecord& record = bundle_.textures()[source.texture];
    image.name = std::string(bundle_.name(record.name));
    gltf_.images.push_back(image);
    tinygltf::Sampler sampler;
    constexpr int kModes[] = {TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE, TINYGLTF_TEXTURE_WRAP_REPEAT,
                              TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT};  // of Wrap
    const TextureWrap wrap = texture_wrap(record.flags);
    sampler.wrapS = kModes[static_cast<std::size_t>(wrap[0])];
    sampler.wrapT = kModes[static_cast<std::size_t>(wrap[1])];
    gltf_.samplers.push_back(sampler);
    tinygltf::Texture texture;
    texture.source = static_cast<int>(gltf_.images.size() - 1);
    texture.sampler = static_cast<int>(gltf_.samplers.size() - 1);
    gltf_.textures.push_back(texture);
    textures_.emplace_back(source.texture, static_cast<int>(gltf_.textures.size() - 1));
  }
}

void GlbBuilder::add_materials(const ModelRecord& model) {
  for (std::uint32_t m = 0; m < model.material_count; ++m) {
    const MaterialRecord& source = bundle_.materials()[model.first_material + m];
    tinygltf::Material material;
    material.name = std::string(bundle_.name(source.name));
    auto& pbr = material.pbrMetallicRoughness;
    pbr.metallicFactor = static_cast<double>(material_share(source.flags, kMaterialMetalness));
    pbr.roughnessFactor = roughness_of(source.shininess);
    material.emissiveFactor.assign(3, 0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      pbr.baseColorFactor[i] = exported_diffuse(bundle_, source, i);
      material.emissiveFactor[i] =
          std::clamp(linear_of_srgb(static_cast<double>(source.emission[i])), 0.0, 1.0);
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

Result<void> GlbBuilder::add_chunk(const LayoutRecord& layout, const ChunkRecord& chunk,
                                   int material, double factor, tinygltf::Mesh& mesh) {
  MODAR_ASSIGN(const DecodedLevel level, decode_level(bundle_, layout, chunk));
  if (level.indices.empty()) return {};
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<float> uvs;
  std::vector<float> colours;
  std::vector<double> least(3, std::numeric_limits<double>::infinity());
  std::vector<double> greatest(3, -std::numeric_limits<double>::infinity());
  tinygltf::Primitive primitive;
  const PartRecord* const part = part_of(chunk.material);
  std::vector<float> still(3 * level.positions.size(), 0.0f);
  if (part != nullptr) still = add_targets(layout, *part, level, primitive);
  for (std::size_t v = 0; v < level.positions.size(); ++v) {
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      positions.push_back(static_cast<float>(level.positions[v][i] * factor) + still[3 * v + axis]);
      normals.push_back(static_cast<float>(level.normals[v][i]));
      least[axis] = std::min(least[axis], static_cast<double>(positions.back()));
      greatest[axis] = std::max(greatest[axis], static_cast<double>(positions.back()));
    }
  }
  for (const glm::dvec2& uv : level.uvs) {
    uvs.insert(uvs.end(), {static_cast<float>(uv.x), static_cast<float>(uv.y)});
  }
  for (const glm::dvec4& c : level.colours) {
    for (int i = 0; i < 3; ++i) colours.push_back(static_cast<float>(linear_of_srgb(c[i])));
    colours.push_back(static_cast<float>(c.a));
  }
  if (part != nullptr) add_bones(layout, *part, level, primitive);
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.material = material;
  const int position = add_floats(positions, TINYGLTF_TYPE_VEC3, 3);
  gltf_.accessors[static_cast<std::size_t>(position)].minValues = least;
  gltf_.accessors[static_cast<std::size_t>(position)].maxValues = greatest;
  primitive.attributes["POSITION"] = position;
  primitive.attributes["NORMAL"] = add_floats(normals, TINYGLTF_TYPE_VEC3, 3);
  if (!uvs.empty()) primitive.attributes["TEXCOORD_0"] = add_floats(uvs, TINYGLTF_TYPE_VEC2, 2);
  if (!colours.empty()) {
    primitive.attributes["COLOR_0"] = add_floats(colours, TINYGLTF_TYPE_VEC4, 4);
  }
  primitive.indices = add_accessor(add_view(level.indices.data(), 2 * level.indices.size(),
                                            TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
                                   TINYGLTF_TYPE_SCALAR, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                                   level.indices.size());
  mesh.primitives.push_back(primitive);
  return {};
}

Result<void> GlbBuilder::add_model(std::uint32_t index, std::span<const GlbImage> images,
                                   double factor, tinygltf::Node node) {
  const ModelRecord& model = bundle_.models()[index];
  add_images(model, images);
  const auto first_material = static_cast<int>(gltf_.materials.size());
  add_materials(model);
  const std::string name(bundle_.name(model.name));
  std::map<std::uint32_t, tinygltf::Mesh> meshes;  // by material of a part; kNone: of the rest
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle_.chunks()[model.first_chunk + c];
    const bool moves = part_of(chunk.material) != nullptr;
    const int material = first_material + static_cast<int>(chunk.material - model.first_material);
    tinygltf::Mesh& mesh = meshes[moves ? chunk.material : kNone];
    mesh.name = name;
    MODAR_TRY(
        add_chunk(bundle_.layouts()[model.layout], chunk, material, moves ? 1.0 : factor, mesh));
  }
  node.name = name;
  if (meshes.count(kNone) != 0) node.mesh = static_cast<int>(gltf_.meshes.size());
  if (meshes.count(kNone) != 0) gltf_.meshes.push_back(std::move(meshes[kNone]));
  meshes.erase(kNone);
  const int root = add_node(std::move(node), -1);
  gltf_.scenes[0].nodes.push_back(root);
  if (meshes.empty()) return {};
  tinygltf::Node moving;
  moving.scale = {factor, factor, factor};
  add_joints(index, add_node(std::move(moving), root));
  part_nodes_.clear();
  for (auto& [material, mesh] : meshes) {
    const PartRecord& part = *part_of(material);
    for (std::uint32_t t = 0; t < part.target_count; ++t) {
      const JointRecord& joint = bundle_.joints()[weight_of(part, t)];
      mesh.weights.push_back(static_cast<double>(joint.translation[0]));
    }
    tinygltf::Node skinned;
    skinned.mesh = static_cast<int>(gltf_.meshes.size());
    skinned.skin = add_skin(part);
    gltf_.meshes.push_back(std::move(mesh));
    part_nodes_[material] = add_node(std::move(skinned), root);
  }
  add_clips(index);
  return {};
}

int GlbBuilder::add_node(tinygltf::Node node, int parent) {
  const auto index = static_cast<int>(gltf_.nodes.size());
  gltf_.nodes.push_back(std::move(node));
  if (parent >= 0) gltf_.nodes[static_cast<std::size_t>(parent)].children.push_back(index);
  return index;
}

const PartRecord* GlbBuilder::part_of(std::uint32_t material) const {
  for (const PartRecord& part : bundle_.moving_parts()) {
    if (part.material == material) return &part;
  }
  return nullptr;
}

bool GlbBuilder::weighs(std::uint32_t joint) const {
  for (const PartRecord& part : bundle_.moving_parts()) {
    for (std::uint32_t t = 0; t < part.target_count; ++t) {
      if (weight_of(part, t) == joint) return true;
    }
  }
  return false;
}

/// A node for each joint that weighs no target, below one with the matrix before it.
void GlbBuilder::add_joints(std::uint32_t model, int root) {
  joint_nodes_.resize(bundle_.joints().size());
  for (std::uint32_t j = 0; j < bundle_.joints().size(); ++j) {
    const JointRecord& joint = bundle_.joints()[j];
    if (joint.model != model) continue;
    joint_nodes_[j] = -1;
    if (weighs(j)) continue;
    tinygltf::Node before;
    for (int i = 0; i < 16; ++i) {
      before.matrix.push_back(i % 4 == 3 ? i / 15
                                         : static_cast<double>(joint.before[i % 4 * 4 + i / 4]));
    }
    tinygltf::Node own;
    own.name = "joint " + std::to_string(j);
    own.translation.assign(joint.translation, joint.translation + 3);
    own.rotation.assign(joint.rotation, joint.rotation + 4);
    own.scale.assign(joint.scale, joint.scale + 3);
    const int parent = joint.parent == kNone ? root : joint_nodes_[joint.parent];
    joint_nodes_[j] = add_node(std::move(own), add_node(std::move(before), parent));
  }
}

int GlbBuilder::add_skin(const PartRecord& part) {
  tinygltf::Skin skin;
  std::vector<float> inverses;
  for (std::uint32_t b = part.first_bone; b < part.first_bone + part.bone_count; ++b) {
    const BoneRecord& bone = bundle_.bones()[b];
    skin.joints.push_back(joint_nodes_[bone.joint]);
    for (int i = 0; i < 16; ++i) {
      inverses.push_back(i % 4 == 3 ? static_cast<float>(i / 15) : bone.inverse[i % 4 * 4 + i / 4]);
    }
  }
  skin.inverseBindMatrices = add_floats(inverses, TINYGLTF_TYPE_MAT4, 16, 0);
  gltf_.skins.push_back(std::move(skin));
  return static_cast<int>(gltf_.skins.size() - 1);
}

void GlbBuilder::add_bones(const LayoutRecord& layout, const PartRecord& part,
                           const DecodedLevel& level, tinygltf::Primitive& primitive) {
  const auto [bones, shares] = vertex_shares(layout, part, level);
  primitive.attributes["JOINTS_0"] =
      add_accessor(add_view(bones.data(), bones.size(), TINYGLTF_TARGET_ARRAY_BUFFER),
                   TINYGLTF_TYPE_VEC4, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, bones.size() / 4);
  primitive.attributes["WEIGHTS_0"] = add_floats(shares, TINYGLTF_TYPE_VEC4, 4);
}

/// Adds the primitive's targets; answers how far vertices are from where they are stored while all
/// weights are 0.
std::vector<float> GlbBuilder::add_targets(const LayoutRecord& layout, const PartRecord& part,
                                           const DecodedLevel& level,
                                           tinygltf::Primitive& primitive) {
  std::vector<float> still(3 * level.vertices.size(), 0.0f);
  for (std::uint32_t t = 0; t < part.target_count; ++t) {
    const JointRecord& joint = bundle_.joints()[weight_of(part, t)];
    std::vector<float> ways;
    for (const std::byte* vertex : level.vertices) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto way = static_cast<float>(morph_part(layout, vertex, axis, t));
        still[ways.size()] += joint.before[3] * way;
        ways.push_back(joint.before[0] * way);
      }
    }
    primitive.targets.push_back({{"POSITION", add_floats(ways, TINYGLTF_TYPE_VEC3, 3)}});
    auto& accessor = gltf_.accessors.back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double low = static_cast<double>(ways[axis]);
      double high = low;
      for (std::size_t i = axis; i < ways.size(); i += 3) {
        low = std::min(low, static_cast<double>(ways[i]));
        high = std::max(high, static_cast<double>(ways[i]));
      }
      accessor.minValues.push_back(low);
      accessor.maxValues.push_back(high);
    }
  }
  return still;
}

void GlbBuilder::add_channel(int node, const char* path, const std::vector<float>& times,
                             const std::vector<float>& values, int type, std::size_t components,
                             tinygltf::Animation& animation) {
  tinygltf::AnimationSampler sampler;
  sampler.input = add_floats(times, TINYGLTF_TYPE_SCALAR, 1, 0);
  gltf_.accessors.back().minValues = {static_cast<double>(times.front())};
  gltf_.accessors.back().maxValues = {static_cast<double>(times.back())};
  sampler.output = add_floats(values, type, components, 0);
  sampler.interpolation = "LINEAR";
  tinygltf::AnimationChannel channel;
  channel.sampler = static_cast<int>(animation.samplers.size());
  channel.target_node = node;
  channel.target_path = path;
  animation.samplers.push_back(std::move(sampler));
  animation.channels.push_back(std::move(channel));
}

void GlbBuilder::add_clips(std::uint32_t model) {
  std::uint32_t first = 0;
  while (bundle_.joints()[first].model != model) ++first;
  for (const ClipRecord& clip : bundle_.clips()) {
    if (clip.model != model) continue;
    ClipTracksView view;
    const auto joints = static_cast<std::uint32_t>(bundle_.joints().size());
    const auto bytes = bundle_.section(SectionType::kClipTracks, clip.tracks);
    if (view_clip_tracks(bytes, joints, view) != nullptr) continue;
    tinygltf::Animation animation;
    animation.name = std::string(bundle_.name(clip.name));
    const float step = clip.seconds / static_cast<float>(view.header->sample_count - 1);
    for (const TrackRecord& track : view.tracks) {
      if (joint_nodes_[first + track.joint] < 0) continue;
      constexpr const char* kPaths[] = {"", "translation", "rotation", "scale"};
      const std::size_t components =
          static_cast<TrackPath>(track.path) == TrackPath::kRotation ? 4 : 3;
      std::vector<float> times;
      std::vector<float> values;
      for (std::uint32_t k = 0; k < track.key_count; ++k) {
        times.push_back(static_cast<float>(view.sample(track, k)) * step);
        const TrackValue value = view.value(track, k);
        values.insert(values.end(), value.begin(),
                      value.begin() + static_cast<std::ptrdiff_t>(components));
      }
      add_channel(joint_nodes_[first + track.joint], kPaths[track.path], times, values,
                  components == 4 ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3, components, animation);
    }
    for (const auto& [material, node] : part_nodes_) {
      add_weights(*part_of(material), node, view, step, first, animation);
    }
    gltf_.animations.push_back(std::move(animation));
  }
}

/// The weights of a part's targets, at the keys of any.
void GlbBuilder::add_weights(const PartRecord& part, int node, const ClipTracksView& view,
                             float step, std::uint32_t first, tinygltf::Animation& animation) {
  std::array<const TrackRecord*, kMostPartTargets> tracks{};
  std::set<std::uint16_t> samples;
  for (std::uint32_t t = 0; t < part.target_count; ++t) {
    for (const TrackRecord& track : view.tracks) {
      const bool own = first + track.joint == weight_of(part, t) &&
                       static_cast<TrackPath>(track.path) == TrackPath::kTranslation;
      if (!own) continue;
      tracks[t] = &track;
      for (std::uint32_t k = 0; k < track.key_count; ++k) samples.insert(view.sample(track, k));
    }
  }
  if (samples.empty()) return;
  std::vector<float> times;
  std::vector<float> values;
  for (const std::uint16_t sample : samples) {
    times.push_back(static_cast<float>(sample) * step);
    for (std::uint32_t t = 0; t < part.target_count; ++t) {
      std::uint32_t key = 0;
      values.push_back(tracks[t] != nullptr
                           ? view.at(*tracks[t], static_cast<float>(sample), key)[0]
                           : bundle_.joints()[weight_of(part, t)].translation[0]);
    }
  }
  add_channel(node, "weights", times, values, TINYGLTF_TYPE_SCALAR, 1, animation);
}

Result<std::vector<std::byte>> GlbBuilder::file() {
  if (gltf_.buffers[0].data.size() > 0xF0000000u) {
    return fail(ExitCode::kUnsupported, "glb.too-large", "",
                "the model needs more than the 4 GB that a GLB file can hold",
                "bake a smaller part of it");
  }
  std::ostringstream out;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&gltf_, out, false, true)) {
    return fail(ExitCode::kInternal, "glb.write", "", "tinygltf cannot write the scene",
                "report this with the bundle");
  }
  const std::string text = std::move(out).str();
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

/// What tinygltf throws, as an error.
template <class Build>
Result<std::vector<std::byte>> guarded_build(const BundleView& bundle, Build&& build) {
  try {
    GlbBuilder builder(bundle);
    MODAR_TRY(build(builder));
    return builder.file();
  } catch (const std::exception& error) {
    return fail(ExitCode::kInternal, "glb.write", "", error.what(), "report this with the bundle");
  }
}

}  // namespace

VertexShares vertex_shares(const LayoutRecord& layout, const PartRecord& part,
                           const DecodedLevel& level) {
  const AttributeRecord* joints = find_attribute(layout, Semantic::kJoints);
  const AttributeRecord* weights = find_attribute(layout, Semantic::kWeights);
  VertexShares result;
  for (const std::byte* vertex : level.vertices) {
    for (std::uint32_t k = 0; k < 4; ++k) {
      const bool one = part.bone_count == 1;
      const double share = one ? (k == 0 ? 1.0 : 0.0) : decode_component(*weights, vertex, k);
      const double bone = one || share == 0 ? 0.0 : decode_component(*joints, vertex, k);
      result.bones.push_back(static_cast<std::uint8_t>(bone));
      result.shares.push_back(static_cast<float>(share));
    }
  }
  return result;
}

double roughness_of(float shininess) {
  const double exponent = std::max(0.0, static_cast<double>(shininess));
  return std::pow(2.0 / (exponent + 2.0), 0.25);
}

float export_gain(const BundleView& bundle, std::uint32_t texture) {
  float gain = 1;
  for (std::uint32_t m = 0; m < bundle.materials().size(); ++m) {
    const MaterialRecord& material = bundle.materials()[m];
    const auto& [red, green, blue] = material.diffuse;
    if (material.texture == texture) gain = std::max({gain, red, green, blue});
  }
  return gain;
}

double exported_diffuse(const BundleView& bundle, const MaterialRecord& material,
                        std::size_t channel) {
  const float gain = material.texture == kNone ? 1.0F : export_gain(bundle, material.texture);
  const auto stored = static_cast<double>(material.diffuse[channel] / gain);
  return std::clamp(linear_of_srgb(stored), 0.0, 1.0);
}

bool shows_texture(const BundleView& bundle, const ModelRecord& model, std::uint32_t texture) {
  for (std::uint32_t m = 0; m < model.material_count; ++m) {
    if (bundle.materials()[model.first_material + m].texture == texture) return true;
  }
  return false;
}

Result<DecodedLevel> decode_level(const BundleView& bundle, const LayoutRecord& layout,
                                  const ChunkRecord& chunk) {
  DecodedLevel out;
  const LevelRecord& level = bundle.levels()[chunk.first_level];
  if (level.index_count == 0) return out;
  out.indices.resize(level.index_count);
  std::memcpy(out.indices.data(), bundle.indices().data() + level.index_offset,
              2 * out.indices.size());
  const auto [low, high] = std::minmax_element(out.indices.begin(), out.indices.end());
  const std::uint16_t first = *low;
  const std::size_t count = std::size_t{*high} - first + 1;
  if (*high >= level.vertex_count) {
    return fail(ExitCode::kInvalidInput, "model.index", "", "an index exceeds its chunk's vertices",
                "run `modar check` on the bundle and bake it again");
  }
  for (std::uint16_t& index : out.indices) index = static_cast<std::uint16_t>(index - first);
  const VertexDecoder decoder(layout);
  for (std::size_t v = 0; v < count; ++v) {
    const std::byte* vertex =
        bundle.vertices().data() + level.vertex_offset + (first + v) * decoder.stride();
    out.vertices.push_back(vertex);
    out.positions.push_back(decoder.position(vertex, chunk));
    out.normals.push_back(decoder.normal(vertex));
    if (decoder.has(Semantic::kUv)) out.uvs.push_back(decoder.uv(vertex, chunk));
    if (decoder.has(Semantic::kColour)) out.colours.push_back(decoder.colour(vertex));
  }
  return out;
}

Result<std::vector<std::byte>> encode_glb(const BundleView& bundle,
                                          std::span<const RoomModel> models,
                                          std::span<const GlbImage> images) {
  return guarded_build(bundle, [&](GlbBuilder& builder) -> Result<void> {
    for (const RoomModel& placed : models) {
      tinygltf::Node node;
      for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) node.matrix.push_back(placed.place[column][row]);
      }
      MODAR_TRY(builder.add_model(placed.model, images, 1.0, std::move(node)));
    }
    return {};
  });
}

Result<std::vector<std::byte>> encode_glb(const BundleView& bundle, std::uint32_t model,
                                          std::span<const GlbImage> images) {
  return guarded_build(bundle, [&](GlbBuilder& builder) {
    const ModelRecord& record = bundle.models()[model];
    tinygltf::Node node;
    node.translation = {record.center[0], record.center[1], record.center[2]};
    return builder.add_model(model, images, record.scale, std::move(node));
  });
}

}  // namespace modar
