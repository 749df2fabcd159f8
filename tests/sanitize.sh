#!/usr/bin/env bash
# Builds tests with sanitizers and runs them.
# Usage: tests/sanitize.sh [address|thread]...; without arguments both.
# address: all tests, with the address and undefined-behaviour sanitizers (preset asan-ubsan).
# thread: the tests of everything that has threads, with the thread sanitizer (preset tsan). What tests/tsan.supp names is not
# reported.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
[ $# -gt 0 ] || set -- address thread
jobs=${JOBS:-$(nproc)}

for sanitizer in "$@"; do
  case $sanitizer in
    address)
      cmake --preset asan-ubsan -DANTIPODE_BUILD_SLOW_TESTS=ON
      cmake --build --preset asan-ubsan --parallel "$jobs"
      # Other tests build programs of their own, without sanitizers.
      UBSAN_OPTIONS=print_stacktrace=1 ctest --preset asan-ubsan --parallel "$jobs" --tests-regex '^(test|example)_|_test$' ;;
    thread)
      cmake --preset tsan
      cmake --build --preset tsan --parallel "$jobs" --target thread_tests
      TSAN_OPTIONS="suppressions=$root/tests/tsan.supp history_size=7" \
        ctest --preset tsan --parallel "$jobs" --label-regex thread ;;
    *)
      sed -n 's/^# //p' "$0" >&2
      exit 2 ;;
  esac
done
