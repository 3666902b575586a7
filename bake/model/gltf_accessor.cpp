// Bounds first, then bytes.
#include "bake/model/gltf_accessor.hpp"

#include <algorithm>
#include <cstring>

#include "bake/model/tinygltf_library.hpp"

namespace modar {
namespace {

template <class T>
double load(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

}  // namespace

bool GltfAccessor::open(const tinygltf::Model& gltf, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= gltf.accessors.size()) return false;
  const tinygltf::Accessor& accessor = gltf.accessors[static_cast<std::size_t>(index)];
  const int components =
      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  const int size =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  if (components <= 0 || size <= 0 || accessor.sparse.isSparse) return false;
  count_ = accessor.count;
  components_ = static_cast<std::size_t>(components);
  size_ = static_cast<std::size_t>(size);
  type_ = accessor.componentType;
  normalised_ = accessor.normalized;
  bytes_ = nullptr;
  if (accessor.bufferView < 0) return true;
  if (static_cast<std::size_t>(accessor.bufferView) >= gltf.bufferViews.size()) return false;
  const tinygltf::BufferView& view =
      gltf.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= gltf.buffers.size()) return false;
  const std::vector<unsigned char>& data = gltf.buffers[static_cast<std::size_t>(view.buffer)].data;
  const std::size_t element = components_ * size_;
  stride_ = view.byteStride == 0 ? element : view.byteStride;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset ||
      stride_ < element || stride_ > 65536 || accessor.byteOffset > view.byteLength) {
    return false;
  }
  const std::size_t room = view.byteLength - accessor.byteOffset;
  if (count_ != 0 && (room < element || (count_ - 1) > (room - element) / stride_)) return false;
  bytes_ = data.data() + view.byteOffset + accessor.byteOffset;
  return true;
}

double GltfAccessor::at(std::size_t element, std::size_t component) const {
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

}  // namespace modar
