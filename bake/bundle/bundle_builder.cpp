// Runs the stages over every input and merges what they give into one bundle.
#include "bake/bundle/bundle_builder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include <glm/geometric.hpp>

#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/clip_records.hpp"
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
#include "bake/mesh/repair/repair.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/options/options.hpp"
#include "bake/pattern/alike_patterns.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/texture/relief/relief.hpp"
#include "bake/texture/texture_stage.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/shortest_number.hpp"
#include "formats/colour_grid.hpp"
#include "formats/content_summary.hpp"
#include "formats/field_table.hpp"
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
  const auto place = ranges::find_if(
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

/// The first model's bytes are taken over unchanged: large ones are not copied.
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
                 const ModelMovement& movement, BundleContent& content) {
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
  std::vector<std::uint32_t> parts;
  for (const SourceMaterial& source : packed.sources) parts.push_back(source.part);
  const Placement placement = {{record.center[0], record.center[1], record.center[2]},
                               record.scale};
  append_geometry(std::move(packed), record.first_material, content.chunks, content.levels,
                  content);
  content.models.push_back(record);
  add_movement(movement, parts, placement, content);
}

/// Appends a proxy of the last model.
void merge_proxy(PackedMesh packed, BundleContent& content) {
  content.proxies.push_back({static_cast<std::uint32_t>(content.models.size() - 1),
                             static_cast<std::uint32_t>(content.proxy_chunks.size()),
                             static_cast<std::uint32_t>(packed.chunks.size()), 0});
  append_geometry(std::move(packed), content.models.back().first_material, content.proxy_chunks,
                  content.proxy_levels, content);
}

bool moves(const BundleContent& content, std::uint32_t material) {
  return ranges::find(content.parts, material, &PartRecord::material) != content.parts.end();
}

/// The order of the last model's triangles that are seen through, where it is the same at any time.
void add_draw_orders(BundleContent& content) {
  const ModelRecord& model = content.models.back();
  const VertexDecoder decoder(content.layouts[model.layout]);
  for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
    const ChunkRecord& chunk = content.chunks[c];
    const LevelRecord& level = content.levels[chunk.first_level];
    const std::size_t count = level.index_count / 3;
    if (!blended(content.materials[chunk.material], content)) continue;
    if (moves(content, chunk.material)) continue;
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
  ModelMovement movement;
  std::vector<std::uint32_t> uses;  ///< of textures, one a material
};

/// Notes the files that a model refers to. Images from inside a file are in temporary files.
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

/// Of the largest side: twice what half floats may move a vertex by. Less takes more keys.
constexpr double kClipBound = 0x1p-11;

/// The greatest distance that a model's clips may be off, source units.
double clip_bound(const SourceModel& source, const BakeRequest& request) {
  glm::dvec3 low(source.positions[0]);
  glm::dvec3 high(low);
  for (const glm::dvec3& p : source.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::dvec3 sides = high - low;
  const double usual = kClipBound * std::max({sides.x, sides.y, sides.z});
  const MaxError& wanted = request.max_error;
  double bound = usual;
  if (wanted.unit == MaxError::Unit::kSource) bound = wanted.value;
  if (wanted.unit == MaxError::Unit::kPercent) bound = wanted.value / 100 * glm::length(sides);
  if (wanted.unit == MaxError::Unit::kMetres && request.unit_metres > 0) {
    bound = wanted.value / request.unit_metres;
  }
  return std::min(bound, usual);
}

/// Reads a model, with what its clips come to; without them where they move nothing that shows.
Result<SourceModel> read_moving(const ModelRequest& model, const BakeRequest& request,
                                ModelMovement& movement) {
  ReadOptions options = {request.jobs, own_picture(model, request), request.within};
  MODAR_ASSIGN(SourceModel source, read_model(model.path, options));
  source.name = model.name;
  if (source.movement.clips.empty()) return source;
  // A repair cuts and closes what only the pose of the file tears.
  if (!request.repair) {
    movement.fitted =
        fit_movement(source, clip_bound(source, request), request.jobs, source.diagnostics);
  }
  if (movement.fitted.clips.empty()) {
    const std::size_t clips = request.repair ? source.movement.clips.size() : 0;
    options.clips = false;
    MODAR_ASSIGN(source, read_model(model.path, options));
    source.name = model.name;
    if (clips != 0) {
      source.diagnostics.push_back({"model.clips", DiagnosticSeverity::kWarning, model.name, 0,
                                    "--repair cuts the model in its pose and leaves out " +
                                        std::to_string(clips) + (clips == 1 ? " clip" : " clips"),
                                    "bake it without --repair to keep them"});
    }
    return source;
  }
  source.diagnostics.push_back(clips_found(model.name, movement.fitted));
  movement.source = std::move(source.movement);
  return source;
}

/// Sides of its pattern from which on a model's offset is taken for a slip.
constexpr double kFarSides = 10;

void tell_far(const SceneRequest& resolved, Report& report) {
  const auto& offset = resolved.offset.value;
  const double sides = std::hypot(offset[0], offset[1], offset[2]);
  if (sides < kFarSides) return;
  report.diagnostics.push_back(
      {"scene.far", DiagnosticSeverity::kWarning, resolved.pattern + "=" + resolved.model, 0,
       "its offset is " + std::to_string(std::lround(sides)) +
           " times the pattern's longer side, where few cameras see it with the pattern",
       "check the unit: offset= is in mm where the pattern's width is known, else in its sides"});
}

/// Draws materials whose backs would be seen from both sides, where the format does not say.
void draw_backs(TriMesh& mesh, const std::vector<bool>& backs, Report& report) {
  std::size_t count = 0;
  for (std::size_t m = 0; m < backs.size(); ++m) {
    SourceMaterial& material = mesh.materials[m];
    if (!backs[m] || material.sides_stated || material.occluder()) continue;
    material.two_sided = true;
    ++count;
  }
  if (count == 0) return;
  report.diagnostics.push_back({"model.two-sided", DiagnosticSeverity::kInfo, mesh.name, 0,
                                std::to_string(count) + " of " +
                                    std::to_string(mesh.materials.size()) +
                                    (count == 1 ? " material is" : " materials are") +
                                    " on open or inside-out surfaces: both sides are drawn",
                                ""});
}

Result<WeldedModel> read_and_weld(const ModelRequest& model, const BakeRequest& request,
                                  TextureUses& textures, Report& report, BakeTrace& trace) {
  StageTimer reading(report, "read");
  ModelMovement movement;
  MODAR_ASSIGN(SourceModel source, read_moving(model, request, movement));
  report.diagnostics.insert(report.diagnostics.end(), source.diagnostics.begin(),
                            source.diagnostics.end());
  note_files(source, trace.files);
  reading.done(source.positions.size(), source.face_count());
  if (request.repairs()) {
    report.repairs.push_back(repair_model(source, request.repair_support, report));
  }
  Result<TriMesh> mesh = weld(std::move(source), report, {request.jobs, request.crease_degrees()});
  if (!mesh) {
    mesh.error().where = model.path;  // it has the model's name only
    return tl::unexpected(mesh.error());
  }
  report.uprights.push_back(request.up ? Upright{*request.up, UpReason::kAsked} : find_up(*mesh));
  // Out of the pattern, as the model stands by itself: a project bakes it without its scenes.
  const glm::dvec3 viewer =
      glm::inverse(rotation_of(report.uprights.back().axis, {})) * glm::dvec3(0, 0, 1);
  report.defects.push_back(count_defects(*mesh, request.repairs(), viewer, report));
  draw_backs(*mesh, report.defects.back().backs, report);
  if (request.topology) {
    report.topologies.push_back(measure_topology(*mesh, request.memory_bytes / 4, report));
  }
  if (request.most_triangles != 0) {
    *mesh = reduce(std::move(*mesh), request.most_triangles, report);
  }
  MODAR_TRY(draw_relief(
      *mesh,
      {rotation_of(report.uprights.back().axis, {}), request.textures.max_side, request.jobs},
      report));
  WeldedModel welded{std::move(*mesh), std::move(movement), {}};
  welded.uses = collect_textures(welded.mesh, textures);
  return welded;
}

/// The greatest requested error, in a model's source units; 0: any.
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

/// Says how positions are stored, and by which rule, where the user did not.
void tell_positions(const PackedMesh& packed, const PositionPlan& plan, const BakeRequest& request,
                    Report& report) {
  char text[256];
  std::string cure;
  const double share = plan.mean_edge > 0 ? 100 * plan.half_error / plan.mean_edge : 0;
  if (plan.kind == PositionKind::kFloat) {
    std::snprintf(text, sizeof text,
                  "positions are stored as floats, %u bytes a vertex: no grid of 16-bit integers "
                  "is as fine as requested and spans the longest triangle",
                  packed.layout.stride);
    cure = "a larger --max-error needs fewer bytes";
  } else if (request.positions || plan.half_error == 0) {
    return;
  } else if (plan.kind == PositionKind::kHalf) {
    std::snprintf(text, sizeof text,
                  "positions are stored as half floats: they lose no triangle and move vertices by "
                  "at most %.1f %% of the mean edge",
                  share);
  } else {
    std::snprintf(text, sizeof text,
                  "positions are stored as 16-bit integers: half floats would lose %zu triangles "
                  "and move vertices by up to %.1f %% of the mean edge",
                  plan.half_loss, share);
  }
  report.diagnostics.push_back(
      {"model.positions", DiagnosticSeverity::kInfo, packed.name, 0, text, cure});
}

/// Phones draw the finest level of models of fewer triangles.
constexpr std::size_t kDrawnWhole = 1'000'000;

/// A model in its bytes.
struct ShapedModel {
  PackedMesh model;
  std::vector<PackedMesh> proxies;
};

/// Packs proxies, each with the error of the whole.
Result<std::vector<PackedMesh>> pack_proxies(const ChunkedMesh& mesh,
                                             const std::vector<ProxyStart>& starts,
                                             const ProxyOptions& options,
                                             const std::vector<std::uint32_t>& texture_sides,
                                             const PackOptions& pack_options, Report& report) {
  MODAR_ASSIGN(const std::vector<Proxy> made, make_proxies(mesh, starts, options, report));
  if (!made.empty()) {
    double& greatest = report.levels.back().position_error_max;
    greatest = std::max(greatest, made.back().error * mesh.mesh.placement.scale);
  }
  std::vector<PackedMesh> all;
  Report quiet;
  double shown = 0;  // never falls, and is never below the truth
  for (const Proxy& proxy : made) {
    Result<PackedMesh> packed = pack(proxy.mesh, texture_sides, pack_options, quiet);
    // Coarser ones have no area as stored either.
    if (!packed && packed.error().code == "model.no-area") break;
    if (!packed) return tl::unexpected(packed.error());
    shown = std::max({shown, proxy.error, proxy.shading});
    const float error = std::nextafter(static_cast<float>(shown), 4.0f);
    for (LevelRecord& level : packed->levels) level.error = error;
    all.push_back(std::move(*packed));
  }
  return all;
}

/// Splits and packs a model as finely as requested. moving: it has clips.
Result<ShapedModel> shape_model(TriMesh mesh, const std::vector<std::uint32_t>& texture_sides,
                                const BakeRequest& request, bool moving, Report& report) {
  MODAR_ASSIGN(const double max_error, max_error_of(request, mesh));
  MODAR_ASSIGN(const PositionPlan plan, plan_positions(mesh, {request.positions, max_error}));
  ChunkOptions chunk_options;
  chunk_options.max_side = plan.max_side;
  chunk_options.max_vertices = chunk_vertices_for(mesh.positions.size());
  MODAR_ASSIGN(ChunkedMesh chunked, chunk(std::move(mesh), chunk_options, report));
  // Occlusion is of one pose.
  if (request.occlusion && !moving) {
    chunked.mesh.occlusion = measure_occlusion(chunked, request.jobs, report);
  }
  LevelOptions level_options;
  // Joints bend flat parts of the stored pose, and coarser levels would lack the folds.
  level_options.levels = chunked.mesh.vertex_bones.empty() ? request.levels : 1;
  level_options.positions = plan.kind;
  level_options.jobs = request.jobs;
  level_options.texture_sides = texture_sides;
  // Chunks of proxies have several parts.
  const ProxyPlan proxies = moving ? ProxyPlan() : plan_proxies(chunked, level_options);
  if (!proxies.halvings.empty()) level_options.most_halvings = proxies.halvings[0] - 1;
  level_options.start = proxies.start;
  MODAR_ASSIGN(const std::vector<ProxyStart> starts, make_levels(chunked, level_options, report));
  PackOptions pack_options;
  pack_options.unit_metres = request.unit_metres;
  pack_options.positions = plan.kind;
  pack_options.jobs = request.jobs;
  ShapedModel shaped;
  MODAR_ASSIGN(shaped.proxies, pack_proxies(chunked, starts, {proxies, plan.kind}, texture_sides,
                                            pack_options, report));
  const bool one_chunk = chunked.chunks.size() == 1 && !shaped.proxies.empty();
  drop_alike_levels(chunked, one_chunk ? shaped.proxies[0].levels[0].error
                                       : std::numeric_limits<double>::infinity());
  // Smaller models are drawn whole, and chunks that share a range are drawn in one call.
  pack_options.prefixes = triangles_in(chunked) > kDrawnWhole;
  MODAR_ASSIGN(shaped.model, pack(chunked, texture_sides, pack_options, report));
  tell_positions(shaped.model, plan, request, report);
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
  const bool moving = !welded.movement.fitted.clips.empty();
  if (!moving) cut_crossing(welded.mesh, seen_through);
  MODAR_ASSIGN(ShapedModel shaped,
               shape_model(std::move(welded.mesh), sides, request, moving, report));
  merge_model(std::move(shaped.model), textures, welded.movement, content);
  for (PackedMesh& packed : shaped.proxies) merge_proxy(std::move(packed), content);
  add_draw_orders(content);
  return {};
}

Result<void> add_models(const BakeRequest& request, const std::vector<KnownScene>& scenes,
                        BundleContent& content, Report& report, BakeTrace& trace) {
  TextureUses textures;
  std::vector<WeldedModel> models;
  for (const ModelRequest& model : request.models) {
    MODAR_ASSIGN(WeldedModel welded, read_and_weld(model, request, textures, report, trace));
    for (const KnownScene& known : scenes) {
      if (known.model != models.size()) continue;
      MODAR_TRY(check_extent(known.scene, welded.mesh, report.uprights.back().axis));
    }
    const glm::dvec3 box = welded.mesh.source_max - welded.mesh.source_min;
    trace.model_sides.push_back({box.x, box.y, box.z});
    models.push_back(std::move(welded));
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
  MODAR_ASSIGN(const std::vector<TextureOutcome> outcomes,
               bake_textures(textures, options, request.texture_budget, content, report));
  for (WeldedModel& model : models) {
    MODAR_TRY(add_model(std::move(model), outcomes, request, content, report));
  }
  return {};
}

/// Those that the request asks for.
void add_parameter_sets(const BakeRequest& request, BundleContent& content) {
  for (const std::string& name : stored_parameters(request)) {
    ParameterSetRecord set = *ranges::find_if(paper_parameter_sets(), [&](const auto& each) {
      return name == parameter_set_name(each.id);
    });
    set.name = content.intern(name);
    content.parameter_sets.push_back(set);
  }
}

/// A section of the pattern that is added next.
void add_pattern_section(BundleContent& content, SectionType type, std::vector<std::byte> bytes) {
  ExtraSection section;
  section.type = static_cast<std::uint32_t>(type);
  section.owner = static_cast<std::uint32_t>(content.patterns.size());
  section.bytes = std::move(bytes);
  content.extra.push_back(std::move(section));
}

/// What people see of a pattern, of a box its front; and the colours by which light is estimated.
Result<void> add_colours(const PatternRequest& request, const PatternFeatures& baked,
                         BundleContent& content) {
  const bool target = is_target_file(request.path);
  MODAR_ASSIGN(const RgbaImage picture,
               target ? read_target_colours(request.path)
                      : read_pattern_picture(request.path, request.width_mm, request.shape));
  const bool front = request.shape.kind == ShapeRequest::Kind::kBox;
  MODAR_ASSIGN(auto preview, encode_preview(picture, front ? picture.width : baked.record.width,
                                            front ? picture.height : baked.record.height));
  add_pattern_section(content, SectionType::kPatternPicture, std::move(preview));
  // A target file names a part of a picture, and on a curved surface light changes from cell to
  // cell: their light is not estimated.
  if (!target && baked.shape.empty()) {
    add_pattern_section(content, SectionType::kPatternColours, pattern_colours(picture));
  }
  return {};
}

/// Widths in millimetres beyond which a print is hardly one.
constexpr double kLeastPrint = 5;
constexpr double kMostPrint = 20000;

Result<void> add_pattern(const PatternRequest& request, const TrackerRecordOptions& loop,
                         BundleContent& content, Report& report, BakeTrace& trace) {
  if (is_target_file(request.path)) {
    MODAR_ASSIGN(trace.files.emplace_back(), target_picture(request.path));
  }
  for (std::string& file : files_of(request.path, request.shape)) {
    trace.files.push_back(std::move(file));
  }
  MODAR_ASSIGN(PatternFeatures baked,
               bake_pattern(request.path, request.width_mm, content.parameter_sets, loop, report,
                            request.shape));
  if (request.width_mm > 0 && (request.width_mm < kLeastPrint || request.width_mm > kMostPrint)) {
    report.diagnostics.push_back({"pattern.width", DiagnosticSeverity::kWarning, request.path, 0,
                                  "its printed width is " + shortest_text(request.width_mm) + " mm",
                                  "a width is written with its unit, as in 210mm"});
  }
  PatternRecord record = baked.record;
  record.name = content.intern(request.name);
  record.copies = request.copies > 1 ? request.copies : 0;
  trace.ranges.push_back(baked.range);
  add_pattern_section(content, SectionType::kTrackerRecord, std::move(baked.loop_record));
  MODAR_TRY(add_colours(request, baked, content));
  if (!baked.shape.empty()) {
    add_pattern_section(content, SectionType::kPatternShape, std::move(baked.shape));
  }
  content.patterns.push_back(record);
  content.features.push_back(std::move(baked.features));
  return {};
}

template <class Number>
void clear_tiny(std::byte* at) {
  Number number = 0;
  std::memcpy(&number, at, sizeof number);
  if (std::fpclassify(number) == FP_SUBNORMAL) std::memset(at, 0, sizeof number);
}

template <class Record>
void clear_tiny(const char* name, std::vector<Record>& records) {
  for (const FieldInfo& field : record_info(name).fields) {
    for (Record& record : records) {
      std::byte* at = reinterpret_cast<std::byte*>(&record) + field.offset;
      for (std::size_t i = 0; i < field.count; ++i, at += field_element_bytes(field.type)) {
        if (field.type == FieldType::kF32) clear_tiny<float>(at);
        if (field.type == FieldType::kF64) clear_tiny<double>(at);
      }
    }
  }
}

}  // namespace

void finish_content(BundleContent& content) {
  clear_tiny("ModelRecord", content.models);
  clear_tiny("ChunkRecord", content.chunks);
  clear_tiny("LevelRecord", content.levels);
  clear_tiny("MaterialRecord", content.materials);
  clear_tiny("SceneRecord", content.scenes);
  clear_tiny("LightRecord", content.lights);
  clear_tiny("NodeRecord", content.nodes);
  clear_tiny("ActionRecord", content.actions);
  clear_tiny("MediaRecord", content.media);
  clear_tiny("ClipRecord", content.clips);
  clear_tiny("JointRecord", content.joints);
  clear_tiny("BoneRecord", content.bones);
  clear_tiny("PartRecord", content.parts);
  clear_tiny("ChunkRecord", content.proxy_chunks);
  clear_tiny("LevelRecord", content.proxy_levels);
  content.summary = content_summary_of(content);
}

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
  MODAR_TRY(add_models(named, scenes, content, report, traced));
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
    tell_far(resolved, report);
    named.scenes.push_back(std::move(resolved));
  }
  MODAR_TRY(add_scene_clips(named.scenes, content));
  MODAR_TRY(add_nodes(named, content, report));
  for (Diagnostic& doubt : doubtful_scenes(content)) report.diagnostics.push_back(std::move(doubt));
  MODAR_TRY(light_scenes(named.scenes, named, content, report));
  content.meta = bundle_meta(named, report, traced);
  finish_content(content);
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
    // A shadow is in a plane.
    if (std::any_of(content.extra.begin(), content.extra.end(), shaped)) continue;
    content.shadows[s] = scene_shadow(content, s, request.jobs);
  }
  timer.done(content.lights.size(), content.shadows.size());
  return {};
}

}  // namespace modar
