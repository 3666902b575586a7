#include "bake/mesh/repair/triangles.hpp"

#include "bake/mesh/weld/triangulate.hpp"

namespace modar::repair {
namespace {

/// A value a face, of runs.
Array<std::uint32_t> spread(const std::vector<FaceRun>& runs, std::size_t faces) {
  Array<std::uint32_t> values(faces);
  RunCursor cursor(runs);
  for (std::size_t f = 0; f < faces; ++f) values[f] = cursor.at(f);
  return values;
}

std::vector<FaceRun> runs_of(const Array<std::uint32_t>& values) {
  std::vector<FaceRun> runs;
  for (std::size_t f = 0; f < values.size(); ++f) {
    if (f == 0 || values[f] != values[f - 1]) runs.push_back({f, values[f]});
  }
  return runs;
}

/// Stores the index of every corner, which then may differ from its position's.
void own(IndexPlane& plane, const Array<std::uint32_t>& positions) {
  if (plane.kind != IndexPlane::Kind::kSame) return;
  plane.own = positions;
  plane.kind = IndexPlane::Kind::kOwn;
}

/// Calls change(indices) for each index of a corner that the model stores.
template <class Change>
void each_plane(SourceModel& model, const Change& change) {
  change(model.corner_positions);
  if (model.corner_uvs.kind == IndexPlane::Kind::kOwn) change(model.corner_uvs.own);
  if (model.corner_normals.kind == IndexPlane::Kind::kOwn) change(model.corner_normals.own);
}

}  // namespace

Triangles::Triangles(SourceModel& model)
    : model_(model),
      material_(spread(model.material_runs, model.face_count())),
      smoothing_(spread(model.smoothing_runs, model.face_count())) {
  own(model.corner_uvs, model.corner_positions);
  own(model.corner_normals, model.corner_positions);
  if (model.first_corner.empty()) return;
  Array<std::uint32_t> from;  // corners
  Array<std::uint32_t> faces;
  std::vector<glm::dvec3> polygon;
  std::vector<std::array<std::uint32_t, 3>> cut;
  for (std::uint32_t f = 0; f < model.face_count(); ++f) {
    const std::uint32_t first = model.first_corner[f];
    polygon.clear();
    for (std::size_t i = 0; i < model.face_size(f); ++i) {
      polygon.push_back(model.positions[model.corner_positions[first + i]]);
    }
    cut.assign(polygon.size() == 3 ? 1 : 0, {0, 1, 2});
    if (cut.empty()) triangulate(polygon, cut);
    for (const auto& triangle : cut) {
      for (const std::uint32_t i : triangle) from.push_back(first + i);
      faces.push_back(f);
    }
  }
  each_plane(model, [&](Array<std::uint32_t>& indices) {
    Array<std::uint32_t> moved(from);
    for (std::uint32_t& c : moved) c = indices[c];
    indices = std::move(moved);
  });
  for (Array<std::uint32_t>* values : {&material_, &smoothing_}) {
    Array<std::uint32_t> moved(faces);
    for (std::uint32_t& f : moved) f = (*values)[f];
    *values = std::move(moved);
  }
  model.first_corner.release();
}

void Triangles::finish() {
  model_.material_runs = runs_of(material_);
  model_.smoothing_runs = runs_of(smoothing_);
}

void Triangles::keep(const std::vector<bool>& kept) {
  const auto filter = [&](Array<std::uint32_t>& values, std::size_t each) {
    std::size_t to = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (kept[i / each]) values[to++] = values[i];
    }
    values.resize(to);
  };
  each_plane(model_, [&](Array<std::uint32_t>& indices) { filter(indices, 3); });
  filter(material_, 1);
  filter(smoothing_, 1);
}

void Triangles::turn(std::size_t t) {
  each_plane(model_, [&](Array<std::uint32_t>& indices) {
    std::swap(indices[3 * t + 1], indices[3 * t + 2]);
  });
  if (model_.corner_normals.kind != IndexPlane::Kind::kOwn) return;
  const glm::dvec3 front = surface().area_vector(t);
  for (std::size_t c = 3 * t; c < 3 * t + 3; ++c) {
    std::uint32_t& normal = model_.corner_normals.own[c];
    if (normal != kNone && glm::dot(front, glm::dvec3(model_.normals[normal])) < 0) normal = kNone;
  }
}

std::uint32_t Triangles::copy_position(std::uint32_t position) {
  model_.positions.push_back(glm::dvec3(model_.positions[position]));
  if (!model_.colours.empty()) model_.colours.push_back(glm::vec3(model_.colours[position]));
  return static_cast<std::uint32_t>(model_.positions.size() - 1);
}

Corner Triangles::add_middle(const std::vector<Corner>& corners) {
  const double share = 1.0 / static_cast<double>(corners.size());
  Corner middle{copy_position(corners[0].position), kNone, kNone};
  glm::dvec3 position(0.0);
  glm::vec3 colour(0.0f);
  glm::dvec2 uv(0.0);
  for (const Corner& corner : corners) {
    position += model_.positions[corner.position] * share;
    if (!model_.colours.empty()) {
      colour += model_.colours[corner.position] * static_cast<float>(share);
    }
    if (corner.uv != kNone) uv += model_.uvs[corner.uv] * share;
  }
  model_.positions.back() = position;
  if (!model_.colours.empty()) model_.colours.back() = colour;
  if (corners[0].uv == kNone) return middle;
  middle.uv = static_cast<std::uint32_t>(model_.uvs.size());
  model_.uvs.push_back(uv);
  return middle;
}

void Triangles::add(const std::array<Corner, 3>& corners, std::size_t like) {
  for (const Corner& corner : corners) {
    model_.corner_positions.push_back(corner.position);
    if (model_.corner_uvs.kind == IndexPlane::Kind::kOwn) {
      model_.corner_uvs.own.push_back(corner.uv);
    }
    if (model_.corner_normals.kind == IndexPlane::Kind::kOwn) {
      model_.corner_normals.own.push_back(corner.normal);
    }
  }
  material_.push_back(std::uint32_t{material_[like]});
  smoothing_.push_back(std::uint32_t{smoothing_[like]});
}

}  // namespace modar::repair
