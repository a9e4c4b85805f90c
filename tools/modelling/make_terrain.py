#!/usr/bin/env python3
"""Makes assets/terrain.png, the heightfield of the tests and the docs: 256 × 256 pixels of 16 bits, a mountain range
with a crater, a canyon and a table rock over low hills.

Needs Python 3 only and writes the same pixels each time. `make_terrain.py N FILE` makes another size, the same land.
"""
import os
import struct
import sys
import zlib
from math import exp, floor, hypot, sin


def mix(i, j, seed):
    """0 … 1, from whole numbers: a finaliser of MurmurHash3 (Appleby)."""
    h = (i * 0x9E3779B1 ^ j * 0x85EBCA77 ^ seed * 0xC2B2AE3D) & 0xFFFFFFFF
    h = ((h ^ h >> 16) * 0x85EBCA6B) & 0xFFFFFFFF
    h = ((h ^ h >> 13) * 0xC2B2AE35) & 0xFFFFFFFF
    return (h ^ h >> 16) / 4294967295.0


def noise(x, z, seed):
    """Value noise, smooth to the second derivative, -1 … 1."""
    i, j = floor(x), floor(z)
    u, v = x - i, z - j
    u, v = u * u * u * (u * (u * 6 - 15) + 10), v * v * v * (v * (v * 6 - 15) + 10)
    a = mix(i, j, seed) + u * (mix(i + 1, j, seed) - mix(i, j, seed))
    b = mix(i, j + 1, seed) + u * (mix(i + 1, j + 1, seed) - mix(i, j + 1, seed))
    return 2 * (a + v * (b - a)) - 1


def step(low, high, x):
    t = min(max((x - low) / (high - low), 0), 1)
    return t * t * (3 - 2 * t)


def height(x, z):
    """0 … 1 over the unit square."""
    hills = ridges = 0.0
    u, v = 5 * x, 5 * z
    for k in range(6):
        hills += noise(u, v, k) * 0.5**k
        level = noise(0.8 * u + 7, 0.8 * v, 20 + k)
        ridges += (1 - (level * level + 0.005) ** 0.5) ** 2 * 0.5**k
        u, v = 2 * (0.8 * u - 0.6 * v), 2 * (0.6 * u + 0.8 * v)  # no octave's squares lie over another's
    range_of = exp(-((z - 0.35 - 0.1 * sin(6 * x)) / 0.16) ** 2)
    y = 0.17 + 0.05 * hills + range_of * (0.27 * ridges - 0.08)
    crater = hypot(x - 0.73, z - 0.72) + 0.006 * noise(x * 24, z * 24, 50)
    y += 0.3 * exp(-((crater - 0.09) / 0.05) ** 2) - 0.06 * exp(-((crater / 0.06) ** 2))
    rock = hypot(x - 0.25, z - 0.75) + 0.02 * noise(x * 14, z * 14, 51)
    y += (0.38 + 0.01 * hills - y) * (1 - step(0.07, 0.085, rock))
    canyon = abs(x - 0.48 - 0.07 * sin(9 * z) - 0.02 * noise(z * 11, 3, 52))
    y -= (0.16 + 0.03 * noise(x * 30, z * 30, 53)) * (1 - step(0.012, 0.035, canyon)) * step(0.5, 0.62, z)
    return min(max(y, 0.0), 1.0)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(path, size):
    rows, above = [], bytes(2 * size)
    for i in range(size):
        row = b"".join(struct.pack(">H", round(65535 * height((j + 0.5) / size, (i + 0.5) / size))) for j in range(size))
        left = b"\0\0" + row[:-2]
        corner = b"\0\0" + above[:-2]
        # the filter "Paeth", as the land changes little from pixel to pixel
        filtered = bytearray(2 * size)
        for k in range(2 * size):
            a, b, c = left[k], above[k], corner[k]
            pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
            filtered[k] = (row[k] - (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255
        rows.append(b"\4" + bytes(filtered))
        above = row
    header = struct.pack(">IIBBBBB", size, size, 16, 0, 0, 0, 0)
    data = zlib.compress(b"".join(rows), 9)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


if __name__ == "__main__":
    here = os.path.dirname(os.path.abspath(__file__))
    write_png(sys.argv[2] if len(sys.argv) > 2 else os.path.join(here, "..", "..", "assets", "terrain.png"),
              int(sys.argv[1]) if len(sys.argv) > 1 else 256)
