#!/usr/bin/env bash
# Prints how the recordings of a list went, and writes OUTPUT/compare.html with those that are finished.
#
#   compare_recordings.sh LIST OUTPUT        the arguments of run_recording.sh
#
# Exit status 1 if a recording is not finished. Environment: STEREO_SLAM (the program; stereo_slam if not given).
set -euo pipefail
if [ $# -ne 2 ]; then
  echo "usage: compare_recordings.sh LIST OUTPUT" >&2
  exit 2
fi
list=$1
output=$2

# member NAME: its value in the summary, without quotes; nan for a number that is not known.
member() {
  sed -n "s/^  *\"$1\": \"\{0,1\}\([^\",]*\).*/\1/p" "$summary" | sed 's/^null$/nan/; q'
}

finished=()
missing=0
printf '%-24s %-12s %7s %5s %5s %9s %9s %7s\n' recording state frames lost loops path_m sigma_m p95_ms
while read -r name _ || [ -n "$name" ]; do  # the last line may have no end
  if [[ -z $name || $name == \#* ]]; then continue; fi
  summary=$output/$name.json
  state=-
  [ ! -s "$summary" ] || state=$(member state)
  if [ "$state" = finished ]; then finished+=("$output/$name"); else missing=$((missing + 1)); fi
  if [ "$state" = - ]; then
    printf '%-24s %-12s\n' "$name" "not run"
  else
    printf '%-24s %-12s %7d %5d %5d %9.1f %9.3f %7.1f\n' "$name" "$state" "$(member frames)" "$(member frames_lost)" \
      "$(member loops_accepted)" "$(member path_m)" "$(member last_sigma_m)" "$(member p95_ms)"
  fi
done <"$list"

if [ ${#finished[@]} -gt 0 ]; then
  "${STEREO_SLAM:-stereo_slam}" compare "${finished[@]}" --output "$output/compare.html"
fi
if [ "$missing" -gt 0 ]; then
  echo "$missing not finished" >&2
  exit 1
fi
