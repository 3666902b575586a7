// The general weld: polygons, seams, missing and made normals.
#include <algorithm>
#include <vector>

#include "bake/mesh/weld/normal_maker.hpp"
#include "bake/mesh/weld/triangulate.hpp"
#include "bake/mesh/weld/vertex_weld.hpp"
#include "bake/mesh/weld/weld_steps.hpp"

namespace modar {
namespace {

/// Marks the number of a made normal in a vertex key; source normals stay below it.
constexpr std::uint32_t kMade = 0x80000000u;

/// Runs over the faces once: triangulates, drops, gathers normals, welds.
class Welder {
 public:
  Welder(SourceModel& source, TriMesh& mesh, WeldCounts& counts)
      : source_(source), mesh_(mesh), counts_(counts), weld_(source.positions.size()) {}

  void run() {
    const std::size_t faces = source_.face_count();
    // One triangle a face, two less than corners in all: exact but for what is dropped.
    const std::size_t triangles = source_.corner_count() - 2 * faces;
    mesh_.triangles.reserve(triangles);
    mesh_.triangle_material.reserve(triangles);
    RunCursor materials(source_.material_runs);
    RunCursor smoothing(source_.smoothing_runs);
    for (std::size_t f = 0; f < faces; ++f) {
      material_ = materials.at(f);
      smoothing_ = smoothing.at(f);
      face(f);
    }
  }

  /// Fills the mesh's vertex arrays, freeing the source's as it goes.
  void finish() {
    weld_.finish();
    source_.corner_positions.release();
    source_.corner_uvs.own.release();
    source_.corner_normals.own.release();
    source_.first_corner.release();
    const Array<Corner>& keys = weld_.keys();
    const std::size_t count = keys.size();
    mesh_.normals.resize(count);
    fill_normals(keys);
    source_.normals.release();
    fill_uvs(keys);
    source_.uvs.release();
    mesh_.source_positions.resize(count);
    for (std::size_t v = 0; v < count; ++v) mesh_.source_positions[v] = keys[v].position;
    if (!source_.colours.empty()) {
      mesh_.colours.resize(count);
      for (std::size_t v = 0; v < count; ++v) {
        mesh_.colours[v] = byte_colour(source_.colours[keys[v].position]);
      }
    }
    mesh_.positions.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
      mesh_.positions[v] = source_.positions[keys[v].position];
    }
    source_.positions.release();
    source_.colours.release();
  }

 private:
  void fill_normals(const Array<Corner>& keys) {
    const Array<glm::dvec3> made = normals_.take_normals();
    counts_.made_normals = made.size();
    for (std::size_t v = 0; v < keys.size(); ++v) {
      const std::uint32_t n = keys[v].normal;
      mesh_.normals[v] =
          (n & kMade) != 0 ? glm::vec3(made[n & ~kMade]) : glm::normalize(source_.normals[n]);
    }
  }

  void fill_uvs(const Array<Corner>& keys) {
    const bool any =
        std::any_of(keys.begin(), keys.end(), [](const Corner& key) { return key.uv != kNoIndex; });
    if (!any) return;
    mesh_.uvs.resize(keys.size());
    for (std::size_t v = 0; v < keys.size(); ++v) {
      const std::uint32_t uv = keys[v].uv;
      mesh_.uvs[v] = image_uv(uv == kNoIndex ? glm::dvec2(0.0) : source_.uvs[uv]);
    }
  }

  void face(std::size_t f) {
    const std::size_t first = source_.face_first(f);
    const std::size_t count = source_.face_size(f);
    flat_ = kNoIndex;
    if (count == 3) {
      triangle(first, {0, 1, 2});
      return;
    }
    polygon_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      polygon_.push_back(source_.positions[source_.corner_positions[first + i]]);
    }
    triangles_.clear();
    if (!triangulate(polygon_, triangles_)) ++counts_.tangled;
    for (const auto& t : triangles_) triangle(first, t);
  }

  void triangle(std::size_t first, const std::array<std::uint32_t, 3>& t) {
    std::array<Corner, 3> corners;
    std::array<glm::dvec3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = source_.corner(first + t[i]);
      p[i] = source_.positions[corners[i].position];
    }
    const glm::dvec3 area = area_vector(p[0], p[1], p[2]);
    if (!is_finite(area)) {
      ++counts_.not_finite;
      return;
    }
    if (area == glm::dvec3(0.0)) {
      ++counts_.flat;
      return;
    }
    std::array<std::uint32_t, 3> out{};
    for (std::size_t i = 0; i < 3; ++i) {
      Corner& key = corners[i];
      if (!has_normal(key)) {
        const std::uint32_t node = normal_node(key.position);
        normals_.add(node, area, p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
        key.normal = kMade | node;
      }
      out[i] = weld_.vertex(key);
    }
    mesh_.triangles.push_back(out);
    mesh_.triangle_material.push_back(material_);
  }

  bool has_normal(const Corner& corner) {
    if (corner.normal == kNoIndex) return false;
    if (has_direction(source_.normals[corner.normal])) return true;
    ++counts_.bad_normals;
    return false;
  }

  std::uint32_t normal_node(std::uint32_t position) {
    if (smoothing_ != 0) return normals_.node(position, smoothing_, source_.positions.size());
    if (flat_ == kNoIndex) flat_ = normals_.flat_node();
    return flat_;
  }

  SourceModel& source_;
  TriMesh& mesh_;
  WeldCounts& counts_;
  VertexWeld weld_;
  NormalMaker normals_;
  std::uint32_t material_ = 0;
  std::uint32_t smoothing_ = 0;
  std::uint32_t flat_ = kNoIndex;  // the normal of the face at hand, where it is flat
  std::vector<glm::dvec3> polygon_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

}  // namespace

void weld_any(SourceModel& source, TriMesh& mesh, WeldCounts& counts) {
  Welder welder(source, mesh, counts);
  welder.run();
  if (!mesh.triangles.empty()) welder.finish();
}

}  // namespace modar
