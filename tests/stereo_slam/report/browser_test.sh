#!/usr/bin/env bash
# Opens the pages of browser_pages in headless Chromium and uses them (probe.js). Exit status 77: no Chromium is installed.
#
#   browser_test.sh BROWSER_PAGES
set -euo pipefail
pages_program=$1
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$browser" ]; then
  echo "skipped: the pages of the report are tested with Chromium (Debian: apt-get install chromium)"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$pages_program" "$folder"

# The page with recorder.js before its scripts and probe.js after them.
with_probe() {
  awk -v recorder="$here/recorder.js" -v probe="$here/probe.js" -v expected="$2" '
    function include(file,   line) { while ((getline line < file) > 0) print line; close(file) }
    { print }
    /^<head>$/ { print "<script>"; include(recorder); print "</script>" }
    /^<div id="page"><\/div>$/ {
      print "<script type=\"application/json\" id=\"expected\">"; include(expected); print "</script>"
      print "<script defer>addEventListener(\"DOMContentLoaded\", () => {"; include(probe); print "});</script>"
    }' "$1"
}

status=0
for page in "$folder"/*.html; do
  name=$(basename "$page" .html)
  tested="$folder/$name.tested"
  with_probe "$page" "$folder/$name.json" >"$tested.html"
  graphics=(--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader)
  [ "$name" != laps-without-webgl ] || graphics=(--disable-3d-apis)
  # Chromium refuses to run as root with its sandbox.
  timeout 120 "$browser" --headless --no-sandbox "${graphics[@]}" --user-data-dir="$folder/profile" --window-size=1200,900 \
    --virtual-time-budget=20000 --dump-dom "file://$tested.html" >"$folder/$name.dom" 2>"$folder/$name.log" || true
  result=$(sed -n '/<pre id="result">/,/<\/pre>/p' "$folder/$name.dom" | sed 's/<[^>]*>//g')
  rm -f "$tested.html"
  if [ "$result" = passed ]; then
    echo "$name: passed"
  else
    status=1
    echo "$name: ${result:-no result}"
    [ -n "$result" ] || tail -n 5 "$folder/$name.log"
  fi
done
exit $status
