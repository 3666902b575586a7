// The documents of `modar check`. Their keys are a contract (json.md).
#pragma once

#include <optional>
#include <string>

#include "bake/check/picture/pose_check.hpp"
#include "bake/check/picture/visual_check.hpp"
#include "bake/check/source/source_check.hpp"
#include "bake/check/verdict.hpp"

namespace modar {

/// What a bundle was held against besides the rules on its bytes.
struct CheckExtras {
  std::string device;  ///< empty: none
  std::optional<SourceFit> source;
  std::vector<PatternRange> poses;
  std::vector<ModelLook> looks;
};

/// `modar check --json`; its schema is bake/commands/check.schema.json.
std::string check_json(const Verdict& verdict, const CheckExtras& extras);

/// `modar check --sarif`: SARIF 2.1.0 for systems that show findings next to code.
/// path: of the bundle, as the user wrote it.
std::string check_sarif(const Verdict& verdict, const std::string& path,
                        const std::string& tool_version);

}  // namespace modar
