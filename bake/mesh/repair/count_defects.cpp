// Counts what repair_model() would change, at a small part of its cost: the fan of a position shows
// whether it is clean, and only edges between the others are examined.
#include <cmath>
#include <map>
#include <memory>
#include <string>

#include "bake/mesh/repair/repair.hpp"
#include "bake/mesh/repair/surface.hpp"
#include "formats/base/shortest_number.hpp"

namespace modar {
namespace {

using namespace repair;

Array<std::uint8_t> clean_positions(const Faces& surface, const Around& around) {
  Array<std::uint8_t> clean(surface.positions.size());
  for (std::uint32_t v = 0; v < clean.size(); ++v) {
    clean[v] = regular(surface, around.at(v)) ? 1 : 0;
  }
  return clean;
}

class Counter {
 public:
  Counter(const Faces& surface, const Around& around, const Array<std::uint8_t>& clean,
          MeshDefects& defects)
      : surface_(surface), around_(around), clean_(clean), defects_(defects) {}

  void run(std::span<const std::uint32_t> materials, const glm::dvec3& viewer) {
    for_each_edge(
        surface_, around_, [&](std::uint32_t v) { return clean_[v] == 0; },
        [&](std::span<const std::uint32_t> edge) { count_edge(edge); });
    for (std::uint32_t v = 0; v < clean_.size(); ++v) {
      if (clean_[v] == 0) count_position(v);
    }
    Components components(surface_, open_);
    bool many = false;
    const std::vector<bool> islands = components.islands(many);
    PointBox whole;
    PointBox rest;
    const auto join = [](PointBox& to, const PointBox& box) {
      to.add(box.low);
      to.add(box.high);
    };
    for (std::size_t p = 0; p < islands.size(); ++p) {
      join(whole, components.at(p).box);
      if (!islands[p]) join(rest, components.at(p).box);
      if (islands[p]) ++defects_.of(Defect::kIsland).count;
    }
    if (rest.diagonal() > 0) spread_ = whole.diagonal() / rest.diagonal();
    const std::map<std::uint32_t, Loop> loops = open_loops(surface_, open_);
    for (const auto& [position, loop] : loops) {
      const std::uint32_t part = components.of(position);
      if (islands[part] || !small_hole(loop.box, components.at(part).box)) continue;
      ++defects_.of(Defect::kHole).count;
    }
    defects_.backs = seen_backs(surface_, components, loops, turned_, materials, viewer);
  }

  /// The model's diagonal with its small islands, times that without them.
  [[nodiscard]] double spread() const { return spread_; }

 private:
  void count_edge(std::span<const std::uint32_t> edge) {
    if (edge.size() == 1) {
      open_.push_back(edge[0]);
    } else if (edge.size() > 2) {
      ++defects_.of(Defect::kEdge).count;
    } else if (surface_.corners[edge[0]] == surface_.corners[edge[1]]) {
      ++defects_.of(Defect::kWinding).count;
      turned_.push_back(edge[0]);
    }
  }

  /// Fans that touch at a position, and triangles that repeat another.
  void count_position(std::uint32_t v) {
    const std::span<const std::uint32_t> corners = around_.at(v);
    if (corners.size() < 2) return;
    fans_.read(surface_, corners);
    if (fans_.count > 1) ++defects_.of(Defect::kVertex).count;
    each_repeated(surface_, corners, v,
                  [&](std::uint32_t) { ++defects_.of(Defect::kDuplicate).count; });
  }

  const Faces& surface_;
  const Around& around_;
  const Array<std::uint8_t>& clean_;
  MeshDefects& defects_;
  std::vector<std::uint32_t> open_;    // half-edges
  std::vector<std::uint32_t> turned_;  // of changes of winding
  Fans fans_;
  double spread_ = 1;
};

/// Times that islands may enlarge a model's diagonal. Higher: models get smaller unsaid. [1.5, 4]
constexpr double kMostSpread = 2;

/// One line that names the option, or what it left.
void report_defects(const MeshDefects& defects, bool repaired, double spread, Report& report) {
  if (spread > kMostSpread) {
    report.diagnostics.push_back(
        {"model.stray", DiagnosticSeverity::kWarning, defects.model, 0,
         defect_words(Defect::kIsland, defects.counts[std::size_t(Defect::kIsland)].count) +
             " far from the rest: the model is " + shortest_text(std::round(spread)) +
             " times as large as without, so that the rest is shown small",
         "--repair removes them"});
  }
  std::string list;
  for (std::size_t d = 0; d < kDefects; ++d) {
    if (defects.counts[d].count == 0) continue;
    list +=
        (list.empty() ? "" : ", ") + defect_words(static_cast<Defect>(d), defects.counts[d].count);
  }
  if (list.empty()) return;
  report.diagnostics.push_back({"model.defects", DiagnosticSeverity::kInfo, defects.model, 0,
                                repaired ? "not repaired: " + list : list,
                                repaired ? "" : "--repair repairs them"});
}

}  // namespace

MeshDefects count_defects(const TriMesh& mesh, bool repaired, const glm::dvec3& viewer,
                          Report& report) {
  StageTimer timer(report, "defects");
  MeshDefects defects;
  defects.model = mesh.name;
  SourceFaces counted(mesh);
  auto around = std::make_unique<Around>(counted.surface());
  Array<std::uint8_t> clean = clean_positions(counted.surface(), *around);
  const auto all = [](std::uint32_t, std::uint32_t) { return true; };
  if (!repaired && join_open_edges(std::span(counted.corners.data(), counted.corners.size()),
                                   counted.positions, *around, clean, all) != 0) {
    around = std::make_unique<Around>(counted.surface());
    clean = clean_positions(counted.surface(), *around);
  }
  const Faces surface = counted.surface();
  Counter counter(surface, *around, clean, defects);
  counter.run({mesh.triangle_material.data(), mesh.triangle_material.size()}, viewer);
  report_defects(defects, repaired, counter.spread(), report);
  timer.done(mesh.triangles.size(), 0);
  return defects;
}

}  // namespace modar
