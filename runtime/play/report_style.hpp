// Style and script of the report's page.
#pragma once

#include <string_view>

namespace modar {

inline constexpr std::string_view kReportStyle = R"(
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

inline constexpr std::string_view kReportScript = R"(
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

}  // namespace modar
