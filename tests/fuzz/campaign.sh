#!/usr/bin/env bash
# Runs each fuzz target for a number of executions, without the sanitizers (preset fuzz-fast), which takes a third to a tenth of the
# time that tests/fuzz/run.sh needs for as many. One process a core.
# Usage: tests/fuzz/campaign.sh EXECUTIONS [TARGET...]
# TARGET is the name of a folder in tests/fuzz/corpus; without it all run. Each run begins with the inputs that the one before found
# interesting (build/fuzz/corpus). Prints a line a target, and appends it to build/fuzz/campaign.txt.
# Inputs that break a claim, hang for ten seconds or take a gigabyte are kept as build/fuzz/findings/TARGET-*. Exit status 1 if
# there is one.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
[[ ${1:-} =~ ^[1-9][0-9]*$ ]] || { echo "Usage: $0 EXECUTIONS [TARGET...]" >&2; exit 2; }
executions=$1
shift
[ $# -gt 0 ] || set -- $(ls tests/fuzz/corpus)
for target in "$@"; do
  [ -d "tests/fuzz/corpus/$target" ] || { echo "$0: no target $target; there are: $(ls -m tests/fuzz/corpus)" >&2; exit 2; }
done

cmake --preset fuzz-fast >/dev/null
cmake --build --preset fuzz-fast
mkdir -p build/fuzz/findings build/fuzz/logs

run_target() {
  local log=build/fuzz/logs/$2-campaign.log status=0
  mkdir -p "build/fuzz/corpus/$2"
  build/fuzz-fast/tests/fuzz/fuzz "--target=$2" -runs="$1" -timeout=10 -rss_limit_mb=1024 -max_len=8192 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/findings/$2-" "build/fuzz/corpus/$2" "tests/fuzz/corpus/$2" >"$log" 2>&1 || status=$?
  figure() { sed -n "s/^stat::$1: *//p" "$log" | tail -n 1; }
  local result="$2: $(figure number_of_executed_units) executions, $(figure average_exec_per_sec) a second"
  [ "$status" -eq 0 ] || result+=", FINDING, exit status $status, see $log"
  echo "$result" | tee -a build/fuzz/campaign.txt
  return "$((status != 0))"
}
export -f run_target
printf '%s\n' "$@" | xargs -P "${JOBS:-$(nproc)}" -I{} bash -c 'run_target "$0" {}' "$executions" || exit 1
