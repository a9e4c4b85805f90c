#!/usr/bin/env python3
"""Makes a level for benchmarks, too large to commit: 64 plots on a ground of 24 × 24 units, each with a head of holes
(eyes, mouth, an open neck) on a pedestal, a fence of posts and rails, and an open sheet or a frame of slats over it all. 257
objects, of which heads have most of the triangles.

Usage: tools/modelling/make_level.py FILE.glb [TRIANGLES]      a million, up to 7; Python 3 only, the same bytes each time; a minute a million
"""
import os
import sys
from math import cos, pi, sin, sqrt

import atlas
from files import Part, write_glb
from solids import Chart, Solid, box, cross, sub, unit

PLOTS, PLOT = 8, 3.0
CLOTH = 36  # cells along a sheet
GREY = ("grey", (0.7, 0.7, 0.7))
DENSITIES = [28.0 * 0.94 ** i for i in range(24)]  # texels a unit at 1024²: the first that fits


class Rectangle:
    """Two triangles that stand for a rectangular chart in the packer, however many triangles the chart has."""

    def __init__(self, chart, width, height, density=1.0):
        self.chart, self.density = chart, density
        self.size = width, height
        self.vertices = [(None, None, uv, None) for uv in ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))]
        self.triangles = [(0, 1, 2), (0, 2, 3)]

    def give(self):
        """Gives the chart's vertices their UVs. The packer may have turned the rectangle."""
        (ox, oy), (ux, uy), _, (vx, vy) = self.lightmap
        self.chart.lightmap = []
        for _, _, (u, v), _ in self.chart.vertices:
            a, b = u / self.size[0], v / self.size[1]
            self.chart.lightmap.append((ox + a * (ux - ox) + b * (vx - ox), oy + a * (uy - oy) + b * (vy - oy)))


def grid(name, points, width, height, is_hole=lambda row, column: False):
    """A smooth open surface: points [rows][columns], outside where rows × columns turn to the left; its rectangle."""
    rows, columns = len(points), len(points[0])
    vertices = []
    for r in range(rows):
        for c in range(columns):
            along = sub(points[r][min(c + 1, columns - 1)], points[r][max(c - 1, 0)])
            up = sub(points[min(r + 1, rows - 1)][c], points[max(r - 1, 0)][c])
            uv = width * c / (columns - 1), height * r / (rows - 1)
            vertices.append((points[r][c], unit(cross(along, up)), uv, uv))
    triangles = []
    for r in range(rows - 1):
        for c in range(columns - 1):
            if not is_hole(r, c):
                i = r * columns + c
                triangles += [(i, i + 1, i + columns), (i + 1, i + columns + 1, i + columns)]
    solid = Solid(name)
    solid.charts.append(Chart(vertices, triangles))
    return solid, [Rectangle(solid.charts[0], width, height)]


def head(name, place, number, cells):
    """Its rows from 30° over the neck to the crown, which stays open by a hair."""
    rows = round(sqrt(cells / 2))
    columns = 2 * rows
    low, high, radius = 0.17 * pi, 0.99 * pi, 0.5
    points = []
    for r in range(rows + 1):
        b = low + (high - low) * r / rows
        row = []
        for c in range(columns):
            a = 2 * pi * c / columns
            k = radius * (1 + 0.10 * sin(2 * b + number) * sin(3 * a + number) + 0.04 * sin(5 * b) * sin(8 * a + 2 * number))
            row.append((place[0] + k * sin(b) * cos(a), place[1] - k * cos(b), place[2] - k * sin(b) * sin(a)))
        points.append(row + row[:1])

    def is_hole(r, c):
        y, x = r / rows, (c / columns + 0.37 * number) % 1.0
        return any(((x - mx) / wx) ** 2 + ((y - my) / wy) ** 2 < 1.0
                   for mx, my, wx, wy in ((0.42, 0.60, 0.045, 0.07), (0.58, 0.60, 0.045, 0.07), (0.5, 0.27, 0.09, 0.05)))

    return grid(name, points, 2 * pi * radius, 0.82 * pi * radius, is_hole)


def cloth(name, place, width, depth, number):
    points = [[(place[0] + width * (c / CLOTH - 0.5),
                place[1] + 0.12 * cos(7 * c / CLOTH + number) * sin(5 * r / CLOTH),
                place[2] - depth * (r / CLOTH - 0.5)) for c in range(CLOTH + 1)] for r in range(CLOTH + 1)]
    return grid(name, points, width, depth)


def thin_box(solid, low, high):
    """A closed box of three charts: its sides unrolled, its ends."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    vertices, triangles, at = [], [], 0.0
    for (ax, az), (bx, bz), n in (((x0, z1), (x1, z1), (0, 0, 1)), ((x1, z1), (x1, z0), (1, 0, 0)),
                                  ((x1, z0), (x0, z0), (0, 0, -1)), ((x0, z0), (x0, z1), (-1, 0, 0))):
        side, i = abs(bx - ax) + abs(bz - az), len(vertices)
        for x, z, y, u in ((ax, az, y0, at), (bx, bz, y0, at + side), (bx, bz, y1, at + side), (ax, az, y1, at)):
            vertices.append(((x, y, z), tuple(map(float, n)), (u, y - y0), (u, y - y0)))
        triangles += [(i, i + 1, i + 2), (i, i + 2, i + 3)]
        at += side
    made = [Rectangle(Chart(vertices, triangles), at, y1 - y0)]
    for y, n, z in ((y1, 1.0, (z1, z0)), (y0, -1.0, (z0, z1))):
        corners = [((x, y, z[k]), (0.0, n, 0.0), uv, uv)
                   for x, k, uv in ((x0, 0, (0.0, 0.0)), (x1, 0, (x1 - x0, 0.0)), (x1, 1, (x1 - x0, z1 - z0)),
                                    (x0, 1, (0.0, z1 - z0)))]
        made.append(Rectangle(Chart(corners, [(0, 1, 2), (0, 2, 3)]), x1 - x0, z1 - z0, 1.0 if n > 0.0 else 0.25))
    solid.charts += [rectangle.chart for rectangle in made]
    return made


def boxes(name, bars):
    solid = Solid(name)
    return solid, [rectangle for low, high in bars for rectangle in thin_box(solid, low, high)]


def bar(x, y, z):
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


def fence(x, z):
    """Posts 0.05 thick and 1.1 high, sunk by a hair, and two rails along one side of a plot."""
    posts = [bar((x - 1.3 + 0.4 * i, x - 1.25 + 0.4 * i), (-0.01, 1.1), (z + 1.2, z + 1.25)) for i in range(7)]
    rails = [bar((x - 1.3, x + 1.15), (y, y + 0.04), (z + 1.25, z + 1.28)) for y in (0.4, 0.9)]
    return posts + rails


def slats(x, z):
    return [bar((x - 0.7 + 0.12 * i, x - 0.67 + 0.12 * i), (2.1, 2.2), (z - 0.7, z + 0.7)) for i in range(12)]


def level(triangles):
    far = PLOTS * PLOT / 2
    ground = box("ground", (-far, far), (-0.3, 0.0), (-far, far))
    made = [(ground, ground.charts)]
    for chart in ground.charts:
        chart.density = 1.0 if chart.vertices[0][1][1] > 0.9 else 0.25
    cells = (triangles - 110_000) / PLOTS ** 2 / 2 / 0.972  # without holes
    for number in range(PLOTS ** 2):
        x, z = (PLOT * (k - PLOTS / 2 + 0.5) for k in divmod(number, PLOTS))
        made.append(boxes("pedestal%d" % number, [bar((x - 0.3, x + 0.3), (-0.01, 0.8), (z - 0.3, z + 0.3))]))
        made.append(head("head%d" % number, (x, 1.25, z), number, cells))
        made.append(boxes("fence%d" % number, fence(x, z)))
        made.append(cloth("sheet%d" % number, (x, 2.1, z), 1.9, 1.5, number) if number % 2 else
                    boxes("slats%d" % number, slats(x, z)))
    return made


def pack(rectangles):
    for density in DENSITIES:
        try:
            atlas.pack(rectangles, density)
            return density
        except ValueError:
            continue
    raise ValueError("the charts do not fit the lightmap")


def main():
    path = sys.argv[1]
    made = level(int(sys.argv[2]) if len(sys.argv) > 2 else 1_000_000)
    rectangles = [rectangle for _, some in made for rectangle in some]
    density = pack(rectangles)
    used = atlas.check(rectangles)
    for rectangle in rectangles:
        if isinstance(rectangle, Rectangle):
            rectangle.give()
    parts = [Part(solid.name, GREY, [solid]) for solid, _ in made]
    size = write_glb(path, "level", os.path.basename(__file__), parts)
    print("%s: %d objects, %d triangles, %d charts, %.1f texels a unit at %d², %.1f %% of the lightmap used, %d bytes"
          % (path, len(parts), sum(len(c.triangles) for p in parts for c in p.charts()), len(rectangles), density,
             atlas.TEXELS, 100 * used, size))


if __name__ == "__main__":
    main()
