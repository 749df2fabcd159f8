#!/usr/bin/env bash
# Writes every fenced code block of the documentation to a file, and prints what a test of it needs to know.
#
#   extract_blocks.sh SOURCE_DIR OUTPUT_DIR FILE.md...
#
# The line before a block may say how it is tested, in a comment that readers do not see: <!-- test: KEY=VALUE -->.
# tests/docs/CMakeLists.txt explains the keys. For every block one line goes to standard output,
#
#   ID|language|KEY=VALUE|FILE.md:line
#
# and its text to OUTPUT_DIR/ID.LANGUAGE. C++ blocks of one file with the same setup=NAME are joined in OUTPUT_DIR/NAME.inc, and
# their #include lines in OUTPUT_DIR/NAME.includes.hpp.
set -euo pipefail
source_dir=$1
output_dir=$2
shift 2

fresh=$output_dir.new
rm -rf "$fresh"
mkdir -p "$output_dir" "$fresh"
for file in "$@"; do
  awk -v source_dir="$source_dir" -v output_dir="$fresh" -v file="$file" '
    BEGIN {
      name = file
      sub(/^docs\//, "", name)
      sub(/\.md$/, "", name)
      gsub(/[^A-Za-z0-9]/, "_", name)
    }
    inside && /^ *```/ { inside = 0; close(output); next }
    inside && joined && /^#include/ { print >> includes; next }
    inside { print >> output; next }
    /^ *(~~~|<pre)/ {
      printf "%s:%d: code blocks are fenced by three backquotes here\n", file, FNR > "/dev/stderr"
      exit failed = 1
    }
    /^ *```/ {
      language = $0
      sub(/^ *```/, "", language)
      sub(/[ \t].*/, "", language)
      if (language == "") language = "text"
      id = name "_" language "_" ++count[language]
      option = ""
      if (previous ~ /^ *<!-- test: .* -->$/) {
        option = previous
        gsub(/^ *<!-- test: | -->$/, "", option)
      }
      joined = language == "cpp" && option ~ /^setup=/
      output = output_dir "/" id "." language
      if (joined) {
        output = output_dir "/" substr(option, 7) ".inc"
        includes = output_dir "/" substr(option, 7) ".includes.hpp"
        printf "" >> includes
        printf "#line %d \"%s/%s\"\n", FNR + 1, source_dir, file >> output
      }
      printf "%s|%s|%s|%s:%d\n", id, language, option, file, FNR
      inside = 1
    }
    { previous = $0 }
    END {
      if (inside && !failed) {
        printf "%s: the last code block is not closed\n", file > "/dev/stderr"
        exit 1
      }
    }' "$source_dir/$file"
done

# What has not changed keeps its time, so that it is not built again.
for block in "$output_dir"/*; do
  [ -e "$fresh/$(basename "$block")" ] || rm -rf "$block"
done
for block in "$fresh"/*; do
  cmp -s "$block" "$output_dir/$(basename "$block")" || mv "$block" "$output_dir"
done
rm -rf "$fresh"
