#!/usr/bin/env bash
# Runs the SLAM on recordings with each preset, with and without loop closure, in turn with the floor (floor.cpp), and writes what came
# out and what it cost: OUT/results.json and OUT/results.md. Prints what became worse than in the baseline, and fails if anything did.
#
#   run.sh [--real FOLDER]... [--rendered FOLDER]... [option]...
#
#   --real FOLDER        recordings in KITTI layout, one a subfolder; 3 cm and 0.1 degrees are allowed for the errors of the ground truth
#   --rendered FOLDER    the same with exact ground truth
#   --preset NAME        may be repeated; default: default, fast, odometry, paper
#   --rounds N           runs of each, of which medians and spreads are taken (3)
#   --max-frames N       of each recording (all)
#   --out DIR            (out/slam)
#   --baseline FILE      results.json of an earlier run (baseline.json beside this script)
#
# Environment: STEREO_SLAM, SLAM_FLOOR: the programs (by default those of build/release, which are built).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

usage() {
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0" >&2
  exit 2
}

recordings=() kinds=() presets=() limit=()
rounds=3
out=$here/../../out/slam
baseline=$here/baseline.json
while [ $# -gt 0 ]; do
  [ $# -ge 2 ] || usage
  case $1 in
    --real | --rendered)
      for recording in "$2"/*/; do
        [ -f "$recording/times.txt" ] || continue
        recordings+=("${recording%/}")
        kinds+=("${1#--}")
      done ;;
    --preset) presets+=("$2") ;;
    --rounds) rounds=$2 ;;
    --max-frames) limit=(--max-frames "$2") ;;
    --out) out=$2 ;;
    --baseline) baseline=$2 ;;
    *) usage ;;
  esac
  shift 2
done
[ ${#recordings[@]} -gt 0 ] || { echo "no recordings: give --real or --rendered a folder of folders in KITTI layout" >&2; exit 2; }
[ ${#presets[@]} -gt 0 ] || presets=(default fast odometry paper)

. "$here/measure.sh"

rm -rf "$out/runs"
for ((round = 1; round <= rounds; ++round)); do
  for i in "${!recordings[@]}"; do
    for preset in "${presets[@]}"; do
      runs=$out/runs/$(basename "${recordings[i]}")
      sigmas=()
      [ "${kinds[i]}" = rendered ] || sigmas=(--truth-sigma-m 0.03 --truth-sigma-deg 0.1)
      echo "round $round: $(basename "${recordings[i]}"), $preset" >&2
      measure "${recordings[i]}" "$runs/$preset/$round" --preset "$preset" "${limit[@]}"
      score "${recordings[i]}" "$runs/$preset/$round" "${sigmas[@]}"
      # A preset without loop closure has nothing to switch off.
      if sed -n '/^  loop_closure:/,/enabled:/p' "$runs/$preset/$round/run.yaml" | grep -q 'enabled: true'; then
        measure "${recordings[i]}" "$runs/$preset, no loops/$round" --preset "$preset" --no-loop-closure "${limit[@]}"
        score "${recordings[i]}" "$runs/$preset, no loops/$round" "${sigmas[@]}"
      fi
    done
  done
done
python3 "$here/summarise.py" "$out/runs" --json "$out/results.json" --table "$out/results.md" --baseline "$baseline"
