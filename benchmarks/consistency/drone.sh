#!/usr/bin/env bash
# Accuracy and consistency along the path of a drone: renders the ground-truth path of EuRoC V1_02_medium, as flown, at four times the
# speed, and its fastest turns with and without motion blur; runs stereo_slam on each and prints its scores. Needs numpy. What is done is not
# done again.
#
#   drone.sh GROUND_TRUTH.csv [OUT]       state_groundtruth_estimate0/data.csv of V1_02_medium; default: out/drone
#
# Environment: STEREO_SLAM: the program (by default that of build/release, which is built); SETTINGS: further arguments of
# `stereo_slam run`, as "--preset fast"; CASES: only these (flown fast turns blurred).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
[ $# -ge 1 ] || { sed -n 's/^# \{0,1\}//p' "$0" >&2; exit 2; }
out=${2:-$root/out/drone}
if [ -z "${STEREO_SLAM:-}" ]; then
  cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
  cmake --build "$root/build/release" --target stereo_slam >/dev/null
  STEREO_SLAM=$root/build/release/examples/stereo_slam/stereo_slam
fi
python3 "$here/drone.py" "$1" "$out"

# one NAME PATH ARGUMENT...: renders, runs and scores one case into OUT/NAME.
one() {
  local name=$1 path=$2 folder=$out/$1
  shift 2
  if [ ! -d "$folder/images" ]; then
    "$STEREO_SLAM" simulate --quiet --format euroc --fps 20 --trajectory "$out/$path.txt" --output "$folder/rendering" "$@"
    mv "$folder/rendering" "$folder/images"
    "$STEREO_SLAM" info --dataset "$folder/images" --write-groundtruth "$folder/truth.tum" >/dev/null
  fi
  # shellcheck disable=SC2086
  "$STEREO_SLAM" run --quiet --overwrite --dataset "$folder/images" --output "$folder/run" ${SETTINGS:-}
  echo "== $name"
  "$STEREO_SLAM" evaluate --groundtruth "$folder/truth.tum" --estimate "$folder/run/trajectory_tum.txt" \
    --covariances "$folder/run/covariances.csv" --loops "$folder/run/loops.csv" 2>/dev/null
}

for name in ${CASES:-flown fast turns blurred}; do
  case $name in
    flown) one flown flown --frames 1600 ;;
    fast) one fast fast --frames 640 ;;
    turns) one turns turns ;;
    blurred) one blurred turns --exposure 15 ;;
    *) echo "$0: no case $name" >&2; exit 2 ;;
  esac
done
