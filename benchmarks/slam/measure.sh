# Sourced by the scripts of this folder: the programs, and one measurement.
#
# Environment: STEREO_SLAM, SLAM_FLOOR: the programs (by default those of build/release, which are built).
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
if [ -z "${STEREO_SLAM:-}" ] || [ -z "${SLAM_FLOOR:-}" ]; then
  cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
  cmake --build "$root/build/release" --target stereo_slam slam_floor >/dev/null
fi
program=${STEREO_SLAM:-$root/build/release/examples/stereo_slam/stereo_slam}
floor=${SLAM_FLOOR:-$root/build/release/benchmarks/slam/slam_floor}

# measure RECORDING FOLDER ARGUMENT...: the floor, then one run with these arguments, into FOLDER.
measure() {
  local recording=$1 folder=$2
  shift 2
  mkdir -p "$folder"
  "$floor" "$recording" >"$folder/floor.json"
  "$program" run --dataset "$recording" --output "$folder" --overwrite --quiet "$@" 2>"$folder/run.log" || {
    cat "$folder/run.log" >&2
    exit 1
  }
  rm -f "$folder/map.ply" "$folder/report.html"
}

# score RECORDING FOLDER ARGUMENT...: compares the run in FOLDER with the ground truth, if there is one.
score() {
  local recording=$1 folder=$2
  shift 2
  [ -f "$recording/poses.txt" ] || return 0
  "$program" evaluate --groundtruth "$recording/poses.txt" --estimate "$folder/trajectory_kitti.txt" \
    --covariances "$folder/covariances.csv" "$@" --json "$folder/scores.json" >/dev/null
}
