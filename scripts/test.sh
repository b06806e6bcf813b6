#!/usr/bin/env bash
# Installs what is missing (for the tests of the replay in a browser also what viewer/package-lock.json names), builds the
# release preset, fuzzes each target of tests/fuzz for FUZZ_SECONDS (default 60, 0 = not at all) and runs all tests. Inputs of the
# kept corpus must not fail. A new one that the search comes upon is told at the end, with what is needed to run it again, and
# does not make the tests fail: it would for one run and not for the next of the same commit (scripts/fuzz.sh exits with 3).
# Extra arguments go to ctest (as in -R mapping); then there is no fuzzing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install_deps.sh
scripts/build.sh release
if command -v npm >/dev/null && [[ viewer/package-lock.json -nt viewer/node_modules/.package-lock.json ]]; then
  npm ci --prefix viewer --no-audit --no-fund </dev/null || echo "test.sh: no tests of the replay: npm ci failed" >&2
fi
fuzzed=0
told=$(mktemp)
trap 'rm -f "$told"' EXIT
if [[ $# -eq 0 ]]; then
  scripts/fuzz.sh "${FUZZ_SECONDS:-60}" 2>&1 | tee "$told" || fuzzed=$?
fi
tested=0
ctest --preset release --output-on-failure --parallel 2 "$@" || tested=$?
if [[ $fuzzed -ne 0 ]]; then
  echo "test.sh: what fuzzing found:"
  tail -n 150 "$told"
fi
[[ $fuzzed -eq 0 || $fuzzed -eq 3 ]] || exit 1
exit $tested
