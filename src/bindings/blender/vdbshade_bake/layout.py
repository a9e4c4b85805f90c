"""Lightmap UVs by `vdbshade unwrap`: finds the objects that need them, and writes them into the meshes."""
import os

import bmesh
import bpy
import numpy

from . import scene
from .scene import BakeError

UV_NAME = "Lightmap"  # of new UV maps


def lightmap_uv(obj):
    """The UV map of an object's lightmap: the one named UV_NAME, or the second; else None."""
    layers = obj.data.uv_layers
    if UV_NAME in layers:
        return UV_NAME
    return layers[1].name if len(layers) > 1 else None


def needs_layout(receivers, how):
    """Whether UVs must be made: an object has none for a lightmap, or shares them with another."""
    if how == "NEVER":
        return False
    data = [obj.data.name for obj in receivers]
    return how == "ALWAYS" or len(set(data)) < len(data) or \
        any(lightmap_uv(obj) is None for obj in receivers)


class Layout:
    """All receivers in one square. Usable UVs are kept as charts, and packed with the new ones."""

    def __init__(self, context, receivers, how):
        if context.mode != "OBJECT":
            raise BakeError("leave edit mode first")
        self.receivers = receivers
        self.keep = how != "ALWAYS"
        self.undo = []
        self.warnings = []
        for obj in receivers:
            if obj.data.library is not None or obj.library is not None:
                raise BakeError("'%s': comes from another file, and so cannot have UVs made; make it local" % obj.name)

    def part(self):
        """Copies meshes that several objects share: each object needs its own place in the lightmap."""
        seen, parted = set(), []
        for obj in self.receivers:
            if obj.data.name in seen:
                before = obj.data
                obj.data = before.copy()
                self.undo.append(lambda obj=obj, before=before, made=obj.data: unpart(obj, before, made))
                parted.append(obj.name)
            seen.add(obj.data.name)
        return parted

    def command(self, program, folder, settings, depsgraph):
        """Writes the receivers; returns the program's command line."""
        names = {obj.name: lightmap_uv(obj) if self.keep else None for obj in self.receivers}
        there = scene.write_glb(os.path.join(folder, "layout.glb"), self.receivers, depsgraph, names, own_corners=True)
        self.laid = [obj for obj in self.receivers if obj.name in there]
        command = [program, "unwrap", "layout.glb", "-o", "layout.obj", "--progress", "--size", str(settings.size),
                   "--padding", str(settings.padding)]
        return command + ["--keep"] if self.keep else command

    def read(self, folder):
        """Writes the new UVs into the meshes."""
        laid = read_obj(os.path.join(folder, "layout.obj"))
        if len(laid) != len(self.laid):
            raise BakeError("%d objects were laid out, of %d" % (len(laid), len(self.laid)))
        for obj, (count, corners, uvs) in zip(self.laid, laid):
            if count != len(obj.data.loops):
                raise BakeError("'%s': was laid out with %d corners, and has %d" % (obj.name, count, len(obj.data.loops)))
            of_corner = numpy.zeros((count, 2), numpy.float32)
            corners, uvs = numpy.array(corners), numpy.array(uvs, numpy.float32)
            of_corner[corners] = uvs
            cut = numpy.unique(corners[(of_corner[corners] != uvs).any(axis=1)])
            self.set_uvs(obj, of_corner)
            if len(cut) > 0:  # a corner of Blender's faces has only one UV
                self.split(obj, cut, corners.reshape(-1, 3), uvs.reshape(-1, 3, 2))

    def split(self, obj, cut, triangles, uvs):
        """Splits the faces of the corners `cut` into the triangles of the layout, each with its own UVs."""
        backup, made = bmesh.new(), bmesh.new()
        backup.from_mesh(obj.data)
        made.from_mesh(obj.data)
        made.faces.ensure_lookup_table()
        made.verts.ensure_lookup_table()
        layer = made.loops.layers.uv[UV_NAME]
        face_of = {loop: face.index for face in obj.data.polygons for loop in face.loop_indices}
        pieces = {face: [made.faces[face]] for face in {face_of[corner] for corner in cut}}
        for corners, places in zip(triangles, uvs):
            own = pieces.get(face_of[corners[0]])
            if own is None:
                continue
            place = {obj.data.loops[corner].vertex_index: uv for corner, uv in zip(corners, places)}
            own.extend(split_off(own, [made.verts[vertex] for vertex in place]))
            for face in own:
                if {loop.vert.index for loop in face.loops} == set(place):
                    for loop in face.loops:
                        loop[layer].uv = place[loop.vert.index]
        made.to_mesh(obj.data)
        made.free()
        self.undo.append(lambda: backup.to_mesh(obj.data))
        self.warnings.append("'%s': %d bent faces are triangles now, as the lightmap parts them" % (obj.name, len(pieces)))

    def set_uvs(self, obj, uvs):
        layers = obj.data.uv_layers
        active, layer = layers.active_index, layers.get(UV_NAME)
        if layer is None:
            layer = layers.new(name=UV_NAME, do_init=False)
            if layer is None:
                raise BakeError("'%s': has as many UV maps as there can be" % obj.name)
            if len(layers) > 1:
                layers.active_index = active
            self.undo.append(lambda obj=obj: obj.data.uv_layers.remove(obj.data.uv_layers[UV_NAME]))
        else:
            before = scene.values_of(layer.data, "uv", 2)
            self.undo.append(lambda obj=obj: obj.data.uv_layers[UV_NAME].data.foreach_set("uv", before))
        layer.data.foreach_set("uv", uvs.ravel())
        obj.data.update()

    def revert(self):
        """Restores everything."""
        for step in reversed(self.undo):
            step()
        self.undo = []


def unpart(obj, before, made):
    obj.data = before
    bpy.data.meshes.remove(made)


def split_off(faces, corners):
    """Cuts the triangle of three vertices out of the face that has them all; returns the faces that this makes."""
    made = []
    for i in range(3):
        a, b = corners[i], corners[i - 1]
        face = next(face for face in faces + made if {*corners} <= {*face.verts})
        if not any({a, b} == {*edge.verts} for edge in face.edges):
            made.append(bmesh.utils.face_split(face, a, b)[0])
    return made


def read_obj(path):
    """Reads [number of positions, positions of corners, UVs of corners] of each object of an OBJ."""
    objects, uvs, positions, first = [], [], 0, 0
    with open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            kind, _, rest = line.partition(" ")
            if kind == "o":
                objects.append([0, [], []])
                first = positions
            elif kind == "v":
                positions += 1
                objects[-1][0] += 1
            elif kind == "vt":
                uvs.append(tuple(map(float, rest.split())))
            elif kind == "f":
                for corner in rest.split():
                    position, uv = corner.split("/")[:2]
                    objects[-1][1].append(int(position) - 1 - first)
                    objects[-1][2].append(uvs[int(uv) - 1])
    return objects
