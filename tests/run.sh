#!/usr/bin/env bash
# Installs what is missing, builds all but the benchmarks and runs all tests. Arguments go to ctest. That every header compiles
# alone is left to other builds (ANTIPODE_CHECK_HEADERS): it takes minutes, and each has a test that includes it first. Large
# headers are precompiled and sources compiled sixteen at a time (a unity build), which hides missing includes; other builds and
# tests/tidy.sh parse each source alone. Clang compiles all this in less than two thirds of GCC's time, so it is used unless CXX in the
# environment names another compiler: CXX=g++ tests/run.sh, without an older build/release. With WARNINGS_AS_ERRORS=ON in the
# environment a warning ends the build.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/release

"$root/cmake/install-dependencies.sh"
if [ -z "${CXX:-}" ]; then
  command -v clang++ >/dev/null || "$root/cmake/install-dependencies.sh" clang || echo "Clang is not to be had here; the build takes longer"
  if command -v clang++ >/dev/null; then export CXX=clang++; fi
fi
linker="" # LLVM's and gold, which is part of GNU's binutils, take a tenth of the time of the usual one
for name in gold lld; do
  if command -v "ld.$name" >/dev/null; then linker=-fuse-ld=$name; fi
done
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DANTIPODE_BUILD_BENCHMARKS=OFF \
  -DANTIPODE_CHECK_HEADERS=OFF -DANTIPODE_PRECOMPILE_HEADERS=ON -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16 \
  -DCMAKE_EXE_LINKER_FLAGS="$linker" \
  -DANTIPODE_WARNINGS_AS_ERRORS="${WARNINGS_AS_ERRORS:-OFF}"
cmake --build "$build"
ctest --test-dir "$build" --output-on-failure --timeout 900 --parallel "$(nproc)" "$@"
