#!/usr/bin/env bash
# Runs two builds of stereo_slam on the same recordings and fails unless their results are the same to the bit.
#
#   bit_identity.sh BEFORE AFTER [RECORDING...]
#
# BEFORE, AFTER: two stereo_slam programs. RECORDING: folders to run on; without them KITTI 06 and EuRoC V1_01 below
# $ANTIPODE_DATA_DIR (by default ../shared/data beside the project) and a rendered drive that closes loops, which BEFORE renders
# once. Everything goes into $OUT (a temporary folder by default; one that is kept saves the rendering and the runs of BEFORE).
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
before=$1
after=$2
shift 2
data=${ANTIPODE_DATA_DIR:-$root/../shared/data}
out=${OUT:-$(mktemp -d)}
mkdir -p "$out"

if [ $# -eq 0 ]; then
  loop=$out/rendered_loop
  [ -f "$loop/poses.txt" ] || "$before" simulate --output "$loop" --frames 400 --scale 0.4 --quiet
  set -- "$loop"
  for recording in "$data/kitti/06_0000-0050" "$data/euroc/V1_01_easy_first12"; do
    if [ -d "$recording" ]; then set -- "$@" "$recording"; else echo "not there, left out: $recording"; fi
  done
fi

failed=0
for recording in "$@"; do
  for preset in default fast odometry paper; do
    results=$out/$(basename "$recording")_$preset
    if [ ! "${results}_before/covariances.csv" -nt "$before" ]; then
      rm -rf "${results}_before"
      "$before" run --dataset "$recording" --preset "$preset" --output "${results}_before" --quiet 2>"${results}_before.log"
    fi
    rm -rf "${results}_after"
    "$after" run --dataset "$recording" --preset "$preset" --output "${results}_after" --quiet 2>"${results}_after.log"
    for file in trajectory_kitti.txt covariances.csv trajectory_online.txt loops.csv; do
      [ -f "${results}_before/$file" ] || continue
      # Without the reasons, the last column of covariances.csv, which earlier programs do not write.
      if cmp <(cut -d, -f-50 "${results}_before/$file") <(cut -d, -f-50 "${results}_after/$file"); then
        echo "identical: $(basename "$recording") $preset $file"
      else
        failed=1
      fi
    done
  done
done
exit $failed
