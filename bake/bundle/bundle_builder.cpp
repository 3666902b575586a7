// Runs the stages over every input and merges what they give into one bundle.
#include "bake/bundle/bundle_builder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <glm/geometric.hpp>

#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/light_image.hpp"
#include "bake/bundle/request_check.hpp"
#include "bake/bundle/scene/scene_nodes.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/bundle/scene/scene_shadow.hpp"
#include "bake/import/read_model.hpp"
#include "bake/mesh/draw_order.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/lod/reduce.hpp"
#include "bake/mesh/pack/pack.hpp"
#include "bake/mesh/rays/occlusion.hpp"
#include "bake/mesh/topology/mesh_topology.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/pattern/alike_patterns.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/texture/relief/relief.hpp"
#include "bake/texture/texture_stage.hpp"
#include "formats/base/path.hpp"
#include "formats/colour_grid.hpp"
#include "formats/content_summary.hpp"
#include "formats/pattern_shape.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

std::uint32_t layout_index(const LayoutRecord& layout, BundleContent& content) {
  const auto same = [&](const LayoutRecord& other) {
    return std::equal(reinterpret_cast<const std::byte*>(&layout),
                      reinterpret_cast<const std::byte*>(&layout + 1),
                      reinterpret_cast<const std::byte*>(&other));
  };
  const auto found = std::find_if(content.layouts.begin(), content.layouts.end(), same);
  if (found != content.layouts.end()) {
    return static_cast<std::uint32_t>(found - content.layouts.begin());
  }
  content.layouts.push_back(layout);
  return static_cast<std::uint32_t>(content.layouts.size() - 1);
}

/// Models of one layout are baked alike: all of them have occlusion, or none.
void add_occlusion(std::uint32_t layout, std::uint32_t byte, BundleContent& content) {
  if (byte == kNone) return;
  const auto place = std::ranges::find_if(
      content.occlusion, [&](const OcclusionRecord& other) { return other.layout >= layout; });
  if (place != content.occlusion.end() && place->layout == layout) return;
  content.occlusion.insert(place, {layout, byte});
}

/// A texture of one colour becomes a factor of the material, which the shader multiplies alike.
void fold_constant(const std::array<std::uint8_t, 4>& rgba, MaterialRecord& material) {
  for (std::size_t i = 0; i < 3; ++i) {
    const float factor = static_cast<float>(rgba[i]) / 255.0f;
    material.diffuse[i] *= factor;
    material.ambient[i] *= factor;
  }
  material.opacity *= static_cast<float>(rgba[3]) / 255.0f;
}

/// The first model's bytes are taken over as they are: large ones are not copied.
void append_bytes(std::vector<std::byte> bytes, std::vector<std::byte>& to) {
  if (to.empty()) {
    to = std::move(bytes);
  } else {
    to.insert(to.end(), bytes.begin(), bytes.end());
  }
}

/// Appends chunks and levels of a mesh to these and its bytes to those of the content, shifting
/// what counts from the mesh's own start.
void append_geometry(PackedMesh packed, std::uint32_t first_material,
                     std::vector<ChunkRecord>& chunks, std::vector<LevelRecord>& levels,
                     BundleContent& content) {
  const auto first_level = static_cast<std::uint32_t>(levels.size());
  for (ChunkRecord chunk : packed.chunks) {
    chunk.material += first_material;
    chunk.first_level += first_level;
    chunks.push_back(chunk);
  }
  for (LevelRecord level : packed.levels) {
    level.vertex_offset += content.vertices.size();
    level.index_offset += content.indices.size();
    levels.push_back(level);
  }
  append_bytes(std::move(packed.vertices), content.vertices);
  append_bytes(std::move(packed.indices), content.indices);
  // Keeps the next mesh's vertices on a 4-byte boundary.
  content.indices.resize((content.indices.size() + 3) / 4 * 4);
}

/// Appends a model's records and bytes.
void merge_model(PackedMesh packed, const std::vector<TextureOutcome>& textures,
                 BundleContent& content) {
  ModelRecord record = packed.record;
  record.name = content.intern(packed.name);
  record.layout = layout_index(packed.layout, content);
  add_occlusion(record.layout, packed.occlusion_byte, content);
  record.first_chunk = static_cast<std::uint32_t>(content.chunks.size());
  record.chunk_count = static_cast<std::uint32_t>(packed.chunks.size());
  record.first_material = static_cast<std::uint32_t>(content.materials.size());
  record.material_count = static_cast<std::uint32_t>(packed.materials.size());
  for (std::size_t m = 0; m < packed.materials.size(); ++m) {
    MaterialRecord material = packed.materials[m];
    material.name = content.intern(packed.sources[m].name);
    material.texture = textures[m].texture;
    if (textures[m].constant) fold_constant(textures[m].rgba, material);
    content.materials.push_back(material);
  }
  append_geometry(std::move(packed), record.first_material, content.chunks, content.levels,
                  content);
  content.models.push_back(record);
}

/// Appends a stand-in of the last model.
void merge_stand_in(PackedMesh packed, BundleContent& content) {
  content.stand_ins.push_back({static_cast<std::uint32_t>(content.models.size() - 1),
                               static_cast<std::uint32_t>(content.stand_in_chunks.size()),
                               static_cast<std::uint32_t>(packed.chunks.size()), 0});
  append_geometry(std::move(packed), content.models.back().first_material, content.stand_in_chunks,
                  content.stand_in_levels, content);
}

/// The order of the last model's triangles that are seen through.
void add_draw_orders(BundleContent& content) {
  const ModelRecord& model = content.models.back();
  const VertexDecoder decoder(content.layouts[model.layout]);
  for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
    const ChunkRecord& chunk = content.chunks[c];
    const LevelRecord& level = content.levels[chunk.first_level];
    const std::size_t count = level.index_count / 3;
    if (!blended(content.materials[chunk.material], content)) continue;
    if (count < 2 || count > kMostOrderedTriangles) continue;
    std::vector<std::array<glm::dvec3, 3>> triangles(count);
    for (std::size_t i = 0; i < 3 * count; ++i) {
      std::uint16_t index = 0;
      std::memcpy(&index, content.indices.data() + level.index_offset + 2 * i, sizeof index);
      const std::byte* vertex =
          content.vertices.data() + level.vertex_offset + std::size_t{index} * decoder.stride();
      triangles[i / 3][i % 3] = decoder.position(vertex, chunk);
    }
    const std::vector<DrawOrderRecord> nodes = draw_order(triangles);
    const auto bytes = std::as_bytes(std::span(nodes));
    ExtraSection section;
    section.type = static_cast<std::uint32_t>(SectionType::kDrawOrder);
    section.owner = c;
    section.bytes.assign(bytes.begin(), bytes.end());
    content.extra.push_back(std::move(section));
  }
}

/// A model that is welded and waits for its textures, which other models may share.
struct WeldedModel {
  TriMesh mesh;
  std::vector<std::uint32_t> uses;  ///< of textures, one a material
};

/// Notes the files that a model refers to. Images from inside a file lie in temporary files.
void note_files(const SourceModel& source, std::vector<std::string>& files) {
  files.insert(files.end(), source.files.begin(), source.files.end());
  for (const SourceMaterial& material : source.materials) {
    if (material.keeper != nullptr) continue;
    for (const std::string& map :
         {material.diffuse_map, material.alpha_map, material.normal.path}) {
      if (!map.empty()) files.push_back(map);
    }
  }
}

/// May a picture that is named as the model be its texture? Not where that name is a pattern's.
bool own_picture(const ModelRequest& model, const BakeRequest& request) {
  return model.own_picture &&
         std::none_of(request.patterns.begin(), request.patterns.end(),
                      [stem = file_stem(model.path)](const PatternRequest& pattern) {
                        return is_own_picture(file_stem(pattern.path), stem);
                      });
}

Result<WeldedModel> read_and_weld(const ModelRequest& model, const BakeRequest& request,
                                  TextureUses& textures, Report& report, BakeTrace& trace) {
  StageTimer reading(report, "read");
  Result<SourceModel> source = read_model(model.path, {request.jobs, own_picture(model, request)});
  if (!source) return tl::unexpected(source.error());
  source->name = model.name;
  report.diagnostics.insert(report.diagnostics.end(), source->diagnostics.begin(),
                            source->diagnostics.end());
  note_files(*source, trace.files);
  reading.done(source->positions.size(), source->face_count());
  Result<TriMesh> mesh = weld(std::move(*source), report, {request.jobs});
  if (!mesh) {
    mesh.error().where = model.path;  // it has the model's name only
    return tl::unexpected(mesh.error());
  }
  report.uprights.push_back(request.up ? Upright{*request.up, UpReason::kAsked} : find_up(*mesh));
  if (request.topology) {
    TopologyOptions options;
    options.jobs = request.jobs;
    options.half_edge_bytes = request.memory_bytes / 4;
    report.topologies.push_back(measure_topology(*mesh, options, report));
  }
  if (request.most_triangles != 0) {
    *mesh = reduce(std::move(*mesh), request.most_triangles, report);
  }
  MODAR_TRY(draw_relief(
      *mesh,
      {rotation_of(report.uprights.back().axis, {}), request.textures.max_side, request.jobs},
      report));
  WeldedModel welded{std::move(*mesh), {}};
  welded.uses = collect_textures(welded.mesh, textures);
  return welded;
}

/// The greatest error that is asked for, in a model's source units; 0: any.
Result<double> max_error_of(const BakeRequest& request, const TriMesh& mesh) {
  switch (request.max_error.unit) {
    case MaxError::Unit::kAny:
      return 0.0;
    case MaxError::Unit::kSource:
      return request.max_error.value;
    case MaxError::Unit::kPercent:
      return request.max_error.value / 100.0 * glm::length(mesh.source_max - mesh.source_min);
    case MaxError::Unit::kMetres:
      break;
  }
  if (!(request.unit_metres > 0)) {
    return fail(ExitCode::kUsage, "bake.max-error-unit", "--max-error",
                "it has a unit, but the unit of the models is unknown",
                "state it with --unit, or give the error in source units or percent");
  }
  return request.max_error.value / request.unit_metres;
}

/// Of the mean edge: beyond it, half floats bend what triangles show. Between a scan of 0.1 million
/// triangles, which has 2 %, and one of 0.9 million, which has 7 %.
constexpr double kVisibleError = 0.05;

/// Says how positions are stored where the user did not: floats, or half floats that 16-bit
/// integers would be better than.
void tell_positions(const ChunkedMesh& mesh, const PackedMesh& packed, const PositionPlan& plan,
                    const BakeRequest& request, Report& report) {
  char text[256];
  std::string cure;
  if (plan.kind == PositionKind::kFloat) {
    std::snprintf(text, sizeof text,
                  "positions are stored as floats, %u bytes a vertex: no grid of 16-bit integers "
                  "is as fine as was asked and spans the longest triangle",
                  packed.layout.stride);
    cure = "a larger --max-error needs fewer bytes";
  } else {
    const double edge = plan.mean_edge * mesh.mesh.placement.scale;
    const double error = packed.record.position_error_max;
    const bool chosen = plan.kind == PositionKind::kHalf && !request.positions;
    if (!chosen || error <= kVisibleError * edge) return;
    const double step = make_grids(mesh, PositionKind::kInt16).front().step;
    std::snprintf(
        text, sizeof text,
        "half floats (%u bytes a vertex) move vertices by up to %.3g, %.0f %% of the mean "
        "edge; 16-bit integers (%u bytes) would move them by at most %.3g",
        packed.layout.stride, error, 100 * error / edge,
        packed.layout.stride - (packed.occlusion_byte == kNone ? 4u : 0u),
        step * std::sqrt(0.75) * mesh.mesh.placement.scale);
    cure = "bake with --positions int16";
  }
  report.diagnostics.push_back(
      {"model.positions", DiagnosticSeverity::kInfo, packed.name, 0, text, cure});
}

/// Phones draw the finest level of models of fewer triangles.
constexpr std::size_t kDrawnWhole = 1'000'000;

/// A model in its bytes.
struct ShapedModel {
  PackedMesh model;
  std::vector<PackedMesh> stand_ins;
};

/// Packs stand-ins, each with the error of the whole.
Result<std::vector<PackedMesh>> pack_stand_ins(const ChunkedMesh& mesh,
                                               const std::vector<StandInStart>& starts,
                                               const StandInOptions& options,
                                               const std::vector<std::uint32_t>& texture_sides,
                                               const PackOptions& pack_options, Report& report) {
  MODAR_ASSIGN(const std::vector<StandIn> made, make_stand_ins(mesh, starts, options, report));
  if (!made.empty()) {
    double& greatest = report.levels.back().position_error_max;
    greatest = std::max(greatest, made.back().error * mesh.mesh.placement.scale);
  }
  std::vector<PackedMesh> all;
  Report quiet;
  double shown = 0;  // never falls, and is never below the truth
  for (const StandIn& stand_in : made) {
    MODAR_ASSIGN(PackedMesh packed, pack(stand_in.mesh, texture_sides, pack_options, quiet));
    shown = std::max({shown, stand_in.error, stand_in.shading});
    const float error = std::nextafter(static_cast<float>(shown), 4.0f);
    for (LevelRecord& level : packed.levels) level.error = error;
    all.push_back(std::move(packed));
  }
  return all;
}

/// Splits and packs a model as finely as was asked.
Result<ShapedModel> shape_model(TriMesh mesh, const std::vector<std::uint32_t>& texture_sides,
                                const BakeRequest& request, Report& report) {
  const Result<double> max_error = max_error_of(request, mesh);
  if (!max_error) return tl::unexpected(max_error.error());
  const Result<PositionPlan> plan = plan_positions(mesh, {request.positions, *max_error});
  if (!plan) return tl::unexpected(plan.error());
  ChunkOptions chunk_options;
  chunk_options.max_side = plan->max_side;
  chunk_options.max_vertices = chunk_vertices_for(mesh.positions.size());
  Result<ChunkedMesh> chunked = chunk(std::move(mesh), chunk_options, report);
  if (!chunked) return tl::unexpected(chunked.error());
  if (request.occlusion) {
    chunked->mesh.occlusion = measure_occlusion(*chunked, request.jobs, report);
  }
  LevelOptions level_options;
  level_options.levels = request.levels;
  level_options.positions = plan->kind;
  level_options.jobs = request.jobs;
  level_options.texture_sides = texture_sides;
  const StandInPlan stand_ins = plan_stand_ins(*chunked, level_options);
  if (!stand_ins.halvings.empty()) level_options.most_halvings = stand_ins.halvings[0] - 1;
  level_options.start = stand_ins.start;
  MODAR_ASSIGN(const std::vector<StandInStart> starts,
               make_levels(*chunked, level_options, report));
  PackOptions pack_options;
  pack_options.unit_metres = request.unit_metres;
  pack_options.positions = plan->kind;
  pack_options.jobs = request.jobs;
  ShapedModel shaped;
  MODAR_ASSIGN(shaped.stand_ins, pack_stand_ins(*chunked, starts, {stand_ins, plan->kind},
                                                texture_sides, pack_options, report));
  const bool one_chunk = chunked->chunks.size() == 1 && !shaped.stand_ins.empty();
  drop_alike_levels(*chunked, one_chunk ? shaped.stand_ins[0].levels[0].error
                                        : std::numeric_limits<double>::infinity());
  // Smaller models are drawn whole, and chunks that share a range are drawn in one call.
  pack_options.prefixes = triangles_in(*chunked) > kDrawnWhole;
  MODAR_ASSIGN(shaped.model, pack(*chunked, texture_sides, pack_options, report));
  tell_positions(*chunked, shaped.model, *plan, request, report);
  return shaped;
}

Result<void> add_model(WeldedModel welded, const std::vector<TextureOutcome>& outcomes,
                       const BakeRequest& request, BundleContent& content, Report& report) {
  std::vector<TextureOutcome> textures(welded.uses.size());
  std::vector<std::uint32_t> sides(welded.uses.size(), 0);
  for (std::size_t m = 0; m < welded.uses.size(); ++m) {
    if (welded.uses[m] != kNone) textures[m] = outcomes[welded.uses[m]];
    sides[m] = textures[m].side;
    welded.mesh.materials[m].see_through =
        textures[m].texture != kNone &&
        (content.textures[textures[m].texture].flags & kTextureAlpha) != 0;
  }
  std::vector<bool> seen_through;
  for (std::size_t m = 0; m < textures.size(); ++m) {
    MaterialRecord material = material_record(welded.mesh.materials[m]);
    material.texture = textures[m].texture;
    if (textures[m].constant) fold_constant(textures[m].rgba, material);
    seen_through.push_back(blended(material, content));
  }
  cut_crossing(welded.mesh, seen_through);
  MODAR_ASSIGN(ShapedModel shaped, shape_model(std::move(welded.mesh), sides, request, report));
  merge_model(std::move(shaped.model), textures, content);
  for (PackedMesh& packed : shaped.stand_ins) merge_stand_in(std::move(packed), content);
  add_draw_orders(content);
  return {};
}

Result<void> add_models(const BakeRequest& request, BundleContent& content, Report& report,
                        BakeTrace& trace) {
  TextureUses textures;
  std::vector<WeldedModel> models;
  for (const ModelRequest& model : request.models) {
    Result<WeldedModel> welded = read_and_weld(model, request, textures, report, trace);
    if (!welded) return tl::unexpected(welded.error());
    const glm::dvec3 box = welded->mesh.source_max - welded->mesh.source_min;
    trace.model_sides.push_back({box.x, box.y, box.z});
    models.push_back(std::move(*welded));
  }
  TextureOptions options = request.textures;
  options.jobs = request.jobs;
  if (request.atlas != AtlasMode::kNever) {
    AtlasOptions atlas = {request.atlas, options, options.max_side};
    atlas.textures.max_side = affordable_side(textures, options, request.texture_budget);
    for (WeldedModel& model : models) {
      MODAR_TRY(make_atlases(atlas, model.mesh, model.uses, textures, report));
    }
  }
  const Result<std::vector<TextureOutcome>> outcomes =
      bake_textures(textures, options, request.texture_budget, content, report);
  if (!outcomes) return tl::unexpected(outcomes.error());
  for (WeldedModel& model : models) {
    if (auto added = add_model(std::move(model), *outcomes, request, content, report); !added) {
      return tl::unexpected(added.error());
    }
  }
  return {};
}

/// Those that the request asks for.
void add_parameter_sets(const BakeRequest& request, BundleContent& content) {
  const std::vector<std::string>& asked = request.parameters;
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    const char* name = parameter_set_name(set.id);
    if (!asked.empty() && std::find(asked.begin(), asked.end(), name) == asked.end()) continue;
    ParameterSetRecord named = set;
    named.name = content.intern(name);
    content.parameter_sets.push_back(named);
  }
}

Result<void> add_pattern(const PatternRequest& request, const TrackerRecordOptions& loop,
                         BundleContent& content, Report& report, BakeTrace& trace) {
  if (is_target_file(request.path)) {
    MODAR_ASSIGN(trace.files.emplace_back(), target_picture(request.path));
  }
  for (std::string& file : files_of(request.path, request.shape)) {
    trace.files.push_back(std::move(file));
  }
  Result<PatternFeatures> baked = bake_pattern(request.path, request.width_mm,
                                               content.parameter_sets, loop, report, request.shape);
  if (!baked) return tl::unexpected(baked.error());
  PatternRecord record = baked->record;
  record.name = content.intern(request.name);
  trace.ranges.push_back(baked->range);
  ExtraSection section;
  section.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
  section.owner = static_cast<std::uint32_t>(content.patterns.size());
  section.bytes = std::move(baked->loop_record);
  content.extra.push_back(std::move(section));
  if (!baked->shape.empty()) {
    ExtraSection shape;
    shape.type = static_cast<std::uint32_t>(SectionType::kPatternShape);
    shape.owner = static_cast<std::uint32_t>(content.patterns.size());
    shape.bytes = std::move(baked->shape);
    content.extra.push_back(std::move(shape));
  } else if (!is_target_file(request.path)) {
    // A target file names a part of a picture, and on what is curved light changes from cell to
    // cell: their light is not estimated.
    ExtraSection colours;
    colours.type = static_cast<std::uint32_t>(SectionType::kPatternColours);
    colours.owner = static_cast<std::uint32_t>(content.patterns.size());
    MODAR_ASSIGN(const RgbaImage picture,
                 read_pattern_picture(request.path, request.width_mm, request.shape));
    colours.bytes = pattern_colours(picture);
    content.extra.push_back(std::move(colours));
  }
  content.patterns.push_back(record);
  content.features.push_back(std::move(baked->features));
  return {};
}

}  // namespace

bool blended(const MaterialRecord& material, const BundleContent& content) {
  if ((material.flags & kMaterialOccluder) != 0) return false;
  if (material.opacity < 1.0f || material.texture == kNone) return material.opacity < 1.0f;
  const std::uint32_t flags = content.textures[material.texture].flags;
  return (flags & kTextureAlpha) != 0 && (flags & kTextureCutOut) == 0;
}

Result<BundleContent> build_bundle(const BakeRequest& request, Report& report, BakeTrace* trace) {
  if (request.models.empty() && request.patterns.empty()) {
    return fail(ExitCode::kUsage, "bake.nothing", "", "there is neither a model nor a pattern",
                "name files with --model and --pattern");
  }
  BakeRequest named = request;
  MODAR_TRY(name_assets(named));
  MODAR_TRY(check_inputs(named));
  MODAR_ASSIGN(const std::vector<KnownScene> scenes, find_scenes(named));

  BundleContent content;
  BakeTrace traced;
  const std::size_t first_up = report.uprights.size();
  MODAR_TRY(add_models(named, content, report, traced));
  if (!named.patterns.empty()) add_parameter_sets(named, content);
  TrackerRecordOptions loop = named.loop;
  loop.jobs = named.jobs;
  for (const PatternRequest& pattern : named.patterns) {
    MODAR_TRY(add_pattern(pattern, loop, content, report, traced));
  }
  for (Diagnostic& alike : alike_patterns(content)) report.diagnostics.push_back(std::move(alike));
  named.scenes.clear();
  for (const KnownScene& known : scenes) {
    const PlacedModel model = {known.model, traced.model_sides[known.model],
                               report.uprights[first_up + known.model].axis};
    MODAR_ASSIGN(SceneRequest resolved, resolve_scene(known.scene, content, known.pattern, model));
    content.scenes.push_back(place_scene(resolved, content, known.pattern, model));
    named.scenes.push_back(std::move(resolved));
  }
  MODAR_TRY(add_nodes(named, content, report));
  MODAR_TRY(light_scenes(named.scenes, named, content, report));
  named.parameters = parameters_of(content);
  content.meta = bundle_meta(named, report, traced);
  content.summary = content_summary_of(content);
  if (trace != nullptr) *trace = std::move(traced);
  return content;
}

Result<void> light_scenes(const std::vector<SceneRequest>& scenes, const BakeRequest& request,
                          BundleContent& content, Report& report) {
  if (scenes.empty()) return {};
  StageTimer timer(report, "light");
  for (std::uint32_t s = 0; s < scenes.size(); ++s) {
    if (scenes[s].light.empty()) continue;
    MODAR_ASSIGN(LightRecord light, read_light(scenes[s].light));
    light.scene = s;
    content.lights.push_back(light);
  }
  content.shadows.resize(request.shadows ? scenes.size() : 0);
  for (std::uint32_t s = 0; s < content.shadows.size(); ++s) {
    const auto shaped = [&](const ExtraSection& section) {
      return section.type == static_cast<std::uint32_t>(SectionType::kPatternShape) &&
             section.owner == content.scenes[s].pattern;
    };
    // A shadow lies in a plane.
    if (std::any_of(content.extra.begin(), content.extra.end(), shaped)) continue;
    content.shadows[s] = scene_shadow(content, s, request.jobs);
  }
  timer.done(content.lights.size(), content.shadows.size());
  return {};
}

}  // namespace modar
