// `modar document`: manual pages, completions of shells and types for TypeScript, from the words of
// --help.
#include <algorithm>
#include <cctype>
#include <memory>
#include <string>

#include "bake/commands/commands.hpp"
#include "bake/io/output.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

bool is_positional(const OptionText& option) {
  return !option.names.front().starts_with('-');
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

// --- Manual pages, section 1 ---

/// Text in roff: no escapes, no requests at the start of a line.
std::string roff(const std::string& text) {
  std::string out = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
  if (out.starts_with('.') || out.starts_with('\'')) out.insert(0, "\\&");
  return replaced(replaced(out, "\n.", "\n\\&."), "\n'", "\n\\&'");
}

std::string page_name(const std::string& command) {
  return replaced(command, " ", "-");
}

std::string synopsis(const CommandText& command) {
  std::string text = ".B " + roff(command.name) + "\n";
  if (!command.commands.empty()) return text + ".I COMMAND\n";
  text += "[\\fIOPTION\\fR ...]";
  for (const OptionText& option : command.options) {
    const std::string word = is_positional(option) ? "\\fI" + roff(option.value) + "\\fR"
                                                   : "\\fB" + roff(option.names.back()) +
                                                         "\\fR \\fI" + roff(option.value) + "\\fR";
    if (option.required) text += " " + word;
    if (!option.required && is_positional(option)) text += " [" + word + "]";
  }
  return text + "\n";
}

std::string manual_page(const CommandText& command, const std::string& version) {
  std::string text = ".TH " + page_name(command.name) + " 1 \"\" \"ModAR " + version +
                     "\"\n.SH NAME\n" + roff(page_name(command.name)) + " \\- " +
                     roff(command.about) + "\n.SH SYNOPSIS\n" + synopsis(command);
  if (!command.commands.empty()) text += ".SH COMMANDS\n";
  for (const CommandText& each : command.commands) {
    text += ".TP\n.BR " + roff(page_name(each.name)) + " (1)\n" + roff(each.about) + "\n";
  }
  text += ".SH OPTIONS\n";
  const OptionText* before = nullptr;
  for (const OptionText& option : command.options) {
    if (before != nullptr && option.group != before->group) {
      text += ".SS " + roff(option.group) + "\n";
    }
    before = &option;
    text += ".TP\n\\fB" + roff(joined(option.names, ", ")) + "\\fR";
    if (!option.value.empty()) text += " \\fI" + roff(option.value) + "\\fR";
    text += "\n" + roff(option.help) + (option.required ? " (required)" : "") + "\n";
  }
  if (!command.footer.empty()) {
    text += ".SH NOTES\n.nf\n" +
            roff(command.footer.substr(command.footer.find_first_not_of('\n'))) + ".fi\n";
  }
  return text;
}

/// Into a folder that other programs share: a page or a completion of `modar` alone is replaced.
Result<void> write_document(const std::string& path, const std::string& text) {
  MODAR_TRY(keep_other_kinds(path, "document of modar", [](std::string_view start) {
    return start.find("modar") != std::string_view::npos;
  }));
  return write_file(path, std::string_view(text));
}

Result<void> write_pages(const CommandText& command, const std::string& folder,
                         const std::string& version) {
  MODAR_TRY(
      write_document(folder + "/" + page_name(command.name) + ".1", manual_page(command, version)));
  for (const CommandText& each : command.commands) MODAR_TRY(write_pages(each, folder, version));
  return {};
}

// --- Completions ---

/// Calls visit(command) for a command and all below it.
template <class Visit>
void for_commands(const CommandText& command, const Visit& visit) {
  visit(command);
  for (const CommandText& each : command.commands) for_commands(each, visit);
}

std::vector<std::string> command_words(const CommandText& command) {
  std::vector<std::string> words;
  for (const CommandText& each : command.commands) {
    words.push_back(each.name.substr(each.name.rfind(' ') + 1));
  }
  return words;
}

std::vector<std::string> option_words(const CommandText& command) {
  std::vector<std::string> words;
  for (const OptionText& option : command.options) {
    if (!is_positional(option)) {
      words.insert(words.end(), option.names.begin(), option.names.end());
    }
  }
  return words;
}

/// A word of a shell.
std::string shell_word(const std::string& text) {
  return "'" + replaced(text, "'", "'\\''") + "'";
}

std::string bash_completion(const CommandText& program) {
  std::string cases;
  std::string values;
  std::string names;
  for_commands(program, [&](const CommandText& command) {
    names += (names.empty() ? "" : "|") + shell_word(command.name);
    cases +=
        "    " + shell_word(command.name) + ") words=" +
        shell_word(joined(command_words(command), " ") + " " + joined(option_words(command), " ")) +
        (command.commands.empty() ? "" : " files=no") + " ;;\n";
    for (const OptionText& option : command.options) {
      for (const std::string& name : option.names) {
        if (option.choices.empty()) continue;
        values += "    " + shell_word(command.name + " " + name) +
                  ") words=" + shell_word(joined(option.choices, " ")) + " ;;\n";
      }
    }
  });
  return "# bash completion for modar. Made by `modar document`.\n_modar() {\n"
         "  local command=modar word words='' files=yes i\n  COMPREPLY=()\n"
         "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
         "    case \"$command ${COMP_WORDS[i]}\" in " +
         names +
         ") command=\"$command ${COMP_WORDS[i]}\" ;; esac\n  done\n"
         "  word=${COMP_WORDS[COMP_CWORD]}\n  case \"$command\" in\n" +
         cases + "  esac\n  case \"$command ${COMP_WORDS[COMP_CWORD - 1]}\" in\n" + values +
         "    *) if [[ $files = yes && $word != -* ]]; then COMPREPLY=($(compgen -f -- "
         "\"$word\")); fi ;;\n  esac\n"
         "  COMPREPLY+=($(compgen -W \"$words\" -- \"$word\"))\n}\n"
         "complete -o filenames -F _modar modar\n";
}

/// What _arguments of zsh takes as one word: names, text and value of an option.
std::string zsh_option(const OptionText& option, const std::string& name) {
  const auto plain = [](const std::string& text) {
    return replaced(replaced(replaced(text, "[", "("), "]", ")"), ":", "\\:");
  };
  std::string text = is_positional(option) ? "*:" + plain(option.help)
                                           : "*" + name + "[" + plain(option.help) + "]";
  if (option.value.empty()) return shell_word(text);
  if (!is_positional(option)) text += ":" + plain(option.value);
  return shell_word(
      text + (option.choices.empty() ? ":_files" : ":(" + joined(option.choices, " ") + ")"));
}

std::string zsh_completion(const CommandText& program) {
  std::string text = "#compdef modar\n# Made by `modar document`.\n";
  for_commands(program, [&](const CommandText& command) {
    text += "_" + replaced(page_name(command.name), "-", "_") + "() {\n";
    if (!command.commands.empty()) {
      text += "  if ((CURRENT > 2)) && (($+functions[" +
              replaced(page_name("_" + command.name), "-", "_") +
              "_${words[2]}])); then\n    local name=$words[2]\n    shift words\n"
              "    ((CURRENT--))\n    " +
              replaced(page_name("_" + command.name), "-", "_") +
              "_$name\n    return\n  fi\n  local -a commands=(\n";
      for (const CommandText& each : command.commands) {
        text += "    " + shell_word(each.name.substr(each.name.rfind(' ') + 1) + ":" + each.about) +
                "\n";
      }
      text += "  )\n  _describe command commands\n";
    }
    text += "  _arguments";
    for (const OptionText& option : command.options) {
      for (const std::string& name : option.names) text += " \\\n    " + zsh_option(option, name);
    }
    text += "\n}\n";
  });
  return text + "_modar \"$@\"\n";
}

/// The condition that `command` is the one being typed.
std::string fish_condition(const CommandText& command) {
  const std::string words = command.name.substr(std::min<std::size_t>(command.name.size(), 6));
  std::string text = words.empty() ? ""
                                   : "__fish_seen_subcommand_from " +
                                         replaced(words, " ", "; and __fish_seen_subcommand_from ");
  const std::vector<std::string> below = command_words(command);
  if (!below.empty()) {
    text += (text.empty() ? "" : "; and ") + std::string("not __fish_seen_subcommand_from ") +
            joined(below, " ");
  }
  return shell_word(text);
}

std::string fish_completion(const CommandText& program) {
  std::string text = "# fish completion for modar. Made by `modar document`.\n";
  for_commands(program, [&](const CommandText& command) {
    const std::string line = "complete -c modar -n " + fish_condition(command);
    for (const CommandText& each : command.commands) {
      text += line + " -f -a " + each.name.substr(each.name.rfind(' ') + 1) + " -d " +
              shell_word(each.about) + "\n";
    }
    for (const OptionText& option : command.options) {
      if (is_positional(option)) continue;
      text += line;
      for (const std::string& name : option.names) {
        text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (!option.choices.empty()) text += " -x -a " + shell_word(joined(option.choices, " "));
      if (!option.value.empty() && option.choices.empty()) text += " -r";
      text += " -d " + shell_word(option.help) + "\n";
    }
  });
  return text;
}

// --- TypeScript ---

/// "--no-lods" as noLods, which bake/extensions/wasm/bake.js turns back.
std::string camel_case(const std::string& words) {
  std::string text;
  for (std::size_t i = words.find_first_not_of('-'); i < words.size(); ++i) {
    const bool upper = words[i] == '-' && i + 1 < words.size();
    text +=
        upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(words[++i]))) : words[i];
  }
  return text;
}

std::string typescript_value(const OptionText& option) {
  if (option.value.empty()) return "boolean";
  if (option.choices.empty()) return "Value | Value[]";
  const std::string one = "'" + joined(option.choices, "' | '") + "'";
  return one + " | (" + one + ")[]";
}

/// An interface a command: PatternScoreOptions of `modar pattern score`.
std::string typescript_options(const CommandText& program) {
  std::string text =
      "// Options of the commands of modar. Made by `modar document`.\n"
      "type Value = string | number;\n";
  for_commands(program, [&](const CommandText& command) {
    if (!command.commands.empty()) return;
    const std::string name = camel_case(replaced(replaced(command.name, "modar", ""), " ", "-"));
    text += "\n/** " + command.about + " */\nexport interface " +
            static_cast<char>(std::toupper(static_cast<unsigned char>(name[0]))) + name.substr(1) +
            "Options {\n";
    for (const OptionText& option : command.options) {
      for (const std::string& flag : option.names) {
        if (!flag.starts_with("--") || flag.starts_with("--help")) continue;
        text += "  /** " + option.help + (option.value.empty() ? "" : ": " + option.value) +
                " */\n  " + camel_case(flag) + "?: " + typescript_value(option) + ";\n";
      }
    }
    text += "}\n";
  });
  return text;
}

Result<ExitCode> write_documents(const CommandLine& program, const std::string& folder) {
  const CommandText text = program.describe();
  const std::string pages = folder + "/man/man1";
  MODAR_TRY(make_output_folder(pages));
  MODAR_TRY(write_pages(text, pages, MODAR_VERSION));
  const auto write = [&](const std::string& place, const std::string& name,
                         const std::string& words) -> Result<void> {
    MODAR_TRY(make_output_folder(folder + "/" + place));
    return write_document(folder + "/" + place + "/" + name, words);
  };
  MODAR_TRY(write("bash-completion/completions", "modar", bash_completion(text)));
  MODAR_TRY(write("zsh/site-functions", "_modar", zsh_completion(text)));
  MODAR_TRY(write("fish/vendor_completions.d", "modar.fish", fish_completion(text)));
  MODAR_TRY(write("modar", "commands.d.ts", typescript_options(text)));
  return ExitCode::kOk;
}

}  // namespace

void add_document(CommandLine& program) {
  CommandLine& line = program.command("document", "Write manual pages, shell completion and types");
  const auto folder = std::make_shared<std::string>();
  line.option("-o,--output", folder.get(),
              "Folder with the layout of /usr/share: man, bash-completion, zsh, fish, modar",
              {.type = "DIR", .required = true});
  line.footer(example("  modar document -o ~/.local/share && man modar-bake\n"));
  line.run([folder, &program] { return write_documents(program, *folder); });
}

}  // namespace modar
