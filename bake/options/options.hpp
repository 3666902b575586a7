// Every option of the bake that changes a bundle, each one entry of one table. The command line,
// the reader of modar.toml and its schema, what `modar init` suggests, and the bundle's meta text
// are made from it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "bake/json.hpp"
#include "bake/options/request.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// What an option changes: [bake] and [[tier]] of modar.toml set those of models, patterns and
/// scenes, [[model]] and [[pattern]] their own, [project] those of projects.
enum class OptionPart : std::uint8_t { kModel, kPattern, kScene, kProject };

/// The heading of an option in `modar bake --help`.
enum class OptionGroup : std::uint8_t { kTarget, kGeometry, kTextures, kPatterns };

/// True or false.
struct TruthOption {
  bool& (*at)(BakeRequest&);
  bool quiet = false;  ///< the meta text states it only where it is on
};

/// A whole number within limits.
struct NumberOption {
  std::uint32_t& (*at)(BakeRequest&);
  std::uint32_t least;
  std::uint32_t most;
};

/// One of a few words, by index.
struct WordOption {
  std::span<const char* const> words;
  int (*get)(const BakeRequest&);  ///< -1: none is chosen
  void (*set)(BakeRequest&, int);  ///< the same
  /// How the meta text states that none is chosen; null: it states the index of the one that is.
  const char* none;
  bool truth;  ///< two words, which the user writes as false and true
};

/// A text with a meaning of its own.
struct TextOption {
  std::vector<std::string> (*choices)();  ///< null: any text
  /// Errors: kUsage, as the reader of the text says.
  Result<void> (*take)(const std::string& text, BakeRequest&);
  void (*state)(const BakeRequest&, const char* name, Json& options);
  // / options: the "options" of anyone's meta text. Errors there change nothing.
  void (*restore)(const Json& options, const char* name, BakeRequest&);
};

/// Several words.
struct WordsOption {
  std::vector<std::string> (*choices)();
  std::vector<std::string>& (*at)(BakeRequest&);
};

using OptionValue = std::variant<TruthOption, NumberOption, WordOption, TextOption, WordsOption>;

struct BakeOption {
  /// "--effort"; flags: "--perceptual" (true), "--no-score" (false), "--atlas,--no-atlas". Of a
  /// number, "--no-lods" means its least.
  const char* flag;
  const char* name;  ///< in modar.toml and in "options" of the bundle's meta text
  OptionPart part;
  OptionGroup group;
  const char* type;     ///< name of the value in --help; null: as its kind says
  const char* example;  ///< a value as parse_option() reads it
  const char* help;     ///< what it sets, as an order: "Store ..."
  OptionValue value;
};

/// All of them, in the order in which the meta text states them.
std::span<const BakeOption> bake_options();

/// The values that an option takes; empty: any. In the order of the table.
std::vector<std::string> option_choices(const BakeOption& option);

/// The value of a request that sets nothing, as modar.toml has it; null: none exists.
Json option_default(const BakeOption& option);

/// The help of an option with its values, limits and default: "Effort ... (fast, good or best;
/// default good)".
std::string option_help(const BakeOption& option);

/// Its first words, for a comment: "Effort of the ETC1 encoder".
std::string option_summary(const BakeOption& option);

/// Takes a value as text; truths are "true" and "false", lists have commas between their parts.
/// Errors: kInvalidInput "project.value", kUsage of the readers of texts.
Result<void> parse_option(const BakeOption& option, const std::string& text, BakeRequest& request);

/// The ModAR paper's parameter sets that a bake of the request stores, in the paper's order.
/// Without `parameters`: kDefaultParameterSet, or for a device none.
std::vector<std::string> stored_parameters(const BakeRequest& request);

/// Lowers sizes once more to what the device and the tier of the request allow: after all options.
void plan_request(BakeRequest& request);

/// "options" of the meta text.
Json state_options(const BakeRequest& request);

/// Sets what "options" of anyone's meta text states; what it does not state, or states wrongly,
/// stays.
void restore_options(const Json& options, BakeRequest& request);

}  // namespace modar
