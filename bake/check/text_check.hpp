// What a page shows of a bundle's patterns, against the project file that says it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

/// A project's texts for visitors where a pattern has a model.
struct SceneText {
  std::string pattern;
  std::string model;
  std::map<std::string, std::string> words;   ///< by language
  std::map<std::string, std::string> alts{};  ///< the same
};

/// Holds the texts in the bundle's meta against those of its sources, both ways: SOURCE_SCENE for
/// each that is missing, strange or worded otherwise. bundle: one that check_bundle() found good.
void check_texts(const BundleView& bundle, const std::vector<SceneText>& sources,
                 const IssueSink& sink);

}  // namespace modar
