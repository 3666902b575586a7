// Checked access to the arrays of a glTF file. Internal to the glTF reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tinygltf {
class Model;
}  // namespace tinygltf

namespace modar {

/// Elements of one accessor as doubles. tinygltf holds none of its numbers against the buffers.
class GltfAccessor {
 public:
  /// Answers false where the accessor does not exist or leaves its buffer. Without a buffer view
  /// all elements are zero, as glTF has it; those that a sparse accessor lists are then replaced.
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

}  // namespace modar
