#!/usr/bin/env bash
# What run --mcap writes, read by @mcap/core and @foxglove/rosmsg2-serialization. Exit status 77: they are not installed.
#
#   witness_test.sh STEREO_SLAM MODULES        MODULES: folder in which npm installed the packages of witness/package.json
set -euo pipefail
program=$1
export WITNESS_MODULES=$2
source "$(dirname "${BASH_SOURCE[0]}")/witness/prepare.sh"
# Nothing changes the covariances at the end of such a run, so that those of the table are those of the messages.
printf 'online_rectification: {enabled: false}\n' >settings.yaml
"$program" run --quiet --dataset DIR --output OUT --config settings.yaml --no-loop-closure --mcap run.mcap --mcap-images
node "$here/witness/read_mcap.mjs" run.mcap OUT/covariances.csv
