#!/usr/bin/env bash
# Fails unless everything that names the version agrees with project(VERSION).
#
#   check_version.sh VERSION SOURCE_DIR [STEREO_SLAM RUN_DIR]        RUN_DIR: results of stereo_slam run
set -euo pipefail
version=$1
source_dir=$2
program=${3:-}

# expect WHAT EXPECTED ACTUAL
expect() {
  if [ "$2" != "$3" ]; then
    echo "$1 says '$3', project(VERSION) '$2'" >&2
    exit 1
  fi
}

released=$(sed -n 's/^date-released: //p' "$source_dir/CITATION.cff")
expect CITATION.cff "$version" "$(sed -n 's/^version: //p' "$source_dir/CITATION.cff")"
expect package.xml "$version" "$(sed -n 's:.*<version>\(.*\)</version>.*:\1:p' "$source_dir/package.xml")"
expect CHANGELOG.md "## [$version] - $released" "$(grep '^## \[[0-9]' "$source_dir/CHANGELOG.md" | head -1)"
expect "find_package in docs/building.md" "${version%.*}" \
  "$(sed -n 's/^find_package(antipode \([0-9.]*\).*/\1/p' "$source_dir/docs/building.md")"
expect "FetchContent in docs/building.md" "v$version" "$(sed -n 's/.*GIT_TAG \(v[0-9.]*\).*/\1/p' "$source_dir/docs/building.md")"
if [ -n "$program" ]; then
  expect "stereo_slam --version" "$version" "$("$program" --version)"
  expect run.yaml "$version" "$(sed -n 's/^version: //p' "$4/run.yaml")"
fi
