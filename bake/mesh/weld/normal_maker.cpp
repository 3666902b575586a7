// Sums of face normals by position and smoothing group.
#include "bake/mesh/weld/normal_maker.hpp"

#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

namespace modar {

void NormalMaker::reset(std::size_t count) {
  first_.release();
  next_.release();
  group_.release();
  sums_.assign(count, glm::dvec3(0.0));
}

std::uint32_t NormalMaker::node(std::uint32_t position, std::uint32_t group,
                                std::size_t position_count) {
  if (first_.empty()) first_.assign(position_count, kNoIndex);
  for (std::uint32_t n = first_[position]; n != kNoIndex; n = next_[n]) {
    if (group_[n] == group) return n;
  }
  const std::uint32_t n = flat_node();
  next_[n] = first_[position];
  group_[n] = group;
  first_[position] = n;
  return n;
}

std::uint32_t NormalMaker::flat_node() {
  sums_.push_back(glm::dvec3(0.0));
  next_.push_back(kNoIndex);
  group_.push_back(0);
  return static_cast<std::uint32_t>(sums_.size() - 1);
}

void NormalMaker::add(std::uint32_t node, const glm::dvec3& cross, const glm::dvec3& a,
                      const glm::dvec3& b, const glm::dvec3& c) {
  const double angle = std::atan2(glm::length(cross), glm::dot(b - a, c - a));
  sums_[node] += cross * angle;
}

Array<glm::dvec3> NormalMaker::take_normals() {
  for (glm::dvec3& n : sums_) {
    const double length = glm::length(n);
    n = length > 0 && std::isfinite(length) ? n / length : glm::dvec3(0, 0, 1);
  }
  return std::move(sums_);
}

}  // namespace modar
