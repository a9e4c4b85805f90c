#!/usr/bin/env python3
"""Writes assets/emblem.png, a mask for tests and docs: a five-pointed star in a ring, white, with its shape in alpha,
anti-aliased by 8 × 8 samples a pixel. Python alone; the same bytes each time for one zlib. Usage: make_emblem.py"""
import math
import pathlib
import struct
import zlib

SIZE, SAMPLES = 96, 8
CENTRE = SIZE / 2


def in_star(x, y, tip=30.0, notch=12.0):
    """Whether a point about the centre, y up, lies in the star: left of one of its edges as seen from the centre."""
    sector = math.pi / 5
    angle = abs((math.atan2(x, y) + sector) % (2 * sector) - sector)
    px, py = math.hypot(x, y) * math.sin(angle), math.hypot(x, y) * math.cos(angle)
    ax, ay = 0.0, tip
    bx, by = notch * math.sin(sector), notch * math.cos(sector)
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax) <= 0


def solid(x, y):
    return in_star(x, y) or 36.0 <= math.hypot(x, y) <= 44.0


def coverage(column, row):
    hits = 0
    for i in range(SAMPLES * SAMPLES):
        x = column + (i % SAMPLES + 0.5) / SAMPLES - CENTRE
        y = CENTRE - row - (i // SAMPLES + 0.5) / SAMPLES
        hits += solid(x, y)
    return round(255 * hits / SAMPLES ** 2)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def main():
    rows = b"".join(b"\0" + b"".join(bytes((255, coverage(c, r))) for c in range(SIZE)) for r in range(SIZE))
    header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 4, 0, 0, 0)  # grey and alpha
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    target = pathlib.Path(__file__).resolve().parents[2] / "assets" / "emblem.png"
    target.write_bytes(png)


main()
