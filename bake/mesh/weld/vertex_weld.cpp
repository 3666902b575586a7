// New vertices, and positions that have very many of them.
#include "bake/mesh/weld/vertex_weld.hpp"

namespace modar {
namespace {

std::uint64_t attributes_of(const Corner& c) {
  return (std::uint64_t{c.uv} << 32) | c.normal;
}

}  // namespace

std::uint32_t VertexWeld::add(const Corner& key) {
  const auto v = static_cast<std::uint32_t>(keys_.size());
  keys_.push_back(key);
  next_.push_back(first_[key.position]);
  first_[key.position] = v;
  return v;
}

std::uint32_t VertexWeld::from_hub(const Corner& key) {
  // Only looked up, so the hash's order shows nowhere.
  auto& hub = hubs_[key.position];
  if (hub.empty()) {
    for (std::uint32_t v = first_[key.position]; v != kNoIndex; v = next_[v]) {
      hub.emplace(attributes_of(keys_[v]), v);
    }
  }
  const auto [at, fresh] = hub.try_emplace(attributes_of(key), 0);
  if (fresh) at->second = add(key);
  return at->second;
}

}  // namespace modar
