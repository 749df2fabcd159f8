#!/usr/bin/env bash
# Kills runs with --mcap at random times (kill -9), and reads what they left with @mcap/core. Exit status 77: it is not installed.
#
#   killed_runs.sh STEREO_SLAM MODULES [KILLS]        MODULES: as for witness_test.sh; KILLS: 3
#
# Prints a line a kill: frames that were finished then and a second before, by trajectory_online.txt, and frames in the messages.
set -euo pipefail
program=$(realpath "$1")
export WITNESS_MODULES=$2
kills=${3:-3}
source "$(dirname "${BASH_SOURCE[0]}")/witness/prepare.sh"
# A long recording: forwards and backwards, again and again.
mkdir -p LONG/image_0 LONG/image_1
cp DIR/calib.txt LONG
for ((i = 0; i < 6000; ++i)); do
  k=$((i % 58))
  [ "$k" -lt 30 ] || k=$((58 - k))
  for camera in 0 1; do
    ln -s "$(printf '../../DIR/image_%d/%06d.png' $camera $k)" "$(printf 'LONG/image_%d/%06d.png' $camera $i)"
  done
  printf '%d.%d\n' $((i / 10)) $((i % 10))
done >LONG/times.txt

finished() { [ ! -f OUT/trajectory_online.txt ] || wc -l <OUT/trajectory_online.txt; }

RANDOM=59
for ((kill = 1; kill <= kills; ++kill)); do
  rm -rf OUT run.mcap
  "$program" run --quiet --dataset LONG --output OUT --mcap run.mcap --mcap-images 2>/dev/null &
  run=$!
  until [ "$(finished)" != "" ] && [ "$(finished)" -gt 0 ]; do sleep 0.05; done
  sleep "0.$((RANDOM % 900 + 100))"
  before=$(finished)
  sleep 1
  builtin kill -9 "$run"
  wait "$run" 2>/dev/null || true
  echo "finished $(finished), a second before $before, in the messages $(node "$here/witness/read_killed_mcap.mjs" run.mcap)"
done
