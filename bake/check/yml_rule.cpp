// The one rule of the checker that needs OpenCV: a pattern's YML text equals its mapped twin.
#include "bake/check/yml_rule.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "formats/bundle_view.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

const IssueKind* yml_issue_kind() {
  for (const IssueKind& kind : content_issue_kinds()) {
    if (std::strcmp(kind.id, "PATTERN_YML_DIFFERS") == 0) return &kind;
  }
  return nullptr;
}

/// Empty where text and twin agree, else what differs.
std::string difference(std::string_view yml, const FeatureView& twin) {
  const Result<Features> text = features_from_yml(std::string(yml));
  if (!text) return to_line(text.error());
  if (text->keypoints.size() != twin.keypoints.size()) {
    return with_numbers("{} keypoints in the text, {} in the twin",
                        {text->keypoints.size(), twin.keypoints.size()});
  }
  const bool same_keypoints =
      twin.keypoints.empty() ||
      std::memcmp(text->keypoints.data(), twin.keypoints.data(), twin.keypoints.size_bytes()) == 0;
  if (!same_keypoints) return "keypoints differ";
  if (!std::equal(text->descriptors.begin(), text->descriptors.end(), twin.descriptors.begin(),
                  twin.descriptors.end())) {
    return "descriptors differ";
  }
  return {};
}

/// True if text and twin agree, or there is no text.
bool check_pair(const BundleView& bundle, std::uint32_t pattern, const ParameterSetRecord& set,
                const IssueSink& sink) {
  const std::string_view yml = bundle.feature_yml(pattern, set.id);
  if (yml.empty()) return true;
  const std::string detail = difference(yml, bundle.features(pattern, set.id));
  if (detail.empty()) return true;
  Issue issue;
  issue.kind = yml_issue_kind();
  issue.where = "pattern '" + std::string(bundle.name(bundle.patterns()[pattern].name)) + "', " +
                std::string(bundle.name(set.name));
  issue.offset =
      static_cast<std::uint64_t>(yml.data() - reinterpret_cast<const char*>(bundle.bytes().data()));
  issue.detail = detail;
  sink(issue);
  return false;
}

}  // namespace

bool check_yml_twins(std::span<const std::byte> bytes, const IssueSink& sink) {
  const Result<BundleView> bundle = BundleView::open(bytes);
  if (!bundle) return false;
  bool good = true;
  for (std::uint32_t p = 0; p < bundle->patterns().size(); ++p) {
    for (const ParameterSetRecord& each : bundle->parameter_sets()) {
      good = check_pair(*bundle, p, each, sink) && good;
    }
  }
  return good;
}

bool check_yml_twin(std::span<const std::byte> bytes, std::uint32_t pattern, std::uint32_t set_id,
                    const IssueSink& sink) {
  const Result<BundleView> bundle = BundleView::open(bytes);
  if (!bundle || pattern >= bundle->patterns().size()) return false;
  for (const ParameterSetRecord& set : bundle->parameter_sets()) {
    if (set.id == set_id) return check_pair(*bundle, pattern, set, sink);
  }
  return false;
}

}  // namespace modar
