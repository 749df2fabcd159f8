#!/usr/bin/env bash
#SBATCH --job-name=stereo_slam
#SBATCH --output=%x_%A_%a.log
#SBATCH --cpus-per-task=2
#SBATCH --mem=2G
#SBATCH --requeue
# Runs the SLAM on one recording of a list, unless it has been run to its end.
#
#   run_recording.sh LIST OUTPUT LINE                               one recording: line LINE of LIST
#   sbatch --array=1-$(wc -l <LIST) run_recording.sh LIST OUTPUT    all of them, as an array of Slurm jobs
#
# A line of LIST is a name and the options of `stereo_slam run` for the recording; quotes group, and lines that are empty or begin
# with # are none:
#
#   town    --dataset /data/town
#   hall    --dataset "/data/second floor.bag" --calibration /data/rig.yaml
#
# Results go to OUTPUT/NAME, the summary of `run --json` to OUTPUT/NAME.json. A recording whose summary says that it is finished is
# not run again, so the same command continues what was interrupted; delete the summary to repeat a recording.
#
# Environment: STEREO_SLAM (the program; stereo_slam if not given).
set -euo pipefail

fail() {
  echo "$(basename "$0"): $1" >&2
  exit "${2:-1}"
}

number=${3:-${SLURM_ARRAY_TASK_ID:-}}
if [ $# -lt 2 ] || [ -z "$number" ]; then fail "usage: run_recording.sh LIST OUTPUT LINE" 2; fi
[[ $number =~ ^[1-9][0-9]*$ ]] || fail "LINE is '$number', but must be the number of a line, from 1" 2
list=$1
output=$2
[ -f "$list" ] || fail "$list: no such file"
[ "$number" -le "$(grep -c "" "$list")" ] || fail "$list: has no line $number"

read -r name options < <(sed -n "${number}p" "$list") || true
if [[ -z $name || $name == \#* ]]; then exit 0; fi
[[ $name =~ ^[A-Za-z0-9][A-Za-z0-9._-]*$ ]] || fail "$list:$number: '$name' is no name; use letters, digits, '.', '_' and '-'"
words=$(xargs printf '%s\n' <<<"$options") || fail "$list:$number: a quote is not closed"
mapfile -t arguments <<<"$words"
[ "$(awk '{ print $1 }' "$list" | grep -cxF -- "$name")" -eq 1 ] || fail "$list:$number: '$name' is also the name of another recording"

summary=$output/$name.json
if grep -qs '"state": "finished"' "$summary"; then
  echo "$name: finished before"
  exit 0
fi
mkdir -p "$output"
echo "$name: begins"
exec "${STEREO_SLAM:-stereo_slam}" run --quiet --output "$output/$name" --overwrite --json "$summary" "${arguments[@]}"
