// Rebakes, compares, measures.
#include "bake/check/source/source_check.hpp"
#include "bake/image/difference.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/check/source/level_difference.hpp"
#include "bake/check/verdict.hpp"
#include "bake/import/read_model.hpp"
#include "bake/mesh/draw_order.hpp"
#include "bake/mesh/lod/reduce.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/texture/texture_codec.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/tracker_record.hpp"

namespace modar {
namespace {

/// Samples of a surface that are measured at most; great models are sampled evenly.
constexpr std::size_t kMaxSamples = 400000;
/// Distances are measured between rounded numbers: this share of the diagonal is theirs.
constexpr double kRounding = 1e-12;
/// Vertex colours are 8 bits; nearest points may lie a little beside their vertex.
constexpr double kColourLimit = 4.0 / 255.0;
/// A block of two encodings that differs more shows, 16 pixels of one.
constexpr double kBlockSlack = 24;
/// Of measured decibels and similarity, which are rounded sums.
constexpr float kQualitySlack = 0.01f;
/// Of measured errors of a model that has the same levels.
constexpr double kFigureSlack = 1e-3;
/// A texel of a shadow that differs more shows.
constexpr int kTexelSlack = 96;
/// Two encodings of one texture that differ more are not of one picture.
constexpr double kLeastTexturePsnr = 30.0;

/// Of scales and offsets, which are floats made from doubles.
constexpr float kSceneSlack = 1e-5f;
/// Of lights, whose parts are sums over a picture.
constexpr float kLightSlack = 1e-3f;
/// Of shadows (0 to 255) and occlusion (0 to 127), on average: what nobody sees.
constexpr double kShadeSlack = 8;
/// Of a cell of a pattern's colours, of 65535: a step and a half of 8 bits.
constexpr int kCellSlack = 400;
/// Of widths that were written in different units.
constexpr double kWidthSlack = 1e-6;
/// Of 256, by which codes of one corner may differ: random ones differ in 128 with a deviation of
/// 8, eight of which lie between.
constexpr std::size_t kSimilarBits = 64;
/// The least share of a record's codes that its source gives again. Set by hand: another version
/// of the baker may choose other views and features.
constexpr double kLeastKnownCodes = 0.5;

/// Triangles of a model in source units.
struct Surface {
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec4> colours;  ///< empty, or one a position
  std::vector<TriangleTree::Triangle> triangles;
};

Surface surface_of(const BundleView& bundle, const ModelRecord& model) {
  Surface surface;
  const VertexDecoder decoder(bundle.layouts()[model.layout]);
  const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    const LevelRecord& level = bundle.levels()[chunk.first_level];
    // Chunks may share vertices: those of others are none of its own.
    std::vector<std::uint32_t> numbers(level.vertex_count, kNone);
    const auto number_of = [&](std::uint16_t v) {
      if (numbers[v] != kNone) return numbers[v];
      const std::byte* vertex =
          bundle.vertices().data() + level.vertex_offset + std::size_t{v} * decoder.stride();
      numbers[v] = static_cast<std::uint32_t>(surface.positions.size());
      surface.positions.push_back(center + model.scale * decoder.position(vertex, chunk));
      if (decoder.has(Semantic::kColour)) surface.colours.push_back(decoder.colour(vertex));
      return numbers[v];
    };
    const auto* indices =
        reinterpret_cast<const std::uint16_t*>(bundle.indices().data() + level.index_offset);
    for (std::uint32_t i = 0; i < level.index_count; i += 3) {
      surface.triangles.push_back(
          {number_of(indices[i]), number_of(indices[i + 1]), number_of(indices[i + 2])});
    }
  }
  return surface;
}

Surface surface_of(const TriMesh& mesh) {
  Surface surface;
  for (const glm::dvec3& p : mesh.positions) {
    surface.positions.push_back(mesh.placement.center + mesh.placement.scale * p);
  }
  for (const glm::u8vec4& c : mesh.colours) surface.colours.push_back(glm::dvec4(c) / 255.0);
  surface.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
  return surface;
}

/// Without the triangles that may lose their area where each corner is off by `error`, which a bake
/// leaves out, and without the positions that only these have.
Surface lasting(const Surface& surface, double error) {
  Surface out;
  std::vector<std::uint32_t> numbers(surface.positions.size(), kNone);
  for (const TriangleTree::Triangle& t : surface.triangles) {
    const std::array<glm::dvec3, 3> p = {surface.positions[t[0]], surface.positions[t[1]],
                                         surface.positions[t[2]]};
    const double twice_area = glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
    const double longest =
        std::max({glm::length(p[1] - p[0]), glm::length(p[2] - p[1]), glm::length(p[0] - p[2])});
    if (twice_area <= 2 * error * longest) continue;  // not as wide as its sides may move
    TriangleTree::Triangle& left = out.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& number = numbers[t[k]];
      if (number == kNone) {
        number = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(p[k]);
      }
      left[k] = number;
    }
  }
  return out;
}

/// Greatest distance of the one's vertices and triangle centres to the other.
double greatest_distance(const Surface& from, TriangleTree& to) {
  const std::size_t count = from.positions.size() + from.triangles.size();
  const std::size_t step = (count + kMaxSamples - 1) / kMaxSamples;
  double greatest = 0;
  for (std::size_t i = 0; i < count; i += step) {
    glm::dvec3 point;
    if (i < from.positions.size()) {
      point = from.positions[i];
    } else {
      const TriangleTree::Triangle& t = from.triangles[i - from.positions.size()];
      point = (from.positions[t[0]] + from.positions[t[1]] + from.positions[t[2]]) / 3.0;
    }
    greatest = std::max(greatest, to.nearest(point));
  }
  return std::sqrt(greatest);
}

/// Greatest difference of a vertex's colour from those of the source's vertices within `error` of
/// it, the most alike, as several may be at one place; where none is, from those of the nearest
/// triangle.
double colour_error(const Surface& bundle, const Surface& source, TriangleTree& tree,
                    double error) {
  if (bundle.colours.empty() || source.colours.empty()) return 0;
  std::vector<std::uint32_t> along(source.positions.size());  // by x
  std::iota(along.begin(), along.end(), 0u);
  const auto x_of = [&](std::uint32_t v) { return source.positions[v].x; };
  std::ranges::sort(along, {}, x_of);
  const std::size_t step = (bundle.positions.size() + kMaxSamples - 1) / kMaxSamples;
  double greatest = 0;
  for (std::size_t i = 0; i < bundle.positions.size(); i += step) {
    const glm::dvec3& at = bundle.positions[i];
    double least = 2;
    const auto compare = [&](std::uint32_t v) {
      const glm::dvec4 off = glm::abs(bundle.colours[i] - source.colours[v]);
      least = std::min(least, std::max({off.x, off.y, off.z}));
    };
    for (auto v = std::ranges::lower_bound(along, at.x - error, {}, x_of);
         v != along.end() && x_of(*v) <= at.x + error; ++v) {
      if (glm::length(source.positions[*v] - at) <= error) compare(*v);
    }
    if (least > 1) {
      tree.nearest(at);
      for (const std::uint32_t v : tree.last_triangle()) compare(v);
    }
    greatest = std::max(greatest, least);
  }
  return greatest;
}

std::span<const std::byte> part(std::span<const std::byte> bytes, std::uint64_t offset,
                                std::uint64_t size) {
  return bytes.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
}

bool equal(std::span<const std::byte> a, std::span<const std::byte> b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin());
}

class SourceCheck {
 public:
  SourceCheck(const BundleView& bundle, const IssueSink& sink) : bundle_(bundle), sink_(sink) {}

  Result<SourceFit> run(BakeRequest request, Report& report) {
    MODAR_TRY(name_assets(request));
    MODAR_ASSIGN(const std::vector<std::byte> bytes, bake_again(request, report));
    MODAR_ASSIGN(again_, BundleView::open(bytes));
    const auto unknown = [this](const auto& sources, const auto& assets) {
      return std::any_of(sources.begin(), sources.end(), [&](const auto& source) {
        for (const auto& each : assets) {
          if (bundle_.name(each.name) == source.name) return false;
        }
        return true;
      });
    };
    strange_model_ = unknown(request.models, bundle_.models());
    strange_pattern_ = unknown(request.patterns, bundle_.patterns());
    for (const ModelRecord& model : bundle_.models()) {
      const auto path =
          std::ranges::find(request.models, bundle_.name(model.name), &ModelRequest::name);
      if (path == request.models.end()) {
        missing("model", model.name, &model, strange_model_);
        continue;
      }
      MODAR_TRY(check_model(model, *path, request, report));
    }
    for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) check_texture(t);
    for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) check_pattern(p);
    check_parameter_sets();
    if (!request.scenes.empty()) check_scenes();
    return std::move(fit_);
  }

 private:
  Result<std::vector<std::byte>> bake_again(const BakeRequest& request, Report& report) {
    MODAR_ASSIGN(const BundleContent content, build_bundle(request, report));
    for (const MaterialRecord& material : content.materials) {
      blended_.push_back(blended(material, content));
    }
    return encode_bundle(content);
  }

  void tell(WorkstationRule rule, const std::string& where, const void* place, std::string detail,
            std::optional<Severity> severity = {}) {
    sink_(Issue{
        &workstation_issue_kind(rule), where,
        static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - bundle_.bytes().data()),
        std::move(detail), severity});
  }

  [[nodiscard]] std::string label(const char* what, NameRef name) const {
    return what + (" '" + std::string(bundle_.name(name)) + "'");
  }

  /// renamed: of what kind of asset the sources have one that the bundle lacks.
  void missing(const char* what, NameRef name, const void* place, bool renamed = false) {
    if (!renamed) return tell(WorkstationRule::kSourceMissing, label(what, name), place, "");
    tell(WorkstationRule::kSourceMissing, label(what, name), place,
         "and no asset has the name of a source: NAME=FILE gives a file that was renamed its name",
         Severity::kError);
  }

  /// Among what was baked again; kNone: there is none.
  template <class T>
  std::uint32_t number_of_namesake(const Table<T>& records, NameRef name) const {
    for (std::uint32_t i = 0; i < records.size(); ++i) {
      if (again_.name(records[i].name) == bundle_.name(name)) return i;
    }
    return kNone;
  }

  template <class T>
  const T* namesake(const Table<T>& records, NameRef name) const {
    const std::uint32_t number = number_of_namesake(records, name);
    return number != kNone ? &records[number] : nullptr;
  }

  [[nodiscard]] bool same_level(const LevelRecord& a, const LevelRecord& b,
                                std::uint64_t stride) const {
    return a.vertex_count == b.vertex_count && a.index_count == b.index_count &&
           equal(part(bundle_.vertices(), a.vertex_offset, a.vertex_count * stride),
                 part(again_.vertices(), b.vertex_offset, b.vertex_count * stride)) &&
           equal(part(bundle_.indices(), a.index_offset, 2ull * a.index_count),
                 part(again_.indices(), b.index_offset, 2ull * b.index_count));
  }

  [[nodiscard]] bool same_model(const ModelRecord& model) const {
    const ModelRecord* other = namesake(again_.models(), model.name);
    if (other == nullptr || other->chunk_count != model.chunk_count) return false;
    const LayoutRecord& layout = bundle_.layouts()[model.layout];
    if (std::memcmp(&layout, &again_.layouts()[other->layout], sizeof layout) != 0) return false;
    // From the centre to the counts: placement, errors, counts.
    constexpr std::size_t kFrom = offsetof(ModelRecord, center);
    constexpr std::size_t kSize = offsetof(ModelRecord, layout) - kFrom;
    if (std::memcmp(&model.center, &other->center, kSize) != 0) return false;
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const ChunkRecord& a = bundle_.chunks()[model.first_chunk + c];
      const ChunkRecord& b = again_.chunks()[other->first_chunk + c];
      if (std::memcmp(&a, &b, offsetof(ChunkRecord, material)) != 0) return false;
      if (a.level_count != b.level_count) return false;
      for (std::uint32_t l = 0; l < a.level_count; ++l) {
        if (!same_level(bundle_.levels()[a.first_level + l], again_.levels()[b.first_level + l],
                        layout.stride)) {
          return false;
        }
      }
    }
    return same_stand_ins(model, *other);
  }

  /// Chunks and levels of a model's stand-ins.
  using StandInChunks = std::vector<std::pair<const ChunkRecord*, const LevelRecord*>>;

  static StandInChunks stand_in_chunks(const BundleView& bundle, const ModelRecord& model) {
    StandInChunks found;
    for (std::uint32_t g = bundle.models().size(); g < bundle.chunk_groups(); ++g) {
      const ChunkGroup group = bundle.chunk_group(g);
      if (&bundle.models()[group.model] != &model) continue;
      for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
        const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
        found.emplace_back(&chunk, &bundle.levels()[chunk.first_level]);
      }
    }
    return found;
  }

  [[nodiscard]] bool same_stand_ins(const ModelRecord& model, const ModelRecord& other) const {
    const StandInChunks ours = stand_in_chunks(bundle_, model);
    const StandInChunks theirs = stand_in_chunks(again_, other);
    const std::uint64_t stride = bundle_.layouts()[model.layout].stride;
    return std::equal(
        ours.begin(), ours.end(), theirs.begin(), theirs.end(), [&](const auto& a, const auto& b) {
          return std::memcmp(a.first, b.first, offsetof(ChunkRecord, material)) == 0 &&
                 a.second->error == b.second->error && same_level(*a.second, *b.second, stride);
        });
  }

  /// Those that are in the order of those baked again, byte by byte.
  void check_stand_ins(const ModelRecord& model, const ModelRecord& other, double slack) {
    const StandInChunks ours = stand_in_chunks(bundle_, model);
    const StandInChunks theirs = stand_in_chunks(again_, other);
    for (std::size_t i = 0; i < std::min(ours.size(), theirs.size()); ++i) {
      const std::string fault =
          level_difference({&bundle_.layouts()[model.layout], ours[i].first, ours[i].second,
                            bundle_.vertices(), bundle_.indices()},
                           {&again_.layouts()[other.layout], theirs[i].first, theirs[i].second,
                            again_.vertices(), again_.indices()},
                           slack);
      if (fault.empty()) continue;
      tell(WorkstationRule::kSourceSurface,
           label("model", model.name) + ", chunk " + std::to_string(i) + " of its stand-ins",
           ours[i].second, fault);
    }
  }

  Result<void> check_model(const ModelRecord& model, const ModelRequest& asked,
                           const BakeRequest& request, Report& report) {
    Report quiet;
    MODAR_ASSIGN(SourceModel source, read_model(asked.path, {request.jobs, asked.own_picture}));
    MODAR_ASSIGN(TriMesh mesh, weld(std::move(source), quiet, {request.jobs}));
    if (request.most_triangles != 0) mesh = reduce(std::move(mesh), request.most_triangles, quiet);
    cut_as_baked(model, mesh);
    StageTimer timer(report, "measure");
    const Surface ours = surface_of(bundle_, model);
    const Surface theirs = surface_of(mesh);
    TriangleTree our_tree(ours.positions, ours.triangles);
    TriangleTree their_tree(theirs.positions, theirs.triangles);
    ModelFit fit;
    fit.name = bundle_.name(model.name);
    fit.same_bytes = same_model(model);
    fit.stated_error = model.position_error_max;
    const bool left_out = model.triangle_count < theirs.triangles.size();
    const Surface lasts = left_out ? lasting(theirs, fit.stated_error) : Surface();
    fit.source_to_bundle = greatest_distance(left_out ? lasts : theirs, our_tree);
    fit.bundle_to_source = greatest_distance(ours, their_tree);
    fit.colour_error = colour_error(ours, theirs, their_tree, fit.stated_error + rounding(model));
    timer.done(theirs.positions.size(), ours.positions.size(),
               std::max(fit.source_to_bundle, fit.bundle_to_source));
    judge_model(model, mesh, left_out ? lasts.triangles.size() : theirs.triangles.size(), fit);
    check_materials(model);
    check_occlusion(model);
    if (fit.same_bytes) {
      check_draw_order(model);
    } else {
      check_levels(model);
    }
    fit_.models.push_back(fit);
    return {};
  }

  /// Cuts what is seen through as the bake does.
  void cut_as_baked(const ModelRecord& model, TriMesh& mesh) const {
    const ModelRecord* other = namesake(again_.models(), model.name);
    if (other == nullptr || other->material_count != mesh.materials.size()) return;
    std::vector<bool> seen_through;
    for (std::uint32_t m = 0; m < other->material_count; ++m) {
      seen_through.push_back(blended_[other->first_material + m]);
    }
    cut_crossing(mesh, seen_through);
  }

  /// Levels that are in the order of those baked again, byte by byte: what was changed since.
  void check_levels(const ModelRecord& model) {
    const ModelRecord* other = namesake(again_.models(), model.name);
    if (other == nullptr || other->chunk_count != model.chunk_count) return;
    const double slack = 2 * model.position_error_max / model.scale + 1e-6;
    bool same = true;
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const ChunkRecord& a = bundle_.chunks()[model.first_chunk + c];
      const ChunkRecord& b = again_.chunks()[other->first_chunk + c];
      for (std::uint32_t l = 0; l < std::min(a.level_count, b.level_count); ++l) {
        const LevelPart ours{&bundle_.layouts()[model.layout], &a,
                             &bundle_.levels()[a.first_level + l], bundle_.vertices(),
                             bundle_.indices()};
        const LevelPart theirs{&again_.layouts()[other->layout], &b,
                               &again_.levels()[b.first_level + l], again_.vertices(),
                               again_.indices()};
        const std::string fault = level_difference(ours, theirs, slack);
        same = same && same_level(*ours.level, *theirs.level, ours.layout->stride);
        if (fault.empty()) continue;
        tell(WorkstationRule::kSourceSurface,
             label("model", model.name) + ", chunk " + std::to_string(c) + ", level " +
                 std::to_string(l),
             ours.level, fault);
      }
    }
    check_stand_ins(model, *other, slack);
    if (same) check_figures(model, *other);
  }

  /// What a model states of itself, where its levels are those of the source.
  void check_figures(const ModelRecord& model, const ModelRecord& other) {
    const auto near = [](double a, double b) { return std::fabs(a - b) <= kFigureSlack * b; };
    const auto close = [&near](float a, float b) {
      return near(static_cast<double>(a), static_cast<double>(b));
    };
    if (near(model.position_error_max, other.position_error_max) &&
        near(model.position_error_rms, other.position_error_rms) &&
        close(model.normal_error_max_deg, other.normal_error_max_deg) &&
        close(model.normal_error_rms_deg, other.normal_error_rms_deg) &&
        close(model.uv_error_max_texels, other.uv_error_max_texels) &&
        close(model.uv_error_rms_texels, other.uv_error_rms_texels) &&
        near(model.unit_metres, other.unit_metres) && model.vertex_count == other.vertex_count) {
      return;
    }
    tell(WorkstationRule::kSourceCounts, label("model", model.name), &model.position_error_max,
         "its levels are the source's, and the errors, the unit or the count that it states are "
         "not");
  }

  /// The sets that detection shares with the bake: of one name, they are one.
  void check_parameter_sets() {
    for (const ParameterSetRecord& set : bundle_.parameter_sets()) {
      const ParameterSetRecord* other = namesake(again_.parameter_sets(), set.name);
      constexpr std::size_t kSize =
          offsetof(ParameterSetRecord, reserved) - offsetof(ParameterSetRecord, id);
      if (other == nullptr || std::memcmp(&set.id, &other->id, kSize) == 0) continue;
      tell(WorkstationRule::kSourcePattern, label("parameter set", set.name), &set,
           "its values are not those of its name");
    }
  }

  /// The shades of a model's corners, where it has the same vertices.
  void check_occlusion(const ModelRecord& model) {
    const ModelRecord* other = namesake(again_.models(), model.name);
    if (other == nullptr || other->chunk_count != model.chunk_count) return;
    const std::uint32_t ours = occlusion_byte(bundle_.occlusion(), model.layout);
    const std::uint32_t theirs = occlusion_byte(again_.occlusion(), other->layout);
    const std::string where = label("model", model.name);
    if ((ours == kNone) != (theirs == kNone)) {
      return tell(WorkstationRule::kSourceColour, where, &model,
                  ours == kNone ? "its occlusion is missing" : "its source gives no occlusion");
    }
    if (ours == kNone) return;
    const std::size_t stride = bundle_.layouts()[model.layout].stride;
    const std::size_t other_stride = again_.layouts()[other->layout].stride;
    double sum = 0;
    std::size_t count = 0;
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const LevelRecord& a = bundle_.levels()[bundle_.chunks()[model.first_chunk + c].first_level];
      const LevelRecord& b = again_.levels()[again_.chunks()[other->first_chunk + c].first_level];
      if (a.vertex_count != b.vertex_count) return;
      for (std::size_t v = 0; v < a.vertex_count; ++v) {
        const auto mine =
            std::to_integer<int>(bundle_.vertices()[a.vertex_offset + v * stride + ours]);
        const auto its =
            std::to_integer<int>(again_.vertices()[b.vertex_offset + v * other_stride + theirs]);
        sum += std::abs(mine - its);
      }
      count += a.vertex_count;
    }
    const double mean = count == 0 ? 0 : sum / static_cast<double>(count);
    if (mean <= kShadeSlack) return;
    tell(WorkstationRule::kSourceColour, where, &model,
         "its occlusion is off by " + std::to_string(mean) + " of 127 on average");
  }

  /// Of a model that has the same bytes.
  void check_draw_order(const ModelRecord& model) {
    const ModelRecord* other = namesake(again_.models(), model.name);
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const std::uint32_t chunk = model.first_chunk + c;
      if (equal(bundle_.section(SectionType::kDrawOrder, chunk),
                again_.section(SectionType::kDrawOrder, other->first_chunk + c))) {
        continue;
      }
      tell(WorkstationRule::kSourceColour,
           label("model", model.name) + ", chunk " + std::to_string(c), &bundle_.chunks()[chunk],
           "the order in which it is drawn is not the source's");
    }
  }

  /// What sums in double precision may be off by, in source units.
  static double rounding(const ModelRecord& model) {
    const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
    return kRounding * (model.diagonal + glm::length(center));
  }

  /// least_triangles: those of the source that no rounding can leave without area.
  void judge_model(const ModelRecord& model, const TriMesh& mesh, std::size_t least_triangles,
                   const ModelFit& fit) {
    const std::string where = label("model", model.name);
    const double limit = fit.stated_error + rounding(model);
    if (!(fit.source_to_bundle <= limit && fit.bundle_to_source <= limit)) {
      tell(WorkstationRule::kSourceSurface, where, &model.position_error_max,
           "the source deviates from the bundle by up to " + std::to_string(fit.source_to_bundle) +
               ", the bundle from the source by up to " + std::to_string(fit.bundle_to_source) +
               "; " + std::to_string(fit.stated_error) + " is stated");
    }
    if (fit.colour_error > kColourLimit) {
      tell(WorkstationRule::kSourceColour, where, &model,
           "a vertex is off by " + std::to_string(fit.colour_error));
    }
    if (model.triangle_count > mesh.triangles.size() || model.triangle_count < least_triangles ||
        model.source_vertex_count != mesh.source_vertex_count ||
        model.source_face_count != mesh.source_face_count) {
      tell(WorkstationRule::kSourceCounts, where, &model.triangle_count,
           std::to_string(model.triangle_count) + " triangles of " +
               std::to_string(model.source_face_count) + " faces and " +
               std::to_string(model.source_vertex_count) + " vertices, the source gives " +
               std::to_string(mesh.triangles.size()) + " of " +
               std::to_string(mesh.source_face_count) + " and " +
               std::to_string(mesh.source_vertex_count));
    }
    if (!fit.same_bytes) {
      tell(WorkstationRule::kSourceBytes, where, &model, "");
    }
  }

  static std::string_view texture_of(const BundleView& bundle, const MaterialRecord& material) {
    if (material.texture == kNone) return "none";
    return bundle.name(bundle.textures()[material.texture].name);
  }

  /// Of each of a model's materials.
  static std::vector<std::uint64_t> triangle_counts(const BundleView& bundle,
                                                    const ModelRecord& model) {
    std::vector<std::uint64_t> counts(model.material_count, 0);
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
      counts[chunk.material - model.first_material] +=
          bundle.levels()[chunk.first_level].index_count / 3;
    }
    return counts;
  }

  /// Materials by their order: names, colours, textures, and how many triangles each has.
  void check_materials(const ModelRecord& model) {
    const ModelRecord* other = namesake(again_.models(), model.name);
    if (other == nullptr) return;
    const auto count = std::min(model.material_count, other->material_count);
    const std::vector<std::uint64_t> ours = triangle_counts(bundle_, model);
    const std::vector<std::uint64_t> theirs = triangle_counts(again_, *other);
    for (std::uint32_t m = 0; m < count; ++m) {
      const MaterialRecord& a = bundle_.materials()[model.first_material + m];
      const MaterialRecord& b = again_.materials()[other->first_material + m];
      const std::string where = label("model", model.name) + ", " + label("material", a.name);
      const std::string_view our_texture = texture_of(bundle_, a);
      const std::string_view their_texture = texture_of(again_, b);
      if (our_texture != their_texture) {
        tell(WorkstationRule::kSourceColour, where, &a.texture,
             "its texture is '" + std::string(our_texture) + "', the source's is '" +
                 std::string(their_texture) + "'");
      }
      if (std::memcmp(a.ambient, b.ambient,
                      offsetof(MaterialRecord, texture) - offsetof(MaterialRecord, ambient)) != 0 ||
          a.flags != b.flags) {
        tell(WorkstationRule::kSourceColour, where, &a, "its colours are not the source's");
      }
      if (ours[m] != theirs[m]) {
        tell(WorkstationRule::kSourceColour, where, &a,
             "it has " + std::to_string(ours[m]) + " triangles, the source's has " +
                 std::to_string(theirs[m]));
      }
    }
  }

  /// Scenes of assets whose sources are given, as the bundle states that they were asked for.
  void check_scenes() {
    if (bundle_.scenes().size() < again_.scenes().size()) {
      tell(WorkstationRule::kSourceScene, "scenes", bundle_.bytes().data(),
           "it has " + std::to_string(bundle_.scenes().size()) + ", and was baked with " +
               std::to_string(again_.scenes().size()));
    }
    for (std::uint32_t s = 0; s < bundle_.scenes().size(); ++s) {
      const SceneRecord& scene = bundle_.scenes()[s];
      const PatternRecord& pattern = bundle_.patterns()[scene.pattern];
      const ModelRecord& model = bundle_.models()[scene.model];
      if (namesake(again_.patterns(), pattern.name) == nullptr ||
          namesake(again_.models(), model.name) == nullptr) {
        continue;
      }
      const std::string where =
          "scene " + std::to_string(s) + ", " + label("pattern", pattern.name);
      std::uint32_t other = 0;
      for (; other < again_.scenes().size(); ++other) {
        const SceneRecord& its = again_.scenes()[other];
        if (again_.name(again_.patterns()[its.pattern].name) == bundle_.name(pattern.name) &&
            again_.name(again_.models()[its.model].name) == bundle_.name(model.name) &&
            same_place(scene, its)) {
          break;
        }
      }
      if (other < again_.scenes().size()) {
        check_lighting(s, other, where);
        continue;
      }
      tell(WorkstationRule::kSourceScene, where, &scene,
           "scale " + std::to_string(scene.scale) + ", offset " + std::to_string(scene.offset[0]) +
               " " + std::to_string(scene.offset[1]) + " " + std::to_string(scene.offset[2]));
    }
  }

  static const LightRecord* light_of(const BundleView& bundle, std::uint32_t scene) {
    const Table<LightRecord> lights = bundle.lights();
    for (const LightRecord& light : lights) {
      if (light.scene == scene) return &light;
    }
    return nullptr;
  }

  /// The light and the shadow of a scene whose model stands as in the source's.
  void check_lighting(std::uint32_t scene, std::uint32_t other, const std::string& where) {
    const LightRecord* ours = light_of(bundle_, scene);
    const LightRecord* theirs = light_of(again_, other);
    const SceneRecord* place = &bundle_.scenes()[scene];
    if (ours != nullptr && theirs == nullptr) {  // its picture is not among the sources
      return tell(WorkstationRule::kSourceMissing, where + ", light", ours, "");
    }
    if (ours == nullptr && theirs != nullptr) {
      return tell(WorkstationRule::kSourceScene, where, place, "its light is missing");
    }
    if (ours != nullptr && !same_light(*ours, *theirs)) {
      tell(WorkstationRule::kSourceScene, where, ours, "its light is not that of its picture");
    }
    const std::string fault = shadow_fault(bundle_.section(SectionType::kShadow, scene),
                                           again_.section(SectionType::kShadow, other));
    if (!fault.empty()) tell(WorkstationRule::kSourceScene, where, place, fault);
  }

  static bool same_light(const LightRecord& a, const LightRecord& b) {
    const auto near = [](const auto& x, const auto& y) {
      return std::equal(std::begin(x), std::end(x), std::begin(y), [](float p, float q) {
        return std::fabs(p - q) <= kLightSlack * std::max(1.0f, std::fabs(q));
      });
    };
    return near(a.sky, b.sky) && near(a.key, b.key) && near(a.direction, b.direction);
  }

  /// How a shadow differs from the one baked again; empty where nobody sees it.
  static std::string shadow_fault(std::span<const std::byte> ours,
                                  std::span<const std::byte> theirs) {
    if (ours.empty() != theirs.empty()) {
      return ours.empty() ? "its shadow is missing" : "the source gives no shadow";
    }
    if (equal(ours, theirs)) return "";
    ShadowHeader a{};
    ShadowHeader b{};
    std::memcpy(&a, ours.data(), sizeof a);
    std::memcpy(&b, theirs.data(), sizeof b);
    const auto near = [](float x, float y) {
      return std::fabs(x - y) <= kLightSlack * std::max(1.0f, std::fabs(y));
    };
    const bool place = near(a.low[0], b.low[0]) && near(a.low[1], b.low[1]) &&
                       near(a.high[0], b.high[0]) && near(a.high[1], b.high[1]);
    if (!place || ours.size() != theirs.size())
      return "its shadow has another position than the source's";
    double sum = 0;
    int worst = 0;
    for (std::size_t i = sizeof a; i < ours.size(); ++i) {
      const int off = std::abs(std::to_integer<int>(ours[i]) - std::to_integer<int>(theirs[i]));
      sum += off;
      worst = std::max(worst, off);
    }
    const double mean = sum / static_cast<double>(ours.size() - sizeof a);
    if (mean <= kShadeSlack && worst > kTexelSlack) {
      return "a texel of its shadow is off by " + std::to_string(worst) + " of 255";
    }
    if (mean <= kShadeSlack) return "";
    return "its shadow is off by " + std::to_string(mean) + " of 255 on average";
  }

  static bool same_place(const SceneRecord& a, const SceneRecord& b) {
    const auto near = [](float x, float y) {
      return std::fabs(x - y) <= kSceneSlack * std::max(1.0f, std::fabs(y));
    };
    float turn = 0;
    for (std::size_t i = 0; i < 4; ++i) turn += a.rotation[i] * b.rotation[i];
    return near(a.scale, b.scale) && near(a.offset[0], b.offset[0]) &&
           near(a.offset[1], b.offset[1]) && near(a.offset[2], b.offset[2]) &&
           std::fabs(turn) >= 1.0f - kSceneSlack;
  }

  void note(bool same, const std::string& where, const void* place) {
    (same ? fit_.same : fit_.different).push_back(where);
    if (!same) tell(WorkstationRule::kSourceBytes, where, place, "");
  }

  /// A texture's greatest level.
  static RgbaImage picture_of(const BundleView& bundle, std::uint32_t index) {
    const TextureRecord& texture = bundle.textures()[index];
    const TextureLevelRecord& level = bundle.texture_levels()[texture.first_level];
    return decode_texture(static_cast<TextureFormat>(texture.format),
                          part(bundle.texture_data(index), level.offset, level.size), texture.width,
                          texture.height);
  }

  void check_texture(std::uint32_t index) {
    const TextureRecord& texture = bundle_.textures()[index];
    const std::string where = label("texture", texture.name);
    const std::uint32_t which = number_of_namesake(again_.textures(), texture.name);
    if (which == kNone) return missing("texture", texture.name, &texture);
    const TextureRecord& other = again_.textures()[which];
    const bool same = equal(bundle_.texture_data(index), again_.texture_data(which));
    note(same, where, &texture);
    if (same) return check_texture_levels(texture, other, where);
    const RgbaImage ours = picture_of(bundle_, index);
    const RgbaImage theirs = picture_of(again_, which);
    const bool size = ours.width == theirs.width && ours.height == theirs.height;
    const double psnr = size ? psnr_db(ours, theirs) : 0.0;
    // Textures that look alike may have changed places.
    for (std::uint32_t t = 0; t < again_.textures().size(); ++t) {
      const TextureRecord& third = again_.textures()[t];
      if (t == which || third.width != ours.width || third.height != ours.height) continue;
      const RgbaImage rival = picture_of(again_, t);
      if (psnr_db(ours, rival) <= psnr) continue;
      return tell(WorkstationRule::kSourceColour, where, &texture,
                  "it is nearer to texture '" + std::string(again_.name(third.name)) + "'");
    }
    if (psnr >= kLeastTexturePsnr) {
      const double worst = worst_block(ours, theirs);
      if (worst <= kBlockSlack) return;
      return tell(WorkstationRule::kSourceColour, where, &texture,
                  "one of its blocks is off by " + std::to_string(worst) + " of 255");
    }
    tell(WorkstationRule::kSourceColour, where, &texture,
         size ? std::to_string(psnr) + " dB from the picture, baked again"
              : "baked again it has another size");
  }

  /// The greatest mean difference of a block of 4 x 4 pixels, of 255, between pictures of one size.
  static double worst_block(const RgbaImage& a, const RgbaImage& b) {
    constexpr std::uint32_t kSide = 4;
    const std::uint32_t columns = (a.width + kSide - 1) / kSide;
    std::vector<int> sums(std::size_t{columns} * ((a.height + kSide - 1) / kSide), 0);
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
      const std::size_t pixel = i / 4;
      const std::size_t block = pixel / a.width / kSide * columns + pixel % a.width / kSide;
      if (i % 4 != 3) sums[block] += std::abs(int{a.pixels[i]} - int{b.pixels[i]});
    }
    return sums.empty() ? 0.0
                        : static_cast<double>(*std::max_element(sums.begin(), sums.end())) /
                              (3 * kSide * kSide);
  }

  /// Of a texture that has the same blocks: they are shown as the source's are.
  void check_texture_levels(const TextureRecord& texture, const TextureRecord& other,
                            const std::string& where) {
    const auto near = [](float a, float b) { return std::fabs(a - b) <= kQualitySlack; };
    bool same = texture.width == other.width && texture.height == other.height &&
                texture.flags == other.flags && texture.format == other.format &&
                texture.source_width == other.source_width &&
                texture.source_height == other.source_height &&
                near(texture.psnr_db, other.psnr_db) && near(texture.ssim, other.ssim) &&
                texture.level_count == other.level_count;
    for (std::uint32_t i = 0; same && i < texture.level_count; ++i) {
      const TextureLevelRecord& a = bundle_.texture_levels()[texture.first_level + i];
      const TextureLevelRecord& b = again_.texture_levels()[other.first_level + i];
      same = a.offset == b.offset && a.alpha_offset == b.alpha_offset &&
             near(a.psnr_db, b.psnr_db) && near(a.ssim, b.ssim);
    }
    if (same) return;
    tell(WorkstationRule::kSourceColour, where, &texture,
         "its blocks are the source's, and what it states of them is not");
  }

  void check_pattern(std::uint32_t index) {
    const PatternRecord& pattern = bundle_.patterns()[index];
    const std::uint32_t which = number_of_namesake(again_.patterns(), pattern.name);
    if (which == kNone) return missing("pattern", pattern.name, &pattern, strange_pattern_);
    const PatternRecord& other = again_.patterns()[which];
    bool same = pattern.width == other.width && pattern.height == other.height;
    for (const ParameterSetRecord& each : again_.parameter_sets()) {
      const std::uint32_t set = each.id;
      const auto features = again_.section(SectionType::kMappedFeatures, which, set);
      same = same && (features.empty() ||
                      equal(bundle_.section(SectionType::kMappedFeatures, index, set), features));
    }
    const auto record = bundle_.section(SectionType::kTrackerRecord, index);
    const auto record_again = again_.section(SectionType::kTrackerRecord, which);
    const bool same_record = record.empty() || record_again.empty() || equal(record, record_again);
    note(same && same_record, label("pattern", pattern.name), &pattern);
    const std::string fault = same_record ? "" : record_fault(record, record_again);
    if (!fault.empty()) {
      tell(WorkstationRule::kSourcePattern, label("pattern", pattern.name), &pattern, fault);
    }
    if (!equal(bundle_.section(SectionType::kPatternShape, index),
               again_.section(SectionType::kPatternShape, which))) {
      tell(WorkstationRule::kSourcePattern, label("pattern", pattern.name), &pattern,
           "its shape is not the source's");
    }
    if (!same_colours(bundle_.section(SectionType::kPatternColours, index),
                      again_.section(SectionType::kPatternColours, which))) {
      tell(WorkstationRule::kSourcePattern, label("pattern", pattern.name), &pattern,
           "its colours, by which light is measured, are not the source's");
    }
    const double width = other.width_mm;
    if (width <= 0 || std::fabs(pattern.width_mm / width - 1) <= kWidthSlack) return;
    tell(WorkstationRule::kSourcePattern, label("pattern", pattern.name), &pattern,
         std::to_string(pattern.width_mm) + " mm wide, the source is " + std::to_string(width));
  }

  /// Within what another decoder of the same picture may give. A bundle that was baked before there
  /// were any has none.
  static bool same_colours(std::span<const std::byte> ours, std::span<const std::byte> theirs) {
    if (ours.empty()) return true;
    if (ours.size() != theirs.size() ||
        !equal(ours.first(sizeof(ColourGridHeader)), theirs.first(sizeof(ColourGridHeader)))) {
      return false;
    }
    for (std::size_t i = sizeof(ColourGridHeader); i + 1 < ours.size(); i += 2) {
      const int off = load_number<std::uint16_t>(ours.data() + i) -
                      load_number<std::uint16_t>(theirs.data() + i);
      if (std::abs(off) > kCellSlack) return false;
    }
    return true;
  }

  /// How the image or the codes of a tracker record differ from those baked again; empty where
  /// another version of the baker may have made them.
  static std::string record_fault(std::span<const std::byte> ours,
                                  std::span<const std::byte> theirs) {
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
    if (square > 255.0 * 255.0 / std::pow(10.0, kLeastTexturePsnr / 10)) {
      return "its image differs from the source's by " + std::to_string(std::sqrt(square)) +
             " gray levels";
    }
    const double share = known_share(a, b);
    if (share >= kLeastKnownCodes) return "";
    return "only " + std::to_string(static_cast<int>(100 * share)) +
           " percent of its codes are like the source's at their place";
  }

  static std::size_t code_distance(const TrackerRecordView& a, std::size_t i,
                                   const TrackerRecordView& b, std::size_t j) {
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
  static double known_share(const TrackerRecordView& a, const TrackerRecordView& b) {
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
            return code_distance(a, i, b, entry.second) <= kSimilarBits;
          });
        }
      }
      known += found ? 1 : 0;
    }
    return static_cast<double>(known) / static_cast<double>(a.features.size());
  }

  const BundleView& bundle_;
  const IssueSink& sink_;
  BundleView again_;            ///< baked from the sources
  std::vector<bool> blended_;   ///< whether its materials are seen through
  bool strange_model_ = false;  ///< a source whose name no model of the bundle has
  bool strange_pattern_ = false;
  SourceFit fit_;
};

}  // namespace

Result<SourceFit> check_source(const BundleView& bundle, const BakeRequest& request,
                               const IssueSink& sink, Report& report) {
  return SourceCheck(bundle, sink).run(request, report);
}

}  // namespace modar
