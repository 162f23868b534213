#include "apps/common/report_page.h"

#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr char kStyle[] = R"css(
:root{--bg:#fff;--fg:#1c2430;--soft:#5d6978;--line:#dde3ea;--card:#f6f8fa;--accent:#1f6fd1;--good:#1d8348;--bad:#c0392b}
@media(prefers-color-scheme:dark){:root{--bg:#14181d;--fg:#e4e9ef;--soft:#9aa7b5;--line:#2d353f;--card:#1b2127;--accent:#6cb0ff;--good:#5fcf8d;--bad:#ff8a7a}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1400px;padding:0 24px 80px;background:var(--bg);color:var(--fg);font:15px/1.5 system-ui,-apple-system,"Segoe UI",sans-serif}
nav{position:sticky;top:0;z-index:2;display:flex;flex-wrap:wrap;gap:4px 18px;padding:10px 0;background:var(--bg);border-bottom:1px solid var(--line);font-size:14px}
a{color:var(--accent);text-decoration:none}a:hover{text-decoration:underline}
h1{font-size:26px;margin:24px 0 4px}h2{font-size:19px;margin:40px 0 12px;scroll-margin-top:52px}h3{font-size:16px;margin:0 0 10px;overflow-wrap:anywhere}div+h3{margin-top:28px}
h3 small{font-weight:400;color:var(--soft);margin-left:8px}
p,li{overflow-wrap:anywhere}
p.lead{margin:0 0 20px;color:var(--soft)}
.scroll{overflow-x:auto;border:1px solid var(--line);border-radius:8px}
table{border-collapse:collapse;width:100%;font-size:13px;font-variant-numeric:tabular-nums}
th,td{padding:5px 9px;text-align:right;white-space:nowrap;border-bottom:1px solid var(--line)}
tr:last-child td{border-bottom:0}
th{background:var(--card);font-weight:600;vertical-align:bottom}
table.sortable th{cursor:pointer}
th.up:after{content:" \25B4"}th.down:after{content:" \25BE"}
table.matrix td{text-align:center}table.matrix th{white-space:normal;text-align:center;padding:5px 6px}table.matrix th.l{white-space:nowrap;text-align:left}
table.named td:first-child,table.named th:first-child,table.matrix th.l{position:sticky;left:0;background:var(--bg)}
table.named th:first-child,table.matrix th.l{background:var(--card)}
table.brief tr.rest{display:none}
td.best{font-weight:700;color:var(--good)}
.l,th.l{text-align:left}td.say{text-align:left;white-space:normal;min-width:160px;color:var(--soft)}
tr.more td{color:var(--soft)}tr.shown td{background:var(--card)}
.failed{color:var(--bad);font-weight:600}
.plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,560px),1fr));gap:20px}
.plots>div,section.image{border:1px solid var(--line);border-radius:8px;padding:16px}
svg{width:100%;height:auto;display:block}
section.image{margin:0 0 22px}
.two{display:flex;flex-wrap:wrap;gap:20px;margin:0 0 14px}.two>div{flex:1 1 300px}
figure{margin:0;flex:0 1 720px}figure img{display:block;width:100%;border-radius:6px;cursor:zoom-in}
ul.say{margin:6px 0 12px;padding-left:18px;color:var(--soft);font-size:13px}
.legend span{display:inline-block;margin-right:16px}.legend i{display:inline-block;width:12px;height:12px;border-radius:3px;margin-right:5px;vertical-align:-1px}
.choose button{font:inherit;font-size:14px;margin:0 6px 14px 0;padding:4px 14px;color:var(--fg);background:var(--card);border:1px solid var(--line);border-radius:16px;cursor:pointer}
.choose button.on{color:#fff;background:#1f6fd1;border-color:#1f6fd1}
.scroll+.choose{margin:12px 0 0}
@media(max-width:600px){body{padding:0 12px 60px}nav{position:static}section.image,.plots>div{padding:10px}th,td{padding:4px 7px}td.say{min-width:220px}table.named td:first-child,table.matrix th.l{white-space:normal}}
details{margin:0 0 22px}summary{cursor:pointer;color:var(--accent)}
#zoom{position:fixed;inset:0;z-index:3;display:none;overflow:hidden;background:#0d1014ee;cursor:grab}
#zoom.on{display:block}#zoom img{position:absolute;left:0;top:0;transform-origin:0 0;max-width:none;user-select:none}
#zoom p{position:absolute;left:0;right:0;bottom:0;margin:0;padding:8px 16px;color:#e4e9ef;background:#0d1014b0;font-size:13px;pointer-events:none}
)css";

constexpr char kScript[] = R"js(
document.querySelectorAll('table.sortable').forEach(function(table){
  var heads=table.querySelectorAll('th');
  heads.forEach(function(head,column){head.addEventListener('click',function(){
    var up=!head.classList.contains('up');
    heads.forEach(function(h){h.classList.remove('up','down')});
    head.classList.add(up?'up':'down');
    var body=table.tBodies[0],rows=Array.from(body.rows);
    function value(row){var text=row.cells[column].textContent.trim(),number=parseFloat(text);
      return text==='-'?null:isNaN(number)?text:number}
    rows.sort(function(a,b){var x=value(a),y=value(b);
      if(x===null||y===null)return(x===null)-(y===null);
      var order=typeof x===typeof y?(x<y?-1:x>y?1:0):(typeof x==='number'?-1:1);return up?order:-order});
    rows.forEach(function(row){body.appendChild(row)})})})});

document.querySelectorAll('button.rest').forEach(function(button){
  button.addEventListener('click',function(){
    document.querySelectorAll('table.brief').forEach(function(table){table.classList.remove('brief')});
    button.remove()})});

document.querySelectorAll('.choose button[value]').forEach(function(button,i,all){
  button.addEventListener('click',function(){
    all.forEach(function(b){b.classList.toggle('on',b===button)});
    document.querySelectorAll('section.image').forEach(function(section){
      section.hidden=button.value!==''&&section.dataset.why!==button.value})})});

(function(){
  var box=document.getElementById('zoom'),view=box.querySelector('img'),words=box.querySelector('p');
  var images=Array.from(document.querySelectorAll('figure img')),now=0,scale=1,x=0,y=0,drag=null,moved=false;
  function place(){view.style.transform='translate('+x+'px,'+y+'px) scale('+scale+')'}
  function show(i){now=(i+images.length)%images.length;view.src=images[now].src;words.textContent=images[now].alt+'   (wheel: zoom, drag: move, arrows: next, Esc: close)';
    var w=images[now].naturalWidth,h=images[now].naturalHeight;
    scale=Math.min(innerWidth/w,(innerHeight-40)/h);x=(innerWidth-w*scale)/2;y=(innerHeight-40-h*scale)/2;place();box.classList.add('on')}
  images.forEach(function(image,i){image.addEventListener('click',function(){show(i)})});
  box.addEventListener('wheel',function(e){e.preventDefault();
    var f=Math.exp(-e.deltaY*0.0015),s=Math.min(40,Math.max(0.1,scale*f));f=s/scale;
    x=e.clientX-(e.clientX-x)*f;y=e.clientY-(e.clientY-y)*f;scale=s;place()},{passive:false});
  box.addEventListener('pointerdown',function(e){drag=[e.clientX-x,e.clientY-y,e.clientX,e.clientY];moved=false;e.preventDefault()});
  box.addEventListener('pointermove',function(e){if(!drag)return;
    moved=moved||Math.hypot(e.clientX-drag[2],e.clientY-drag[3])>4;x=e.clientX-drag[0];y=e.clientY-drag[1];place()});
  box.addEventListener('pointerup',function(){drag=null;if(!moved)box.classList.remove('on')});
  document.addEventListener('keydown',function(e){if(!box.classList.contains('on'))return;
    if(e.key==='Escape')box.classList.remove('on');
    if(e.key==='ArrowRight')show(now+1);if(e.key==='ArrowLeft')show(now-1)});
})();
)js";

}  // namespace

std::string PageTop(const std::string& title) {
  return "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
         "<meta name='viewport' content='width=device-width,initial-scale=1'><title>" +
         EscapeHtml(title) + "</title><style>" + kStyle + "</style></head><body>\n";
}

std::string PageEnd() {
  return std::string("<div id='zoom'><img alt=''><p></p></div>\n<script>") + kScript +
         "</script></body></html>\n";
}

std::string CellHtml(const std::string& text, const std::string& css) {
  return (css.empty() ? "<td>" : "<td class='" + css + "'>") + EscapeHtml(text) + "</td>";
}

std::string ListHtml(const std::vector<std::string>& sentences, const std::string& css) {
  if (sentences.empty()) return "";
  std::string html = "<ul class='" + css + "'>";
  for (const std::string& sentence : sentences) html += "<li>" + EscapeHtml(sentence) + "</li>";
  return html + "</ul>";
}

std::string PictureHtml(const std::string& alt, const std::string& jpeg) {
  return "<img alt='" + EscapeHtml(alt) + "' src='data:image/jpeg;base64," + EncodeBase64(jpeg) +
         "'>";
}

}  // namespace circline::apps
