#!/usr/bin/env bash
# Installs what is missing, builds the release preset, fuzzes each target of tests/fuzz for FUZZ_SECONDS (default 60,
# 0 = not at all) and runs all tests. Extra arguments go to ctest (as in -R mapping); then there is no fuzzing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install_deps.sh
scripts/build.sh release
fuzzed=0
if [[ $# -eq 0 ]]; then
  scripts/fuzz.sh "${FUZZ_SECONDS:-60}" || fuzzed=$?
fi
ctest --preset release --output-on-failure --parallel 2 "$@"
exit "$fuzzed"
