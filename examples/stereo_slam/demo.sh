#!/usr/bin/env bash
# Renders a drive through a synthetic town, runs the stereo SLAM on its images and evaluates the result.
#
#   demo.sh [DIR]       DIR: output folder (default: out/demo)
#
# Environment: FRAMES (300), SCALE (image size relative to KITTI's, 1), STEREO_SLAM (the program; built if not given).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${1:-$root/out/demo}
frames=${FRAMES:-300}
scale=${SCALE:-1}
program=${STEREO_SLAM:-}

if [ -z "$program" ]; then
  "$root/cmake/configure-release.sh"
  cmake --build "$root/build/release" --target stereo_slam
  program=$root/build/release/examples/stereo_slam/stereo_slam
fi

sequence=$out/sequence_${frames}_${scale}
written=$sequence.demo  # stands beside the folder that this script wrote
if [ "$sequence/times.txt" -nt "$program" ] && "$program" info --dataset "$sequence" >/dev/null 2>&1; then
  echo "== The sequence is already rendered: $sequence"
else
  if [ -e "$sequence" ] && [ ! -e "$written" ]; then
    echo "$0: $sequence: exists, and is not of this script; move it, or give another folder" >&2
    exit 1
  fi
  echo "== Rendering $frames stereo frames"
  [ ! -e "$written" ] || rm -rf "$sequence"
  mkdir -p "$out"
  touch "$written"
  "$program" simulate --output "$sequence" --frames "$frames" --scale "$scale"
fi

echo "== The recording"
"$program" info --dataset "$sequence"

echo "== SLAM"
"$program" run --dataset "$sequence" --output "$out/results" --overwrite

echo "== Estimate against ground truth"
"$program" evaluate --groundtruth "$sequence/poses.txt" --estimate "$out/results/trajectory_kitti.txt" \
  --json "$out/results/evaluation.json"

echo "== Files"
echo "report                $out/results/report.html: open it in a browser"
echo "images, ground truth  $sequence"
echo "trajectory            $out/results/trajectory_kitti.txt, trajectory_tum.txt, trajectory_online.txt"
echo "covariances           $out/results/covariances.csv"
echo "landmarks             $out/results/map.ply"
echo "timing, settings      $out/results/timing.csv, run.yaml"
echo "scores                $out/results/evaluation.json"
