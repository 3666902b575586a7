#include "bake/mesh/repair/triangles.hpp"

#include <cmath>

namespace modar::repair {
namespace {

/// Triangles at an edge above which none continues another, which bounds the time.
constexpr std::size_t kMostPaired = 64;
/// Rounds of splitting after which triangles that still share an edge with a third come apart.
constexpr int kRounds = 3;

class Links {
 public:
  Links(Triangles& triangles, MeshDefects& defects)
      : triangles_(triangles), defects_(defects), twin_(triangles.corners().size(), kNone) {}

  void run() {
    pair();
    orient();
    split(&defects_.of(Defect::kVertex));
    for (int round = 0; cut_crowded(round >= kRounds); ++round) split(nullptr);
  }

 private:
  void pair() {
    const Faces surface = triangles_.surface();
    const Around around(surface);
    for_each_edge(
        surface, around, [](std::uint32_t) { return true; },
        [&](std::span<const std::uint32_t> edge) {
          if (edge.size() > 2) {
            add(Defect::kEdge, 1, edge);
          }
          if (edge.size() > 1 && edge.size() <= kMostPaired) pair_at(edge);
        });
  }

  void add(Defect defect, std::uint64_t count, std::span<const std::uint32_t> half_edges) {
    defects_.of(defect).count += count;
    for (const std::uint32_t h : half_edges) {
      defects_.of(defect).area += triangles_.surface().area(h / 3);
    }
  }

  void link(std::uint32_t a, std::uint32_t b) {
    twin_[a] = b;
    twin_[b] = a;
  }
  void cut(std::uint32_t h) {
    if (twin_[h] == kNone) return;
    twin_[twin_[h]] = kNone;
    twin_[h] = kNone;
  }

  /// Joins the flattest pair first, of one winding where it can. Both sides of one triangle never.
  void pair_at(std::span<const std::uint32_t> edge) {
    const Faces surface = triangles_.surface();
    struct Pair {
      double fold;
      std::uint32_t a, b;
    };
    std::vector<Pair> pairs;
    const glm::dvec3 from = surface.at(edge[0]);
    const glm::dvec3 along = surface.at(next(edge[0])) - from;
    const auto away = [&](std::uint32_t h) {
      const glm::dvec3 to = surface.at(previous(h)) - from;
      return glm::normalize(to - along * (glm::dot(to, along) / glm::dot(along, along)));
    };
    for (std::size_t i = 0; i < edge.size(); ++i) {
      for (std::size_t k = i + 1; k < edge.size(); ++k) {
        if (surface.corners[previous(edge[i])] == surface.corners[previous(edge[k])]) continue;
        const bool turned = surface.corners[edge[i]] == surface.corners[edge[k]];
        double fold = edge.size() == 2 ? 0 : glm::dot(away(edge[i]), away(edge[k]));
        if (!std::isfinite(fold)) fold = 1;
        pairs.push_back({fold + (turned ? 2 : 0), edge[i], edge[k]});
      }
    }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
      return a.fold != b.fold ? a.fold < b.fold : a.a != b.a ? a.a < b.a : a.b < b.b;
    });
    for (const Pair& pair : pairs) {
      if (twin_[pair.a] == kNone && twin_[pair.b] == kNone) link(pair.a, pair.b);
    }
  }

  /// Whether the normals that a triangle states look to its front: -1, 1, or 1 where it has none.
  [[nodiscard]] double facing(std::size_t t) const {
    glm::dvec3 sum(0.0);
    for (std::size_t c = 3 * t; c < 3 * t + 3; ++c) {
      const std::uint32_t normal = triangles_.corner(c).normal;
      if (normal != kNone) sum += glm::dvec3(triangles_.model().normals[normal]);
    }
    return glm::dot(sum, triangles_.surface().area_vector(t)) < 0 ? -1 : 1;
  }

  /// Turns the smaller part of each surface that does not wind as the rest.
  void orient() {
    const Faces surface = triangles_.surface();
    std::vector<std::uint8_t> state(surface.triangles(), 0);  // 1: stays, 2: to be turned
    std::vector<std::uint32_t> part;
    for (std::uint32_t start = 0; start < state.size(); ++start) {
      if (state[start] != 0) continue;
      part.assign(1, start);
      state[start] = 1;
      bool mixed = false;
      for (std::size_t i = 0; i < part.size(); ++i) {
        for (std::uint32_t h = 3 * part[i]; h < 3 * part[i] + 3; ++h) {
          if (twin_[h] == kNone) continue;
          const bool against = surface.corners[h] == surface.corners[twin_[h]];
          const std::uint8_t wanted = against ? 3 - state[part[i]] : state[part[i]];
          std::uint8_t& other = state[twin_[h] / 3];
          if (other == 0) {
            other = wanted;
            part.push_back(twin_[h] / 3);
            mixed = mixed || wanted == 2;
          } else if (other != wanted) {
            add(Defect::kEdge, 1, std::span(&h, 1));  // a surface of one side
            cut(h);
          }
        }
      }
      if (mixed) turn(part, state);
    }
    Array<std::uint32_t> turned(twin_);
    const auto now = [&](std::uint32_t h) { return state[h / 3] == 2 ? h / 3 * 3 + 2 - h % 3 : h; };
    for (std::uint32_t h = 0; h < twin_.size(); ++h) {
      turned[now(h)] = twin_[h] == kNone ? kNone : now(twin_[h]);
    }
    twin_ = std::move(turned);
  }

  void turn(const std::vector<std::uint32_t>& part, std::vector<std::uint8_t>& state) {
    double vote = 0;  // for those that stay
    for (const std::uint32_t t : part) {
      vote += triangles_.surface().area(t) * facing(t) * (state[t] == 1 ? 1 : -1);
    }
    for (const std::uint32_t t : part) {
      if (vote < 0) state[t] = 3 - state[t];
      if (state[t] != 2) continue;
      const std::uint32_t h = 3 * t;
      add(Defect::kWinding, 1, std::span(&h, 1));
      triangles_.turn(t);
    }
  }

  /// Walks the fan of a corner from its first triangle and gives it a position.
  void walk(std::uint32_t corner, std::vector<bool>& seen, std::uint32_t position) {
    std::uint32_t c = corner;
    while (twin_[c] != kNone && next(twin_[c]) != corner) c = next(twin_[c]);
    const std::uint32_t first = c;
    do {
      seen[c] = true;
      triangles_.corners()[c] = position;
      c = twin_[previous(c)];
    } while (c != kNone && c != first);
  }

  void split(DefectCount* count) {
    const std::size_t corners = twin_.size();
    std::vector<bool> seen(corners, false);
    std::vector<std::uint8_t> uses(triangles_.surface().positions.size(), 0);
    for (std::uint32_t c = 0; c < corners; ++c) {
      if (seen[c]) continue;
      const std::uint32_t position = triangles_.corners()[c];
      if (uses[position] == 1 && count != nullptr) ++count->count;
      uses[position] = static_cast<std::uint8_t>(std::min(uses[position] + 1, 2));
      if (uses[position] > 1 && count != nullptr) count->area += triangles_.surface().area(c / 3);
      walk(c, seen, uses[position] == 1 ? position : triangles_.copy_position(position));
    }
  }

  /// Parts what still shares an edge with a third: a fan may meet itself. apart: from all others.
  bool cut_crowded(bool apart) {
    const Faces surface = triangles_.surface();
    bool any = false;
    for_each_edge(
        surface, Around(surface), [](std::uint32_t) { return true; },
        [&](std::span<const std::uint32_t> edge) {
          if (edge.size() < 2 || (edge.size() == 2 && twin_[edge[0]] == edge[1])) return;
          if (edge.size() == 2 && twin_[edge[0]] == kNone && twin_[edge[1]] == kNone &&
              surface.corners[edge[0]] != surface.corners[edge[1]] &&
              surface.corners[previous(edge[0])] != surface.corners[previous(edge[1])]) {
            return link(edge[0], edge[1]);
          }
          any = true;
          for (const std::uint32_t h : edge) {
            cut(h);
            if (apart) cut(next(h));
            if (apart) cut(previous(h));
          }
        });
    return any;
  }

  Triangles& triangles_;
  MeshDefects& defects_;
  Array<std::uint32_t> twin_;  // of each half-edge: the one that continues it, or kNone
};

}  // namespace

void make_manifold(Triangles& triangles, MeshDefects& defects) {
  Links(triangles, defects).run();
}

}  // namespace modar::repair
