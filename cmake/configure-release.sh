#!/usr/bin/env bash
# Installs what is missing and configures build/release, which demo.sh and tests/run.sh share. Arguments go to CMake.
# Clang compiles the project in two thirds of GCC's time, so it is installed and used unless CXX in the environment names another
# compiler: CXX=g++ cmake/configure-release.sh, without an older build/release.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

if [ -n "${CXX:-}" ] || command -v clang++ >/dev/null; then
  "$root/cmake/install-dependencies.sh"
else
  "$root/cmake/install-dependencies.sh" clang lld || { "$root/cmake/install-dependencies.sh" && echo "Clang is not to be had here; the build takes longer"; }
fi
if [ -z "${CXX:-}" ] && command -v clang++ >/dev/null; then export CXX=clang++; fi
cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@"
