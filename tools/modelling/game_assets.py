"""The sixteen game assets of tools/modelling/make_game_assets.py, as lists of (name, Part). Metres, z up."""
from math import atan2, cos, exp, hypot, pi, sin, sqrt
from random import Random

from game_parts import Part, ball, box, card, cube, grid, ground, lathe, rod, together


def room():
    """Faces inwards, a window and a door left open; furniture that stands on the floor and touches the walls."""
    shell = box((0, 6), (0, 5), (0, 3), cells=(24, 20, 12)).inward()
    shell.kind = "room"
    shell.without(lambda x, y, z: (y == 0 and 2 < x < 4.5 and 1 < z < 2.5) or (x == 6 and 2 < y < 3 and z < 2))
    table = together([cube(3, 2, 0.74, 1.6, 0.9, 0.04)] +
                     [cube(3 + sx * 0.7, 2 + sy * 0.38, 0.36, 0.06, 0.06, 0.72) for sx in (-1, 1) for sy in (-1, 1)])
    shelf = together([cube(0.9, 4.82, z, 1.6, 0.36, 0.03) for z in (0.02, 0.5, 1.0, 1.5, 1.985)] +
                     [cube(x, 4.82, 1.0, 0.03, 0.36, 2.0) for x in (0.1, 1.7)])
    rng = Random(1)
    books, x = [], 0.13
    while x < 1.6:
        w, h = rng.uniform(0.02, 0.05), rng.uniform(0.25, 0.4)
        for z in (0.515, 1.015):
            books.append(box((x, x + w), (4.75 - rng.uniform(0, 0.05), 4.99), (z, z + h)))
        x += w + 0.001
    parts = [("shell", shell), ("table", table), ("shelf", shelf), ("books", together(books)),
             ("lamp", ball(0.18).moved(3, 2, 2.2)), ("cord", rod(0.01, (3, 2, 2.35), (3, 2, 3.0), 8)),
             ("rug", cube(3, 2.2, 0.004, 2.6, 1.8, 0.008, cells=(8, 6, 1))),
             ("bin", lathe([(0.0, 0.0), (0.12, 0.0), (0.15, 0.35), (0.14, 0.35), (0.11, 0.01), (0.0, 0.01)], 24)
              .moved(5.5, 4.5, 0.0))]
    for k, (x, y, turn) in enumerate(((3, 1.2, 0.1), (3.4, 2.9, pi), (1.9, 2.0, -1.4))):
        chair = together([cube(0, 0, 0.45, 0.42, 0.42, 0.04), cube(0, -0.2, 0.75, 0.42, 0.025, 0.5)] +
                         [cube(a * 0.19, b * 0.19, 0.215, 0.035, 0.035, 0.43) for a in (-1, 1) for b in (-1, 1)])
        parts.append(("chair%d" % k, chair.moved(x, y, 0, turn)))
    return parts


def corridors():
    """Cells of 3 m that are open to their neighbours by doors of 1.2 m; faces inwards, no thickness; light from above."""
    plan = ["##.##", "#.###", "#####", ".#.#.", "##.##"]
    cells = {(i, j) for j, row in enumerate(plan) for i, c in enumerate(row) if c == "#"}
    faces, vertices, index = [], [], {}

    def quad(corners):
        ring = []
        for p in corners:
            key = (i, j) + tuple(round(v, 6) for v in p)  # neighbours share no vertices
            if key not in index:
                index[key] = len(vertices)
                vertices.append(key[2:])
            ring.append(index[key])
        faces.append(ring)

    step = 0.3
    for i, j in sorted(cells):
        for a in range(10):
            for b in range(10):
                x, y, s = 3 * i + a * step, 3 * j + b * step, step
                quad([(x, y, 0), (x + s, y, 0), (x + s, y + s, 0), (x, y + s, 0)])
                if not ((i + j) % 2 == 0 and 3 <= a < 7 and 3 <= b < 7):  # a skylight
                    quad([(x, y, 3), (x, y + s, 3), (x + s, y + s, 3), (x + s, y, 3)])
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            door = (i + di, j + dj) in cells
            for a in range(10):
                for b in range(10):
                    if door and 3 <= a < 7 and b < 7:
                        continue
                    s, z = a * step, b * step
                    if di:
                        x = 3 * i + (3 if di > 0 else 0)
                        ring = [(x, 3 * j + s, z), (x, 3 * j + s, z + step), (x, 3 * j + s + step, z + step),
                                (x, 3 * j + s + step, z)]
                        quad(ring if di > 0 else ring[::-1])
                    else:
                        y = 3 * j + (3 if dj > 0 else 0)
                        ring = [(3 * i + s, y, z), (3 * i + s + step, y, z), (3 * i + s + step, y, z + step),
                                (3 * i + s, y, z + step)]
                        quad(ring if dj > 0 else ring[::-1])
    parts = [("shell", Part(vertices, faces, "room"))]
    for i, j in sorted(cells):
        if (i + 1, j) in cells:  # frames that stand in the openings, through both sheets of the wall
            x, y = 3 * i + 3, 3 * j + 1.5
            parts.append(("frame%d%d" % (i, j), together([cube(x, y - 0.6, 1.05, 0.2, 0.1, 2.1),
                                                          cube(x, y + 0.6, 1.05, 0.2, 0.1, 2.1),
                                                          cube(x, y, 2.15, 0.2, 1.3, 0.1)])))
        parts.append(("column%d%d" % (i, j), lathe([(0.0, 0.0), (0.15, 0.0), (0.12, 0.2), (0.12, 2.8), (0.15, 3.0),
                                                    (0.0, 3.0)], 12).moved(3 * i + 0.5, 3 * j + 0.5)))
    return parts


def wall_with(length, height, thick, holes):
    """A wall along x from 0, between y = 0 and `thick`, made of boxes around holes (x0, x1, z0, z1), in the order of x."""
    parts, x = [], 0.0
    for x0, x1, z0, z1 in holes:
        parts.append(box((x, x0), (0, thick), (0, height), cells=(6, 1, 6)))
        if z0 > 0:
            parts.append(box((x0, x1), (0, thick), (0, z0), cells=(4, 1, 3)))
        parts.append(box((x0, x1), (0, thick), (z1, height), cells=(4, 1, 2)))
        x = x1
    parts.append(box((x, length), (0, thick), (0, height), cells=(6, 1, 6)))
    return together(parts)


def house():
    """Two floors, thick walls of boxes that touch, roof sheets, furniture: all in one mesh."""
    storey = []
    for z in (0.0, 2.8):
        storey += [box((0, 8), (0, 6), (z, z + 0.2), cells=(16, 12, 1)) if z == 0 else
                   together([box((0, 8), (0, 4), (z, z + 0.2), cells=(16, 8, 1)),
                             box((0, 5), (4, 6), (z, z + 0.2), cells=(10, 4, 1))]),
                   wall_with(8, 2.6, 0.25, [(1, 2.5, 0.9, 2.1), (3.5, 4.5, 0, 2.1), (5.5, 7, 0.9, 2.1)]).moved(0, 0, z + 0.2),
                   wall_with(8, 2.6, 0.25, [(2, 3.5, 0.9, 2.1), (5, 6.5, 0.9, 2.1)]).moved(0, 5.75, z + 0.2),
                   wall_with(5.5, 2.6, 0.25, [(2, 3.5, 0.9, 2.1)]).moved(0.25, 0.25, z + 0.2, pi / 2),
                   wall_with(5.5, 2.6, 0.25, [(1.5, 3, 0.9, 2.1)]).moved(8, 0.25, z + 0.2, pi / 2),
                   wall_with(5.5, 2.6, 0.1, [(2.5, 3.4, 0, 2.0)]).moved(4, 0.25, z + 0.2, pi / 2)]
        for x, y in ((1.5, 1.5), (6, 2)):
            storey += [cube(x, y, z + 0.92, 1.4, 0.8, 0.04)] + [
                cube(x + a * 0.6, y + b * 0.3, z + 0.55, 0.05, 0.05, 0.7) for a in (-1, 1) for b in (-1, 1)]
        storey += [cube(1.3, 5.2, z + 0.45, 2.0, 1.0, 0.5, cells=(8, 4, 2)), cube(0.4, 5.2, z + 0.75, 0.1, 1.0, 1.1),
                   cube(3.7, 1.0, z + 1.2, 0.4, 1.2, 2.0, cells=(1, 3, 5)), ball(0.12, 8, 16).moved(6, 2, z + 2.2)]
    storey += [box((5.2 + 0.22 * k, 5.42 + 0.22 * k), (4.6, 5.6), (0.2, 0.2 + 0.2 * (k + 1))) for k in range(10)]
    for side in (-1, 1):  # roof plates of 12 cm over a ridge along x
        slope = together([box((-0.4, 8.4), (0, 3.9), (0, 0.12), cells=(20, 10, 1))])
        slope.moved(0, 0, 0, tilt=0.55)
        if side > 0:
            slope.vertices = [(8 - x, 6 - y, z) for x, y, z in slope.vertices]
        storey.append(slope.moved(0, -0.35 * -side, 5.45))
    storey.append(box((6, 6.7), (1.5, 2.2), (5.6, 8.4), cells=(2, 2, 8)))
    whole = together(storey)
    return [("house", whole), ("garden", ground((-3, 11), (-3, 9), 16))]


def fence():
    """Pickets of 2 cm on two rails, posts sunk into a ground that is a sheet."""
    rng = Random(4)
    bumps = lambda x, y: 0.04 * sin(2.1 * x) * cos(1.7 * y)  # noqa: E731
    parts = [("ground", ground((-3, 3), (-2, 2), 24, bumps))]
    pickets, posts, rails = [], [], []
    for side in range(2):
        y = -0.8 + 1.6 * side
        for k in range(46):
            x, h = -2.7 + 0.12 * k, 1.0 + rng.uniform(-0.02, 0.02)
            a, b = x - 0.035, x + 0.035
            outline = [(a, 0.08), (b, 0.08), (b, h - 0.06), (x, h), (a, h - 0.06)]
            front = [(p, y, q) for p, q in outline]
            back = [(p, y + 0.02, q) for p, q in outline]
            faces = [(0, 1, 2, 3, 4), (9, 8, 7, 6, 5)] + [(5 + i, 5 + (i + 1) % 5, (i + 1) % 5, i) for i in range(5)]
            pickets.append(Part(front + back, faces))
        for k in range(4):
            posts.append(cube(-2.7 + 1.8 * k, y + 0.09, 0.35, 0.1, 0.1, 1.5, cells=(2, 2, 8)))
        for z in (0.3, 0.8):
            rails.append(box((-2.75, 2.75), (y + 0.02, y + 0.055), (z - 0.04, z + 0.04), cells=(12, 1, 1)))
    return parts + [("pickets", together(pickets)), ("posts", together(posts)), ("rails", together(rails)),
                    ("stone", ball(0.3, 10, 20, 0.7).moved(1.2, 0, 0.0))]


def foliage():
    """Crossed quads on a slab, ivy before a wall; half the bushes have a second quad for the back, in the same place."""
    rng = Random(5)
    cards, double, ivy = [], [], []
    for k in range(150):
        x, y, turn, w = rng.uniform(-2.3, 2.3), rng.uniform(-2.3, 1.9), rng.uniform(0, pi), rng.uniform(0.2, 0.5)
        for cross in (0.0, pi / 3, 2 * pi / 3):
            quad = card(w, w * 1.3).moved(x, y, 0.0, turn + cross)
            (double if k % 2 else cards).append(quad)
            if k % 2:
                back = Part(quad.vertices, [f[::-1] for f in quad.faces], "sheet")
                double.append(back)
    for k in range(300):
        quad = card(0.14, 0.14).moved(0, 0, 0, 0, rng.uniform(-0.7, 0.2))
        ivy.append(quad.moved(rng.uniform(-2, 2), 2.08 - 0.005 - rng.uniform(0.06, 0.14), rng.uniform(0.1, 1.8),
                              rng.uniform(-0.5, 0.5)))
    return [("soil", box((-2.5, 2.5), (-2.5, 2.5), (-0.2, 0), cells=(16, 16, 1))),
            ("wall", box((-2.2, 2.2), (2.1, 2.3), (0, 2), cells=(16, 1, 8))), ("cards", together(cards, "sheet")),
            ("double", together(double, "sheet")), ("ivy", together(ivy, "sheet"))]


def head():
    """Open at the eyes and the neck; eyeballs within, a collar around."""
    def shape(x, y, z):
        n = sqrt(x * x + y * y + z * z)
        x, y, z = x / n, y / n, z / n
        nose = 0.35 * exp(-((x / 0.13) ** 2 + ((z + 0.05) / 0.22) ** 2)) if y < 0 else 0.0
        brow = 0.08 * exp(-((z - 0.28) / 0.1) ** 2) if y < 0 else 0.0
        jaw = 1.0 - 0.25 * max(0.0, -z) ** 2
        r = 1.0 + nose + brow
        return (0.085 * r * x * jaw, 0.105 * r * y, 0.13 * z * (1 + 0.1 * (z < 0)) + 1.6)

    sphere = ball(1.0, 80, 160)
    sphere.without(lambda x, y, z: z < -0.86 or (y < 0 and hypot((abs(x) - 0.36) / 0.2, (z - 0.1) / 0.12) < 1.0))
    sphere.vertices = [shape(*v) for v in sphere.vertices]
    eye = [ball(0.021, 16, 32).moved(side * 0.031, -0.077, 1.613) for side in (-1, 1)]
    collar = lathe([(0.06, 1.44), (0.075, 1.44), (0.08, 1.5), (0.072, 1.5), (0.06, 1.44)], 48)
    hat = lathe([(0.14, 1.685), (0.14, 1.69), (0.095, 1.695), (0.09, 1.78), (0.0, 1.79)], 64, "sheet")
    return [("skin", sphere), ("eyes", together(eye, smooth=True)), ("collar", collar), ("hat", hat)]


def rivets():
    """Half balls without a base on plates on a wall, some sunk, some a hair off; decals half a millimetre off; a grate."""
    rng = Random(7)
    half, parts = [], []
    for i in range(20):
        for j in range(8):
            rivet = lathe([(0.02, 0.0), (0.0185, 0.008), (0.014, 0.0145), (0.0075, 0.0185), (0.0, 0.02)], 12)
            lift = (0.0005, 0.0, -0.002)[(i + j) % 3]
            rivet.moved(0, 0, 0, 0, pi / 2).moved(-1.9 + 0.2 * i, -0.02 - lift, 0.15 + 0.25 * j)
            half.append(rivet)
    decals = [card(0.18, 0.12).moved(rng.uniform(-1.7, 1.7), -0.0205 - 0.0004 * k, rng.uniform(0.2, 1.7)) for k in range(12)]
    plates = [box((-1.98 + 0.8 * k, -1.22 + 0.8 * k), (-0.02, 0.0), (0.05, 1.95), cells=(6, 1, 12)) for k in range(5)]
    bars = [rod(0.006, (1.0 + 0.04 * k, -0.35, 0.02), (1.0 + 0.04 * k, -0.35, 0.6), 6) for k in range(20)]
    bars += [rod(0.006, (0.98, -0.35, z), (1.78, -0.35, z), 6) for z in (0.1, 0.3, 0.5)]
    parts += [("wall", box((-2, 2), (0, 0.3), (0, 2), cells=(16, 1, 10))),
              ("floor", box((-2, 2), (-1.5, 0), (-0.1, 0), cells=(16, 8, 1))), ("plates", together(plates)),
              ("rivets", together(half, smooth=True)), ("decals", together(decals, "sheet")), ("grate", together(bars))]
    return parts


def cloth():
    """A sheet over a box, falling in folds onto the floor."""
    def point(s, t):
        x, y = 2.4 * (s - 0.5), 2.4 * (t - 0.5)
        out = max(abs(x) - 0.5, abs(y) - 0.5, 0.0)
        angle = atan2(y, x)
        drop = 0.82 * (1 - exp(-(out / 0.22) ** 2))
        fold = 0.035 * sin(11 * angle) * min(1.0, out / 0.25)
        pull = 1.0 - 0.42 * (1 - exp(-(out / 0.3) ** 2)) * out / max(hypot(x, y), 1e-6)
        return (x * pull + fold * cos(angle), y * pull + fold * sin(angle), 0.83 - drop + 0.01 * sin(9 * x) * sin(8 * y))
    return [("floor", box((-2, 2), (-2, 2), (-0.1, 0), cells=(16, 16, 1))),
            ("box", cube(0, 0, 0.4, 0.96, 0.96, 0.8, cells=(4, 4, 4))), ("cloth", grid(90, 90, point))]


def stairs():
    """A straight flight and a winding one with railings of 2 cm, up to a landing."""
    parts = [("floor", box((-3, 5), (-3, 3), (-0.2, 0), cells=(24, 18, 1)))]
    flight = [box((0.28 * k, 0.28 * k + 0.28), (-0.6, 0.6), (0.17 * k, 0.17 * k + 0.17)) for k in range(14)]
    parts += [("flight", together(flight)),
              ("landing", box((3.92, 5), (-1.5, 1.5), (2.2, 2.38), cells=(4, 12, 1)))]
    rails = []
    for y in (-0.57, 0.57):
        rails += [rod(0.012, (0.14 + 0.28 * k, y, 0.17 * (k + 1)), (0.14 + 0.28 * k, y, 0.17 * (k + 1) + 0.9), 8)
                  for k in range(14)]
        rails.append(rod(0.025, (0.14, y, 1.07), (0.14 + 0.28 * 13, y, 0.17 * 14 + 0.9), 12))
    parts.append(("railing", together(rails, smooth=True)))
    treads, posts = [], []
    for k in range(24):
        a = 0.32 * k
        tread = [(0.06, -0.13), (0.9, -0.16), (0.9, 0.16), (0.06, 0.13)]
        z = 0.1 + 0.13 * k
        low = [(x, y, z - 0.04) for x, y in tread]
        high = [(x, y, z) for x, y in tread]
        faces = [(3, 2, 1, 0), (4, 5, 6, 7)] + [(i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)]
        treads.append(Part(low + high, faces).moved(-1.6, 0, 0, a))
        posts.append(rod(0.01, (0.85, 0, z), (0.85, 0, z + 0.95), 8).moved(-1.6, 0, 0, a))
    parts += [("treads", together(treads)), ("posts", together(posts, smooth=True)),
              ("pole", rod(0.08, (-1.6, 0, 0), (-1.6, 0, 3.6), 24))]
    parts[-1][1].smooth = True
    return parts


def pipes():
    """Open at both ends: most of one wall, some of two; they lie on and in each other, with flanges and bends."""
    tubes, thick, bends = [], [], []
    for row in range(3):
        for k in range(7 - row):
            x, z = -1.5 + 0.5 * k + 0.25 * row, 0.25 + 0.43 * row
            if (row + k) % 3:
                tubes.append(rod(0.25, (x, -1.5, z), (x, 1.5 - 0.1 * k, z), 32, closed=False))
            else:
                wall = lathe([(0.25, 0), (0.25, 3), (0.22, 3), (0.22, 0), (0.25, 0)], 32)
                thick.append(wall.moved(0, 0, 0, 0, pi / 2).moved(x, 1.5, z))
    for k in range(3):
        def ring(s, t, k=k):  # a quarter of a torus in the plane x = const
            a, b = 0.5 * pi * t, 2 * pi * s
            r = 0.6 + 0.15 * cos(b)
            return (2.3 + 0.15 * sin(b), 0.9 * k - 1.5 + r * cos(a), 0.02 + r * sin(a))
        bend = grid(24, 16, ring, "solid")
        bends.append(bend)
    flanges = [rod(0.3, (-1.5 + 0.5 * k, 0.4, 0.25), (-1.5 + 0.5 * k, 0.46, 0.25), 32) for k in range(0, 7, 2)]
    return [("floor", box((-2.5, 3.5), (-2.5, 2.5), (-0.1, 0), cells=(24, 20, 1))),
            ("tubes", together(tubes, "hollow", smooth=True)), ("thick", together(thick, smooth=True)),
            ("bends", together(bends, "hollow", smooth=True)), ("flanges", together(flanges, smooth=True))]


def mixed():
    """A level's bits: some faces turned over, instances mirrored by a negative scale, one crate wholly inside out."""
    rng = Random(11)
    parts = [("floor", box((-4, 4), (-4, 4), (-0.2, 0), cells=(20, 20, 1)))]
    for k in range(8):
        block = box((-0.4, 0.4), (-0.3, 0.3), (0, rng.uniform(0.6, 1.6)), cells=(3, 3, 4))
        block.true_faces = block.faces
        block.faces = [f[::-1] if rng.random() < 0.12 else f for f in block.faces]
        block.at = (-3 + 2 * (k % 4), -2.5 + 1.8 * (k // 4), 0.0)
        parts.append(("turned%d" % k, block))
    for k in range(6):
        arch = together([box((-0.9, -0.6), (-0.25, 0.25), (0, 1.6), cells=(1, 1, 4)),
                         box((0.4, 0.9), (-0.25, 0.25), (0, 1.6), cells=(1, 1, 4)),
                         box((-0.9, 0.9), (-0.25, 0.25), (1.6, 1.9), cells=(5, 1, 1)),
                         rod(0.05, (-0.6, 0, 1.2), (0.4, 0, 1.4), 12)])
        arch.at = (-2.8 + 2.7 * (k % 3), 1.2 + 1.6 * (k // 3), 0.0)
        arch.scale = ((-1, 1, 1), (1, -1, 1), (1, 1, 1), (-1, -1, 1), (-1.2, 0.8, 0.9), (1.1, -1, 1.2))[k]
        parts.append(("arch%d" % k, arch))
    inside_out = box((-0.4, 0.4), (-0.4, 0.4), (0, 0.8), cells=(4, 4, 4)).inward()
    inside_out.kind = "room"
    inside_out.at = (0.0, 0.35, 2.6)
    parts.append(("inside_out", inside_out))
    parts.append(("balls", together([ball(0.3, 12, 24).moved(-2 + 2 * k, -3.6, 0.25) for k in range(3)], smooth=True)))
    return parts


def crates():
    """Stacked so that they touch, and thrown so that they cross each other."""
    rng = Random(12)
    parts = [("floor", box((-3, 3), (-3, 3), (-0.15, 0), cells=(16, 16, 1)))]
    for k in range(9):
        stack = [cube(0, 0, 0.3 + 0.6 * level, 0.6, 0.6, 0.6, cells=(3, 3, 3)) for level in range(1 + k % 3)]
        parts.append(("stack%d" % k, together(stack).moved(-1.8 + 0.6 * (k % 3), 0.6 * (k // 3), 0)))
    for k in range(26):
        w = rng.uniform(0.3, 0.7)
        crate = cube(0, 0, 0, w, w * 0.8, w * 0.7, cells=(3, 3, 3))
        crate.moved(0, 0, 0, 0, rng.uniform(-0.6, 0.6)).moved(rng.gauss(1.1, 0.55), rng.gauss(-0.9, 0.55),
                                                              0.2 + abs(rng.gauss(0, 0.35)), rng.uniform(0, pi))
        parts.append(("thrown%d" % k, crate))
    return parts


def vessels():
    """Shells of one sheet, open above, with things in them; one cup of two walls; all on a table."""
    bowl = [(0.0, 0.0), (0.06, 0.0), (0.07, 0.012), (0.12, 0.03), (0.16, 0.06), (0.18, 0.1), (0.185, 0.12)]
    vase = [(0.0, 0.0), (0.05, 0.0)] + [(0.05 + 0.045 * sin(pi * k / 20) + 0.02 * sin(pi * k / 10) ** 3, 0.015 * k)
                                       for k in range(1, 21)] + [(0.06, 0.31)]
    cup = [(0.0, 0.0), (0.03, 0.0), (0.04, 0.02), (0.045, 0.1)]
    mug = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.1), (0.036, 0.1), (0.036, 0.005), (0.0, 0.005)]

    def handle(s, t):
        a, b = pi * (t - 0.5), 2 * pi * s
        r = 0.028 + 0.006 * cos(b)
        return (0.04 + r * cos(a), 0.006 * sin(b), 0.05 + r * sin(a))
    parts = [("table", box((-0.8, 0.8), (-0.6, 0.6), (-0.04, 0), cells=(24, 18, 1))),
             ("bowl", lathe(bowl, 64, "sheet").moved(-0.3, 0, 0)),
             ("fruit", together([ball(0.045, 14, 28).moved(-0.3 + 0.05 * cos(2.1 * k), 0.05 * sin(2.1 * k), 0.06 + 0.001 * k)
                                 for k in range(3)], smooth=True)),
             ("vase", lathe(vase, 64, "hollow").moved(0.15, 0.2, 0)),
             ("flower", together([rod(0.003, (0.15, 0.2, 0.01), (0.15 + 0.06 * cos(k), 0.2 + 0.06 * sin(k), 0.5), 8)
                                  for k in range(5)], smooth=True)),
             ("cup", lathe(cup, 48, "sheet").moved(0.1, -0.25, 0)),
             ("spoon", rod(0.003, (0.09, -0.25, 0.01), (0.16, -0.25, 0.14), 8)),
             ("mug", lathe(mug, 48).moved(0.45, -0.1, 0)), ("handle", grid(16, 24, handle, "solid").inward().moved(0.448, -0.1, 0)),
             ("plate", lathe([(0.0, 0.0), (0.08, 0.0), (0.13, 0.015), (0.13, 0.018), (0.08, 0.004), (0.0, 0.004)], 64)
              .moved(-0.2, -0.4, 0))]
    return parts


def tree():
    """A closed trunk with closed branches that cross it, and leaf cards."""
    rng = Random(14)
    trunk = lathe([(0.0, -0.3), (0.3, -0.3), (0.25, 0.1), (0.2, 0.5), (0.17, 1.5), (0.14, 2.5), (0.08, 3.5), (0.0, 3.9)], 24)
    branches, leaves = [], []
    for k in range(22):
        a, z, length = 2.4 * k, 1.4 + 0.1 * k, 1.5 - 0.04 * k
        end = (length * cos(a), length * sin(a), z + 0.5)
        branches.append(rod(0.05 - 0.001 * k, (0, 0, z), end, 10))
        for _ in range(60):
            t = rng.uniform(0.4, 1.1)
            leaf = card(0.16, 0.22).moved(0, 0, 0, 0, rng.uniform(-1.4, 1.4))
            leaves.append(leaf.moved(end[0] * t + rng.gauss(0, 0.12), end[1] * t + rng.gauss(0, 0.12),
                                     z + 0.5 * t + rng.gauss(0, 0.12), rng.uniform(0, 2 * pi)))
    return [("trunk", trunk), ("branches", together(branches, smooth=True)), ("leaves", together(leaves, "sheet")),
            ("earth", lathe([(0.0, -0.5), (3.0, -0.5), (3.0, -0.02), (1.5, 0.0), (0.0, 0.05)], 48))]


def terrain():
    """A closed block with hills, rocks sunk in it."""
    rng = Random(15)

    def height(x, y):
        return (0.6 * sin(0.55 * x + 0.3) * cos(0.45 * y) + 0.15 * sin(1.9 * x + 1.1 * y) + 0.05 * sin(5.1 * x) * sin(4.3 * y))
    n = 64
    block = box((-6, 6), (-6, 6), (0, 1), cells=(n, n, 1))
    block.vertices = [(x, y, height(x, y) if z > 0.5 else -1.5) for x, y, z in block.vertices]
    block.faces = [g for f in block.faces for g in ((f[0], f[1], f[2]), (f[0], f[2], f[3]))]
    block.true_faces = block.faces
    block.smooth = True
    parts = [("land", block)]
    for k in range(40):
        x, y, r = rng.uniform(-5.3, 5.3), rng.uniform(-5.3, 5.3), rng.uniform(0.12, 0.6)
        rock = ball(r, 8, 14)
        rock.smooth = False
        rock.vertices = [tuple(c * (1 + 0.12 * sin(7 * u[0] / r + k) * cos(6 * u[1] / r - k)) for c in u)
                         for u in rock.vertices]
        parts.append(("rock%02d" % k, rock.moved(x, y, height(x, y) + rng.uniform(-0.5, 0.3) * r, rng.uniform(0, pi))))
    return parts


def village():
    """Forty houses, a well and a wall on a disc of ground, within a sky dome whose faces look inwards."""
    rng = Random(16)
    dome = ball(30, 24, 48).inward()
    dome.kind = "room"
    parts = [("sky", dome), ("ground", lathe([(0.0, -1.0), (29, -1.0), (29, 0.0), (0.0, 0.0)], 48))]
    parts[1][1].smooth = False
    for k in range(40):
        a, r = 2.39996 * k, 3.0 + 3.2 * sqrt(k)
        w, d, h = rng.uniform(1.4, 2.4), rng.uniform(1.4, 2.4), rng.uniform(1.2, 2.2)
        walls = cube(0, 0, h / 2, w, d, h, cells=(2, 2, 2))
        e = 0.25
        roof = Part([(-w / 2 - e, -d / 2 - e, h), (w / 2 + e, -d / 2 - e, h), (w / 2 + e, d / 2 + e, h),
                     (-w / 2 - e, d / 2 + e, h), (-w / 2 - e, 0, h + 0.9), (w / 2 + e, 0, h + 0.9)],
                    [(0, 3, 2, 1), (0, 1, 5, 4), (2, 3, 4, 5), (3, 0, 4), (1, 2, 5)])
        chimney = cube(w / 4, d / 8, h + 0.7, 0.25, 0.25, 1.0)
        house_parts = (("walls", walls), ("roof", roof), ("chimney", chimney))
        for name, p in house_parts:
            p.at = (0.95 * r * cos(a), 0.95 * r * sin(a), 0.0)
            parts.append(("%s%02d" % (name, k), p))
    well = lathe([(0.7, 0.0), (0.7, 0.8), (0.55, 0.8), (0.55, 0.0), (0.7, 0.0)], 32)
    return parts + [("well", well)]


ASSETS = {f.__name__: f for f in (room, corridors, house, fence, foliage, head, rivets, cloth, stairs, pipes, mixed, crates,
                                  vessels, tree, terrain, village)}
