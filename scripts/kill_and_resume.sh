#!/usr/bin/env bash
# Kills a run with SIGKILL ten times at random moments, resumes it each time, and compares its coverage with that of a run left
# alone. KILLS=10 SEED=1; extra arguments go to `stairwell explore`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

program=${PROGRAM:-build/release/bin/stairwell}
kills=${KILLS:-10}
RANDOM=${SEED:-1}
folder=$(mktemp -d runs/kill-XXXXXX 2>/dev/null || { mkdir -p runs && mktemp -d runs/kill-XXXXXX; })
explore=("$program" explore worlds/duplex.sdf --uavs 2 --charge-planning off --set checkpoint_period_s=0.2 --quiet "$@")

coverage_of() { sed -n 's/^ *"coverage": *\([0-9.]*\),\{0,1\}$/\1/p' "$1/metrics.json"; }

"${explore[@]}" --out "$folder/alone" >/dev/null
command=("${explore[@]}" --out "$folder/killed")
for ((i = 1; i <= kills; ++i)); do
  "${command[@]}" >/dev/null 2>&1 &
  process=$!
  sleep "$((RANDOM % 2)).$((RANDOM % 9 + 1))"
  if ! kill -KILL "$process" 2>/dev/null; then echo "the run ended by itself before kill $i"; fi
  wait "$process" 2>/dev/null || true
  [[ -d $folder/killed ]] && command=("$program" explore --quiet --resume "$folder/killed")
  echo "killed $i of $kills"
done
"${command[@]}" >/dev/null
alone=$(coverage_of "$folder/alone")
killed=$(coverage_of "$folder/killed")
echo "coverage alone $alone, killed $kills times and resumed $killed ($folder)"
awk -v a="$alone" -v b="$killed" 'BEGIN { exit (a - b > 0.01 || b - a > 0.01) }'
