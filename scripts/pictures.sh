#!/usr/bin/env bash
# Makes the pictures of README.md and docs/cli.md again: explores the office tower as scripts/demo.sh does, but so that it
# repeats (--charge-planning off). STAIRWELL=<program> takes another one than the release build's.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

stairwell=${STAIRWELL:-build/release/bin/stairwell}
[[ -x $stairwell ]] || {
  echo "pictures.sh: $stairwell is missing: run scripts/build.sh first" >&2
  exit 1
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$stairwell" explore worlds/office_tower.sdf --uavs 4 --mode volume --charge-planning off --quiet --out "$work/run"
cp "$work/run/snapshot.png" docs/images/office_tower.png
"$stairwell" map render "$work/run/map.bt" --view storey:2 --size 800x600 -o docs/images/office_tower_storey.png
"$stairwell" report "$work/run" --film "$work/film.gif" --size 640x480
if [[ -f $work/film.gif ]]; then
  cp "$work/film.gif" docs/images/office_tower.gif
else
  echo "pictures.sh: docs/images/office_tower.gif needs ffmpeg" >&2
fi
ls -l docs/images
