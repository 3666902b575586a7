// Finds the size at which a level is first drawn, and compares two pictures of that size.
#include "bake/check/picture/level_look.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "modar/camera.hpp"

namespace modar {
namespace {

constexpr std::array<float, 3> kClear = {1.0f, 0.0f, 1.0f};  ///< no model is all of one such colour
/// Of the size at which a level is first drawn: within it, rounding does not choose a finer one.
constexpr double kBehind = 1 - 1e-4;

/// Of a pixel, along a side.
constexpr int kLeastSamples = 4;

/// Chunks and levels that are first drawn together.
struct Switch {
  std::vector<std::pair<std::uint32_t, float>> chunks;  ///< each with the error of its level
};

std::vector<Switch> switches_of(const BundleView& bundle, std::uint32_t model) {
  std::vector<Switch> switches;
  const Table<ChunkRecord> chunks = bundle.chunks();
  const ChunkGroup own = bundle.chunk_group(model);
  for (std::uint32_t level = 1;; ++level) {
    Switch next;
    for (std::uint32_t c = own.first_chunk; c < own.first_chunk + own.chunk_count; ++c) {
      if (level >= chunks[c].level_count) continue;
      next.chunks.emplace_back(c, bundle.levels()[chunks[c].first_level + level].error);
    }
    if (next.chunks.empty()) break;
    switches.push_back(std::move(next));
  }
  for (std::uint32_t g = bundle.models().size(); g < bundle.chunk_groups(); ++g) {
    const ChunkGroup group = bundle.chunk_group(g);
    if (group.model != model) continue;
    Switch next;
    for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
      next.chunks.emplace_back(c, bundle.levels()[chunks[c].first_level].error);
    }
    switches.push_back(std::move(next));
  }
  return switches;
}

/// Focal length, in pixels, at which a switch happens.
double focal_length_of(const BundleView& bundle, const Switch& at, const glm::dvec3& eye) {
  double focal = std::numeric_limits<double>::infinity();
  for (const auto& [c, error] : at.chunks) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    glm::dvec3 gap(0.0);
    for (int i = 0; i < 3; ++i) {
      gap[i] = std::max({static_cast<double>(chunk.bounds_min[i]) - eye[i],
                         eye[i] - static_cast<double>(chunk.bounds_max[i]), 0.0});
    }
    if (error > 0) focal = std::min(focal, glm::length(gap) / static_cast<double>(error));
  }
  return kBehind * focal;
}

double radius_of(const BundleView& bundle, std::uint32_t model) {
  double radius = 0;
  const ChunkGroup group = bundle.chunk_group(model);
  for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    glm::dvec3 far(0.0);
    for (int i = 0; i < 3; ++i) {
      far[i] = std::max(std::fabs(chunk.bounds_min[i]), std::fabs(chunk.bounds_max[i]));
    }
    radius = std::max(radius, glm::length(far));
  }
  return radius;
}

/// How often each difference occurs, in 1/16 of 255.
class Differences {
 public:
  Differences() : counts_(255 * kSteps + 1, 0) {}

  /// Compares averages of blocks of two pictures.
  void add(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, std::size_t side,
           std::size_t block) {
    for (std::size_t y = 0; y + block <= side; y += block) {
      for (std::size_t x = 0; x + block <= side; x += block) add_block(a, b, side, block, x, y);
    }
  }

  [[nodiscard]] double mean() const {
    double sum = 0;
    double all = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      sum += static_cast<double>(i * counts_[i]) / kSteps;
      all += static_cast<double>(counts_[i]);
    }
    return all > 0 ? sum / all : 0.0;
  }

  [[nodiscard]] double percentile(double share) const {
    std::uint64_t all = 0;
    for (const std::uint64_t count : counts_) all += count;
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      below += counts_[i];
      if (static_cast<double>(below) >= share * static_cast<double>(all)) {
        return static_cast<double>(i) / kSteps;
      }
    }
    return 0;
  }

 private:
  static constexpr int kSteps = 16;

  void add_block(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, std::size_t side,
                 std::size_t block, std::size_t left, std::size_t top) {
    std::array<int, 3> sums{};
    for (std::size_t y = top; y < top + block; ++y) {
      for (std::size_t x = left; x < left + block; ++x) {
        const std::size_t at = 4 * (y * side + x);
        if (is_clear(&a[at]) || is_clear(&b[at])) return;
        for (std::size_t i = 0; i < 3; ++i) sums[i] += a[at + i] - b[at + i];
      }
    }
    int greatest = 0;
    for (const int sum : sums) greatest = std::max(greatest, std::abs(sum));
    ++counts_[static_cast<std::size_t>(greatest) * kSteps / (block * block)];
  }
  static bool is_clear(const std::uint8_t* pixel) {
    return pixel[0] == 255 && pixel[1] == 0 && pixel[2] == 255;
  }

  std::vector<std::uint64_t> counts_;
};

class LevelLooker {
 public:
  LevelLooker(const BundleView& bundle, Renderer& renderer, std::uint32_t model,
              const LevelLookOptions& options)
      : bundle_(bundle),
        renderer_(renderer),
        model_(model),
        options_(options),
        radius_(radius_of(bundle, model)) {}

  Result<LevelLook> look(const Switch& at) {
    LevelLook look;
    Differences differences;
    for (const glm::dvec3& direction : view_directions()) {
      const glm::dvec3 eye = kViewDistance * glm::normalize(direction);
      const double focal = options_.lod_pixels * focal_length_of(bundle_, at, eye);
      const double diameter =
          2 * focal * radius_ / std::sqrt(kViewDistance * kViewDistance - radius_ * radius_);
      const int side = static_cast<int>(std::min<double>(options_.side, std::ceil(diameter) + 2));
      const int block = std::max(kLeastSamples, options_.samples / side);
      MODAR_TRY(draw(direction, block * focal, block * side,
                     static_cast<float>(block) * options_.lod_pixels, coarse_));
      look.triangles += renderer_.stats().triangles;
      MODAR_TRY(draw(direction, block * focal, block * side, 0.0f, fine_));
      look.finest_triangles += renderer_.stats().triangles;
      look.side_px += diameter / kViews;
      differences.add(coarse_, fine_, static_cast<std::size_t>(block * side),
                      static_cast<std::size_t>(block));
    }
    look.triangles /= kViews;
    look.finest_triangles /= kViews;
    look.difference_mean = differences.mean();
    look.difference = differences.percentile(0.99);
    return look;
  }

 private:
  Result<void> draw(const glm::dvec3& direction, double focal, int side, float pixels,
                    std::vector<std::uint8_t>& picture) {
    Camera camera = default_camera(side, side);
    camera.fx = camera.fy = focal;
    RenderOptions render;
    render.clear_colour = {kClear[0], kClear[1], kClear[2], 1.0f};
    render.lod_pixels = pixels;
    renderer_.set_options(render);
    MODAR_TRY(renderer_.resize(side, side));
    const DrawItem item{model_, glm::mat4(view_from(direction))};
    const DepthRange range = depth_range(bundle_, {&item, 1});
    renderer_.render(RgbImage{}, gl_projection(camera, range.near_plane, range.far_plane),
                     {&item, 1});
    picture.resize(4 * static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    renderer_.read_pixels(picture);
    return {};
  }

  const BundleView& bundle_;
  Renderer& renderer_;
  std::uint32_t model_;
  LevelLookOptions options_;
  double radius_;
  std::vector<std::uint8_t> coarse_;
  std::vector<std::uint8_t> fine_;
};

}  // namespace

std::array<glm::dvec3, kViews> view_directions() {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  std::array<glm::dvec3, kViews> views;
  std::size_t n = 0;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-golden, golden}) {
      views[n++] = {0, a, b};
      views[n++] = {a, b, 0};
      views[n++] = {b, 0, a};
    }
  }
  return views;
}

glm::dmat4 view_from(const glm::dvec3& direction) {
  return glm::lookAt(kViewDistance * glm::normalize(direction), glm::dvec3(0.0),
                     std::fabs(direction.x) > 1 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0));
}

Result<std::vector<LevelLook>> look_at_levels(const BundleView& bundle, Renderer& renderer,
                                              std::uint32_t model,
                                              const LevelLookOptions& options) {
  std::vector<LevelLook> looks;
  LevelLooker looker(bundle, renderer, model, options);
  for (const Switch& at : switches_of(bundle, model)) {
    MODAR_ASSIGN(LevelLook look, looker.look(at));
    look.level = static_cast<std::uint32_t>(looks.size() + 1);
    looks.push_back(look);
  }
  return looks;
}

}  // namespace modar
