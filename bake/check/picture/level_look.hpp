// Levels of detail compared with the finest one, as the renderer draws both.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/renderer.hpp"

namespace modar {

inline constexpr std::size_t kViews = 12;
inline constexpr double kViewDistance = 4.0;  ///< of the eye from the middle of a model in [-1,1]

/// From the 12 corners of an icosahedron, not of unit length.
std::array<glm::dvec3, kViews> view_directions();
/// Model space to that of an eye at kViewDistance in a direction.
glm::dmat4 view_from(const glm::dvec3& direction);

/// A level where it is first drawn: as large as all chunks that have it show it, or a coarser one.
struct LevelLook {
  std::uint32_t level = 0;      ///< from 1 on; those of proxies follow those of chunks
  double side_px = 0;           ///< diameter of the sphere around the model, mean of the views
  std::uint64_t triangles = 0;  ///< drawn, mean of the views
  std::uint64_t finest_triangles = 0;
  /// 99th percentile of the greatest difference of a channel, of 255, over pixels that show nothing
  /// but the model. Both pictures are drawn larger and averaged, so that what twinkles under few
  /// samples a pixel is not counted as a difference: of a scan of 0.85 million triangles, 11 pixels
  /// wide, 5.5 of 255 with 16 samples a pixel, 1.1 with 2,000 and with 8,000.
  double difference = 0;
  double difference_mean = 0;  ///< the same, in the mean
};

struct LevelLookOptions {
  int side = 512;           ///< of a view, pixels, at most
  float lod_pixels = 1.0f;  ///< as RenderOptions has it
  int samples = 1024;       ///< of a picture along a side, about; 4 of a pixel at least
};

/// Draws a model at each of its levels, and at the finest, from 12 sides. Errors: kUnsupported
/// "gl.framebuffer".
Result<std::vector<LevelLook>> look_at_levels(const BundleView& bundle, Renderer& renderer,
                                              std::uint32_t model, const LevelLookOptions& options);

}  // namespace modar
