#include "bake/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <set>
#include <type_traits>

#include "bake/io/terminal.hpp"
#include "formats/base/nearest.hpp"
#include "formats/base/ranges.hpp"

namespace modar {

struct CommandLine::Parts {
  std::unique_ptr<CLI::App> own;  ///< of the program; its subcommands' belong to CLI11
  CLI::App* app = nullptr;
  std::function<Result<ExitCode>()> work;
  std::vector<std::unique_ptr<CommandLine>> commands;
  std::map<const CLI::Option*, std::vector<std::string>> choices;
  std::map<const CLI::Option*, OptionRules> rules;
  std::string heading;
  Shown shown = Shown::kAlways;
  /// Options and subcommands that --help-all alone shows; one set for the whole program.
  std::shared_ptr<std::set<const void*>> in_full;

  /// Puts an option or a subcommand under the present heading.
  template <class Declared>
  void place(Declared& declared) const {
    if (!heading.empty()) declared.group(heading);
    if (shown == Shown::kInFull) in_full->insert(&declared);
  }
};

namespace {

/// "800M" to "800000000". CLI11 alone takes "-1" and numbers beyond 64 bits for very great ones.
std::string size_in_bytes(std::string& text) {
  const std::size_t digits = text.find_first_not_of("0123456789");
  constexpr std::size_t kMostDigits = 18;
  if (digits == 0 || std::min(digits, text.size()) > kMostDigits) return "no size";
  return CLI::AsSizeValue(true)(text);
}

/// What --help says of an option beyond its own text: "1 to 12, default 4, not with --no-lods".
std::string rules_in_words(const OptionRules& rules, const CLI::Option& option) {
  std::string words;
  const auto add = [&words](const std::string& more) {
    words += (words.empty() ? "" : ", ") + more;
  };
  char text[64];
  if (rules.positive) add("above 0");
  if (!std::isinf(rules.least)) {
    std::snprintf(text, sizeof text, "%.8g to %.8g", rules.least, rules.most);
    add(text);
  }
  if (rules.shows_default && !option.get_default_str().empty()) {
    add("default " + option.get_default_str());
  }
  if (!rules.needs.empty()) add("needs " + rules.needs);
  if (!rules.excludes.empty()) add("not with " + rules.excludes);
  return words.empty() ? "" : " (" + words + ")";
}

void apply(const OptionRules& rules, CLI::App& app, CLI::Option& option) {
  if (!rules.choices.empty()) option.check(CLI::IsMember(rules.choices).description(""));
  if (rules.positive) option.check(CLI::Validator(CLI::PositiveNumber).description(""));
  if (rules.separator != 0) option.delimiter(rules.separator);
  if (rules.repeatable) option.allow_extra_args(false);
  if (!rules.type.empty()) option.type_name(rules.type);
  if (rules.required) option.required();
  if (rules.shows_default) option.capture_default_str();
  option.description(option.get_description() + rules_in_words(rules, option));
  if (!rules.needs.empty()) option.needs(app.get_option(rules.needs));
  if (!rules.excludes.empty()) option.excludes(app.get_option(rules.excludes));
}

template <class T>
void limit(const OptionRules& rules, CLI::Option& option) {
  if constexpr (std::is_arithmetic_v<T>) {
    option.type_name(std::is_floating_point_v<T> ? "NUMBER" : "N");
    if (std::isinf(rules.least)) return;
    option.check(CLI::Validator(
        CLI::Range(static_cast<T>(rules.least), static_cast<T>(rules.most)).description("")));
  }
}

/// Text with line breaks between words, so that no line is longer than `width`, but for longer
/// words.
std::string wrapped(const std::string& text, std::size_t width) {
  std::string out;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (column > 0 && column + 1 + end - begin > width) {
      out += '\n';
      column = 0;
    } else if (begin > 0) {
      out += ' ';
      ++column;
    }
    out.append(text, begin, end - begin);
    column += end - begin;
    begin = end + 1;
  }
  return out;
}

/// Options without their validators' notes, which apply() has put into words, in lines of 80
/// columns. Leaves out what --help-all alone shows, unless requested.
class HelpFormatter : public CLI::Formatter {
 public:
  explicit HelpFormatter(std::shared_ptr<std::set<const void*>> in_full)
      : in_full_(std::move(in_full)) {
    label("Positionals", "Arguments");
    label("SUBCOMMAND", "COMMAND");
  }

  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    return make_description(app) + make_usage(app, std::move(name)) + make_positionals(app) +
           options_text(app, mode) + make_subcommands(app, mode) + '\n' + make_footer(app);
  }
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override {
    std::string text;
    std::string heading;
    for (const CLI::App* command : app->get_subcommands({})) {
      if (!shown(command, mode)) continue;
      if (command->get_group() != heading) text += "\n" + command->get_group() + ":\n";
      heading = command->get_group();
      text += make_subcommand(command);
    }
    return text;
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    return wrapped(CLI::Formatter::make_option_desc(option), kColumns - column_width_);
  }
  std::string make_option_name(const CLI::Option* option, bool positional) const override {
    const std::string name = CLI::Formatter::make_option_name(option, positional);
    return name.substr(0, name.find('{'));
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_type_size() == 0) return "";
    std::string words = " " + option->get_type_name();
    if (option->get_expected_max() == CLI::detail::expected_max_vector_size) words += " ...";
    return words + (option->get_required() ? " REQUIRED" : "");
  }

 private:
  [[nodiscard]] bool shown(const void* declared, CLI::AppFormatMode mode) const {
    return mode == CLI::AppFormatMode::All || !in_full_->contains(declared);
  }
  /// The options under their headings, help last.
  [[nodiscard]] std::string options_text(const CLI::App* app, CLI::AppFormatMode mode) const {
    std::vector<std::pair<std::string, std::vector<const CLI::Option*>>> groups;
    std::vector<const CLI::Option*> help = {app->get_help_ptr()};
    if (has_more(*app)) help.push_back(app->get_help_all_ptr());
    for (const std::string& heading : app->get_groups()) {
      auto options = app->get_options([&](const CLI::Option* option) {
        return option->get_group() == heading && option->nonpositional() && shown(option, mode) &&
               option != app->get_help_ptr() && option != app->get_help_all_ptr();
      });
      if (!options.empty()) groups.emplace_back(heading, std::move(options));
    }
    if (groups.size() != 1) groups.emplace_back(groups.empty() ? "Options" : "Help", help);
    auto& last = groups.back().second;
    if (last != help) last.insert(last.end(), help.begin(), help.end());
    std::string text;
    for (const auto& [heading, options] : groups) text += make_group(heading, false, options);
    return text;
  }

  /// Whether --help leaves out options or subcommands of `app`.
  [[nodiscard]] bool has_more(const CLI::App& app) const {
    const auto hidden = [this](const void* declared) { return in_full_->contains(declared); };
    const auto options = app.get_options();
    const auto commands = app.get_subcommands({});
    return std::any_of(options.begin(), options.end(), hidden) ||
           std::any_of(commands.begin(), commands.end(), hidden);
  }

  static constexpr std::size_t kColumns = 80;
  std::shared_ptr<std::set<const void*>> in_full_;
};

/// "modar ship publish".
std::string full_name(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  return (parent != nullptr ? full_name(*parent) + " " : "") + app.get_name();
}

/// The first word of the command line that nothing takes, and the name that it is nearest to.
/// Keys of --scene that people write as options of `modar bake`.
constexpr std::string_view kSceneKeys[] = {"--height", "--width",  "--scale", "--up",
                                           "--turn",   "--offset", "--clip"};

std::optional<Error> unknown_word(const CLI::App* app) {
  while (!app->get_subcommands().empty()) app = app->get_subcommands().front();
  const std::vector<std::string> left = app->remaining();
  if (left.empty()) return std::nullopt;
  const std::string word = left.front().substr(0, left.front().find('='));
  const bool is_option = word.starts_with('-');
  std::vector<std::string> names;
  if (is_option) {
    if (full_name(*app) == "modar bake") names.assign(std::begin(kSceneKeys), std::end(kSceneKeys));
    for (const CLI::Option* option : app->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  } else {
    for (const CLI::App* command : app->get_subcommands(nullptr)) {
      names.push_back(command->get_name());
    }
    if (names.empty()) return std::nullopt;
  }
  const std::string_view meant = nearest_name(word, names);
  const bool of_scene = ranges::find(kSceneKeys, meant) != std::end(kSceneKeys);
  const std::string cure = meant.empty() ? "see `" + full_name(*app) + " --help`"
                           : of_scene    ? "write it in --scene, as in --scene PATTERN=MODEL," +
                                            std::string(meant.substr(2)) + "=..."
                                      : "did you mean " + std::string(meant) + "?";
  return Error{ExitCode::kUsage, "cli.unknown", word,
               is_option ? "there is no such option" : "there is no such command", cure};
}

/// The option that CLI11's message is about: the longest name in it.
const CLI::Option* option_in(const CLI::App& app, const std::string& message) {
  const CLI::Option* found = nullptr;
  std::size_t longest = 0;
  for (const CLI::Option* option : app.get_options()) {
    std::vector<std::string> names = option->get_lnames();
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    if (option->get_positional()) names.push_back(option->get_name(true));
    for (const std::string& name : names) {
      if (name.size() <= longest || message.find(name) == std::string::npos) continue;
      found = option;
      longest = name.size();
    }
  }
  return found;
}

std::string shown_name(const CLI::Option& option) {
  if (!option.get_lnames().empty()) return "--" + option.get_lnames().front();
  return option.get_positional() ? option.get_name(true) : "-" + option.get_snames().front();
}

std::optional<double> number_in(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' ? std::optional(value) : std::nullopt;
}

/// What a value should have been, and an example.
std::string number_cure(const OptionRules& rules, const std::string& name) {
  char text[96];
  if (rules.positive || (rules.least == 0 && rules.most > 1e300)) {
    return std::string("write a number ") + (rules.positive ? "above 0" : "from 0 on");
  }
  if (std::isinf(rules.least)) return "write a number, as in " + name + " 4";
  std::snprintf(text, sizeof text, "write a number from %.8g to %.8g", rules.least, rules.most);
  return text;
}

/// An error of CLI11 in the words that all others have.
Error usage_error(const CLI::ParseError& thrown, const CLI::Option* option,
                  const std::vector<std::string>& choices, const OptionRules& rules,
                  const std::string& help) {
  Error error{ExitCode::kUsage, "cli.usage", "", thrown.what(), "see `" + help + " --help`"};
  if (option == nullptr) return error;
  const std::string name = shown_name(*option);
  error.where = name;
  const std::string value = option->results().empty() ? "" : option->results().back();
  const std::string quoted = "'" + value + "'";
  if (dynamic_cast<const CLI::RequiredError*>(&thrown) != nullptr) {
    error.cause = "it is missing";
  } else if (dynamic_cast<const CLI::ExcludesError*>(&thrown) != nullptr) {
    error.cause = "it contradicts another option: " + std::string(thrown.what());
    error.cure = "leave one of them out";
  } else if (dynamic_cast<const CLI::RequiresError*>(&thrown) != nullptr) {
    error.cause = "it needs " + (rules.needs.empty() ? std::string("another option") : rules.needs);
    error.cure = "add it";
  } else if (option->get_expected_max() == 1 && option->results().size() > 1) {
    error.cause = "it is given " + std::to_string(option->results().size()) + " times";
    error.cure = "give it once";
  } else if (value.empty()) {
    error.cause = "its value is missing";
    error.cure = "write " + name + " " + option->get_type_name();
  } else if (!choices.empty()) {
    const std::string_view meant = nearest_name(value, choices);
    std::string list;
    for (const std::string& choice : choices) list += (list.empty() ? "" : ", ") + choice;
    error.cause = quoted + " is not one of its values";
    error.cure = meant.empty() ? "name one of " + list : "did you mean " + std::string(meant) + "?";
  } else {
    const bool size = option->get_type_name() == "SIZE";
    error.cause = size               ? "it is no size"
                  : number_in(value) ? quoted + " is out of range"
                                     : quoted + " is not a number";
    error.cure =
        size ? "write bytes, or a number with k, M or G, as in 800M" : number_cure(rules, name);
  }
  return error;
}

}  // namespace

std::string example(const std::string& text, const std::string& codes) {
  return "\nExample:\n" + text +
         "\nExit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 invalid input,\n"
         "4 internal error, 5 not supported" +
         codes + ".\n";
}

CommandLine::CommandLine(const std::string& about, const std::string& version)
    : parts_(std::make_unique<Parts>()) {
  parts_->own = std::make_unique<CLI::App>(about, version.substr(0, version.find(' ')));
  parts_->app = parts_->own.get();
  parts_->in_full = std::make_shared<std::set<const void*>>();
  parts_->app->set_version_flag("--version", version);
  parts_->app->set_help_flag("-h,--help", "Print this help and exit");
  parts_->app->set_help_all_flag("--help-all", "Print this help in full and exit");
  parts_->app->formatter(std::make_shared<HelpFormatter>(parts_->in_full));
}

CommandLine::CommandLine(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

CommandLine::~CommandLine() = default;

CommandLine& CommandLine::command(const std::string& name, const std::string& about) {
  auto parts = std::make_unique<Parts>();
  parts_->app->require_subcommand(1);
  parts->app = parts_->app->add_subcommand(name, about);
  parts->in_full = parts_->in_full;
  parts_->place(*parts->app);
  parts_->commands.emplace_back(new CommandLine(std::move(parts)));
  return *parts_->commands.back();
}

void CommandLine::group(const std::string& heading, Shown shown) {
  parts_->heading = heading;
  parts_->shown = shown;
}

void CommandLine::add_help() {
  CommandLine& line = command("help", "Show the help of a command; `help all` lists all commands");
  const auto words = std::make_shared<std::vector<std::string>>();
  line.option("command", words.get(), "Its name; `all` after it shows every option",
              {.type = "COMMAND|all"});
  line.run([this, words]() -> Result<ExitCode> {
    MODAR_ASSIGN(const std::string text, help(*words));
    std::fputs(text.c_str(), stdout);
    return ExitCode::kOk;
  });
}

Result<std::string> CommandLine::help(std::vector<std::string> words) const {
  const bool all = !words.empty() && words.back() == "all";
  if (all) words.pop_back();
  const CommandLine* chosen = this;
  std::string name = parts_->app->get_name();
  for (const std::string& word : words) {
    std::vector<std::string> known;
    const CommandLine* next = nullptr;
    for (const auto& command : chosen->parts_->commands) {
      known.push_back(command->parts_->app->get_name());
      if (known.back() == word) next = command.get();
    }
    if (next == nullptr) {
      const std::string_view meant = nearest_name(word, known);
      return fail(ExitCode::kUsage, "cli.unknown", word, "there is no such command",
                  meant.empty() ? "see `" + parts_->app->get_name() + " help all`"
                                : "did you mean " + std::string(meant) + "?");
    }
    chosen = next;
    name += " " + word;
  }
  const CLI::App& app = *chosen->parts_->app;
  return app.get_formatter()->make_help(&app, name,
                                        all ? CLI::AppFormatMode::All : CLI::AppFormatMode::Normal);
}

void CommandLine::option(const std::string& names, Value value, const std::string& help,
                         const OptionRules& rules) {
  std::visit(
      [&](auto* target) {
        CLI::Option* option = parts_->app->add_option(names, *target, help);
        limit<std::remove_pointer_t<decltype(target)>>(rules, *option);
        apply(rules, *parts_->app, *option);
        parts_->place(*option);
        parts_->choices[option] = rules.choices;
        parts_->rules[option] = rules;
      },
      value);
}

void CommandLine::size(const std::string& names, std::uint64_t& bytes, const std::string& help,
                       const OptionRules& rules) {
  CLI::Option* option = parts_->app->add_option(names, bytes, help);
  option->transform(CLI::Validator(size_in_bytes, ""));
  apply(rules, *parts_->app, *option);
  parts_->place(*option);
}

void CommandLine::flag(const std::string& names, bool& value, const std::string& help,
                       const OptionRules& rules) {
  CLI::Option* option = parts_->app->add_flag(names, value, help);
  apply(rules, *parts_->app, *option);
  parts_->place(*option);
}

void CommandLine::flag(const std::string& names, std::function<void()> seen,
                       const std::string& help, const OptionRules& rules) {
  CLI::Option* option = parts_->app->add_flag_callback(names, std::move(seen), help);
  apply(rules, *parts_->app, *option);
  parts_->place(*option);
}

void CommandLine::flag(const std::string& names, int& value, int plain, const std::string& help) {
  parts_->place(*parts_->app->add_flag(names + "{" + std::to_string(plain) + "}", value, help));
}

void CommandLine::choose(const std::string& names, std::function<void(int)> take,
                         const std::map<std::string, int>& words, const std::string& help,
                         const OptionRules& rules) {
  CLI::Option* option = parts_->app->add_option_function<int>(names, std::move(take), help);
  option->transform(CLI::CheckedTransformer(words).description(""));
  apply(rules, *parts_->app, *option);
  parts_->place(*option);
  for (const auto& [word, number] : words) parts_->choices[option].push_back(word);
}

void CommandLine::footer(const std::string& text) {
  parts_->app->footer(text);
}

void CommandLine::run(std::function<Result<ExitCode>()> work) {
  parts_->work = std::move(work);
}

CommandText CommandLine::describe() const {
  const CLI::App& app = *parts_->app;
  CommandText text{full_name(app), app.get_description(), app.get_footer(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    const auto known = parts_->choices.find(option);
    OptionText one{
        {}, "", option->get_description(), option->get_required(), {}, option->get_group()};
    for (const std::string& name : option->get_snames()) one.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) one.names.push_back("--" + name);
    if (option->get_positional()) one.names = {option->get_name(true)};
    if (option->get_type_size() != 0) {
      one.value = option->get_type_name();
      if (option->get_expected_max() == CLI::detail::expected_max_vector_size) one.value += " ...";
    }
    if (known != parts_->choices.end()) one.choices = known->second;
    text.options.push_back(std::move(one));
  }
  for (const auto& command : parts_->commands) text.commands.push_back(command->describe());
  return text;
}

Error CommandLine::explained(const std::exception& error) const {
  const CommandLine* chosen = this;
  for (bool deeper = true; deeper;) {
    deeper = false;
    for (const auto& command : chosen->parts_->commands) {
      if (!command->parts_->app->parsed()) continue;
      chosen = command.get();
      deeper = true;
      break;
    }
  }
  const Parts& parts = *chosen->parts_;
  const CLI::Option* option = option_in(*parts.app, error.what());
  const auto choices = parts.choices.find(option);
  const auto rules = parts.rules.find(option);
  return usage_error(dynamic_cast<const CLI::ParseError&>(error), option,
                     choices == parts.choices.end() ? std::vector<std::string>() : choices->second,
                     rules == parts.rules.end() ? OptionRules() : rules->second,
                     full_name(*parts.app));
}

int CommandLine::parse_and_run(int argc, char** argv) {
  try {
    parts_->app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      if (const auto unknown = unknown_word(parts_->app)) return print_error(*unknown);
      return print_error(explained(error));
    }
    return parts_->app->exit(error) == 0 ? static_cast<int>(ExitCode::kOk)
                                         : static_cast<int>(ExitCode::kUsage);
  }
  words_.assign(argv + 1, argv + argc);
  const CommandLine* chosen = this;
  while (!chosen->parts_->work) {
    const CommandLine* next = nullptr;
    for (const auto& command : chosen->parts_->commands) {
      if (command->parts_->app->parsed()) next = command.get();
    }
    if (next == nullptr) return static_cast<int>(ExitCode::kUsage);
    chosen = next;
  }
  const Result<ExitCode> answer = chosen->parts_->work();
  return answer ? static_cast<int>(*answer) : print_error(answer.error());
}

}  // namespace modar
