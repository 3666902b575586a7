// Rebakes, compares, measures.
#include "bake/check/source_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/check/verdict.hpp"
#include "bake/import/read_model.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/mesh/triangle_tree.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/texture/texture_codec.hpp"

namespace modar {
namespace {

/// Samples of a surface that are measured at most; great models are sampled evenly.
constexpr std::size_t kMaxSamples = 400000;
/// Distances are measured between rounded numbers: this share of the diagonal is theirs.
constexpr double kRounding = 1e-12;
/// Vertex colours are 8 bits; nearest points may lie a little beside their vertex.
constexpr double kColourLimit = 4.0 / 255.0;
/// Two encodings of one texture that differ more are not of one picture.
constexpr double kLeastTexturePsnr = 30.0;

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
    const auto base = static_cast<std::uint32_t>(surface.positions.size());
    for (std::uint32_t v = 0; v < level.vertex_count; ++v) {
      const std::byte* vertex =
          bundle.vertices().data() + level.vertex_offset + std::size_t{v} * decoder.stride();
      surface.positions.push_back(center + model.scale * decoder.position(vertex, chunk));
      if (decoder.has(Semantic::kColour)) surface.colours.push_back(decoder.colour(vertex));
    }
    const auto* indices =
        reinterpret_cast<const std::uint16_t*>(bundle.indices().data() + level.index_offset);
    for (std::uint32_t i = 0; i < level.index_count; i += 3) {
      surface.triangles.push_back(
          {base + indices[i], base + indices[i + 1], base + indices[i + 2]});
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

/// Greatest difference of a vertex's colour from the source's at the nearest point.
double colour_error(const Surface& bundle, const Surface& source, TriangleTree& tree) {
  if (bundle.colours.empty() || source.colours.empty()) return 0;
  const std::size_t step = (bundle.positions.size() + kMaxSamples - 1) / kMaxSamples;
  double greatest = 0;
  for (std::size_t i = 0; i < bundle.positions.size(); i += step) {
    tree.nearest(bundle.positions[i]);
    double least = 1;
    for (const std::uint32_t v : tree.last_triangle()) {
      const glm::dvec4 off = glm::abs(bundle.colours[i] - source.colours[v]);
      least = std::min(least, std::max({off.x, off.y, off.z}));
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

  Result<SourceFit> run(const BakeRequest& request, Report& report) {
    MODAR_ASSIGN(const BundleContent content, build_bundle(request, report));
    again_ = &content;
    for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) {
      const ModelRecord& model = bundle_.models()[m];
      const auto path = std::find_if(
          request.models.begin(), request.models.end(),
          [&](const std::string& p) { return file_stem(p) == bundle_.name(model.name); });
      if (path == request.models.end()) {
        missing("model", model.name, &model);
        continue;
      }
      MODAR_TRY(check_model(model, *path, request.jobs, report));
    }
    for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) check_texture(t);
    for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) check_pattern(p);
    return std::move(fit_);
  }

 private:
  void tell(WorkstationRule rule, const std::string& where, const void* place, std::string detail) {
    sink_(Issue{
        &workstation_issue_kind(rule), where,
        static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - bundle_.bytes().data()),
        std::move(detail)});
  }

  [[nodiscard]] std::string label(const char* what, NameRef name) const {
    return what + (" '" + std::string(bundle_.name(name)) + "'");
  }

  void missing(const char* what, NameRef name, const void* place) {
    tell(WorkstationRule::kSourceMissing, label(what, name), place, "");
  }

  [[nodiscard]] std::string_view name_again(NameRef name) const {
    return std::string_view(again_->names).substr(name.offset, name.length);
  }

  template <class T>
  const T* namesake(const std::vector<T>& records, NameRef name) const {
    const auto found = std::find_if(records.begin(), records.end(), [&](const T& other) {
      return name_again(other.name) == bundle_.name(name);
    });
    return found != records.end() ? &*found : nullptr;
  }

  [[nodiscard]] bool same_level(const LevelRecord& a, const LevelRecord& b,
                                std::uint64_t stride) const {
    return a.vertex_count == b.vertex_count && a.index_count == b.index_count &&
           equal(part(bundle_.vertices(), a.vertex_offset, a.vertex_count * stride),
                 part(again_->vertices, b.vertex_offset, b.vertex_count * stride)) &&
           equal(part(bundle_.indices(), a.index_offset, 2ull * a.index_count),
                 part(again_->indices, b.index_offset, 2ull * b.index_count));
  }

  [[nodiscard]] bool same_model(const ModelRecord& model) const {
    const ModelRecord* other = namesake(again_->models, model.name);
    if (other == nullptr || other->chunk_count != model.chunk_count) return false;
    const LayoutRecord& layout = bundle_.layouts()[model.layout];
    if (std::memcmp(&layout, &again_->layouts[other->layout], sizeof layout) != 0) return false;
    // From the centre to the counts: placement, errors, counts.
    constexpr std::size_t kFrom = offsetof(ModelRecord, center);
    constexpr std::size_t kSize = offsetof(ModelRecord, layout) - kFrom;
    if (std::memcmp(&model.center, &other->center, kSize) != 0) return false;
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const ChunkRecord& a = bundle_.chunks()[model.first_chunk + c];
      const ChunkRecord& b = again_->chunks[other->first_chunk + c];
      if (std::memcmp(&a, &b, offsetof(ChunkRecord, material)) != 0) return false;
      if (a.level_count != b.level_count) return false;
      for (std::uint32_t l = 0; l < a.level_count; ++l) {
        if (!same_level(bundle_.levels()[a.first_level + l], again_->levels[b.first_level + l],
                        layout.stride)) {
          return false;
        }
      }
    }
    return true;
  }

  Result<void> check_model(const ModelRecord& model, const std::string& path, unsigned jobs,
                           Report& report) {
    Report quiet;
    MODAR_ASSIGN(SourceModel source, read_model(path, jobs));
    MODAR_ASSIGN(const TriMesh mesh, weld(std::move(source), quiet, {jobs}));
    StageTimer timer(report, "measure");
    const Surface ours = surface_of(bundle_, model);
    const Surface theirs = surface_of(mesh);
    TriangleTree our_tree(ours.positions, ours.triangles);
    TriangleTree their_tree(theirs.positions, theirs.triangles);
    ModelFit fit;
    fit.name = bundle_.name(model.name);
    fit.same_bytes = same_model(model);
    fit.stated_error = model.position_error_max;
    fit.source_to_bundle = greatest_distance(theirs, our_tree);
    fit.bundle_to_source = greatest_distance(ours, their_tree);
    fit.colour_error = colour_error(ours, theirs, their_tree);
    timer.done(theirs.positions.size(), ours.positions.size(),
               std::max(fit.source_to_bundle, fit.bundle_to_source));
    judge_model(model, mesh, fit);
    fit_.models.push_back(fit);
    return {};
  }

  void judge_model(const ModelRecord& model, const TriMesh& mesh, const ModelFit& fit) {
    const std::string where = label("model", model.name);
    const double limit =
        fit.stated_error + kRounding * (model.diagonal + glm::length(mesh.placement.center));
    if (!(fit.source_to_bundle <= limit && fit.bundle_to_source <= limit)) {
      tell(WorkstationRule::kSourceSurface, where, &model.position_error_max,
           "the source lies up to " + std::to_string(fit.source_to_bundle) +
               " beside the bundle, the bundle up to " + std::to_string(fit.bundle_to_source) +
               " beside the source, " + std::to_string(fit.stated_error) + " is stated");
    }
    if (fit.colour_error > kColourLimit) {
      tell(WorkstationRule::kSourceColour, where, &model,
           "a vertex is off by " + std::to_string(fit.colour_error));
    }
    if (model.triangle_count != mesh.triangles.size() ||
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

  void note(bool same, const std::string& where, const void* place) {
    (same ? fit_.same : fit_.different).push_back(where);
    if (!same) tell(WorkstationRule::kSourceBytes, where, place, "");
  }

  void check_texture(std::uint32_t index) {
    const TextureRecord& texture = bundle_.textures()[index];
    const std::string where = label("texture", texture.name);
    const TextureRecord* other = namesake(again_->textures, texture.name);
    if (other == nullptr) return missing("texture", texture.name, &texture);
    const auto& data =
        again_->texture_data[static_cast<std::size_t>(other - again_->textures.data())];
    const bool same = equal(bundle_.texture_data(index), data);
    note(same, where, &texture);
    if (same) return;
    const auto picture = [](const TextureRecord& t, const TextureLevelRecord& level,
                            std::span<const std::byte> bytes) {
      return decode_texture(static_cast<TextureFormat>(t.format),
                            part(bytes, level.offset, level.size), t.width, t.height);
    };
    const RgbaImage ours = picture(texture, bundle_.texture_levels()[texture.first_level],
                                   bundle_.texture_data(index));
    const RgbaImage theirs = picture(*other, again_->texture_levels[other->first_level], data);
    const bool size = ours.width == theirs.width && ours.height == theirs.height;
    const double psnr = size ? psnr_db(ours, theirs) : 0.0;
    if (psnr >= kLeastTexturePsnr) return;
    tell(WorkstationRule::kSourceColour, where, &texture,
         size ? std::to_string(psnr) + " dB from the picture, baked again"
              : "baked again it has another size");
  }

  void check_pattern(std::uint32_t index) {
    const PatternRecord& pattern = bundle_.patterns()[index];
    const PatternRecord* other = namesake(again_->patterns, pattern.name);
    if (other == nullptr) return missing("pattern", pattern.name, &pattern);
    bool same = pattern.width == other->width && pattern.height == other->height;
    const auto& list = again_->features[static_cast<std::size_t>(other - again_->patterns.data())];
    for (const FeatureContent& features : list) {
      const FeatureView view = bundle_.features(index, features.set_id);
      same = same &&
             equal(std::as_bytes(view.keypoints), std::as_bytes(std::span(features.keypoints))) &&
             equal(view.descriptors, features.descriptors);
    }
    note(same, label("pattern", pattern.name), &pattern);
  }

  const BundleView& bundle_;
  const IssueSink& sink_;
  const BundleContent* again_ = nullptr;
  SourceFit fit_;
};

}  // namespace

Result<SourceFit> check_source(const BundleView& bundle, const BakeRequest& request,
                               const IssueSink& sink, Report& report) {
  return SourceCheck(bundle, sink).run(request, report);
}

}  // namespace modar
