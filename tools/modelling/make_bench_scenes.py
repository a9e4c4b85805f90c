#!/usr/bin/env python3
"""Makes two scenes for benchmarks: assets/smooth.glb, a lobed ring of some
50 000 triangles over a plate, and assets/thin.glb, posts, slats and a roof sheet over a floor.

Needs Python 3 only, takes no arguments, and writes the same bytes each time. Lengths are scene units, y is up.
"""
import os
from math import cos, pi, sin

import atlas
from files import Part, write_glb
from solids import Solid, box, check_solid, cross, sub, unit

GREY = ("grey", (0.7, 0.7, 0.7))
UNSEEN = 0.25  # of the lightmap's density, for the underside of a ground that nobody sees
RINGS, SIDES = 112, 224


def ground():
    """The top at y = 0."""
    s = box("ground", (-2.0, 2.0), (-0.2, 0.0), (-2.0, 2.0))
    for chart in s.charts:
        if all(vertex[1][1] < -0.9 for vertex in chart.vertices):
            chart.density = UNSEEN
    return s


def ring_point(a, b):
    """Angle a around y, b around the tube, whose radius and height change on the way."""
    tube = 0.28 + 0.08 * sin(5 * a + 2 * b)
    return ((0.9 + tube * cos(b)) * cos(a), 0.8 + tube * sin(b) + 0.15 * sin(3 * a), (0.9 + tube * cos(b)) * sin(a))


def ring_normal(a, b, step=1e-5):
    along = sub(ring_point(a + step, b), ring_point(a - step, b))
    around = sub(ring_point(a, b + step), ring_point(a, b - step))
    return unit(cross(around, along))


def ring():
    """One chart: the surface unrolled at its mean radii."""
    s = Solid("ring")
    rows = []
    for i in range(SIDES + 1):
        row = []
        for j in range(RINGS + 1):
            a, b = 2 * pi * (i % SIDES) / SIDES, 2 * pi * (j % RINGS) / RINGS
            row.append((ring_point(a, b), ring_normal(a, b), (2 * pi * 0.28 * j / RINGS, 2 * pi * 0.9 * i / SIDES)))
        rows.append(row)
    s.grid(rows)
    return s


def around(centre, half):
    return tuple((c - h, c + h) for c, h in zip(centre, half))


def thin():
    posts = [box("post", *around((-1.5 + i % 4, 0.75, -1.2 + 1.2 * (i // 4)), (0.03, 0.73, 0.03))) for i in range(12)]
    slats = [box("slat", *around((-1.6 + 0.06 * i, 1.55, 0.0), (0.012, 0.04, 1.4))) for i in range(24)]
    sheet = box("sheet", *around((1.0, 1.6, 0.0), (0.8, 0.012, 1.4)))
    return [Part("ground", GREY, [ground()]), Part("posts", GREY, posts), Part("slats", GREY, slats),
            Part("sheet", GREY, [sheet])]


def write(name, parts, texels_per_unit):
    for part in parts:
        for solid in part.solids:
            check_solid(solid)
    charts = [chart for part in parts for chart in part.charts()]
    atlas.pack(charts, texels_per_unit)
    used = atlas.check(charts)
    folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "assets")
    size = write_glb(os.path.join(folder, name + ".glb"), name, os.path.basename(__file__), parts)
    print("%s: %d triangles, %d charts, %.1f %% of the lightmap used, %d bytes"
          % (name, sum(len(c.triangles) for c in charts), len(charts), 100 * used, size))


if __name__ == "__main__":
    write("smooth", [Part("ring", GREY, [ring()]), Part("ground", GREY, [ground()])], 170.0)
    write("thin", thin(), 115.0)
