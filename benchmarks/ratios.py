#!/usr/bin/env python3
"""ratios.py FOLDER OUT.json TABLE.md|-: medians and ratios of the Google Benchmark results in a folder."""

import json
import os
import pathlib
import statistics
import sys

RESOLUTIONS = ("0.10", "0.05")
SHAPES = ("sphere", "box", "ellipsoid", "cylinder")


def read(folder):
    """name -> {"ms", "real_ms": medians over the rounds, counters..., or "skipped": why}"""
    rounds = {}
    context = {}
    in_order = sorted(pathlib.Path(folder).glob("*.json"), key=lambda file: [int(n) for n in file.stem.split("-")])
    for file in in_order:
        try:
            content = json.loads(file.read_text())
        except json.JSONDecodeError as error:
            sys.exit(f"ratios.py: {file.name} is not what a benchmark writes: {error}")
        context = content["context"]
        for entry in content["benchmarks"]:
            name = entry["name"]
            for suffix in ("/real_time", "/manual_time"):
                name = name.removesuffix(suffix)
            name = name.split("/iterations:")[0]
            rounds.setdefault(name, []).append(entry)
    found = {}
    for name, entries in rounds.items():
        failed = [entry for entry in entries if entry.get("error_occurred")]
        if failed:
            found[name] = {"skipped": failed[0].get("error_message", "failed")}
            continue
        to_ms = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}[entries[0]["time_unit"]]
        manual = "manual_time" in entries[0]["name"]
        figures = {"ms": statistics.median(entry["real_time" if manual else "cpu_time"] for entry in entries) * to_ms,
                   "real_ms": statistics.median(entry["real_time"] for entry in entries) * to_ms,
                   "rounds": len(entries)}
        known = {"name", "family_index", "per_family_instance_index", "run_name", "run_type", "repetitions",
                 "repetition_index", "threads", "iterations", "real_time", "cpu_time", "time_unit"}
        for key in entries[0].keys() - known:
            if isinstance(entries[0][key], (int, float)):
                figures[key] = statistics.median(entry[key] for entry in entries)
        found[name] = figures
    return found, context


class Ratios:
    def __init__(self, found):
        self.found = found
        self.ratios = {}
        self.skipped = {}

    def get(self, name, figure="ms"):
        entry = self.found.get(name)
        return None if entry is None else entry.get(figure)

    def add(self, key, reference, ours, figure="ms"):
        """How many times faster than the reference."""
        for name in (reference, ours):
            if "skipped" in self.found.get(name, {}):
                self.skipped[key] = self.found[name]["skipped"]
                return
        above, below = self.get(reference, figure), self.get(ours, figure)
        if above is not None and below:
            self.ratios[key] = above / below

    def all(self):
        for r in RESOLUTIONS:
            for kind in ("exact", "discretize"):
                reference = f"integrate/{kind}/octomap/{r}"
                self.add(f"{kind}_{r}", reference, f"integrate/{kind}/avx512/{r}")
                self.add(f"{kind}_{r}_avx2", reference, f"integrate/{kind}/avx2/{r}")
                self.add(f"{kind}_{r}_scalar", reference, f"integrate/{kind}/scalar/{r}")
            self.add(f"threads_{r}", f"integrate/exact/best/{r}", f"integrate/exact/two_threads/{r}", "real_ms")
            for shape in SHAPES:
                ways = [f"collision/{way}/{shape}/{r}" for way in ("fcl", "fcl_indep", "fcl_boxes")]
                ways = [way for way in ways if self.get(way) is not None]
                if ways:  # FCL's fastest for this shape
                    fastest = min(ways, key=self.get)
                    self.add(f"collision_{r}_{shape}", fastest, f"collision/words/{shape}/{r}")
            worst = [self.ratios[f"collision_{r}_{shape}"] for shape in SHAPES if f"collision_{r}_{shape}" in self.ratios]
            if worst:
                self.ratios[f"collision_{r}"] = min(worst)
            self.add(f"edt_update_{r}", f"distance/update/dynamicEDT3D/{r}", f"distance/update/occupied/{r}")
            step = self.get(f"step/{r}", "p50_ms")
            if step is not None:
                self.ratios[f"step_ms_{r}"] = step
        self.add("scale_100_over_1", "scale/ours/100", "scale/ours/1")
        self.add("scale_100_over_1_octomap", "scale/octomap/100", "scale/octomap/1")
        return self


BARS = [
    # what, reference, keys at 0.10 and 0.05, bars, unit
    ("exact, one thread, AVX-512", "OctoMap", "exact_{r}", (12, 37), "x"),
    ("exact, one thread, AVX2", "OctoMap", "exact_{r}_avx2", (8, 25), "x"),
    ("exact, one thread, scalar", "OctoMap", "exact_{r}_scalar", (5, 15), "x"),
    ("discretize, one thread, AVX-512", "OctoMap", "discretize_{r}", (18, 45), "x"),
    ("discretize, one thread, AVX2", "OctoMap", "discretize_{r}_avx2", (None, None), "x"),
    ("discretize, one thread, scalar", "OctoMap", "discretize_{r}_scalar", (None, None), "x"),
    ("two threads over one, exact", "one thread", "threads_{r}", (1.7, 1.7), "x"),
    ("collision check, slowest shape", "FCL's fastest way", "collision_{r}", (9, 9), "x"),
    ("distance-field update, 2 m", "dynamicEDT3D", "edt_update_{r}", (8, 8), "x"),
    ("depth pixels to potential, median", "-", "step_ms_{r}", (12, 25), "ms"),
]


def cell(ratios, skipped, key, bar, unit):
    if key in skipped:
        return f"skipped: {skipped[key]}"
    if key not in ratios:
        return "-"
    value = ratios[key]
    text = f"{value:.1f} {unit}"
    if bar is None:
        return text
    reached = value >= bar if unit == "x" else value <= bar
    sign = ">=" if unit == "x" else "<="
    return f"{text} ({sign} {bar}{'' if reached else ', not reached'})"


def table(result):
    lines = ["# Benchmarks", "",
             "Made by `benchmarks/run.sh OUT.json`. Every benchmark has a process of its own; figures are medians over "
             f"{result['rounds']} round{'' if result['rounds'] == 1 else 's'} through all of them.",
             "Processor time, but for threads (elapsed time). In brackets: what was aimed at. Scans: 320x240 pixels,",
             "90 x 73.7 degrees, 8 m, in `worlds/office_tower.sdf`: 48 places all over it (integration, distance), and a "
             "flight of 240 (step).",
             "Maps of all ways are byte for byte the same (`tests/mapping/scan_integrator_test.cpp`).", "",
             f"Machine: {result['machine']}.", "",
             "| what | against | 0.10 m | 0.05 m |", "|---|---|---|---|"]
    for what, reference, key, bars, unit in BARS:
        cells = [cell(result["ratios"], result["skipped"], key.format(r=r), bar, unit)
                 for r, bar in zip(RESOLUTIONS, bars)]
        lines.append(f"| {what} | {reference} | {cells[0]} | {cells[1]} |")
    lines += ["", "## Time and memory", "",
              "Milliseconds a scan (integrate, distance) or a check, and the growth of resident memory.", "",
              "| benchmark | ms | resident MiB |", "|---|---|---|"]
    for name, figures in result["benchmarks"].items():
        if "skipped" in figures:
            lines.append(f"| {name} | skipped: {figures['skipped']} | |")
            continue
        ms = figures["ms"] / figures.get("scans", 1)
        rss = f"{figures['rss_MiB']:.0f}" if "rss_MiB" in figures else ""
        lines.append(f"| {name} | {ms:.4g} | {rss} |")
    growth = result["ratios"].get("scale_100_over_1")
    if growth is not None:
        lines += ["", "A scan into a map of a hundred explored buildings (`scale/`) costs "
                  f"{growth:.2f} times what it costs into a map of one; OctoMap: "
                  f"{result['ratios'].get('scale_100_over_1_octomap', float('nan')):.2f}."]
    return "\n".join(lines) + "\n"


def write(path, text):
    """Complete or not at all."""
    temporary = f"{path}.tmp"
    with open(temporary, "w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, path)


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    found, context = read(sys.argv[1])
    ratios = Ratios(found).all()
    cpu = "unknown processor"
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            cpu = line.split(":", 1)[1].strip()
    result = {"machine": f"{cpu}, {context.get('num_cpus', '?')} cores",
              "rounds": max((entry.get("rounds", 0) for entry in found.values()), default=0),
              "ratios": ratios.ratios, "skipped": ratios.skipped, "benchmarks": found}
    result.update(ratios.ratios)  # by name at the top as well
    write(sys.argv[2], json.dumps(result, indent=1) + "\n")
    text = table(result)
    if sys.argv[3] == "-":
        print(text, end="")
    else:
        write(sys.argv[3], text)
        print(f"{sys.argv[2]}: {len(found)} benchmarks; {sys.argv[3]} written")


if __name__ == "__main__":
    main()
