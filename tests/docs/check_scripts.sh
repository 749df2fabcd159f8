#!/usr/bin/env bash
# Fails unless every command of a block is an executable script of this project, or one of CMake's with presets that exist. Running
# them is for continuous integration.
#
#   check_scripts.sh BLOCK.sh SOURCE_DIR
set -euo pipefail
block=$1
cd "$2"

fail() {
  echo "$1" >&2
  exit 1
}

while read -r command arguments; do
  if [[ $command =~ ^(cmake|ctest)$ && $arguments =~ --preset\ ([a-z-]+) ]]; then
    grep -q "\"name\": \"${BASH_REMATCH[1]}\"" CMakePresets.json || fail "no preset ${BASH_REMATCH[1]}"
  elif [ ! -f "$command" ] || [ ! -x "$command" ] || ! bash -n "$command"; then
    fail "no executable script: $command"
  fi
done < <(grep -v '^ *\(#.*\)\?$' "$block")
