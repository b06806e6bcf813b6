#!/usr/bin/env bash
# build.sh [preset]: configures and builds a preset (default: release) into build/<preset>/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=${1:-release}
cmake --preset "$preset"
cmake --build --preset "$preset" -j "$(nproc)"
