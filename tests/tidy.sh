#!/usr/bin/env bash
# Runs clang-tidy with the checks of .clang-tidy; ends with 1 where it finds something.
# Usage: tests/tidy.sh [--most N] [--] [FILE...]
# FILE is a source, or a header of include/ or examples/, which is checked through a source that includes it. Without FILE all
# sources of examples/ and tests/ are checked, a quarter to half a minute each (docs/results/build.md).
# --most checks N sources and names the others. With -- and no FILE it checks nothing.
# It configures a build folder of its own for the list of compile commands, but builds nothing.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/tidy
cd "$root"
most=100000
if [ "${1:-}" = --most ]; then
  most=${2:?--most needs a number}
  shift 2
fi
all=true
if [ "${1:-}" = -- ]; then
  all=false
  shift
fi
command -v clang-tidy >/dev/null || { echo "$0: clang-tidy not found: apt-get install clang-tidy" >&2; exit 1; }

# The source to check a file by: itself, that of the same name, or the first that includes it.
source_for() {
  case $1 in
    *.cpp) echo "$1" ;;
    *.hpp)
      if [ -f "${1%.hpp}.cpp" ]; then
        echo "${1%.hpp}.cpp"
      else
        local included=${1#include/}
        git grep -lF -e "${included#examples/}" -- 'examples/*.cpp' 'tests/*.cpp' | sed -n 1p || true
      fi ;;
  esac
}

if [ $# -eq 0 ] && $all; then
  mapfile -t sources < <(git ls-files 'examples/*.cpp' 'tests/*.cpp')
else
  mapfile -t sources < <(for file in "$@"; do source_for "$file"; done | sort -u)
fi
[ ${#sources[@]} -gt 0 ] || exit 0
for source in "${sources[@]:$most}"; do echo "tidy: $source is left out (--most $most)"; done
sources=("${sources[@]:0:$most}")

# clang-tidy is to see each source alone.
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DANTIPODE_QUICK_BUILD=OFF -DANTIPODE_CHECK_HEADERS=OFF \
  -DANTIPODE_BUILD_BENCHMARKS=OFF >/dev/null
listed() { grep -qF "\"$root/$1\"" "$build/compile_commands.json"; }
for source in "${sources[@]}"; do
  if listed "$source"; then printf '%s\0' "$source"; else echo "tidy: $source is not built here, left out" >&2; fi
done | xargs -0 -r -n 1 -P "$(nproc)" sh -c 'echo "tidy: $1"; exec clang-tidy --quiet -p "$0" "$1"' "$build"
