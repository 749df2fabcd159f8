#!/usr/bin/env bash
# Is the covariance of `run --imu` as large as its error, and what does an IMU cost or gain? Renders drives, and flights if there is a path,
# with an IMU that is late or early, turned by 2 degrees and 2 cm off its calibration, with motion blur, all of which begin in motion; runs
# stereo_slam on each with and without the IMU, and once more with a second of its images missing. Prints Markdown tables.
# Needs numpy. What is rendered is not rendered again.
#
#   inertial_drives.sh [OUT]       default: out/inertial_drives
#
# Environment: SEEDS ("1 2 ... 10"); FLIGHT: a ground truth of EuRoC whose parts are flown, one a seed, besides (none); STREETS: pose files of
# KITTI (10 Hz), separated by spaces, a part of one of which is driven, besides (none); KINDS of cases ("drive flight street", if there is a path);
# STEREO_SLAM: the program (by default that of build/release, which is built); FRAMES (160); SCALE of the images (0.5).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${1:-$root/out/inertial_drives}
frames=${FRAMES:-160}
if [ -z "${STEREO_SLAM:-}" ]; then
  cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
  cmake --build "$root/build/release" --target stereo_slam >/dev/null
  STEREO_SLAM=$root/build/release/examples/stereo_slam/stereo_slam
fi
python=${PYTHON:-python3}
delays=(-20 0 20 -10 10) # ms, by the seed
mkdir -p "$out"

# one NAME SEED ARGUMENT...: renders a case into OUT/NAME/images, runs and scores it.
one() {
  local seed=$2 folder=$out/$1 run
  shift 2
  if [ ! -d "$folder/images" ]; then
    rm -rf "$folder"
    local blur=(--exposure 20)
    ((seed % 3 == 0)) || blur=()
    "$STEREO_SLAM" simulate --quiet --format euroc --frames "$frames" --fps 20 --scale "${SCALE:-0.5}" --seed "$seed" --imu \
      --imu-delay "${delays[seed % 5]}" "${blur[@]}" --output "$folder/rendering" "$@"
    "$python" "$here/inertial_drives.py" misalign "$folder/rendering/mav0" "$seed"
    mv "$folder/rendering" "$folder/images"
  fi
  rm -rf "$folder/gap"
  cp -rs "$folder/images" "$folder/gap" # links
  "$python" "$here/inertial_drives.py" remove "$folder/gap/mav0"
  for run in alone imu gap_alone gap_imu; do
    local images=images options=()
    [[ $run == gap* ]] && images=gap
    [[ $run == *imu ]] && options=(--imu)
    "$STEREO_SLAM" run --quiet --overwrite --dataset "$folder/$images" --output "$folder/$run" --json "$folder/$run.json" \
      --pose-frame body "${options[@]}" 2>"$folder/$run.log" || true
  done
  # The poses are those of the body, velocities and biases those of what the calibration takes for the IMU.
  for run in alone imu; do
    "$STEREO_SLAM" evaluate --groundtruth "$folder/images/mav0/state_groundtruth_estimate0/data.csv" --estimate "$folder/$run/trajectory_tum.txt" \
      --covariances "$folder/$run/covariances.csv" --json "$folder/${run}_score.json" >/dev/null 2>&1 || true
  done
  "$STEREO_SLAM" evaluate --groundtruth "$folder/images/mav0/true_imu.csv" --estimate "$folder/imu/trajectory_tum.txt" \
    --inertial "$folder/imu/inertial.csv" --imu-delay "${delays[seed % 5]}" --json "$folder/inertial.json" >/dev/null 2>&1 || true
  "$python" "$here/inertial_drives.py" row "$folder"
}

out=$(cd "$out" && pwd)
read -ra streets <<<"${STREETS:-}"
kinds=${KINDS:-drive${FLIGHT:+ flight}${STREETS:+ street}}
"$python" "$here/inertial_drives.py" head
for seed in ${SEEDS:-1 2 3 4 5 6 7 8 9 10}; do
  for kind in $kinds; do
    path=()
    if [ "$kind" != drive ]; then
      file=${FLIGHT:-}
      [ "$kind" = street ] && file=${streets[seed % ${#streets[@]}]}
      path=(--trajectory "$out/$kind-$seed.txt")
      "$python" "$here/inertial_drives.py" "$kind" "$file" "$seed" "$frames" "${path[1]}"
    fi
    one "$kind-$seed" "$seed" "${path[@]}"
  done
done
"$python" "$here/inertial_drives.py" summary "$out"
