#!/usr/bin/env bash
# Fails if the documentation names a setting, as `group.name` or `group.name: value`, that stereo_slam does not have. Results, the
# changelog and the list of faults may name settings of earlier versions.
#
#   check_settings.sh STEREO_SLAM SOURCE_DIR FILE.md...
set -euo pipefail
program=$1
cd "$2"
shift 2

settings=$("$program" --print-settings | awk '
  /^[a-z_]+:/ { group = substr($1, 1, length($1) - 1) }
  /^  [a-z_]+:/ { print group "." substr($1, 1, length($1) - 1) }')

# Those that settings/schema.cpp refuses as removed or renamed: "group.name", or {"group", "name name" "name"}.
schema=examples/stereo_slam/settings/schema.cpp
earlier=$(
  grep -oE '"[a-z_]+\.[a-z_]+"' "$schema" | tr -d '"'
  tr '\n' ' ' <"$schema" | grep -oE '\{"[a-z_]+", *("[a-z0-9_ ]+" *)+\}' | tr -c 'a-z0-9_\n' ' ' |
    awk '{ for (i = 2; i <= NF; ++i) print $1 "." $i }'
)

status=0
for file in "$@"; do
  while read -r name; do
    case $name in *.csv | *.txt | *.ply | *.yml | *.xml | *.json | *.bag | *.mcap | *.yaml | *.html | *.js | *.hpp | *.cpp | *.py | *.sh) continue ;; esac
    known=$settings
    case $file in docs/results/* | CHANGELOG.md | docs/robustness.md) known+=$'\n'$earlier ;; esac
    if ! grep -qxF "$name" <<<"$known"; then
      echo "$file: no setting $name" >&2
      status=1
    fi
  done < <(grep -oE '`[a-z_]+\.[a-z_]+(:[^`]*)?`' "$file" | tr -d '`' | sed 's/:.*//' | sort -u)
done
exit $status
