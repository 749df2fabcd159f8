#!/usr/bin/env bash
# Runs a code block of the documentation in a folder of its own, as a reader would.
#
#   run_block.sh BLOCK.sh|BLOCK.yaml|BLOCK.python WORK_DIR [CHECK.sh|CHECK.py]
#
# The folder holds the recordings of prepare_recordings.sh under the names that the documentation uses. Environment: SOURCE_DIR,
# BUILD_DIR, RECORDINGS, STEREO_SLAM and OBJECT_POSE (the programs), CMAKE.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
block=$1
work=$2
check=${3:-}

rm -rf "$work"
mkdir -p "$work"
cp -r "$RECORDINGS"/. "$work"
cd "$work"
if grep -q 'run .*--output OUT\b' "$block"; then rm -rf OUT; fi  # the block makes its own
export PATH="$here/bin:$PATH" HOME=$work
mkdir build
ln -s "$BUILD_DIR" build/release
ln -s "$SOURCE_DIR/examples" examples

case $block in
  *.sh) sed 's/\bSEED\b/1/g' "$block" >block.sh; bash -euxo pipefail block.sh | tee block.out ;;
  *.yaml) cp "$block" block.yaml ;;
  *.python)
    modules=sys
    if grep -q '^import numpy' "$block"; then modules=numpy; fi
    python=
    for candidate in python3 /usr/bin/python3; do
      if "$candidate" -c "import $modules" 2>/dev/null; then python=$candidate && break; fi
    done
    if [ -z "$python" ]; then
      echo "skipped: no python3 with $modules"
      exit 0
    fi
    cat "$block" "$check" >block.py
    "$python" block.py
    ;;
esac
case $check in
  *.sh) bash -euxo pipefail "$check" ;;
esac
