#!/usr/bin/env bash
# hall.sh OUT: explores benchmarks/hall.sdf, 100 x 100 x 30 m with pillars, galleries and shelves, at 0.1 m (300 million
# voxels) end to end into the run folder OUT and prints coverage, time and the most memory used. About three quarters of
# an hour on two cores. PROGRAM=... names another stairwell than build/release's.
set -euo pipefail
[[ $# -eq 1 && $1 != -* ]] || { sed -n '2,4s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
out=$(realpath -m "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=${PROGRAM:-build/release/bin/stairwell}
[[ -x $program ]] || { echo "hall.sh: $program is missing: build first (scripts/build.sh release)" >&2; exit 1; }
"$program" explore benchmarks/hall.sdf --box=-50,-50,0,50,50,30 --uavs 6 --mode volume --sensor lidar \
  --fov-deg 360x-45..45 --range 15 --samples 60000 --rate-hz 2 --vmax 4 --amax 3 --charge-planning off \
  --target-coverage 0.99 --set checkpoint_period_s=60 --out "$out"
grep -E '"(coverage|finish_s|peak_rss_mib|wall_s|collisions|stop_reason)"' "$out/metrics.json"
