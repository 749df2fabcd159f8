#!/usr/bin/env bash
# What reading a large bag costs: the time to its first frame, the time of a frame, and the memory. See docs/results/bags.md.
#
#   bags.sh RECORDING [OUT [GIGABYTES [OTHERS]]]        OUT: out/bags; 4; 6 other messages of 300 kB after each image
#
# RECORDING is in KITTI layout. The bags stay in OUT, 10 GB by default. Environment: BUILD, the folder of the build (build/release).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
[ $# -ge 1 ] || { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0" >&2; exit 2; }
recording=$1 out=${2:-$root/out/bags} gigabytes=${3:-4} others=${4:-6}
build=${BUILD:-$root/build/release}
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$build" --target stereo_slam bag_of_recording reading_time >/dev/null
program=$build/examples/stereo_slam/stereo_slam
mkdir -p "$out"
for compression in none lz4 zstd; do
  bag=$out/$compression.mcap
  [ -f "$bag" ] || "$build/benchmarks/slam/bag_of_recording" "$recording" "$bag" "$compression" "$gigabytes" "$others"
  echo "$compression: $(stat -c %s "$bag") bytes"
  for round in 1 2 3; do
    TIMEFORMAT="  run --max-frames 1: %R s, CPU %U + %S s"
    time "$program" run --quiet --dataset "$bag" --output "$out/run" --overwrite --max-frames 1
  done
  "$build/benchmarks/slam/reading_time" "$bag" | sed 's/^/  /'
done
