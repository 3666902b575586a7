#include "bake/bundle/link_bundles.hpp"

#include <algorithm>
#include <cstring>

#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/clip_records.hpp"
#include "bake/bundle/scene/scene_nodes.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "formats/base/ranges.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/pattern_shape.hpp"

namespace modar {
namespace {

template <class T>
bool same_bytes(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

/// Index of the record in `list`, where it is appended if it is new.
template <class T>
std::uint32_t index_in(std::vector<T>& list, const T& record) {
  const auto found = std::find_if(list.begin(), list.end(),
                                  [&](const T& other) { return same_bytes(other, record); });
  const auto index = static_cast<std::uint32_t>(found - list.begin());
  if (found == list.end()) list.push_back(record);
  return index;
}

tl::unexpected<Error> no_part(const LinkPart& part, const std::string& what) {
  return fail(ExitCode::kInvalidInput, "link.part", part.name, "it is not a bundle of one " + what,
              "bake it again");
}

class Linker {
 public:
  Result<BundleContent> run(std::span<const LinkPart> models, std::span<const LinkPart> patterns,
                            const BakeRequest& described, const MediaSource& media) {
    for (const LinkPart& part : models) {
      if (part.bundle.models().size() != 1) return no_part(part, "model");
      add_model(part);
    }
    // A bake interns the names of parameter sets before those of patterns.
    for (const LinkPart& part : patterns) {
      if (part.keypoints) add_parameter_sets(part.bundle);
    }
    for (const LinkPart& part : patterns) {
      if (part.bundle.patterns().size() != 1) return no_part(part, "pattern");
      add_pattern(part);
    }
    BakeRequest resolved = described;
    for (SceneRequest& scene : resolved.scenes) {
      MODAR_ASSIGN(const std::uint32_t pattern, find(patterns, scene.pattern, "pattern"));
      MODAR_ASSIGN(const std::uint32_t index, find(models, scene.model, "model"));
      const auto upright = stated_upright(models[index].bundle, 0);
      const PlacedModel model = {index, models[index].model_sides,
                                 upright ? upright->axis : UpAxis::kY};
      MODAR_ASSIGN(scene, resolve_scene(scene, content_, pattern, model));
      content_.scenes.push_back(place_scene(scene, content_, pattern, model));
    }
    ranges::sort(content_.occlusion, {}, &OcclusionRecord::layout);
    Report quiet;
    MODAR_TRY(add_scene_clips(resolved.scenes, content_));
    MODAR_TRY(add_nodes(resolved, content_, quiet, media));
    MODAR_TRY(light_scenes(resolved.scenes, resolved, content_, quiet));
    Json meta = Json::parse(bundle_meta(resolved, {}, {}));
    meta.set("models", std::move(models_));
    meta.set("patterns", std::move(patterns_));
    content_.meta = meta.dump();
    finish_content(content_);
    return std::move(content_);
  }

 private:
  static Result<std::uint32_t> find(std::span<const LinkPart> parts, const std::string& name,
                                    const std::string& what) {
    const auto found = ranges::find(parts, name, &LinkPart::name);
    if (found != parts.end()) return static_cast<std::uint32_t>(found - parts.begin());
    return fail(ExitCode::kUsage, "bake.scene-unknown", name,
                "the scene names a " + what + " that is not baked", "name one that is");
  }

  /// The new index of each texture of the part.
  std::vector<std::uint32_t> add_textures(const BundleView& part) {
    std::vector<std::uint32_t> indices;
    for (std::uint32_t t = 0; t < part.textures().size(); ++t) {
      const std::span<const std::byte> data = part.texture_data(t);
      const auto same = ranges::find_if(content_.textures, [&](const TextureRecord& other) {
        const auto& bytes =
            content_.texture_data[static_cast<std::size_t>(&other - content_.textures.data())];
        const TextureRecord& mine = part.textures()[t];
        return other.width == mine.width && other.height == mine.height &&
               other.format == mine.format && other.flags == mine.flags &&
               other.level_count == mine.level_count &&
               std::equal(bytes.begin(), bytes.end(), data.begin(), data.end());
      });
      indices.push_back(static_cast<std::uint32_t>(same - content_.textures.begin()));
      if (same == content_.textures.end()) add_texture(part, t);
    }
    return indices;
  }

  void add_texture(const BundleView& part, std::uint32_t index) {
    TextureRecord record = part.textures()[index];
    const std::uint32_t first = record.first_level;
    record.name = content_.intern(part.name(record.name));
    record.first_level = static_cast<std::uint32_t>(content_.texture_levels.size());
    for (std::uint32_t l = 0; l < record.level_count; ++l) {
      content_.texture_levels.push_back(part.texture_levels()[first + l]);
    }
    const std::span<const std::byte> data = part.texture_data(index);
    content_.texture_data.emplace_back(data.begin(), data.end());
    content_.textures.push_back(record);
  }

  /// A section of the part, where it has one.
  void add_extra(const BundleView& part, SectionType type, std::uint32_t owner,
                 std::uint32_t new_owner) {
    const auto bytes = part.section(type, owner);
    if (bytes.empty()) return;
    ExtraSection section;
    section.type = static_cast<std::uint32_t>(type);
    section.owner = new_owner;
    section.bytes.assign(bytes.begin(), bytes.end());
    content_.extra.push_back(std::move(section));
  }

  void add_chunks(const BundleView& part, const ModelRecord& model, std::uint32_t first_material) {
    for (std::uint32_t c = 0; c < part.chunks().own().size(); ++c) {
      add_extra(part, SectionType::kDrawOrder, c,
                static_cast<std::uint32_t>(content_.chunks.size()));
      ChunkRecord chunk = part.chunks()[c];
      chunk.material = chunk.material - model.first_material + first_material;
      chunk.first_level += static_cast<std::uint32_t>(content_.levels.size());
      content_.chunks.push_back(chunk);
    }
    add_proxies(part, model, first_material);
    const std::uint32_t own = part.levels().own().size();
    for (std::uint32_t l = 0; l < part.levels().size(); ++l) {
      LevelRecord level = part.levels()[l];
      level.vertex_offset += content_.vertices.size();
      level.index_offset += content_.indices.size();
      (l < own ? content_.levels : content_.proxy_levels).push_back(level);
    }
    content_.vertices.insert(content_.vertices.end(), part.vertices().begin(),
                             part.vertices().end());
    content_.indices.insert(content_.indices.end(), part.indices().begin(), part.indices().end());
  }

  /// All but their levels, which are added with those of the model.
  void add_proxies(const BundleView& part, const ModelRecord& model, std::uint32_t first_material) {
    const std::uint32_t chunks = part.chunks().own().size();
    const std::uint32_t levels = part.levels().own().size();
    for (ProxyRecord record : part.proxies()) {
      record.model = static_cast<std::uint32_t>(content_.models.size());
      record.first_chunk += static_cast<std::uint32_t>(content_.proxy_chunks.size()) - chunks;
      content_.proxies.push_back(record);
    }
    const auto first_level = static_cast<std::uint32_t>(content_.proxy_levels.size());
    for (std::uint32_t c = chunks; c < part.chunks().size(); ++c) {
      ChunkRecord chunk = part.chunks()[c];
      chunk.material = chunk.material - model.first_material + first_material;
      chunk.first_level += first_level - levels;
      content_.proxy_chunks.push_back(chunk);
    }
  }

  void add_model(const LinkPart& linked) {
    const BundleView& part = linked.bundle;
    const ModelRecord& source = part.models()[0];
    const std::vector<std::uint32_t> textures = add_textures(part);
    ModelRecord record = source;
    record.name = content_.intern(linked.name);
    record.layout = index_in(content_.layouts, part.layouts()[source.layout]);
    const std::uint32_t byte = occlusion_byte(part.occlusion(), source.layout);
    if (byte != kNone) index_in(content_.occlusion, OcclusionRecord{record.layout, byte});
    record.first_chunk = static_cast<std::uint32_t>(content_.chunks.size());
    record.first_material = static_cast<std::uint32_t>(content_.materials.size());
    add_chunks(part, source, record.first_material);
    for (std::uint32_t m = 0; m < source.material_count; ++m) {
      MaterialRecord material = part.materials()[source.first_material + m];
      material.name = content_.intern(part.name(material.name));
      if (material.texture != kNone) material.texture = textures[material.texture];
      content_.materials.push_back(material);
    }
    content_.models.push_back(record);
    models_.push_back(stated_entry(part, "models"));
    add_movement(part, record.first_material - source.first_material);
  }

  /// Of the model that was added last.
  void add_movement(const BundleView& part, std::uint32_t materials) {
    const auto model = static_cast<std::uint32_t>(content_.models.size() - 1);
    const auto first_joint = static_cast<std::uint32_t>(content_.joints.size());
    const auto first_bone = static_cast<std::uint32_t>(content_.bones.size());
    for (JointRecord joint : part.joints()) {
      joint.model = model;
      if (joint.parent != kNone) joint.parent += first_joint;
      content_.joints.push_back(joint);
    }
    for (BoneRecord bone : part.bones()) {
      bone.joint += first_joint;
      content_.bones.push_back(bone);
    }
    for (PartRecord moving : part.moving_parts()) {
      moving.material += materials;
      moving.first_bone += first_bone;
      content_.parts.push_back(moving);
    }
    for (ClipRecord clip : part.clips()) {
      const auto bytes = part.section(SectionType::kClipTracks, clip.tracks);
      clip.name = content_.intern(part.name(clip.name));
      clip.model = model;
      add_clip(clip, {bytes.begin(), bytes.end()}, content_);
    }
  }

  void add_parameter_sets(const BundleView& part) {
    for (ParameterSetRecord set : part.parameter_sets()) {
      set.name = content_.intern(part.name(set.name));
      index_in(content_.parameter_sets, set);
    }
  }

  void add_pattern(const LinkPart& linked) {
    const BundleView& part = linked.bundle;
    PatternRecord record = part.patterns()[0];
    record.name = content_.intern(linked.name);
    for (const SectionType type : {SectionType::kTrackerRecord, SectionType::kPatternColours,
                                   SectionType::kPatternShape, SectionType::kPatternPicture}) {
      add_extra(part, type, 0, static_cast<std::uint32_t>(content_.patterns.size()));
    }
    std::vector<FeatureContent> features;
    for (const ParameterSetRecord& each : part.parameter_sets()) {
      const std::uint32_t set = each.id;
      const FeatureView view = part.features(0, set);
      if (!linked.keypoints || view.descriptor_bytes == 0) continue;
      features.push_back({set,
                          view.descriptor_bytes,
                          {view.keypoints.begin(), view.keypoints.end()},
                          {view.descriptors.begin(), view.descriptors.end()},
                          std::string(part.feature_yml(0, set))});
    }
    content_.patterns.push_back(record);
    content_.features.push_back(std::move(features));
    patterns_.push_back(stated_entry(part, "patterns"));
  }

  /// What the part's meta text says of its only asset.
  static Json stated_entry(const BundleView& part, const char* kind) {
    return Json::parse(part.meta())[kind][0];
  }

  BundleContent content_;
  Json models_ = Json::array();  // entries of the meta text
  Json patterns_ = Json::array();
};

}  // namespace

Result<BundleContent> link_bundles(std::span<const LinkPart> models,
                                   std::span<const LinkPart> patterns, const BakeRequest& described,
                                   const MediaSource& media) {
  return Linker().run(models, patterns, described, media);
}

}  // namespace modar
