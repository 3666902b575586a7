// What differs visibly between a bundle and the same sources baked by another version.
#include "bake/check/source/source_measure.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/export/model_file.hpp"
#include "bake/image/difference.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "bake/texture/texture_codec.hpp"
#include "formats/tracker_record.hpp"

namespace modar {
namespace {

/// Samples of a surface. More: small damage of large models is found; each takes about 1 us.
constexpr std::size_t kMaxSurfaceSamples = 400000;
/// Two encodings of one picture, in decibels. Lower: more damage passes; higher: other encoders
/// fail.
constexpr double kMinTexturePsnr = 30.0;
/// Differing bits of codes of one corner, of 256; codes of two corners differ in 128 on average.
constexpr std::size_t kMaxCodeDistance = 64;
/// Share of codes that the source gives again: another version may choose other features.
constexpr double kMinKnownCodes = 0.5;

/// Triangles of a model in source units.
struct BundleSurface {
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec4> colours;  ///< empty, or one a position
  std::vector<TriangleTree::Triangle> triangles;
};

BundleSurface surface_of(const BundleView& bundle, const ModelRecord& model) {
  BundleSurface surface;
  const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    const auto level = decode_level(bundle, bundle.layouts()[model.layout], chunk);
    if (!level) continue;  // its bytes are judged before
    const auto first = static_cast<std::uint32_t>(surface.positions.size());
    for (const glm::dvec3& position : level->positions) {
      surface.positions.push_back(center + model.scale * position);
    }
    surface.colours.insert(surface.colours.end(), level->colours.begin(), level->colours.end());
    const auto& at = level->indices;
    for (std::size_t i = 0; i + 2 < at.size(); i += 3) {
      surface.triangles.push_back({first + at[i], first + at[i + 1], first + at[i + 2]});
    }
  }
  return surface;
}

/// Vertices and triangle centres, evenly sampled.
template <class Visit>
void visit_samples(const BundleSurface& surface, const Visit& visit) {
  const std::size_t count = surface.positions.size() + surface.triangles.size();
  const std::size_t step = count / kMaxSurfaceSamples + 1;
  for (std::size_t i = 0; i < count; i += step) {
    if (i < surface.positions.size()) {
      visit(surface.positions[i], i);
      continue;
    }
    const TriangleTree::Triangle& t = surface.triangles[i - surface.positions.size()];
    visit((surface.positions[t[0]] + surface.positions[t[1]] + surface.positions[t[2]]) / 3.0, i);
  }
}

double greatest_distance(const BundleSurface& from, TriangleTree& to) {
  double greatest = 0;
  visit_samples(from, [&](const glm::dvec3& point, std::size_t) {
    greatest = std::max(greatest, to.nearest(point));
  });
  return std::sqrt(greatest);
}

/// Mean difference of vertex colours from the most alike corner of the nearest triangle.
double mean_colour_error(const BundleSurface& ours, const BundleSurface& again,
                         TriangleTree& tree) {
  if (ours.colours.empty() || again.colours.empty()) return 0;
  double sum = 0;
  std::size_t count = 0;
  visit_samples(ours, [&](const glm::dvec3& point, std::size_t i) {
    if (i >= ours.colours.size()) return;
    tree.nearest(point);
    double least = 1;
    for (const std::uint32_t v : tree.last_triangle()) {
      const glm::dvec4 off = glm::abs(ours.colours[i] - again.colours[v]);
      least = std::min(least, std::max({off.x, off.y, off.z}));
    }
    sum += least;
    ++count;
  });
  return sum / static_cast<double>(count);
}

/// A texture's largest level.
RgbaImage picture_of(const BundleView& bundle, const TextureRecord& texture, std::uint32_t index) {
  const TextureLevelRecord& level = bundle.texture_levels()[texture.first_level];
  return decode_texture(
      static_cast<TextureFormat>(texture.format),
      bundle.texture_data(index).subspan(static_cast<std::size_t>(level.offset), level.size),
      texture.width, texture.height);
}

std::size_t code_distance(const TrackerRecordView& a, std::size_t i, const TrackerRecordView& b,
                          std::size_t j) {
  const auto byte = [](const TrackerRecordView& view, std::size_t code, std::size_t k) {
    const std::size_t block = code / kTrackerBlockCodes * kTrackerBlockCodes;
    return view.codes[block * kTrackerCodeBytes + k * kTrackerBlockCodes + code - block];
  };
  std::size_t bits = 0;
  for (std::size_t k = 0; k < kTrackerCodeBytes; ++k) {
    bits += static_cast<std::size_t>(
        std::popcount(static_cast<unsigned>(byte(a, i, k) ^ byte(b, j, k))));
  }
  return bits;
}

/// The share of a's features that b has, too: within a pixel, with a similar code.
double known_share(const TrackerRecordView& a, const TrackerRecordView& b) {
  if (a.features.empty()) return b.features.empty() ? 1.0 : 0.0;
  constexpr int kPixel = 64;
  const auto cell = [](int x, int y) { return y / kPixel * 2048 + x / kPixel; };
  std::multimap<int, std::size_t> by_cell;
  for (std::size_t j = 0; j < b.features.size(); ++j) {
    by_cell.emplace(cell(b.features[j].x, b.features[j].y), j);
  }
  std::size_t known = 0;
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    bool found = false;
    for (int dy = -1; dy <= 1 && !found; ++dy) {
      for (int dx = -1; dx <= 1 && !found; ++dx) {
        const auto [first, last] = by_cell.equal_range(
            cell(a.features[i].x + kPixel, a.features[i].y + kPixel) + (dy - 1) * 2048 + dx - 1);
        found = std::any_of(first, last, [&](const auto& entry) {
          return code_distance(a, i, b, entry.second) <= kMaxCodeDistance;
        });
      }
    }
    known += found ? 1 : 0;
  }
  return static_cast<double>(known) / static_cast<double>(a.features.size());
}

}  // namespace

void measure_surfaces(const BundleView& ours, const ModelRecord& model, const BundleView& again,
                      const ModelRecord& other, ModelFit& fit) {
  const BundleSurface surface = surface_of(ours, model);
  const BundleSurface surface_again = surface_of(again, other);
  if (surface.triangles.empty() || surface_again.triangles.empty()) {
    fit.source_to_bundle = fit.bundle_to_source = std::max(model.diagonal, other.diagonal);
    return;
  }
  TriangleTree tree(surface.positions, surface.triangles);
  TriangleTree tree_again(surface_again.positions, surface_again.triangles);
  fit.source_to_bundle = greatest_distance(surface_again, tree);
  fit.bundle_to_source = greatest_distance(surface, tree_again);
  fit.colour_error = mean_colour_error(surface, surface_again, tree_again);
}

std::string texture_fault(const BundleView& ours, std::uint32_t index, const BundleView& again,
                          std::uint32_t index_again) {
  const RgbaImage picture = picture_of(ours, ours.textures()[index], index);
  const RgbaImage other = picture_of(again, again.textures()[index_again], index_again);
  if (picture.width != other.width || picture.height != other.height) {
    return "baked again it has another size";
  }
  const double psnr = psnr_db(picture, other);
  if (psnr >= kMinTexturePsnr) return "";
  return std::to_string(psnr) + " dB from the picture, baked again";
}

std::string record_fault(std::span<const std::byte> ours, std::span<const std::byte> theirs) {
  TrackerRecordView a;
  TrackerRecordView b;
  // Sections are aligned by the format, vectors by their allocation.
  if (view_tracker_record(ours, a) || view_tracker_record(theirs, b)) return "it is unreadable";
  if (a.header.width != b.header.width || a.header.height != b.header.height ||
      a.pixels.size() != b.pixels.size()) {
    return "its image has another size than the source's";
  }
  double square = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double off = static_cast<double>(a.pixels[i]) - b.pixels[i];
    square += off * off / static_cast<double>(a.pixels.size());
  }
  if (square > 255.0 * 255.0 / std::pow(10.0, kMinTexturePsnr / 10)) {
    return "its image differs from the source's by " + std::to_string(std::sqrt(square)) +
           " gray levels";
  }
  const double share = known_share(a, b);
  if (share >= kMinKnownCodes) return "";
  return "only " + std::to_string(static_cast<int>(100 * share)) +
         " percent of its codes are like the source's at their place";
}

}  // namespace modar
