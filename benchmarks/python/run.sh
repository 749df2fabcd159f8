#!/usr/bin/env bash
# What the Python module adds to the time of a frame: the same images through the same library, in turn from C++ and from Python.
#
#   run.sh RECORDING FX FY CX CY BASELINE_M [ROUNDS]        RECORDING in KITTI layout, with grey images; ROUNDS: 9
#
# Prints the times and their ratio, by the shortest time of each frame, which the load of the machine disturbs least, and fails unless
# the poses are the same. tests/python/run.sh has to have
# been run before: it builds the library and the module. Needs python3-matplotlib.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
[ $# -ge 6 ] || { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0" >&2; exit 2; }
arguments=("${@:1:6}")
rounds=${7:-9}
build=$root/build/python
cmake -S "$root/benchmarks/python" -B "$build/process_time" -G Ninja -D CMAKE_CXX_COMPILER="${CXX:-clang++}" -D CMAKE_BUILD_TYPE=Release \
  -D antipode_ROOT="$build/prefix" >/dev/null
cmake --build "$build/process_time" >/dev/null
export PYTHONPATH=$build/module
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
for ((round = 0; round < rounds; ++round)); do
  "$build/process_time/process_time" "${arguments[@]}" >"$out/cpp_$round"
  /usr/bin/python3 "$root/benchmarks/python/process_time.py" "${arguments[@]}" >"$out/python_$round"
  cmp <(cut -d' ' -f1,2 "$out/cpp_$round") <(cut -d' ' -f1,2 "$out/python_$round")
done
/usr/bin/python3 - "$out" <<'END'
import pathlib, sys
import numpy as np
times = {name: np.array([np.loadtxt(file)[:, 2:] for file in sorted(pathlib.Path(sys.argv[1]).glob(f"{name}_*"))]) for name in ("cpp", "python")}
for i, clock in enumerate(("wall", "CPU")):
    cpp, python = (times[name][:, :, i] for name in ("cpp", "python"))
    smallest = cpp.min(axis=0).mean(), python.min(axis=0).mean()
    ratios = np.sort(python.mean(axis=1) / cpp.mean(axis=1))
    print(f"{clock}: shortest of {len(cpp)} rounds, mean of {cpp.shape[1]} frames: {smallest[0]:.3f} ms in C++, {smallest[1]:.3f} ms in Python, ratio "
          f"{smallest[1] / smallest[0]:.4f}; ratios of the rounds: median {np.median(ratios):.4f}, {ratios[0]:.4f} to {ratios[-1]:.4f}")
END
