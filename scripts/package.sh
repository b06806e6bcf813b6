#!/usr/bin/env bash
# Builds the Debian packages stairwell and stairwell-dev into build/package/packages/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/build.sh package >build/package.log 2>&1 || {
  tail -n 40 build/package.log >&2
  echo "package.sh: the build failed; all of its output is in build/package.log" >&2
  exit 1
}
rm -rf build/package/packages
(cd build/package && cpack -G DEB) >>build/package.log 2>&1 || {
  tail -n 20 build/package.log >&2
  echo "package.sh: cpack failed; all of its output is in build/package.log" >&2
  exit 1
}
ls build/package/packages/*.deb
