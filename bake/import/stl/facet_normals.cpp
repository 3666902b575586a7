#include "bake/import/stl/facet_normals.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Cosine of 40 degrees: edges of cylinders with 9 sides and more are round, those of a hexagon
/// sharp. CAD programs ask for 20 to 45.
constexpr double kCrease = 0.766;
/// Around one position: beyond, all are taken as one smooth fan, which bounds the time.
constexpr std::uint32_t kMostCompared = 256;

/// The facets around each position.
struct Fans {
  std::vector<std::uint32_t> first;   ///< positions + 1 entries
  std::vector<std::uint32_t> facets;  ///< numbers of triangles
};

Fans fans_of(const SourceModel& model) {
  Fans fans;
  fans.first.assign(model.positions.size() + 1, 0);
  for (const std::uint32_t p : model.corner_positions) ++fans.first[p + 1];
  for (std::size_t p = 1; p < fans.first.size(); ++p) fans.first[p] += fans.first[p - 1];
  std::vector<std::uint32_t> next(fans.first.begin(), fans.first.end() - 1);
  fans.facets.resize(model.corner_count());
  for (std::size_t c = 0; c < model.corner_count(); ++c) {
    fans.facets[next[model.corner_positions[c]]++] = static_cast<std::uint32_t>(c / 3);
  }
  return fans;
}

glm::dvec3 area_vector(const SourceModel& model, std::size_t facet) {
  const glm::dvec3& a = model.positions[model.corner_positions[3 * facet]];
  const glm::dvec3& b = model.positions[model.corner_positions[3 * facet + 1]];
  const glm::dvec3& c = model.positions[model.corner_positions[3 * facet + 2]];
  return glm::cross(b - a, c - a);
}

}  // namespace

void add_facet_normals(SourceModel& model) {
  const Fans fans = fans_of(model);
  std::vector<glm::dvec3> vectors(model.face_count());
  for (std::size_t f = 0; f < vectors.size(); ++f) vectors[f] = area_vector(model, f);
  model.corner_normals.kind = IndexPlane::Kind::kOwn;
  model.corner_normals.own.resize(model.corner_count());
  std::vector<glm::dvec3> sums;        // different ones at this position
  std::vector<std::uint32_t> indices;  // of their normals
  for (std::size_t p = 0; p < model.positions.size(); ++p) {
    sums.clear();
    indices.clear();
    const bool smooth = fans.first[p + 1] - fans.first[p] > kMostCompared;
    glm::dvec3 whole(0.0);
    for (std::uint32_t k = fans.first[p]; smooth && k < fans.first[p + 1]; ++k) {
      whole += vectors[fans.facets[k]];
    }
    for (std::uint32_t i = fans.first[p]; i < fans.first[p + 1]; ++i) {
      const glm::dvec3& own = vectors[fans.facets[i]];
      glm::dvec3 sum = whole;
      for (std::uint32_t k = fans.first[p]; !smooth && k < fans.first[p + 1]; ++k) {
        const glm::dvec3& other = vectors[fans.facets[k]];
        if (glm::dot(own, other) >=
            kCrease * std::sqrt(glm::dot(own, own) * glm::dot(other, other)))
          sum += other;
      }
      auto known =
          static_cast<std::size_t>(std::find(sums.begin(), sums.end(), sum) - sums.begin());
      if (known == sums.size()) {
        const double length = glm::length(sum);
        sums.push_back(sum);
        indices.push_back(static_cast<std::uint32_t>(model.normals.size()));
        model.normals.push_back(length > 0 ? glm::vec3(sum / length) : glm::vec3(0, 0, 1));
      }
      const std::size_t facet = fans.facets[i];
      for (std::size_t c = 3 * facet; c < 3 * facet + 3; ++c) {
        if (model.corner_positions[c] == p) model.corner_normals.own[c] = indices[known];
      }
    }
  }
}

}  // namespace modar
