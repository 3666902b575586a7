// Takes a bundle's assets out again, as files of other tools.
#pragma once

#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// Writes into `folder` (made if absent): MODEL.glb a model with its textures inside,
/// TEXTURE.LEVEL.pkm (and TEXTURE.alpha.LEVEL.pkm) a texture level, TEXTURE.ktx a texture,
/// PATTERN.SET.yml a pattern and parameter set. Names are cleaned of what file systems do not like.
/// Answers the paths it wrote. force: see claim_output_folder().
Result<std::vector<std::string>> extract_bundle(const BundleView& bundle, const std::string& folder,
                                                bool force = false);

}  // namespace modar
