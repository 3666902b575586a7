// Corrects each value by the mean difference around it, several times.
#include "bake/mesh/lod/attribute_fit.hpp"

#include <algorithm>

namespace modar {
namespace {

/// Corrections. Higher is nearer to least squares and slower.
constexpr int kCorrections = 5;

}  // namespace

// Simultaneous iterative reconstruction (Gilbert, "Iterative methods for the three-dimensional
// reconstruction of an object from projections", 1972).
void fit_attributes(std::span<const FitPoint> points, std::span<const glm::vec4> targets,
                    std::span<const std::uint32_t> groups, std::vector<glm::vec4>& values) {
  const std::size_t count =
      groups.empty() ? 0 : 1 + *std::max_element(groups.begin(), groups.end());
  std::vector<glm::vec4> fitted(count);
  for (std::size_t v = 0; v < groups.size(); ++v) fitted[groups[v]] = values[v];
  std::vector<glm::vec4> sums(count);
  std::vector<float> weights(count);
  for (int correction = 0; correction < kCorrections; ++correction) {
    std::fill(sums.begin(), sums.end(), glm::vec4(0.0f));
    std::fill(weights.begin(), weights.end(), 0.0f);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const FitPoint& point = points[i];
      glm::vec4 left = targets[i];
      for (std::size_t k = 0; k < 3; ++k) {
        left -= point.weights[k] * fitted[groups[point.corners[k]]];
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const float weight = point.area * point.weights[k];
        sums[groups[point.corners[k]]] += weight * left;
        weights[groups[point.corners[k]]] += weight;
      }
    }
    for (std::size_t g = 0; g < count; ++g) {
      if (weights[g] > 0) fitted[g] += sums[g] / weights[g];
    }
  }
  for (std::size_t v = 0; v < groups.size(); ++v) values[v] = fitted[groups[v]];
}

}  // namespace modar
