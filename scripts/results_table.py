#!/usr/bin/env python3
"""results_table.py RUNS_DIR OUT.md: one table of the metrics.json files below RUNS_DIR."""
import json
import os
import pathlib
import statistics
import sys

HEAD = """# Results

Six own worlds in both modes with four UAVs, and two buildings of published explorers. Made by `scripts/results.sh` (with
`DATA=DIR` for the latter) and the release preset, two runs side by side, planning time not charged; every run folder keeps its
configuration and seed. Coverage is observed over explorable volume (see [metrics.md](metrics.md)); times are simulated
seconds. "plan" and "wall" are what the computer took, on two cores with other programs at work on them: only they change
when the table is made again. Published rules and maps, more UAVs, turns and the building of
twelve storeys: [exploration.md](exploration.md), each with its command.

"""
COLUMNS = [
    ("world", lambda m: pathlib.PurePath(str(m.get("world", "?"))).stem),
    ("mode", lambda m: m.get("mode", "?")),
    ("UAVs", lambda m: m.get("uavs", "?")),
    ("seed", lambda m: m.get("seed", "?")),
    ("coverage", lambda m: number(m, "coverage", "{:.3f}")),
    ("t50 s", lambda m: number(m, "t50_s", "{:.0f}")),
    ("t90 s", lambda m: number(m, "t90_s", "{:.0f}")),
    ("t95 s", lambda m: number(m, "t95_s", "{:.0f}")),
    ("t99 s", lambda m: number(m, "t99_s", "{:.0f}")),
    ("finish s", lambda m: number(m, "finish_s", "{:.0f}")),
    ("path m", lambda m: number(m, "path_length_m", "{:.0f}")),
    ("d mean m", lambda m: number(m, "mean_uav_distance_m", "{:.1f}")),
    ("d min m", lambda m: number(m, "min_uav_distance_m", "{:.2f}")),
    ("collisions", lambda m: number(m, "collisions", "{:.0f}")),
    ("plan p50 / p99 ms", lambda m: number(m.get("plan_ms") or {}, "p50", "{:.0f}") + " / "
     + number(m.get("plan_ms") or {}, "p99", "{:.0f}")),
    ("wall s", lambda m: number(m, "wall_s", "{:.0f}")),
    ("ended", lambda m: m.get("stop_reason", "?")),
]


def number(metrics, key, pattern):
    value = metrics.get(key)
    return pattern.format(value) if isinstance(value, (int, float)) else "-"


def row(cells):
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |\n"


def load(folder):
    found = []
    for file in sorted(folder.glob("*/metrics.json")):
        if (file.parent / "checkpoint").exists():  # interrupted, to be resumed
            continue
        try:
            found.append(json.loads(file.read_text()))
        except (OSError, ValueError) as error:
            print(f"{file}: left out: {error}", file=sys.stderr)
    return found


def summary(runs):
    """Mean and spread over the seeds, per world and mode."""
    groups = {}
    for run in runs:
        groups.setdefault((COLUMNS[0][1](run), str(run.get("mode"))), []).append(run)
    text = row(["world", "mode", "runs", "coverage mean (least)", "t90 s mean", "finish s mean", "collisions"])
    text += row(["---"] * 7)
    for (world, mode), members in sorted(groups.items()):
        def values(key):
            return [run[key] for run in members if isinstance(run.get(key), (int, float))]

        def mean(key, pattern):
            return pattern.format(statistics.fmean(values(key))) if len(values(key)) == len(members) else "-"

        least = f" ({min(values('coverage')):.3f})" if values("coverage") else ""
        text += row([world, mode, len(members), mean("coverage", "{:.3f}") + least, mean("t90_s", "{:.0f}"),
                     mean("finish_s", "{:.0f}"), f"{sum(values('collisions')):.0f}"])
    return text


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    runs = load(pathlib.Path(sys.argv[1]))
    if not runs:
        sys.exit(f"{sys.argv[1]}: no finished runs")
    text = HEAD + "## Over the seeds\n\n" + summary(runs) + "\n## Every run\n\n"
    text += row([name for name, _ in COLUMNS]) + row(["---"] * len(COLUMNS))
    for run in sorted(runs, key=lambda m: (COLUMNS[0][1](m), str(m.get("mode")), m.get("seed", 0))):
        text += row([cell(run) for _, cell in COLUMNS])
    out = pathlib.Path(sys.argv[2])
    temporary = out.with_name(out.name + ".tmp")
    temporary.write_text(text)
    os.replace(temporary, out)
    print(f"{out}: {len(runs)} runs")


if __name__ == "__main__":
    main()
