// A model as the second reader reads it: what its program hands to the checker.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/image/image.hpp"
#include "formats/sections.hpp"

namespace modar {

/// Colours are sRGB, 0 to 1.
struct SecondMaterial {
  glm::dvec4 colour{229.0 / 255, 229.0 / 255, 229.0 / 255, 1};
  glm::dvec3 emission{0};
  TextureWrap wrap = kWrapRepeat;
  RgbaImage picture;  ///< without pixels: none
};

struct SecondCorner {
  glm::dvec3 position{0};  ///< source units
  glm::dvec3 normal{0};    ///< unit length
  glm::dvec2 uv{0};        ///< v down
  glm::dvec3 colour{1};
};

/// A polygon that is not flat: any triangulation of it is right, and its triangles are one.
struct SecondPolygon {
  std::uint32_t first_triangle = 0;  ///< of two less than corners
  std::uint32_t first_corner = 0;
  std::uint32_t corners = 0;
};

struct SecondModel {
  bool knows_colours = true;  ///< false: the file states some that this reader does not know
  std::vector<std::array<SecondCorner, 3>> triangles;
  std::vector<std::uint32_t> triangle_material;
  std::vector<SecondPolygon> polygons;
  std::vector<SecondCorner> polygon_corners;
  std::vector<SecondMaterial> materials;
};

/// The program's output. Its reader is the same version: the bytes are checked for their length
/// alone.
std::string write_second(const SecondModel& model);
/// False where the bytes end early.
bool read_second(const std::string& bytes, SecondModel& model);

}  // namespace modar
