// What the commands of `modar ship` share: keys and folders on the command line.
#pragma once

#include <string>

#include "bake/commands/command_line.hpp"
#include "bake/ship/keys/keys.hpp"
#include "modar/release.hpp"

namespace modar {

/// Files of a secret key and its pass phrase.
struct KeyFiles {
  std::string key;
  std::string pass_phrase;  ///< empty: asked for on the terminal
};
Result<SecretKey> load_key(const KeyFiles& files);
/// The root keys that devices were given. Errors: as parse_root_set().
Result<RootSet> read_trust(const std::string& path);

std::string ship_example(const std::string& text);
void add_folder(CommandLine& line, std::string& folder);
void add_key_options(CommandLine& line, KeyFiles& files);

void add_keygen(CommandLine& ship);
void add_root(CommandLine& ship);
void add_trust(CommandLine& ship);
void add_sign(CommandLine& ship);
void add_accept(CommandLine& ship);
void add_rotate(CommandLine& ship);

}  // namespace modar
