#!/usr/bin/env bash
# What a frame costs against the size of the problem: pixels, points that the odometry follows, landmarks, length of the recording.
# Renders small drives, runs each in turn with the floor, and prints a Markdown table with the law that fits.
#
#   sizes.sh [OUT]        default: out/sizes; recordings that are there already are used again
#
# Environment: as in measure.sh; FRAMES (40) of the short drives, LONG (800) of the long one; ROUNDS (3) of which medians are taken.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=${1:-$here/../../out/sizes}
frames=${FRAMES:-40}
long=${LONG:-800}
rounds=${ROUNDS:-3}
. "$here/measure.sh"

# drive SCALE FRAMES: the folder of such a drive, rendered if it is not there.
drive() {
  local folder=$out/recordings/scale_$1_frames_$2
  [ -f "$folder/times.txt" ] && "$program" info --dataset "$folder" >/dev/null 2>&1 || {
    rm -rf "$folder"
    "$program" simulate --quiet --output "$folder" --frames "$2" --scale "$1" --seed 3
  }
  echo "$folder"
}

# measure_all ROUND
measure_all() {
  local recording scale points landmarks share
  for scale in 0.73 1 1.46 2.07 2.93; do
    recording=$(drive "$scale" "$frames")
    measure "$recording" "$out/runs/pixels/$scale/$1"
  done
  recording=$(drive 1 "$frames")
  for points in 100 300 600 1000 2000; do
    echo "odometry: {max_points: $points}" >"$out/settings.yaml"
    measure "$recording" "$out/runs/points/$points/$1" --config "$out/settings.yaml"
  done
  for landmarks in 100 300 600 1000 2000; do
    echo "map: {max_new_landmarks: $landmarks, cell_px: 20}" >"$out/settings.yaml"
    measure "$recording" "$out/runs/landmarks/$landmarks/$1" --config "$out/settings.yaml"
  done
  recording=$(drive 0.4 "$long")
  for share in 8 4 2 1; do
    measure "$recording" "$out/runs/length/$((long / share))/$1" --max-frames $((long / share))
  done
}

rm -rf "$out/runs"
for ((round = 1; round <= rounds; ++round)); do
  measure_all "$round"
done
python3 "$here/sizes.py" "$out/runs"
