"""Writes a model as GLB and as OBJ. A model is a list of Part: one node and mesh each."""
import json
import os
import struct
from math import cos, pi, sin


def f32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def shortest(x):
    """The shortest decimal that reads back as the same 32-bit float."""
    for digits in range(1, 10):
        text = "%.*g" % (digits, x)
        if f32(float(text)) == f32(x):
            break
    return text if "e" not in text else ("%.12f" % float(text)).rstrip("0")


class Part:
    """A mesh, its material's (name, colour), and its node's transform: turned by `degrees` about `axis`, then
    moved by `offset`."""

    def __init__(self, name, material, solids, offset=None, axis=(1.0, 0.0, 0.0), degrees=0.0):
        self.name, self.material, self.solids = name, material, solids
        self.offset = offset
        half = degrees * pi / 360
        self.rotation = tuple(f32(sin(half) * a) for a in axis) + (f32(cos(half)),)

    def charts(self):
        return [chart for solid in self.solids for chart in solid.charts]

    def turned(self, p):
        x, y, z, w = self.rotation
        t = (2 * (y * p[2] - z * p[1]), 2 * (z * p[0] - x * p[2]), 2 * (x * p[1] - y * p[0]))
        return (p[0] + w * t[0] + y * t[2] - z * t[1], p[1] + w * t[1] + z * t[0] - x * t[2],
                p[2] + w * t[2] + x * t[1] - y * t[0])

    def placed(self, p):
        return tuple(a + b for a, b in zip(self.turned(p), self.offset)) if self.offset else p

    def oriented(self, n):
        return self.turned(n) if self.offset else n


def replace_file(path, data):
    with open(path + ".part", "wb") as out:
        out.write(data)
    os.replace(path + ".part", path)


def write_obj(path, title, parts):
    lines = ["# " + title, "# vt is the lightmap, v up"]
    base = 0
    for part in parts:
        lines.append("o " + part.name)
        positions, normals, uvs, faces = [], [], [], []
        for chart in part.charts():
            for (p, n, _, _), uv in zip(chart.vertices, chart.lightmap):
                positions.append("v " + " ".join(shortest(x) for x in part.placed(p)))
                normals.append("vn " + " ".join(shortest(round(x, 5) + 0.0) for x in part.oriented(n)))
                uvs.append("vt " + " ".join(shortest(x) for x in uv))
            for triangle in chart.triangles:
                faces.append("f " + " ".join("%d/%d/%d" % ((base + i + 1,) * 3) for i in triangle))
            base += len(chart.vertices)
        lines += positions + uvs + normals + faces
    replace_file(path, ("\n".join(lines) + "\n").encode())
    return base


def write_glb(path, name, generator, parts):
    blob = bytearray()
    views, accessors, meshes, nodes, materials = [], [], [], [], []

    def add(rows, code, component, kind, target, bounds=False):
        data = b"".join(struct.pack("<%d%s" % (len(row), code), *row) for row in rows)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data), "target": target})
        accessor = {"bufferView": len(views) - 1, "componentType": component, "count": len(rows), "type": kind}
        if bounds:
            accessor["min"] = [min(f32(row[i]) for row in rows) for i in range(3)]
            accessor["max"] = [max(f32(row[i]) for row in rows) for i in range(3)]
        accessors.append(accessor)
        blob.extend(data + b"\0" * (-len(data) % 4))
        return len(accessors) - 1

    for part in parts:
        vertices, uvs, indices = [], [], []
        for chart in part.charts():
            indices += [(len(vertices) + i,) for t in chart.triangles for i in t]
            vertices += chart.vertices
            uvs += chart.lightmap
        attributes = {
            "POSITION": add([p for p, _, _, _ in vertices], "f", 5126, "VEC3", 34962, True),
            "NORMAL": add([n for _, n, _, _ in vertices], "f", 5126, "VEC3", 34962),
            "TEXCOORD_0": add([(u, 1.0 - v) for _, _, _, (u, v) in vertices], "f", 5126, "VEC2", 34962),
            "TEXCOORD_1": add([(u, 1.0 - v) for u, v in uvs], "f", 5126, "VEC2", 34962),
        }
        material_name, colour = part.material
        if material_name not in [m["name"] for m in materials]:
            materials.append({"name": material_name, "pbrMetallicRoughness": {
                "baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}})
        material = [m["name"] for m in materials].index(material_name)
        meshes.append({"name": part.name, "primitives": [{
            "attributes": attributes, "material": material,
            "indices": add(indices, "H", 5123, "SCALAR", 34963)}]})
        node = {"name": part.name, "mesh": len(meshes) - 1}
        if part.offset:
            node.update(translation=list(part.offset), rotation=list(part.rotation))
        nodes.append(node)

    document = {"asset": {"version": "2.0", "generator": generator}, "scene": 0,
                "scenes": [{"name": name, "nodes": list(range(len(nodes)))}], "nodes": nodes,
                "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
                "buffers": [{"byteLength": len(blob)}]}
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = (struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob)
    data = struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body
    replace_file(path, data)
    return len(data)
