// A small path tracer: what a model on a pattern looks like under a room's light. The reference of
// `modar-lab bench light`. Internal to bake/extensions/lab.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "bake/check/picture/reference_renderer.hpp"
#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "bake/mesh/tri_mesh.hpp"
#include "modar/camera.hpp"
#include "modar/renderer.hpp"

namespace modar {

/// The plane z = 0, diffuse: a printed picture in its middle, and a table around that.
struct TracedGround {
  SoftTexture print;
  double half_width = 1;  ///< of the print; its top looks to +y
  double half_height = 1;
  glm::dvec3 table{0.3};  ///< albedo, linear
};

struct TracedScene {
  const TriMesh& mesh;
  const std::vector<SoftTexture>& textures;  ///< one a material
  glm::dmat4 place{1.0};                     ///< mesh space to the pattern's world (z up)
  RoomLight light;
  TracedGround ground;
  /// The room as a panorama (see read_light()): what paths see in place of the light, with as much
  /// light on a white surface that looks up. Null: the light itself.
  const LinearImage* room = nullptr;
};

/// Linear light, top row first.
struct TracedPicture {
  int width = 0;
  int height = 0;
  std::vector<glm::dvec3> pixels;
  std::vector<double>
      model;  ///< the share of each pixel where the model is, even a transparent one
};

/// Follows paths of up to six bounces with cosine-weighted directions: diffuse surfaces, the key
/// light as a disc with shadow rays, Blinn and Phong's highlight of it where the camera looks,
/// reflection of the surroundings by the GGX distribution with Schlick's Fresnel term, and alpha as
/// the share of rays that a surface stops. The sky's radiance is that whose irradiance the
/// coefficients are, without negative parts. Scene and what it refers to outlive the tracer.
class PathTracer {
 public:
  explicit PathTracer(const TracedScene& scene);
  ~PathTracer();
  PathTracer(const PathTracer&) = delete;
  PathTracer& operator=(const PathTracer&) = delete;

  /// to_eye: the pattern's world to GL eye space. samples: paths a pixel. The same on any number of
  /// threads; another seed takes other paths.
  [[nodiscard]] TracedPicture draw(const Camera& camera, const glm::dmat4& to_eye, int samples,
                                   std::uint64_t seed, unsigned jobs) const;
  /// The ground alone, without noise: what a camera sees before a model is drawn into its picture.
  [[nodiscard]] TracedPicture draw_ground(const Camera& camera, const glm::dmat4& to_eye,
                                          int samples, unsigned jobs) const;

 private:
  class Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace modar
