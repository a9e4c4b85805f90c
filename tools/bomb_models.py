"""Models, level sets, tables and scenes of tools/memory-bombs: small files that ask for much."""
import base64
import json
import struct
import zlib

from bomb_images import zeros

TRIANGLE = base64.b64encode(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)).decode()
FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"


def gltf(nodes=None, meshes=None, accessors=None, length=36, views=None, scene=None, **more):
    """A triangle, unless told otherwise."""
    made = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": scene or [0]}], "nodes": nodes or [{"mesh": 0}],
            "meshes": meshes or [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": accessors or [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": views or [{"buffer": 0, "byteLength": length}],
            "buffers": [{"byteLength": length, "uri": "data:application/octet-stream;base64," + TRIANGLE}], **more}
    return json.dumps(made).encode()


def grid_obj(n, extra=""):
    """n² vertices as a sheet."""
    lines = [f"v {x} 0 {y}" for y in range(n) for x in range(n)]
    lines += [f"f {y * n + x + 1} {y * n + x + 2} {(y + 1) * n + x + 2} {(y + 1) * n + x + 1}" for y in range(n - 1) for x in range(n - 1)]
    return ("\n".join(lines) + "\n" + extra).encode()


def far_cubes(n, apart):
    """Cubes far from each other: each has nodes of its own in a level set's tree."""
    lines, faces = [], []
    for i in range(n):
        at = (i % 20 * apart, i // 20 % 20 * apart, i // 400 * apart)
        lines += [f"v {at[0] + x} {at[1] + y} {at[2] + z}" for z in (0, 4) for y in (0, 4) for x in (0, 4)]
        faces += ["f " + " ".join(str(8 * i + k) for k in face) for face in
                  ((1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6))]
    return "\n".join(lines + faces).encode()


def ply(vertices, faces, body, properties="xyz", form="binary_little_endian", index="list uchar int vertex_indices"):
    names = "".join(f"property float {name}\n" for name in properties)
    return (f"ply\nformat {form} 1.0\nelement vertex {vertices}\n{names}element face {faces}\nproperty {index}\nend_header\n").encode() + body


def fbx_record(name, properties, count, inner=b"", at=0):
    stop = at + 13 + len(name) + len(properties) + len(inner)
    return struct.pack("<IIIB", stop, count, len(properties), len(name)) + name + properties + inner


def fbx(numbers):
    """Vertices of so many numbers, all 0, packed."""
    head = b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400)
    packed = zeros(8 * numbers)
    array = b"d" + struct.pack("<III", numbers, 1, len(packed)) + packed
    name = b"L" + struct.pack("<q", 1) + b"S" + struct.pack("<I", 14) + b"a\0\1Geometry\0\0\0\0" + b"S" + struct.pack("<I", 4) + b"Mesh"
    objects, geometry = len(head), len(head) + 13 + 7
    inner = fbx_record(b"Vertices", array, 1, at=geometry + 13 + 8 + len(name))
    one = fbx_record(b"Geometry", name, 3, inner + bytes(13), at=geometry)
    return head + fbx_record(b"Objects", b"", 0, one + bytes(13), at=objects) + bytes(13 + 160)


def dae(geometry, nodes, head=""):
    return (f'<?xml version="1.0"?>{head}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><up_axis>Y_UP'
            f'</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">{geometry}'
            '</float_array><technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" '
            'type="float"/><param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" '
            'source="#p"/></vertices><triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh>'
            f'</geometry></library_geometries>{nodes}<scene><instance_visual_scene url="#s"/></scene></COLLADA>').encode()


def doubling(levels):
    """Each node has the next one twice."""
    return [{"children": [i + 1, i + 1]} for i in range(levels)] + [{"mesh": 0}]


def models():
    """Names and files."""
    yield "count.gltf", gltf(accessors=[{"bufferView": 0, "componentType": 5126, "count": 1000000000, "type": "VEC3"}])
    yield "no_view.gltf", gltf(accessors=[{"componentType": 5126, "count": 300000000, "type": "VEC3"}])
    yield "sparse.gltf", gltf(accessors=[{"componentType": 5126, "count": 300000000, "type": "VEC3", "sparse": {
        "count": 1, "indices": {"bufferView": 0, "componentType": 5125}, "values": {"bufferView": 0}}}])
    yield "length.gltf", gltf(length=4000000000)
    yield "doubling.gltf", gltf(nodes=doubling(40))
    yield "loop.gltf", gltf(nodes=[{"mesh": 0, "children": [0]}])
    yield "nodes.gltf", gltf(nodes=[{"mesh": 0}] * 400000, scene=list(range(400000)))
    yield "chain.gltf", gltf(nodes=[{"children": [i + 1]} for i in range(200000)] + [{"mesh": 0}])
    yield "meshes.gltf", gltf(meshes=[{"name": "m%d" % i, "primitives": [{"attributes": {"POSITION": 0}}]} for i in range(200000)])
    yield "primitives.gltf", gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * 200000}])
    triangles = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) * 20000
    shared = json.loads(gltf(nodes=[{"mesh": 0}] * 2000, scene=list(range(2000)), length=len(triangles),
                             accessors=[{"bufferView": 0, "componentType": 5126, "count": 60000, "type": "VEC3"}]))
    shared["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(triangles).decode()
    yield "instances.gltf", json.dumps(shared).encode()
    shared["nodes"], shared["scenes"][0]["nodes"] = [{"mesh": 0}], [0]
    shared["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}}] * 3000}]
    yield "views.gltf", json.dumps(shared).encode()
    yield "names.gltf", gltf(nodes=[{"mesh": 0, "name": "n" * 30000000}])
    yield "extras.gltf", gltf(extras=[{}] * 3000000)
    yield "nest.gltf", b'{"asset":{"version":"2.0"},"extras":' + b"[" * 5000000 + b"]" * 5000000 + b"}"
    head = b'{"asset":{"version":"2.0"},"buffers":[{"byteLength":4}]}' + b" " * 3
    yield "chunk.glb", b"glTF" + struct.pack("<III", 2, 0xffffffff, len(head)) + b"JSON" + head + struct.pack("<I", 0xfffffff0) + b"BIN\0"
    yield "json.glb", b"glTF" + struct.pack("<III", 2, 0xffffffff, 0xffffff00) + b"JSON" + head
    yield "polygon.obj", b"".join(b"v %d 0 %d\n" % (i, i * i % 977) for i in range(300000)) + b"f " + b" ".join(
        b"%d" % (i + 1) for i in range(300000)) + b"\n"
    yield "sheet.obj", grid_obj(700)
    yield "objects.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"".join(b"o a%d\nf 1 2 3\n" % i for i in range(300000))
    yield "materials.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"".join(b"usemtl a%d\nf 1 2 3\n" % i for i in range(300000))
    yield "index.obj", b"v 0 0 0\nf 1 2000000000 -2000000000\n"
    yield "line.obj", b"v " + b"1 " * 10000000
    yield "name.obj", b"o " + b"n" * 30000000 + b"\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    yield "faces.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * 2000000
    yield "corners.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 1 0\n" + b"f 1/1/1 2/1/1 3/1/1\n" * 700000
    yield "vertices.ply", ply(4000000000, 1, b"\0" * 100)
    yield "faces.ply", ply(3, 4000000000, bytes(36))
    yield "list.ply", ply(3, 1, bytes(36) + struct.pack("<I", 4000000000), index="list uint int vertex_indices")
    yield "long_list.ply", ply(3, 1, bytes(36) + struct.pack("<I", 3000000) + bytes(12000000), index="list uint int vertex_indices")
    yield "properties.ply", ply(1000, 0, bytes(1000 * 4 * 2003), ["x", "y", "z"] + ["p%d" % i for i in range(2000)])
    yield "text.ply", ply(1000000, 0, b"0 0 0\n" * 1000000, form="ascii")
    yield "elements.ply", b"ply\nformat ascii 1.0\n" + b"".join(b"element e%d 4000000000\n" % i for i in range(100000)) + b"end_header\n"
    yield "count.stl", bytes(80) + struct.pack("<I", 0xffffffff) + bytes(50)
    yield "facets.stl", bytes(80) + struct.pack("<I", 400000) + struct.pack("<12fH", *range(12), 0) * 400000
    yield "text.stl", b"solid a\n" + (b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
                                     * 150000) + b"endsolid a\n"
    yield "array.fbx", fbx(120000000)
    yield "small_array.fbx", fbx(15000000)
    yield "deep.fbx", b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400) + b"".join(
        struct.pack("<IIIB", 0x7fffffff, 0, 0, 1) + b"a" for _ in range(300000))
    yield "numbers.dae", dae("0 " * 8000000, "")
    yield "laughs.dae", dae("&l9;", "", "<!DOCTYPE COLLADA [<!ENTITY l0 '1 1 1 1 1 1 1 1 1 1 '>" + "".join(
        f"<!ENTITY l{i + 1} '{f'&l{i};' * 10}'>" for i in range(9)) + "]>")
    library = "".join(f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>' for i in range(30))
    yield "doubling.dae", dae("0 0 0 1 0 0 0 1 0", f'<library_nodes>{library}<node id="n30"><instance_geometry url="#g"/></node></library_nodes>'
                              '<library_visual_scenes><visual_scene id="s"><node><instance_node url="#n0"/></node></visual_scene>'
                              '</library_visual_scenes>')
    yield "nest.dae", b'<?xml version="1.0"?><COLLADA>' + b"<a>" * 3000000
    yield "instances.dae", dae("0 0 0 1 0 0 0 1 0", '<library_visual_scenes><visual_scene id="s">' + '<node><instance_geometry url="#g"/></node>'
                               * 200000 + '</visual_scene></library_visual_scenes>')


def lit(casters, receivers=(), **more):
    return json.dumps({"casters": casters, "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2], "angle_deg": 5}],
                       "receivers": list(receivers), **more}).encode()


def floor(**more):
    return {"mesh": "floor.obj", "size": 64, "output": "out.exr", **more}


BALL = {"sdf": {"shape": "sphere", "radius": 1}}


def scenes():
    """Names, files, commands; IN is the file."""
    bake = ["bake", "IN", "-o", "out.exr"]
    voxelize = ["voxelize", "IN", "-o", "out.vdb"]
    query = ["query", "IN", "--points", "points.csv", "-o", "out.csv"]
    yield "braces.json", b'{"casters": [' + b"{}," * 1000000 + b"{}]}", ["info", "IN"]
    yield "braces64.json", b'{"casters": [' + b"{}," * 20000000 + b"{}]}", ["info", "IN"]
    yield "brackets.json", b'{"casters": ' + b"[" * 3000000, ["info", "IN"]
    yield "string.json", b'{"casters": "' + b"x" * 60000000 + b'"}', ["info", "IN"]
    yield "keys.json", b"{" + b",".join(b'"k%d":0' % i for i in range(1000000)) + b"}", ["info", "IN"]
    yield "numbers.json", b'{"casters": [' + b"1," * 20000000 + b"1]}", bake
    yield "casters.json", lit([BALL] * 65536, [floor()], resolution=16), bake
    yield "nodes.json", lit([{"sdf": {"op": "union", "of": [BALL["sdf"]] * 60000}}], [floor()], resolution=16), voxelize
    yield "receivers.json", lit([BALL], [floor(size=65536, output=f"{i}.exr") for i in range(2000)], resolution=16), ["bake", "IN", "--output-folder", "made"]
    yield "spheres.json", lit([{"spheres": [[i % 1000, i // 1000, 0, 0.4] for i in range(1000000)]}], [floor()]), bake
    yield "lights.json", json.dumps({"casters": [BALL], "resolution": 16, "receivers": [floor(size=4096)], "lights": [
        {"name": f"l{i}", "type": "directional", "direction": [0.3, 1, 0.2]} for i in range(250)]}).encode(), bake
    yield "resolution.json", lit([BALL], [floor()], resolution=65536), voxelize
    yield "resolution2.json", lit([BALL], [floor()], resolution=3000), bake
    yield "voxels.json", lit([BALL], [floor()], voxel_size=1e-6), query
    yield "width.json", lit([BALL], [floor()], resolution=500, half_width=100), voxelize
    yield "size.json", lit([BALL], [floor(size=65536)], resolution=16), bake
    yield "samples.json", lit([BALL], [floor(size=16384, supersample=4)], resolution=16), bake
    yield "padding.json", lit([BALL], [floor(size=8192, padding=4096)], resolution=16), bake
    yield "layers.json", lit([dict(BALL, layer=f"l{i}") for i in range(100)], [floor()], resolution=256, layers=[
        {"name": f"l{i}"} for i in range(100)]), bake
    yield "text.json", lit([{"text": "@" * 1000000, "font": FONT, "height": 1, "thickness": 0.5}], [floor()], resolution=64), bake
    yield "lines.json", lit([{"text": "&\n" * 200000, "font": FONT, "height": 1, "thickness": 0.5}], [floor()], resolution=64), voxelize
    yield "far.json", lit([{"sdf": dict(BALL["sdf"], translate=[i * 1e4, 0, 0])} for i in range(3000)], [floor()], voxel_size=0.1), voxelize
    yield "checks.json", lit([{"mask": "checks.png", "size": 4, "thickness": 0.5}], [floor()], resolution=64), bake
    yield "few_checks.json", lit([{"mask": "few_checks.png", "size": 4, "thickness": 0.5}], [floor()], resolution=64), bake
    yield "heights.json", lit([{"heightfield": "checks.png", "size": [4, 4], "height": 1}], [floor()], resolution=64), bake
    yield "direct.json", lit([{"heightfield": "checks.png", "size": [4, 4], "height": 1, "direct": True}], [floor()]), bake
    yield "receiver.json", lit([BALL], [{"heightfield": "checks.png", "extent": [4, 4], "height": 1, "size": 64, "output": "out.exr"}],
                               resolution=16), bake
    yield "box.json", lit([BALL], resolution=16), ["volume", "IN", "--box=-4,-4,-4,4,4,4", "--box-voxel-size", "0.01", "-o", "out.vdb"]
    yield "band.json", lit([BALL], resolution=600), ["volume", "IN", "--band", "50", "-o", "out.vdb"]
    yield "picture.json", lit([BALL], resolution=16), ["render", "IN", "--size", "16384x16384", "-o", "out.png"]
    plane = {"region": [-2, -2, 2, 2], "lights": [{"name": "l", "type": "disc", "position": [1, 1.5], "radius": 0.1}]}
    flat = ["flat", "IN", "-o", "out.exr"]
    yield "plane.json", json.dumps(dict(plane, size=65536)).encode(), flat
    yield "plane_samples.json", json.dumps(dict(plane, size=8192, supersample=16)).encode(), flat
    yield "polygon.json", json.dumps(dict(plane, size=8, casters=[{"shape": "polygon", "points": [[i % 997, i % 991] for i in range(1000000)]}])
                                     ).encode(), flat
    yield "circles.json", json.dumps(dict(plane, size=8, casters=[{"shape": "circle", "radius": 1}] * 60000)).encode(), flat
    yield "plane_checks.json", json.dumps(dict(plane, size=8, casters=[{"mask": "checks.png", "size": 2}])).encode(), flat
    yield "plane_text.json", json.dumps(dict(plane, size=8, casters=[{"text": "@" * 300000, "font": FONT, "height": 1}])).encode(), flat
    yield "regress/regress.json", json.dumps({"cases": [{"scene": "a.json", "output": f"{i}.exr"} for i in range(300000)]}).encode(), ["regress", "regress"]
    yield "limits.json", b'{"channels": {' + b",".join(b'"c%d": {"rmse": 1}' % i for i in range(300000)) + b"}}", [
        "compare", "small.exr", "small.exr", "--tolerances", "IN"]


def tables():
    ball = ["query", "ball.json", "-o", "out.csv", "--points", "IN"]
    yield "rows.csv", b"0,5,0,0,1,0\n" * 1000000, ball
    yield "line.csv", b"0," * 30000000, ball
    yield "header.csv", b"x,y,z," + b",".join(b"c%d" % i for i in range(2000000)) + b"\n" + b"0,0,0\n", ball
    yield "words.csv", b"x,y,z,w\n0,0,0," + b"w" * 60000000 + b"\n", ball
    yield "points.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n" \
        b"end_header\n" + bytes(12000), ball
    yield "wide.ply", b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" + b"".join(
        b"property float p%d\n" % i for i in range(300000)) + b"end_header\n" + b"0 0 0\n", ball
    yield "lists.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n" \
        b"property list uint float q\nend_header\n" + bytes(12) + struct.pack("<I", 4000000000), ball
    yield "points.raw", bytes(40000000), ball
    spheres = ["bake", "IN.json", "-o", "out.exr"]
    yield "many.csv", b"".join(b"%d,%d,0,0.4\n" % (i % 1000, i // 1000) for i in range(1000000)), spheres
    yield "blank.csv", b"\n" * 50000000 + b"0,0,0,1\n", spheres
    yield "long.csv", b"1 " * 25000000, spheres
