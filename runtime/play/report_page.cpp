// The report's page.
#include "report_page.hpp"

#include <cmath>
#include <string_view>

#include "formats/base/html.hpp"

namespace modar {
namespace {

constexpr std::string_view kReportStyle = R"(
:root{color-scheme:light dark;--ink:#1d232b;--soft:#667;--ground:#f5f6f8;--sheet:#fff;--line:#dde1e7;
--shown:#2f9e5f;--held:#e3a21a;--hidden:#cf4b45}
@media(prefers-color-scheme:dark){:root{--ink:#e6e9ee;--soft:#9aa3b0;--ground:#14171c;--sheet:#1d2128;
--line:#323843}}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
main{max-width:1080px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:26px;margin:0 0 16px}h1 small{font-size:16px;font-weight:400;color:var(--soft)}
h2{font-size:18px;margin:32px 0 10px}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(140px,1fr));gap:10px;margin:0 0 16px}
.card{background:var(--sheet);border:1px solid var(--line);border-radius:10px;padding:10px 14px}
.card b{display:block;font-size:22px;font-variant-numeric:tabular-nums}
.card span{color:var(--soft);font-size:13px}
video,img{display:block;width:100%;border-radius:10px;background:#000}
#strip{position:relative;height:34px;margin:12px 0 6px;cursor:pointer;border-radius:6px;overflow:hidden}
#strip svg{display:block;width:100%;height:100%}
#strip:focus-visible{outline:2px solid var(--ink);outline-offset:2px}
#head{position:absolute;top:0;bottom:0;left:0;width:2px;margin-left:-1px;background:var(--ink);
box-shadow:0 0 0 1px var(--sheet);pointer-events:none}
rect.shown{fill:var(--shown)}rect.held{fill:var(--held)}rect.hidden{fill:var(--hidden)}
#now{margin:0;min-height:1.5em;font-variant-numeric:tabular-nums}
.legend{color:var(--soft);font-size:13px}.legend span,.legend em{margin-right:16px;font-style:normal}
.legend span::before,tbody td:nth-child(3)::before{content:"";display:inline-block;width:10px;
height:10px;border-radius:3px;margin-right:6px;background:var(--c)}
.shown{--c:var(--shown)}.held{--c:var(--held)}.hidden{--c:var(--hidden)}
details{margin-top:28px}summary{font-size:18px;font-weight:600;cursor:pointer}
.scroll{max-height:460px;overflow:auto;margin-top:10px;border:1px solid var(--line);border-radius:10px}
table{width:100%;border-collapse:collapse;background:var(--sheet);font-variant-numeric:tabular-nums}
th{position:sticky;top:0;background:var(--sheet);text-align:left;font-size:13px;color:var(--soft)}
th,td{padding:4px 12px;border-bottom:1px solid var(--line)}
tbody tr{cursor:pointer}tbody tr.now{background:color-mix(in srgb,var(--c) 22%,var(--sheet))}
.foot{color:var(--soft);font-size:13px}a{color:inherit}
)";

constexpr std::string_view kReportScript = R"(
const film=document.getElementById('film'),strip=document.getElementById('strip'),
head=document.getElementById('head'),now=document.getElementById('now'),
rows=[...document.getElementById('rows').rows];
let current=-1;
function at(){return Math.max(0,Math.min(rows.length-1,Math.floor(film.currentTime*fps+1e-3)))}
function show(){
  const i=at();
  if(i===current||!rows.length)return;
  if(rows[current])rows[current].classList.remove('now');
  current=i;
  const row=rows[i],cell=row.cells;
  row.classList.add('now');
  const box=row.closest('.scroll'),top=row.offsetTop-box.clientHeight/2;
  box.scrollTop=top;
  head.style.left=(100*(i+.5)/rows.length)+'%';
  now.textContent='frame '+cell[0].textContent+' \u00b7 '+cell[1].textContent+' s \u00b7 '+
    cell[2].textContent+(cell[4].textContent?' \u00b7 '+cell[4].textContent+' inliers':'');
}
function seek(i){
  film.pause();
  film.currentTime=(Math.max(0,Math.min(rows.length-1,i))+.5)/fps;
  show();
}
strip.addEventListener('click',e=>{
  const box=strip.getBoundingClientRect();
  seek(Math.floor((e.clientX-box.left)/box.width*rows.length));
});
strip.addEventListener('keydown',e=>{
  const step={ArrowLeft:-1,ArrowRight:1,PageUp:-30,PageDown:30}[e.key];
  if(step){e.preventDefault();seek(at()+step)}
});
rows.forEach((row,i)=>row.addEventListener('click',()=>seek(i)));
film.addEventListener('seeked',show);
(function tick(){show();requestAnimationFrame(tick)})();
)";

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
  page += "<div class=card><b>" + value + "</b><span>" + escape_html(label) + "</span></div>\n";
}

void add_cards(std::string& page, const ReportTitle& title, const RunStats& stats) {
  const StageTimes ms = stats.median_ms();
  page += "<section class=cards>\n";
  add_card(page, std::to_string(stats.frames()), "frames");
  add_card(page, fixed(stats.recognised_percent(), 1) + " %", "with a pattern recognised");
  add_card(page, std::to_string(stats.count(Shown::kHeld)), "frames held");
  add_card(page, std::to_string(stats.count(Shown::kHidden)), "frames hidden");
  add_card(page, fixed(ms[static_cast<std::size_t>(Stage::kTrack)], 1) + " ms", "vision (median)");
  add_card(page, fixed(ms[static_cast<std::size_t>(Stage::kRender)], 1) + " ms",
           draws_in_software(title.gl_renderer)
               ? "rendering (median), in software: no graphics card"
               : "rendering (median)");
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
            " height=1><title>" + escape_html(text) + "</title></rect>\n";
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
    page += "<em>" + escape_html(to_string(reason)) + ": " + std::to_string(stats.count(reason)) +
            "</em>";
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
            escape_html(what(frame)) + "<td>" + escape_html(frame.patterns);
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
  page += escape_html(title.bundle) + " on " + escape_html(title.input) + "</title>\n<style>" +
          std::string(kReportStyle) + "</style></head>\n<body><main>\n";
  page += "<h1>" + escape_html(title.bundle) + " <small>on " + escape_html(title.input) +
          ", method " + escape_html(title.method) + "</small></h1>\n";
  add_cards(page, title, stats);
  page +=
      "<video id=film src=overlay.mp4 poster=poster.png controls loop muted playsinline "
      "preload=auto></video>\n";
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
