#!/usr/bin/env python3
"""`auto` against every named method: the error that a given time leaves, the choice of the method included.

    bench-auto.py PROGRAM FOLDER [--seconds S] [--size N] [--only SCENE] [--table FILE]

PROGRAM is caustica; references and the best of each grid are kept in FOLDER, so that a second run only judges. For each scene
there is a grid of methods: every integrator, with light paths a pass in three numbers, and with the default merge radius, half of
it and twice. Cells are cut by halves: each is rendered for an eighth of the time, the best eight for half of it, of these the best
two for all of it with two seeds. The best of them is judged by two other seeds, against `auto` with the same seeds and time. The
error is relMSE against a reference by `vavcm` with another seed; the efficiency is 1 / (relMSE x seconds). Light that `auto`
misses shows in the block test of `compare` against that reference: blocks that differ by more than noise. Prints a table in
Markdown."""
import argparse
import hashlib
import json
import os
import statistics
import subprocess
import sys

from auto_scenes import SCENES

THREADS = 2
ALONE = ("path",)
CONNECTING = ("light", "bdpt", "bdpt:strategies=no-splat")
MERGING = ("ppm", "bdpm", "vcm", "vcm-plus", "vcm-star", "ovcm", "cavcm", "vavcm", "qmcppm")
LIGHT_PATHS, RADII = (0.25, 1, 4), (0.5, 1, 2)  # of the usual number; of the default radius
HALVES, FINALISTS = 8, 2
CHOOSING_SEEDS, JUDGING_SEEDS = (101, 102), (201, 202)
REFERENCE_SEED, REFERENCE_TIMES = 9001, 12      # times the time of a render


class Bench:
    def __init__(self, options):
        self.options = options
        os.makedirs(options.folder, exist_ok=True)

    def path(self, name):
        return os.path.join(self.options.folder, name)

    def render(self, scene, method, seconds, seed, out):
        """The statistics of a render."""
        size = f"{self.options.size}x{self.options.size}"
        command = [self.options.program, "render", scene, "-i", method, "--time", str(seconds), "--seed", str(seed),
                   "--threads", str(THREADS), "--resolution", size, "-o", out, "--stats", self.path("stats.json"), "--quiet"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit("bench-auto: " + done.stderr)
        with open(self.path("stats.json")) as file:
            return json.load(file)

    def key(self, scene):
        return f"{hashlib.sha256(open(scene, 'rb').read()).hexdigest()[:12]}-{self.options.size}"

    def reference(self, scene):
        path = self.path(f"reference-{self.key(scene)}.exr")
        if not os.path.exists(path):
            self.render(scene, "vavcm", REFERENCE_TIMES * self.options.seconds, REFERENCE_SEED, path)
        return path

    def cost(self, scene, method, seconds, seed):
        """relMSE x seconds, the statistics, and the block test (None: not done)."""
        out = self.path("render.exr")
        stats = self.render(scene, method, seconds, seed, out)
        command = [self.options.program, "compare", out, "--reference", self.reference(scene), "--stats", self.path("compare.json")]
        done = subprocess.run(command, capture_output=True, text=True)
        if not os.path.exists(self.path("compare.json")):
            sys.exit("bench-auto: " + done.stderr)
        with open(self.path("compare.json")) as file:
            image = json.load(file)["images"][0]
        os.remove(self.path("compare.json"))
        return image["relmse"] * stats["seconds"], stats, image["block_test"]

    def radius_of(self, scene, method):
        stats = self.render(scene, method, 1e-3, 1, self.path("render.exr"))
        return stats["integrator"]["parameters"].get("radius") or stats.get("radius")

    def grid(self, scene):
        pixels = self.options.size ** 2
        cells = list(ALONE)
        for method in CONNECTING:
            join = "," if ":" in method else ":"
            cells += [f"{method}{join}light_paths={round(f * pixels)}" for f in LIGHT_PATHS]
        for method in MERGING:
            for f in LIGHT_PATHS:
                for r in RADII:
                    radius = "" if r == 1 else f",radius={r * self.default_radius(scene, method):.6g}"
                    cells.append(f"{method}:light_paths={round(f * pixels)}{radius}")
        return cells

    def default_radius(self, scene, method):
        known = self.__dict__.setdefault("radii", {})
        if (scene, method) not in known:
            known[scene, method] = self.radius_of(scene, method)
        return known[scene, method]

    def best_of_grid(self, scene):
        """The method that the grid finds, or that it found before."""
        path = self.path(f"best-{self.key(scene)}-{self.options.seconds:g}.txt")
        if not os.path.exists(path):
            best = self.search_grid(scene)
            with open(path, "w") as file:
                file.write(best + "\n")
        return open(path).read().strip()

    def search_grid(self, scene):
        cells, seconds = self.grid(scene), self.options.seconds
        def ranked(names, share, seeds):
            costs = {n: statistics.mean(self.cost(scene, n, share * seconds, s)[0] for s in seeds) for n in names}
            return sorted(names, key=costs.get)
        cells = ranked(cells, 1 / 8, CHOOSING_SEEDS[:1])[:HALVES]
        cells = ranked(cells, 1 / 2, CHOOSING_SEEDS[:1])[:FINALISTS]
        return ranked(cells, 1, CHOOSING_SEEDS)[0]

    def compare(self, scene):
        best = self.best_of_grid(scene)
        autos = [self.cost(scene, "auto", self.options.seconds, s) for s in JUDGING_SEEDS]
        bests = [self.cost(scene, best, self.options.seconds, s)[0] for s in JUDGING_SEEDS]
        auto = statistics.mean(cost for cost, _, _ in autos)
        return statistics.mean(bests) / auto, best, autos[0][1]["method"]["reason"], [test for _, _, test in autos]


def told(tests):
    """Blocks that differ in each picture, and the least p value."""
    if None in tests:
        return "not done"
    blocks = ", ".join(f"{test['rejected']}" for test in tests)
    return f"{blocks} of {tests[0]['blocks']} (p = {min(test['p_value'] for test in tests):.2g})"


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--only")
    parser.add_argument("--table")
    options = parser.parse_args()
    bench = Bench(options)
    lines = ["| scene | `auto` over the best | the best of the grid | `auto` chose | blocks that differ |", "|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    ratios = []
    for name, file in SCENES:
        if options.only and options.only not in name:
            continue
        ratio, best, reason, tests = bench.compare(file)
        ratios.append(ratio)
        lines.append(f"| {name} | {ratio:.2f} | `{best}` | {reason} | {told(tests)} |")
        print(lines[-1], flush=True)
    print(f"\nmedian {statistics.median(ratios):.2f}, least {min(ratios):.2f}")
    if options.table:
        with open(options.table, "w") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
