// The options of the bake that a project file sets.
#pragma once

#include "bake/options/options.hpp"
#include "bake/project/project.hpp"

namespace modar {

/// Errors: kInvalidInput "project.value"; `where` is the key.
Result<void> apply_settings(const Settings& settings, BakeRequest& request);

/// Those of `settings` that change what becomes of such a part.
Settings settings_of(const Settings& settings, OptionPart part);

}  // namespace modar
