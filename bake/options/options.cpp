#include "bake/options/options.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "bake/options/request_text.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "modar/device_profile.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

using Part = OptionPart;
using Group = OptionGroup;

constexpr const char* kEfforts[] = {"fast", "good", "best"};
constexpr const char* kPositions[] = {"half", "int16"};
constexpr const char* kAtlases[] = {"never", "always"};
constexpr const char* kMaxErrorUnits[] = {"any", "source", "percent", "metres"};

void restore_number(const Json& options, const char* key, double& value) {
  value = options[key].number().value_or(value);
}

constexpr TextOption kDevice = {
    [] {
      std::vector<std::string> names;
      for (const DeviceProfile& profile : device_profiles()) names.emplace_back(profile.name);
      return names;
    },
    plan_for_device,
    [](const BakeRequest& request, const char* name, Json& options) {
      options.set(name, request.device);
    },
    [](const Json& options, const char* name, BakeRequest& request) {
      static_cast<void>(plan_for_device(options.text_at(name), request));
    }};

constexpr TextOption kTier = {tier_names, plan_for_tier,
                              [](const BakeRequest& request, const char* name, Json& options) {
                                options.set(name, request.tier);
                              },
                              [](const Json& options, const char* name, BakeRequest& request) {
                                static_cast<void>(plan_for_tier(options.text_at(name), request));
                              }};

constexpr TextOption kMaxError = {
    nullptr,
    [](const std::string& text, BakeRequest& request) -> Result<void> {
      MODAR_ASSIGN(request.max_error, parse_max_error(text));
      return {};
    },
    [](const BakeRequest& request, const char* name, Json& options) {
      options.set(name, request.max_error.value);
      options.set(std::string(name) + "-unit",
                  kMaxErrorUnits[static_cast<std::size_t>(request.max_error.unit)]);
    },
    [](const Json& options, const char* name, BakeRequest& request) {
      restore_number(options, name, request.max_error.value);
      const std::string unit = options.text_at(std::string(name) + "-unit");
      const auto* found = std::find(std::begin(kMaxErrorUnits), std::end(kMaxErrorUnits), unit);
      if (found == std::end(kMaxErrorUnits)) return;
      request.max_error.unit = static_cast<MaxError::Unit>(found - std::begin(kMaxErrorUnits));
    }};

constexpr TextOption kUnit = {
    [] { return std::vector<std::string>{"mm", "cm", "m", "km", "in", "ft"}; },
    [](const std::string& text, BakeRequest& request) -> Result<void> {
      MODAR_ASSIGN(request.unit_metres, parse_unit(text));
      return {};
    },
    [](const BakeRequest& request, const char* name, Json& options) {
      options.set(name, request.unit_metres);
    },
    [](const Json& options, const char* name, BakeRequest& request) {
      restore_number(options, name, request.unit_metres);
    }};

constexpr TextOption kUp = {
    [] { return std::vector<std::string>(std::begin(kUpAxisNames), std::end(kUpAxisNames)); },
    [](const std::string& text, BakeRequest& request) -> Result<void> {
      MODAR_ASSIGN(request.up, parse_up(text));
      return {};
    },
    [](const BakeRequest& request, const char* name, Json& options) {
      options.set(name, request.up ? up_axis_name(*request.up) : "");
    },
    [](const Json& options, const char* name, BakeRequest& request) {
      request.up = up_axis_of(options.text_at(name));
    }};

/// The meta text has the picture's name; its path is that of a source of this name.
constexpr TextOption kLight = {nullptr,
                               [](const std::string& text, BakeRequest& request) -> Result<void> {
                                 request.light = text;
                                 return {};
                               },
                               [](const BakeRequest& request, const char* name, Json& options) {
                                 options.set(name, file_name(request.light));
                               },
                               [](const Json& options, const char* name, BakeRequest& request) {
                                 request.light = source_picture(request, options.text_at(name));
                               }};

constexpr WordsOption kParameters = {
    [] {
      std::vector<std::string> names = {"none", "all"};
      for (const auto& set : paper_parameter_sets()) names.emplace_back(parameter_set_name(set.id));
      return names;
    },
    [](BakeRequest& request) -> std::vector<std::string>& { return request.parameters; }};

constexpr BakeOption kOptions[] = {
    {"--device", "device", Part::kModel, Group::kTarget, "NAME", "mali400",
     "Fit a device's texture size and GPU memory", kDevice},
    {"--tier", "tier", Part::kModel, Group::kTarget, "TIER", "phone",
     "Reduce models: thumb has 20,000 triangles and textures of 512 pixels, phone 100,000 "
     "and 2048, desktop 150,000 and 4096",
     kTier},
    {"--lods,--no-lods", "lods", Part::kModel, Group::kGeometry, nullptr, "4",
     "Most levels of detail, including the finest; each has half the triangles of the one before "
     "(a "
     "quarter above 300,000)",
     NumberOption{[](BakeRequest& r) -> std::uint32_t& { return r.levels; }, 1, kMaxLevels}},
    {"--max-error", "max-error", Part::kModel, Group::kGeometry, "LENGTH", "0.01%",
     "Largest error of stored positions: in source units, as a percentage of the diagonal (0.01%), "
     "or "
     "as a length (2mm, with a unit)",
     kMaxError},
    {"--positions", "positions", Part::kModel, Group::kGeometry, "FORMAT", "int16",
     "Position format; without it half, or int16 or float if the largest error or a fine mesh "
     "requires it",
     WordOption{
         kPositions,
         [](const BakeRequest& r) { return r.positions ? static_cast<int>(*r.positions) : -1; },
         [](BakeRequest& r, int word) {
           r.positions = word < 0 ? std::nullopt : std::optional(static_cast<PositionKind>(word));
         },
         "auto", false}},
    {"--no-occlusion", "occlusion", Part::kModel, Group::kGeometry, nullptr, "false",
     "Store ambient occlusion", TruthOption{[](BakeRequest& r) -> bool& { return r.occlusion; }}},
    {"--no-shadows", "shadows", Part::kScene, Group::kGeometry, nullptr, "false",
     "Bake models' shadows on their patterns",
     TruthOption{[](BakeRequest& r) -> bool& { return r.shadows; }}},
    {"--topology,--no-topology", "topology", Part::kModel, Group::kGeometry, nullptr, "true",
     "Measure the models' topology and store the result in the bundle",
     TruthOption{[](BakeRequest& r) -> bool& { return r.topology; }}},
    {"--atlas,--no-atlas", "atlas", Part::kModel, Group::kTextures, nullptr, "true",
     "Repack the used parts of textures onto shared pages (without it, if it saves a third of the "
     "bytes "
     "or half of the materials)",
     WordOption{kAtlases,
                [](const BakeRequest& r) {
                  return r.atlas == AtlasMode::kWhereItPays ? -1
                                                            : int{r.atlas == AtlasMode::kAlways};
                },
                [](BakeRequest& r, int word) {
                  r.atlas = word < 0    ? AtlasMode::kWhereItPays
                            : word == 1 ? AtlasMode::kAlways
                                        : AtlasMode::kNever;
                },
                "where it pays", true}},
    {"--effort", "effort", Part::kModel, Group::kTextures, "EFFORT", "best",
     "Effort of the ETC1 encoder",
     WordOption{
         kEfforts, [](const BakeRequest& r) { return static_cast<int>(r.textures.effort); },
         [](BakeRequest& r, int word) { r.textures.effort = static_cast<TextureEffort>(word); },
         nullptr, false}},
    {"--perceptual", "perceptual", Part::kModel, Group::kTextures, nullptr, "true",
     "Weight ETC1 errors by luma",
     TruthOption{[](BakeRequest& r) -> bool& { return r.textures.perceptual; }}},
    {"--max-texture", "max-texture", Part::kModel, Group::kTextures, nullptr, "512",
     "Longest side of a texture, in pixels",
     NumberOption{[](BakeRequest& r) -> std::uint32_t& { return r.textures.max_side; }, 4,
                  kMaxTextureSide}},
    {"--no-mipmaps", "mipmaps", Part::kModel, Group::kTextures, nullptr, "false",
     "Store the smaller mip levels of textures",
     TruthOption{[](BakeRequest& r) -> bool& { return r.textures.mipmaps; }}},
    {"--loop-views", "loop-views", Part::kPattern, Group::kPatterns, nullptr, "60",
     "Random views that test a pattern's features: fewer bake faster, more are more robust",
     NumberOption{[](BakeRequest& r) -> std::uint32_t& { return r.loop.trial_views; }, 1, 10000}},
    {"--no-score", "score", Part::kPattern, Group::kPatterns, nullptr, "false",
     "Score the patterns", TruthOption{[](BakeRequest& r) -> bool& { return r.loop.score; }}},
    {"--unit", "unit", Part::kModel, Group::kTarget, nullptr, "mm",
     "Unit of the models' coordinates", kUnit},
    {"--up", "up", Part::kModel, Group::kGeometry, "AXIS", "z",
     "Axis of the models that points up, in scenes that name none; without it, as each file says",
     kUp},
    {"--light", "light", Part::kProject, Group::kTarget, "FILE", "room.hdr",
     "Radiance HDR panorama or photo of the room that lights scenes without a light of their own",
     kLight},
    {"--parameters", "parameters", Part::kPattern, Group::kPatterns, "SET,SET", "none",
     "Keypoints of the ModAR paper's method to store as well; without it orb-2000, with --device "
     "none",
     kParameters},
    {"--crease", "crease", Part::kModel, Group::kGeometry, "DEGREES", "30",
     "Angle between faces above which an edge stays sharp, where the file states no normals and no "
     "smoothing groups",
     NumberOption{[](BakeRequest& r) -> std::uint32_t& { return r.crease; }, 0, 180}},
    {"--smooth", "smooth", Part::kModel, Group::kGeometry, nullptr, "true",
     "Smooth all edges where the file states no normals and no smoothing groups",
     TruthOption{[](BakeRequest& r) -> bool& { return r.smooth; }}},
    {"--repair", "repair", Part::kModel, Group::kGeometry, nullptr, "true",
     "Repair scans: remove small islands and repeated triangles, split non-manifold edges, make "
     "the winding consistent, close small holes",
     TruthOption{[](BakeRequest& r) -> bool& { return r.repair; }, true}},
    {"--repair-support", "repair-support", Part::kModel, Group::kGeometry, nullptr, "true",
     "Repair, and remove the table or floor that a scan is on",
     TruthOption{[](BakeRequest& r) -> bool& { return r.repair_support; }, true}},
};

/// Whether the flags are "--" or "--no-" and the name.
constexpr bool one_spelling(const BakeOption& option) {
  std::string_view flags = option.flag;
  while (!flags.empty()) {
    std::string_view flag = flags.substr(0, flags.find(','));
    flags.remove_prefix(std::min(flags.size(), flag.size() + 1));
    flag.remove_prefix(flag.starts_with("--no-") ? 5 : 2);
    if (flag != option.name) return false;
  }
  return true;
}
static_assert(std::all_of(std::begin(kOptions), std::end(kOptions), one_spelling));

/// Of a variant's kinds, one function each.
template <class... Functions>
struct Each : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Each(Functions...) -> Each<Functions...>;

tl::unexpected<Error> bad_value(const std::string& value, const std::string& cure) {
  return fail(ExitCode::kInvalidInput, "project.value", "", "'" + value + "' is not understood",
              cure);
}

/// "a, b or c".
std::string listed(const std::vector<std::string>& words, const char* last) {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    list += (i == 0 ? "" : i + 1 == words.size() ? last : ", ") + words[i];
  }
  return list;
}

Result<void> take_number(const NumberOption& number, const std::string& text,
                         BakeRequest& request) {
  double value = 0;
  if (!parse_number(text, value) || value < number.least || value > number.most ||
      value != std::floor(value)) {
    return bad_value(text,
                     with_numbers("give a number from {} to {}", {number.least, number.most}));
  }
  number.at(request) = static_cast<std::uint32_t>(value);
  return {};
}

Result<void> parse_word(const WordOption& word, const BakeOption& option, const std::string& text,
                        BakeRequest& request) {
  std::vector<std::string> names = option_choices(option);
  if (word.truth) names = {"false", "true"};
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) return bad_value(text, "name one of " + listed(names, ", "));
  word.set(request, static_cast<int>(found - names.begin()));
  return {};
}

Result<void> parse_words(const WordsOption& words, const std::string& text, BakeRequest& request) {
  const std::vector<std::string> known = words.choices();
  std::vector<std::string>& values = words.at(request);
  values.clear();
  for (const std::string_view word : split(text, ',')) {
    if (std::find(known.begin(), known.end(), word) == known.end()) {
      return bad_value(std::string(word), "name some of " + listed(known, ", "));
    }
    values.emplace_back(word);
  }
  return {};
}

void restore_word(const WordOption& word, const Json& stated, BakeRequest& request) {
  if (word.none == nullptr) {
    const auto index = stated.count();
    if (index && *index < word.words.size()) word.set(request, static_cast<int>(*index));
    return;
  }
  const std::string text = stated.text().value_or("");
  if (text == word.none) return word.set(request, -1);
  const auto found = std::find(word.words.begin(), word.words.end(), text);
  if (found != word.words.end()) word.set(request, static_cast<int>(found - word.words.begin()));
}

void restore_words(const WordsOption& words, const Json& stated, BakeRequest& request) {
  if (!stated.is_array()) return;
  const std::vector<std::string> known = words.choices();
  words.at(request).clear();
  for (const Json& one : stated.elements()) {
    const std::string word = one.text().value_or("");
    if (std::find(known.begin(), known.end(), word) == known.end()) continue;
    words.at(request).push_back(word);
  }
}

}  // namespace

std::string source_picture(const BakeRequest& request, const std::string& file) {
  const auto found =
      std::find_if(request.patterns.begin(), request.patterns.end(),
                   [&](const PatternRequest& pattern) { return file_name(pattern.path) == file; });
  return file.empty() || found == request.patterns.end() ? "" : found->path;
}

std::span<const BakeOption> bake_options() {
  return kOptions;
}

std::vector<std::string> option_choices(const BakeOption& option) {
  using Names = std::vector<std::string>;
  return std::visit(
      Each{
          [](const TruthOption&) { return Names(); }, [](const NumberOption&) { return Names(); },
          [](const WordOption& word) {
            return word.truth ? Names() : Names(word.words.begin(), word.words.end());
          },
          [](const TextOption& text) { return text.choices == nullptr ? Names() : text.choices(); },
          [](const WordsOption& words) { return words.choices(); }},
      option.value);
}

Json option_default(const BakeOption& option) {
  BakeRequest plain;
  if (const auto* truth = std::get_if<TruthOption>(&option.value)) return truth->at(plain);
  if (const auto* number = std::get_if<NumberOption>(&option.value)) return number->at(plain);
  const auto* word = std::get_if<WordOption>(&option.value);
  const int chosen = word == nullptr ? -1 : word->get(plain);
  return chosen < 0 ? Json() : Json(word->words[static_cast<std::size_t>(chosen)]);
}

std::string option_help(const BakeOption& option) {
  std::string rules = listed(option_choices(option), " or ");
  if (const auto* number = std::get_if<NumberOption>(&option.value)) {
    rules = with_numbers("{} to {}; default {}",
                         {number->least, number->most, option_default(option).count().value_or(0)});
  }
  if (std::holds_alternative<WordOption>(option.value)) {
    const auto usual = option_default(option).text();
    if (usual) rules += "; default " + *usual;
  }
  return option.help + (rules.empty() ? "" : " (" + rules + ")");
}

std::string option_summary(const BakeOption& option) {
  const std::string help = option.help;
  return help.substr(0, std::min({help.find(" ("), help.find(": "), help.find("; ")}));
}

Result<void> parse_option(const BakeOption& option, const std::string& text, BakeRequest& request) {
  return std::visit(
      Each{[&](const TruthOption& truth) -> Result<void> {
             if (text != "true" && text != "false") return bad_value(text, "write true or false");
             truth.at(request) = text == "true";
             return {};
           },
           [&](const NumberOption& number) { return take_number(number, text, request); },
           [&](const WordOption& word) { return parse_word(word, option, text, request); },
           [&](const TextOption& value) { return value.take(text, request); },
           [&](const WordsOption& words) { return parse_words(words, text, request); }},
      option.value);
}

std::vector<std::string> stored_parameters(const BakeRequest& request) {
  std::vector<std::string> asked = request.parameters;
  if (asked.empty()) asked = {request.device.empty() ? kDefaultParameterSet : "none"};
  std::vector<std::string> stored;
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    const auto named = [&](const std::string& word) {
      return word == "all" || word == parameter_set_name(set.id);
    };
    if (ranges::any_of(asked, named)) stored.emplace_back(parameter_set_name(set.id));
  }
  return stored;
}

void plan_request(BakeRequest& request) {
  if (!request.device.empty()) static_cast<void>(plan_for_device(request.device, request));
  if (!request.tier.empty()) static_cast<void>(plan_for_tier(request.tier, request));
}

Json state_options(const BakeRequest& request) {
  BakeRequest own = request;  // fields are reached as variables
  Json options = Json::object();
  for (const BakeOption& option : kOptions) {
    std::visit(
        Each{
            [&](const TruthOption& truth) {
              if (truth.at(own) || !truth.quiet) options.set(option.name, truth.at(own));
            },
            [&](const NumberOption& number) { options.set(option.name, number.at(own)); },
            [&](const WordOption& word) {
              const int chosen = word.get(own);
              options.set(option.name, word.none == nullptr ? Json(chosen)
                                       : chosen < 0
                                           ? Json(word.none)
                                           : Json(word.words[static_cast<std::size_t>(chosen)]));
            },
            [&](const TextOption& text) { text.state(own, option.name, options); },
            [&](const WordsOption& words) { options.set(option.name, Json::list(words.at(own))); }},
        option.value);
  }
  return options;
}

void restore_options(const Json& options, BakeRequest& request) {
  for (const BakeOption& option : kOptions) {
    const Json stated = options[option.name];
    std::visit(Each{[&](const TruthOption& truth) {
                      truth.at(request) = stated.truth().value_or(truth.at(request));
                    },
                    [&](const NumberOption& number) {
                      const auto count = stated.count();
                      if (!count || *count < number.least || *count > number.most) return;
                      number.at(request) = static_cast<std::uint32_t>(*count);
                    },
                    [&](const WordOption& word) { restore_word(word, stated, request); },
                    [&](const TextOption& text) { text.restore(options, option.name, request); },
                    [&](const WordsOption& words) { restore_words(words, stated, request); }},
               option.value);
  }
}

}  // namespace modar
