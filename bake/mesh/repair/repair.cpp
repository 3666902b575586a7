#include "bake/mesh/repair/repair.hpp"

#include "bake/mesh/repair/triangles.hpp"

namespace modar {
namespace {

using namespace repair;

/// Removes triangles and reports how many there were.
class Removal {
 public:
  explicit Removal(Triangles& triangles)
      : triangles_(triangles), kept_(triangles.surface().triangles(), true) {}

  void remove(std::size_t t, DefectCount& count) {
    if (!kept_[t]) return;
    kept_[t] = false;
    ++count.count;
    count.area += triangles_.surface().area(t);
  }
  void finish() { triangles_.keep(kept_); }

 private:
  Triangles& triangles_;
  std::vector<bool> kept_;
};

void join_seams(Triangles& triangles) {
  const Around around(triangles.surface());
  const Array<std::uint8_t> clean(triangles.surface().positions.size(), 0);
  const Array<glm::vec3>& colours = triangles.model().colours;
  join_open_edges(triangles.corners(), triangles.surface().positions, around, clean,
                  [&](std::uint32_t a, std::uint32_t b) {
                    return colours.empty() || colours[a] == colours[b];
                  });
}

void remove_flat(Triangles& triangles, DefectCount& count) {
  Removal removal(triangles);
  for (std::size_t t = 0; t < triangles.surface().triangles(); ++t) {
    if (triangles.surface().area_vector(t) == glm::dvec3(0.0)) removal.remove(t, count);
  }
  removal.finish();
}

/// Keeps the first of triangles that have the same positions in the same winding.
void remove_repeated(Triangles& triangles, DefectCount& count) {
  const Faces surface = triangles.surface();
  const Around around(surface);
  Removal removal(triangles);
  for (std::uint32_t v = 0; v < surface.positions.size(); ++v) {
    each_repeated(surface, around.at(v), v,
                  [&](std::uint32_t corner) { removal.remove(corner / 3, count); });
  }
  removal.finish();
}

/// Returns whether there was one.
bool remove_support(Triangles& triangles, DefectCount& count) {
  const std::vector<bool> support = find_support(triangles.surface());
  if (support.empty()) return false;
  Removal removal(triangles);
  for (std::size_t t = 0; t < support.size(); ++t) {
    if (support[t]) removal.remove(t, count);
  }
  removal.finish();
  count.count = 1;
  return true;
}

/// Returns whether there were too many to be removed.
bool remove_islands(Triangles& triangles, DefectCount& count) {
  const Faces surface = triangles.surface();
  Components components(surface, open_edges(surface, Around(surface)));
  bool many = false;
  const std::vector<bool> small = components.islands(many);
  Removal removal(triangles);
  DefectCount removed;
  for (std::size_t t = 0; t < surface.triangles(); ++t) {
    if (small[components.of(surface.corners[3 * t])]) removal.remove(t, removed);
  }
  removal.finish();
  count = {static_cast<std::uint64_t>(std::count(small.begin(), small.end(), true)), removed.area};
  return many;
}

}  // namespace

MeshDefects repair_model(SourceModel& model, bool support, Report& report) {
  StageTimer timer(report, "repair");
  MeshDefects defects;
  defects.model = model.name;
  const std::size_t faces = model.face_count();
  Triangles triangles(model);
  remove_flat(triangles, defects.of(Defect::kDegenerate));
  join_seams(triangles);
  remove_repeated(triangles, defects.of(Defect::kDuplicate));
  make_manifold(triangles, defects);
  if (support && remove_support(triangles, defects.of(Defect::kSupport))) {
    make_manifold(triangles, defects);  // its objects may touch now
  } else if (support) {
    report.diagnostics.push_back({"model.no-support", DiagnosticSeverity::kWarning, model.name, 0,
                                  "no flat surface with an open border is under the model",
                                  "cut it off in an editor, or leave out --repair-support"});
  }
  if (remove_islands(triangles, defects.of(Defect::kIsland))) {
    report.diagnostics.push_back(
        {"model.islands-kept", DiagnosticSeverity::kInfo, model.name, 0,
         "small parts are kept: together they are more than 1 % of the area", ""});
  }
  close_holes(triangles, defects.of(Defect::kHole));
  triangles.finish();
  timer.done(faces, model.face_count());
  return defects;
}

}  // namespace modar
