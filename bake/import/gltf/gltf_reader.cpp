// Reads glTF: walks the scene and gathers its primitives.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include "bake/import/gltf/gltf_materials.hpp"
#include "bake/import/gltf/gltf_meshopt.hpp"
#include "bake/import/gltf/gltf_pictures.hpp"
#include "bake/import/gltf/tinygltf_library.hpp"
#include "bake/import/read_model.hpp"
#include "bake/input.hpp"

namespace modar {
namespace {

// Checked access to arrays: bounds first, then bytes.

/// Elements of one accessor as doubles. Checks every bound: tinygltf checks none.
class GltfAccessor {
 public:
  /// Returns false where the accessor does not exist or exceeds its buffer. Without a buffer view
  /// all elements are zero, as the specification has it; elements of a sparse accessor replace
  /// them.
  bool open(const tinygltf::Model& gltf, int index);

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] std::size_t components() const { return components_; }
  /// element < size(), component < components(). Normalised integers become [0,1] or [-1,1].
  [[nodiscard]] double at(std::size_t element, std::size_t component) const;

 private:
  bool replace_sparse(const tinygltf::Model& gltf, int index);

  const unsigned char* bytes_ = nullptr;
  std::size_t count_ = 0;
  std::size_t components_ = 0;
  std::size_t stride_ = 0;
  std::size_t size_ = 0;  // of a component
  int type_ = 0;
  bool normalised_ = false;
  std::vector<double> replaced_;  // all elements, where some are sparse
};

/// Elements without a buffer behind them: a file of a few bytes could ask for any number. Set by
/// hand: far above real files, 384 MiB of normals at most.
constexpr std::size_t kMostUnbacked = std::size_t{1} << 24;

template <class T>
double load(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

/// `count` elements of `element` bytes each, `stride` apart (0: the view's own, or none); nullptr
/// where they exceed their buffer.
const unsigned char* place(const tinygltf::Model& gltf, int index, std::size_t offset,
                           std::size_t count, std::size_t element, std::size_t& stride) {
  if (index < 0 || static_cast<std::size_t>(index) >= gltf.bufferViews.size()) return nullptr;
  const tinygltf::BufferView& view = gltf.bufferViews[static_cast<std::size_t>(index)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= gltf.buffers.size()) {
    return nullptr;
  }
  const std::vector<unsigned char>& data = gltf.buffers[static_cast<std::size_t>(view.buffer)].data;
  if (stride == 0) stride = view.byteStride == 0 ? element : view.byteStride;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset ||
      stride < element || stride > 65536 || offset > view.byteLength) {
    return nullptr;
  }
  const std::size_t room = view.byteLength - offset;
  if (count != 0 && (room < element || (count - 1) > (room - element) / stride)) return nullptr;
  return data.data() + view.byteOffset + offset;
}

bool GltfAccessor::open(const tinygltf::Model& gltf, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= gltf.accessors.size()) return false;
  const tinygltf::Accessor& accessor = gltf.accessors[static_cast<std::size_t>(index)];
  const int components =
      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  const int size =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  if (components <= 0 || size <= 0) return false;
  count_ = accessor.count;
  components_ = static_cast<std::size_t>(components);
  size_ = static_cast<std::size_t>(size);
  type_ = accessor.componentType;
  normalised_ = accessor.normalized;
  bytes_ = nullptr;
  stride_ = 0;
  replaced_.clear();
  if (accessor.bufferView >= 0) {
    bytes_ =
        place(gltf, accessor.bufferView, accessor.byteOffset, count_, components_ * size_, stride_);
    if (bytes_ == nullptr) return false;
  }
  if (bytes_ == nullptr && count_ > kMostUnbacked) return false;
  return !accessor.sparse.isSparse || replace_sparse(gltf, index);
}

bool GltfAccessor::replace_sparse(const tinygltf::Model& gltf, int index) {
  const auto& sparse = gltf.accessors[static_cast<std::size_t>(index)].sparse;
  const int index_size =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(sparse.indices.componentType));
  if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > count_ || index_size <= 0 ||
      sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 || count_ > kMostUnbacked) {
    return false;
  }
  GltfAccessor indices;
  indices.count_ = static_cast<std::size_t>(sparse.count);
  indices.components_ = 1;
  indices.size_ = indices.stride_ = static_cast<std::size_t>(index_size);
  indices.type_ = sparse.indices.componentType;
  indices.bytes_ =
      place(gltf, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset),
            indices.count_, indices.size_, indices.stride_);
  GltfAccessor values(*this);
  values.count_ = indices.count_;
  values.stride_ = components_ * size_;
  values.bytes_ =
      place(gltf, sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset),
            values.count_, values.stride_, values.stride_);
  if (indices.bytes_ == nullptr || values.bytes_ == nullptr) return false;
  std::vector<double> all(count_ * components_);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = at(i / components_, i % components_);
  for (std::size_t i = 0; i < indices.count_; ++i) {
    const double element = indices.at(i, 0);
    if (!(element >= 0 && element < static_cast<double>(count_))) return false;
    for (std::size_t c = 0; c < components_; ++c) {
      all[static_cast<std::size_t>(element) * components_ + c] = values.at(i, c);
    }
  }
  replaced_ = std::move(all);
  return true;
}

double GltfAccessor::at(std::size_t element, std::size_t component) const {
  if (!replaced_.empty()) return replaced_[element * components_ + component];
  if (bytes_ == nullptr) return 0.0;
  const unsigned char* const place = bytes_ + element * stride_ + component * size_;
  switch (type_) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return normalised_ ? std::max(load<std::int8_t>(place) / 127.0, -1.0)
                         : load<std::int8_t>(place);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<std::uint8_t>(place) / (normalised_ ? 255.0 : 1.0);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return normalised_ ? std::max(load<std::int16_t>(place) / 32767.0, -1.0)
                         : load<std::int16_t>(place);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(place) / (normalised_ ? 65535.0 : 1.0);
    case TINYGLTF_COMPONENT_TYPE_INT:
      return load<std::int32_t>(place);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return load<std::uint32_t>(place);
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
      return load<double>(place);
    default:
      return load<float>(place);
  }
}

// The scene.

constexpr int kMaxDepth = 1000;  ///< of nodes; keeps recursion within a small stack, set by hand

/// What is counted while the scene is read, and left out of the model.
struct LeftOut {
  std::size_t lines_and_points = 0;  ///< primitives
  std::size_t morphs = 0;            ///< primitives with targets
  std::size_t second_uvs = 0;        ///< primitives
};

class SceneReader {
 public:
  SceneReader(const tinygltf::Model& gltf, SourceModel& model, std::string label)
      : gltf_(gltf), model_(model), label_(std::move(label)), seen_(gltf.nodes.size()) {}

  [[nodiscard]] const LeftOut& left_out() const { return left_out_; }

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

  static glm::dmat4 transform_of(const tinygltf::Node& node) {
    glm::dmat4 m(1.0);
    if (node.matrix.size() == 16) {
      for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
      return m;
    }
    if (node.rotation.size() == 4) {
      m = glm::mat4_cast(
          glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]));
    }
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (node.scale.size() == 3) m[i] *= node.scale[k];
      if (node.translation.size() == 3) m[3][i] = node.translation[k];
    }
    return m;
  }

  Result<void> walk(int index, const glm::dmat4& parent, int depth) {
    if (index < 0 || static_cast<std::size_t>(index) >= gltf_.nodes.size() || depth > kMaxDepth ||
        seen_[static_cast<std::size_t>(index)]) {
      return wrong("gltf.read", "its nodes refer to nodes that are not there, or meet twice");
    }
    seen_[static_cast<std::size_t>(index)] = true;
    const tinygltf::Node& node = gltf_.nodes[static_cast<std::size_t>(index)];
    const glm::dmat4 to_scene = parent * transform_of(node);
    if (node.skin >= 0) ++skins_;
    if (node.mesh >= 0 && static_cast<std::size_t>(node.mesh) < gltf_.meshes.size()) {
      for (const auto& primitive : gltf_.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
        MODAR_TRY(add_primitive(primitive, to_scene));
      }
    }
    for (const int child : node.children) MODAR_TRY(walk(child, to_scene, depth + 1));
    return {};
  }

  /// Opens an optional attribute; false if it is present and broken.
  bool open(const tinygltf::Primitive& primitive, const std::string& name, std::size_t count,
            std::size_t least_components, GltfAccessor& accessor, bool& there) const {
    const auto found = primitive.attributes.find(name);
    there = found != primitive.attributes.end();
    return !there || (accessor.open(gltf_, found->second) && accessor.size() >= count &&
                      accessor.components() >= least_components);
  }

  Result<void> add_primitive(const tinygltf::Primitive& primitive, const glm::dmat4& to_scene) {
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES) {
      ++left_out_.lines_and_points;
      return {};
    }
    if (!primitive.targets.empty()) ++left_out_.morphs;
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
      return wrong("gltf.accessor", "an accessor leaves its buffer, or has no sense");
    }
    if (!there) return {};
    if (model_.positions.size() + positions.size() >= kNoIndex) {
      return wrong("gltf.read", "it has more vertices than 32 bits count");
    }
    const auto first = static_cast<std::uint32_t>(model_.positions.size());
    const glm::dmat3 turn = glm::transpose(glm::inverse(glm::dmat3(to_scene)));
    for (std::size_t v = 0; v < positions.size(); ++v) {
      model_.positions.push_back(glm::dvec3(to_scene * glm::dvec4(vector(positions, v), 1.0)));
      model_.normals.push_back(has_normals ? glm::vec3(turn * vector(normals, v)) : glm::vec3(0));
      // SourceModel has OBJ's convention: v points up.
      const glm::dvec2 uv =
          has_uvs ? placing.apply({uvs.at(v, 0), uvs.at(v, 1)}) : glm::dvec2(0.0, 1.0);
      model_.uvs.push_back({uv.x, 1.0 - uv.y});
      glm::vec3 colour(1.0f);
      for (int i = 0; has_colours && i < 3; ++i) {
        colour[i] = static_cast<float>(srgb_of_linear(colours.at(v, static_cast<std::size_t>(i))));
      }
      model_.colours.push_back(colour);
    }
    any_colours_ = any_colours_ || has_colours;
    begin_material(primitive.material);
    return add_triangles(primitive, mode, first, positions.size(),
                         glm::determinant(glm::dmat3(to_scene)) < 0, has_uvs, has_normals);
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
      return wrong("gltf.accessor", "the indices of a primitive leave their buffer");
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
    compact(model_.corner_positions, model_.corner_uvs);
    compact(model_.corner_positions, model_.corner_normals);
    if (!any_colours_) model_.colours.release();
    // The specification: faces without normals are flat-shaded.
    model_.smoothing_runs = {{0, 0}};
    if (skins_ == 0) return;
    model_.diagnostics.push_back(
        {"gltf.skin", DiagnosticSeverity::kWarning, label_, 0,
         std::to_string(skins_) + " skinned nodes are baked in the pose of their nodes", ""});
  }

  const tinygltf::Model& gltf_;
  SourceModel& model_;
  std::string label_;
  std::vector<bool> seen_;  // nodes: glTF's are trees
  bool any_colours_ = false;
  LeftOut left_out_;
  std::uint64_t skins_ = 0;
};

/// Reads a whole file; false where it cannot be read.
bool read_bytes(const std::string& path, std::string& bytes) {
  if (!is_regular_file(path)) return false;
  std::ifstream file(path, std::ios::binary);
  if (!file) return false;
  bytes.assign(std::istreambuf_iterator<char>(file), {});
  return !file.bad();
}

/// Extensions that are read in full; a file that requires others cannot be shown as it is meant.
constexpr const char* kKnownExtensions[] = {"EXT_meshopt_compression",    "EXT_texture_webp",
                                            "KHR_draco_mesh_compression", "KHR_materials_unlit",
                                            "KHR_mesh_quantization",      "KHR_texture_transform"};

bool is_known(const std::string& extension) {
  return std::find(std::begin(kKnownExtensions), std::end(kKnownExtensions), extension) !=
         std::end(kKnownExtensions);
}

/// Refuses glTF 1.0 and required extensions that are not read. gltf: may be half read.
Result<void> require_support(const tinygltf::Model& gltf, std::string_view bytes,
                             const std::string& path) {
  const bool old_binary = bytes.starts_with("glTF") && bytes.size() > 4 && bytes[4] == 1;
  if (old_binary || gltf.asset.version.starts_with("1")) {
    return fail(ExitCode::kUnsupported, "gltf.version", path, "this is glTF 1.0",
                "convert it to glTF 2.0, for instance with Blender or gltf-pipeline");
  }
  std::string unknown;
  for (const std::string& extension : gltf.extensionsRequired) {
    if (!is_known(extension)) unknown += (unknown.empty() ? "" : ", ") + extension;
  }
  if (unknown.empty()) return {};
  return fail(ExitCode::kUnsupported, "gltf.extension", path,
              "it requires extensions that are not read: " + unknown,
              "export it without them (meshes uncompressed or by Draco, textures as PNG, JPEG or "
              "WebP)");
}

/// What of the file no bundle holds, as one finding.
void report_left_out(const tinygltf::Model& gltf, const LeftOut& counts, const std::string& label,
                     std::vector<Diagnostic>& diagnostics) {
  std::string words;
  const auto add = [&words](std::size_t count, const char* one, const char* many) {
    if (count == 0) return;
    words += (words.empty() ? "" : ", ") + std::to_string(count) + " " + (count == 1 ? one : many);
  };
  const auto normal_maps = static_cast<std::size_t>(
      std::count_if(gltf.materials.begin(), gltf.materials.end(),
                    [](const auto& material) { return material.normalTexture.index >= 0; }));
  add(gltf.animations.size(), "animation", "animations");
  add(counts.morphs, "set of morph targets", "sets of morph targets");
  add(normal_maps, "normal map", "normal maps");
  add(counts.second_uvs, "second uv set", "second uv sets");
  add(counts.lines_and_points, "primitive of lines or points", "primitives of lines or points");
  add(gltf.cameras.size(), "camera", "cameras");
  std::string extensions;
  for (const std::string& extension : gltf.extensionsUsed) {
    if (!is_known(extension)) extensions += (extensions.empty() ? "" : ", ") + extension;
  }
  if (!extensions.empty()) words += (words.empty() ? "" : ", ") + ("extensions " + extensions);
  if (words.empty()) return;
  const bool shows = !gltf.animations.empty() || counts.morphs + counts.lines_and_points != 0;
  diagnostics.push_back({"gltf.left-out",
                         shows ? DiagnosticSeverity::kWarning : DiagnosticSeverity::kInfo, label, 0,
                         "left out: " + words, ""});
}

// How tinygltf reads the files that a model names: regular ones, under the names as they stand.

bool regular_file(const std::string& path, void*) {
  return is_regular_file(path);
}

std::string plain_path(const std::string& path, void*) {
  return path;
}

bool read_buffer(std::vector<unsigned char>* bytes, std::string* error, const std::string& path,
                 void*) {
  std::string read;
  if (!read_bytes(path, read)) {
    *error += "cannot read " + path;
    return false;
  }
  bytes->assign(read.begin(), read.end());
  return true;
}

}  // namespace

Result<SourceModel> read_gltf(const std::string& path) {
  std::string bytes;
  if (!read_bytes(path, bytes)) {
    return fail(ExitCode::kIo, "gltf.open", path, "the file cannot be read", "check its name");
  }
  const std::string parent = std::filesystem::path(path).parent_path().string();
  const std::string folder = (parent.empty() ? "." : parent) + "/";
  MODAR_ASSIGN(bytes, decode_meshopt_views(std::move(bytes), folder, path));
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_image_bytes, nullptr);
  loader.SetFsCallbacks({regular_file, plain_path, read_buffer, nullptr, nullptr});
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
    return fail(
        ExitCode::kInvalidInput, "gltf.read", path, "it cannot be read as glTF 2.0: " + error,
        "put its buffers beside it, or check it with the glTF validator and export it again");
  }
  SourceModel model;
  model.name = std::filesystem::path(path).stem().string();
  model.up = {UpAxis::kY, UpReason::kStandard};
  const auto note_file = [&](const std::string& uri) {
    if (!uri.empty() && !tinygltf::IsDataURI(uri)) model.files.push_back(folder + uri);
  };
  for (const tinygltf::Buffer& buffer : gltf.buffers) note_file(buffer.uri);
  for (const tinygltf::Image& image : gltf.images) note_file(image.uri);
  model.materials = gltf_materials(gltf, folder, path, model.diagnostics);
  SceneReader scene(gltf, model, path);
  MODAR_TRY(scene.run());
  report_left_out(gltf, scene.left_out(), path, model.diagnostics);
  if (model.corner_positions.empty()) {
    return fail(ExitCode::kInvalidInput, "gltf.no-faces", path, "it shows no triangles",
                "export a mesh in its default scene");
  }
  return model;
}

}  // namespace modar
