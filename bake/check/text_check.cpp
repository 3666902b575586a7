#include "bake/check/text_check.hpp"

#include <optional>

#include "bake/check/verdict.hpp"
#include "bake/json.hpp"

namespace modar {
namespace {

/// How the words of one scene differ from the source's; empty: they do not.
std::string word_fault(const std::optional<modar::Json>& stated,
                       const std::map<std::string, std::string>& words) {
  if (words.empty() && !stated) return "";
  if (!stated) return "its text is missing";
  for (const auto& [language, expected] : words) {
    const auto found = stated->find(language);
    const auto text = found ? found->text() : std::nullopt;
    if (!text) return "its text in '" + language + "' is missing";
    if (*text != expected) {
      return "its text in '" + language + "' is '" + *text + "', the source's is '" + expected +
             "'";
    }
  }
  return stated->size() == words.size() ? "" : "it has a text in a language that the source lacks";
}

}  // namespace

void check_texts(const BundleView& bundle, const std::vector<SceneText>& sources,
                 const IssueSink& sink) {
  const auto meta = bundle.section(SectionType::kMeta);
  const auto offset = meta.empty()
                          ? std::uint64_t{0}
                          : static_cast<std::uint64_t>(meta.data() - bundle.bytes().data());
  const auto tell = [&](const std::string& where, std::string detail) {
    sink(Issue{&workstation_issue_kind(WorkstationRule::kSourceScene), where, offset,
               std::move(detail), std::nullopt});
  };
  const std::vector<Json> stated = Json::parse(bundle.meta())["texts"].elements();
  std::size_t known = 0;
  for (const SceneText& source : sources) {
    const auto found = std::find_if(stated.begin(), stated.end(), [&](const Json& each) {
      return each.text_at("pattern") == source.pattern && each.text_at("model") == source.model;
    });
    const Json entry = found == stated.end() ? Json() : *found;
    known += found == stated.end() ? 0u : 1u;
    for (const std::string& fault : {word_fault(entry.find("text"), source.words),
                                     word_fault(entry.find("alt"), source.alts)}) {
      if (fault.empty()) continue;
      tell("pattern '" + source.pattern + "', model '" + source.model + "'", fault);
    }
  }
  if (stated.size() != known) {
    tell("texts", with_numbers("it has {}, the source {}", {stated.size(), sources.size()}));
  }
}

}  // namespace modar
