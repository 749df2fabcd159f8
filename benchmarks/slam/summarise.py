#!/usr/bin/env python3
"""Summarises the runs of run.sh: medians over the rounds as JSON and as Markdown tables, and what is worse than a baseline.

    summarise.py RUNS --json FILE --table FILE [--baseline FILE]

RUNS/RECORDING/CONFIGURATION/ROUND holds the results of `stereo_slam run`, floor.json and, with ground truth, scores.json. Ends with
status 1 if something became worse by more than its noise.
"""
import argparse
import csv
import json
import pathlib
import re
import statistics
import sys

# What is compared with the baseline: whether larger is better, the relative and the absolute change that are not worth a word. Accuracy is
# the same to the bit on one machine, but small changes move single figures; times are compared as ratios to the floor only.
COMPARED = {
    "t_rel_100_800_percent": (False, 0.05, 0.005),
    "t_rel_10_50_percent": (False, 0.05, 0.005),
    "r_rel_deg_per_100m": (False, 0.05, 0.01),
    "ate_m": (False, 0.05, 0.002),
    "ate_similarity_m": (False, 0.05, 0.002),
    "length_error_percent": (False, 0.05, 0.02),
    "rpe_m": (False, 0.05, 0.0002),
    "nees_inside_1": (True, 0.0, 0.02),
    "nees_inside_10": (True, 0.0, 0.02),
    "nees_inside_100": (True, 0.0, 0.02),
    "median_to_floor": (False, 0.1, 0.0),
    "p95_to_floor": (False, 0.15, 0.0),
    "cpu_to_floor": (False, 0.1, 0.0),
    "peak_mb": (False, 0.05, 2.0),
}


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))]


def accuracy(scores):
    """The figures of an evaluation; None where there is no such score."""
    def score(name, member):
        return (scores.get(name) or {}).get(member)

    ratio = scores["path_ratio"]
    similarity = scores["similarity_aligned"]
    short = score("segments_10_50_m", "r_rel_deg_per_100m")
    figures = {
        "t_rel_100_800_percent": score("kitti", "t_rel_percent"),
        "t_rel_10_50_percent": score("segments_10_50_m", "t_rel_percent"),
        "r_rel_deg_per_100m": score("kitti", "r_rel_deg_per_100m") or short,
        "ate_m": scores["ate_se3_aligned_m"]["rmse"],
        "ate_similarity_m": similarity["ate_m"]["rmse"] if similarity else None,
        "path_ratio": ratio,
        "length_error_percent": abs(ratio - 1) * 100 if ratio is not None else None,
        "rpe_m": scores["rpe_1_frame"]["translation_m"]["rmse"],
    }
    for nees in scores["nees"]["relative_nees"]:
        figures[f"nees_inside_{nees['frames']}"] = nees.get("share_inside_95")
    return figures


def cost(folder):
    """What a frame cost. CPU time without reading the images, like the floor's."""
    with open(folder / "timing.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    floor = json.loads((folder / "floor.json").read_text())
    total = [float(row["total_ms"]) for row in rows]
    cpu_ms = statistics.fmean(float(row["cpu_ms"]) - float(row["read_cpu_ms"]) for row in rows)
    peak = re.search(r"peak_mb: ([\d.]+)", (folder / "run.yaml").read_text())
    figures = {
        "frames": len(rows),
        "median_ms": statistics.median(total),
        "p95_ms": quantile(total, 0.95),
        "max_ms": max(total),
        "cpu_ms": cpu_ms,
        "floor_ms": floor["wall_ms"]["frame"],
        "floor_cpu_ms": floor["cpu_ms"]["frame"],
        "median_to_floor": statistics.median(total) / floor["wall_ms"]["frame"],
        "p95_to_floor": quantile(total, 0.95) / floor["wall_ms"]["frame"],
        "cpu_to_floor": cpu_ms / floor["cpu_ms"]["frame"],
        "peak_mb": float(peak.group(1)) if peak else None,
    }
    for stage in rows[0]:
        if stage.endswith("_ms") and stage not in ("total_ms", "cpu_ms", "read_cpu_ms"):
            figures["stage_" + stage] = statistics.median(float(row[stage]) for row in rows)
    return figures


def figures_of(folder):
    figures = cost(folder)
    scores = folder / "scores.json"
    if scores.exists():
        figures.update(accuracy(json.loads(scores.read_text())))
    return figures


def over_rounds(rounds):
    """Median and spread (largest minus smallest) of every figure."""
    summary = {}
    for name in rounds[0]:
        values = [r[name] for r in rounds]
        known = [v for v in values if v is not None]
        summary[name] = {"median": statistics.median(known), "spread": max(known) - min(known)} if known else None
    return summary


def summarise(runs):
    results = {}
    for configuration in sorted(p for p in runs.glob("*/*") if p.is_dir()):
        rounds = [figures_of(folder) for folder in sorted(configuration.iterdir())]
        results.setdefault(configuration.parent.name, {})[configuration.name] = over_rounds(rounds)
    return results


def table(results, recording, columns):
    if columns == "stages":
        stages = dict.fromkeys(n for figures in results[recording].values() for n in figures if n.startswith("stage_"))
        columns = [(name[len("stage_"):-len("_ms")], name, ".2f") for name in stages]
    lines = ["| " + " | ".join(["configuration", *(title for title, _, _ in columns)]) + " |", "|---" * (len(columns) + 1) + "|"]
    for configuration, figures in results[recording].items():
        cells = [configuration]
        for _, name, form in columns:
            figure = figures.get(name)
            cells.append(format(figure["median"], form) if figure else "-")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


ACCURACY = [("t_rel % 10-50 m", "t_rel_10_50_percent", ".3f"), ("t_rel % 100-800 m", "t_rel_100_800_percent", ".3f"),
            ("r_rel deg/100 m", "r_rel_deg_per_100m", ".3f"), ("ATE m, SE(3)", "ate_m", ".3f"),
            ("ATE m, similarity", "ate_similarity_m", ".3f"), ("path ratio", "path_ratio", ".4f"), ("RPE m", "rpe_m", ".4f"),
            ("inside 95 %: 1 frame", "nees_inside_1", ".0%"), ("10", "nees_inside_10", ".0%"), ("100", "nees_inside_100", ".0%")]
COST = [("median ms", "median_ms", ".1f"), ("95 %", "p95_ms", ".1f"), ("max", "max_ms", ".1f"), ("CPU ms", "cpu_ms", ".1f"),
        ("floor ms", "floor_ms", ".1f"), ("floor CPU ms", "floor_cpu_ms", ".1f"), ("median / floor", "median_to_floor", ".2f"),
        ("95 % / floor", "p95_to_floor", ".2f"), ("CPU / floor", "cpu_to_floor", ".2f"), ("peak MB", "peak_mb", ".0f")]


def markdown(results):
    parts = []
    for recording in results:
        parts.append(f"### {recording}\n" + table(results, recording, ACCURACY))
        parts.append(table(results, recording, COST))
        parts.append("Median ms of each stage:\n\n" + table(results, recording, "stages"))
    return "\n\n".join(parts) + "\n"


def became_worse(results, baseline):
    """One line for every figure that is worse than in the baseline by more than the noise of both."""
    worse = []
    for recording, configurations in results.items():
        for configuration, figures in configurations.items():
            before = baseline.get(recording, {}).get(configuration, {})
            for name, (larger_is_better, relative, absolute) in COMPARED.items():
                old, new = before.get(name), figures.get(name)
                if not old or not new:
                    continue
                loss = (old["median"] - new["median"]) * (1 if larger_is_better else -1)
                if loss > max(relative * abs(old["median"]), absolute, old["spread"] + new["spread"]):
                    worse.append(f"{recording}, {configuration}: {name} was {old['median']:.4g}, is {new['median']:.4g}")
    return worse


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path, required=True)
    parser.add_argument("--table", type=pathlib.Path, required=True)
    parser.add_argument("--baseline", type=pathlib.Path)
    arguments = parser.parse_args()
    results = summarise(arguments.runs)
    arguments.json.write_text(json.dumps(results, indent=1) + "\n")
    arguments.table.write_text(markdown(results))
    print(markdown(results))
    if not (arguments.baseline and arguments.baseline.exists()):
        return 0
    worse = became_worse(results, json.loads(arguments.baseline.read_text()))
    print("\n".join(["Worse than the baseline:", *worse]) if worse else "Nothing is worse than in the baseline.")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
