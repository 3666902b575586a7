// Reads glTF: walks the scene and gathers its primitives.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include "bake/import/conversion.hpp"
#include "bake/import/gltf/gltf_accessor.hpp"
#include "bake/import/gltf/gltf_materials.hpp"
#include "bake/import/gltf/gltf_meshopt.hpp"
#include "bake/import/gltf/gltf_parts.hpp"
#include "bake/import/gltf/gltf_pictures.hpp"
#include "bake/import/gltf/gltf_pose.hpp"
#include "bake/import/gltf/tinygltf_library.hpp"
#include "bake/import/name_form.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/input.hpp"
#include "bake/json.hpp"

namespace modar {
namespace {

// The scene.

/// Vertices beyond which a file may not copy nodes: some bytes could ask for any number. 33 times
/// the triangles that the device draws in a frame.
constexpr std::size_t kMostCopied = std::size_t{1} << 25;
constexpr int kMaxDepth = 1000;  ///< of nodes, which take 0.5 to 0.75 MiB of the stack

/// Parts counted while the scene is read, and left out of the model.
struct LeftOut {
  std::size_t hidden = 0;            ///< nodes
  std::size_t vertex_alphas = 0;     ///< primitives whose vertices have an opacity
  std::size_t lines_and_points = 0;  ///< primitives
  std::size_t morphs = 0;            ///< primitives with targets
  std::size_t second_uvs = 0;        ///< primitives
};

class SceneReader {
 public:
  SceneReader(const tinygltf::Model& gltf, SourceModel& model, std::string label, bool clips)
      : gltf_(gltf),
        model_(model),
        label_(std::move(label)),
        skins_(gltf),
        seen_(gltf.nodes.size()),
        parts_(gltf, clips ? gltf_clips(gltf, roots(), label_, model.diagnostics) : GltfClips{}) {}

  [[nodiscard]] const LeftOut& left_out() const { return left_out_; }

  /// Counts what the scene uses of the file, see Account.
  void account() {
    Account& account = model_.account;
    account.colours.used = gltf_.materials.size();
    account.animations.used = model_.movement.clips.size();
    account.animations.left_out = gltf_.animations.size() - account.animations.used;
    std::vector<bool> drawn(gltf_.meshes.size(), false);
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const tinygltf::Node& node = gltf_.nodes[i];
      const bool used = seen_[i] && !is_hidden(node);
      ++(!used            ? account.nodes.left_out
         : node.skin >= 0 ? account.nodes.changed
                          : account.nodes.used);
      const auto mesh = static_cast<std::size_t>(node.mesh);
      if (used && mesh < drawn.size()) drawn[mesh] = true;
    }
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      for (const tinygltf::Primitive& primitive : gltf_.meshes[i].primitives) {
        const std::string uv = gltf_uv(gltf_, primitive.material).attribute;
        for (const auto& [name, accessor] : primitive.attributes) {
          const bool bones = name == "JOINTS_0" || name == "WEIGHTS_0";
          const bool posed = bones && !parts_.any();
          const bool known = name == "POSITION" || name == "NORMAL" || name == "COLOR_0" ||
                             name == uv || (bones && parts_.any());
          ++(drawn[i] && known   ? account.attributes.used
             : drawn[i] && posed ? account.attributes.changed
                                 : account.attributes.left_out);
        }
      }
    }
  }

  Result<void> run() {
    for (const int node : roots()) MODAR_TRY(walk(node, glm::dmat4(1.0), 0));
    finish();
    return {};
  }

 private:
  [[nodiscard]] std::vector<int> roots() const {
    const int scene = gltf_.defaultScene >= 0 ? gltf_.defaultScene : 0;
    if (static_cast<std::size_t>(scene) < gltf_.scenes.size()) {
      return gltf_.scenes[static_cast<std::size_t>(scene)].nodes;
    }
    std::vector<bool> child(gltf_.nodes.size(), false);
    for (const tinygltf::Node& node : gltf_.nodes) {
      for (const int c : node.children) {
        if (c >= 0 && static_cast<std::size_t>(c) < child.size()) {
          child[static_cast<std::size_t>(c)] = true;
        }
      }
    }
    std::vector<int> nodes;
    for (std::size_t i = 0; i < child.size(); ++i) {
      if (!child[i]) nodes.push_back(static_cast<int>(i));
    }
    return nodes;
  }

  tl::unexpected<Error> wrong(const char* code, const std::string& cause) const {
    return fail(ExitCode::kInvalidInput, code, label_, cause,
                "check the file with the glTF validator and export it again");
  }

  Result<void> walk(int index, const glm::dmat4& parent, int depth) {
    if (index < 0 || static_cast<std::size_t>(index) >= gltf_.nodes.size() || depth > kMaxDepth ||
        seen_[static_cast<std::size_t>(index)]) {
      return wrong("gltf.read", "its nodes refer to missing nodes, or are reached twice");
    }
    seen_[static_cast<std::size_t>(index)] = true;
    const tinygltf::Node& node = gltf_.nodes[static_cast<std::size_t>(index)];
    if (is_hidden(node)) {
      ++left_out_.hidden;
      return {};
    }
    const glm::dmat4 to_scene = parent * node_transform(node);
    if (node.mesh >= 0 && static_cast<std::size_t>(node.mesh) < gltf_.meshes.size()) {
      node_ = static_cast<std::size_t>(index);
      MODAR_TRY(add_mesh(node, to_scene));
    }
    for (const int child : node.children) MODAR_TRY(walk(child, to_scene, depth + 1));
    return {};
  }

  /// KHR_node_visibility: hides a node and all below it.
  static bool is_hidden(const tinygltf::Node& node) {
    const auto found = node.extensions.find("KHR_node_visibility");
    if (found == node.extensions.end() || !found->second.IsObject()) return false;
    const tinygltf::Value& visible = found->second.Get("visible");
    return visible.IsBool() && !visible.Get<bool>();
  }

  Result<void> add_mesh(const tinygltf::Node& node, const glm::dmat4& to_scene) {
    const auto copies = node_copies(gltf_, node);
    if (!copies) return wrong("gltf.accessor", "the instances of a node exceed their buffer");
    for (const glm::dmat4& copy : *copies) {
      if (copies->size() > 1 && model_.positions.size() > kMostCopied) {
        return wrong("gltf.copies", "its instanced nodes make more than " +
                                        std::to_string(kMostCopied) + " vertices");
      }
      const tinygltf::Mesh& mesh = gltf_.meshes[static_cast<std::size_t>(node.mesh)];
      for (const auto& primitive : mesh.primitives) {
        MODAR_TRY(add_primitive(primitive, node.skin, to_scene, copy));
      }
    }
    return {};
  }

  /// A morph target with a weight, or one that a clip gives it.
  struct Morph {
    double weight = 0;
    std::uint32_t joint = kNoJoint;
    bool moves = false;
    bool turns = false;
    GltfAccessor positions;
    GltfAccessor normals;

    void apply(std::size_t v, glm::dvec3& at, glm::dvec3& normal) const {
      if (moves) at += weight * vector(positions, v);
      if (turns) normal += weight * vector(normals, v);
    }
  };

  /// Opens an optional attribute; false if it is present and broken.
  bool open(const tinygltf::Primitive& primitive, const std::string& name, std::size_t count,
            std::size_t least_components, GltfAccessor& accessor, bool& there) const {
    const auto found = primitive.attributes.find(name);
    there = found != primitive.attributes.end();
    return !there || (accessor.open(gltf_, found->second) && accessor.size() >= count &&
                      accessor.components() >= least_components);
  }

  bool open_morphs(const tinygltf::Primitive& primitive, std::size_t count,
                   std::vector<Morph>& morphs) const {
    for (std::size_t t = 0; t < primitive.targets.size(); ++t) {
      const double weight = gltf_weight(gltf_, gltf_.nodes[node_], t);
      const std::uint32_t joint = parts_.weight_joint(node_, t);
      if (weight == 0 && joint == kNoJoint) continue;
      Morph& morph = morphs.emplace_back();
      morph.weight = weight;
      morph.joint = joint;
      tinygltf::Primitive target;
      target.attributes = primitive.targets[t];
      if (!open(target, "POSITION", count, 3, morph.positions, morph.moves) ||
          !open(target, "NORMAL", count, 3, morph.normals, morph.turns)) {
        return false;
      }
    }
    return true;
  }

  Result<void> add_primitive(const tinygltf::Primitive& primitive, int skin,
                             const glm::dmat4& to_scene, const glm::dmat4& copy) {
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES) {
      ++left_out_.lines_and_points;
      return {};
    }
    if (primitive.attributes.count("TEXCOORD_1") != 0) ++left_out_.second_uvs;
    const GltfUv placing = gltf_uv(gltf_, primitive.material);
    GltfAccessor positions;
    GltfAccessor normals;
    GltfAccessor uvs;
    GltfAccessor colours;
    bool there = false;
    bool has_normals = false;
    bool has_uvs = false;
    bool has_colours = false;
    if (!open(primitive, "POSITION", 0, 3, positions, there) ||
        !open(primitive, "NORMAL", positions.size(), 3, normals, has_normals) ||
        !open(primitive, placing.attribute, positions.size(), 2, uvs, has_uvs) ||
        !open(primitive, "COLOR_0", positions.size(), 3, colours, has_colours)) {
      return wrong("gltf.accessor", "an accessor exceeds its buffer or is invalid");
    }
    if (!there) return {};
    std::vector<Morph> morphs;
    if (!open_morphs(primitive, positions.size(), morphs)) {
      return wrong("gltf.accessor", "a morph target exceeds its buffer or is invalid");
    }
    const bool morphing = std::any_of(morphs.begin(), morphs.end(), weighed);
    if (!primitive.targets.empty() && !morphing) ++left_out_.morphs;
    if (model_.positions.size() + positions.size() >= kNoIndex) {
      return wrong("gltf.read", "it has more vertices than 32 bits count");
    }
    const auto places = skins_.bind(primitive, skin, positions.size(), to_scene * copy);
    if (!places) return wrong("gltf.skin", "a skin, its joints or its weights are broken");
    const auto first = static_cast<std::uint32_t>(model_.positions.size());
    const std::uint32_t group =
        places->skinned()
            ? parts_.of_skin(static_cast<std::size_t>(skin), skins_, *places, positions.size())
            : parts_.of_node(node_);
    const bool moves = group != GltfParts::kStill;
    std::optional<glm::dmat4> place = places->of(0);
    if (moves && place) place = stored_place(*places, group, copy);
    glm::dmat3 turn(1.0);
    const bool mirrored = place && glm::determinant(glm::dmat3(*place)) < 0;
    for (std::size_t v = 0; v < positions.size(); ++v) {
      if (v == 0 || places->skinned()) {
        place = places->of(v);
        if (!place)
          return wrong("gltf.skin", "a vertex refers to a joint that its skin does not have");
        if (moves) place = stored_place(*places, group, copy);
        turn = glm::transpose(glm::inverse(glm::dmat3(*place)));
      }
      glm::dvec3 at = vector(positions, v);
      glm::dvec3 normal = has_normals ? vector(normals, v) : glm::dvec3(0.0);
      for (const Morph& morph : morphs) morph.apply(v, at, normal);
      model_.positions.push_back(glm::dvec3(*place * glm::dvec4(at, 1.0)));
      model_.normals.push_back(has_normals ? glm::vec3(turn * normal) : glm::vec3(0));
      model_.uvs.push_back(has_uvs ? uv_up(placing.apply({uvs.at(v, 0), uvs.at(v, 1)}))
                                   : glm::dvec2(0.0));
      model_.colours.push_back(has_colours ? colour_of(colours, v) : glm::vec3(1.0f));
      if (!parts_.any()) continue;
      parts_.add_vertex(moves && places->skinned() ? places->shares(v) : std::vector<BoneShare>(),
                        ways_of(morphs, v, glm::dmat3(*place)));
    }
    any_colours_ = any_colours_ || has_colours;
    if (has_colours && !opaque(primitive.material) && has_alpha(colours, positions.size())) {
      ++left_out_.vertex_alphas;
    }
    begin_material(primitive.material);
    if (parts_.any())
      parts_.begin_faces(model_.corner_positions.size() / 3,
                         moves || !morphing ? group : parts_.of_still());
    return add_triangles(primitive, mode, first, positions.size(), mirrored, has_uvs, has_normals);
  }

  static bool weighed(const Morph& morph) { return morph.moves && morph.joint != kNoJoint; }

  static std::vector<GltfParts::Way> ways_of(const std::vector<Morph>& morphs, std::size_t v,
                                             const glm::dmat3& turn) {
    std::vector<GltfParts::Way> ways;
    for (const Morph& morph : morphs) {
      if (weighed(morph)) ways.push_back({morph.joint, turn * vector(morph.positions, v)});
    }
    return ways;
  }

  /// Where the vertices of what moves are stored.
  [[nodiscard]] glm::dmat4 stored_place(const VertexPlaces& places, std::uint32_t group,
                                        const glm::dmat4& copy) const {
    return places.skinned() ? parts_.group(group).to_stored : parts_.to_stored(node_) * copy;
  }

  /// Such a material hides all behind it, whatever its alpha.
  [[nodiscard]] bool opaque(int material) const {
    const auto number = static_cast<std::size_t>(material);
    return material < 0 || number >= gltf_.materials.size() ||
           gltf_.materials[number].alphaMode == "OPAQUE";
  }

  static bool has_alpha(const GltfAccessor& colours, std::size_t count) {
    for (std::size_t v = 0; v < count && colours.components() == 4; ++v) {
      if (colours.at(v, 3) < 1) return true;
    }
    return false;
  }

  /// As SourceModel has it, in OBJ's convention.
  static glm::dvec2 uv_up(const glm::dvec2& uv) { return {uv.x, 1.0 - uv.y}; }

  static glm::vec3 colour_of(const GltfAccessor& colours, std::size_t v) {
    const glm::dvec3 linear = vector(colours, v);
    return glm::vec3(
        glm::dvec3(stored_light(linear.x), stored_light(linear.y), stored_light(linear.z)));
  }

  static glm::dvec3 vector(const GltfAccessor& accessor, std::size_t v) {
    return {accessor.at(v, 0), accessor.at(v, 1), accessor.at(v, 2)};
  }

  void begin_material(int material) {
    const bool known = material >= 0 && static_cast<std::size_t>(material) < gltf_.materials.size();
    const auto value = static_cast<std::uint32_t>(known ? static_cast<std::size_t>(material)
                                                        : gltf_.materials.size());
    const std::uint64_t face = model_.corner_positions.size() / 3;
    if (!model_.material_runs.empty() && model_.material_runs.back().first_face == face) {
      model_.material_runs.back().value = value;
    } else if (model_.material_runs.empty() || model_.material_runs.back().value != value) {
      model_.material_runs.push_back({face, value});
    }
  }

  Result<void> add_triangles(const tinygltf::Primitive& primitive, int mode, std::uint32_t first,
                             std::size_t vertices, bool mirrored, bool has_uvs, bool has_normals) {
    GltfAccessor indices;
    const bool indexed = primitive.indices >= 0;
    if (indexed && !indices.open(gltf_, primitive.indices)) {
      return wrong("gltf.accessor", "the indices of a primitive exceed their buffer");
    }
    const std::size_t count = indexed ? indices.size() : vertices;
    const bool list = mode == TINYGLTF_MODE_TRIANGLES;
    const bool fan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
    for (std::size_t i = 0; i + 2 < count; i += list ? 3 : 1) {
      std::array<std::size_t, 3> corner = {fan ? 0 : i, i + 1, i + 2};
      // Every other triangle of a strip, and all of a mirrored node, reverse their winding.
      const bool odd = !list && !fan && i % 2 == 1;
      if (odd != mirrored) std::swap(corner[1], corner[2]);
      for (const std::size_t c : corner) {
        const double at = indexed ? indices.at(c, 0) : static_cast<double>(c);
        if (!(at >= 0 && at < static_cast<double>(vertices))) {
          return wrong("gltf.accessor", "an index is beyond the vertices of its primitive");
        }
        const std::uint32_t v = first + static_cast<std::uint32_t>(at);
        model_.corner_positions.push_back(v);
        model_.corner_uvs.own.push_back(has_uvs ? v : kNoIndex);
        model_.corner_normals.own.push_back(has_normals ? v : kNoIndex);
      }
    }
    return {};
  }

  /// Stores an index plane in its cheapest form.
  static void compact(const Array<std::uint32_t>& positions, IndexPlane& plane) {
    const auto missing = [](std::uint32_t index) { return index == kNoIndex; };
    if (plane.own == positions) {
      plane.kind = IndexPlane::Kind::kSame;
    } else if (std::all_of(plane.own.begin(), plane.own.end(), missing)) {
      plane.kind = IndexPlane::Kind::kAbsent;
    } else {
      plane.kind = IndexPlane::Kind::kOwn;
      return;
    }
    plane.own.release();
  }

  void finish() {
    if (!any_colours_) model_.colours.release();
    parts_.cut(model_);
    compact(model_.corner_positions, model_.corner_uvs);
    compact(model_.corner_positions, model_.corner_normals);
    // The specification: faces without normals are flat-shaded.
    model_.smoothing_runs = {{0, 0}};
  }

  const tinygltf::Model& gltf_;
  SourceModel& model_;
  std::string label_;
  SkinPoses skins_;
  std::vector<bool> seen_;  // nodes: glTF's are trees
  GltfParts parts_;
  std::size_t node_ = 0;  // at hand
  bool any_colours_ = false;
  LeftOut left_out_;
};

/// More has no GLB, whose header states its length in 32 bits, and no buffer that fits next to one.
constexpr std::size_t kMaxFileBytes = 0xFFFFFFFF;

/// Extensions that are read in full.
constexpr const char* kKnownExtensions[] = {
    "EXT_mesh_gpu_instancing",    "EXT_meshopt_compression", "EXT_texture_webp",
    "KHR_draco_mesh_compression", "KHR_materials_unlit",     "KHR_mesh_quantization",
    "KHR_meshopt_compression",    "KHR_texture_transform",   "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission", "KHR_node_visibility"};

bool is_known(const std::string& extension) {
  return std::find(std::begin(kKnownExtensions), std::end(kKnownExtensions), extension) !=
         std::end(kKnownExtensions);
}

/// Whether a file that requires an extension can be shown without it: lamps, which the scene's
/// light replaces, notes, and refinements of the core's materials.
bool is_dispensable(const std::string& extension) {
  constexpr const char* kAlone[] = {
      "KHR_lights_punctual", "EXT_lights_ies", "EXT_lights_image_based",
      "KHR_xmp_json_ld",     "KHR_xmp",        "KHR_animation_pointer"};
  return std::find(std::begin(kAlone), std::end(kAlone), extension) != std::end(kAlone) ||
         extension.starts_with("KHR_materials_");
}

/// Whether nodes are in an object, as in glTF 1.0, which need not state a version.
bool has_named_nodes(std::string_view bytes) {
  const auto nodes = Json::parse(bytes).find("nodes");
  return nodes && !nodes->is_array() && !nodes->keys().empty();
}

/// Refuses glTF 1.0 and required extensions that are not read. gltf: may be half read.
Result<void> require_support(const tinygltf::Model& gltf, std::string_view bytes,
                             const std::string& path) {
  const bool binary = bytes.starts_with("glTF");
  const bool old_binary = binary && bytes.size() > 4 && bytes[4] == 1;
  if (old_binary || gltf.asset.version.starts_with("1") || (!binary && has_named_nodes(bytes))) {
    return fail(ExitCode::kUnsupported, "gltf.version", path, "this is glTF 1.0",
                "convert it to glTF 2.0, for instance with Blender or gltf-pipeline");
  }
  std::string unknown;
  for (const std::string& extension : gltf.extensionsRequired) {
    if (is_known(extension) || is_dispensable(extension)) continue;
    unknown += (unknown.empty() ? "" : ", ") + extension;
  }
  if (unknown.empty()) return {};
  if (unknown == kBasisTextures) {
    return fail(ExitCode::kUnsupported, "gltf.extension", path,
                "its textures are KTX 2 files (" + unknown + "), which are not read",
                gltf_conversion(path, {false, true}));
  }
  return fail(ExitCode::kUnsupported, "gltf.extension", path,
              "it requires extensions that are not read: " + unknown,
              "export it without them (meshes uncompressed or by Draco, textures as PNG, JPEG or "
              "WebP)");
}

/// What of the file no bundle holds, as one finding.
/// animations: that no clip of the model is of.
void report_left_out(const tinygltf::Model& gltf, std::size_t animations, const LeftOut& counts,
                     const std::string& label, std::vector<Diagnostic>& diagnostics) {
  std::string words;
  const auto add = [&words](std::size_t count, const char* one, const char* many) {
    if (count == 0) return;
    words += (words.empty() ? "" : ", ") + std::to_string(count) + " " + (count == 1 ? one : many);
  };
  add(animations, "animation (the pose of the file's nodes is baked)",
      "animations (the pose of the file's nodes is baked)");
  add(counts.morphs, "set of morph targets (at its default weights)",
      "sets of morph targets (at their default weights)");
  add(counts.hidden, "hidden node", "hidden nodes");
  add(counts.vertex_alphas, "primitive's opacity of vertices", "primitives' opacities of vertices");
  add(counts.second_uvs, "further uv set", "further uv sets");
  add(counts.lines_and_points, "primitive of lines or points", "primitives of lines or points");
  add(gltf.cameras.size(), "camera", "cameras");
  std::string extensions;
  for (const std::string& extension : gltf.extensionsUsed) {
    if (!is_known(extension)) extensions += (extensions.empty() ? "" : ", ") + extension;
  }
  if (!extensions.empty()) words += (words.empty() ? "" : ", ") + ("extensions " + extensions);
  if (words.empty()) return;
  const bool shows = animations != 0 || counts.morphs + counts.lines_and_points != 0;
  diagnostics.push_back(
      {"gltf.left-out", shows ? DiagnosticSeverity::kWarning : DiagnosticSeverity::kInfo, label, 0,
       "left out: " + words,
       animations == 0 ? "" : "for another pose, apply it to the model and export it again"});
}

// How tinygltf reads the files that a model names: regular ones, under the names as they stand.

bool is_readable(const std::string& path, void* folder) {
  return static_cast<const ModelFolder*>(folder)->has(path);
}

/// The file that a buffer's path refers to, in the folder or as find_named_file() finds it.
std::string found_path(const std::string& path, void* user) {
  const auto& folder = *static_cast<const ModelFolder*>(user);
  if (folder.has(path) || !path.starts_with(folder.path)) return path;
  const std::string found = find_named_file(path.substr(folder.path.size()), folder);
  return found.empty() ? path : found;
}

/// Calls what a `data:` URI holds plain bytes, whatever the file calls it: the bytes show what they
/// are, and tinygltf reads few types.
void call_data_bytes(std::string& json) {
  constexpr std::string_view kStart = "\"data:";
  constexpr std::string_view kEnd = ";base64,";
  constexpr std::size_t kMostType = 256;
  std::string plain;
  std::size_t done = 0;
  for (std::size_t at = json.find(kStart); at != std::string::npos;
       at = json.find(kStart, at + 1)) {
    const std::size_t end = json.find(kEnd, at);
    if (end == std::string::npos) break;
    const std::size_t type = at + kStart.size();
    if (end - type > kMostType || json.find('"', type) < end) continue;
    plain.append(json, done, type - done);
    plain += "application/octet-stream";
    done = end;
    // Nothing at all would refuse the file; a byte is no picture, which is reported.
    if (json.compare(end + kEnd.size(), 1, "\"") == 0) {
      plain.append(kEnd).append("AA==");
      done = end + kEnd.size();
    }
  }
  if (done != 0) json = plain.append(json, done, std::string::npos);
}

/// Words of a message with each URI short.
std::string short_words(const std::string& message) {
  std::string words;
  for (std::size_t at = 0; at < message.size();) {
    const std::size_t end = std::min(message.find(' ', at), message.size());
    words += (words.empty() ? "" : " ") + short_name(message.substr(at, end - at));
    at = end + 1;
  }
  return words;
}

bool read_buffer(std::vector<unsigned char>* bytes, std::string* error, const std::string& path,
                 void*) {
  const Result<std::string> read = read_file(path, kMaxFileBytes);
  if (!read) {
    *error += "cannot read " + path + ": " + read.error().cause;
    return false;
  }
  bytes->assign(read->begin(), read->end());
  return true;
}

/// Errors: kInvalidInput "gltf.short" where a GLB states more bytes than it has.
Result<void> require_whole(std::string_view bytes, const std::string& path) {
  constexpr std::size_t kLengthAt = 8;
  std::uint32_t stated = 0;
  if (!bytes.starts_with("glTF") || bytes.size() < kLengthAt + sizeof stated) return {};
  std::memcpy(&stated, bytes.data() + kLengthAt, sizeof stated);
  if (stated <= bytes.size()) return {};
  return fail(ExitCode::kInvalidInput, "gltf.short", path + ": byte 8",
              "the file states " + std::to_string(stated) + " bytes and has " +
                  std::to_string(bytes.size()),
              "the file is truncated; copy or export it again");
}

}  // namespace

Result<SourceModel> read_gltf(const std::string& path, const ReadOptions& options) {
  MODAR_ASSIGN(std::string bytes, read_file(path, kMaxFileBytes));
  MODAR_TRY(require_whole(bytes, path));
  const std::string parent = std::filesystem::path(path).parent_path().string();
  ModelFolder place((parent.empty() ? "." : parent) + "/", options.within);
  const std::string& folder = place.path;
  MODAR_ASSIGN(bytes, decode_meshopt_views(std::move(bytes), place, path));
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_image_bytes, nullptr);
  if (!bytes.starts_with("glTF")) call_data_bytes(bytes);
  loader.SetFsCallbacks({is_readable, found_path, read_buffer, nullptr, &place});
  tinygltf::Model gltf;
  std::string error;
  std::string warning;
  const auto size = static_cast<unsigned>(std::min<std::size_t>(bytes.size(), 0xFFFFFFFFu));
  bool good = false;
  try {
    good = bytes.starts_with("glTF")
               ? loader.LoadBinaryFromMemory(&gltf, &error, &warning,
                                             reinterpret_cast<const unsigned char*>(bytes.data()),
                                             size, folder)
               : loader.LoadASCIIFromString(&gltf, &error, &warning, bytes.data(), size, folder);
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  MODAR_TRY(require_support(gltf, bytes, path));
  if (!good) {
    std::replace(error.begin(), error.end(), '\n', ' ');
    error.erase(error.find_last_not_of(". ") + 1);
    return fail(
        ExitCode::kInvalidInput, "gltf.read", path,
        "it cannot be read as glTF 2.0: " + short_words(error),
        "put its buffers next to it, or check it with the glTF validator and export it again");
  }
  SourceModel model;
  model.name = std::filesystem::path(path).stem().string();
  model.up = {UpAxis::kY, UpReason::kStandard};
  const auto note_file = [&](const std::string& uri) {
    if (!uri.empty() && !tinygltf::IsDataURI(uri)) model.files.push_back(folder + uri);
  };
  for (const tinygltf::Buffer& buffer : gltf.buffers) note_file(buffer.uri);
  for (const tinygltf::Image& image : gltf.images) note_file(image.uri);
  use_metallic_roughness(gltf);
  std::vector<MetalMap> metal_maps;
  model.materials =
      gltf_materials(gltf, place, path, model.diagnostics, metal_maps, model.account.images);
  SceneReader scene(gltf, model, path, options.clips);
  MODAR_TRY(scene.run());
  apply_metal_maps(metal_maps, path, model);
  const std::size_t still = model.movement.clips.empty() ? gltf.animations.size() : 0;
  report_left_out(gltf, still, scene.left_out(), path, model.diagnostics);
  scene.account();
  if (model.corner_positions.empty()) {
    return fail(ExitCode::kInvalidInput, "gltf.no-faces", path, "it contains no triangles",
                "export a mesh in its default scene");
  }
  return model;
}

}  // namespace modar
