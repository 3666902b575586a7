// By getopt_long: programs of the device link no library for it.
#include "command_line.hpp"

#include <getopt.h>

#include <charconv>

#include "formats/base/nearest.hpp"

namespace modar {
namespace {

/// getopt's numbers for our options begin above any letter.
constexpr int kFirst = 256;

tl::unexpected<Error> usage(const CommandSyntax& syntax, const char* kind, std::string where,
                            std::string cause) {
  return fail(ExitCode::kUsage, std::string(syntax.code) + kind, std::move(where), std::move(cause),
              syntax.cure);
}

/// What getopt refused: optopt is the letter of a short option, else our number or 0; optind points
/// behind a long one.
tl::unexpected<Error> refused(const CommandSyntax& syntax, int answer,
                              const std::vector<char*>& argv) {
  const bool letter = optopt > 0 && optopt < kFirst;
  const std::string current = letter ? std::string("-") + static_cast<char>(optopt)
                                     : argv[static_cast<std::size_t>(optind - 1)];
  if (answer == ':') return usage(syntax, ".value", current, "the option needs a value");
  if (optopt >= kFirst) return usage(syntax, ".value", current, "the option takes no value");
  std::vector<std::string> names;
  for (const CommandOption& each : syntax.options) names.push_back(std::string("--") + each.name);
  const std::string_view meant = nearest_name(current.substr(0, current.find('=')), names);
  return usage(syntax, ".option", "",
               "'" + current + "' is not an option" +
                   (meant.empty() ? "" : "; did you mean " + std::string(meant) + "?"));
}

}  // namespace

Result<std::vector<std::string>> parse_command_line(std::span<const char* const> arguments,
                                                    const CommandSyntax& syntax,
                                                    const TakeOption& take) {
  // getopt_long permutes the array that it is given, not the texts: a copy of the pointers will do.
  std::string program;
  std::vector<char*> argv = {program.data()};
  for (const char* argument : arguments) argv.push_back(const_cast<char*>(argument));
  argv.push_back(nullptr);
  const int argc = static_cast<int>(argv.size()) - 1;
  std::vector<option> table;
  for (const CommandOption& each : syntax.options) {
    table.push_back({each.name, each.expected == nullptr ? no_argument : required_argument, nullptr,
                     kFirst + static_cast<int>(table.size())});
  }
  table.push_back({nullptr, 0, nullptr, 0});
  opterr = 0;
  optind = 0;  // starts a new scan (GNU)
  for (;;) {
    const int number = getopt_long(argc, argv.data(), ":", table.data(), nullptr);
    if (number == -1) break;
    if (number == '?' || number == ':') return refused(syntax, number, argv);
    const auto index = static_cast<std::size_t>(number - kFirst);
    const CommandOption& each = syntax.options[index];
    if (!take(index, each.expected == nullptr ? "" : optarg)) {
      return usage(syntax, ".value", std::string("--") + each.name,
                   "'" + std::string(optarg) + "' is not " + each.expected);
    }
  }
  return std::vector<std::string>(argv.begin() + optind, argv.begin() + argc);
}

std::uint64_t parse_count(std::string_view text, std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && last == text.data() + text.size() && value <= most ? value : 0;
}

}  // namespace modar
