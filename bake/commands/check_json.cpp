// What `modar check` prints for programs.
#include "bake/commands/check_json.hpp"

#include <algorithm>
#include <vector>

#include "bake/json.hpp"

namespace modar {
namespace {

std::string message_of(const Issue& issue) {
  std::string message = issue.kind->message;
  if (!issue.detail.empty()) message += ": " + issue.detail;
  return message;
}

/// A path as a relative reference of RFC 3986: all but unreserved characters and slashes escaped.
std::string uri_of(const std::string& path) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  const std::string plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string uri;
  for (const char letter : path) {
    if (plain.find(letter) != std::string::npos) {
      uri += letter;
      continue;
    }
    const auto byte = static_cast<unsigned char>(letter);
    uri += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return uri;
}

Json source_json(const SourceFit& fit) {
  const Json models = Json::list(fit.models, [&](const ModelFit& model) -> Json {
    return {{"name", model.name},
            {"same_bytes", model.same_bytes},
            {"stated_error", model.stated_error},
            {"source_to_bundle", model.source_to_bundle},
            {"bundle_to_source", model.bundle_to_source},
            {"colour_error", model.colour_error}};
  });
  return {
      {"models", models}, {"same", Json::list(fit.same)}, {"different", Json::list(fit.different)}};
}

Json poses_json(const std::vector<PatternRange>& ranges) {
  Json list = Json::array();
  for (const PatternRange& range : ranges) {
    const Json steps = Json::list(range.steps, [&](const PoseStep& step) -> Json {
      return {{"area", step.area},
              {"tilt_deg", step.tilt_deg},
              {"views", step.views},
              {"right", step.right},
              {"corner_px", step.corner_px},
              {"rotation_deg", step.rotation_deg},
              {"translation_percent", step.translation_percent}};
    });
    list.push_back({{"pattern", range.name},
                    {"method", range.method},
                    {"area_low", range.area_low},
                    {"area_high", range.area_high},
                    {"tilt_deg", range.tilt_deg},
                    {"corner_px", range.corner_px},
                    {"rotation_deg", range.rotation_deg},
                    {"translation_percent", range.translation_percent},
                    {"steps", steps}});
  }
  return list;
}

Json levels_json(const std::vector<LevelLook>& levels) {
  return Json::list(levels, [&](const LevelLook& level) -> Json {
    return {{"level", level.level},
            {"side_px", level.side_px},
            {"triangles", level.triangles},
            {"finest_triangles", level.finest_triangles},
            {"difference_p99", level.difference},
            {"difference_mean", level.difference_mean}};
  });
}

Json clips_json(const std::vector<ClipLook>& clips) {
  return Json::list(clips, [&](const ClipLook& clip) -> Json {
    return {{"clip", clip.name},
            {"ssim_mean", clip.ssim_mean},
            {"ssim_worst", clip.ssim_worst},
            {"delta_e_mean", clip.delta_e_mean},
            {"delta_e_worst", clip.delta_e_worst},
            {"worst_view", clip.worst_view},
            {"worst_s", clip.worst_s}};
  });
}

Json looks_json(const std::vector<ModelLook>& looks) {
  return Json::list(looks, [&](const ModelLook& look) -> Json {
    return {{"model", look.name},
            {"judged", look.judged},
            {"ssim_mean", look.ssim_mean},
            {"ssim_worst", look.ssim_worst},
            {"delta_e_mean", look.delta_e_mean},
            {"delta_e_worst", look.delta_e_worst},
            {"worst_view", look.worst_view},
            {"picture", look.picture.empty() ? Json() : Json(look.picture)},
            {"clips", clips_json(look.clips)},
            {"levels", levels_json(look.levels)}};
  });
}

const char* sarif_level(Severity severity) {
  return severity == Severity::kInfo ? "note" : severity_name(severity);
}

Json sarif_rules(const std::vector<const IssueKind*>& kinds) {
  return Json::list(kinds, [&](const IssueKind* kind) -> Json {
    return {{"id", kind->id},
            {"shortDescription", {{"text", kind->message}}},
            {"help", {{"text", kind->cure}}},
            {"defaultConfiguration", {{"level", sarif_level(kind->severity)}}}};
  });
}

Json sarif_result(const WeighedIssue& weighed, const std::string& uri, std::size_t rule) {
  const Issue& issue = weighed.issue;
  const Json place = {{"artifactLocation", {{"uri", uri}}},
                      {"region", {{"byteOffset", issue.offset}, {"byteLength", 1}}}};
  return {
      {"ruleId", issue.kind->id},
      {"ruleIndex", rule},
      {"level", sarif_level(weighed.severity)},
      {"message", {{"text", message_of(issue) + "; " + issue.kind->cure}}},
      {"locations",
       Json::array({Json({{"physicalLocation", place},
                          {"logicalLocations", Json::array({Json({{"name", issue.where}})})}})})}};
}

}  // namespace

std::string check_json(const Verdict& verdict, const CheckExtras& extras) {
  Json list = Json::array();
  for (const WeighedIssue& weighed : verdict.issues()) {
    const Issue& issue = weighed.issue;
    list.push_back({{"id", issue.kind->id},
                    {"severity", severity_name(weighed.severity)},
                    {"where", issue.where},
                    {"offset", issue.offset},
                    {"message", message_of(issue)},
                    {"cure", issue.kind->cure}});
  }
  Json left_out = Json::object();
  for (const auto& [id, count] : verdict.left_out()) left_out.set(id, count);
  Json document = {{"verdict", verdict.good() ? "good" : "bad"},
                   {"errors", verdict.errors()},
                   {"warnings", verdict.warnings()},
                   {"device", extras.device.empty() ? Json() : Json(extras.device)},
                   {"issues", list},
                   {"left_out", left_out}};
  if (extras.source) document.set("source", source_json(*extras.source));
  if (!extras.poses.empty()) document.set("poses", poses_json(extras.poses));
  if (!extras.looks.empty()) document.set("looks", looks_json(extras.looks));
  return document.dump();
}

std::string check_sarif(const Verdict& verdict, const std::string& path,
                        const std::string& tool_version) {
  const std::vector<const IssueKind*> kinds = all_issue_kinds();
  Json results = Json::array();
  for (const WeighedIssue& weighed : verdict.issues()) {
    const auto rule = std::find(kinds.begin(), kinds.end(), weighed.issue.kind);
    results.push_back(
        sarif_result(weighed, uri_of(path), static_cast<std::size_t>(rule - kinds.begin())));
  }
  const Json driver = {
      {"name", "modar check"}, {"version", tool_version}, {"rules", sarif_rules(kinds)}};
  const Json run = {{"tool", {{"driver", driver}}},
                    {"invocations", Json::array({Json({{"executionSuccessful", true}})})},
                    {"artifacts", Json::array({Json({{"location", {{"uri", uri_of(path)}}}})})},
                    {"results", results}};
  const Json document = {{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
                         {"version", "2.1.0"},
                         {"runs", Json::array({run})}};
  return document.dump();
}

}  // namespace modar
