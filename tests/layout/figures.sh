#!/usr/bin/env bash
# Prints how much of stereo_slam there is to know: settings, members, the longest function of the algorithm, the files that know
# of the errors of the rig, and how many folders include each folder. docs/architecture.md quotes it.
# Usage: tests/layout/figures.sh      (the longest function needs universal-ctags)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../examples/stereo_slam"
algorithm=(core rig frontend odometry local_map tracking loop_closing inertial slam)

lines() { git ls-files -- "$@" | grep -E '\.(hpp|cpp)$' | xargs cat | wc -l; }

echo "settings: $(grep -c '\.add(' settings/schema.cpp)"
echo "members of Slam and its base: $(cat slam/slam.hpp slam/slam_system.hpp | grep -cE '^  [A-Z]\w+ \w+_;')"
echo "lines of the algorithm: $(lines "${algorithm[@]}")"
echo "lines of the SLAM: $(lines .)"
echo "lines of the library: $(cd ../.. && lines include)"
if command -v ctags >/dev/null; then
  longest=$(../../tests/layout/function_sizes.sh --longest 1 "${algorithm[@]/#/examples/stereo_slam/}" | sed -n 2p)
  echo "longest function of the algorithm: $(awk '{ print $1 " lines, " $3 }' <<<"$longest")"
fi
errors='RectificationEstimator|MotionEvidence|CameraErrors|RightImageMonitor|RightCamera'
know() { grep -rlE "$errors" "$@" | wc -l; }
echo "files of the algorithm that know of the rig's errors: $(know "${algorithm[@]}"), of these outside rig/: $(know --exclude-dir=rig "${algorithm[@]}")"
for folder in */; do
  folder=${folder%/}
  echo "$folder: included by $(grep -lE "#include \"stereo_slam/$folder/" */*.?pp | cut -d/ -f1 | grep -v "^$folder$" | sort -u | wc -l) folders"
done
