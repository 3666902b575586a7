// Counts what a bundle asks of a device.
#include "bake/check/device/device_rules.hpp"

#include <algorithm>
#include <string>

#include "bake/check/verdict.hpp"
#include "formats/memory_share.hpp"
#include "formats/texture_format.hpp"

namespace modar {
namespace {

constexpr std::uint64_t kMebibyte = 1u << 20;
/// Vec4s of shaders/model.vert: projection, place in the scene, light, material.
constexpr int kVertexUniforms = 22;
/// Vec4s of the fragment shaders: opacity, or a camera picture's range and swap.
constexpr int kFragmentUniforms = 2;
constexpr std::uint64_t kDecodedPixelBytes = 3;  ///< RGB8

class DeviceCheck {
 public:
  DeviceCheck(const BundleView& bundle, const DeviceProfile& device, const IssueSink& sink)
      : bundle_(bundle), device_(device), sink_(sink) {
    // OpenGL ES 3 has it in its core.
    half_ = device.es_version >= 30 || device.has_extension("GL_OES_vertex_half_float");
  }

  bool run() {
    for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) check_texture(t);
    for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) check_model(m);
    check_uniforms();
    check_memory();
    return good_;
  }

 private:
  void tell(WorkstationRule rule, std::string where, const void* place, std::string detail) {
    Issue issue;
    issue.kind = &workstation_issue_kind(rule);
    issue.where = std::move(where);
    issue.offset =
        static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - bundle_.bytes().data());
    issue.detail = std::move(detail) + " on " + std::string(device_.name);
    good_ = good_ && issue.kind->severity != Severity::kError;
    sink_(issue);
  }

  [[nodiscard]] std::string label(const char* what, NameRef name) const {
    return what + (" '" + std::string(bundle_.name(name)) + "'");
  }

  void check_texture(std::uint32_t index) {
    const TextureRecord& texture = bundle_.textures()[index];
    const std::string where = label("texture", texture.name);
    const std::uint64_t bytes = bundle_.texture_data(index).size();
    const TextureFormatInfo& format = *find_texture_format(texture.format);
    const bool reads = device_.es_version >= static_cast<int>(format.core_since) ||
                       device_.has_extension(format.gl_extension);
    texture_bytes_ += texture_bytes(bundle_, index, reads);
    const TextureLevelRecord& smallest =
        bundle_.texture_levels()[texture.first_level + texture.level_count - 1];
    const std::uint64_t pixels = std::uint64_t{smallest.width} * smallest.height;
    smallest_bytes_ += (reads ? smallest.size : pixels * kDecodedPixelBytes) *
                       (smallest.alpha_offset == kNoOffset ? 1 : 2);
    if (std::max(texture.width, texture.height) >
        static_cast<std::uint32_t>(device_.max_texture_size)) {
      tell(WorkstationRule::kDeviceTextureSize, where, &texture.width,
           std::to_string(texture.width) + " x " + std::to_string(texture.height) +
               " pixels, at most " + std::to_string(device_.max_texture_size));
    }
    if (!reads) {
      tell(WorkstationRule::kDeviceEtc1, where, &texture.format,
           with_numbers("{} bytes become {}", {bytes, texture_bytes(bundle_, index, false)}));
    }
  }

  void check_model(std::uint32_t index) {
    const ModelRecord& model = bundle_.models()[index];
    const LayoutRecord& layout = bundle_.layouts()[model.layout];
    const std::string where = label("model", model.name);
    if (layout.attribute_count > device_.max_vertex_attributes) {
      tell(WorkstationRule::kDeviceAttributes, where, &layout,
           std::to_string(layout.attribute_count) + " attributes, at most " +
               std::to_string(device_.max_vertex_attributes));
    }
    most_coarse_bytes_ = std::max(most_coarse_bytes_, coarse_bytes(index));
    const std::uint64_t halves = half_bytes(layout);
    if (half_ || halves == 0) return;
    widened_bytes_ += halves * model.vertex_count;
    tell(WorkstationRule::kDeviceHalfFloat, where, &layout,
         std::to_string(halves * model.vertex_count) + " bytes more");
  }

  /// Bytes of a vertex that are half floats.
  static std::uint64_t half_bytes(const LayoutRecord& layout) {
    std::uint64_t bytes = 0;
    for (std::uint32_t a = 0; a < layout.attribute_count; ++a) {
      const AttributeRecord& attribute = layout.attributes[a];
      if (attribute.type == static_cast<std::uint8_t>(ComponentType::kHalf)) {
        bytes += 2ull * attribute.components;
      }
    }
    return bytes;
  }

  /// Vertices and indices of the coarsest level of each chunk, as the device has them; of a model's
  /// proxy that needs least, where it has any.
  [[nodiscard]] std::uint64_t coarse_bytes(std::uint32_t model) const {
    const LayoutRecord& layout = bundle_.layouts()[bundle_.models()[model].layout];
    const std::uint64_t stride = layout.stride + (half_ ? 0 : half_bytes(layout));
    std::uint64_t least = ~std::uint64_t{0};
    for (std::uint32_t g = 0; g < bundle_.chunk_groups(); ++g) {
      const ChunkGroup group = bundle_.chunk_group(g);
      if (group.model != model) continue;
      std::uint64_t bytes = 0;
      for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
        const ChunkRecord& chunk = bundle_.chunks()[c];
        const LevelRecord& level = bundle_.levels()[chunk.first_level + chunk.level_count - 1];
        bytes += std::uint64_t{level.vertex_count} * stride + 2ull * level.index_count;
      }
      least = std::min(least, bytes);
    }
    return least;
  }

  void check_uniforms() {
    if (device_.max_vertex_uniform_vectors >= kVertexUniforms &&
        device_.max_fragment_uniform_vectors >= kFragmentUniforms) {
      return;
    }
    tell(WorkstationRule::kDeviceUniforms, "shaders", bundle_.bytes().data(),
         std::to_string(kVertexUniforms) + " in vertex and " + std::to_string(kFragmentUniforms) +
             " in fragment shaders, at most " + std::to_string(device_.max_vertex_uniform_vectors) +
             " and " + std::to_string(device_.max_fragment_uniform_vectors));
  }

  /// The asset that takes most, so that one knows where to begin.
  [[nodiscard]] std::string largest_asset() const {
    std::uint64_t most = bundle_.vertices().size() + bundle_.indices().size();
    std::string name = "the models' vertices and indices";
    for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
      const std::uint64_t bytes = bundle_.texture_data(t).size();
      if (bytes <= most) continue;
      most = bytes;
      name = label("texture", bundle_.textures()[t].name);
    }
    return name + " with " + std::to_string(most) + " bytes";
  }

  void check_memory() {
    const std::uint64_t gpu =
        bundle_.vertices().size() + widened_bytes_ + bundle_.indices().size() + texture_bytes_;
    const void* first = bundle_.bytes().data();
    const std::uint64_t limit = device_.gpu_memory_mib * kMebibyte;
    if (gpu > limit) {
      // The renderer keeps to the limit: it leaves out the largest mip levels, and the nearest
      // parts get their finest levels first.
      const bool drawn = most_coarse_bytes_ <= geometry_share(texture_bytes_, limit) &&
                         most_coarse_bytes_ + smallest_bytes_ <= limit;
      tell(drawn ? WorkstationRule::kDeviceGpuDetail : WorkstationRule::kDeviceGpuMemory,
           largest_asset(), first, with_numbers("{} bytes in all, at most {}", {gpu, limit}));
    }
    const std::uint64_t file = bundle_.bytes().size();
    if (file > device_.ram_mib * kMebibyte / 2) {
      tell(WorkstationRule::kDeviceRam, largest_asset(), first,
           with_numbers("{} bytes, the memory has {}", {file, device_.ram_mib * kMebibyte}));
    }
    if (file > device_.storage_mib * kMebibyte / 2) {
      tell(WorkstationRule::kDeviceStorage, largest_asset(), first,
           with_numbers("{} bytes, the storage has {}", {file, device_.storage_mib * kMebibyte}));
    }
  }

  const BundleView& bundle_;
  const DeviceProfile& device_;
  const IssueSink& sink_;
  bool half_ = false;
  bool good_ = true;
  std::uint64_t texture_bytes_ = 0;
  std::uint64_t smallest_bytes_ = 0;     ///< of the textures' smallest mip levels
  std::uint64_t most_coarse_bytes_ = 0;  ///< of the model whose coarsest levels take most
  std::uint64_t widened_bytes_ = 0;
};

}  // namespace

bool check_device(const BundleView& bundle, const DeviceProfile& device, const IssueSink& sink) {
  return DeviceCheck(bundle, device, sink).run();
}

}  // namespace modar
