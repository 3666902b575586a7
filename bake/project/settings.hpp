// The options of the bake that a project file can set.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "bake/project/project.hpp"

namespace modar {

struct Setting {
  const char* key;
  enum class Kind : std::uint8_t { kText, kNumber, kTruth, kTexts } kind;  ///< of TOML
  enum class Part : std::uint8_t { kModel, kPattern, kScene } part;        ///< that it changes
  /// value: as text; truths are "true" and "false", lists have commas between their parts.
  Result<void> (*apply)(const std::string& value, BakeRequest& request);
};

/// All there are, in the order in which they are applied.
std::span<const Setting> all_settings();

/// Errors: kInvalidInput "project.value"; `where` is the key.
Result<void> apply_settings(const Settings& settings, BakeRequest& request);

/// Those of `settings` that change what becomes of such a part.
Settings settings_of(const Settings& settings, Setting::Part part);

}  // namespace modar
