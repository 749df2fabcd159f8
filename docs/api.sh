#!/usr/bin/env bash
# Makes the API reference, OUTPUT_DIR/html/index.html, from the comments in the headers. Fails if a public symbol has none.
#
#   docs/api.sh [OUTPUT_DIR]        default: build/docs
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
output=$(realpath -m "${1:-$root/build/docs}")
cd "$root"
command -v doxygen >/dev/null || { echo "$0: doxygen not found: apt-get install doxygen" >&2; exit 1; }
mkdir -p "$output"
rm -rf "$output/html"
{
  cat docs/Doxyfile
  echo "OUTPUT_DIRECTORY = \"$output\""
} | doxygen -
echo "$output/html/index.html"
