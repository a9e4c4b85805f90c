"""Writes glTF files for tests, and shows what glTF and GLB files hold. Usage:

    gltf.py write FILE [BUFFER.bin] <DOCUMENT
    gltf.py show FILE EXPRESSION…

A document to write is a glTF without accessors. Where it would have an accessor's number it has the accessor: its type with
all of its numbers, such as {"VEC2": [0, 1, 1, 0]}, and what else an accessor has. "times" multiplies the numbers. "alphas" of
a colour are those of white vertices. A primitive may have a "plate": x, y and z of one corner, x and z of the opposite one.
Values of Python expressions are printed in one line, lists by their elements. `root` is the document, `text` its JSON without
spaces, `size` the file's in bytes.
"""
import base64
import json
import re
import struct
import sys

FORMATS = {5121: "B", 5123: "H", 5126: "f"}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def add_accessor(root, body, accessor):
    """Appends an accessor with its view and its bytes, and returns its number."""
    if "alphas" in accessor:
        white = [number for alpha in accessor.pop("alphas") for number in (255, 255, 255, alpha)]
        accessor.update(VEC4=white, componentType=5121, normalized=True)
    kind = next(name for name in SIZES if name in accessor)
    width, factor, numbers = SIZES[kind], accessor.pop("times", 1), accessor.pop(kind)
    code = FORMATS[accessor.setdefault("componentType", 5126)]
    rows = [[number * factor if code == "f" else int(number * factor) for number in numbers[i:i + width]]
            for i in range(0, len(numbers), width)]
    accessor.update(bufferView=len(root["bufferViews"]), count=len(rows), type=kind)
    view = {"buffer": 0, "byteOffset": len(body)}
    packed = [struct.pack(f"<{width}{code}", *row) for row in rows]
    if kind == "SCALAR":
        body += b"".join(packed)
    else:
        view["byteStride"] = (len(packed[0]) + 3) // 4 * 4
        body += b"".join(one.ljust(view["byteStride"], b"\0") for one in packed)
    view["byteLength"] = len(body) - view["byteOffset"]
    body += bytes(-len(body) % 4)
    if kind == "VEC3" and code == "f":
        accessor.update(min=[min(column) for column in zip(*rows)], max=[max(column) for column in zip(*rows)])
    root["bufferViews"].append(view)
    root["accessors"].append(accessor)
    return len(root["accessors"]) - 1


def write(path, buffer=None):
    root, body, known = json.load(sys.stdin), bytearray(), {}
    root = {"asset": {"version": "2.0"}, "scenes": [{"nodes": list(range(len(root["nodes"])))}], "bufferViews": [], "accessors": [], **root}

    def number_of(accessor):
        key = json.dumps(accessor)
        if key not in known:
            known[key] = add_accessor(root, body, accessor)
        return known[key]

    for primitive in (one for mesh in root["meshes"] for one in mesh["primitives"]):
        attributes = primitive.setdefault("attributes", {})
        if "plate" in primitive:
            x, y, z, far_x, far_z = primitive.pop("plate")
            attributes.setdefault("TEXCOORD_0", {"VEC2": [0, 1, 1, 1, 1, 0, 0, 0]})
            attributes["POSITION"] = {"VEC3": [x, y, far_z, far_x, y, far_z, far_x, y, z, x, y, z]}
        primitive["indices"] = number_of({"SCALAR": [0, 1, 2, 0, 2, 3], "componentType": 5123})
        attributes.update({name: number_of(accessor) for name, accessor in attributes.items()})
    uri = buffer or "data:;base64," + base64.b64encode(body).decode()
    root["buffers"] = [{"byteLength": len(body), "uri": uri}]
    if buffer:
        with open(buffer, "wb") as out:
            out.write(body)
    with open(path, "w", encoding="utf-8") as out:
        json.dump(root, out)


def show(path, *expressions):
    with open(path, "rb") as file:
        data = file.read()
    text = data[20:20 + struct.unpack_from("<I", data, 12)[0]] if data[:4] == b"glTF" else data
    root = json.loads(text)
    names = {"root": root, "text": json.dumps(root, separators=(",", ":")), "size": len(data), "re": re}
    values = [eval(expression, names) for expression in expressions]
    print(*(one for value in values for one in (value if isinstance(value, list) else [value])))


{"write": write, "show": show}[sys.argv[1]](*sys.argv[2:])
