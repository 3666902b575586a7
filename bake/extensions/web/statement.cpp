#include "bake/extensions/web/statement.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "bake/extensions/web/page_texts.hpp"
#include "formats/base/html.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// Replacements of {name}: HTML.
using Values = std::vector<std::pair<std::string_view, std::string>>;

/// What the tests prove, in the order of the statement.
constexpr std::string_view kProven[] = {"axe",   "names",     "keys",  "handles",
                                        "alone", "languages", "reflow"};

std::string filled(const Json& texts, std::string_view key, const Values& values) {
  std::string html = escape_html(texts.text_at(key));
  for (const auto& [name, value] : values) {
    const std::string mark = "{" + std::string(name) + "}";
    for (std::size_t at = html.find(mark); at != std::string::npos;
         at = html.find(mark, at + value.size())) {
      html.replace(at, mark.size(), value);
    }
  }
  return html;
}

/// A link that shows its address, as people write it.
std::string link_to(const std::string& address) {
  const std::size_t scheme = address.find(':');
  const bool plain = address.starts_with("mailto:") || address.starts_with("tel:");
  return "<a href=\"" + escape_html(address) + "\">" +
         escape_html(plain ? address.substr(scheme + 1) : address) + "</a>";
}

bool is_date(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00";
  return std::equal(text.begin(), text.end(), kForm.begin(), kForm.end(), [](char c, char form) {
    return form == '0' ? c >= '0' && c <= '9' : c == form;
  });
}

std::string paragraph(const std::string& html) {
  return "<p>" + html + "</p>\n";
}

}  // namespace

Result<Publisher> read_publisher(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  const Json given = Json::parse(file.bytes());
  Publisher publisher{given.text_at("publisher"), given.text_at("date"), given.text_at("feedback"),
                      given.text_at("enforcement")};
  const std::pair<const char*, bool> parts[] = {
      {"publisher", !publisher.name.empty()},
      {"date", is_date(publisher.date)},
      {"feedback", is_link_address(publisher.feedback)},
      {"enforcement", is_link_address(publisher.enforcement)}};
  for (const auto& [key, good] : parts) {
    if (good) continue;
    return fail(ExitCode::kInvalidInput, "web.statement", path,
                "it has no '" + std::string(key) + "', or not a valid one",
                R"(write {"publisher": "Museum of X", "date": "2026-11-26", "feedback": )"
                R"("mailto:access@museum.org", "enforcement": "https://..."})");
  }
  return publisher;
}

std::string statement_page(const Json& texts, const std::string& language, const std::string& page,
                           const Publisher& publisher,
                           const std::vector<std::string>& undescribed) {
  const std::string own = "<a href=\"./?lang=" + language + "\">" + escape_html(page) + "</a>";
  std::string scenes;
  for (const std::string& scene : undescribed) {
    scenes += (scenes.empty() ? "" : ", ") + escape_html(scene);
  }
  Values values = {{"publisher", escape_html(publisher.name)},
                   {"page", own},
                   {"scenes", scenes},
                   {"date", "<time>" + escape_html(publisher.date) + "</time>"},
                   {"address", link_to(publisher.feedback)}};
  const auto text = [&](std::string_view key) { return filled(texts, key, values); };
  const auto heading = [&](const std::string& section) {
    return "<h2>" + text(section + "/heading") + "</h2>\n";
  };
  std::string body =
      "<h1>" + text("title") + "</h1>\n" + paragraph(text("commitment")) + paragraph(text("scope"));
  body += heading("status") + paragraph(text("status/text"));
  body += heading("content") + paragraph(text("content/lead")) + "<ul>\n";
  for (const char* barrier : {"camera", "aiming", "models"}) {
    body += "<li>" + text(std::string("content/") + barrier) + "</li>\n";
  }
  if (!undescribed.empty()) body += "<li>" + text("content/undescribed") + "</li>\n";
  body += "</ul>\n" + heading("preparation") + paragraph(text("preparation/date")) +
          paragraph(text("preparation/method")) + "<ul>\n";
  for (const std::string_view proven : kProven) {
    body += "<li>" + text("preparation/" + std::string(proven)) + "</li>\n";
  }
  body += "</ul>\n" + paragraph(text("preparation/untested"));
  body += heading("feedback") + paragraph(text("feedback/text"));
  values.back().second = link_to(publisher.enforcement);
  body += heading("enforcement") + paragraph(text("enforcement/text"));
  return "<!doctype html>\n<html lang=\"" + language +
         "\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
         "style-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'\">\n<title>" +
         text("title") + " · " + escape_html(page) +
         "</title>\n<link rel=\"icon\" href=\"icon.svg\" type=\"image/svg+xml\">\n"
         "<link rel=\"stylesheet\" href=\"style.css\">\n</head>\n<body>\n<main "
         "id=\"statement\">\n" +
         body + "</main>\n</body>\n</html>\n";
}

}  // namespace modar
