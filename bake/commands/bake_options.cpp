// The table of options on the command line.
#include "bake/commands/bake_options.hpp"

namespace modar {
namespace {

/// "Store occlusion (why)" -> "Do not store occlusion".
std::string negated(const BakeOption& option) {
  std::string help = option_summary(option);
  help[0] = static_cast<char>(help[0] - 'A' + 'a');
  return "Do not " + help;
}

/// Flags of a truth: "--x", "--no-x" or both.
void add_truth(CommandLine& line, const BakeOption& option, bool& value) {
  const std::string flag = option.flag;
  const std::size_t comma = flag.find(',');
  const bool off = flag.starts_with("--no-");
  line.flag(comma == std::string::npos ? (off ? "!" + flag : flag)
                                       : flag.substr(0, comma) + ",!" + flag.substr(comma + 1),
            value, off ? negated(option) : option_help(option));
}

/// "--x" takes index 1, "--no-x" 0.
void add_truth(CommandLine& line, const BakeOption& option, const WordOption& word,
               BakeRequest& request) {
  const std::string flag = option.flag;
  const std::string on = flag.substr(0, flag.find(','));
  line.flag(
      on, [&word, &request] { word.set(request, 1); }, option_help(option));
  line.flag(flag.substr(on.size() + 1), [&word, &request] { word.set(request, 0); },
            negated(option), {.excludes = on});
}

void add_number(CommandLine& line, const BakeOption& option, const NumberOption& number,
                BakeRequest& request) {
  const std::string flag = option.flag;
  const std::string name = flag.substr(0, flag.find(','));
  line.option(name, &number.at(request), option.help,
              {.shows_default = true,
               .least = static_cast<double>(number.least),
               .most = static_cast<double>(number.most)});
  if (name == flag) return;
  line.flag(flag.substr(name.size() + 1),
            [&number, &request] { number.at(request) = number.least; },
            "The same as " + name + " " + std::to_string(number.least), {.excludes = name});
}

void add_words(CommandLine& line, const BakeOption& option, const WordOption& word,
               BakeRequest& request) {
  std::map<std::string, int> words;
  for (std::size_t i = 0; i < word.words.size(); ++i) words[word.words[i]] = static_cast<int>(i);
  line.choose(option.flag, [&word, &request](int chosen) { word.set(request, chosen); }, words,
              option_help(option), {.type = option.type});
}

}  // namespace

void add_bake_options(CommandLine& line, OptionGroup group, BakeRequest& request,
                      OptionTexts& texts) {
  for (const BakeOption& option : bake_options()) {
    if (option.group != group) continue;
    OptionRules rules;
    if (option.type != nullptr) rules.type = option.type;
    rules.choices = option_choices(option);
    if (const auto* truth = std::get_if<TruthOption>(&option.value)) {
      add_truth(line, option, truth->at(request));
    } else if (const auto* number = std::get_if<NumberOption>(&option.value)) {
      add_number(line, option, *number, request);
    } else if (const auto* word = std::get_if<WordOption>(&option.value)) {
      if (word->truth) {
        add_truth(line, option, *word, request);
      } else {
        add_words(line, option, *word, request);
      }
    } else if (const auto* words = std::get_if<WordsOption>(&option.value)) {
      rules.separator = ',';
      line.option(option.flag, &words->at(request), option_help(option), rules);
    } else {
      line.option(option.flag, &texts[&option], option_help(option), rules);
    }
  }
}

Result<void> take_texts(const OptionTexts& texts, BakeRequest& request) {
  for (const auto& [option, text] : texts) {
    if (!text.empty()) MODAR_TRY(parse_option(*option, text, request));
  }
  plan_request(request);
  return {};
}

}  // namespace modar
