#include "bake/project/settings.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "bake/bundle/request_text.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

tl::unexpected<Error> bad_value(const std::string& value, const std::string& cure) {
  return fail(ExitCode::kInvalidInput, "project.value", "", "'" + value + "' is not understood",
              cure);
}

/// A whole number within limits.
Result<void> take_number(const std::string& value, std::uint32_t least, std::uint32_t most,
                         std::uint32_t& out) {
  double number = 0;
  if (parse_number(value, number) && number >= least && number <= most &&
      number == std::floor(number)) {
    out = static_cast<std::uint32_t>(number);
    return {};
  }
  return bad_value(value,
                   "give a number from " + std::to_string(least) + " to " + std::to_string(most));
}

template <class Value, class Enum>
Result<void> take_word(const std::string& value, const std::map<std::string, Enum>& words,
                       Value& out) {
  const auto found = words.find(value);
  if (found != words.end()) {
    out = found->second;
    return {};
  }
  std::string list;
  for (const auto& [word, meaning] : words) list += (list.empty() ? "" : ", ") + word;
  return bad_value(value, "name one of " + list);
}

Result<void> take_parameters(const std::string& value, BakeRequest& request) {
  request.parameters.clear();
  for (const std::string_view name : split(value, ',')) {
    const auto& sets = paper_parameter_sets();
    const bool known =
        name == "none" || std::any_of(sets.begin(), sets.end(), [&](const auto& set) {
          return name == parameter_set_name(set.id);
        });
    if (!known) return bad_value(std::string(name), "`modar bake --help` lists the sets");
    request.parameters.emplace_back(name);
  }
  return {};
}

using Kind = Setting::Kind;
using Part = Setting::Part;

constexpr Setting kSettings[] = {
    {"max-texture", Kind::kNumber, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       return take_number(value, 4, kMaxTextureSide, request.textures.max_side);
     }},
    {"mipmaps", Kind::kTruth, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       request.textures.mipmaps = value == "true";
       return Result<void>();
     }},
    {"effort", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       return take_word<TextureEffort, TextureEffort>(value,
                                                      {{"fast", TextureEffort::kFast},
                                                       {"good", TextureEffort::kGood},
                                                       {"best", TextureEffort::kBest}},
                                                      request.textures.effort);
     }},
    {"perceptual", Kind::kTruth, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       request.textures.perceptual = value == "true";
       return Result<void>();
     }},
    {"unit", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) -> Result<void> {
       MODAR_ASSIGN(request.unit_metres, parse_unit(value));
       return {};
     }},
    {"max-error", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) -> Result<void> {
       MODAR_ASSIGN(request.max_error, parse_max_error(value));
       return {};
     }},
    {"positions", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       return take_word<std::optional<PositionKind>, PositionKind>(
           value, {{"half", PositionKind::kHalf}, {"int16", PositionKind::kInt16}},
           request.positions);
     }},
    {"lods", Kind::kNumber, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       return take_number(value, 1, kMaxLevels, request.levels);
     }},
    {"topology", Kind::kTruth, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       request.topology = value == "true";
       return Result<void>();
     }},
    {"atlas", Kind::kTruth, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       request.atlas = value == "true" ? AtlasMode::kAlways : AtlasMode::kNever;
       return Result<void>();
     }},
    {"occlusion", Kind::kTruth, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       request.occlusion = value == "true";
       return Result<void>();
     }},
    {"up", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) -> Result<void> {
       MODAR_ASSIGN(request.up, parse_up(value));
       return {};
     }},
    {"shadows", Kind::kTruth, Part::kScene,
     [](const std::string& value, BakeRequest& request) {
       request.shadows = value == "true";
       return Result<void>();
     }},
    // After max-texture, which both lower.
    {"tier", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) { return plan_for_tier(value, request); }},
    {"device", Kind::kText, Part::kModel,
     [](const std::string& value, BakeRequest& request) {
       return plan_for_device(value, request);
     }},
    {"loop-views", Kind::kNumber, Part::kPattern,
     [](const std::string& value, BakeRequest& request) {
       return take_number(value, 1, 10000, request.loop.trial_views);
     }},
    {"parameters", Kind::kTexts, Part::kPattern, take_parameters},
    {"score", Kind::kTruth, Part::kPattern,
     [](const std::string& value, BakeRequest& request) {
       request.loop.score = value == "true";
       return Result<void>();
     }},
};

}  // namespace

std::span<const Setting> all_settings() {
  return kSettings;
}

Result<void> apply_settings(const Settings& settings, BakeRequest& request) {
  for (const Setting& setting : kSettings) {
    const auto found = settings.find(setting.key);
    if (found == settings.end()) continue;
    if (auto applied = setting.apply(found->second, request); !applied) {
      const Error& error = applied.error();
      return fail(ExitCode::kInvalidInput, "project.value", setting.key, error.cause, error.cure);
    }
  }
  return {};
}

Settings settings_of(const Settings& settings, Setting::Part part) {
  Settings mine;
  for (const Setting& setting : kSettings) {
    const auto found = settings.find(setting.key);
    if (setting.part == part && found != settings.end()) mine.insert(*found);
  }
  return mine;
}

}  // namespace modar
