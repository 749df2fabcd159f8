#!/usr/bin/env bash
# Builds and runs the micro-benchmarks and prints one Markdown table for each: mean time and its standard deviation.
# Arguments go to the programs: "[fit]" --benchmark-samples 30, say.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/release

"$root/cmake/install-dependencies.sh"
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DANTIPODE_BUILD_BENCHMARKS=ON >/dev/null
benchmarks=(bench_dual_quaternion bench_bingham bench_sampling bench_filters bench_least_squares bench_mixtures bench_map_file
  bench_pose_graph)
cmake --build "$build" --target "${benchmarks[@]}" >/dev/null

commit=$(git -C "$root" rev-parse --short HEAD 2>/dev/null || echo unknown)
printf '%s, %s, commit %s\n' "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1)" \
  "$(c++ --version | head -1)" "$commit"
for benchmark in "${benchmarks[@]}"; do
  printf '\n### %s\n| | mean | standard deviation |\n|---|---|---|\n' "$benchmark"
  "$build/benchmarks/$benchmark" --reporter xml "$@" | awk '
    function attribute(name,   text) {
      text = $0
      if (!sub(".*[ <]" name "=\"", "", text)) return ""
      sub("\".*", "", text)
      gsub("&lt;", "<", text); gsub("&gt;", ">", text); gsub("&amp;", "\\&", text)
      return text
    }
    function time(text,   ns) {
      ns = text + 0
      if (ns < 1e3) return sprintf("%.3g ns", ns)
      if (ns < 1e6) return sprintf("%.3g us", ns / 1e3)
      return sprintf("%.3g ms", ns / 1e6)
    }
    /<BenchmarkResults /       { name = attribute("name") }
    /<mean value=/             { mean = attribute("value") }
    /<standardDeviation value=/ { printf "| %s | %s | %s |\n", name, time(mean), time(attribute("value")) }'
done
