#!/usr/bin/env bash
# Reports the longest functions and those with more than five parameters. It is a report, not a test: tables may be long.
# Usage: tests/layout/function_sizes.sh [--longest 20] [FOLDER...]     (default: include examples)
# It reads the functions from universal-ctags (Debian: apt-get install universal-ctags), which nothing else here needs.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
longest=20
if [ "${1:-}" = --longest ]; then
  longest=${2:?--longest needs a number}
  shift 2
fi
command -v ctags >/dev/null || { echo "$0: ctags not found: apt-get install universal-ctags" >&2; exit 1; }
cd "$root"
[ $# -gt 0 ] || set -- include examples

# One line a function: lines of the body, parameters, file:line, name. ctags calls lambdas __anon…: they count as functions, too.
functions() {
  git ls-files -- "$@" | grep -E '\.(hpp|cpp)$' |
    ctags -L - -o - --sort=no --language-force=C++ --kinds-C++=fp --fields=+neS --excmd=number |
    awk -F '\t' '
      # Commas between the outermost parentheses, those of templates, calls and braces left out.
      function count_parameters(signature,    i, depth, commas, empty, c, previous) {
        depth = 0; commas = 0; empty = 1; previous = ""
        for (i = 1; i <= length(signature); ++i) {
          c = substr(signature, i, 1)
          if (c ~ /[(<{[]/) ++depth
          else if (c ~ /[)}\]]/ || (c == ">" && previous != "-")) { if (--depth == 0) break }
          else if (c == "," && depth == 1) ++commas
          else if (depth == 1 && c != " ") empty = 0
          previous = c
        }
        return empty ? 0 : commas + 1
      }
      {
        line = end = signature = ""
        for (i = 4; i <= NF; ++i) {
          if ($i ~ /^line:/) line = substr($i, 6)
          else if ($i ~ /^end:/) end = substr($i, 5)
          else if ($i ~ /^signature:/) signature = substr($i, 11)
        }
        name = $1 ~ /^__anon/ ? "(lambda)" : $1
        printf "%d\t%d\t%s:%d\t%s\n", end == "" ? 0 : end - line + 1, count_parameters(signature), $2, line, name
      }'
}

list=$(functions "$@")
echo "Longest functions (lines, where, name):"
sort -t $'\t' -k1,1nr -k3,3 <<<"$list" | awk -F '\t' -v longest="$longest" \
  'NR <= longest || $1 > 60 { printf "%4d  %s  %s%s\n", $1, $3, $4, ($1 > 60 ? "  (above 60)" : "") }'
echo "More than five parameters (number, where, name):"
sort -t $'\t' -k2,2nr -k3,3 <<<"$list" | awk -F '\t' '$2 > 5 { printf "%4d  %s  %s\n", $2, $3, $4 }'
