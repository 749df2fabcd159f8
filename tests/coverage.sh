#!/usr/bin/env bash
# Prints which share of the lines of the library and of stereo_slam the tests execute, by folder, and lists files below 80 %.
# Usage: tests/coverage.sh [TEST-REGEX]: of the tests with such a name, which must be built by the preset `coverage`; without it
# of all, which are built first.
# Needs gcovr (apt-get install gcovr).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
command -v gcovr >/dev/null || { echo "$0: gcovr not found: apt-get install gcovr" >&2; exit 1; }
jobs=${JOBS:-$(nproc)}
if [ $# -eq 0 ]; then
  cmake --preset coverage
  cmake --build --preset coverage --parallel "$jobs"
fi
find build/coverage -name '*.gcda' -delete
# A test may fail here: those that limit the size of files also limit the files of gcov. Its lines are counted.
ctest --preset coverage --parallel "$jobs" --tests-regex "${1:-^(test|example)_|_test$}" || echo "some tests failed"
gcovr --root . --filter include/ --filter examples/stereo_slam/ --exclude-unreachable-branches -j "$jobs" --csv build/coverage/lines.csv \
  build/coverage >/dev/null
awk -F, 'NR > 1 {
    folder = $1
    sub("/[^/]*$", "", folder)
    sub("/detail$", "", folder)
    product = $1 ~ /^include/ ? "include" : "examples/stereo_slam"
    for (name in names) delete names[name]
    names[folder]; names[product " in all"]
    for (name in names) { lines[name] += $2; hit[name] += $3 }
    if ($2 > 0 && $3 < 0.8 * $2) low = low sprintf("  %s: %d of %d lines\n", $1, $3, $2)
  }
  END {
    for (name in lines) printf "%-42s %6d of %6d lines  %5.1f %%\n", name, hit[name], lines[name], 100 * hit[name] / lines[name] | "sort"
    close("sort")
    printf "below 80 %%:\n%s", low
  }' build/coverage/lines.csv
