#!/usr/bin/env bash
# What rigs that differ from their calibration cost: renders drives with a right camera that vibrates, drifts or is late, a bad road and a
# lens error, at three levels each, runs stereo_slam with every preset on them, and prints a Markdown table; OUT/PRESET.svg plots it. What is done
# is not done again, and a run that fails is a row without figures.
#
#   rigs.sh [OUT]       default: out/rigs; images are deleted after their runs, unless KEEP_IMAGES=1
#
# Environment: STEREO_SLAM: the program (by default that of build/release, which is built); PRESETS ("default fast"); SEEDS (1); FRAMES (200);
# JOBS: drives at a time (2); SIMULATE: further arguments of `stereo_slam simulate`, as "--scene highway"; KINDS: only these
# (vibration loose drift sync ride lens).
# For real recordings, RECORDINGS: folders in KITTI's layout with poses.txt; DISTURB: a script that copies one with displaced right images:
# DISTURB RECORDING COPY --u PX --v PX --roll DEG --hold FRAMES --seed N (standard deviations; a displacement stays for so many frames).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${1:-$root/out/rigs}
if [ -z "${STEREO_SLAM:-}" ]; then
  cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
  cmake --build "$root/build/release" --target stereo_slam >/dev/null
  STEREO_SLAM=$root/build/release/examples/stereo_slam/stereo_slam
fi
export STEREO_SLAM PRESETS=${PRESETS:-default fast} KEEP_IMAGES=${KEEP_IMAGES:-} DISTURB=${DISTURB:-}

# SCENE_KIND_LEVEL-SEED ARGUMENTS, those of `stereo_slam simulate`, or a recording and those of DISTURB.
rigs() {
  local seed kind level recording
  for seed in ${SEEDS:-1}; do
    local common="--frames ${FRAMES:-200} --seed $seed ${SIMULATE:-}"
    echo "rendered_none_0-$seed $common"
    for kind in ${KINDS:-vibration loose drift sync ride lens}; do
      case $kind in
        vibration | loose | drift) set -- 0.3 1 3 ;;
        sync) set -- 3 10 30 ;;
        ride) set -- 5 10 20 ;;
        lens) set -- 0.5 1 2 ;; # times that of KITTI
        *) echo "$0: no kind $kind" >&2; exit 2 ;;
      esac
      for level; do
        case $kind in
          vibration) echo "rendered_vibration_$level-$seed $common --rig-vibration $level" ;;
          loose) echo "rendered_loose_$level-$seed $common --rig-vibration $level,10" ;;
          drift) echo "rendered_drift_$level-$seed $common --rig-drift $level" ;;
          sync) echo "rendered_sync_$level-$seed $common --sync-error $level" ;;
          ride) echo "rendered_ride_$level-$seed $common --ride $level" ;;
          lens) echo "rendered_lens_$level-$seed $common --lens-error $(awk "BEGIN { print -.026 * $level \",\" .013 * $level }")" ;;
        esac
      done
    done
    [ -n "$DISTURB" ] || continue
    for recording in ${RECORDINGS:-}; do
      for level in 0 0.3 1 3; do
        for kind in vibration loose; do
          # .3 of the displacement in v, and by the roll at the border of an image 1240 pixels wide
          awk -v name="$(basename "$recording")_${kind}_$level-$seed $(realpath "$recording")" -v px="$level" -v seed="$seed" \
            -v hold="$([ "$kind" = loose ] && echo 10 || echo 1)" \
            'BEGIN { print name, "--u", px, "--v", .3 * px, "--roll", .3 * px / 620 * 57.3, "--hold", hold, "--seed", seed }'
        done
      done
    done
  done
}

# one OUT NAME ARGUMENT...: makes the images of one rig in OUT/NAME, and runs and scores every preset on them.
one() {
  local folder=$1/$2 name=$2 preset run
  shift 2
  [ ! -f "$folder/done" ] || return 0
  rm -rf "$folder"
  mkdir -p "$folder"
  case ${1:-} in
    --*) "$STEREO_SLAM" simulate --quiet --threads 1 --output "$folder/images" "$@" ;;
    *) "$DISTURB" "$1" "$folder/images" "${@:2}" ;;
  esac
  for preset in $PRESETS; do
    run=$folder/$preset
    "$STEREO_SLAM" run --quiet --threads 1 --preset "$preset" --dataset "$folder/images" --output "$run" --json "$folder/$preset.json" &&
      "$STEREO_SLAM" evaluate --groundtruth "$folder/images/poses.txt" --estimate "$run/trajectory_kitti.txt" \
        --covariances "$run/covariances.csv" --json "$run/scores.json" >/dev/null || echo "$name: $preset failed" >&2
    [ -n "$KEEP_IMAGES" ] || rm -f "$run/map.ply" "$run/report.html"
  done
  [ -n "$KEEP_IMAGES" ] || rm -rf "$folder/images"
  touch "$folder/done"
  echo "$name" >&2
}
export -f one

mkdir -p "$out"
# shellcheck disable=SC2016
rigs | xargs -P "${JOBS:-2}" -L 1 bash -c 'set -euo pipefail; one "$0" "$@"' "$out"
# shellcheck disable=SC2086
python3 "$here/rigs.py" "$out" $PRESETS
