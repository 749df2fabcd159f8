#!/usr/bin/env bash
# Checks what the container and the workflows call, where neither can be run: every script of this repository that they name exists
# and is executable, targets of the container that are built are there, and the YAML files are valid.
#
#   check_calls.sh SOURCE_DIR
set -euo pipefail
cd "$1"

failed=0
complain() {
  echo "$*" >&2
  failed=1
}

files=(Dockerfile .github/workflows/*.yml CONTRIBUTING.md README.md)
for script in $(grep -hoE '(^|[ `])(tests|cmake|examples|benchmarks|\.ci)/[a-z_/-]+(\.sh|/run)|\.ci/run' "${files[@]}" | tr -d ' `' | sort -u); do
  [ -x "$script" ] || complain "$script is called, and is no executable script"
done
for target in $(grep -hoE 'docker build --target [a-z]+' "${files[@]}" | awk '{ print $4 }' | sort -u); do
  grep -qE "^FROM .* AS $target\$" Dockerfile || complain "Dockerfile has no target $target"
done
for stage in $(grep -oE 'COPY --from=[a-z]+|^FROM [a-z]+ ' Dockerfile | sed -E 's/.*(=| )([a-z]+) ?$/\2/' | sort -u); do
  grep -qE "^FROM .* AS $stage\$" Dockerfile || complain "Dockerfile has no stage $stage"
done
if python3 -c 'import yaml' 2>/dev/null; then
  for file in .github/workflows/*.yml .github/ISSUE_TEMPLATE/*.yml; do
    python3 -c 'import sys, yaml; assert yaml.safe_load(open(sys.argv[1]))' "$file" || complain "$file is not valid YAML"
  done
fi
exit $failed
