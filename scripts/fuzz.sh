#!/usr/bin/env bash
# fuzz.sh [seconds [target...]]: builds the libFuzzer programs of tests/fuzz (preset fuzz) and runs each for that long
# (default 60) from its kept corpus. Exit code 1 when a kept input fails, 3 when the search finds a new one that does, which is
# kept in <build>/findings/ and printed. New inputs gather in <build>/corpus/; `fuzz.sh --merge` takes what they add to the
# corpus. FUZZ_BUILD_DIR names another build folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build=${FUZZ_BUILD_DIR:-build/fuzz}
seconds=60
if [[ $# -gt 0 ]]; then
  seconds=$1
  shift
fi
targets=("$@")
[[ ${#targets[@]} -gt 0 ]] || targets=(fuzz_integrator fuzz_map_readers)
if [[ "$seconds" == 0 ]]; then
  echo "fuzz.sh: skipped (0 seconds)"
  exit 0
fi

if ! command -v clang++-14 >/dev/null ||
  [[ ! -e "$(clang++-14 -print-runtime-dir)/libclang_rt.fuzzer-$(uname -m).a" ]]; then
  echo "fuzz.sh: skipped: clang-14 and libclang-rt-14-dev are not installed" >&2
  exit 0
fi

cmake --preset fuzz -B "$build" >/dev/null
cmake --build "$build" -j "$(nproc)" --target "${targets[@]}"

# The largest sound input needs some 100 MB; one that asks for more is a finding, as is one that takes a minute.
limits=(-rss_limit_mb=3000 -malloc_limit_mb=1000 -timeout=60 -max_len=4000)
# Short stacks and a small quarantine: OctoMap's recursion fills memory with distinct stacks otherwise.
export ASAN_OPTIONS=${ASAN_OPTIONS:-malloc_context_size=4:quarantine_size_mb=64}
mkdir -p "$build/findings"

# What went wrong with a target, and the input, so that a log is enough to run it again.
tell() {
  local input
  grep -aE '^fuzzer: |ERROR: |SUMMARY: |Test unit written' "$build/$1.log" || tail -n 5 "$build/$1.log"
  input=$(sed -n 's/.*Test unit written to //p' "$build/$1.log" | tail -n 1)
  if [[ -f "$input" ]]; then
    echo "the input (base64 -d | gunzip):"
    gzip -9nc "$input" | base64
  fi
}

failed=0
summary=""
for target in "${targets[@]}"; do
  kept=tests/fuzz/corpus/$target
  found=$build/corpus/$target
  mkdir -p "$found"
  if [[ "$seconds" == --merge ]]; then
    merged=$(mktemp -d "$build/merged-XXXXXX")
    "$build/bin/$target" -merge=1 -use_counters=0 "${limits[@]}" "$merged" "$kept" "$found" 2>"$build/$target.log" || failed=1
    rm -rf "$kept" && mv "$merged" "$kept" && chmod 755 "$kept"
    summary+="$target: $(find "$kept" -type f | wc -l) files, $(du -sb "$kept" | cut -f1) bytes"$'\n'
    continue
  fi
  status=0
  "$build/bin/$target" "${limits[@]}" -runs=0 -artifact_prefix="$build/findings/$target-" "$kept" \
    >"$build/$target.log" 2>&1 || status=$?
  if [[ $status -ne 0 ]]; then
    failed=1
    summary+="$target: A KEPT INPUT FAILS (see $build/$target.log)"$'\n'
    tell "$target"
    continue
  fi
  "$build/bin/$target" "${limits[@]}" -max_total_time="$seconds" -print_final_stats=1 \
    -artifact_prefix="$build/findings/$target-" "$found" "$kept" >"$build/$target.log" 2>&1 || status=$?
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$build/$target.log")
  counts=$(grep -aoE 'cov: [0-9]+ ft: [0-9]+' "$build/$target.log" | tail -n 1 || true)
  summary+="$target: ${runs:-?} executions, ${counts:-no coverage}, "
  if [[ $status -eq 0 ]]; then
    summary+="nothing found"$'\n'
  else
    [[ $failed -ne 0 ]] || failed=3
    summary+="FINDING (see $build/$target.log, input in $build/findings/)"$'\n'
    tell "$target"
  fi
done
printf '%s' "$summary"
exit $failed
