#!/usr/bin/env bash
# run_recording.sh and compare_recordings.sh with a program that only writes what `stereo_slam run` would.
#
#   recordings_scripts_test.sh SOURCE_DIR
set -euo pipefail
scripts=$1/examples/stereo_slam
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

cat >program <<'END'
#!/usr/bin/env bash
printf '<%s>' "$@" >>calls
echo >>calls
[ "$1" = run ] || exit 0
while [ "$1" != --json ]; do shift; done
[ "${STATE:-finished}" = killed ] && exit 137
printf '{\n  "stereo_slam": "1",\n  "state": "%s",\n  "frames": 3,\n  "frames_lost": 0,\n  "loops_accepted": 0,\n' "${STATE:-finished}" >"$2"
printf '  "path_m": 1.5,\n  "last_sigma_m": null,\n  "frame": {\n    "p95_ms": 7.25\n  }\n}\n' >>"$2"
[ "${STATE:-finished}" = finished ]
END
chmod +x program
export STEREO_SLAM=$work/program

fail() {
  echo "$1" >&2
  exit 1
}
# expect STATUS TEXT COMMAND...: the command ends with this status and its output contains the text.
expect() {
  local status=0 output
  output=$("${@:3}" 2>&1) || status=$?
  [ "$status" -eq "$1" ] || fail "${*:3}: status $status, expected $1: $output"
  grep -qF -- "$2" <<<"$output" || fail "${*:3}: '$output' does not say '$2'"
}
calls() { if [ -e calls ]; then wc -l <calls; else echo 0; fi; }

cat >list <<'END'
# a comment

first   --dataset a --preset fast
second  --dataset "b c" --clahe
bad/name --dataset d
open    --dataset "e
twice   --dataset f
twice   --dataset g
END

# What is no recording is passed over, and what is wrong is named.
for line in 1 2; do "$scripts/run_recording.sh" list out "$line"; done
expect 1 "list:5: 'bad/name' is no name" "$scripts/run_recording.sh" list out 5
expect 1 "list:6: a quote is not closed" "$scripts/run_recording.sh" list out 6
expect 1 "list:7: 'twice' is also the name of another recording" "$scripts/run_recording.sh" list out 7
expect 1 "list: has no line 9" "$scripts/run_recording.sh" list out 9
expect 2 "LINE is '0'" "$scripts/run_recording.sh" list out 0
expect 2 "LINE is '1-3'" "$scripts/run_recording.sh" list out 1-3
expect 2 "usage" "$scripts/run_recording.sh" list out
expect 1 "nowhere: no such file" "$scripts/run_recording.sh" nowhere out 1
[ "$(calls)" -eq 0 ] || fail "the program was called for lines that are wrong"

# A recording is run until it has finished, and then no more.
STATE=killed expect 137 "first: begins" "$scripts/run_recording.sh" list out 3
STATE=interrupted expect 1 "first: begins" "$scripts/run_recording.sh" list out 3
expect 0 "first: begins" "$scripts/run_recording.sh" list out 3
expect 0 "first: finished before" "$scripts/run_recording.sh" list out 3
[ "$(calls)" -eq 3 ] || fail "a finished recording was run again"
grep -qxF '<run><--quiet><--output><out/first><--overwrite><--json><out/first.json><--dataset><a><--preset><fast>' calls || fail "$(cat calls)"

# A job of an array takes its line from Slurm, and quotes group words.
head -n 4 list >good
SLURM_ARRAY_TASK_ID=4 STATE=interrupted expect 1 "second: begins" "$scripts/run_recording.sh" good out
grep -qF '<--dataset><b c><--clahe>' calls || fail "$(cat calls)"

# The comparison has the finished ones only, and says what is missing.
expect 1 "1 not finished" "$scripts/compare_recordings.sh" good out
tail -n 1 calls | grep -qxF '<compare><out/first><--output><out/compare.html>' || fail "$(tail -n 1 calls)"
SLURM_ARRAY_TASK_ID=4 "$scripts/run_recording.sh" good out
expect 0 "second                   finished           3     0     0       1.5       nan     7.2" "$scripts/compare_recordings.sh" good out
tail -n 1 calls | grep -qxF '<compare><out/first><out/second><--output><out/compare.html>' || fail "$(tail -n 1 calls)"
printf 'late --dataset h' >>good # a last line without an end counts, too
expect 1 "late                     not run" "$scripts/compare_recordings.sh" good out
expect 0 "late: begins" "$scripts/run_recording.sh" good out 5
