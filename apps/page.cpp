#include "apps/page.hpp"

#include "apps/svg_plot.hpp"

namespace stairwell::apps {

namespace {

constexpr const char* kStyle = R"(<style>
:root{--paper:#fbfcfe;--ink:#222b38;--soft:#5c6878;--rule:#dde3ec;--card:#fff;--bar:#3f7fbf;
--c0:#d55e00;--c1:#1667b8;--c2:#c23c8b;--c3:#4b5563;--c4:#c98a00;--c5:#00855f;--c6:#3fa7d6;--c7:#7a5cc0}
@media (prefers-color-scheme:dark){:root{--paper:#12161c;--ink:#e3e8ef;--soft:#9aa6b5;--rule:#2b333e;--card:#1a2029;--bar:#5b9bd9;
--c0:#ff8a3d;--c1:#5aa6f0;--c2:#ef7fbd;--c3:#c3cad4;--c4:#f0bb45;--c5:#3cc79c;--c6:#7fd0f2;--c7:#b49cf0}}
*{box-sizing:border-box}body{margin:0 auto;max-width:1320px;padding:1rem;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,sans-serif}h1{font-size:1.5rem;margin:.4rem 0}h2{font-size:1.15rem;margin:1.6rem 0 .6rem}
.key{display:flex;flex-wrap:wrap;gap:.6rem}.key div{background:var(--card);border:1px solid var(--rule);border-radius:.5rem;
padding:.5rem .9rem;min-width:8rem;flex:1}.key b{display:block;font-size:1.25rem}.key span,figcaption,.legend{color:var(--soft)}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,26rem),1fr));gap:1rem}
figure{margin:0;background:var(--card);border:1px solid var(--rule);border-radius:.5rem;padding:.6rem}
svg,img{width:100%;height:auto;display:block}svg text{fill:var(--soft);font:12px system-ui,sans-serif}
.grid{stroke:var(--rule)}.line{fill:none;stroke-width:1.6;stroke-linejoin:round}.bar{fill:var(--bar)}
.legend{margin:.3rem 0 0;font-size:.9rem}.legend i{display:inline-block;width:1.1em;height:.28em;margin:0 .35em .2em .6em}
.scroll{overflow-x:auto}table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:.25rem .6rem;
border-bottom:1px solid var(--rule);vertical-align:top;overflow-wrap:anywhere}td+td{font-variant-numeric:tabular-nums}
.two{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1rem}
pre{background:var(--card);border:1px solid var(--rule);border-radius:.5rem;padding:.7rem;overflow-x:auto;font-size:.85rem;margin:0}
.band{opacity:.18;stroke:none}.whisker{stroke:var(--ink);stroke-width:1.4}.dot{fill:var(--bar)}
path.s0{stroke:var(--c0)}path.s1{stroke:var(--c1)}path.s2{stroke:var(--c2)}path.s3{stroke:var(--c3)}
path.s4{stroke:var(--c4)}path.s5{stroke:var(--c5)}path.s6{stroke:var(--c6)}path.s7{stroke:var(--c7)}
path.band.s0{fill:var(--c0)}path.band.s1{fill:var(--c1)}path.band.s2{fill:var(--c2)}path.band.s3{fill:var(--c3)}
path.band.s4{fill:var(--c4)}path.band.s5{fill:var(--c5)}path.band.s6{fill:var(--c6)}path.band.s7{fill:var(--c7)}
i.s0{background:var(--c0)}i.s1{background:var(--c1)}i.s2{background:var(--c2)}i.s3{background:var(--c3)}
i.s4{background:var(--c4)}i.s5{background:var(--c5)}i.s6{background:var(--c6)}i.s7{background:var(--c7)}
</style>)";

}  // namespace

std::string open_page(std::string_view title) {
  const std::string text = escape_html(title);
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
         "<meta name=\"color-scheme\" content=\"light dark\"><title>" +
         text + "</title>" + kStyle + "</head><body><h1>" + text + "</h1>\n";
}

}  // namespace stairwell::apps
