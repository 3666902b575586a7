#include "bake/extensions/report/nodes_section.hpp"

#include <cstdio>

#include "bake/bundle/bundle_json.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "formats/base/html.hpp"
#include "formats/captions.hpp"
#include "formats/meta_text.hpp"

namespace modar {
namespace {

constexpr const char* kTable = "<div class=\"scroll\"><table><thead><tr>";
constexpr const char* kTableEnd = "</tbody></table></div>\n";

std::string heads(std::initializer_list<const char*> names) {
  std::string html = kTable;
  for (const char* name : names) html += std::string("<th scope=\"col\">") + name + "</th>";
  return html + "</tr></thead><tbody>\n";
}

std::string text_at(const Json& object, const char* key) {
  return escape_html(object.text_at(key));
}

/// Titles, texts and alternatives, a line a language.
std::string node_words(const BundleView& bundle, const NodeRecord& node) {
  const std::string_view pattern = bundle.name(bundle.patterns()[node.pattern].name);
  const std::string_view name = bundle.name(node.name);
  std::string html;
  visit_node_texts(bundle.meta(), [&](const MetaText& each) {
    if (each.pattern != pattern || each.node != name) return;
    const std::string language = escape_html(each.language);
    if (!html.empty()) html += "<br>";
    html += "<span class=\"chip\">" + language + "</span> ";
    if (each.kind == MetaText::Kind::kCaptions) {
      html += "<details><summary>Captions</summary><span lang=\"" + language + "\">" +
              escape_html(transcript(each.words)) + "</span></details>";
    } else {
      html += "<span lang=\"" + language + "\">" + escape_html(each.words) + "</span>";
    }
  });
  return html;
}

std::string node_state(const NodeRecord& node) {
  std::string words = (node.flags & kNodeHidden) != 0 ? "hidden at first" : "";
  const auto add = [&words](const std::string& word) {
    words += (words.empty() ? "" : ", ") + word;
  };
  if (plays_media(node)) add((node.flags & kNodePlays) != 0 ? "plays when found" : "waits");
  if ((node.flags & kNodeLoops) != 0) add("again and again");
  if (node.group != 0) add("variant of group " + std::to_string(node.group));
  return words;
}

std::string node_table(const BundleView& bundle, const Json& nodes) {
  std::string html = heads({"Name", "What", "On", "State", "Words"});
  for (std::uint32_t n = 0; n < bundle.nodes().size(); ++n) {
    const Json one = nodes[n];
    const std::string mark = text_at(one, "mark");
    html += "<tr><th scope=\"row\">" + text_at(one, "name") +
            (mark.empty() ? "" : " <span class=\"chip\">" + mark + "</span>") + "</th><td>" +
            text_at(one, "kind") + "</td><td>" + text_at(one, "pattern") + "</td><td>" +
            node_state(bundle.nodes()[n]) + "</td><td>" + node_words(bundle, bundle.nodes()[n]) +
            "</td></tr>\n";
  }
  return html + kTableEnd;
}

std::string media_table(const BundleView& bundle) {
  std::string html = heads({"File", "Is", "Lasts", "Bytes", "Flashes"});
  for (std::uint32_t m = 0; m < bundle.media().size(); ++m) {
    const MediaRecord& media = bundle.media()[m];
    const bool video = media.kind == static_cast<std::uint32_t>(MediaKind::kVideo);
    char seconds[32];
    std::snprintf(seconds, sizeof seconds, "%.1f s", static_cast<double>(media.seconds));
    const std::string sides = with_numbers("{} × {} video, ", {media.width, media.height});
    const char* sound = (media.flags & kMediaSound) != 0 ? "with sound" : "silent";
    const char* flashes = (media.flags & kMediaFlashes) != 0
                              ? "<span class=\"chip warn\">more than three a second</span>"
                              : "no";
    html += "<tr><th scope=\"row\">" + escape_html(bundle.name(media.name)) + "</th><td>" +
            (video ? sides + sound : "sound") + "</td><td>" + seconds + "</td><td>" +
            human_bytes(bundle.media_data(m).size()) + "</td><td>" + (video ? flashes : "") +
            "</td></tr>\n";
  }
  return html + kTableEnd;
}

std::string action_table(const Json& actions) {
  std::string html = heads({"On", "When: what"});
  for (const Json& one : actions.elements()) {
    html += "<tr><th scope=\"row\">" + text_at(one, "pattern") + "</th><td>" +
            text_at(one, "words") + "</td></tr>\n";
  }
  return html + kTableEnd;
}

}  // namespace

std::string acting_section(const BundleView& bundle) {
  if (bundle.nodes().empty()) return "";
  const Json document = bundle_json(bundle);
  std::string html =
      "<section aria-labelledby=\"acting\">\n<h2 id=\"acting\">What plays, points "
      "and acts</h2>\n" +
      node_table(bundle, document["nodes"]);
  if (!bundle.media().empty()) html += "<h3>Videos and sounds</h3>\n" + media_table(bundle);
  if (!bundle.actions().empty()) {
    html += "<h3>Actions</h3>\n" + action_table(document["actions"]);
  }
  return html + "</section>\n";
}

}  // namespace modar
