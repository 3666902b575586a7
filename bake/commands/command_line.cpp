#include "bake/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <type_traits>

#include "bake/terminal.hpp"

namespace modar {

struct CommandLine::Parts {
  std::unique_ptr<CLI::App> own;  ///< of the program; its subcommands' belong to CLI11
  CLI::App* app = nullptr;
  std::function<Result<ExitCode>()> work;
  std::vector<std::unique_ptr<CommandLine>> commands;
};

namespace {

void apply(const OptionRules& rules, CLI::App& app, CLI::Option& option) {
  if (!rules.choices.empty()) option.check(CLI::IsMember(rules.choices).description(""));
  if (rules.positive) option.check(CLI::PositiveNumber);
  if (rules.separator != 0) option.delimiter(rules.separator);
  if (rules.repeatable) option.allow_extra_args(false);
  if (!rules.type.empty()) option.type_name(rules.type);
  if (rules.required) option.required();
  if (rules.shows_default) option.capture_default_str();
  if (!rules.needs.empty()) option.needs(app.get_option(rules.needs));
  if (!rules.excludes.empty()) option.excludes(app.get_option(rules.excludes));
}

template <class T>
void limit(const OptionRules& rules, CLI::Option& option) {
  if constexpr (std::is_arithmetic_v<T>) {
    if (std::isinf(rules.least)) return;
    option.check(CLI::Range(static_cast<T>(rules.least), static_cast<T>(rules.most)));
  }
}

}  // namespace

CommandLine::CommandLine(const std::string& about, const std::string& version)
    : parts_(std::make_unique<Parts>()) {
  parts_->own = std::make_unique<CLI::App>(about, "modar");
  parts_->app = parts_->own.get();
  parts_->app->set_version_flag("--version", version);
}

CommandLine::CommandLine(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

CommandLine::~CommandLine() = default;

CommandLine& CommandLine::command(const std::string& name, const std::string& about) {
  auto parts = std::make_unique<Parts>();
  parts_->app->require_subcommand(1);
  parts->app = parts_->app->add_subcommand(name, about);
  parts_->commands.emplace_back(new CommandLine(std::move(parts)));
  return *parts_->commands.back();
}

void CommandLine::option(const std::string& names, Value value, const std::string& help,
                         const OptionRules& rules) {
  std::visit(
      [&](auto* target) {
        CLI::Option* option = parts_->app->add_option(names, *target, help);
        limit<std::remove_pointer_t<decltype(target)>>(rules, *option);
        apply(rules, *parts_->app, *option);
      },
      value);
}

void CommandLine::size(const std::string& names, std::uint64_t& bytes, const std::string& help,
                       const OptionRules& rules) {
  CLI::Option* option = parts_->app->add_option(names, bytes, help);
  option->transform(CLI::AsSizeValue(true));
  apply(rules, *parts_->app, *option);
}

void CommandLine::flag(const std::string& names, bool& value, const std::string& help,
                       const OptionRules& rules) {
  apply(rules, *parts_->app, *parts_->app->add_flag(names, value, help));
}

void CommandLine::flag(const std::string& names, std::function<void()> seen,
                       const std::string& help, const OptionRules& rules) {
  apply(rules, *parts_->app, *parts_->app->add_flag_callback(names, std::move(seen), help));
}

void CommandLine::flag(const std::string& names, int& value, int plain, const std::string& help) {
  parts_->app->add_flag(names + "{" + std::to_string(plain) + "}", value, help);
}

void CommandLine::choose(const std::string& names, std::function<void(int)> take,
                         const std::map<std::string, int>& words, const std::string& help,
                         const OptionRules& rules) {
  CLI::Option* option = parts_->app->add_option_function<int>(names, std::move(take), help);
  option->transform(CLI::CheckedTransformer(words).description(""));
  apply(rules, *parts_->app, *option);
}

void CommandLine::footer(const std::string& text) {
  parts_->app->footer(text);
}

void CommandLine::run(std::function<Result<ExitCode>()> work) {
  parts_->work = std::move(work);
}

int CommandLine::parse_and_run(int argc, char** argv) {
  try {
    parts_->app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
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
