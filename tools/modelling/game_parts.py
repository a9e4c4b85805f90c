"""Meshes as lists of vertices and faces, and the shapes that game_assets.py is made of. Metres, z up."""
from math import cos, pi, sin, sqrt


class Part:
    """A mesh. kind is what a person would call it: "solid" (closed), "room" (solid, but its faces look inwards), "sheet" (nothing
    is behind it) or "hollow" (a vessel or pipe of one wall: solid and sheet are both right). true_faces are the faces before some
    of them were flipped by mistake."""

    def __init__(self, vertices=(), faces=(), kind="solid", smooth=False):
        self.vertices, self.faces, self.kind, self.smooth = list(vertices), [tuple(f) for f in faces], kind, smooth
        self.true_faces = self.faces
        self.at, self.scale = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)

    def add(self, other):
        base = len(self.vertices)
        self.vertices += other.vertices
        self.faces += [tuple(base + i for i in f) for f in other.faces]
        self.true_faces = self.faces
        return self

    def moved(self, x=0.0, y=0.0, z=0.0, turn=0.0, tilt=0.0):
        """Tilts it about x, turns it about z, then moves it."""
        c, s, ct, st = cos(turn), sin(turn), cos(tilt), sin(tilt)
        moved = []
        for a, b, d in self.vertices:
            b, d = ct * b - st * d, st * b + ct * d
            moved.append((c * a - s * b + x, s * a + c * b + y, d + z))
        self.vertices = moved
        return self

    def inward(self):
        self.faces = self.true_faces = [f[::-1] for f in self.faces]
        return self

    def without(self, unwanted):
        """Removes the faces whose centre is unwanted."""
        def centre(f):
            return [sum(self.vertices[i][k] for i in f) / len(f) for k in range(3)]
        self.faces = self.true_faces = [f for f in self.faces if not unwanted(*centre(f))]
        used = sorted({i for f in self.faces for i in f})
        to = {i: n for n, i in enumerate(used)}
        self.vertices = [self.vertices[i] for i in used]
        self.faces = self.true_faces = [tuple(to[i] for i in f) for f in self.faces]
        return self

    def place(self, v):
        return tuple(self.at[k] + self.scale[k] * v[k] for k in range(3))


def together(parts, kind="solid", smooth=False):
    whole = Part(kind=kind, smooth=smooth)
    for p in parts:
        whole.add(p)
    return whole


def box(x, y, z, cells=(1, 1, 1), kind="solid"):
    """Ranges; faces are cut into cells."""
    index, vertices, faces = {}, [], []
    ranges = (x, y, z)

    def vertex(i):
        if i not in index:
            index[i] = len(vertices)
            vertices.append(tuple(r[0] + (r[1] - r[0]) * i[k] / cells[k] for k, r in enumerate(ranges)))
        return index[i]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, cells[axis]):
            for a in range(cells[u]):
                for b in range(cells[v]):
                    ring = []
                    for da, db in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        i = [0, 0, 0]
                        i[axis], i[u], i[v] = side, a + da, b + db
                        ring.append(vertex(tuple(i)))
                    faces.append(ring if side else ring[::-1])
    return Part(vertices, faces, kind)


def cube(cx, cy, cz, sx, sy, sz, **more):
    return box((cx - sx / 2, cx + sx / 2), (cy - sy / 2, cy + sy / 2), (cz - sz / 2, cz + sz / 2), **more)


def grid(nx, ny, point, kind="sheet", smooth=True):
    """Triangles over point(s, t), s and t in 0 … 1; they look to +z where point is (s, t, height)."""
    vertices = [point(i / nx, j / ny) for j in range(ny + 1) for i in range(nx + 1)]
    faces = []
    for j in range(ny):
        for i in range(nx):
            a = j * (nx + 1) + i
            b, c, d = a + 1, a + nx + 2, a + nx + 1
            faces += [(a, b, c), (a, c, d)] if (i + j) % 2 else [(a, b, d), (b, c, d)]
    return Part(vertices, faces, kind, smooth)


def ground(x, y, cells=8, height=None):
    flat = height or (lambda a, b: 0.0)

    def point(s, t):
        a, b = x[0] + s * (x[1] - x[0]), y[0] + t * (y[1] - y[0])
        return (a, b, flat(a, b))
    return grid(cells, cells, point)


def lathe(profile, sides, kind="solid", smooth=True):
    """(radius, z) from below to above, turned about z, looking outwards. A radius of 0 at an end closes it."""
    vertices, rows, faces = [], [], []
    for r, z in profile:
        if r == 0.0:
            rows.append([len(vertices)] * sides)
            vertices.append((0.0, 0.0, z))
            continue
        rows.append([len(vertices) + k for k in range(sides)])
        vertices += [(r * cos(2 * pi * k / sides), r * sin(2 * pi * k / sides), z) for k in range(sides)]
    for low, high in zip(rows, rows[1:]):
        for k in range(sides):
            n = (k + 1) % sides
            ring = (low[k], low[n], high[n], high[k])
            faces += [tuple(dict.fromkeys(f)) for f in (ring[:3], (ring[0],) + ring[2:]) if len(set(f)) == 3]
    return Part(vertices, faces, kind, smooth)


def ball(r, rows=12, sides=24, squash=1.0):
    return lathe([(r * sin(pi * k / rows) if 0 < k < rows else 0.0, -squash * r * cos(pi * k / rows))
                  for k in range(rows + 1)], sides)


def rod(r, a, b, sides=12, closed=True, kind="solid"):
    """A cylinder from a to b."""
    d = [b[k] - a[k] for k in range(3)]
    length = sqrt(sum(v * v for v in d))
    profile = [(r, 0.0), (r, length)]
    if closed:
        profile = [(0.0, 0.0)] + profile + [(0.0, length)]
    tube = lathe(profile, sides, kind)
    z = [v / length for v in d]
    aside = (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0)
    x = [aside[k] - z[k] * sum(aside[i] * z[i] for i in range(3)) for k in range(3)]
    n = sqrt(sum(v * v for v in x))
    x = [v / n for v in x]
    y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
    tube.vertices = [tuple(a[k] + v[0] * x[k] + v[1] * y[k] + v[2] * z[k] for k in range(3)) for v in tube.vertices]
    return tube


def card(width, height):
    """A single quad that stands on the origin and looks to -y."""
    return Part([(-width / 2, 0, 0), (width / 2, 0, 0), (width / 2, 0, height), (-width / 2, 0, height)], [(0, 1, 2, 3)],
                "sheet")
