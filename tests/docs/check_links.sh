#!/usr/bin/env bash
# Fails if a link of the documentation leads to no file, or to no heading of one, or if a source file that it names does not exist.
#
#   check_links.sh SOURCE_DIR FILE.md...
set -euo pipefail
cd "$1"
shift

# The name that GitHub gives a heading.
anchors() {
  sed -n 's/^##* *//p' "$1" | tr '[:upper:]' '[:lower:]' | sed 's/[^a-z0-9 _-]//g; s/ /-/g'
}

sources=$(find include examples tests benchmarks -name '*.hpp' -o -name '*.cpp')
status=0
for file in "$@"; do
  while read -r target; do
    case $target in http*://* | mailto:*) continue ;; esac
    path=${target%%#*}
    page=$file
    [ -z "$path" ] || page=$(dirname "$file")/$path
    if [ ! -e "$page" ]; then
      echo "$file: no file at $target" >&2
      status=1
    elif [[ $target == *#* ]] && ! anchors "$page" | grep -qxF -- "${target#*#}"; then
      echo "$file: no heading for $target" >&2
      status=1
    fi
  done < <(awk '/^```/ { inside = !inside; next } !inside' "$file" | grep -o '](\([^)]*\))' | sed 's/^](//; s/)$//')
  case $file in CHANGELOG.md | docs/results/*) continue ;; esac  # they may name what there was
  while read -r source; do
    if ! grep -qE "(^|/)$source\$" <<<"$sources"; then
      echo "$file: no source $source" >&2
      status=1
    fi
  done < <(grep -oE '`[a-zA-Z0-9_/]+\.(hpp|cpp)`' "$file" | tr -d '`' | sort -u)
done
exit $status
