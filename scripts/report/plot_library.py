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
  window.draw=function(id,figure,config){Plotly.newPlot(id,figure.data,figure.layout,config);};
  for(const plot of drawLater)draw(...plot);
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
