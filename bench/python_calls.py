"""Calls from Python beside the same calls from C (tests/python/points.c): python_calls.py POINTS MODEL [FILE.csv]

Processor seconds, one thread, in turn: medians of rounds. What a call costs is that of Python less that of C."""
import contextlib
import csv
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy

import vdbshade

ROUNDS, MILLION, CALLS = 7, 1000000, 20000


def each(function, calls=CALLS):
    """Nanoseconds of a call: the median of five runs."""
    times = []
    for _ in range(5):
        begin = time.process_time()
        for _ in range(calls):
            function()
        times.append((time.process_time() - begin) / calls * 1e9)
    return statistics.median(times)


def main(points, model, output=""):
    random = numpy.random.default_rng(1)
    positions = random.uniform([-3, 0, -2.2], [3, 2.6, 2.2], (MILLION, 3))
    normals = numpy.tile(numpy.float32([0, 1, 0]), (MILLION, 1))
    occluders = vdbshade.Occluders(vdbshade.Model(model), resolution=128)
    sun = vdbshade.Light(direction=(0.5, 1, 0), angle=0.1)
    query = vdbshade.Query(occluders, sun, method="cone", ao_method="cones")
    field, run = occluders.field, vdbshade.Run(threads=1)
    of_c, of_python, calls_of_c = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "points"
        path.write_bytes(positions.tobytes() + normals.tobytes())
        for _ in range(ROUNDS):
            told = subprocess.run([points, model, path, "time", "2"], check=True, capture_output=True, text=True).stdout.split()
            of_c.append(float(told[1]))  # the first one is not measured, of either
            calls_of_c.append([float(t) for t in told[2:]])
            query.points(positions, normals, run=run)
            begin = time.process_time()
            query.points(positions, normals, run=run)
            of_python.append(time.process_time() - begin)
    in_c = [statistics.median(times) for times in zip(*calls_of_c)]
    one, up = positions[:1].copy(), normals[:1].copy()
    into, out = dict(shadow=numpy.empty((1, 1), numpy.float32)), numpy.empty(1, numpy.float32)
    rows = [("Query.points, one point", each(lambda: query.points(one, up)), in_c[0]),
            ("Query.points, one point, into an array", each(lambda: query.points(one, up, out=into)), in_c[0]),
            ("Field.sample, one point", each(lambda: field.sample(one)), in_c[1]),
            ("Field.sample, one point, into an array", each(lambda: field.sample(one, out)), in_c[1]),
            ("shade_shadow, one point", each(lambda: vdbshade.shade_shadow(occluders, one, up, sun, run=run, method="cone")), in_c[2])]
    with open(output, "w", newline="") if output else contextlib.nullcontext(sys.stdout) as file:
        writer = csv.writer(file)
        writer.writerow(["what", "python_ns", "c_ns", "python_less_c_ns", "python_over_c"])
        for what, python, c in rows:
            writer.writerow([what, f"{python:.0f}", f"{c:.0f}", f"{python - c:.0f}", ""])
        python, c = statistics.median(of_python) / MILLION * 1e9, statistics.median(of_c) / MILLION * 1e9
        ratios = statistics.median(p / q for p, q in zip(of_python, of_c))
        writer.writerow(["Query.points, a million points, each", f"{python:.1f}", f"{c:.1f}", f"{python - c:.1f}", f"{ratios:.4f}"])


if __name__ == "__main__":
    main(*sys.argv[1:])
