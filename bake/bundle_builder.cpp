// Runs the stages over every input and merges what they give into one bundle.
#include "bake/bundle_builder.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "bake/model/packed_mesh.hpp"
#include "bake/pattern/pattern_image.hpp"
#include "bake/read_model.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

/// Textures of the bundle by file and wrap mode: one file used twice is stored once.
using TextureKey = std::pair<std::string, bool>;
struct TextureStore {
  std::map<TextureKey, std::uint32_t> index;
};

Result<std::uint32_t> add_texture(const std::string& path, bool repeat, const BakeRequest& request,
                                  TextureStore& store, BundleContent& content, Report& report) {
  const TextureKey key{path, repeat};
  if (auto found = store.index.find(key); found != store.index.end()) return found->second;
  TextureOptions options = request.textures;
  options.repeat = repeat;
  options.jobs = request.jobs;
  Result<Etc1Texture> baked = bake_texture(path, options, report);
  if (!baked) return tl::unexpected(baked.error());

  TextureRecord record{};
  record.name = content.intern(baked->name);
  record.width = baked->levels.front().width;
  record.height = baked->levels.front().height;
  record.source_width = baked->source_width;
  record.source_height = baked->source_height;
  record.format = static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb);
  record.flags = (baked->alpha ? kTextureAlpha : 0u) | (baked->repeat ? kTextureRepeat : 0u);
  record.first_level = static_cast<std::uint32_t>(content.texture_levels.size());
  record.level_count = static_cast<std::uint32_t>(baked->levels.size());
  record.psnr_db = static_cast<float>(baked->levels.front().psnr_db);
  record.ssim = static_cast<float>(baked->levels.front().ssim);

  std::vector<std::byte> data;
  for (const Etc1Level& level : baked->levels) {
    TextureLevelRecord out{};
    out.offset = data.size();
    out.alpha_offset = kNoOffset;
    out.size = static_cast<std::uint32_t>(level.colour.size());
    out.width = level.width;
    out.height = level.height;
    out.psnr_db = static_cast<float>(level.psnr_db);
    out.ssim = static_cast<float>(level.ssim);
    data.insert(data.end(), level.colour.begin(), level.colour.end());
    if (baked->alpha) {
      out.alpha_offset = data.size();
      data.insert(data.end(), level.alpha.begin(), level.alpha.end());
    }
    content.texture_levels.push_back(out);
  }
  content.texture_data.push_back(std::move(data));
  const auto index = static_cast<std::uint32_t>(content.textures.size());
  content.textures.push_back(record);
  store.index.emplace(key, index);
  return index;
}

/// Does any triangle of the material sample outside of its image?
std::vector<bool> repeating_materials(const TriMesh& mesh) {
  constexpr double kSlack = 1e-4;  // half a texel at 4096: what exporters leave at the border
  std::vector<bool> repeats(mesh.materials.size(), false);
  if (mesh.uvs.empty()) return repeats;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      const glm::dvec2 uv = mesh.uvs[v];
      if (uv.x < -kSlack || uv.y < -kSlack || uv.x > 1 + kSlack || uv.y > 1 + kSlack) {
        repeats[mesh.triangle_material[t]] = true;
      }
    }
  }
  return repeats;
}

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

/// Appends a model's records and bytes, shifting what counts from the model's own start.
void merge_model(PackedMesh packed, const std::vector<std::uint32_t>& textures,
                 BundleContent& content) {
  ModelRecord record = packed.record;
  record.name = content.intern(packed.name);
  record.layout = layout_index(packed.layout, content);
  record.first_chunk = static_cast<std::uint32_t>(content.chunks.size());
  record.chunk_count = static_cast<std::uint32_t>(packed.chunks.size());
  record.first_material = static_cast<std::uint32_t>(content.materials.size());
  record.material_count = static_cast<std::uint32_t>(packed.materials.size());
  const auto first_level = static_cast<std::uint32_t>(content.levels.size());
  for (ChunkRecord chunk : packed.chunks) {
    chunk.material += record.first_material;
    chunk.first_level += first_level;
    content.chunks.push_back(chunk);
  }
  for (LevelRecord level : packed.levels) {
    level.vertex_offset += content.vertices.size();
    level.index_offset += content.indices.size();
    content.levels.push_back(level);
  }
  for (std::size_t m = 0; m < packed.materials.size(); ++m) {
    MaterialRecord material = packed.materials[m];
    material.name = content.intern(packed.sources[m].name);
    material.texture = textures[m];
    content.materials.push_back(material);
  }
  content.vertices.insert(content.vertices.end(), packed.vertices.begin(), packed.vertices.end());
  content.indices.insert(content.indices.end(), packed.indices.begin(), packed.indices.end());
  // Keeps the next model's vertices on a 4-byte boundary.
  content.indices.resize((content.indices.size() + 3) / 4 * 4);
  content.models.push_back(record);
}

/// The model's side lengths in source units.
Result<std::array<double, 3>> add_model(const std::string& path, const BakeRequest& request,
                                        TextureStore& store, BundleContent& content,
                                        Report& report) {
  StageTimer reading(report, "read");
  Result<SourceModel> source = read_model(path, request.jobs);
  if (!source) return tl::unexpected(source.error());
  report.findings.insert(report.findings.end(), source->findings.begin(), source->findings.end());
  reading.done(source->positions.size(), source->face_count());

  Result<TriMesh> mesh = weld(*source, report);
  if (!mesh) return tl::unexpected(mesh.error());
  const glm::dvec3 sides = mesh->source_max - mesh->source_min;
  const std::vector<bool> repeats = repeating_materials(*mesh);
  std::vector<bool> used(mesh->materials.size(), false);
  for (const std::uint32_t material : mesh->triangle_material) used[material] = true;

  std::vector<std::uint32_t> textures(mesh->materials.size(), kNone);
  std::vector<std::uint32_t> texture_side(mesh->materials.size(), 0);
  for (std::size_t m = 0; m < mesh->materials.size(); ++m) {
    const std::string& map = mesh->materials[m].diffuse_map;
    if (map.empty() || !used[m] || mesh->uvs.empty()) continue;
    Result<std::uint32_t> texture = add_texture(map, repeats[m], request, store, content, report);
    if (!texture) return tl::unexpected(texture.error());
    textures[m] = *texture;
    const TextureRecord& record = content.textures[*texture];
    texture_side[m] = std::max(record.width, record.height);
  }

  Result<ChunkedMesh> chunked = chunk(std::move(*mesh), ChunkOptions{}, report);
  if (!chunked) return tl::unexpected(chunked.error());
  PackOptions pack_options;
  pack_options.unit_metres = request.unit_metres;
  Result<PackedMesh> packed = pack(*chunked, texture_side, pack_options, report);
  if (!packed) return tl::unexpected(packed.error());
  merge_model(std::move(*packed), textures, content);
  return std::array<double, 3>{sides.x, sides.y, sides.z};
}

Result<void> add_pattern(const PatternRequest& request, BundleContent& content, Report& report) {
  Result<PatternFeatures> baked = bake_pattern(request.path, request.width_mm, report);
  if (!baked) return tl::unexpected(baked.error());
  PatternRecord record = baked->record;
  record.name = content.intern(baked->name);
  content.patterns.push_back(record);
  content.features.push_back(std::move(baked->features));
  return {};
}

Result<void> require_unique(const std::vector<std::string>& paths, const char* what) {
  std::set<std::string> seen;
  for (const std::string& path : paths) {
    if (!seen.insert(file_stem(path)).second) {
      return fail(ExitCode::kUsage, "bake.same-name", path,
                  std::string("two ") + what + "s are named '" + file_stem(path) + "'",
                  "rename one of the files: scenes refer to them by name");
    }
  }
  return {};
}

Result<std::uint32_t> find_by_name(const std::vector<std::string>& paths, const std::string& name,
                                   const char* what) {
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (file_stem(paths[i]) == name) return static_cast<std::uint32_t>(i);
  }
  std::string known;
  for (const std::string& path : paths) known += (known.empty() ? "" : ", ") + file_stem(path);
  return fail(ExitCode::kUsage, "bake.scene-unknown", name,
              std::string("the scene names a ") + what + " that is not baked",
              std::string("name one of: ") + (known.empty() ? "(none)" : known));
}

Result<void> add_scenes(const BakeRequest& request, const std::vector<std::string>& pattern_paths,
                        const std::vector<std::array<double, 3>>& sides, BundleContent& content) {
  std::vector<SceneRequest> scenes = request.scenes;
  if (scenes.empty() && request.models.size() == 1 && pattern_paths.size() == 1) {
    SceneRequest scene;
    scene.pattern = file_stem(pattern_paths[0]);
    scene.model = file_stem(request.models[0]);
    scenes.push_back(scene);
  }
  for (const SceneRequest& scene : scenes) {
    const Result<std::uint32_t> pattern = find_by_name(pattern_paths, scene.pattern, "pattern");
    if (!pattern) return tl::unexpected(pattern.error());
    const Result<std::uint32_t> model = find_by_name(request.models, scene.model, "model");
    if (!model) return tl::unexpected(model.error());
    content.scenes.push_back(place_scene(scene, *pattern, *model, sides[*model]));
  }
  return {};
}

}  // namespace

std::string file_stem(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

Result<BundleContent> build_bundle(const BakeRequest& request, Report& report) {
  if (request.models.empty() && request.patterns.empty()) {
    return fail(ExitCode::kUsage, "bake.nothing", "", "there is neither a model nor a pattern",
                "name files with --model and --pattern");
  }
  std::vector<std::string> pattern_paths;
  for (const PatternRequest& pattern : request.patterns) pattern_paths.push_back(pattern.path);
  if (auto unique = require_unique(request.models, "model"); !unique) {
    return tl::unexpected(unique.error());
  }
  if (auto unique = require_unique(pattern_paths, "pattern"); !unique) {
    return tl::unexpected(unique.error());
  }

  BundleContent content;
  TextureStore textures;
  std::vector<std::array<double, 3>> sides;
  for (const std::string& path : request.models) {
    Result<std::array<double, 3>> model = add_model(path, request, textures, content, report);
    if (!model) return tl::unexpected(model.error());
    sides.push_back(*model);
  }
  if (!request.patterns.empty()) {
    for (const ParameterSetRecord& set : paper_parameter_sets()) {
      ParameterSetRecord named = set;
      named.name = content.intern(parameter_set_name(set.id));
      content.parameter_sets.push_back(named);
    }
  }
  for (const PatternRequest& pattern : request.patterns) {
    if (auto added = add_pattern(pattern, content, report); !added) {
      return tl::unexpected(added.error());
    }
  }
  if (auto added = add_scenes(request, pattern_paths, sides, content); !added) {
    return tl::unexpected(added.error());
  }
  content.meta = bundle_meta(request);
  return content;
}

}  // namespace modar
