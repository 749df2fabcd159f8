#!/usr/bin/env python3
"""Table and plots of the rigs of rigs.sh.

    rigs.py OUT PRESET...

Prints a Markdown table, with means over the drives of a row (in brackets the smallest and the largest), and writes OUT/PRESET.svg: each figure
against the level, a line for every kind of rig.
"""
import collections
import json
import pathlib
import statistics
import sys

import drives

COLUMNS = {  # figure: heading and form
    "ok": ("% of frames OK", "{:.1f}"),
    "ate": ("ATE m", "{:.3f}"),
    "ratio": ("path ratio", "{:.4f}"),
    "inside 1": ("% inside, 1 frame", "{:.0f}"),
    "inside 10": ("10 frames", "{:.0f}"),
    "inside 100": ("100 frames", "{:.0f}"),
}
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf")
PANEL_PX, GAP_PX = 220, 70


def figures(folder, preset):
    """Of one run; without scores if it failed."""
    summary = folder / f"{preset}.json"
    run = json.loads(summary.read_text()) if summary.exists() else {"frames": 0}
    if not run["frames"]:
        return {"ok": 0.0}
    scores = drives.figures(folder / preset) if (folder / preset / "scores.json").exists() else {}
    return scores | {"ok": 100 * run["frames_by_status"].get("OK", 0) / run["frames"]}


def read(out, preset):
    """Figures of all drives by (scene, kind, level)."""
    groups = collections.defaultdict(list)
    for done in sorted(out.glob("*/done")):
        scene, kind, level = done.parent.name.rpartition("-")[0].rsplit("_", 2)
        groups[scene, kind, float(level)].append(figures(done.parent, preset))
    return dict(sorted(groups.items()))


def panel(groups, key, left):
    """One plot of the SVG: the figure `key` against the place of the level in its kind."""
    lines = collections.defaultdict(list)
    for (scene, kind, _), runs in groups.items():
        values = [run[key] for run in runs if key in run]
        lines[scene, kind].append(statistics.mean(values) if values else None)
    every = [value for line in lines.values() for value in line if value is not None] or [0]
    low, high = (0, 100) if key == "ok" or key.startswith("inside") else (min(every), max(every))
    span, steps = (high - low) or 1, max(map(len, lines.values())) - 1 or 1
    yield f'<rect x="{left}" y="{GAP_PX}" width="{PANEL_PX}" height="{PANEL_PX}" fill="none" stroke="#ccc"/>'
    yield f'<text x="{left}" y="{GAP_PX - 8}">{COLUMNS[key][0]}: {low:.4g} to {high:.4g}</text>'
    for colour, line in zip(COLOURS * len(lines), lines.values()):
        points = [
            f"{left + PANEL_PX * i / steps:.1f},{GAP_PX + PANEL_PX * (high - value) / span:.1f}" for i, value in enumerate(line) if value is not None
        ]
        yield f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}"/>'
        yield "".join(f'<circle cx="{x}" cy="{y}" r="3" fill="{colour}"/>' for x, y in (point.split(",") for point in points))


def with_none_first(groups):
    """The undisturbed drives of a scene as level 0 of each of its kinds."""
    none = {(scene, 0.0): runs for (scene, kind, _), runs in groups.items() if kind == "none"}
    rest = {key: runs for key, runs in groups.items() if key[1] != "none"}
    zero = {(scene, kind, 0.0): none[scene, 0.0] for scene, kind, _ in rest if (scene, 0.0) in none}
    return dict(sorted((zero | rest).items()))


def plot(groups, preset):
    groups = with_none_first(groups)
    kinds = list(dict.fromkeys((scene, kind) for scene, kind, _ in groups))
    width, height = len(COLUMNS) * (PANEL_PX + GAP_PX) + GAP_PX, PANEL_PX + 2 * GAP_PX
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="12">']
    parts += [f'<rect width="100%" height="100%" fill="white"/><text x="{GAP_PX}" y="20">{preset}; levels from left to right</text>']
    for i, key in enumerate(COLUMNS):
        parts += panel(groups, key, GAP_PX + i * (PANEL_PX + GAP_PX))
    for i, (colour, name) in enumerate(zip(COLOURS * len(kinds), kinds)):
        parts += [f'<text x="{GAP_PX + 150 * i}" y="{height - 20}" fill="{colour}">{" ".join(name)}</text>']
    return "\n".join([*parts, "</svg>"])


def main(out, presets):
    print("| preset | rig | level | | " + " | ".join(heading for heading, _ in COLUMNS.values()) + " |")
    print("|---" * (len(COLUMNS) + 4) + "|")
    for preset in presets:
        groups = read(out, preset)
        if not groups:
            sys.exit(f"{out}: no rig is done")
        for (scene, kind, level), runs in groups.items():
            cells = [preset, f"{scene} {kind}", f"{level:g}", str(len(runs))]
            cells += [drives.spread(runs, key, form) for key, (_, form) in COLUMNS.items()]
            print("| " + " | ".join(cells) + " |")
        (out / f"{preset}.svg").write_text(plot(groups, preset))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2:])
