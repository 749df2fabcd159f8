#!/usr/bin/env bash
# The consistency of the whole SLAM: renders twenty drives, runs stereo_slam on each, and prints a Markdown table of how many poses
# lie within the 95 % bound of their covariances. Two drives at a time; what is done is not done again.
#
#   drives.sh [OUT]       default: out/drives; images are deleted after their run, unless KEEP_IMAGES=1
#
# Environment: STEREO_SLAM: the program (by default that of build/release, which is built); JOBS: drives at a time (2);
# SETTINGS: further arguments of `stereo_slam run`, as "--preset fast".
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${1:-$root/out/drives}
if [ -z "${STEREO_SLAM:-}" ]; then
  cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
  cmake --build "$root/build/release" --target stereo_slam >/dev/null
  STEREO_SLAM=$root/build/release/examples/stereo_slam/stereo_slam
fi
export STEREO_SLAM SETTINGS=${SETTINGS:-} KEEP_IMAGES=${KEEP_IMAGES:-}

# NAME ARGUMENTS of `stereo_slam simulate`. The name up to the hyphen is the row of the table.
drives() {
  local seed error
  for seed in 1 2 3 4 5 6; do echo "town-$seed --frames 200 --seed $seed"; done
  for error in 0.1 0.3 1; do
    for seed in 7 8; do echo "town_${error}px-$seed --frames 200 --seed $seed --rectification-error $error"; done
  done
  for seed in 1 2 3; do echo "highway-$seed --scene highway --frames 150 --seed $seed"; done
  echo "highway_0.3px-4 --scene highway --frames 150 --seed 4 --rectification-error 0.3"
  for seed in 1 2 3 4; do echo "two_laps_half_size-$seed --frames 400 --scale 0.5 --seed $seed"; done
}

# one OUT NAME ARGUMENT...: renders, runs and scores one drive into OUT/NAME.
one() {
  local folder=$1/$2 name=$2
  shift 2
  [ ! -f "$folder/scores.json" ] || return 0
  rm -rf "$folder"
  "$STEREO_SLAM" simulate --quiet --threads 1 --output "$folder/images" "$@"
  # shellcheck disable=SC2086
  "$STEREO_SLAM" run --quiet --threads 1 --dataset "$folder/images" --output "$folder/run" $SETTINGS
  "$STEREO_SLAM" evaluate --groundtruth "$folder/images/poses.txt" --estimate "$folder/run/trajectory_kitti.txt" \
    --covariances "$folder/run/covariances.csv" --json "$folder/scores.json" >/dev/null
  [ -n "$KEEP_IMAGES" ] || rm -rf "$folder/images" "$folder/run/map.ply" "$folder/run/report.html"
  echo "$name" >&2
}
export -f one

mkdir -p "$out"
drives | xargs -P "${JOBS:-2}" -L 1 bash -c 'one "$0" "$@"' "$out"
python3 "$here/drives.py" "$out"
