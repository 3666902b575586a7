// Parses the command lines of modar-play and modar-fetch. They cannot use CLI11 as `modar` does: it
// throws and needs iostream and locale, which code of the device must not (scripts/check_laws.py).
// Internal to runtime.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

struct CommandOption {
  const char* name;                ///< without the "--"
  const char* expected = nullptr;  ///< what its value has to be, for messages; nullptr: a switch
};

struct CommandSyntax {
  const char* code;  ///< errors are "<code>.option" and "<code>.value"
  const char* cure;  ///< of every error: "see modar-play --help"
  std::span<const CommandOption> options;
};

/// Receives option number `index` with its value ("" for a switch); false: the value is invalid.
using TakeOption = std::function<bool(std::size_t index, std::string_view value)>;

/// Returns the arguments that are no options, in their order. Options may come before, between and
/// after them, as --name VALUE or --name=VALUE, or by an unambiguous prefix; "--" ends them.
/// arguments: without the program's name. Errors: kUsage.
Result<std::vector<std::string>> parse_command_line(std::span<const char* const> arguments,
                                                    const CommandSyntax& syntax,
                                                    const TakeOption& take);

/// The whole text as a decimal number from 1 to `most`; 0 if it is not.
std::uint64_t parse_count(std::string_view text, std::uint64_t most);

}  // namespace modar
