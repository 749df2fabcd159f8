#!/usr/bin/env bash
# Makes the API reference, and fails if Doxygen warns of anything: a public symbol without a comment, say, or a name that leads nowhere.
# Exit status 77: the Doxygen whose warnings these are is not installed.
#
#   check_api.sh SOURCE_DIR OUTPUT_DIR
set -euo pipefail
version=1.9.4 # of Debian 12; others find other faults
installed=$(doxygen --version 2>/dev/null | cut -d' ' -f1 || true)
if [ "$installed" != "$version" ]; then
  echo "skipped: the API reference is tested with Doxygen $version, here is ${installed:-none} (Debian 12: apt-get install doxygen)"
  exit 77
fi
exec "$1/docs/api.sh" "$2"
