"""Closed solids made of charts: prisms with holes, lathes, tubes and grids.

A chart is a piece of surface that is unwrapped as one: a planar face, or a smooth strip that is unrolled. Hard
edges always part charts, so that no texel has to hold the light of two directions. Lengths are scene units;
chart coordinates (u, v) are scene units too, v up and never mirrored.
"""
from collections import Counter
from math import cos, dist, pi, sin, sqrt

GRID = 8192  # positions are multiples of 1/GRID: parts weld exactly, and decimals and 32-bit floats hold them alike


def snap(x):
    return round(x * GRID) / GRID


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = sqrt(dot(a, a))
    return tuple(x / length for x in a)


def area2(a, b, c):
    """Twice the signed area of a triangle in the plane."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


class Chart:
    """Vertices (position, normal, uv, tile) and anticlockwise triangles."""

    def __init__(self, vertices, triangles, density=1.0):
        self.vertices = [(tuple(snap(x) for x in p), n, uv, tile) for p, n, uv, tile in vertices]
        self.triangles = triangles
        self.density = density  # texels per unit, relative to the atlas


class Solid:
    """One closed part; `charts` together bound it."""

    def __init__(self, name):
        self.name = name
        self.charts = []

    def face(self, normal, outer, *holes, density=1.0):
        """A planar face with the given outward normal; loops in either direction."""
        n = unit(normal)
        if abs(n[1]) > 0.9:
            u = (1.0, 0.0, 0.0)
            u = unit(sub(u, tuple(dot(u, n) * x for x in n)))
        else:
            u = unit(cross((0.0, 1.0, 0.0), n))
        v = cross(n, u)
        loops = [[(dot(p, u), dot(p, v), p) for p in loop] for loop in (outer, *holes)]
        for i, loop in enumerate(loops):
            signed = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(loop, loop[1:] + loop[:1]))
            if (signed > 0) != (i == 0):
                loop.reverse()
        polygon, triangles = triangulate(loops)
        vertices = [(p, n, (s, t), box_tile(p, n)) for s, t, p in polygon]
        self.charts.append(Chart(vertices, triangles, density))

    def grid(self, rows):
        """A smooth strip: rows of (position, normal, uv), two triangles a cell, wound by the normals."""
        width = len(rows[0])
        vertices = [vertex for row in rows for vertex in row]
        a, b, c = vertices[0], vertices[1], vertices[width]
        outward = dot(cross(sub(b[0], a[0]), sub(c[0], a[0])), a[1]) > 0
        mirrored = (area2(a[2], b[2], c[2]) > 0) != outward
        if mirrored:
            vertices = [(p, n, (-u, v)) for p, n, (u, v) in vertices]
        triangles = []
        for r in range(len(rows) - 1):
            for i in range(r * width, r * width + width - 1):
                quad = [(i, i + 1, i + width), (i + 1, i + width + 1, i + width)]
                triangles += quad if outward else [(x, z, y) for x, y, z in quad]
        self.charts.append(Chart([(p, n, uv, uv) for p, n, uv in vertices], triangles))

    def triangles(self):
        for chart in self.charts:
            for triangle in chart.triangles:
                yield chart, tuple(chart.vertices[i] for i in triangle)


def box_tile(p, n):
    """Tiling coordinates by projection along the largest component of the normal."""
    axis = max(range(3), key=lambda i: abs(n[i]))
    return [(p[2], p[1]), (p[0], p[2]), (p[0], p[1])][axis]


def triangulate(loops):
    """Ear clipping; holes are joined to the outline by the shortest bridges that cross nothing."""
    polygon = list(loops[0])
    holes = list(loops[1:])

    def crosses(a, b, c, d):
        return area2(a, b, c) * area2(a, b, d) < -1e-14 and area2(c, d, a) * area2(c, d, b) < -1e-14

    while holes:
        edges = [e for loop in (polygon, *holes) for e in zip(loop, loop[1:] + loop[:1])]
        bridges = sorted((dist(p[:2], q[:2]), h, i, j) for h, hole in enumerate(holes)
                         for i, p in enumerate(hole) for j, q in enumerate(polygon))
        _, h, i, j = next(b for b in bridges
                          if not any(crosses(holes[b[1]][b[2]], polygon[b[3]], c, d) for c, d in edges))
        hole = holes.pop(h)
        polygon[j + 1:j + 1] = hole[i:] + hole[:i + 1] + [polygon[j]]

    def quality(k):
        a, b, c = (polygon[left[(k + d) % len(left)]] for d in (-1, 0, 1))
        twice = area2(a, b, c)
        if twice < 1e-9:
            return -1.0
        for m in left:
            p = polygon[m]
            if p[:2] in (a[:2], b[:2], c[:2]):
                continue
            if min(area2(a, b, p), area2(b, c, p), area2(c, a, p)) > -1e-10:
                return -1.0
        return twice / max(dist(a[:2], b[:2]), dist(b[:2], c[:2]), dist(c[:2], a[:2])) ** 2

    left = list(range(len(polygon)))
    triangles = []
    scores = {}
    while len(left) > 2:
        for k, m in enumerate(left):
            if m not in scores:
                scores[m] = quality(k)
        k = max(range(len(left)), key=lambda k: scores[left[k]])
        if scores[left[k]] <= 0.0:
            raise ValueError("a face could not be triangulated")
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
        # Fewer vertices can only make other ears possible: look again at the refused and at both neighbours.
        changed = {left[k - 1], left[k % len(left)]}
        scores = {m: s for m, s in scores.items() if s > 0.0 and m not in changed}
    return polygon, triangles


def arc(centre, radius, start, end, count):
    """Points of a circle from angle start to angle end (degrees), count segments."""
    steps = [(start + (end - start) * i / count) * pi / 180 for i in range(count + 1)]
    return [(snap(centre[0] + radius * cos(t)), snap(centre[1] + radius * sin(t))) for t in steps]


def line(*points):
    """Straight runs from point to point."""
    return [[a, b] for a, b in zip(points, points[1:])]


# Planes to draw in: (a, b, c) to (x, y, z), right-handed, so that a face looks along +c when a goes right.
XY = lambda a, b, c: (a, b, c)
ZY = lambda a, b, c: (c, b, -a)  # seen from +x: a = -z


def strip(solid, plane, run, c0, c1, side=1.0):
    """The wall over one run of an outline; outside is on its right for side = 1. Longer runs are smooth."""
    normals = []
    for i in range(len(run)):
        a, b = run[max(i - 1, 0)], run[min(i + 1, len(run) - 1)]
        length = dist(a, b)
        normals.append(plane(side * (b[1] - a[1]) / length, side * (a[0] - b[0]) / length, 0.0))
    if len(run) == 2:
        (a, b), (p, q) = run[0], run[1]
        solid.face(normals[0], [plane(a, b, c0), plane(p, q, c0), plane(p, q, c1), plane(a, b, c1)])
        return
    lengths = [0.0]
    for a, b in zip(run, run[1:]):
        lengths.append(lengths[-1] + dist(a, b))
    solid.grid([[(plane(*p, c), n, (s, c - c0)) for p, n, s in zip(run, normals, lengths)] for c in (c0, c1)])


def prism(name, plane, outline, c0, c1, holes=()):
    """A solid between c0 and c1. Outline: runs, anticlockwise; holes: runs, clockwise. A run of two points is
    a flat side, a longer one a smooth strip."""
    solid = Solid(name)
    for runs in (outline, *holes):
        for run in runs:
            strip(solid, plane, run, c0, c1)
    for c, way in ((c0, -1.0), (c1, 1.0)):
        loops = [[plane(*p, c) for run in runs for p in run[:-1]] for runs in (outline, *holes)]
        solid.face(plane(0.0, 0.0, way), *loops)
    return solid


def box(name, x, y, z):
    """An upright box from (min, max) pairs."""
    corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]
    return prism(name, XY, line(*corners, corners[0]), z[0], z[1])


def lathe(name, bands, sides, centre=(0.0, 0.0, 0.0)):
    """A turned solid around y. Bands of (radius, y) follow one another with the outside on their right (up the
    outer side); level bands become discs or rings, others strips that are smooth inside the band."""
    solid = Solid(name)
    turns = [(cos(2 * pi * i / sides), sin(2 * pi * i / sides)) for i in range(sides)]

    def at(r, y, i):
        return (centre[0] + r * turns[i % sides][0], centre[1] + y, centre[2] + r * turns[i % sides][1])

    for band in bands:
        (r0, y0), (r1, y1) = band[0], band[-1]
        if all(y == y0 for _, y in band):
            loops = [[at(r, y0, i) for i in range(sides)] for r in sorted((r0, r1), reverse=True) if r > 0.0]
            solid.face((0.0, 1.0 if r1 < r0 else -1.0, 0.0), *loops)
            continue
        lengths = [0.0]
        for a, b in zip(band, band[1:]):
            lengths.append(lengths[-1] + dist(a, b))
        mean = sum((a[0] + b[0]) / 2 * dist(a, b) for a, b in zip(band, band[1:])) / lengths[-1]
        step = 2 * sin(pi / sides) * mean
        rows = []
        for k, (r, y) in enumerate(band):
            a, b = band[max(k - 1, 0)], band[min(k + 1, len(band) - 1)]
            nr, ny = (b[1] - a[1]) / dist(a, b), (a[0] - b[0]) / dist(a, b)
            rows.append([(at(r, y, i), (nr * turns[i % sides][0], ny, nr * turns[i % sides][1]),
                          (i * step, lengths[k])) for i in range(sides + 1)])
        solid.grid(rows)
    return solid


def tube(name, path, radius, sides, across):
    """A round bar along a path that lies in the plane perpendicular to the unit vector `across`."""
    solid = Solid(name)
    ways = [unit(sub(b, a)) for a, b in zip(path, path[1:])]
    rows, ends, length = [], [], 0.0
    for k, p in enumerate(path):
        first, last = ways[max(k - 1, 0)], ways[min(k, len(ways) - 1)]
        along = unit(tuple(a + b for a, b in zip(first, last)))
        up = cross(along, across)
        stretch = 1.0 / dot(along, first)  # the mitre is longer than the bar is thick
        if k:
            length += dist(path[k - 1], p)
        ring = []
        for i in range(sides + 1):
            t = 2 * pi * (i % sides + 0.5) / sides
            n = tuple(cos(t) * a + sin(t) * b for a, b in zip(across, up))
            q = tuple(c + radius * (cos(t) * a + sin(t) * stretch * b) for c, a, b in zip(p, across, up))
            ring.append((q, n, (i * 2 * radius * sin(pi / sides), length)))
        rows.append(ring)
        ends.append([q for q, _, _ in ring[:-1]])
    solid.grid(rows)
    solid.face(tuple(-x for x in ways[0]), ends[0])
    solid.face(ways[-1], ends[-1])
    return solid


def check_solid(solid):
    """Closed, wound outwards, no triangle without area."""
    edges = Counter()
    volume = 0.0
    for _, vertices in solid.triangles():
        a, b, c = (v[0] for v in vertices)
        if dot(cross(sub(b, a), sub(c, a)), cross(sub(b, a), sub(c, a))) < 1e-14:
            raise ValueError("%s: a triangle without area" % solid.name)
        volume += dot(a, cross(b, c)) / 6
        edges.update(((a, b), (b, c), (c, a)))
    for (a, b), count in edges.items():
        if count != edges[(b, a)]:
            raise ValueError("%s: open edge from %s to %s" % (solid.name, a, b))
        if count != 1:
            raise ValueError("%s: %d triangles share the edge from %s to %s" % (solid.name, 2 * count, a, b))
    if volume <= 0.0:
        raise ValueError("%s: wound inwards" % solid.name)
