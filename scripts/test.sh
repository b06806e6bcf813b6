#!/usr/bin/env bash
# Installs what is missing (for the tests of the replay in a browser also what viewer/package-lock.json names), builds the
# release preset, fuzzes each target of tests/fuzz for FUZZ_SECONDS (default 60, 0 = not at all) from a fixed seed, so that two
# runs search alike (`scripts/fuzz.sh 3600` searches on), and runs all tests. Extra arguments go to ctest (as in -R mapping);
# then there is no fuzzing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install_deps.sh
scripts/build.sh release
if command -v npm >/dev/null && [[ viewer/package-lock.json -nt viewer/node_modules/.package-lock.json ]]; then
  npm ci --prefix viewer --no-audit --no-fund </dev/null || echo "test.sh: no tests of the replay: npm ci failed" >&2
fi
fuzzed=0
if [[ $# -eq 0 ]]; then
  FUZZ_SEED=${FUZZ_SEED:-1} scripts/fuzz.sh "${FUZZ_SECONDS:-60}" || fuzzed=$?
fi
ctest --preset release --output-on-failure --parallel 2 "$@"
exit "$fuzzed"
