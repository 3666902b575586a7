#include "bake/import/gltf/gltf_accessor.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "bake/import/gltf/tinygltf_library.hpp"

namespace modar {
namespace {

/// Elements without a buffer behind them: a file of a few bytes could ask for any number. Far
/// above real files, 384 MiB of normals at most.
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

}  // namespace

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

}  // namespace modar
