// The command line of `modar`, as its commands declare it: names, help and the variables that take
// the values. CLI11 is known to command_line.cpp alone, for a file that includes it takes 8 s to
// compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// What an option accepts, beyond its type, and how --help shows it.
struct OptionRules {
  std::string type = {};  ///< name of the value in --help: "FILE"
  bool required = false;
  bool shows_default = false;  ///< print what the variable holds when it is declared
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool positive = false;                  ///< above 0
  std::vector<std::string> choices = {};  ///< the values there are; empty: any
  char separator = 0;                     ///< between several values in one word; 0: none
  bool repeatable = false;                ///< of a list: one value each time, not all that follow
  std::string needs = {};                 ///< another option, declared before
  std::string excludes = {};              ///< the same
};

/// An option as --help shows it.
struct OptionText {
  std::vector<std::string> names;  ///< "-o", "--output"; of a positional argument its name
  std::string value;               ///< "FILE", "FILE ..."; empty: it takes none
  std::string help;
  bool required = false;
  std::vector<std::string> choices;  ///< empty: any value
  std::string group;                 ///< the heading that it stands under
};

/// A command as --help shows it.
struct CommandText {
  std::string name;  ///< with those before it: "modar pattern score"
  std::string about;
  std::string footer;
  std::vector<OptionText> options;
  std::vector<CommandText> commands;
};

/// Which help shows the declared options: --help and --help-all, or --help-all alone.
enum class Shown { kAlways, kInFull };

/// A command with its options and subcommands. Variables must live until parse_and_run() returns.
class CommandLine {
 public:
  using Value = std::variant<std::string*, std::vector<std::string>*, double*, int*, unsigned*,
                             std::uint64_t*>;

  /// The program itself. version: what --version prints, its name and number ("modar 1.0.0").
  CommandLine(const std::string& about, const std::string& version);
  ~CommandLine();

  /// A subcommand, which stays this object's. A command that has some runs none itself.
  CommandLine& command(const std::string& name, const std::string& about);
  /// Adds the subcommand `help [COMMAND ...] [all]`.
  void add_help();

  /// The heading of the options or subcommands that are declared from now on.
  void group(const std::string& heading, Shown shown = Shown::kAlways);

  /// names: "-o,--output"; without dashes a positional argument.
  void option(const std::string& names, Value value, const std::string& help,
              const OptionRules& rules = {});
  /// A number of bytes: 800M, 1G (powers of 1024).
  void size(const std::string& names, std::uint64_t& bytes, const std::string& help,
            const OptionRules& rules = {});
  /// Without a value. names "!--no-x" sets the variable to false.
  void flag(const std::string& names, bool& value, const std::string& help,
            const OptionRules& rules = {});
  /// Runs `seen` where the flag stands.
  void flag(const std::string& names, std::function<void()> seen, const std::string& help,
            const OptionRules& rules = {});
  /// The same, but --name=N sets another number than `plain`.
  void flag(const std::string& names, int& value, int plain, const std::string& help);
  /// One of several words; takes its number.
  void choose(const std::string& names, std::function<void(int)> take,
              const std::map<std::string, int>& words, const std::string& help,
              const OptionRules& rules = {});

  /// Printed below the options.
  void footer(const std::string& text);
  /// What the command does. Its answer is the program's exit code; an error is printed to stderr.
  void run(std::function<Result<ExitCode>()> work);

  /// The command and all below it, for manual pages and completion.
  [[nodiscard]] CommandText describe() const;

  /// What followed the program's name.
  [[nodiscard]] const std::vector<std::string>& words() const { return words_; }

  /// --help, --help-all and --version go to stdout with 0, a wrong command line to stderr with
  /// ExitCode::kUsage; else what the chosen command answers.
  int parse_and_run(int argc, char** argv);

 private:
  struct Parts;
  explicit CommandLine(std::unique_ptr<Parts> parts);
  /// What the parser threw, with cause and cure.
  [[nodiscard]] Error explained(const std::exception& error) const;
  /// The help of the command that `words` name, in full where the last one is "all".
  [[nodiscard]] Result<std::string> help(std::vector<std::string> words) const;

  std::unique_ptr<Parts> parts_;
  std::vector<std::string> words_;
};

/// The foot of a command's --help: `text`, an example, and the exit codes, to which `codes` adds a
/// command's own (", 15 ...").
std::string example(const std::string& text, const std::string& codes = "");

}  // namespace modar
