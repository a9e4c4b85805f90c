#!/usr/bin/env python3
"""Makes docs/images/terrain.png and docs/images/spheres.png, casters without voxels, and docs/images/light.png, bent
normals, tinted penumbrae and layers, from the assets.

Usage: tools/picture_casters.py [VDBSHADE]     the program; build/vdbshade where none is given. Needs Python 3 only.
"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
ASSETS = os.path.abspath(os.path.join(ROOT, "assets"))
SIDE, GAP = 256, 4
SUN = {"name": "sun", "type": "directional", "direction": [-0.7, 0.4, 0.3], "angle_deg": 4}
LAND = {"heightfield": os.path.join(ASSETS, "terrain.png"), "height": 2}
SHADOW, AO = "R=shadow.sun,G=shadow.sun,B=shadow.sun", "R=ao,G=ao,B=ao"
TINT, BENT = "R=tint.sun.R,G=tint.sun.G,B=tint.sun.B", "R=bent.X,G=bent.Y,B=bent.Z"
LIT = "R=irradiance.R,G=irradiance.G,B=irradiance.B"


def read_png(path):
    """Rows of 8-bit RGB."""
    data = open(path, "rb").read()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            assert bits == 8 and colour == 2, "expected 8 bits of RGB"
        packed += body if kind == b"IDAT" else b""
        at += size + 12
    raw, rows, above = zlib.decompress(packed), [], bytearray(3 * width)
    for y in range(height):
        start = y * (3 * width + 1)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + 3 * width])
        for i in range(3 * width):
            a, b, c = (row[i - 3] if i > 2 else 0), above[i], (above[i - 3] if i > 2 else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            row[i] = (row[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        rows.append(bytes(row))
        above = row
    return rows


def write_png(path, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    data = zlib.compress(b"".join(b"\0" + row for row in rows), 9)
    header = struct.pack(">IIBBBBB", len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def bake(program, folder, casters, receiver, pack, **keys):
    scene = os.path.join(folder, "scene.json")
    output = os.path.join(folder, "out.png")
    with open(scene, "w") as file:
        json.dump({"casters": casters, "lights": [SUN], "ao": {"distance": 1}, "irradiance": True, **keys,
                   "receivers": [{**receiver, "size": SIDE, "output": output, "bits": 8, "pack": pack}]}, file)
    subprocess.run([program, "bake", scene, "--quiet"], check=True)
    return read_png(output)


def join(panels):
    gap = b"\xff" * (3 * GAP)
    return [gap.join(rows) for rows in zip(*panels)]


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build", "vdbshade")
    land, direct = {**LAND, "size": [10, 10]}, {**LAND, "size": [10, 10], "direct": True}
    top = {**LAND, "extent": [10, 10]}
    balls, floor = {"spheres": os.path.join(ASSETS, "spheres.csv")}, {"mesh": os.path.join(ASSETS, "seeds_floor.obj")}
    with tempfile.TemporaryDirectory() as folder:
        write_png(os.path.join(ROOT, "docs", "images", "terrain.png"),
                  join([bake(program, folder, [direct], top, pack) for pack in (LIT, SHADOW, AO)] +
                       [bake(program, folder, [land], top, SHADOW, resolution=384)]))
        write_png(os.path.join(ROOT, "docs", "images", "spheres.png"),
                  join([bake(program, folder, [balls], floor, pack) for pack in (LIT, SHADOW, AO)]))
        light(program, folder)


def light(program, folder):
    """The seeds' floor: bent normals; penumbrae in red; every second solid in a hard layer; a blue sky."""
    with open(os.path.join(ASSETS, "seeds.json")) as file:
        casters = [{"sdf": solid} for solid in json.load(file)["casters"][0]["sdf"]["of"]]
    floor = {"mesh": os.path.join(ASSETS, "seeds_floor.obj")}
    layers = {"layers": [{"name": "hard", "softness": 0}]}
    parted = [{**caster, "layer": "hard"} if i % 2 else caster for i, caster in enumerate(casters)]
    panels = [bake(program, folder, casters, floor, BENT, ao={"distance": 1.5, "bent_normals": "tangent", "cones": 64}),
              bake(program, folder, casters, floor, TINT, tint=[0.6, 1.2, 1.8]),
              bake(program, folder, parted, floor, SHADOW, **layers),
              bake(program, folder, casters, floor, LIT, ambient=[0.15, 0.25, 0.45])]
    write_png(os.path.join(ROOT, "docs", "images", "light.png"), join(panels))


if __name__ == "__main__":
    main()
