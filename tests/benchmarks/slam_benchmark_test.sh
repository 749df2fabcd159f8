#!/usr/bin/env bash
# benchmarks/slam/run.sh on a small rendered drive: its files contain what they should, and a figure that became worse is reported.
#
#   slam_benchmark_test.sh STEREO_SLAM SLAM_FLOOR WORK_DIR
set -euo pipefail
scripts=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../benchmarks/slam" && pwd)
export STEREO_SLAM=$1 SLAM_FLOOR=$2
work=$3

fail() {
  echo "$1" >&2
  exit 1
}

# expect_status STATUS COMMAND...
expect_status() {
  local expected=$1 status=0
  shift
  "$@" >"$work/printed" 2>&1 || status=$?
  [ "$status" -eq "$expected" ] || { cat "$work/printed" >&2; fail "status $status instead of $expected: $*"; }
}

rm -rf "$work"
mkdir -p "$work/rendered"
expect_status 2 "$scripts/run.sh"
expect_status 2 "$scripts/run.sh" --rendered "$work/rendered"
expect_status 2 "$scripts/run.sh" --no-such-option 1
expect_status 2 "$SLAM_FLOOR"
expect_status 1 "$SLAM_FLOOR" "$work/none"
if ! python3 --version >/dev/null 2>&1; then
  echo "skipped: no python3"
  exit 0
fi

"$STEREO_SLAM" simulate --quiet --output "$work/rendered/drive" --frames 24 --scale 0.3
summarise=(python3 "$scripts/summarise.py" "$work/out/runs" --json "$work/again.json" --table "$work/again.md")
expect_status 0 "$scripts/run.sh" --rendered "$work/rendered" --preset default --preset odometry --rounds 2 --max-frames 20 \
  --out "$work/out" --baseline "$work/none.json"
expect_status 0 "${summarise[@]}" --baseline "$work/out/results.json"
grep -q "Nothing is worse" "$work/printed" || fail "the same runs are called worse"

python3 - "$work" <<'EOF'
import json, pathlib, sys

work = pathlib.Path(sys.argv[1])
results = json.loads((work / "out/results.json").read_text())
assert list(results) == ["drive"], list(results)
assert sorted(results["drive"]) == ["default", "default, no loops", "odometry"], list(results["drive"])
for configuration, figures in results["drive"].items():
    for name in ("t_rel_10_50_percent", "ate_m", "ate_similarity_m", "path_ratio", "rpe_m", "nees_inside_1", "nees_inside_10", "median_ms",
                 "p95_ms", "max_ms", "cpu_ms", "floor_ms", "floor_cpu_ms", "median_to_floor", "cpu_to_floor", "peak_mb", "stage_images_ms"):
        assert figures[name]["median"] > 0, (configuration, name)
        assert figures[name]["spread"] >= 0, (configuration, name)
    assert figures["frames"]["median"] == 20
    assert figures["ate_m"]["spread"] == 0, "two rounds differ"
    assert figures["t_rel_100_800_percent"] is None, "the drive is short"
    assert figures["nees_inside_100"] is None, "the drive is short"
table = (work / "out/results.md").read_text()
columns = 0
for line in table.splitlines():
    if line.startswith("|"):
        assert columns in (0, line.count("|")), line
    columns = line.count("|")
assert "### drive" in table and "| default, no loops |" in table and "median / floor" in table

results["drive"]["default"]["ate_m"]["median"] /= 2
results["drive"]["odometry"]["nees_inside_10"]["median"] += 0.5
results["drive"]["odometry"]["path_ratio"]["median"] *= 2  # a figure that is not compared
(work / "better.json").write_text(json.dumps(results))
EOF

expect_status 1 "${summarise[@]}" --baseline "$work/better.json"
[ "$(grep -c ' was .*, is ' "$work/printed")" -eq 2 ] || { cat "$work/printed" >&2; fail "two figures became worse"; }
grep -q "^drive, default: ate_m was " "$work/printed" || fail "the ATE became worse"
grep -q "^drive, odometry: nees_inside_10 was " "$work/printed" || fail "the covariances became worse"
cmp "$work/again.json" "$work/out/results.json"
cmp "$work/again.md" "$work/out/results.md"

mkdir -p "$work/sizes/points"
cp -r "$work/out/runs/drive/default" "$work/sizes/points/100"
cp -r "$work/out/runs/drive/odometry" "$work/sizes/points/300"
PYTHONDONTWRITEBYTECODE=1 expect_status 0 python3 "$scripts/sizes.py" "$work/sizes"
[ "$(grep -c '^| [13]00 |' "$work/printed")" -eq 2 ] || fail "sizes.py has a row for every size"
grep -q "^Law, .* CPU ms .* MB " "$work/printed" || fail "sizes.py prints a law"
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$scripts python3 - <<'EOF'
from sizes import line_fit

assert line_fit([1, 2, 4], [3, 5, 9]) == (1, 2, 0), line_fit([1, 2, 4], [3, 5, 9])
a, b, difference = line_fit([0, 1, 2], [1, 2.5, 3])
assert abs(a - 7 / 6) < 1e-12 and abs(b - 1) < 1e-12 and abs(difference - 1 / 6) < 1e-12, (a, b, difference)
EOF
