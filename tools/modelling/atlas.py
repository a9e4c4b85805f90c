"""The lightmap: all charts packed into one unit square, with a grid of bits.

Rows of cells are Python integers, one bit a cell; shifts and ORs test all columns of a row at once, so charts of
any shape (arched walls, rings) nest into one another.
"""
from math import ceil, floor

TEXELS = 1024            # the size at which GAP holds
CELL = 2                 # texels a cell of the packer
GAP = 4                  # texels between charts
CELLS = TEXELS // CELL
STEPS = 1 << 16          # UVs are multiples of 1/STEPS: exact in 32-bit floats, and so is 1 - v
FINE = STEPS // CELLS     # of them in a cell
EPSILON = 1e-6


def touched(points):
    """(row, first, last) of the unit cells that a triangle touches."""
    edges = list(zip(points, points[1:] + points[:1]))
    low, high = (f(p[1] for p in points) for f in (min, max))
    for y in range(floor(low + EPSILON), max(ceil(high - EPSILON), floor(low + EPSILON) + 1)):
        xs = [p[0] for p in points if y <= p[1] <= y + 1]
        for (x0, y0), (x1, y1) in edges:
            for level in (y, y + 1):
                if (y0 < level) != (y1 < level):
                    xs.append(x0 + (x1 - x0) * (level - y0) / (y1 - y0))
        if xs:
            first = floor(min(xs) + EPSILON)
            yield y, first, max(ceil(max(xs) - EPSILON) - 1, first)


def centres(points):
    """(row, first, end) of the unit cells whose centre a triangle covers; a shared edge counts once."""
    edges = [tuple(sorted(e, key=lambda p: (p[1], p[0]))) for e in zip(points, points[1:] + points[:1])]
    low, high = (f(p[1] for p in points) for f in (min, max))
    for y in range(ceil(low - 0.5), ceil(high - 0.5)):
        xs = sorted(ceil(x0 + (x1 - x0) * (y + 0.5 - y0) / (y1 - y0) - 0.5)
                    for (x0, y0), (x1, y1) in edges if (y0 <= y + 0.5) != (y1 <= y + 0.5))
        if len(xs) == 2 and xs[0] < xs[1]:
            yield y, xs[0], xs[1]


def cover(triangles):
    """Row masks of the cells that any of the triangles touches."""
    rows = {}
    for points in triangles:
        for y, first, last in touched(points):
            rows[y] = rows.get(y, 0) | ((1 << (last + 1)) - (1 << first))
    return rows


def runs(mask):
    """(start, length) of each run of ones."""
    start = 0
    while mask:
        skip = (mask & -mask).bit_length() - 1
        mask >>= skip
        start += skip
        length = (~mask & (mask + 1)).bit_length() - 1
        yield start, length
        mask >>= length
        start += length


def spread(mask, length):
    """OR of mask >> 0 … mask >> length - 1."""
    done = 1
    while done < length:
        step = min(done, length - done)
        mask |= mask >> step
        done += step
    return mask


def lowest_place(rows, width, occupied):
    """The lowest, then leftmost (y, x) where the row masks meet nothing, or None."""
    shape = [list(runs(row)) for row in rows]
    columns = (1 << (CELLS - 1 - width)) - 1  # a margin of one cell on all sides
    cache = {}
    for y in range(1, CELLS - len(rows)):
        blocked = 0
        for r, row_runs in enumerate(shape):
            for start, length in row_runs:
                key = (y + r, length)
                if key not in cache:
                    cache[key] = spread(occupied[y + r], length)
                blocked |= cache[key] >> start
            if blocked | ~(columns << 1) == -1:
                break
        free = ~blocked & (columns << 1)
        if free:
            return y, (free & -free).bit_length() - 1
    return None


def pack(charts, density):
    """Gives each chart `lightmap`: its vertices' UVs, v up. Density: texels a unit at TEXELS."""
    items = []
    for order, chart in enumerate(charts):
        turned = []
        for turn in (lambda u, v: (u, v), lambda u, v: (-v, u)):
            uv = [turn(*vertex[2]) for vertex in chart.vertices]
            low = [min(p[i] for p in uv) for i in (0, 1)]
            scale = density * chart.density / CELL
            turned.append([tuple(round((x - l) * scale * FINE) / FINE for x, l in zip(p, low)) for p in uv])
        extent = [max(p[i] for p in turned[0]) for i in (0, 1)]
        items.append((-max(extent), -min(extent), order, chart, turned))
    occupied = [0] * (CELLS + 1)
    for _, _, _, chart, turned in sorted(items, key=lambda item: item[:3]):
        best = None
        for uv in turned:
            mask = cover([[uv[i] for i in t] for t in chart.triangles])
            rows = [mask.get(y, 0) for y in range(max(mask) + 1)]
            width = max(row.bit_length() for row in rows)
            place = lowest_place(rows, width, occupied) if width < CELLS and len(rows) < CELLS else None
            if place and (best is None or (place[0] + len(rows), place) < best[0]):
                best = ((place[0] + len(rows), place), uv, rows)
        if best is None:
            raise ValueError("the charts do not fit the lightmap: lower the texel density")
        (_, (y, x)), uv, rows = best
        ring = GAP // CELL
        for r, row in enumerate(rows):
            wide = spread(row << (x + ring), 2 * ring + 1)
            for other in range(max(y + r - ring, 0), min(y + r + ring, CELLS) + 1):
                occupied[other] |= wide
        chart.lightmap = [tuple((p + o) / CELLS for p, o in zip(q, (x, y))) for q in uv]


def check(charts):
    """Proves on TEXELS² what pack() promises; returns the fraction of the square that charts use."""
    everything = [0] * TEXELS
    area = 0.0
    for chart in charts:
        triangles = [[chart.lightmap[i] for i in t] for t in chart.triangles]
        for (ax, ay), (bx, by), (cx, cy) in triangles:
            twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            if twice <= 0.0:
                raise ValueError("a triangle has no area in the lightmap, or is mirrored")
            area += twice / 2
        if not all(0.0 <= x <= 1.0 for p in chart.lightmap for x in p):
            raise ValueError("lightmap coordinates leave the unit square")
        texels = [[(u * TEXELS, v * TEXELS) for u, v in t] for t in triangles]
        once = {}
        for points in texels:
            for y, first, end in centres(points):
                span = (1 << end) - (1 << first)
                if once.get(y, 0) & span:
                    raise ValueError("a chart overlaps itself")
                once[y] = once.get(y, 0) | span
        mask = cover(texels)
        for y, row in mask.items():
            wide = spread(row << GAP, 2 * GAP + 1)
            if any(everything[other] & wide for other in range(max(y - GAP, 0), min(y + GAP + 1, TEXELS))):
                raise ValueError("two charts are closer than %d texels" % GAP)
        for y, row in mask.items():
            everything[y] |= row
    return area
