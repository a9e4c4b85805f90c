#!/usr/bin/env python3
"""Makes the sample asset: assets/cloister.glb and assets/cloister.obj, the corner of a cloister's courtyard.

Needs Python 3 only, takes no arguments, and writes the same bytes each time. Lengths are scene units, y is up;
the courtyard opens towards +x and +z. Parts that stand on others are sunk by SINK, as game assets do.
"""
import os

import atlas
from files import Part, write_glb, write_obj
from solids import XY, ZY, Solid, arc, box, check_solid, lathe, line, prism, strip, tube

TEXELS_PER_UNIT = 64.5  # lightmap density at 1024²
UNSEEN = 0.25           # of that density, for the one face that nobody sees: the underside of the ground
SINK = 0.002

STONE = ("limestone", (0.74, 0.70, 0.62))
PAVING = ("paving", (0.62, 0.59, 0.54))
PLASTER = ("plaster", (0.80, 0.74, 0.64))
WOOD = ("wood", (0.45, 0.32, 0.22))
TILES = ("roof tiles", (0.62, 0.34, 0.24))
IRON = ("iron", (0.16, 0.16, 0.18))
CLAY = ("clay", (0.66, 0.40, 0.28))

# Plan
X0, X1, Z0, Z1 = -3.0, 3.0, -2.2, 2.2      # outer faces of what stands on the ground
EDGE = 0.04                                # how far the ground goes on beyond them
GALLERY, STEP = 0.24, 0.12                 # heights of the gallery's floor and of the step before it
GX, GZ, SX, SZ = -1.5, -0.44, -1.3, -0.24  # edges of gallery and step towards the courtyard
WALL = 0.15                                # thickness of the outer walls
AX, AZ = -1.75, -0.75                      # axes of the two arcades
BAY, SPAN, RING = 0.96, 0.33, 0.41         # of the arches: distance, inner and outer radius
HALF, RELIEF = 0.13, 0.025                 # of the arcade's wall: half thickness, how far the rings stand out
SPRING, TOP = 1.288, 1.86                  # heights where arches begin and where the arcade's wall ends
STAIR_X, STAIR_Z, RISER, TREAD, RISERS = 2.25, 1.75, 0.12, 0.17, 10
LANDING = RISER * RISERS


def floor():
    """Courtyard, step and gallery as one solid, so that nothing lies hidden in another."""
    s = Solid("floor")
    x0, x1, z0, z1, low = X0 - EDGE, X1 + EDGE, Z0 - EDGE, Z1 + EDGE, -0.14
    up, right, front = (0, 1, 0), (1, 0, 0), (0, 0, 1)
    s.face(up, [(SX, 0, SZ), (x1, 0, SZ), (x1, 0, z1), (SX, 0, z1)])
    s.face(up, [(GX, STEP, GZ), (x1, STEP, GZ), (x1, STEP, SZ), (SX, STEP, SZ), (SX, STEP, z1), (GX, STEP, z1)])
    s.face(up, [(x0, GALLERY, z0), (x1, GALLERY, z0), (x1, GALLERY, GZ), (GX, GALLERY, GZ), (GX, GALLERY, z1),
                (x0, GALLERY, z1)])
    for x, z, y0, y1 in ((SX, SZ, 0, STEP), (GX, GZ, STEP, GALLERY)):
        s.face(right, [(x, y0, z), (x, y0, z1), (x, y1, z1), (x, y1, z)])
        s.face(front, [(x, y0, z), (x1, y0, z), (x1, y1, z), (x, y1, z)])
    s.face(front, [(x, y, z1) for x, y in ((x0, low), (x1, low), (x1, 0), (SX, 0), (SX, STEP), (GX, STEP),
                                          (GX, GALLERY), (x0, GALLERY))])
    s.face(right, [(x1, y, z) for z, y in ((z0, low), (z1, low), (z1, 0), (SZ, 0), (SZ, STEP), (GZ, STEP),
                                          (GZ, GALLERY), (z0, GALLERY))])
    s.face((0, 0, -1), [(x0, low, z0), (x1, low, z0), (x1, GALLERY, z0), (x0, GALLERY, z0)])
    s.face((-1, 0, 0), [(x0, low, z0), (x0, low, z1), (x0, GALLERY, z1), (x0, GALLERY, z0)])
    s.face((0, -1, 0), [(x0, low, z0), (x1, low, z0), (x1, low, z1), (x0, low, z1)], density=UNSEEN)
    return s


def arcade(name, plane, start, end, middles, axis):
    """A wall on round arches whose rings stand out on both sides. `plane` draws it, `axis` is its middle in c."""
    s = Solid(name)
    inner = [arc((m, SPRING), SPAN, 180, 0, 14) for m in middles]
    outer = [arc((m, SPRING), RING, 180, 0, 14) for m in middles]
    wall, ring = (axis - HALF, axis + HALF), (axis - HALF - RELIEF, axis + HALF + RELIEF)
    below = [p for run in outer for p in run]
    for way, c, d in ((-1.0, wall[0], ring[0]), (1.0, wall[1], ring[1])):
        s.face(plane(0, 0, way), [plane(*p, c) for p in [(start, SPRING), *below, (end, SPRING), (end, TOP),
                                                         (start, TOP)]])
        for a, b in zip(inner, outer):
            s.face(plane(0, 0, way), [plane(*p, d) for p in a + b[::-1]])
            strip(s, plane, b, min(c, d), max(c, d), -1.0)
    for a in inner:
        strip(s, plane, a, *ring)
    for run in line((end, SPRING), (end, TOP), (start, TOP), (start, SPRING)):
        strip(s, plane, run, *wall)
    stops = [(None, start)] + [(m - SPAN, m - RING) for m in middles]
    begins = [(m + SPAN, m + RING) for m in middles] + [(None, end)]
    for left, right in zip([(None, start)] + begins[:-1], stops[1:] + [(None, end)]):
        half = [(left[1], wall[1])] if left[0] is None else [(left[0], ring[1]), (left[1], ring[1]),
                                                            (left[1], wall[1])]
        half += [(right[1], wall[1])] if right[0] is None else [(right[1], wall[1]), (right[1], ring[1]),
                                                               (right[0], ring[1])]
        loop = half + [(a, 2 * axis - c) for a, c in reversed(half)]
        s.face((0, -1, 0), [plane(a, SPRING, c) for a, c in loop])
    return s


def column(x, z, top=None):
    """Plinth, base, shaft, capital and abacus; with `top` a stump that broke off there."""
    y = GALLERY
    base = [[(0, 0.056), (0.132, 0.056)],
            [(0.132, 0.056), (0.144, 0.080), (0.124, 0.104)],
            [(0.124, 0.104), (0.101, 0.122), (0.106, 0.146)]]
    parts = [box("plinth", (x - 0.15, x + 0.15), (y - SINK, y + 0.058), (z - 0.15, z + 0.15))]
    if top:
        return parts + [lathe("stump", base + [[(0.106, 0.146), (0.092, 0.165)], [(0.092, 0.165), (0.089, top)],
                                               [(0.089, top), (0, top)]], 20, (x, y, z))]
    capital = [[(0.106, 0.146), (0.092, 0.165)], [(0.092, 0.165), (0.091, 0.45), (0.080, 0.80)],
               [(0.080, 0.80), (0.101, 0.816), (0.084, 0.832)],
               [(0.084, 0.832), (0.090, 0.88), (0.112, 0.93), (0.150, 0.962)],
               [(0.150, 0.962), (0, 0.962)]]
    parts.append(lathe("column", base + capital, 20, (x, y, z)))
    parts.append(box("abacus", (x - 0.17, x + 0.17), (y + 0.96, SPRING + SINK), (z - 0.17, z + 0.17)))
    return parts


def pier(x, z, free=True):
    """A square pier over the given ranges, with base and cap that stand out; not towards +x unless it is free."""
    g = 0.03
    wide = [(x[0] - g, x[1] + (g if free else 0)), (z[0] - g, z[1] + g)]
    return [box("pier base", wide[0], (GALLERY - SINK, GALLERY + 0.13), wide[1]),
            box("pier", x, (GALLERY + 0.13 - SINK, 1.20 + SINK), z),
            box("pier cap", wide[0], (1.20, SPRING + SINK), wide[1])]


def cornice(x1, z1):
    """A moulding along both arcades with a mitred corner."""
    s = Solid("cornice")
    xf, zf = AX + HALF, AZ + HALF
    profile = [(-0.30, TOP - SINK), (0.02, TOP - SINK), (0.03, 1.885), (0.06, 1.90), (0.10, 1.94), (0.10, 1.98),
               (-0.30, 1.98)]
    for (a, y), (b, t) in zip(profile, profile[1:] + profile[:1]):
        if y == t:
            s.face((0, a - b, 0), [(x1, y, zf + a), (xf + a, y, zf + a), (xf + a, y, z1), (xf + b, y, z1),
                                   (xf + b, y, zf + b), (x1, y, zf + b)])
            continue
        s.face((0, a - b, t - y), [(x1, y, zf + a), (xf + a, y, zf + a), (xf + b, t, zf + b), (x1, t, zf + b)])
        s.face((t - y, a - b, 0), [(xf + a, y, z1), (xf + a, y, zf + a), (xf + b, t, zf + b), (xf + b, t, z1)])
    s.face((1, 0, 0), [(x1, y, zf + a) for a, y in profile])
    s.face((0, 0, 1), [(xf + a, y, z1) for a, y in profile])
    return s


def opening(middle, half, sill, spring):
    """A round-headed opening as a hole of a wall."""
    a, b = middle - half, middle + half
    return [*line((a, sill), (a, spring)), arc((middle, spring), half, 180, 0, 12),
            *line((b, spring), (b, sill), (a, sill))]


WINDOWS = (-0.31, 0.65)


def walls():
    y = GALLERY - SINK
    back = prism("back wall", XY, line((X0, y), (X1, y), (X1, 2.6), (X0, 2.6), (X0, y)), Z0, Z0 + WALL,
                 [opening(m, 0.2, 0.85, 1.35) for m in WINDOWS] + [opening(2.62, 0.26, LANDING + 0.02, 1.86)])
    a0, a1 = -Z1, -(Z0 + WALL) + SINK  # a = -z
    ruin = [(a0, y), (a1, y), (a1, 2.45), (-1.45, 2.45), (-1.45, 2.1), (-1.68, 2.1), (-1.68, 1.5), (-1.93, 1.5),
            (-1.93, 0.85), (a0, 0.85), (a0, y)]
    left = prism("left wall", ZY, line(*ruin), X0, X0 + WALL, [opening(-0.45, 0.24, 0.85, 1.45)])
    return [back, left,
            box("coping", (X0 - 0.04, X1 + 0.04), (2.6 - SINK, 2.68), (Z0 - 0.04, Z0 + WALL + 0.04)),
            box("coping", (X0 - 0.04, X0 + WALL + 0.04), (2.45 - SINK, 2.52), (Z0 + WALL - SINK, 1.49))]


def stairs():
    """The flight and its landing, with a vaulted passage from the gallery under the landing."""
    z1 = Z0 + WALL - SINK
    steps = [(-STAIR_Z + i * TREAD, h * RISER) for i in range(RISERS - 1, -1, -1) for h in (i + 1, i)]
    steps[-1] = (-STAIR_Z, -SINK)
    outline = [*line((-STAIR_Z, -SINK), (1.05, -SINK), (1.05, 0.68)), arc((1.40, 0.68), 0.35, 180, 0, 14),
               *line((1.75, 0.68), (1.75, -SINK), (-z1, -SINK), (-z1, LANDING), *steps)]
    return [prism("stairs", ZY, outline, STAIR_X, X1)]


def railing(x, last):
    """Bars on each tread and along the landing as far as z = last, a handrail, a newel with a ball."""
    height, foot = 0.55, STAIR_Z - TREAD / 2
    rail = lambda z: min(RISER + height + (foot - z) * RISER / TREAD, LANDING + height)
    parts = []
    z, i = foot, 1
    while z > last:
        parts.append(tube("bar", [(x, min(i * RISER, LANDING) - SINK, z), (x, rail(z), z)], 0.022, 6, (1, 0, 0)))
        z, i = z - TREAD, i + 1
    newel = STAIR_Z + 0.07
    bend = foot - (RISERS - 1) * TREAD
    parts.append(tube("handrail", [(x, rail(newel), newel), (x, LANDING + height, bend),
                                   (x, LANDING + height, last)], 0.038, 8, (1, 0, 0)))
    top = rail(newel) + 0.09
    parts.append(box("newel", (x - 0.05, x + 0.05), (-SINK, top), (newel - 0.05, newel + 0.05)))
    ball = arc((0, 0.07), 0.06, -50, 80, 5)
    parts.append(lathe("ball", [[(0, -SINK), (0.03, -SINK)], [(0.03, -SINK), ball[0]], ball,
                                [ball[-1], (0, ball[-1][1])]], 8, (x, top, newel)))
    return parts


def grilles():
    parts = []
    z = Z0 + WALL / 2
    for m in WINDOWS:
        for d in (-0.1, 0.0, 0.1):
            parts.append(tube("grille", [(m + d, 0.84, z), (m + d, 1.36 + (0.04 - d * d) ** 0.5, z)], 0.02, 6,
                              (1, 0, 0)))
        parts.append(tube("grille", [(m - 0.21, 1.2, z), (m + 0.21, 1.2, z)], 0.02, 6, (0, 0, 1)))
    return parts


def fountain(x, z):
    basin = [[(0, -SINK), (0.68, -SINK)], [(0.68, -SINK), (0.68, 0.07)], [(0.68, 0.07), (0.52, 0.07)],
             [(0.52, 0.07), (0.49, 0.11), (0.47, 0.17), (0.48, 0.25), (0.50, 0.28)], [(0.50, 0.28), (0.53, 0.28)],
             [(0.53, 0.28), (0.545, 0.31), (0.53, 0.34)], [(0.53, 0.34), (0.44, 0.34)],
             [(0.44, 0.34), (0.43, 0.20)], [(0.43, 0.20), (0, 0.20)]]
    bowl = [[(0, -SINK), (0.13, -SINK)], [(0.13, -SINK), (0.13, 0.06)], [(0.13, 0.06), (0.085, 0.06)],
            [(0.085, 0.06), (0.055, 0.14), (0.05, 0.24), (0.075, 0.32)],
            [(0.075, 0.32), (0.05, 0.345), (0.05, 0.38)],
            [(0.05, 0.38), (0.15, 0.41), (0.23, 0.455), (0.275, 0.52)], [(0.275, 0.52), (0.245, 0.52)],
            [(0.245, 0.52), (0.20, 0.47), (0.12, 0.445), (0.05, 0.44)],
            [(0.05, 0.44), (0.035, 0.50), (0.03, 0.58), (0.055, 0.62), (0.06, 0.66), (0.04, 0.71), (0.012, 0.735)],
            [(0.012, 0.735), (0, 0.735)]]
    return [lathe("basin", basin, 24, (x, 0, z)), lathe("bowl", bowl, 16, (x, 0.20, z))]


def pot(x, y, z, size):
    shape = [[(0, -SINK / size), (0.10, -SINK / size)], [(0.10, -SINK / size), (0.10, 0.03), (0.075, 0.05)],
             [(0.075, 0.05), (0.13, 0.12), (0.165, 0.22), (0.15, 0.32), (0.105, 0.39)],
             [(0.105, 0.39), (0.14, 0.43)], [(0.14, 0.43), (0.11, 0.43)], [(0.11, 0.43), (0.085, 0.37)],
             [(0.085, 0.37), (0, 0.37)]]
    return lathe("pot", [[(r * size, h * size) for r, h in band] for band in shape], 14, (x, y, z))


def pergola():
    parts = [box("slat", (X0 + WALL - SINK, -1.38), (1.98 - SINK, 2.08), (z - 0.024, z + 0.024))
             for z in (-0.36 + 0.18 * i for i in range(11))]
    for x in (-2.45, -1.95):
        parts.append(box("purlin", (x - 0.02, x + 0.02), (2.08 - SINK, 2.12), (-0.42, 1.50)))
    return parts


def roof():
    """Drawn level, its eave at z = 0; the node tilts it."""
    x0, x1 = X0 + WALL - SINK, 2.16
    parts = [box("roof", (x0, x1), (0, 0.06), (-1.60, 0))]
    for i in range(13):
        x = x0 + 0.12 + i * (x1 - x0 - 0.24) / 12
        parts.append(box("rib", (x - 0.03, x + 0.03), (0.06 - SINK, 0.095), (-1.60 + SINK, -0.01)))
    return parts


def bench():
    return [box("seat", (-2.80, -2.48), (GALLERY + 0.20, GALLERY + 0.26), (-0.30, 1.20)),
            *(box("bench foot", (-2.77, -2.52), (GALLERY - SINK, GALLERY + 0.20 + SINK), (z - 0.06, z + 0.06))
              for z in (-0.12, 1.02))]


def parts():
    front = [AX + BAY / 2 + BAY * i for i in range(4)]
    side = (-0.18, 0.78)
    zf = AZ + HALF
    arches = [arcade("front arcade", XY, AX - HALF, STAIR_X, front, AZ),
              arcade("side arcade", ZY, -1.40, -zf + SINK, [-z for z in reversed(side)], AX),
              cornice(STAIR_X + 0.01, 1.43),
              box("wall plate", (AX, 2.14), (1.98 - SINK, 2.02), (AZ - 0.13, AZ + 0.09))]
    columns = [c for i in (1, 2, 3) for c in column(AX + BAY * i, AZ)] + column(AX, 0.30) + column(AX, 1.92, 0.47)
    columns += pier((-1.91, -1.59), (-0.91, -0.50)) + pier((1.93, STAIR_X + SINK), (-0.91, -0.59), False)
    columns += pier((-1.91, -1.59), (1.10, 1.40))
    drum = lathe("drum", [[(0, 0), (0.089, 0)], [(0.089, 0), (0.086, 0.62)], [(0.086, 0.62), (0, 0.62)]], 24)
    return [
        Part("floor", PAVING, [floor()]),
        Part("arcade", STONE, arches),
        Part("columns", STONE, columns),
        Part("walls", PLASTER, walls()),
        Part("stairs", PAVING, stairs()),
        Part("railing", IRON, railing(2.32, -0.6) + railing(2.93, -2.0) + grilles()),
        Part("fountain", STONE, fountain(0.42, 1.0)),
        Part("roof", TILES, roof(), (0.0, 1.985, -0.50), (1.0, 0.0, 0.0), 13.0),
        Part("pergola", WOOD, pergola()),
        Part("bench", STONE, bench()),
        Part("pots", CLAY, [pot(-1.02, 0, 0.06, 1.0), pot(1.92, 0, 0.10, 0.8), pot(-0.79, STEP, -0.33, 0.55)]),
        Part("drum", STONE, [drum], (-0.42, 0.087, 1.30), (0.6, 0.0, 0.8), 90.0),
    ]


def main():
    model = parts()
    for part in model:
        for solid in part.solids:
            check_solid(solid)
    charts = [chart for part in model for chart in part.charts()]
    atlas.pack(charts, TEXELS_PER_UNIT)
    used = atlas.check(charts)
    folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "assets")
    size = write_glb(os.path.join(folder, "cloister.glb"), "cloister", "make_cloister.py", model)
    vertices = write_obj(os.path.join(folder, "cloister.obj"), "The corner of a cloister's courtyard", model)
    print("%d parts in %d meshes, %d triangles, %d vertices, %d charts, %.1f %% of the lightmap used, GLB %d bytes"
          % (sum(len(part.solids) for part in model), len(model), sum(len(c.triangles) for c in charts), vertices,
             len(charts), 100 * used, size))


if __name__ == "__main__":
    main()
