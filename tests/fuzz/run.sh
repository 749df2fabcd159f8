#!/usr/bin/env bash
# Builds the fuzz targets with Clang and the sanitizers, and runs each of them, one process a core.
# Usage: tests/fuzz/run.sh [SECONDS] [TARGET...]
# SECONDS for each target, 60 without it. TARGET is the name of a folder in tests/fuzz/corpus; without it all run.
# The program is that of the preset asan-ubsan, so that its objects are compiled once for tests and fuzzing.
# Inputs that were found interesting stay in build/fuzz/corpus/TARGET, where the next run begins; inputs that break a claim, hang
# for ten seconds or take a gigabyte are kept as build/fuzz/findings/TARGET-*, and printed. Exit status 1 if there is one.
# Repeat one: build/asan-ubsan/tests/fuzz/fuzz --target=TARGET FILE
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
seconds=${1:-60}
shift || true
[ $# -gt 0 ] || set -- $(ls tests/fuzz/corpus)
for target in "$@"; do
  [ -d "tests/fuzz/corpus/$target" ] || { echo "$0: no target $target; there are: $(ls -m tests/fuzz/corpus)" >&2; exit 2; }
done

[ -f build/asan-ubsan/build.ninja ] || cmake --preset asan-ubsan >/dev/null
cmake --build --preset fuzz
mkdir -p build/fuzz/findings build/fuzz/logs
# Short stacks of allocations and a small quarantine take less time.
export ASAN_OPTIONS=detect_leaks=1:malloc_context_size=2:quarantine_size_mb=8 UBSAN_OPTIONS=print_stacktrace=1

run_target() {
  local log=build/fuzz/logs/$2.log status=0
  mkdir -p "build/fuzz/corpus/$2"
  build/asan-ubsan/tests/fuzz/fuzz "--target=$2" -max_total_time="$1" -timeout=10 -rss_limit_mb=1024 -max_len=8192 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/findings/$2-" "build/fuzz/corpus/$2" "tests/fuzz/corpus/$2" >"$log" 2>&1 || status=$?
  figure() { sed -n "s/^stat::$1: *//p" "$log" | tail -n 1; }
  echo "$2: $(figure number_of_executed_units) executions, $(figure average_exec_per_sec) a second"
  [ "$status" -ne 0 ] || return 0
  echo "$2: FINDING, exit status $status, see $log"
  sed -n 's/.*Test unit written to /  input: /p; s/^  what():/  claim:/p; s/^SUMMARY:/  summary:/p' "$log"
  return 1
}
export -f run_target
printf '%s\n' "$@" | xargs -P "${JOBS:-$(nproc)}" -I{} bash -c 'run_target "$0" {}' "$seconds" || exit 1
