#!/usr/bin/env bash
# Builds the SLAM as an archive for shared libraries (some CPU minutes), installs it to a folder, builds examples/python with it, and
# tests the modules. Exit status 77: Debian's pybind11-dev or python3-numpy is not installed.
#
#   tests/python/run.sh [STEREO_SLAM [BUILD_DIR]]
#
# STEREO_SLAM is the program, whose poses the module must have: by default the one in build/release; if there is none, it is built, too.
# BUILD_DIR is build/python by default.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
program=${1:-$root/build/release/examples/stereo_slam/stereo_slam}
build=${2:-$root/build/python}
python=/usr/bin/python3
if ! [ -d /usr/include/pybind11 ] || ! "$python" -c 'import numpy' 2>/dev/null; then
  echo "skipped: apt-get install pybind11-dev python3-dev python3-numpy"
  exit 77
fi
# The same compiler as the program, so that the poses have the same bits.
cmake -S "$root" -B "$build" -G Ninja -D CMAKE_CXX_COMPILER="${CXX:-clang++}" -D CMAKE_BUILD_TYPE=Release -D ANTIPODE_BUILD_TESTS=OFF \
  -D CMAKE_POSITION_INDEPENDENT_CODE=ON >/dev/null
targets=(stereo_slam_library stereo_slam_opencv_codecs)
if [ ! -x "$program" ]; then
  program=$build/examples/stereo_slam/stereo_slam
  targets+=(stereo_slam)
fi
cmake --build "$build" --target "${targets[@]}"
for component in library stereo_slam; do cmake --install "$build" --component "$component" --prefix "$build/prefix" >/dev/null; done
cmake -S "$root/examples/python" -B "$build/module" -G Ninja -D CMAKE_CXX_COMPILER="${CXX:-clang++}" -D CMAKE_BUILD_TYPE=Release \
  -D antipode_ROOT="$build/prefix" >/dev/null
cmake --build "$build/module"
export PYTHONPATH=$build/module STEREO_SLAM=$program PLOT_RUN=$root/examples/python/plot_run.py
"$python" "$root/tests/python/toolkit_test.py"
"$python" "$root/tests/python/module_test.py"
