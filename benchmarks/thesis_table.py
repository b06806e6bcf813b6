#!/usr/bin/env python3
"""thesis_table.py SWEEP_DIR..: the rows of the thesis's table 6.2 beside those of sweeps over its maps, as Markdown.

A step of the thesis is 0.1 s here.
"""
import json
import pathlib
import sys

STEP_S = 0.1
THESIS = [  # table 6.2: strategy, map, A %, mean distance, its deviation, least distance, t50, t70, t80
    ("thesis, k-means", "map_A", 95.0, 9.51, 3.36, 1.18, 96, 169, 246),
    ("thesis, learned + k-means", "map_A", 93.6, 10.27, 3.24, 1.62, 82, 148, 228),
    ("thesis, k-means", "map_C", 93.2, 9.94, 3.95, 1.16, 96, 161, 230),
    ("thesis, learned + k-means", "map_C", 93.3, 9.64, 3.35, 2.34, 84, 140, 255),
]


def mean(row, key, scale, pattern):
    value = (row.get(key) or {}).get("mean")
    return "-" if value is None else pattern.format(scale * value)


def line(cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    rows = [(row[1], line((row[0], row[1], "", *row[2:]))) for row in THESIS]
    for folder in map(pathlib.Path, sys.argv[1:]):
        for row in json.loads((folder / "comparison.json").read_text()):
            cells = [row["coverage_strategy"], row["world"], folder.name.removeprefix("thesis-"),
                     mean(row, "coverage", 100, "{:.1f}"), mean(row, "mean_uav_distance_m", 1, "{:.2f}"),
                     mean(row, "std_uav_distance_m", 1, "{:.2f}"), mean(row, "min_uav_distance_m", 1, "{:.2f}")]
            cells += [mean(row, key, 1 / STEP_S, "{:.0f}") for key in ("t50_s", "t70_s", "t80_s")]
            rows.append((row["world"], line(cells)))
    print("\n### Beside the thesis's table 6.2\n")
    print(line(["strategy", "map", "vision (degrees)", "A %", "distance m", "its sd m", "least m", "t50 steps", "t70", "t80"]))
    print(line(["---"] * 10))
    for _, text in sorted(rows, key=lambda row: row[0]):
        print(text)


if __name__ == "__main__":
    main()
