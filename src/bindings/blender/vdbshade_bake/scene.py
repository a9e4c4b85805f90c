"""Writes the scene for the program: a scene file, and a GLB of the casters in the world, with Blender's axes."""
import json
import math
import re
import struct

import mathutils
import numpy


class BakeError(Exception):
    """An error for the user, in one line."""


def values_of(items, name, width=1, kind=None):
    """Values of all items of a collection, such as "co" of a mesh's vertices, in one array of float32 or `kind`."""
    values = numpy.empty(width * len(items), kind or numpy.float32)
    items.foreach_get(name, values)
    return values


def is_caster(obj):
    return obj.type == "MESH" and not obj.hide_render and len(obj.data.polygons) > 0


def keeps_corners(obj, mesh):
    """Whether modifiers kept an object's faces, so that corners still match. Vertices may have moved."""
    ours, theirs = (values_of(which.loops, "vertex_index", 1, numpy.int32) for which in (obj.data, mesh))
    return len(obj.data.polygons) == len(mesh.polygons) and numpy.array_equal(ours, theirs)


def arrays_of(obj, mesh, uv_name):
    """Positions, normals (world), UVs or None, and indices of a mesh where its object stands. Each corner is a vertex."""
    mesh.calc_loop_triangles()
    if hasattr(mesh, "calc_normals_split"):  # until Blender 4.1
        mesh.calc_normals_split()
    points = values_of(mesh.vertices, "co", 3)
    vertices = values_of(mesh.loops, "vertex_index", 1, numpy.int32)
    normals = values_of(mesh.loops, "normal", 3)
    indices = values_of(mesh.loop_triangles, "loops", 3, numpy.int32)
    uvs = None
    if uv_name is not None:
        if uv_name not in mesh.uv_layers:
            raise BakeError("'%s': its modifiers leave nothing of the UV map '%s'" % (obj.name, uv_name))
        uvs = values_of(mesh.uv_layers[uv_name].data, "uv", 2)
    if len(indices) == 0:
        return None
    matrix = numpy.array(obj.matrix_world, numpy.float64)
    determinant = numpy.linalg.det(matrix[:3, :3])
    if determinant == 0.0:
        return None  # flattened: it has no normals, and casts nothing that could be seen
    points = points.reshape(-1, 3)[vertices] @ matrix[:3, :3].T + matrix[:3, 3]
    normals = normals.reshape(-1, 3) @ numpy.linalg.inv(matrix[:3, :3])
    length = numpy.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / numpy.where(length > 0.0, length, 1.0)
    if determinant < 0.0:  # mirrored: corners the other way round
        indices = indices.reshape(-1, 3)[:, ::-1]
    return (points.astype("<f4"), normals.astype("<f4"), None if uvs is None else uvs.reshape(-1, 2),
            indices.astype("<u4").ravel())


def mesh_arrays(obj, depsgraph, uv_name, own_corners):
    """The arrays of an object as it is rendered. With `own_corners`, modifiers that change its faces do not apply, so that
    each vertex of the arrays is a corner of its mesh."""
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if not own_corners or keeps_corners(obj, mesh):
            return arrays_of(obj, mesh, uv_name)
    finally:
        evaluated.to_mesh_clear()
    return arrays_of(obj, obj.data, uv_name)


class Glb:
    """A GLB that grows: axes as they are in Blender."""

    def __init__(self):
        self.chunks, self.accessors, self.views, self.meshes, self.nodes = [], [], [], [], []
        self.size = 0

    def add(self, array, kind, component, count, **more):
        self.views.append({"buffer": 0, "byteOffset": self.size, "byteLength": array.nbytes})
        self.chunks.append(array.tobytes())
        self.size += array.nbytes
        self.accessors.append(dict({"bufferView": len(self.views) - 1, "componentType": component, "count": count,
                                    "type": kind}, **more))
        return len(self.accessors) - 1

    def add_mesh(self, name, points, indices, **attributes):
        if not numpy.isfinite(points).all():
            raise BakeError("'%s': has vertices that are not finite" % name)
        attributes["POSITION"] = self.add(points, "VEC3", 5126, len(points), min=points.min(axis=0).tolist(),
                                          max=points.max(axis=0).tolist())
        self.meshes.append({"name": name, "primitives": [
            {"attributes": attributes, "indices": self.add(indices, "SCALAR", 5125, len(indices))}]})
        return len(self.meshes) - 1

    def add_object(self, obj, arrays):
        points, normals, uvs, indices = arrays
        attributes = {"NORMAL": self.add(normals, "VEC3", 5126, len(points))}
        if uvs is not None:
            flipped = numpy.stack((uvs[:, 0], 1.0 - uvs[:, 1]), axis=1).astype("<f4")  # v down
            attributes["TEXCOORD_0"] = self.add(flipped, "VEC2", 5126, len(points))
        self.nodes.append({"name": obj.name, "mesh": self.add_mesh(obj.name, points, indices, **attributes)})

    def add_instance(self, mesh, matrix, known):
        """Adds an instance of a mesh as a caster. `known` has the numbers of the meshes that were added before."""
        key = mesh.as_pointer()
        if key not in known:
            mesh.calc_loop_triangles()
            points = values_of(mesh.vertices, "co", 3)
            indices = values_of(mesh.loop_triangles, "vertices", 3, numpy.int32)
            known[key] = None if len(indices) == 0 else self.add_mesh(
                "instanced " + mesh.name, points.reshape(-1, 3).astype("<f4"), indices.astype("<u4"))
        if known[key] is not None and matrix.determinant() != 0.0:
            columns = [x for column in matrix.transposed() for x in column]
            self.nodes.append({"name": "instance %d of %s" % (len(self.nodes), mesh.name), "mesh": known[key],
                               "matrix": columns})

    def write(self, path):
        if not self.nodes:
            raise BakeError("no object has a face")
        body = b"".join(self.chunks)
        text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(self.nodes)))}],
                           "nodes": self.nodes, "meshes": self.meshes, "accessors": self.accessors,
                           "bufferViews": self.views, "buffers": [{"byteLength": len(body)}]}).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as out:
            out.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(body), len(text), 0x4E4F534A))
            out.write(text + struct.pack("<II", len(body), 0x004E4942) + body)


def write_glb(path, objects, depsgraph, uv_names, own_corners=False, instances=False):
    """Writes objects as a GLB; with `instances` also the copies that collections, particles and geometry nodes show.
    Returns the names of the objects that have triangles."""
    glb, there = Glb(), []
    for obj in objects:
        arrays = mesh_arrays(obj, depsgraph, uv_names.get(obj.name), own_corners)
        if arrays is not None:
            glb.add_object(obj, arrays)
            there.append(obj.name)
    known = {}
    for shown in depsgraph.object_instances if instances else ():
        if shown.is_instance and shown.object.type == "MESH" and not shown.object.hide_render and \
                not (shown.parent is not None and shown.parent.hide_render):
            glb.add_instance(shown.object.data, shown.matrix_world, known)
    glb.write(path)
    return there


def pattern_of(name):
    """A name as the pattern that matches it alone."""
    return re.sub(r"([*?\[\\])", r"\\\1", name)


def sun_of(settings, scene):
    """Direction towards the sun, and its angular diameter in degrees; None where there is none."""
    lamp = settings.sun
    if lamp is None:
        lamp = next((obj for obj in scene.objects if obj.type == "LIGHT" and obj.data.type == "SUN" and
                     not obj.hide_render), None)
    if lamp is None:
        return None
    towards = lamp.matrix_world.to_3x3() @ mathutils.Vector((0.0, 0.0, 1.0))
    return list(towards.normalized()), math.degrees(lamp.data.angle)


PACKS = {"SHADOW": "R=shadow.sun,G=shadow.sun,B=shadow.sun", "AO": "R=ao,G=ao,B=ao", "BOTH": "rgb", "LIGHT": "rgb"}


def scene_of(settings, scene, receivers, output):
    """The scene file's content."""
    made = {"casters": [{"mesh": "scene.glb"}], "receivers": [
        {"mesh": "scene.glb", "objects": [pattern_of(name) for name in receivers], "uv_set": 0, "size": settings.size,
         "padding": settings.padding, "output": output, "pack": PACKS[settings.what]}]}
    if settings.what != "AO":
        sun = sun_of(settings, scene)
        if sun is None:
            raise BakeError("the scene has no sun: add one, or bake ambient occlusion alone")
        made["lights"] = [{"name": "sun", "type": "directional", "direction": sun[0], "angle_deg": max(sun[1], 0.0)}]
    if settings.what != "SHADOW":
        made["ao"] = {"distance": settings.ao_distance}
    if settings.what == "LIGHT":
        made["irradiance"] = True
        made["ambient"] = [settings.ambient] * 3
    return made
