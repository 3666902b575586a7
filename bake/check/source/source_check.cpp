// Bakes the sources again and compares each part of the bundle with its counterpart by its hash.
// What another version baked is measured instead.
#include "bake/check/source/source_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <tuple>
#include <utility>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "bake/check/source/source_measure.hpp"
#include "bake/check/verdict.hpp"
#include "bake/json.hpp"
#include "formats/base/ranges.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/sections.hpp"

namespace modar {
namespace {

/// Mean difference of vertex colours, of 1, between versions: four steps of 8 bits are not seen.
constexpr double kMaxColourError = 4.0 / 255.0;
/// Relative difference of distances: positions are sums in double precision.
constexpr double kDistanceRounding = 1e-12;
/// Relative difference of scales and offsets between versions, which are rounded to floats.
constexpr float kPlaceRounding = 1e-5f;
/// Relative difference of widths that were written in different units.
constexpr double kWidthRounding = 1e-6;

/// A part of an asset that its sources alone determine.
struct AssetPart {
  WorkstationRule rule = WorkstationRule::kSourceBytes;  ///< of its difference
  const void* place = nullptr;                           ///< in the bundle's bytes
  std::uint64_t hash = 0;
  bool lasting = false;  ///< the same in all versions of the baker
};

/// A model, texture, pattern, parameter set or scene.
struct Asset {
  const void* place = nullptr;
  std::map<std::string, AssetPart> parts;  ///< by name
  std::vector<std::string> uses;           ///< of a scene: the labels of its model and pattern
};
/// By a label that is the same in every bundle with the asset.
using Assets = std::map<std::string, Asset>;

/// Hash of several values and byte ranges.
class PartHash {
 public:
  PartHash& bytes(std::span<const std::byte> bytes) {
    hash_ = XXH64(bytes.data(), bytes.size(), hash_);
    return *this;
  }
  template <class T>
  PartHash& value(const T& value) {
    return bytes(std::as_bytes(std::span(&value, 1)));
  }
  /// The members of a record from the first on and before the second.
  template <class T>
  PartHash& members(const T& record, std::size_t first, std::size_t second) {
    return bytes(std::as_bytes(std::span(&record, 1)).subspan(first, second - first));
  }
  PartHash& text(std::string_view text) {
    return value(text.size()).bytes(std::as_bytes(std::span(text.data(), text.size())));
  }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0;
};

/// Lists the parts of a bundle.
class PartList {
 public:
  explicit PartList(const BundleView& bundle) : bundle_(bundle) {}

  Assets list() {
    for (const ModelRecord& model : bundle_.models()) add_model(model);
    for (std::uint32_t g = bundle_.models().size(); g < bundle_.chunk_groups(); ++g) add_proxy(g);
    for (const TextureRecord& texture : bundle_.textures()) add_texture(texture);
    for (const PatternRecord& pattern : bundle_.patterns()) {
      Asset& asset = named("pattern", pattern.name, &pattern);
      add(asset, "its record", WorkstationRule::kSourcePattern, &pattern,
          PartHash().members(pattern, offsetof(PatternRecord, width), sizeof pattern));
    }
    for (const ParameterSetRecord& set : bundle_.parameter_sets()) {
      add(named("parameter set", set.name, &set), "its record", WorkstationRule::kSourcePattern,
          &set, PartHash().members(set, offsetof(ParameterSetRecord, id), sizeof set), true);
    }
    for (std::uint32_t s = 0; s < bundle_.scenes().size(); ++s) add_scene(s);
    for (const SectionEntry& section : bundle_.sections()) add_section(section);
    return std::move(assets_);
  }

 private:
  [[nodiscard]] std::string label(const char* what, NameRef name) const {
    return what + (" '" + std::string(bundle_.name(name)) + "'");
  }
  Asset& named(const char* what, NameRef name, const void* place) {
    Asset& asset = assets_[label(what, name)];
    if (asset.place == nullptr) asset.place = place;
    return asset;
  }
  static void add(Asset& asset, std::string name, WorkstationRule rule, const void* place,
                  const PartHash& hash, bool lasting = false) {
    asset.parts[std::move(name)] = {rule, place, hash.hash(), lasting};
  }

  void add_model(const ModelRecord& model) {
    Asset& asset = named("model", model.name, &model);
    add(asset, "the counts of its source", WorkstationRule::kSourceCounts,
        &model.source_vertex_count,
        PartHash().value(model.source_vertex_count).value(model.source_face_count), true);
    add(asset, "its record", WorkstationRule::kSourceCounts, &model.center,
        PartHash()
            .members(model, offsetof(ModelRecord, center), offsetof(ModelRecord, layout))
            .value(model.level_count));
    const LayoutRecord& layout = bundle_.layouts()[model.layout];
    add(asset, "its vertex layout", WorkstationRule::kSourceSurface, &layout,
        PartHash().value(layout));
    add(asset, "its occlusion", WorkstationRule::kSourceColour, &model,
        PartHash().value(occlusion_byte(bundle_.occlusion(), model.layout)));
    for (std::uint32_t m = 0; m < model.material_count; ++m) {
      const MaterialRecord& material = bundle_.materials()[model.first_material + m];
      const bool plain = material.texture == kNone;
      const std::string number = "material " + std::to_string(m);
      add(asset, number + ", name", WorkstationRule::kSourceColour, &material,
          PartHash().text(bundle_.name(material.name)));
      add(asset, number, WorkstationRule::kSourceColour, &material,
          PartHash()
              .members(material, offsetof(MaterialRecord, ambient),
                       offsetof(MaterialRecord, texture))
              .value(material.flags)
              .text(plain ? "" : bundle_.name(bundle_.textures()[material.texture].name)),
          true);
    }
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      add_chunk(asset, model, model.first_chunk + c, "chunk " + std::to_string(c));
    }
  }

  void add_proxy(std::uint32_t group_index) {
    const ChunkGroup group = bundle_.chunk_group(group_index);
    const ModelRecord& model = bundle_.models()[group.model];
    const std::uint32_t number = proxies_[group.model]++;
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      add_chunk(named("model", model.name, &model), model, group.first_chunk + c,
                with_numbers("proxy {}, chunk {}", {number, c}));
    }
  }

  void add_chunk(Asset& asset, const ModelRecord& model, std::uint32_t index,
                 const std::string& where) {
    const ChunkRecord& chunk = bundle_.chunks()[index];
    add(asset, where, WorkstationRule::kSourceSurface, &chunk,
        PartHash()
            .members(chunk, 0, offsetof(ChunkRecord, material))
            .value(chunk.material - model.first_material));
    for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
      const LevelRecord& level = bundle_.levels()[chunk.first_level + l];
      const std::size_t bytes =
          std::size_t{level.vertex_count} * bundle_.layouts()[model.layout].stride;
      add(asset, where + ", level " + std::to_string(l), WorkstationRule::kSourceSurface, &level,
          PartHash()
              .value(level.error)
              .value(level.vertex_count)
              .bytes(
                  bundle_.vertices().subspan(static_cast<std::size_t>(level.vertex_offset), bytes))
              .bytes(bundle_.indices().subspan(static_cast<std::size_t>(level.index_offset),
                                               2 * std::size_t{level.index_count})));
    }
  }

  void add_texture(const TextureRecord& texture) {
    PartHash hash;
    hash.members(texture, offsetof(TextureRecord, width), offsetof(TextureRecord, first_level));
    hash.members(texture, offsetof(TextureRecord, level_count), sizeof texture);
    for (std::uint32_t l = 0; l < texture.level_count; ++l) {
      hash.value(bundle_.texture_levels()[texture.first_level + l]);
    }
    add(named("texture", texture.name, &texture), "its record", WorkstationRule::kSourceColour,
        &texture, hash);
  }

  [[nodiscard]] std::string scene_label(std::uint32_t index) const {
    const SceneRecord& scene = bundle_.scenes()[index];
    std::uint32_t before = 0;
    for (std::uint32_t s = 0; s < index; ++s) {
      const SceneRecord& other = bundle_.scenes()[s];
      before += other.pattern == scene.pattern && other.model == scene.model ? 1 : 0;
    }
    return "scene " + std::to_string(before) + " of " +
           label("model", bundle_.models()[scene.model].name) + " on " +
           label("pattern", bundle_.patterns()[scene.pattern].name);
  }

  void add_scene(std::uint32_t index) {
    const SceneRecord& scene = bundle_.scenes()[index];
    Asset& asset = assets_[scene_label(index)];
    asset.place = &scene;
    asset.uses = {label("model", bundle_.models()[scene.model].name),
                  label("pattern", bundle_.patterns()[scene.pattern].name)};
    add(asset, "its place", WorkstationRule::kSourceScene, &scene,
        PartHash().members(scene, offsetof(SceneRecord, scale), sizeof scene));
    for (const LightRecord& light : bundle_.lights()) {
      if (light.scene != index) continue;
      add(asset, "its light", WorkstationRule::kSourceScene, &light,
          PartHash().members(light, offsetof(LightRecord, sky), sizeof light));
    }
  }

  /// A section of one record's own.
  void add_section(const SectionEntry& section) {
    const SectionInfo* info = section_info(section.type);
    if (info == nullptr || section.owner == kNone) return;
    std::string name = std::string("its ") + info->name;
    std::replace(name.begin(), name.end(), '_', ' ');
    if (section.variant != 0) name += " " + std::to_string(section.variant);
    Asset* asset = nullptr;
    WorkstationRule rule = WorkstationRule::kSourceColour;
    if (info->owner == SectionOwner::kPattern) {
      asset = &assets_[label("pattern", bundle_.patterns()[section.owner].name)];
      rule = WorkstationRule::kSourcePattern;
    } else if (info->owner == SectionOwner::kTexture) {
      asset = &assets_[label("texture", bundle_.textures()[section.owner].name)];
    } else if (info->owner == SectionOwner::kScene) {
      asset = &assets_[scene_label(section.owner)];
      rule = WorkstationRule::kSourceScene;
    } else if (info->owner == SectionOwner::kChunk) {
      std::tie(asset, name) = chunk_section(section.owner, name);
    }
    if (asset == nullptr) return;
    const bool lasting = info->type == SectionType::kPatternShape;
    asset->parts[name] = {rule, bundle_.bytes().data() + section.offset, section.hash, lasting};
  }

  /// Draw orders belong to chunks of models.
  std::pair<Asset*, std::string> chunk_section(std::uint32_t chunk, const std::string& name) {
    for (const ModelRecord& model : bundle_.models()) {
      if (chunk - model.first_chunk >= model.chunk_count) continue;
      return {&assets_[label("model", model.name)],
              "chunk " + std::to_string(chunk - model.first_chunk) + ", " + name};
    }
    return {nullptr, name};
  }

  const BundleView& bundle_;
  std::map<std::uint32_t, std::uint32_t> proxies_;  ///< listed so far, by model
  Assets assets_;
};

/// Of a table's records, by name.
template <class T>
std::uint32_t number_of(const BundleView& bundle, const Table<T>& records, std::string_view name) {
  for (std::uint32_t i = 0; i < records.size(); ++i) {
    if (bundle.name(records[i].name) == name) return i;
  }
  return kNone;
}

class SourceCheck {
 public:
  SourceCheck(const BundleView& bundle, const IssueSink& sink) : bundle_(bundle), sink_(sink) {}

  Result<SourceFit> run(BakeRequest request, Report& report) {
    MODAR_TRY(name_assets(request));
    MODAR_ASSIGN(const BundleContent content, build_bundle(request, report));
    MODAR_ASSIGN(const std::vector<std::byte> bytes, encode_bundle(content));
    MODAR_ASSIGN(again_, BundleView::open(bytes));
    const Json meta = Json::parse(bundle_.meta());
    exact_ = meta["tool"].text() == "modar " + request.tool_version && !meta.find("baked_apart");
    StageTimer timer(report, "compare");
    ours_ = PartList(bundle_).list();
    theirs_ = PartList(again_).list();
    for (const auto& [label, asset] : ours_) check_asset(label, asset);
    for (const auto& [label, asset] : theirs_) {
      if (asset.uses.empty() || ours_.contains(label) || !has_all(ours_, asset.uses)) continue;
      tell(WorkstationRule::kSourceScene, label, bundle_.bytes().data(), "the bundle lacks it");
    }
    timer.done(theirs_.size(), ours_.size());
    return std::move(fit_);
  }

 private:
  void tell(WorkstationRule rule, const std::string& where, const void* place, std::string detail,
            std::optional<Severity> severity = {}) {
    sink_(Issue{
        &workstation_issue_kind(rule), where,
        static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - bundle_.bytes().data()),
        std::move(detail), severity});
  }

  static bool has_all(const Assets& assets, const std::vector<std::string>& labels) {
    return ranges::all_of(labels, [&](const auto& each) { return assets.contains(each); });
  }

  /// An asset that was not baked again.
  void missing(const std::string& label, const Asset& asset) {
    if (label.starts_with("parameter set ")) return;
    if (!asset.uses.empty()) {
      if (!has_all(theirs_, asset.uses)) return;
      return tell(WorkstationRule::kSourceScene, label, asset.place, "the sources give none");
    }
    const std::string kind = label.substr(0, label.find('\'') + 1);  // "model '"
    const bool strange =
        kind != "texture '" && std::any_of(theirs_.begin(), theirs_.end(), [&](const auto& each) {
          return each.first.starts_with(kind) && !ours_.contains(each.first);
        });
    if (!strange) return tell(WorkstationRule::kSourceMissing, label, asset.place, "");
    tell(WorkstationRule::kSourceMissing, label, asset.place,
         "and no asset has the name of a source: NAME=FILE gives a file that was renamed its name",
         Severity::kError);
  }

  void check_asset(const std::string& label, const Asset& asset) {
    const auto found = theirs_.find(label);
    if (found == theirs_.end()) return missing(label, asset);
    Asset other = found->second;
    Asset ours = asset;
    if (ours.parts.contains("its light") && !other.parts.contains("its light")) {
      // Its picture is not among the sources: then the shadow that it casts is unknown, too.
      tell(WorkstationRule::kSourceMissing, label + ", light", ours.parts["its light"].place, "");
      for (auto* each : {&ours, &other})
        each->parts.erase("its light"), each->parts.erase("its shadow");
    }
    const bool same = tell_differences(label, ours, other);
    const bool scene = !asset.uses.empty();
    if (label.starts_with("model ")) return measure_model(label, same);
    if (!scene && !label.starts_with("parameter set "))
      (same ? fit_.same : fit_.different).push_back(label);
    if (same || exact_) return;
    if (label.starts_with("texture ")) measure_texture(label);
    if (label.starts_with("pattern ")) measure_pattern(label);
    if (scene) measure_scene(label, asset, found->second);
  }

  /// One issue a rule, which names the first part that differs. Returns whether none does.
  bool tell_differences(const std::string& label, const Asset& ours, const Asset& other) {
    std::map<WorkstationRule, std::pair<Issue, int>> issues;
    bool same = true;
    const auto differs = [&](const std::string& name, const AssetPart& part, const void* place,
                             const char* how) {
      same = false;
      const bool judged = exact_ || part.lasting;
      const WorkstationRule rule = judged ? part.rule : WorkstationRule::kSourceBytes;
      auto& [issue, count] = issues[rule];
      if (count++ > 0) return;
      issue.where = label;
      issue.offset =
          static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - bundle_.bytes().data());
      issue.detail = judged ? name + how : "";
    };
    for (const auto& [name, part] : ours.parts) {
      const auto its = other.parts.find(name);
      if (its == other.parts.end()) {
        differs(name, part, part.place, ": the sources give none");
      } else if (its->second.hash != part.hash) {
        differs(name, part, part.place, ": not as baked again");
      }
    }
    for (const auto& [name, part] : other.parts) {
      if (!ours.parts.contains(name)) differs(name, part, ours.place, ": missing");
    }
    for (auto& [rule, found] : issues) {
      auto& [issue, count] = found;
      if (count > 1 && !issue.detail.empty()) {
        issue.detail +=
            ", and " + std::to_string(count - 1) + (count == 2 ? " other part" : " other parts");
      }
      issue.kind = &workstation_issue_kind(rule);
      sink_(issue);
    }
    return same;
  }

  static std::string name_in(const std::string& label) {
    const std::size_t quote = label.find('\'');
    return label.substr(quote + 1, label.size() - quote - 2);
  }

  void measure_model(const std::string& label, bool same) {
    const ModelRecord& model =
        bundle_.models()[number_of(bundle_, bundle_.models(), name_in(label))];
    const ModelRecord& other = again_.models()[number_of(again_, again_.models(), name_in(label))];
    ModelFit fit;
    fit.name = name_in(label);
    fit.same_bytes = same;
    fit.stated_error = model.position_error_max;
    if (!same) measure_surfaces(bundle_, model, again_, other, fit);
    fit_.models.push_back(fit);
    if (exact_) return;
    const double limit =
        fit.stated_error + other.position_error_max +
        kDistanceRounding * (model.diagonal + std::fabs(model.center[0]) +
                             std::fabs(model.center[1]) + std::fabs(model.center[2]));
    if (!(std::max(fit.source_to_bundle, fit.bundle_to_source) <= limit)) {
      tell(WorkstationRule::kSourceSurface, label, &model.position_error_max,
           "the source, baked again, is up to " + std::to_string(fit.source_to_bundle) +
               " from the bundle, the bundle up to " + std::to_string(fit.bundle_to_source) +
               " from the source; " + std::to_string(fit.stated_error) + " is stated");
    }
    if (fit.colour_error > kMaxColourError) {
      tell(WorkstationRule::kSourceColour, label, &model,
           "its vertices are off by " + std::to_string(fit.colour_error) + " on average");
    }
  }

  void measure_texture(const std::string& label) {
    const std::uint32_t index = number_of(bundle_, bundle_.textures(), name_in(label));
    const std::uint32_t other = number_of(again_, again_.textures(), name_in(label));
    const std::string fault = texture_fault(bundle_, index, again_, other);
    if (!fault.empty()) {
      tell(WorkstationRule::kSourceColour, label, &bundle_.textures()[index], fault);
    }
  }

  void measure_pattern(const std::string& label) {
    const std::uint32_t index = number_of(bundle_, bundle_.patterns(), name_in(label));
    const std::uint32_t which = number_of(again_, again_.patterns(), name_in(label));
    const PatternRecord& pattern = bundle_.patterns()[index];
    const auto record = bundle_.section(SectionType::kTrackerRecord, index);
    const auto record_again = again_.section(SectionType::kTrackerRecord, which);
    const bool both = !record.empty() && !record_again.empty();
    const std::string fault = both ? record_fault(record, record_again) : "";
    if (!fault.empty()) tell(WorkstationRule::kSourcePattern, label, &pattern, fault);
    const double width = again_.patterns()[which].width_mm;
    if (width <= 0 || std::fabs(pattern.width_mm / width - 1) <= kWidthRounding) return;
    tell(WorkstationRule::kSourcePattern, label, &pattern,
         std::to_string(pattern.width_mm) + " mm wide, the source is " + std::to_string(width));
  }

  void measure_scene(const std::string& label, const Asset& asset, const Asset& other) {
    const SceneRecord& a = *static_cast<const SceneRecord*>(asset.place);
    const SceneRecord& b = *static_cast<const SceneRecord*>(other.place);
    const auto near = [](float x, float y) {
      return std::fabs(x - y) <= kPlaceRounding * std::max(1.0f, std::fabs(y));
    };
    float turn = 0;
    for (std::size_t i = 0; i < 4; ++i) turn += a.rotation[i] * b.rotation[i];
    if (near(a.scale, b.scale) && near(a.offset[0], b.offset[0]) &&
        near(a.offset[1], b.offset[1]) && near(a.offset[2], b.offset[2]) &&
        std::fabs(turn) >= 1.0f - kPlaceRounding) {
      return;
    }
    tell(WorkstationRule::kSourceScene, label, &a,
         "scale " + std::to_string(a.scale) + ", offset " + std::to_string(a.offset[0]) + " " +
             std::to_string(a.offset[1]) + " " + std::to_string(a.offset[2]));
  }

  const BundleView& bundle_;
  const IssueSink& sink_;
  BundleView again_;  ///< baked from the sources
  Assets ours_;
  Assets theirs_;
  bool exact_ = false;  ///< the same version baked it at once by the stated options
  SourceFit fit_;
};

}  // namespace

Result<SourceFit> check_source(const BundleView& bundle, const BakeRequest& request,
                               const IssueSink& sink, Report& report) {
  return SourceCheck(bundle, sink).run(request, report);
}

}  // namespace modar
