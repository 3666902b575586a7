// Composes the report's page. Everything is in the markup; the script only ties it to the movie.
#include "report_page.hpp"

#include <cmath>

#include "report_style.hpp"

namespace modar {
namespace {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

/// A number with that many decimals, 1 to 6, and a point in any locale.
std::string fixed(double value, int decimals) {
  if (!(std::abs(value) < 1e9)) return "-";
  const double scale = std::pow(10.0, decimals);
  std::string digits = std::to_string(std::llround(std::abs(value) * scale));
  const auto least = static_cast<std::size_t>(decimals) + 1;
  if (digits.size() < least) digits.insert(0, least - digits.size(), '0');
  digits.insert(digits.size() - static_cast<std::size_t>(decimals), 1, '.');
  return value < 0 ? "-" + digits : digits;
}

std::string what(const PageFrame& frame) {
  std::string text = to_string(frame.state);
  if (frame.state == Shown::kShown) return text;
  if (frame.seen) return text + ": seen once, waits for a second frame";
  return text + ": " + to_string(frame.reason);
}

void add_card(std::string& page, const std::string& value, const std::string& label) {
  page += "<div class=card><b>" + value + "</b><span>" + escaped(label) + "</span></div>\n";
}

void add_cards(std::string& page, const RunStats& stats) {
  const StageTimes ms = stats.median_ms();
  page += "<section class=cards>\n";
  add_card(page, std::to_string(stats.frames()), "frames");
  add_card(page, fixed(stats.recognised_percent(), 1) + " %", "with a pattern recognised");
  add_card(page, std::to_string(stats.count(Shown::kHeld)), "frames held");
  add_card(page, std::to_string(stats.count(Shown::kHidden)), "frames hidden");
  add_card(page, fixed(ms[static_cast<std::size_t>(Stage::kTrack)], 1) + " ms", "vision (median)");
  add_card(page, fixed(ms[static_cast<std::size_t>(Stage::kRender)], 1) + " ms",
           "rendering (median)");
  page += "</section>\n";
}

/// Runs of equal frames are one rectangle, so that an hour of video stays small.
void add_strip(std::string& page, std::span<const PageFrame> frames) {
  page +=
      "<div id=strip role=slider tabindex=0 aria-label=\"state of each frame\">\n<svg viewBox=\"0 "
      "0 " +
      std::to_string(frames.empty() ? 1 : frames.size()) +
      " 1\" preserveAspectRatio=none shape-rendering=crispEdges>\n";
  for (std::size_t first = 0; first < frames.size();) {
    const std::string text = what(frames[first]);
    std::size_t end = first + 1;
    while (end < frames.size() && what(frames[end]) == text) ++end;
    page += "<rect class=" + std::string(to_string(frames[first].state)) +
            " x=" + std::to_string(first) + " width=" + std::to_string(end - first) +
            " height=1><title>" + escaped(text) + "</title></rect>\n";
    first = end;
  }
  page += "</svg><i id=head></i></div>\n";
}

void add_reasons(std::string& page, const RunStats& stats) {
  page +=
      "<p class=legend><span class=shown>shown</span><span class=held>held</span>"
      "<span class=hidden>hidden</span>";
  for (const Reason reason : kReasons) {
    if (reason == Reason::kVisible || stats.count(reason) == 0) continue;
    page +=
        "<em>" + escaped(to_string(reason)) + ": " + std::to_string(stats.count(reason)) + "</em>";
  }
  page += "</p>\n";
}

void add_table(std::string& page, std::span<const PageFrame> frames) {
  page +=
      "<details open><summary>Frames</summary><div class=scroll><table>\n<thead><tr><th>frame"
      "<th>time, s<th>state<th>pattern<th>inliers<th>matches</tr></thead>\n<tbody id=rows>\n";
  for (const PageFrame& frame : frames) {
    page += "<tr class=" + std::string(to_string(frame.state)) + "><td>" +
            std::to_string(frame.frame) + "<td>" + fixed(frame.time_s, 2) + "<td>" +
            escaped(what(frame)) + "<td>" + escaped(frame.patterns);
    page += "<td>" + (frame.seen ? std::to_string(frame.inliers) : std::string());
    page += "<td>" + (frame.seen ? std::to_string(frame.matches) : std::string()) + "</tr>\n";
  }
  page += "</tbody></table></div></details>\n";
}

}  // namespace

std::string report_page(const ReportTitle& title, double fps, std::span<const PageFrame> frames,
                        const RunStats& stats) {
  std::string page =
      "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\n"
      "<meta name=viewport content=\"width=device-width,initial-scale=1\">\n<title>";
  page += escaped(title.bundle) + " on " + escaped(title.input) + "</title>\n<style>" +
          std::string(kReportStyle) + "</style></head>\n<body><main>\n";
  page += "<h1>" + escaped(title.bundle) + " <small>on " + escaped(title.input) + ", method " +
          escaped(title.method) + "</small></h1>\n";
  add_cards(page, stats);
  page += "<video id=film src=overlay.mp4 controls loop muted playsinline preload=auto></video>\n";
  add_strip(page, frames);
  page += "<p id=now aria-live=off>&nbsp;</p>\n";
  add_reasons(page, stats);
  page +=
      "<h2>Contact sheet</h2>\n<a href=contact_sheet.png><img src=contact_sheet.png "
      "alt=\"frames with their numbers and states\"></a>\n";
  add_table(page, frames);
  page +=
      "<p class=foot>Frame by frame, with poses and times: <a href=frames.jsonl>frames.jsonl"
      "</a></p>\n</main>\n<script>const fps=" +
      fixed(fps, 6) + ";" + std::string(kReportScript) + "</script>\n</body></html>\n";
  return page;
}

}  // namespace modar
