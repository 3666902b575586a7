// Checked access to the arrays of a glTF file: bounds first, then bytes.
#pragma once

#include <cstddef>
#include <vector>

namespace tinygltf {
class Model;
}

namespace modar {

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

}  // namespace modar
