#!/usr/bin/env python3
"""Times whole bakes, from start to file: `vdbshade bake --max-error E`, and an Embree baker (bench/embree_bake.c) with the
number of rays that gives the same error. The error is the root mean square against 4096 rays a texel of another scramble, over
all texels that this truth calls valid, including values from padding. Three runs take turns: vdbshade, and Embree with the powers
of two below and above that number. The baker's seconds are interpolated between these.

Usage: tools/bench whole [OPTIONS]        all cells at 1024², into bench/results/MACHINE-whole.csv; an hour on two idle cores
       tools/bench whole --asset cloister --light ao --error 0.02 --csv cell.csv        one cell
       tools/bench whole --error-only     only errors; the machine need not be idle
       tools/bench whole --size 4096      a sun of 5° and AO, at the errors that matter there

Truths and the level are made once and kept in --work. Delete them there if the rasteriser, the rays' origins or the rules for valid
texels change."""
import argparse
import csv
import math
import os
import statistics
import subprocess
import sys
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
import lightmap

TRUTH_FRAME, MOST_RAYS = 1, 4096
SUN = "--sun=-0.5,0.8,-0.6"
LIGHTS = {"sun0.5": ("shadow.sun", [SUN, "--sun-angle", "0.5"]), "sun5": ("shadow.sun", [SUN, "--sun-angle", "5"]),
          "sun30": ("shadow.sun", [SUN, "--sun-angle", "30"]), "ao": ("ao", ["--ao", "0.6"])}
ASSETS = ("cloister", "smooth", "thin", "level")
ERRORS = (0.05, 0.02, 0.01, 0.005, 0.002)
LARGE = {"sun5": (0.02, 0.005, 0.002), "ao": (0.02, 0.01)}  # from 4096² on
COLUMNS = ["asset", "light", "size", "threads", "max_error", "texels", "rmse", "bias", "p99", "max", "wall_s", "cpu_s",
           "peak_mb", "embree_rays", "embree_wall_s", "embree_cpu_s", "embree_peak_mb", "wall_ratio", "cpu_ratio"]


class Run:
    """A finished process: its seconds, including those of its children, and its peak memory in MB."""

    def __init__(self, command):
        start = time.monotonic()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        said = process.stderr.read()
        _, status, used = os.wait4(process.pid, 0)
        self.wall, self.cpu = time.monotonic() - start, used.ru_utime + used.ru_stime
        self.peak = used.ru_maxrss / 1000
        if status != 0:
            sys.exit("whole: %s: status %d\n%s" % (" ".join(command), status, said[-2000:]))


class Cell:
    """An asset under one light at one size: its truth, and the error of Embree by number of rays."""

    def __init__(self, bench, asset, light):
        self.bench, self.asset, self.light = bench, asset, light
        self.path = bench.asset(asset)
        self.channel, self.options = LIGHTS[light]
        self.truth = os.path.join(bench.work, "truth-%s-%s-%d-%d.exr" % (asset, light, bench.size, bench.truth_rays))
        self.rmse = {}
        if not os.path.exists(self.truth):
            part = bench.file("truth.exr")
            Run(self.embree(bench.truth_rays, part, "--frame", str(TRUTH_FRAME)))
            os.rename(part, self.truth)

    def options_of(self, out):
        return [*self.options, "--size", str(self.bench.size), "--threads", str(self.bench.threads), "-o", out]

    def ours(self, error, out):
        return [os.path.join(self.bench.build, "vdbshade"), "bake", self.path, "--max-error", str(error), "--quiet",
                *self.options_of(out)]

    def embree(self, rays, out, *more):
        return [os.path.join(self.bench.build, "bench", "vsh_embree_bake"), self.path, "--rays", str(rays), *more,
                *self.options_of(out)]

    def compare(self, out):
        """Texels, RMSE, bias, 99th percentile and maximum."""
        return lightmap.compare(self.bench.vdbshade, self.truth, self.channel, out, self.channel)

    def embree_rmse(self, rays):
        if rays not in self.rmse:
            out = self.bench.file("embree.exr")
            Run(self.embree(rays, out))
            self.rmse[rays] = self.compare(out)[1]
        return self.rmse[rays]

    def rays_around(self, rmse):
        """Two successive powers of two of rays: the first has at least this error, the second less."""
        rays = 1
        while rays < MOST_RAYS // 4 and self.embree_rmse(2 * rays) > rmse:
            rays *= 2
        return rays, 2 * rays

    def measure(self, error):
        ours, embree = self.bench.file("ours.exr"), self.bench.file("embree.exr")
        first = Run(self.ours(error, ours))
        off = self.compare(ours)
        row = {"asset": self.asset, "light": self.light, "size": self.bench.size, "threads": self.bench.threads,
               "max_error": error, "texels": int(off[0]), "rmse": off[1], "bias": off[2], "p99": off[3], "max": off[4],
               "wall_s": first.wall, "cpu_s": first.cpu, "peak_mb": first.peak}
        if self.bench.repeat > 0:
            low, high = self.rays_around(off[1])
            rounds = [[Run(command) for command in (self.ours(error, ours), self.embree(low, embree),
                                                    self.embree(high, embree))] for _ in range(self.bench.repeat)]
            steps = math.log(self.embree_rmse(low) / off[1]) / math.log(self.embree_rmse(low) / self.embree_rmse(high))
            part = max(steps, 0.0)  # one ray already suffices
            row["embree_rays"] = low * 2 ** part
            row["embree_peak_mb"] = max(run[2].peak for run in rounds)
            for clock in ("wall", "cpu"):
                mine = [getattr(run[0], clock) for run in rounds]
                theirs = [getattr(a, clock) * (getattr(b, clock) / getattr(a, clock)) ** part for _, a, b in rounds]
                row[clock + "_s"], row["embree_" + clock + "_s"] = statistics.median(mine), statistics.median(theirs)
                row[clock + "_ratio"] = statistics.median(m / t for m, t in zip(mine, theirs))
        return row


class Bench:
    def __init__(self, asked):
        self.size, self.threads, self.repeat = asked.size, asked.threads, 0 if asked.error_only else asked.repeat
        self.truth_rays = asked.truth_rays
        self.build, self.work = os.path.join(ROOT, asked.build), asked.work
        self.vdbshade = lightmap.load(self.build)
        os.makedirs(self.work, exist_ok=True)

    def file(self, name):
        return os.path.join(self.work, "%d-%s" % (os.getpid(), name))

    def asset(self, name):
        if name in ("cloister", "smooth", "thin"):
            return os.path.join(ROOT, "assets", name + ".glb")
        path = os.path.join(self.work, name + ".glb")
        if not os.path.exists(path):
            triangles = "5000000" if name == "level5" else "1000000"
            subprocess.run([os.path.join(ROOT, "tools", "modelling", "make_level.py"), path, triangles], check=True)
        return path


def text(row, column):
    value = row.get(column, "")
    return "%.4g" % value if isinstance(value, float) and column != "rmse" else "%.6f" % value if column == "rmse" else value


def table(rows):
    """Prints the table of bench/README.md: a row for each scene and light, a column for each error."""
    errors = list(dict.fromkeys(row["max_error"] for row in rows))
    cells = {(row["asset"], row["light"], row["max_error"]): "%.4f%s, %.2f s%s" % (
        row["rmse"], "" if row["rmse"] <= row["max_error"] else " (!)", row["wall_s"],
        ", %.2f" % row["wall_ratio"] if "wall_ratio" in row else "") for row in rows}
    print("\nRMSE, seconds from start to file, and those over the Embree baker's at this RMSE:\n")
    print("| scene | light | " + " | ".join("%g" % error for error in errors) + " |")
    print("|---|---" + "|---" * len(errors) + "|")
    for asset, light in dict.fromkeys((row["asset"], row["light"]) for row in rows):
        print("| %s | %s | %s |" % (asset, light, " | ".join(cells.get((asset, light, e), "") for e in errors)))


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asset", action="append", choices=[*ASSETS, "level5"])
    parser.add_argument("--light", action="append", choices=list(LIGHTS))
    parser.add_argument("--error", action="append", type=float)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--repeat", type=int, default=3, help="timed rounds; the table has their medians")
    parser.add_argument("--truth-rays", type=int, default=4096, help="fewer if a large truth takes too long")
    parser.add_argument("--error-only", action="store_true")
    parser.add_argument("--build", default=os.environ.get("BUILD", "build-bench"))
    parser.add_argument("--work", default=os.path.join(ROOT, "build-bench", "whole"))
    parser.add_argument("--csv")
    return parser.parse_args()


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        name = next((line.split(":")[1] for line in file if line.startswith("model name")), "unknown")
    return "-".join("".join(c if c.isalnum() else " " for c in name.lower()).split())


def main():
    asked = parse()
    bench = Bench(asked)
    rows = []
    path = asked.csv or os.path.join(ROOT, "bench", "results", machine() + "-whole.csv")
    with open(path, "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(COLUMNS)
        for asset in asked.asset or ASSETS:
            for light in asked.light or (LARGE if asked.size >= 4096 else LIGHTS):
                cell = Cell(bench, asset, light)
                for error in asked.error or (LARGE.get(light, ERRORS) if asked.size >= 4096 else ERRORS):
                    rows.append(cell.measure(error))
                    out.writerow([text(rows[-1], column) for column in COLUMNS])
                    file.flush()
                    print("  ".join("%s %s" % (column, text(rows[-1], column)) for column in COLUMNS), flush=True)
    table(rows)
    for name in ("ours.exr", "embree.exr"):
        if os.path.exists(bench.file(name)):
            os.remove(bench.file(name))


main()
