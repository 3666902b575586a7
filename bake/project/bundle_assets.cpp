// Which assets of a project go into one of its bundles.
#include <fnmatch.h>

#include <algorithm>

#include "bake/project/project.hpp"

namespace modar {
namespace {

bool matches(const std::string& name, const std::vector<std::string>& globs) {
  return std::any_of(globs.begin(), globs.end(), [&](const std::string& glob) {
    return ::fnmatch(glob.c_str(), name.c_str(), 0) == 0;
  });
}

/// "a, b and 3 more".
std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMostNames = 6;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i) {
    list += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() <= kMostNames) return list;
  return list + " and " + std::to_string(names.size() - kMostNames) + " more";
}

}  // namespace

BundleAssets assets_of(const Project& project, const ProjectBundle& bundle) {
  const bool all = bundle.models.empty() && bundle.patterns.empty();
  BundleAssets assets;
  std::set<std::string> patterns;
  for (const ProjectAsset& pattern : project.patterns) {
    if (!all && !matches(pattern.name, bundle.patterns)) continue;
    assets.patterns.push_back(&pattern);
    patterns.insert(pattern.name);
  }
  std::set<std::string> used;  // "\np" behind patterns, "\nm" behind models
  for (const ProjectScene& scene : project.scenes) {
    if (!patterns.contains(scene.request.pattern)) continue;
    assets.scenes.push_back(&scene);
    used.insert({scene.request.pattern + "\np", scene.request.model + "\nm"});
  }
  std::vector<std::string> left_out;
  std::vector<std::string> kept;
  for (const ProjectAsset& model : project.models) {
    const bool shown = used.contains(model.name + "\nm");
    const bool named = matches(model.name, bundle.models) || (all && patterns.empty());
    if (shown || named) assets.models.push_back(&model);
    if (shown || patterns.empty() || !(named || all)) continue;
    (named ? kept : left_out).push_back(model.name);
  }
  std::vector<std::string> bare;
  for (const ProjectAsset* pattern : assets.patterns) {
    if (!used.contains(pattern->name + "\np")) bare.push_back(pattern->name);
  }
  if (assets.models.empty() && left_out.empty()) bare.clear();
  using Kind = NeverShown::Kind;
  for (const auto& [kind, names] :
       {std::pair(Kind::kLeftOut, &left_out), {Kind::kKept, &kept}, {Kind::kBare, &bare}}) {
    if (!names->empty()) assets.never_shown.push_back({kind, list_of(*names)});
  }
  return assets;
}

Diagnostic finding_of(const NeverShown& what, const std::string& file) {
  const bool left_out = what.kind == NeverShown::Kind::kLeftOut;
  return {kNeverShown,
          DiagnosticSeverity::kWarning,
          file,
          0,
          (what.kind == NeverShown::Kind::kBare ? "nothing is on the patterns "
                                                : "no pattern shows the models ") +
              what.names + (left_out ? ": they are left out" : ""),
          std::string("write a [[scene]] with pattern and model for each, or ") +
              (left_out ? "name them in `models` of a [[bundle]] to keep them" : "leave them out")};
}

}  // namespace modar
