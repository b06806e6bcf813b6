#!/usr/bin/env python3
"""metrics_table.py SWEEP_DIR METRIC..: chosen metrics of a sweep (comparison.json) as Markdown, means with 95 % intervals."""
import json
import pathlib
import sys


def cell(row, key):
    value = row.get(key) or {}
    if value.get("mean") is None:
        return "-"
    low, high = value["ci95"]
    return f"{value['mean']:.1f} [{low:.1f}, {high:.1f}]"


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    folder, metrics = pathlib.Path(sys.argv[1]), sys.argv[2:]
    print("\n| world | UAVs | strategy | seeds | " + " | ".join(metrics) + " |")
    print("|" + " --- |" * (4 + len(metrics)))
    for row in json.loads((folder / "comparison.json").read_text()):
        strategy = " ".join(filter(None, (row["mode"], row["coverage_strategy"], row.get("variant", ""))))
        cells = [row["world"], str(row["uavs"]), strategy, str(len(row["seeds"]))]
        print("| " + " | ".join(cells + [cell(row, metric) for metric in metrics]) + " |")


if __name__ == "__main__":
    main()
