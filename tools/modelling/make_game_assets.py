#!/usr/bin/env python3
"""Makes the sixteen game assets that `tools/bench assets` bakes, each as GLB, OBJ and FBX with lightmap UVs in its
second set. NAME.solids.obj says what a person would call solid. NAME_smooth.glb is NAME.glb, smooth-shaded up to
60° between faces; it is missing where that changes nothing.

  blender -b --python tools/modelling/make_game_assets.py -- FOLDER [NAME…]

Needs Blender 3.4. The same files each time. Metres; z is up in here, y in the files.
"""
import filecmp
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from game_assets import ASSETS  # noqa: E402

MARGIN = 0.004  # of the unit square: 4 texels of 1024
SMOOTH_BELOW = 0.7  # radians between faces of a smooth object
SMOOTHER_BELOW = 1.05  # of all objects of NAME_smooth.glb


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def mesh_of(name, part):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(part.vertices, [], part.faces)
    if mesh.validate():
        raise SystemExit("%s: Blender mended the mesh" % name)
    if part.smooth:
        shade_smooth(mesh, SMOOTH_BELOW)
    return mesh


def shade_smooth(mesh, below):
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.use_auto_smooth = True
    mesh.auto_smooth_angle = below


def tiling_uvs(mesh):
    """The first set of UVs, for a texture that repeats each metre: it overlaps itself and leaves the square."""
    layer = mesh.uv_layers.new(name="UVMap")
    for polygon in mesh.polygons:
        drop = max(range(3), key=lambda k: abs(polygon.normal[k]))
        for loop in polygon.loop_indices:
            at = mesh.vertices[mesh.loops[loop].vertex_index].co
            layer.data[loop].uv = [at[k] for k in range(3) if k != drop]


def lightmap_uvs(objects):
    for o in objects:
        layer = o.data.uv_layers.new(name="Lightmap")
        o.data.uv_layers.active = layer
        layer.active_render = True
        o.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=1.15, island_margin=0.0, area_weight=0.0)
    bpy.ops.uv.average_islands_scale()
    bpy.ops.uv.pack_islands(rotate=True, margin_method="FRACTION", margin=MARGIN)
    bpy.ops.object.mode_set(mode="OBJECT")


def to_file(p):
    """Blender's exporters: y up, looking along -z."""
    return (p[0], p[2], -p[1])


def write_solids(path, parts):
    with open(path, "w", encoding="ascii") as f:
        base = 1
        for name, part in parts:
            f.write("o %s:%s\n" % (part.kind, name))
            flip = (part.scale[0] * part.scale[1] * part.scale[2] < 0)
            for v in part.vertices:
                f.write("v %.9g %.9g %.9g\n" % to_file(part.place(v)))
            for face in part.true_faces:
                corners = face[::-1] if flip else face
                f.write("f " + " ".join(str(base + i) for i in corners) + "\n")
            base += len(part.vertices)


def export_glb(stem):
    bpy.ops.export_scene.gltf(filepath=stem + ".glb", export_format="GLB", export_materials="NONE")


def export(stem):
    export_glb(stem)
    bpy.ops.wm.obj_export(filepath=stem + ".obj", export_materials=False)
    bpy.ops.export_scene.fbx(filepath=stem + ".fbx")


def make(folder, name, build):
    clear()
    parts = build()
    objects = []
    for part_name, part in parts:
        mesh = mesh_of(part_name, part)
        o = bpy.data.objects.new(part_name, mesh)
        o.location, o.scale = part.at, part.scale
        bpy.context.collection.objects.link(o)
        tiling_uvs(mesh)
        objects.append(o)
    lightmap_uvs(objects)
    write_solids(os.path.join(folder, name + ".solids.obj"), parts)
    stem = os.path.join(folder, name)
    export(stem)
    for o in objects:
        shade_smooth(o.data, SMOOTHER_BELOW)
    export_glb(stem + "_smooth")
    if filecmp.cmp(stem + ".glb", stem + "_smooth.glb", shallow=False):
        os.remove(stem + "_smooth.glb")
    triangles = sum(len(p.vertices) - 2 for o in objects for p in o.data.polygons)
    print("asset %s: %d objects, %d triangles" % (name, len(objects), triangles))


def main():
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if not words:
        raise SystemExit("usage: blender -b --python tools/modelling/make_game_assets.py -- FOLDER [NAME…]")
    os.makedirs(words[0], exist_ok=True)
    for name in words[1:] or sorted(ASSETS):
        make(words[0], name, ASSETS[name])


main()
