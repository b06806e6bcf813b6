#!/usr/bin/env bash
# Installs what is missing, builds the release preset and runs all tests. Extra arguments go to ctest (as in -R mapping).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install_deps.sh
scripts/build.sh release
exec ctest --preset release --output-on-failure --parallel 2 "$@"
