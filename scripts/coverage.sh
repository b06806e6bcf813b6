#!/usr/bin/env bash
# Builds with the coverage preset, runs the tests and prints the share of executed lines per folder and in all.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/build.sh coverage
find build/coverage -name '*.gcda' -delete
ctest --test-dir build/coverage --output-on-failure --parallel 2 "$@"

folders=(core sim3d perception mapping planning3d coverage3d explore apps)
if command -v gcovr >/dev/null; then
  filters=()
  for folder in "${folders[@]}"; do filters+=(--filter "$folder/"); done
  exec gcovr --root . "${filters[@]}" build/coverage
fi

root=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
# gcov's summary is a "File" line followed by "Lines executed:P% of N"; a file may come up once per object that includes it,
# and then its best covered object counts.
find "$root/build/coverage" -name '*.gcda' -print0 |
  xargs -0 -r gcov --no-output --source-prefix "$root" --relative-only 2>/dev/null |
  awk -v wanted="${folders[*]}" '
    BEGIN { count = split(wanted, order, " "); for (i in order) known[order[i]] = 1 }
    /^File / { split($0, quoted, "\047"); file = quoted[2]; next }
    /^Lines executed:/ && file != "" {
      split($0, part, /[:% ]+/)
      lines = part[5]; hit = lines * part[3] / 100
      split(file, path, "/")
      if (path[1] in known && (!(file in best) || hit > best[file])) { best[file] = hit; size[file] = lines }
      file = ""
    }
    END {
      for (file in best) {
        split(file, path, "/")
        hits[path[1]] += best[file]; sizes[path[1]] += size[file]; hit_all += best[file]; size_all += size[file]
      }
      printf "%-12s %8s %8s\n", "folder", "lines", "executed"
      for (i = 1; i <= count; ++i)
        if (sizes[order[i]] > 0)
          printf "%-12s %8d %7.1f %%\n", order[i], sizes[order[i]], 100 * hits[order[i]] / sizes[order[i]]
      if (size_all == 0) { print "no coverage data" > "/dev/stderr"; exit 1 }
      printf "%-12s %8d %7.1f %%\n", "all", size_all, 100 * hit_all / size_all
    }'
