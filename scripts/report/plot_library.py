"""plotly.js with the parts that a page needs, packed so that one file opens offline.

Debian's plotly.js is 8.7 MB of modules, as browserify joins them: {NUMBER: [function, {name:
NUMBER}]}. Most of them draw kinds of traces (maps, 3-D scenes) that few pages have. What the page's
traces need is cut out and compressed; the browser decompresses it before it draws.
"""
import base64
import gzip
import json
import re

import plotly.offline

MODULE = re.compile(r"(\d+):\[function\(_dereq_,module,exports\)\{\n")
END = re.compile(r"\n\},(\{[^\n]*?\})\](?:,(?=\d+:\[function\(_dereq_,)|"
                 r"\},\{\},\[(\d+)\]\)\(\d+\)\n\}\);\s*$)")
CORE = ["./core"]  # scatter is part of it
ALWAYS_THERE = {"scatter"}
UNPACK = """
window.drawLater=[];
window.draw=function(id,figure,config){drawLater.push([id,figure,config]);};
addEventListener("DOMContentLoaded",async function(){
  try{
    const text=document.getElementById("plot-library").textContent;
    const bytes=Uint8Array.from(atob(text),c=>c.charCodeAt(0));
    const stream=new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script=document.createElement("script");
    script.textContent=await new Response(stream).text();
    document.head.appendChild(script);
  }catch(error){
    for(const plot of document.querySelectorAll(".plot"))
      plot.textContent="This browser can't unpack the plots ("+error+
        "). Firefox 113, Chromium 80 and Safari 16.4 can, and later ones.";
    return;
  }
  const dark=matchMedia("screen and (prefers-color-scheme: dark)");
  function look(layout,isDark){
    const ink=isDark?"#dfe5ec":"#1b2430",line=isDark?"#333d4a":"#e9edf2";
    const changes={paper_bgcolor:"rgba(0,0,0,0)",plot_bgcolor:"rgba(0,0,0,0)","font.color":ink,
      "modebar.bgcolor":"rgba(0,0,0,0)","modebar.color":"#97a3b4","modebar.activecolor":ink};
    for(const key of Object.keys(layout).filter(key=>/^[xy]axis/.test(key)))
      Object.assign(changes,{[key+".gridcolor"]:line,[key+".linecolor"]:isDark?"#57636f":"#c6cfda"});
    (layout.annotations||[]).forEach((_,i)=>changes["annotations["+i+"].font.color"]=ink);
    return changes;
  }
  // On a telephone panels that stand side by side stand below each other, the legend below all.
  function stack(id,{data,layout},config){
    config.displayModeBar=false;
    const below=!(layout.legend.x<1)?20*data.length:0;  // px of the legend
    if(below)layout.legend={orientation:"h",x:0,y:-0.1,yanchor:"top"};
    const panels=Object.keys(layout).filter(key=>/^xaxis/.test(key)).map(key=>
      ({x:layout[key],y:layout[(layout[key].anchor||"").replace("y","yaxis")]})
    ).filter(({x,y})=>x.domain&&y&&y.domain).map(({x,y})=>
      ({x,y,left:x.domain[0],middle:(x.domain[0]+x.domain[1])/2,top:y.domain[1]})
    ).sort((a,b)=>b.top-a.top||a.left-b.left);
    const lefts=new Set(panels.map(p=>p.left)).size,high=1/panels.length;
    if(lefts<2)return;
    panels.forEach((p,i)=>{
      p.x.domain=[0,1];
      p.y.domain=[1-(i+0.75)*high,1-(i+0.05)*high];
      p.y.showticklabels=p.x.showticklabels=true;
      for(const title of layout.annotations||[])
        if(!title.done&&Math.abs(title.x-p.middle)<1e-3&&Math.abs(title.y-p.top)<1e-3)
          Object.assign(title,{x:0.5,y:p.y.domain[1],done:true});
    });
    layout.height=0.8*lefts*layout.height+below;
    document.getElementById(id).style.height=layout.height+"px";
  }
  window.draw=function(id,figure,config){
    if(innerWidth<=600)stack(id,figure,config);
    Plotly.newPlot(id,figure.data,figure.layout,config).then(p=>Plotly.relayout(p,look(p.layout,dark.matches)));
  };
  for(const plot of drawLater)draw(...plot);
  const plots=()=>document.querySelectorAll(".js-plotly-plot");
  dark.addEventListener("change",()=>plots().forEach(p=>Plotly.relayout(p,look(p.layout,dark.matches))));
  document.addEventListener("toggle",e=>e.target.querySelectorAll(".js-plotly-plot")
    .forEach(p=>Plotly.Plots.resize(p)),true);
  // On paper everything is open, light, and as wide as the paper.
  const folded=[];
  addEventListener("beforeprint",()=>{
    for(const block of document.querySelectorAll("details:not([open])")){folded.push(block);block.open=true;}
    plots().forEach(p=>Plotly.relayout(p,{...look(p.layout,false),width:680}));
  });
  addEventListener("afterprint",()=>{
    for(const block of folded.splice(0))block.open=false;
    plots().forEach(p=>Plotly.relayout(p,{...look(p.layout,dark.matches),width:null,autosize:true}));
  });
});
"""


def script_tags(html):
    """What a page with these blocks of HTML has in its head. Blocks call draw(id, figure, config)."""
    types = set(re.findall(r'"type":"([a-z0-9]+)"', html)) - ALWAYS_THERE
    packed = base64.b64encode(gzip.compress(partial_bundle(types).encode(), 9, mtime=0)).decode()
    return (f'<script type="text/plain" id="plot-library">{packed}</script>'
            f"<script>{UNPACK}</script>")


def partial_bundle(types):
    """plotly.js with the core and these kinds of traces; all of it if it is built otherwise."""
    whole = plotly.offline.get_plotlyjs()
    head, modules, main = split(whole)
    if main not in modules:
        return whole
    text, names = modules[main]
    wanted = CORE + [f"./{kind}" for kind in sorted(types) if f"./{kind}" in names]
    loads = ",".join(f"_dereq_({json.dumps(name)})" for name in wanted[1:])
    text = f"var Plotly=_dereq_('./core');Plotly.register([{loads}]);module.exports=Plotly;"
    modules[main] = (text, {name: names[name] for name in wanted})
    body = ",".join(f"{number}:[function(_dereq_,module,exports){{\n{text}\n}},{json.dumps(names)}]"
                    for number, (text, names) in needed(modules, main).items())
    return f"{head}{body}}},{{}},[{main}])({main})\n}});\n"


def split(whole):
    """(text before the first module, {number: (text, {name: number})}, number of the first to run).
    No modules where the text is not as expected."""
    start = MODULE.search(whole)
    head, modules, main, place = whole[:start.start()] if start else "", {}, None, start
    while place:
        end = END.search(whole, place.end())
        if not end:
            return "", {}, None
        modules[int(place[1])] = (whole[place.end():end.start()], json.loads(end[1]))
        main = int(end[2]) if end[2] else None
        place = MODULE.match(whole, end.end())
    return head, modules, main


def needed(modules, main):
    """The modules that `main` loads, directly or not."""
    found, open_ = set(), [main]
    while open_:
        number = open_.pop()
        if number not in found:
            found.add(number)
            open_ += modules[number][1].values()
    return {number: modules[number] for number in sorted(found)}
