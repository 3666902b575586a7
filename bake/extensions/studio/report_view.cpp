#include "bake/extensions/studio/report_view.hpp"

#include <algorithm>
#include <array>
#include <thread>
#include <vector>

#include "bake/bundle/bundle_json.hpp"
#include "bake/check/content/content_check.hpp"
#include "bake/check/verdict.hpp"
#include "bake/extensions/studio/exports.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/io/input.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/ranges.hpp"
#include "formats/bundle_view.hpp"
#include "formats/sections.hpp"
#include "modar/device_profile.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr std::size_t kMostFindings = 1u << 20;  // bytes of the file of a bake's findings

struct OpenBundle {
  MappedFile file;
  BundleView view;
};

Result<OpenBundle> open_bundle(Session& session) {
  MODAR_ASSIGN(const std::string path, baked_bundle(session));
  OpenBundle bundle;
  MODAR_ASSIGN(bundle.file, MappedFile::open(path_in(session, path)));
  MODAR_ASSIGN(bundle.view, BundleView::open(bundle.file.bytes()));
  return bundle;
}

/// "model 'spider', chunk 3" is a thing of the view where models are, "pattern 'cover'" of the
/// pictures'.
Json place_of(const std::string& where) {
  const std::size_t quote = where.find('\'');
  const std::size_t end = quote == std::string::npos ? quote : where.find('\'', quote + 1);
  if (end == std::string::npos) return {};
  const std::string name = where.substr(quote + 1, end - quote - 1);
  const char* view = where.starts_with("pattern")                                 ? "picture"
                     : where.starts_with("scene") || where.starts_with("node")    ? "scene"
                     : where.starts_with("model") || where.starts_with("texture") ? "files"
                                                                                  : "ship";
  return {{"view", view}, {"name", name}};
}

Json finding_json(const WeighedIssue& weighed) {
  const Issue& issue = weighed.issue;
  return {{"severity", severity_name(weighed.severity)},
          {"id", issue.kind->id},
          {"where", issue.where},
          {"text", issue.kind->message},
          {"detail", issue.detail},
          {"cure", issue.kind->cure},
          {"place", place_of(issue.where)}};
}

Json findings_json(const Verdict& verdict) {
  return Json::list(verdict.issues(), finding_json);
}

std::string findings_file(const Session& session) {
  return session.own + "/findings.json";
}

/// The warnings of the bake that wrote a bundle; nothing where another program wrote it.
Json bake_warnings(const Session& session, const BundleView& bundle) {
  const Json kept = Json::parse(read_file(findings_file(session), kMostFindings).value_or(""));
  Json warnings = Json::array();
  if (kept.text_at("bundle") != std::to_string(bundle.header().hash)) return warnings;
  for (const Json& one : kept["findings"].elements()) {
    const auto text = [&](const char* key) { return one.text_at(key); };
    if (text("severity") != "warning" || text("id") == kNeverShown) continue;
    warnings.push_back({{"severity", "warning"},
                        {"id", text("id")},
                        {"where", text("file")},
                        {"text", text("message")},
                        {"detail", ""},
                        {"cure", text("cure")},
                        {"place", {{"view", "files"}, {"name", text("file")}}}});
  }
  return warnings;
}

Json never_shown_json(const NeverShown& what) {
  const Diagnostic finding = finding_of(what, "");
  return {{"severity", "warning"},   {"id", finding.id},     {"names", what.names},
          {"text", finding.message}, {"cure", finding.cure}, {"place", Json{{"view", "scene"}}}};
}

Result<Json> check(Session& session, const std::string& device) {
  const DeviceProfile* profile = nullptr;
  if (!device.empty()) {
    profile = find_device_profile(device);
    if (profile == nullptr) {
      return fail(ExitCode::kUsage, "device.unknown", device, "there is no such device",
                  "choose from " + device_profile_names());
    }
  }
  MODAR_ASSIGN(const OpenBundle bundle, open_bundle(session));
  Verdict verdict;
  check_all(bundle.file.bytes(), profile, std::thread::hardware_concurrency(),
            [&](const Issue& issue) {
              // What the project says of it names models that are not in the bundle, too.
              if (std::string_view(issue.kind->id) != "NEVER_SHOWN") verdict.add(issue);
            });
  MODAR_TRY(bundle.file.intact());
  Json findings = findings_json(verdict);
  Json warnings = bake_warnings(session, bundle.view);
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const Project project = read_draft(state.text, session.file).project;
  for (const NeverShown& what : assets_of(project, project.bundles.front()).never_shown) {
    warnings.push_back(never_shown_json(what));
  }
  for (Json& warning : warnings.elements()) findings.push_back(std::move(warning));
  return Json{{"good", verdict.good()},
              {"errors", verdict.errors()},
              {"warnings", verdict.warnings() + warnings.size()},
              {"findings", std::move(findings)}};
}

struct Part {
  std::string kind;
  std::string name;
  std::uint64_t bytes = 0;
};

/// Of models by their vertices' and indices' share, of textures and pictures by their sections.
std::vector<Part> parts_of(const BundleView& bundle) {
  std::vector<Part> parts;
  std::uint64_t triangles = 0;
  for (const ModelRecord& model : bundle.models()) triangles += model.triangle_count;
  const std::uint64_t geometry = bundle.vertices().size() + bundle.indices().size();
  for (const ModelRecord& model : bundle.models()) {
    const double share =
        triangles == 0 ? 0
                       : static_cast<double>(model.triangle_count) / static_cast<double>(triangles);
    parts.push_back({"model", std::string(bundle.name(model.name)),
                     static_cast<std::uint64_t>(share * static_cast<double>(geometry))});
  }
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    parts.push_back({"texture", std::string(bundle.name(bundle.textures()[t].name)),
                     bundle.texture_data(t).size()});
  }
  for (std::uint32_t m = 0; m < bundle.media().size(); ++m) {
    parts.push_back({"video", std::to_string(m + 1), bundle.media_data(m).size()});
  }
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    Part part{"picture", std::string(bundle.name(bundle.patterns()[p].name)), 0};
    for (const SectionType type : {SectionType::kTrackerRecord, SectionType::kPatternShape,
                                   SectionType::kPatternColours, SectionType::kPatternPicture}) {
      part.bytes += bundle.section(type, p).size();
    }
    for (const ParameterSetRecord& set : bundle.parameter_sets()) {
      const std::uint32_t id = set.id;
      const FeatureView features = bundle.features(p, id);
      part.bytes += features.keypoints.size() * sizeof(KeypointRecord) +
                    features.descriptors.size() + bundle.feature_yml(p, id).size();
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

Result<Json> sizes(Session& session) {
  MODAR_ASSIGN(const OpenBundle bundle, open_bundle(session));
  const std::uint64_t whole = bundle.file.bytes().size();
  std::vector<Part> parts = parts_of(bundle.view);
  std::uint64_t told = 0;
  for (const Part& part : parts) told += part.bytes;
  parts.push_back({"other", "", whole > told ? whole - told : 0});
  ranges::stable_sort(parts, std::greater(), &Part::bytes);
  Json list = Json::list(parts, [&](const Part& part) -> Json {
    return {{"kind", part.kind},
            {"name", part.name},
            {"bytes", part.bytes},
            {"share", static_cast<double>(part.bytes) / static_cast<double>(whole)}};
  });
  return Json{{"bytes", whole}, {"parts", std::move(list)}};
}

Result<Json> devices(Session& session) {
  MODAR_ASSIGN(const OpenBundle bundle, open_bundle(session));
  Json list = Json::array();
  for (const DeviceProfile& device : device_profiles()) {
    const Verdict verdict = device_verdict(bundle.view, device);
    list.push_back({{"name", std::string(device.name)},
                    {"title", std::string(device.title)},
                    {"fits", verdict.good()},
                    {"findings", findings_json(verdict)}});
  }
  return list;
}

Json model_facts(const BundleView& bundle, const Json& stated, std::uint32_t index) {
  const ModelRecord& model = bundle.models()[index];
  std::array<double, 3> least{};
  std::array<double, 3> most{};
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord chunk = bundle.chunks()[model.first_chunk + c];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto low = static_cast<double>(chunk.bounds_min[axis]);
      const auto high = static_cast<double>(chunk.bounds_max[axis]);
      least[axis] = c == 0 ? low : std::min(least[axis], low);
      most[axis] = c == 0 ? high : std::max(most[axis], high);
    }
  }
  Json size = Json::array();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size.push_back(model.scale * (most[axis] - least[axis]));
  }
  Json clips = Json::array();
  for (const ClipRecord& clip : bundle.clips()) {
    if (clip.model == index) clips.push_back(std::string(bundle.name(clip.name)));
  }
  const auto upright = upright_in(stated, index);
  const auto repair = stated_repair(bundle, index);
  return {{"triangles", model.triangle_count},
          {"size", std::move(size)},
          {"up", upright ? Json(up_axis_name(upright->axis)) : Json()},
          {"repair", repair ? defects_json(*repair) : Json()},
          {"clips", std::move(clips)}};
}

Json pattern_facts(const BundleView& bundle, const Json& stated, std::uint32_t index) {
  const PatternRecord& pattern = bundle.patterns()[index];
  const auto range = range_in(stated, index);
  if (!range) return {{"grade", nullptr}, {"score", nullptr}, {"range_cm", nullptr}};
  const double cm = static_cast<double>(pattern.width_mm) / 10;
  return {{"grade", std::string(1, grade_of(*range))},
          {"score", static_cast<double>(pattern.score)},
          {"range_cm", cm > 0 ? Json::array({range->nearest * cm, range->farthest * cm}) : Json()}};
}

}  // namespace

void keep_findings(Session& session, const Json& findings) {
  const auto bundle = open_bundle(session);
  if (!bundle) return;
  const Json kept = {{"bundle", std::to_string(bundle->view.header().hash)},
                     {"findings", findings}};
  // Without the file the page only says less.
  static_cast<void>(write_file(findings_file(session), kept.dump()));
}

BakedFacts baked_facts(const std::string& bundle) {
  BakedFacts facts;
  const auto file = MappedFile::open(bundle);
  const auto view = file ? BundleView::open(file->bytes()) : Result<BundleView>();
  if (!file || !view) return facts;
  const Json models = stated_list(*view, "models");
  for (std::uint32_t m = 0; m < view->models().size(); ++m) {
    facts.models[std::string(view->name(view->models()[m].name))] = model_facts(*view, models, m);
  }
  const Json patterns = stated_list(*view, "patterns");
  for (std::uint32_t p = 0; p < view->patterns().size(); ++p) {
    facts.patterns[std::string(view->name(view->patterns()[p].name))] =
        pattern_facts(*view, patterns, p);
  }
  return facts;
}

Result<Answer> get_check(Session& session, const Call& call) {
  return answer_or_error(check(session, call.asked("device")));
}

Result<Answer> get_sizes(Session& session) {
  return answer_or_error(sizes(session));
}

Result<Answer> get_devices(Session& session) {
  return answer_or_error(devices(session));
}

}  // namespace modar
