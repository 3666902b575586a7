#include "bake/check/source/second_model.hpp"

#include <cstring>

namespace modar {
namespace {

/// Passes each part of a model to `part`, in the order of the bytes.
template <class Model, class Part>
void visit(Model& model, const Part& part) {
  part(model.knows_colours);
  part(model.triangles);
  part(model.triangle_material);
  part(model.polygons);
  part(model.polygon_corners);
  std::uint64_t materials = model.materials.size();
  part(materials);
  if constexpr (!std::is_const_v<Model>) model.materials.resize(materials);
  for (auto& material : model.materials) {
    part(material.colour);
    part(material.emission);
    part(material.wrap);
    part(material.picture.width);
    part(material.picture.height);
    part(material.picture.pixels);
  }
}

}  // namespace

std::string write_second(const SecondModel& model) {
  std::string bytes;
  const auto put = [&](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  visit(model, [&](const auto& part) {
    if constexpr (requires { part.data(), part.capacity(); }) {
      const std::uint64_t count = part.size();
      put(&count, sizeof count);
      put(part.data(), count * sizeof part[0]);
    } else {
      put(&part, sizeof part);
    }
  });
  return bytes;
}

bool read_second(const std::string& bytes, SecondModel& model) {
  std::size_t at = 0;
  const auto take = [&](void* data, std::size_t size) {
    const bool good = size <= bytes.size() - at;
    if (good && size != 0) std::memcpy(data, bytes.data() + at, size);
    at = good ? at + size : bytes.size();
  };
  bool good = true;
  visit(model, [&](auto& part) {
    if constexpr (requires { part.data(), part.capacity(); }) {
      std::uint64_t count = 0;
      take(&count, sizeof count);
      good = good && count <= (bytes.size() - at) / sizeof part[0];
      part.resize(good ? count : 0);
      take(part.data(), part.size() * sizeof part[0]);
    } else {
      take(&part, sizeof part);
    }
  });
  return good && at == bytes.size() && !model.triangles.empty();
}

}  // namespace modar
