# Read by the tests beside this folder, which set `program` and WITNESS_MODULES: goes to a temporary folder with a drive, DIR, or
# ends the test with exit status 77 if the packages of package.json are not installed. `here` is the folder of the test.
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if ! command -v node >/dev/null || [ ! -d "$WITNESS_MODULES/node_modules/@mcap/core" ]; then
  echo "skipped: npm install --prefix $WITNESS_MODULES $here/witness    (node and npm: Debian's packages of these names)"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"$program" simulate --quiet --output DIR --frames 30 --scale 0.35
