// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace stereo_slam::report {

/// The report's style sheet: light and dark, wide and narrow. Charts take colours by class: c0 ... c7 series,
/// ok weak lost relocalised the path, loop, sigma, landmarks.
inline constexpr std::string_view kStyle = R"css(
:root {
  --page: #f4f5f7; --card: #fff; --ink: #1c2430; --muted: #626d7c; --rule: #e3e6ea; --dots: #aab4c0;
  --blue: #2f6fde; --orange: #e0771a; --green: #15966b; --pink: #c0409c; --violet: #7d5bd0; --ochre: #b58b00;
  --red: #cf3a44; --slate: #6c8296;
  color-scheme: light dark;
}
@media (prefers-color-scheme: dark) {
  :root {
    --page: #0f1317; --card: #181d23; --ink: #e6eaef; --muted: #97a3b1; --rule: #2b323b; --dots: #4d5966;
    --blue: #6fa8ff; --orange: #ffa14f; --green: #45cfa0; --pink: #f085d0; --violet: #b59bff; --ochre: #e2c044;
    --red: #ff7d87; --slate: #93a8bb;
  }
}
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1160px; padding: 28px 20px 40px; background: var(--page); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
h1 { margin: 0; font-size: 26px; line-height: 1.25; overflow-wrap: anywhere; }
h2 { margin: 0 0 8px; font-size: 17px; }
h3 { margin: 0; font-size: 15px; }
header p { margin: 2px 0 0; color: var(--muted); overflow-wrap: anywhere; }
.error { margin: 14px 0 0; padding: 10px 14px; border-left: 4px solid var(--red); background: var(--card); color: var(--ink); }
dl.facts { display: grid; grid-template-columns: repeat(8, minmax(0, 1fr)); gap: 10px; margin: 18px 0; }
dl.facts div { padding: 10px 14px; border-radius: 10px; background: var(--card); }
dt { color: var(--muted); font-size: 13px; }
dd { margin: 0; font-size: 20px; font-weight: 600; line-height: 1.35; font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
dd small { display: block; color: var(--muted); font-size: 12.5px; font-weight: 400; }
.finished { color: var(--green); } .interrupted { color: var(--orange); } .failed { color: var(--red); }
main { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 16px; }
section { padding: 16px 18px; border-radius: 10px; background: var(--card); }
section.wide { grid-column: 1 / -1; }
section > p { margin: 8px 0 0; color: var(--muted); font-size: 13.5px; }
figure { margin: 0; }
.empty { color: var(--muted); }
ul.legend { display: flex; flex-wrap: wrap; gap: 2px 14px; margin: 4px 0 6px; padding: 0; list-style: none; color: var(--muted);
  font-size: 13px; }
ul.legend i { display: inline-block; width: 14px; height: 4px; margin-right: 6px; border-radius: 2px; vertical-align: middle;
  background: var(--c); }
.c0 { --c: var(--blue); } .c1 { --c: var(--orange); } .c2 { --c: var(--green); } .c3 { --c: var(--pink); }
.c4 { --c: var(--violet); } .c5 { --c: var(--ochre); } .c6 { --c: var(--red); } .c7 { --c: var(--slate); }
.ink, .level, .mark { --c: var(--ink); }
.ok { --c: var(--blue); } .weak { --c: var(--orange); } .lost { --c: var(--red); } .relocalised { --c: var(--ochre); }
.initializing { --c: var(--slate); }
.loop, .ring { --c: var(--green); } .refused { --c: var(--pink); }
.sigma { --c: var(--violet); } .landmarks, .dot { --c: var(--dots); } .uncorrected { --c: var(--muted); }
.disc, .square { --c: var(--ink); }
ul.legend .faint { height: 10px; opacity: .25; }
ul.legend .level, ul.legend .uncorrected { height: 0; border-top: 2px dashed var(--c); border-radius: 0; background: none; }
ul.legend .mark { width: 2px; height: 9px; }
ul.legend .disc, ul.legend .dot { width: 9px; height: 9px; border-radius: 50%; }
ul.legend .dot { width: 4px; height: 4px; }
ul.legend .square { width: 8px; height: 8px; border-radius: 0; }
ul.legend .ring { width: 10px; height: 10px; border: 2px solid var(--c); border-radius: 50%; background: none; }
ul.legend .sigma { width: 14px; height: 9px; border: 1.5px solid var(--c); border-radius: 50%; background: none; }
svg { display: block; width: 100%; height: auto; }
svg text { fill: var(--muted); font-size: 12.5px; font-variant-numeric: tabular-nums; }
svg text.end { text-anchor: end; } svg text.middle { text-anchor: middle; }
svg path, svg ellipse, svg circle { vector-effect: non-scaling-stroke; }
.grid { fill: none; stroke: var(--rule); }
.line { fill: none; stroke: var(--c); stroke-width: 1.5; stroke-linecap: round; stroke-linejoin: round; }
.line.ink { stroke-width: 1; opacity: .5; }
.area { fill: var(--c); opacity: .85; stroke: none; }
.band { fill: var(--c); opacity: .2; stroke: none; }
path.level { fill: none; stroke: var(--c); stroke-width: 1.5; stroke-dasharray: 5 4; }
path.mark { stroke: var(--c); stroke-width: 1.5; }
.top-view svg text { font-size: 9px; }
path.landmarks { fill: none; stroke: var(--c); stroke-width: 1.6; stroke-linecap: round; opacity: .75; }
.track { fill: none; stroke: var(--c); stroke-width: 2.4; stroke-linecap: round; stroke-linejoin: round; }
.track.weak, .track.lost, .track.relocalised { stroke-width: 4; }
.track.uncorrected { stroke-width: 1.3; stroke-dasharray: 5 4; }
ellipse.sigma { fill: none; stroke: var(--c); stroke-width: 1.4; }
.loop path, .loop circle { fill: none; stroke: var(--c); stroke-width: 1.5; }
.loop path { stroke-width: 1; }
.loop circle { fill: var(--card); }
.end-mark { fill: var(--ink); stroke: var(--card); stroke-width: 1.5; }
.scroll { max-height: 268px; overflow: auto; }
table { width: 100%; border-collapse: collapse; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th { position: sticky; top: 0; padding: 4px 8px; background: var(--card); color: var(--muted); font-weight: 500; text-align: right; }
td { padding: 3px 8px; border-top: 1px solid var(--rule); text-align: right; }
th:last-child, td:last-child { text-align: left; }
td.refused { color: var(--c); }
footer { margin-top: 22px; color: var(--muted); font-size: 13px; overflow-wrap: anywhere; }
@media (max-width: 1120px) { dl.facts { grid-template-columns: repeat(4, minmax(0, 1fr)); } }
@media (max-width: 760px) {
  body { padding: 18px 12px 28px; }
  main { grid-template-columns: minmax(0, 1fr); gap: 12px; }
  section { padding: 14px 12px; }
  dl.facts { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 8px; }
  svg text { font-size: 17px; }
  .top-view svg text { font-size: 22px; }
}
)css";

}  // namespace stereo_slam::report
