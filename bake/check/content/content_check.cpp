// Runs the rules, the cheap ones first, and holds records against the meta text and each other.
#include "bake/check/content/content_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>
#include <vector>

#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/check/content/content_rules.hpp"
#include "bake/check/verdict.hpp"
#include "bake/json.hpp"
#include "bake/pattern/score.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/component.hpp"
#include "formats/field_table.hpp"
#include "formats/meta_text.hpp"
#include "modar/features.hpp"

namespace modar {

void ContentLog::tell(WorkstationRule rule, std::string where, const void* place,
                      std::string detail) {
  const auto offset = static_cast<const std::byte*>(place) - bundle.bytes().data();
  sink_({&workstation_issue_kind(rule), std::move(where), static_cast<std::uint64_t>(offset),
         std::move(detail), std::nullopt});
  good_ = false;
}

bool ContentLog::concerns(std::initializer_list<SectionType> types) const {
  if (!options.changed) return true;
  const std::uint64_t head = sizeof(FileHeader) + bundle.sections().size_bytes();
  return *options.changed < head ||
         ranges::any_of(bundle.sections(), [&](const SectionEntry& entry) {
           return *options.changed >= entry.offset &&
                  *options.changed < entry.offset + entry.size &&
                  ranges::count(types, static_cast<SectionType>(entry.type)) > 0;
         });
}

namespace {

constexpr const char* kStateIt = "the meta text states ";

/// The name that the meta text gives an asset, as records hold names.
std::string stated_name(const Json& asset) {
  const std::string file = asset.text_at("file");
  BundleContent names;
  names.intern(asset.find("name").value_or(file_stem(file)).text().value_or(""));
  return names.names;
}

/// The name, file and number of each asset that the meta text lists.
template <class Records>
void check_list(ContentLog& log, const char* key, const char* what, const Records& records) {
  const Json stated = stated_list(log.bundle, key);
  if (stated.size() != records.size()) {
    log.tell(WorkstationRule::kMetaDiffers, key, log.bundle.meta().data(),
             kStateIt + std::to_string(stated.size()) + ", the table has " +
                 std::to_string(records.size()));
  }
  for (std::uint32_t i = 0; i < std::min<std::size_t>(records.size(), stated.size()); ++i) {
    const std::string name = stated_name(stated[i]);
    if (name == log.bundle.name(records[i].name)) continue;
    log.tell(WorkstationRule::kMetaDiffers, log.label(what, records[i].name), &records[i],
             kStateIt + ("the name '" + name + "'"));
  }
}

void check_patterns(ContentLog& log) {
  const Json stated = stated_list(log.bundle, "patterns");
  const Table<PatternRecord> patterns = log.bundle.patterns();
  for (std::uint32_t p = 0; p < patterns.size(); ++p) {
    const PatternRecord& pattern = patterns[p];
    const double width = stated[p].number_at("width_mm");
    const auto range = range_in(stated, p);
    const double score = range ? score_of(*range) : -1;
    std::string fault;
    if (width > 0 && width != pattern.width_mm) fault = "another width";
    if (stated[p].number_at("copies") != static_cast<double>(pattern.copies))
      fault = "other copies";
    if (score != static_cast<double>(pattern.score)) fault = "another range than the score's";
    if ((pattern.score >= 0) != (pattern.score_version > 0) ||
        pattern.score_version > kScoreVersion) {
      fault = "no score of version " + std::to_string(pattern.score_version);
    }
    const double longer = std::max(pattern.width, pattern.height);
    if (pattern.half_width != static_cast<float>(pattern.width / longer) ||
        pattern.half_height != static_cast<float>(pattern.height / longer)) {
      fault = "a plane that is not the picture's";
    }
    if (fault.empty()) continue;
    log.tell(WorkstationRule::kMetaDiffers, log.label("pattern", pattern.name), &pattern,
             kStateIt + fault);
  }
}

/// Sets of the paper's names have the paper's values.
void check_parameter_sets(ContentLog& log) {
  constexpr std::size_t kSize =
      offsetof(ParameterSetRecord, reserved) - offsetof(ParameterSetRecord, id);
  for (const ParameterSetRecord& set : log.bundle.parameter_sets()) {
    const bool known = ranges::any_of(paper_parameter_sets(), [&](const auto& other) {
      return log.bundle.name(set.name) == parameter_set_name(other.id) &&
             std::memcmp(&set.id, &other.id, kSize) == 0;
    });
    if (known) continue;
    log.tell(WorkstationRule::kMetaDiffers, log.label("parameter set", set.name), &set,
             "its values are not those of a set of that name");
  }
}

/// Calls `work` with each field of each record of every table, and the place of the record.
template <class Work>
void for_each_field(const BundleView& bundle, const Work& work) {
  for (const RecordInfo& record : record_infos()) {
    if (record.table == nullptr) continue;
    const auto bytes = bundle.section(record.section);
    if (bytes.size() < sizeof(TableHeader)) continue;
    const auto header = load_number<TableHeader>(bytes.data());
    for (std::uint32_t i = 0; i < header.count; ++i) {
      const std::byte* place = bytes.data() + sizeof header + std::size_t{i} * header.stride;
      for (const FieldInfo& field : record.fields) work(record, field, place);
    }
  }
}

/// Marks the bytes of names that the records of every table use, and of the parameter sets that
/// trim() leaves out.
std::vector<bool> used_names(const BundleView& bundle) {
  const auto names = bundle.section(SectionType::kNames);
  std::vector<bool> used(names.size());
  const std::string_view text(reinterpret_cast<const char*>(names.data()), names.size());
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    const std::string_view name = parameter_set_name(set.id);
    const std::size_t at = text.find(name);
    if (at == text.npos) continue;
    std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(at), name.size(), true);
  }
  for_each_field(bundle, [&](const RecordInfo&, const FieldInfo& field, const std::byte* place) {
    if (field.type != FieldType::kName) return;
    const auto name = load_number<NameRef>(place + field.offset);
    std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(name.offset), name.length, true);
  });
  return used;
}

/// Numbers next to 0, of bits that a format's smallest normal number does not need: no measure or
/// text gives them.
void check_numbers(ContentLog& log) {
  const auto tiny = [](const FieldInfo& field, const std::byte* at) {
    if (field.type == FieldType::kF32)
      return std::fpclassify(load_number<float>(at)) == FP_SUBNORMAL;
    return field.type == FieldType::kF64 &&
           std::fpclassify(load_number<double>(at)) == FP_SUBNORMAL;
  };
  for_each_field(
      log.bundle, [&](const RecordInfo& record, const FieldInfo& field, const std::byte* place) {
        for (std::size_t i = 0; i < field.count; ++i) {
          const std::byte* at = place + field.offset + i * field_element_bytes(field.type);
          if (tiny(field, at)) {
            log.tell(WorkstationRule::kNumberTiny, record.table, at, field.name);
          }
        }
      });
}

void check_unused(ContentLog& log, const char* table, std::vector<bool> used) {
  const auto unused = ranges::find(used, false);
  if (unused == used.end()) return;
  log.tell(WorkstationRule::kUnused, table, log.bundle.bytes().data(),
           "nothing uses number " + std::to_string(unused - used.begin()));
}

void check_uses(ContentLog& log) {
  const BundleView& bundle = log.bundle;
  std::vector<bool> layouts(bundle.layouts().size());
  for (const ModelRecord& model : bundle.models()) layouts[model.layout] = true;
  std::vector<bool> textures(bundle.textures().size());
  for (const MaterialRecord& material : bundle.materials()) {
    if (material.texture != kNone) textures[material.texture] = true;
  }
  std::vector<bool> media(bundle.media().size());
  for (const NodeRecord& node : bundle.nodes()) {
    if (static_cast<NodeKind>(node.kind) == NodeKind::kPicture) textures[node.subject] = true;
    if (plays_media(node)) media[node.subject] = true;
  }
  for (const MediaRecord& file : bundle.media()) {
    if (file.poster != kNone) textures[file.poster] = true;
  }
  check_unused(log, "bytes of names", used_names(bundle));
  check_unused(log, "layouts", std::move(layouts));
  check_unused(log, "textures", std::move(textures));
  check_unused(log, "media", std::move(media));
}

void report_unseen_models(const BundleView& bundle, const IssueSink& sink) {
  for (const SceneRecord& scene : bundle.scenes()) {
    if (!draws_nothing(bundle, scene)) continue;
    const auto at = reinterpret_cast<const std::byte*>(&scene) - bundle.bytes().data();
    sink({&workstation_issue_kind(WorkstationRule::kModelUnseen),
          "model '" + std::string(bundle.name(bundle.models()[scene.model].name)) + "'",
          static_cast<std::uint64_t>(at), "", std::nullopt});
  }
}

}  // namespace

void check_statements(ContentLog& log) {
  check_list(log, "models", "model", log.bundle.models());
  check_list(log, "patterns", "pattern", log.bundle.patterns());
  check_patterns(log);
  check_parameter_sets(log);
  check_numbers(log);
  check_uses(log);
}

bool check_content(const BundleView& bundle, const IssueSink& sink, const ContentOptions& options) {
  const std::string_view meta = bundle.meta();
  const bool ours = Json::parse(meta).text_at("tool").starts_with("modar ");
  if (!ours || meta.starts_with(kPreviewMeta)) return true;
  ContentLog log(bundle, sink, options);
  for (const auto rules :
       {check_statements, check_meshes, check_textures, check_placements, check_pictures}) {
    if (!log.done()) rules(log);
  }
  return log.good();
}

bool check_all(std::span<const std::byte> bytes, const DeviceProfile* device, unsigned jobs,
               const IssueSink& sink) {
  if (!check_whole(bytes, device, sink)) return false;
  if (const auto bundle = BundleView::open(bytes)) {
    report_unseen_models(*bundle, sink);
    check_content(*bundle, sink, {.jobs = jobs});
  }
  return true;
}

}  // namespace modar
