#!/usr/bin/env bash
# Explores the six worlds in both modes with three seeds and writes docs/results.md. Planning time is not charged, so that the
# table repeats on any machine. Finished runs are not repeated; a killed run is resumed.
#   JOBS=2                  runs side by side (default: one per processor)
#   SEEDS="1" WORLDS="duplex atrium"   fewer runs
#   DATA=DIR                adds duplex_office and cubicle_office from a folder with buildings/ and multi_uav/
# Extra arguments go to `stairwell explore`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

program=${PROGRAM:-build/release/bin/stairwell}
[[ -x $program ]] || { echo "results.sh: $program is missing; run scripts/build.sh first" >&2; exit 1; }
read -r -a worlds <<<"${WORLDS:-office_tower duplex parking_garage warehouse atrium collapsed}"
read -r -a seeds <<<"${SEEDS:-1 2 3}"
runs=runs/results
mkdir -p "$runs" docs

# One line per run: its name, then the arguments.
list_runs() {
  local seed world mode
  for seed in "${seeds[@]}"; do
    for world in "${worlds[@]}"; do
      for mode in slice volume; do
        echo "$world-$mode-$seed worlds/$world.sdf --uavs 4 --mode $mode --seed $seed"
      done
    done
    [[ -n ${DATA:-} ]] || continue
    local duplex="$DATA/buildings/duplex_office.sdf --box=-10,-10,0,10,10,4 --start=-9,0,0 --fov-deg 90x73.7 --range 5
      --vmax 2 --amax 3 --yaw-rate-deg 90 --yaw-acc-deg 90 --seed $seed"
    # shellcheck disable=SC2086  # meant to be split
    echo "duplex_office-volume-$seed" $duplex --mode volume
    # shellcheck disable=SC2086
    echo "duplex_office-slice-$seed" $duplex --mode slice --uavs 2
    echo "cubicle_office-volume-$seed $DATA/multi_uav/cubicle_office.pcd --box=-14.7,-15.7,0.5,15.6,15.1,2.0 --start=-13.5,0,1" \
      "--start=-13.5,-1,1 --start=-13.5,1,1 --start=-13.5,2,1 --sensor lidar --fov-deg 360x-7..45 --samples 20000 --range 10" \
      "--vmax 2 --amax 2 --yaw-rate-deg 60 --yaw-acc-deg 90 --mode volume --seed $seed"
  done
}

# shellcheck disable=SC2317  # called through xargs
one_run() {
  local program=$1 runs=$2 name=$3
  shift 3
  local folder=$runs/$name
  [[ -f $folder/metrics.json && ! -d $folder/checkpoint ]] && { echo "$name: there already"; return; }
  local command=("$program" explore "$@" --charge-planning off --quiet --out "$folder")
  [[ -d $folder ]] && command=("$program" explore --quiet --resume "$folder")
  if "${command[@]}" </dev/null >"$folder.log" 2>&1; then
    echo "$name: done"
  else
    echo "$name: failed, see $folder.log" >&2
    return 1
  fi
}
export -f one_run

status=0
list_runs | xargs -P "${JOBS:-$(nproc)}" -I '{}' bash -c "one_run '$program' '$runs' {} $*" || status=1
python3 scripts/results_table.py "$runs" docs/results.md
[[ $status -eq 0 ]] || echo "results.sh: some runs failed and are left out of the table" >&2
exit $status
