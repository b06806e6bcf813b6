#!/usr/bin/env bash
# Makes the tables of exploration again: every row is a set of runs of `stairwell compare`, resumed where a former call stopped.
#   benchmarks/exploration.sh [--quick] [TABLE..]     tables: worlds baselines duplex cubicle c2 thesis map3d tower turns twelve
#   (default: all but twelve, which takes hours)
#   DATA=DIR     folder with buildings/, multi_uav/ and thesis/; without it only the own worlds are explored
#   SEEDS=1..10  JOBS=2  RUNS=runs/exploration  OUT=$RUNS/tables.md  PROGRAM=build/release/bin/stairwell
# --quick: seeds 1 and 2 only. Arguments after -- go to every `stairwell compare`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

program=${PROGRAM:-build/release/bin/stairwell}
runs=${RUNS:-runs/exploration}
out=${OUT:-$runs/tables.md}
seeds=${SEEDS:-1..10}
jobs=${JOBS:-$(nproc)}
data=${DATA:-}
wanted=()
while [[ $# -gt 0 ]]; do
  case $1 in
    --quick) seeds=1,2 ;;
    --) shift; break ;;
    -*) echo "exploration.sh: unknown option $1" >&2; exit 2 ;;
    *) wanted+=("$1") ;;
  esac
  shift
done
more=("$@")
[[ ${#wanted[@]} -gt 0 ]] || wanted=(worlds baselines duplex cubicle c2 thesis map3d tower turns)
[[ -x $program ]] || { echo "exploration.sh: $program is missing; run scripts/build.sh first" >&2; exit 1; }
mkdir -p "$runs" "$(dirname "$out")"
status=0

# sweep NAME HEADING ARGUMENTS..: one sweep and its section of the page; a table that fails is named, the others go on.
sweep() {
  local name=$1 heading=$2
  shift 2
  local command=(compare "$@" --seeds "$seeds" --jobs "$jobs" ${more[@]+"${more[@]}"})
  echo "== $name" >&2
  if ! "$program" "${command[@]}" --out "$runs/$name" >/dev/null; then
    echo "exploration.sh: $name: some runs failed" >&2
    status=1
  fi
  [[ -f $runs/$name/comparison.md ]] || return 0
  {
    printf '\n## %s\n\n    stairwell' "$heading"
    printf ' %s' "${command[@]//$data/DATA}"
    printf '\n\n'
    tail -n +5 "$runs/$name/comparison.md" | sed 's/^## /### /'
  } >>"$page"
}

need_data() {
  [[ -n $data ]] && return 0
  echo "exploration.sh: $1 needs DATA=DIR, left out" >&2
  return 1
}

# Without noise seeds differ by computing times alone; moved starts make other flights.
moved=(--start-spread 0.25)

table_worlds() {
  sweep worlds "Own worlds, slice against volume" worlds/{office_tower,duplex,parking_garage,warehouse,atrium,collapsed}.sdf \
    --modes slice,volume --uavs 4 "${moved[@]}"
}

table_baselines() {
  sweep baselines "Coverage strategies" worlds/duplex.sdf worlds/collapsed.sdf \
    --coverage frontiers,layers,kmeans,hybrid,nearest,greedy,lawnmower,random --uavs 2 "${moved[@]}"
}

duplex_task=(--box=-10,-10,0,10,10,4 --start=-9,0,0 --fov-deg 90x73.7 --range 5 --vmax 2 --amax 3 --yaw-rate-deg 90
  --yaw-acc-deg 90)
table_duplex() {
  need_data duplex || return 0
  sweep duplex "Duplex office (FALCON's), one UAV" "$data/buildings/duplex_office.sdf" "${duplex_task[@]}" \
    --coverage frontiers,nearest,greedy --uavs 1 "${moved[@]}"
}

cubicle_task=(--box=-14.7,-15.7,0.5,15.6,15.1,2.0 --start=-13.5,0,1 --start=-13.5,-1,1 --start=-13.5,1,1 --start=-13.5,2,1
  --sensor lidar --fov-deg 360x-7..45 --samples 20000 --range 10 --vmax 2 --amax 2 --yaw-rate-deg 60 --yaw-acc-deg 90)
table_cubicle() {
  need_data cubicle || return 0
  local spread
  for spread in 0 0.25; do
    sweep "cubicle-spread-$spread" \
      "Cubicle office (C2-Explorer's), strict: one shared map, Euclidean limits, to 99 %, starts moved by up to $spread m" \
      "$data/multi_uav/cubicle_office.pcd" "${cubicle_task[@]}" --target-coverage 0.99 --uavs 2,3,4 --start-spread "$spread"
  done
}

c2_rules=(--limits per-axis --radio-range 5 --finish frontier:1..1.5 --uavs 2,3,4 --bound off)
table_c2() {
  need_data c2 || return 0
  local spread  # 0: their starts. There the seeds differ in computing times alone; moved starts make other flights
  for spread in 0 0.25; do
    sweep "c2-spread-$spread" "Cubicle office by C2-Explorer's rules, starts moved by up to $spread m" \
      "$data/multi_uav/cubicle_office.pcd" "${cubicle_task[@]}" "${c2_rules[@]}" --start-spread "$spread"
    python3 benchmarks/metrics_table.py "$runs/c2-spread-$spread" last_motion_s finish_rule_met_s path_length_m coverage \
      >>"$page"
  done
}

table_turns() {
  sweep turns "Turn-taking, three UAVs" worlds/duplex.sdf worlds/collapsed.sdf --coverage frontiers,greedy \
    --vary turn_taking=off,on --uavs 3 --noise on --charge-planning off --bound off
}

# Made here, too large to keep.
table_twelve() {
  [[ -f $runs/twelve.sdf ]] ||
    "$program" world generate --storeys 12 --width 100 --depth 100 --storey-height 2.5 --seed 1 -o "$runs/twelve.sdf"
  sweep twelve "Twelve storeys of 100 x 100 m, eight UAVs" "$runs/twelve.sdf" --uavs 8 --sensor lidar \
    --fov-deg 360x-45..45 --range 15 --resolution 0.2 --rate-hz 2 --charge-planning off --bound off --threads 2 \
    --time-limit 20000
  python3 benchmarks/metrics_table.py "$runs/twelve" finish_s coverage plan_ms.p50 plan_ms.p99 wall_s peak_rss_mib >>"$page"
}

# The thesis's maps are plane: a slab 0.6 m thick, a UAV moves 0.12 m in a step of 0.1 s, it sees 3 m far.
thesis_task=(--uavs 4 --modes slice --layers 1 --box=0,0,0.7,20,20,1.3 --motion step --range 3 --charge-planning off --bound off
  --time-limit 600 --coverage layers,kmeans,hybrid)
table_thesis() {
  need_data thesis || return 0
  sweep thesis-360 "Thesis maps A and C, vision of 360 degrees" "$data/thesis/map_A.yaml" "$data/thesis/map_C.yaml" \
    "${thesis_task[@]}" --sensor lidar --fov-deg 360x-15..15
  sweep thesis-360-moved "The same, starts moved by up to 0.25 m" "$data/thesis/map_A.yaml" "$data/thesis/map_C.yaml" \
    "${thesis_task[@]}" --sensor lidar --fov-deg 360x-15..15 "${moved[@]}"
  sweep thesis-50 "Thesis maps A and C, vision of 50 degrees" "$data/thesis/map_A.yaml" "$data/thesis/map_C.yaml" \
    "${thesis_task[@]}" --sensor depth --fov-deg 50x30
  python3 benchmarks/thesis_table.py "$runs"/thesis-{360,360-moved,50} >>"$page"
}

table_map3d() {
  need_data map3d || return 0
  local starts=(--start=1,2,1 --start=8,8,2 --start=8,1,3 --start=1,8,4)
  sweep map3d-slice "The thesis's 3D map, slices at 1 to 4 m" "$data/thesis/map_3D.bt" "${starts[@]}" --modes slice \
    --layers 1,2,3,4 --uavs 4
  sweep map3d-volume "The thesis's 3D map, volume" "$data/thesis/map_3D.bt" "${starts[@]}" --modes volume --uavs 4
}

table_tower() {
  sweep tower "Office tower, one to eight UAVs" worlds/office_tower.sdf --uavs 1,2,4,8 "${moved[@]}"
}

page=$(mktemp "$runs/page-XXXXXX")
trap 'rm -f "$page"' EXIT
cat >"$page" <<'EOF'
# Exploration, measured

Made by `benchmarks/exploration.sh`. Means over the seeds with 95 % bootstrap intervals, times are simulated seconds; planning
time is charged unless the command says `--charge-planning off`. "bound" is `stairwell bound`: a fleet that knows the world.
What the columns mean: [metrics.md](metrics.md).
EOF
for table in "${wanted[@]}"; do
  declare -F "table_$table" >/dev/null || { echo "exploration.sh: unknown table $table" >&2; exit 2; }
  "table_$table"
done
chmod 644 "$page"
mv "$page" "$out"
trap - EXIT
echo "$out"
exit $status
