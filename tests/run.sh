#!/usr/bin/env bash
# Installs what is missing, builds all but the benchmarks and runs all tests. Arguments go to ctest. That every header compiles
# alone is left to other builds (ANTIPODE_CHECK_HEADERS): it takes minutes, and each has a test that includes it first. With
# WARNINGS_AS_ERRORS=ON in the environment a warning ends the build.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/release

"$root/cmake/configure-release.sh" -DANTIPODE_BUILD_BENCHMARKS=OFF -DANTIPODE_CHECK_HEADERS=OFF \
  -DANTIPODE_WARNINGS_AS_ERRORS="${WARNINGS_AS_ERRORS:-OFF}"
cmake --build "$build"
ctest --test-dir "$build" --output-on-failure --timeout 900 --parallel "$(nproc)" "$@"
