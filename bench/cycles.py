#!/usr/bin/env python3
"""Compares Blender's Cycles with vdbshade (--max-error alone) and the Embree baker: sun and AO of the sample asset at 1024², whole
processes on all cores. Errors are against Embree's rays, over valid texels. Skips Cycles if Blender is not installed.

Usage: tools/bench cycles [CSV]     (bench/results/cycles.csv)
Environment: SAMPLES="1 4 16 64 256" of Cycles, SIZE=1024, REPEAT=3 (rounds of vdbshade and Embree; the table has medians),
WORK=a folder that keeps the images."""
import csv
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
import lightmap

ASSET = os.path.join(ROOT, "assets", "cloister.glb")
SUN, ANGLE, DISTANCE = "-0.5,0.8,-0.6", "5", "0.6"
SIZE = os.environ.get("SIZE", "1024")
SAMPLES = [int(n) for n in os.environ.get("SAMPLES", "1 4 16 64 256").split()]
REPEAT = int(os.environ.get("REPEAT", "3"))
BUILD = os.path.join(ROOT, os.environ.get("BUILD", "build-bench"))
BENCH = os.path.join(BUILD, "bench")
CORES = str(len(os.sched_getaffinity(0)))
LIGHTS = ["--sun=" + SUN, "--sun-angle", ANGLE, "--ao", DISTANCE, "--size", SIZE]
CHANNELS = ("shadow.sun", "ao")

# The runs beside Cycles: name and command.
VDBSHADE = [os.path.join(BUILD, "vdbshade"), "bake", ASSET, "--quiet", *LIGHTS, "--max-error"]
EMBREE = [os.path.join(BENCH, "vsh_embree_bake"), ASSET, *LIGHTS, "--rays"]
TRIED = [("vdbshade %g" % e, [*VDBSHADE, str(e)]) for e in (0.2, 0.1, 0.05, 0.02, 0.01, 0.005)]
TRIED += [("embree %d" % n, [*EMBREE, str(n)]) for n in (4, 16, 64, 256)]


def run(command, **options):
    """Wall and processor seconds of a process, including its children."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    wall, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit("cycles: %s: exit code %d\n%s" % (" ".join(command), done.returncode, done.stdout[-2000:]))
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def error(truth, channel, path, of_file, valid):
    """RMSE and bias of a file's channel over valid texels."""
    return lightmap.compare(lightmap.load(BUILD), truth, channel, path, of_file, valid)[1:3]


class Table:
    COLUMNS = ["what", "wall_s", "cpu_s", "shadow_rmse", "shadow_bias", "ao_rmse", "ao_bias"]

    def __init__(self, path):
        self.file = open(path, "w", newline="", encoding="utf-8")
        self.csv = csv.writer(self.file)
        self.csv.writerow(self.COLUMNS)
        print("%-26s" % self.COLUMNS[0] + "".join("%*s" % (len(name) + 2, name) for name in self.COLUMNS[1:]))

    def row(self, what, *values):
        texts = ["%.3f" % v if i < 2 else "%.5f" % v for i, v in enumerate(values)]
        self.csv.writerow([what] + texts)
        self.file.flush()
        print("%-26s" % what + "".join("%*s" % (len(n) + 2, text) for n, text in zip(self.COLUMNS[1:], texts)),
              flush=True)


def measure_tried(work, table, centre):
    outs = [os.path.join(work, "tried-%d.exr" % i) for i in range(len(TRIED))]
    rounds = [[run([*command, "-o", out]) for (_, command), out in zip(TRIED, outs)] for _ in range(REPEAT)]
    rows = []
    for (name, _), out, runs in zip(TRIED, outs, zip(*rounds)):
        off = [error(centre, channel, out, channel, centre) for channel in CHANNELS]
        rows.append((name, *(statistics.median(r[k] for r in runs) for k in (0, 1)), *off[0], *off[1]))
        table.row(*rows[-1])
    return rows


def measure_cycles(work, table, centre, area):
    blender = shutil.which("blender")
    if blender is None:
        print("cycles: Blender is not installed: skipping Cycles")
        return []
    # Blender loads the Python library of the first python3 in PATH; its own folder has the right one.
    environment = dict(os.environ, PATH=os.path.dirname(blender) + os.pathsep + os.environ["PATH"])
    rows = []
    for samples in SAMPLES:
        out = os.path.join(work, "cycles-%d" % samples)
        wall, cpu = run([blender, "-b", "--factory-startup", "--python-exit-code", "1", "-P",
                         os.path.join(ROOT, "bench", "cycles_bake.py"), "--", ASSET, out, SIZE, str(samples), CORES,
                         SUN, ANGLE, DISTANCE], env=environment)
        # One sample lies at the texel's centre; several spread over the texel. Each case has its own truth.
        truth = centre if samples == 1 else area
        off = [error(truth, channel, out + suffix, "R", centre)
               for channel, suffix in zip(CHANNELS, ("-shadow.exr", "-ao.exr"))]
        rows.append(("cycles %d" % samples, wall, cpu, *off[0], *off[1]))
        table.row(*rows[-1])
    return rows


def measure(work, table):
    # Cycles averages over a texel's area, vdbshade shades its centre, so each has its own truth.
    centre, area = os.path.join(work, "centre.exr"), os.path.join(work, "area.exr")
    if not os.path.exists(centre):
        run([*EMBREE, "4096", "--frame", "1", "-o", centre])
    if not os.path.exists(area):
        sun = [float(x) for x in SUN.split(",")]
        lightmap.write_area_truth(lightmap.load(BUILD), area, ASSET, int(SIZE), sun, float(ANGLE), float(DISTANCE), 64, 4)
    return measure_tried(work, table, centre), measure_cycles(work, table, centre, area)


def report(ours, theirs):
    print("\nThe fastest run with errors of shadow and AO up to those of Cycles:")
    for name, wall, cpu, shadow, _, ao, _ in theirs:
        print("  %s (shadow %.4f, AO %.4f; %.1f s):" % (name, shadow, ao, wall))
        for kind in ("vdbshade", "embree"):
            good = [o for o in ours if o[0].startswith(kind) and o[3] <= shadow and o[5] <= ao]
            if not good:
                print("    %s: no run is as accurate" % kind)
                continue
            best = min(good, key=lambda o: o[1])
            print("    %s (shadow %.4f, AO %.4f; %.2f s): %.1f times as fast (%.1f by processor time)" % (
                best[0], best[3], best[5], best[1], wall / best[1], cpu / best[2]))


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "bench", "results", "cycles.csv")
    work = os.environ.get("WORK") or tempfile.mkdtemp(prefix="cycles-")
    os.makedirs(work, exist_ok=True)
    report(*measure(work, Table(path)))
    print("images: %s" % work)


main()
