// The table of options on the command line.
#pragma once

#include <map>
#include <string>

#include "bake/commands/command_line.hpp"
#include "bake/options/options.hpp"

namespace modar {

/// Options whose value is a text, as the command line has it.
using OptionTexts = std::map<const BakeOption*, std::string>;

/// Declares the options of one heading. Values other than texts go to the request at once.
void add_bake_options(CommandLine& line, OptionGroup group, BakeRequest& request,
                      OptionTexts& texts);

/// Takes the texts, after the command line was read. Errors: those of parse_option().
Result<void> take_texts(const OptionTexts& texts, BakeRequest& request);

}  // namespace modar
