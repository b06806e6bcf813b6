#!/usr/bin/env bash
# Explores the six worlds in both modes with three seeds and writes docs/results.md. Finished runs are not repeated; a killed
# run is resumed. SEEDS="1" or WORLDS="duplex atrium" choose less; extra arguments go to `stairwell explore`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

program=build/release/bin/stairwell
[[ -x $program ]] || { echo "results.sh: $program is missing; run scripts/build.sh first" >&2; exit 1; }
read -r -a worlds <<<"${WORLDS:-office_tower duplex parking_garage warehouse atrium collapsed}"
read -r -a seeds <<<"${SEEDS:-1 2 3}"
modes=(slice volume)
runs=runs/results
mkdir -p "$runs" docs

total=$((${#worlds[@]} * ${#modes[@]} * ${#seeds[@]}))
done_runs=0
failed=0
for world in "${worlds[@]}"; do
  for mode in "${modes[@]}"; do
    for seed in "${seeds[@]}"; do
      done_runs=$((done_runs + 1))
      folder=$runs/$world-$mode-$seed
      label="[$done_runs/$total] $world $mode seed $seed"
      if [[ -f $folder/metrics.json && ! -d $folder/checkpoint ]]; then
        echo "$label: there already"
        continue
      fi
      echo "$label"
      command=("$program" explore "worlds/$world.sdf" --uavs 4 --mode "$mode" --seed "$seed" --out "$folder" "$@")
      if [[ -d $folder ]]; then
        command=("$program" explore --resume "$folder")
      fi
      if ! "${command[@]}" </dev/null >"$folder.log" 2>&1; then
        echo "$label: failed, see $folder.log" >&2
        failed=$((failed + 1))
      fi
    done
  done
done

python3 scripts/results_table.py "$runs" docs/results.md
if [[ $failed -gt 0 ]]; then
  echo "results.sh: $failed of $total runs failed and are left out of the table" >&2
  exit 1
fi
