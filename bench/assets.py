#!/usr/bin/env python3
"""Bakes game assets with default options and judges the bakes against rays.

    tools/bench assets FOLDER [--program vdbshade] [--options "--method cone --ao-method cones"] [--run NAME]
                       [--formats glb,obj,fbx] [--rays 256] [--size 1024] [--seen-only] [--compare] [NAME…]

FOLDER/assets holds the assets (tools/modelling/make_game_assets.py makes them if there are none). FOLDER/truth keeps their
truth from run to run. FOLDER/NAME gets bakes, pictures, judged.csv, table.md and sheet.png of the run. Every
format is compared with the truth of the GLB. --compare also runs `vdbshade compare` against --max-error 0.002.

The "seen" columns compare bilinear lookups with rays at random points of the surface (bench/judge_seen.c), for a sun
of 20°, GLBs and their smooth-shaded versions. Shares are in percent of the points. --seen-only makes these alone.
"""
import argparse
import csv
import os
import resource
import shlex
import subprocess
import sys
from glob import glob

import numpy

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
BUILD = os.path.join(ROOT, os.environ.get("BUILD", "build-bench"))
sys.path.insert(0, os.path.join(BUILD, "python"))
import vdbshade  # noqa: E402

EMPTY, VALID, INVALID, UNCLEAR = range(4)  # verdicts of the truth (bench/judge.h)
BLACK, BRIGHT, WRONG = 0.02, 0.5, 0.25  # black: below the first where truth is above the second; WRONG is visible at a glance
SUN, ANGLE, SEEN_ANGLE, AO = "0.4,0.8,0.3", "2", "20", "1"
STEP = 4  # the sheet shows every fourth pixel
SEEN = ["%s_%s" % (c, f) for c in ("ao", "shadow") for f in ("rmse", "dark", "bright", "wide_dark", "wide_bright")]
LIMITS = {"shadow_rmse": 0.02, "ao_rmse": 0.02, "black_texels": 0, "black_triangles": 0, "compare": 0,
          "seen_ao_rmse": 0.01, "seen_ao_wide_dark": 0.01, "seen_ao_wide_bright": 0.01, "seen_shadow_wide_dark": 0.01,
          "seen_shadow_wide_bright": 0.01}  # at most
RIGHT = 5000  # at most one verdict in this many may be wrong


def options():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder")
    p.add_argument("names", nargs="*")
    p.add_argument("--program", default=os.path.join(BUILD, "vdbshade"))
    p.add_argument("--judge", default=os.path.join(BUILD, "bench", "vsh_judge"))
    p.add_argument("--options", default="")
    p.add_argument("--run", default="bakes")
    p.add_argument("--formats", default="glb,obj,fbx")
    p.add_argument("--rays", default="256")
    p.add_argument("--size", default="1024")
    p.add_argument("--compare", action="store_true")
    p.add_argument("--seen-only", action="store_true")
    p.add_argument("--keep", action="store_true", help="judge existing bakes of this run again")
    return p.parse_intermixed_args()


def timed(command, log):
    """Processor seconds (a shared machine spoils wall clock), and the exit code."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with open(log, "a", encoding="utf-8") as f:
        f.write("$ %s\n" % shlex.join(command))
        f.flush()
        code = subprocess.run(command, stdout=f, stderr=f, check=False).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, code


def ask(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, check=False, text=True)
    return done.stdout.strip() if done.returncode == 0 else None


def newer(path, *sources):
    return os.path.exists(path) and all(os.path.getmtime(path) >= os.path.getmtime(s) for s in sources)


def rmse(errors):
    return float(numpy.sqrt(numpy.mean(errors.astype(float)**2))) if errors.size else 0.0


def compare(truth, bake, picture):
    """Figures of a bake against its truth; writes a picture of them."""
    t, b = vdbshade.image_read(truth), vdbshade.image_read(bake)
    verdict, a, valid = t["verdict"].astype(int), b["A"], t["verdict"] == VALID
    truths, values, apart = (t["shadow"], t["ao"]), (b["shadow.sun"], b["ao"]), t["apart"] > 0
    errors, judged = [x - y for x, y in zip(values, truths)], (valid & ~apart, valid)
    row = {"covered": numpy.sum(verdict != EMPTY), "valid": valid.sum(), "unclear": numpy.sum(verdict == UNCLEAR),
           "wrongly_invalid": numpy.sum(valid & (a < 1)), "wrongly_valid": numpy.sum((verdict == INVALID) & (a > 0))}
    for name, error, where in zip(("shadow", "ao"), errors, judged):
        e = error[where]
        row.update({name + "_rmse": "%.5f" % rmse(e), name + "_bias": "%.5f" % (e.mean() if e.size else 0.0),
                    name + "_p99": "%.4f" % (numpy.percentile(abs(e), 99) if e.size else 0.0),
                    name + "_max": "%.4f" % abs(e).max(initial=0), "filled_%s_rmse" % name: "%.5f" % rmse(error[where & (a < 1)])})
    row["black_texels"] = numpy.any([w & (x < BLACK) & (y > BRIGHT) for w, x, y in zip(judged, values, truths)], axis=0).sum()
    row["leaks"] = numpy.any([w & (e > WRONG) for w, e in zip(judged, errors)], axis=0).sum()
    triangle = t["triangle"].astype(int)
    texels, black = numpy.bincount(triangle[valid]), valid & (a < 1) & (values[0] < BLACK) & (values[1] < BLACK)
    blacks = numpy.bincount(triangle[black], minlength=len(texels))
    light = numpy.bincount(triangle[valid], numpy.maximum(*truths)[valid], minlength=len(texels))
    row["black_triangles"] = numpy.sum(((texels >= 4) & (blacks == texels) & (light > 0.1 * texels))[1:])
    row["apart"], row["apart_shadow_rmse"] = numpy.sum(valid & apart), "%.5f" % rmse(errors[0][valid & apart])
    panels = [[numpy.repeat(p[:, :, None], 3, axis=2) for p in (x, y)] + [error_colors(e, verdict, a > 0)]
              for x, y, e in zip(values, truths, errors)]
    write_picture(picture, numpy.concatenate([numpy.concatenate(line, axis=1) for line in panels]))
    return row


def error_colors(error, verdict, valid):
    """Red: too bright; blue: too dark; green: invalid by mistake; yellow: valid by mistake; the rest grey."""
    shade, colors = numpy.minimum(4 * abs(error), 1), numpy.zeros((*error.shape, 3), numpy.float32)
    colors[:, :, 0], colors[:, :, 2] = numpy.where(error > 0, shade, 0), numpy.where(error > 0, 0, shade)
    colors[:, :, 1] = numpy.where(valid, 0, 0.5)
    for kind, grey in ((EMPTY, 0.16), (UNCLEAR, 0.35), (INVALID, 0.24)):
        colors[verdict == kind] = grey
    colors[(verdict == INVALID) & valid] = (0.9, 0.9, 0.24)
    return colors


def write_picture(path, picture):
    planes = {name: numpy.ascontiguousarray(picture[:, :, c], numpy.float32) for c, name in enumerate("RGB")}
    vdbshade.image_write(path, planes, bits=8, color_space="linear")


def alike(first, second):
    """RMSE of shadow and AO over texels valid in both bakes, and the number of texels valid in one only."""
    a, b = vdbshade.image_read(first), vdbshade.image_read(second)
    if a["A"].shape != b["A"].shape:
        return "no"
    both, one = (a["A"] > 0) & (b["A"] > 0), (a["A"] > 0) != (b["A"] > 0)
    return "%.5f %.5f %d" % (*(rmse((a[c] - b[c])[both]) for c in ("shadow.sun", "ao")), one.sum())


def sheet(path, pictures, columns=3, gap=6):
    """Writes the pictures in order, each with shadow above AO: bake, truth, error × 4."""
    tiles = []
    for picture in map(vdbshade.image_read, pictures):
        tile = numpy.stack([picture[c][::STEP, ::STEP] for c in "RGB"], axis=2)
        tiles.append(numpy.pad(tile, ((0, gap), (0, gap), (0, 0)), constant_values=0.38))
    tiles += [numpy.zeros_like(tiles[0])] * (-len(tiles) % columns)
    lines = [numpy.concatenate(tiles[first:first + columns], axis=1) for first in range(0, len(tiles), columns)]
    write_picture(path, numpy.concatenate(lines))


def one_in(wrong, of):
    return of if wrong == 0 else of // wrong


def bake(o, model, stem, angle):
    """Seconds, exit code."""
    log = stem + ".log"
    if o.keep and os.path.exists(stem + ".exr") and os.path.exists(stem + ".seconds"):
        with open(stem + ".seconds", encoding="ascii") as f:
            return float(f.read()), 0
    if os.path.exists(log):
        os.remove(log)
    seconds, code = timed([o.program, "bake", model, "--sun", SUN, "--sun-angle", angle, "--ao", AO, "--size", o.size] +
                          shlex.split(o.options) + ["-o", stem + ".exr"], log)
    with open(stem + ".seconds", "w", encoding="ascii") as f:
        f.write("%.3f" % seconds)
    return seconds, code


def judge(o, name, suffix):
    where, run = os.path.join(o.folder, "assets"), os.path.join(o.folder, o.run)
    model, stem = os.path.join(where, "%s.%s" % (name, suffix)), os.path.join(run, "%s.%s" % (name, suffix))
    seconds, code = bake(o, model, stem, ANGLE)
    row = {"asset": name, "format": suffix, "seconds": "%.2f" % seconds, "exit": code}
    if code != 0:
        return row
    row.update(compare(truth_of(o, name), stem + ".exr", stem + ".png"))
    row["wrong_1_in"] = one_in(int(row["wrongly_invalid"]) + int(row["wrongly_valid"]), int(row["covered"]))
    if suffix != "glb":
        row["alike"] = alike(os.path.join(run, name + ".glb.exr"), stem + ".exr")
    elif o.compare:
        seconds, code = timed([o.program, "bake", model, "--sun", SUN, "--sun-angle", ANGLE, "--ao", AO, "--size", o.size,
                               "--max-error", "0.002", "-o", stem + ".fine.exr"], stem + ".log")
        row["fine_seconds"] = "%.2f" % seconds
        if code == 0:
            row["compare"] = timed([o.program, "compare", stem + ".fine.exr", stem + ".exr"], stem + ".log")[1]
    return row


def judge_seen(o, name):
    model = os.path.join(o.folder, "assets", name + ".glb")
    stem = os.path.join(o.folder, o.run, name + ".seen")
    seconds, code = bake(o, model, stem, SEEN_ANGLE)
    row = {"asset": name, "format": "glb", "seconds": "%.2f" % seconds, "exit": code}
    if code == 0:
        lines = ask(o.judge, "seen", model, stem + ".exr", "--sun", SUN, "--sun-angle", SEEN_ANGLE, "--ao", AO,
                    "--solids", solids_of(o, name))
        row.update(line.split() for line in lines.splitlines())
    return row


def truth_of(o, name):
    return os.path.join(o.folder, "truth", "%s.%s.exr" % (name, o.size))


def solids_of(o, name):
    path = os.path.join(o.folder, "assets", name.removesuffix("_smooth") + ".solids.obj")
    return path if os.path.exists(path) else "-"


COLUMNS = [("asset", "asset"), ("format", "format"), ("seconds", "CPU s"), ("shadow_rmse", "shadow RMSE"),
           ("ao_rmse", "AO RMSE"), ("wrongly_invalid", "invalid by mistake"), ("wrongly_valid", "valid by mistake"),
           ("wrong_1_in", "wrong: 1 in"), ("black_texels", "black texels"), ("black_triangles", "black triangles"),
           ("leaks", "errors > 0.25"), ("apart_shadow_rmse", "smooth horizons' shadow RMSE"),
           ("alike", "off the GLB (shadow, AO, validity)"),
           ("compare", "compare")] + [("seen_" + k, "seen " + k.replace("_", " ")) for k in SEEN]


def fails(row):
    return (row["exit"] != 0 or int(row.get("wrong_1_in", RIGHT)) < RIGHT or
            any(float(row.get(key, 0)) > most for key, most in LIMITS.items()))


def write(o, rows):
    run = os.path.join(o.folder, o.run)
    keys = list(dict.fromkeys(k for r in rows for k in r))
    with open(os.path.join(run, "judged.csv"), "w", newline="", encoding="utf-8") as f:
        w = csv.DictWriter(f, keys)
        w.writeheader()
        w.writerows(rows)
    columns = [(k, title) for k, title in COLUMNS if k in keys]
    lines = ["| " + " | ".join(title for _, title in columns) + " | |", "|" + "---|" * (len(columns) + 1)]
    lines += ["| " + " | ".join(str(r.get(k, "")) for k, _ in columns) + " | " + ("fails" if fails(r) else "") + " |"
              for r in rows]
    seconds = sum(float(r["seconds"]) for r in rows)
    lines.append("\n%d bakes, %d fail, %.1f s of processor" % (len(rows), sum(map(fails, rows)), seconds))
    with open(os.path.join(run, "table.md"), "w", encoding="utf-8") as f:
        f.write("\n".join(lines) + "\n")
    judged = [r["asset"] for r in rows if "shadow_rmse" in r and r["format"] == "glb"]
    pictures = [p for p in (os.path.join(run, "%s.glb.png" % name) for name in judged) if os.path.exists(p)]
    if pictures:
        sheet(os.path.join(run, "sheet.png"), pictures)


def main():
    o = options()
    where = os.path.join(o.folder, "assets")
    if not glob(os.path.join(where, "*.glb")):
        subprocess.run(["blender", "-b", "--python-exit-code", "1", "--python",
                        os.path.join(ROOT, "tools", "modelling", "make_game_assets.py"), "--", where], check=True,
                       stdout=subprocess.DEVNULL)
    for part in ("truth", o.run):
        os.makedirs(os.path.join(o.folder, part), exist_ok=True)
    wanted = o.names or sorted(os.path.basename(p)[:-4] for p in glob(os.path.join(where, "*.glb")))
    rows = []
    for name in wanted:
        model, solids, truth = (os.path.join(where, name + ".glb"), solids_of(o, name), truth_of(o, name))
        of_name = [] if o.seen_only or name.endswith("_smooth") else o.formats.split(",")
        if of_name and not newer(truth, model):
            subprocess.run([o.judge, "truth", model, o.size, SUN, ANGLE, AO, o.rays, solids, truth], check=True)
        for row in [judge(o, name, suffix) for suffix in of_name] + [judge_seen(o, name)]:
            rows.append(row)
            print("  ".join("%s %s" % (title, row[k]) for k, title in COLUMNS if k in row), flush=True)
        write(o, rows)
    with open(os.path.join(o.folder, o.run, "table.md"), encoding="utf-8") as f:
        print(f.read())
    return 1 if any(map(fails, rows)) else 0


if __name__ == "__main__":
    sys.exit(main())
