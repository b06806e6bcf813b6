#!/usr/bin/env bash
# run.sh [--quick] OUT.json: builds the benchmarks, runs each one in a process of its own, and writes the ratios by name
# and every figure to OUT.json; the table goes to docs/benchmarks.md (with --quick to standard output only).
#   --quick       one round, the shortest time each (about 4 minutes); otherwise three rounds (about 20 minutes)
#   ROUNDS=N      rounds instead of three
#   FILTER=regex  only benchmarks whose names match; the table is not written then
# Rounds go through all benchmarks in turn, so that a slow spell of the machine meets ours and the references alike; the
# figures are medians over the rounds.
set -euo pipefail
invoked_from=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  sed -n '2,9s/^# \{0,1\}//p' "benchmarks/run.sh" >&2
  exit 2
}

rounds=${ROUNDS:-3}
min_time=0.5
quick=0
if [[ ${1:-} == --quick ]]; then
  quick=1
  rounds=1
  min_time=0.01
  shift
fi
[[ $# -eq 1 && $1 != -* ]] || usage
out=$1
[[ $out == /* ]] || out=$invoked_from/$out
[[ -d $(dirname "$out") && -w $(dirname "$out") ]] || { echo "run.sh: cannot write into $(dirname "$out")" >&2; exit 2; }

scripts/install_deps.sh
if ! dpkg-query -W -f='${db:Status-Status}' libbenchmark-dev 2>/dev/null | grep -q '^installed$'; then
  echo "run.sh: Google Benchmark is missing; as root: apt-get install libbenchmark-dev" >&2
  exit 1
fi
cmake --preset release -DSTAIRWELL_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release -j "$(nproc)" --target benchmarks

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: >"$work/names"
for program in build/release/bin/benchmark_*; do
  "$program" --benchmark_list_tests 2>/dev/null | sed "s|^|$program |" >>"$work/names"
done
grep -E " .*${FILTER:-.}" "$work/names" >"$work/chosen" || { echo "run.sh: no benchmark matches '$FILTER'" >&2; exit 2; }
total=$(($(wc -l <"$work/chosen") * rounds))
done=0
for ((round = 1; round <= rounds; ++round)); do
  while read -r program name; do
    done=$((done + 1))
    if [[ -t 2 ]]; then
      printf '\r\033[K%d/%d %s' "$done" "$total" "$name" >&2
    fi
    "$program" --benchmark_filter="^$name\$" --benchmark_min_time="$min_time" --benchmark_format=json \
      >"$work/$round-$done.json" 2>"$work/errors" || { cat "$work/errors" >&2; exit 1; }
  done <"$work/chosen"
done
[[ -t 2 ]] && printf '\r\033[K' >&2

table=docs/benchmarks.md
[[ $quick -eq 1 || -n ${FILTER:-} ]] && table=-
python3 benchmarks/ratios.py "$work" "$out" "$table"
