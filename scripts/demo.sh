#!/usr/bin/env bash
# Builds a release and explores the office tower with four UAVs. Extra arguments are passed to `stairwell explore`
# (as in scripts/demo.sh --uavs 2 --mode slice).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/install_deps.sh
echo "Building (some minutes the first time; build/demo.log)"
mkdir -p build
if ! scripts/build.sh release >build/demo.log 2>&1; then
  tail -n 40 build/demo.log >&2
  echo "demo.sh: the build failed; all of its output is in build/demo.log" >&2
  exit 1
fi

number=1
while [[ -e runs/demo-$number ]]; do number=$((number + 1)); done
folder=runs/demo-$number
mkdir -p runs
status=0
build/release/bin/stairwell explore worlds/office_tower.sdf --uavs 4 --mode volume --out "$folder" "$@" || status=$?

# A later --out among the arguments wins; then the folder is printed by the program itself.
if [[ -f $folder/metrics.json ]]; then
  echo
  echo "Run folder: $PWD/$folder"
  for key in stop_reason coverage t90_s finish_s path_length_m min_uav_distance_m collisions wall_s; do
    value=$(sed -n "s/^ *\"$key\": *\(.*[^,]\),\{0,1\}$/\1/p" "$folder/metrics.json" | head -n 1)
    printf '  %-20s %s\n' "$key" "${value:-not recorded}"
  done
  echo "Open $folder/report.html in a browser; $folder/map.bt opens in octovis."
fi
exit "$status"
