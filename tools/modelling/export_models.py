"""Makes tests/models: one small scene in every format that is read, as Blender 3.4 writes it.

    blender -b --factory-startup --python tools/modelling/export_models.py -- FOLDER

The scene, in Blender's axes (z up): a box of two materials and two UV sets, moved; an L of one polygon, a
child of the box, turned and scaled; of "figure" a bar on two bones, the upper of which is bent to the right.
"""
import bmesh
import bpy
import math
import os
import re
import sys
from mathutils import Vector

FOLDER = sys.argv[sys.argv.index("--") + 1]


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def material(name, alpha):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = alpha
    made.blend_method = "BLEND" if alpha < 1 else "OPAQUE"
    return made


def add(name, points, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(made)
    return made


def set_uvs(mesh, name, of):
    layer = mesh.uv_layers.new(name=name)
    for polygon in mesh.polygons:
        for k, loop in enumerate(polygon.loop_indices):
            layer.data[loop].uv = of(polygon.index, k, mesh.vertices[mesh.loops[loop].vertex_index].co)


def scene():
    clear()
    box = add("box", [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)],
              [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    corner = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    set_uvs(box.data, "UVMap", lambda face, k, at: corner[k % 4])
    set_uvs(box.data, "Lightmap", lambda face, k, at: ((face % 3 + 0.05 + 0.9 * corner[k][0]) / 3,
                                                       (face // 3 + 0.05 + 0.9 * corner[k][1]) / 3))
    box.data.materials.append(material("wall", 1.0))
    box.data.materials.append(material("glass", 0.25))
    box.data.polygons[1].material_index = 1
    box.location = (1, 2, 3)
    ell = add("ell", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)], [(0, 1, 2, 3, 4, 5)])
    set_uvs(ell.data, "UVMap", lambda face, k, at: (at.x / 2, at.y / 2))
    set_uvs(ell.data, "Lightmap", lambda face, k, at: (0.05 + at.x / 8, 0.7 + at.y / 8))
    ell.data.materials.append(bpy.data.materials["wall"])
    ell.parent = box
    ell.location = (0.5, 0, 1.5)
    ell.rotation_euler = (math.radians(30), math.radians(20), math.radians(10))
    ell.scale = (1, 2, 0.5)
    bpy.context.view_layer.update()


def figure():
    clear()
    ring = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)]
    bar = add("bar", [(x, y, z) for z in (0, 1, 2) for x, y in ring],
              [(3, 2, 1, 0), (8, 9, 10, 11)] +
              [(4 * h + k, 4 * h + (k + 1) % 4, 4 * h + 4 + (k + 1) % 4, 4 * h + 4 + k)
               for h in (0, 1) for k in range(4)])
    set_uvs(bar.data, "UVMap", lambda face, k, at: ((face + (k % 3 > 0)) / 10, k // 2))
    bones = bpy.data.armatures.new("bones")
    rig = bpy.data.objects.new("rig", bones)
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    lower = bones.edit_bones.new("lower")
    lower.head, lower.tail = (0, 0, 0), (0, 0, 1)
    upper = bones.edit_bones.new("upper")
    upper.head, upper.tail, upper.parent = (0, 0, 1), (0, 0, 2), lower
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, chosen in (("lower", range(0, 8)), ("upper", range(8, 12))):
        group = bar.vertex_groups.new(name=name)
        group.add(list(chosen), 1.0, "REPLACE")
    bar.parent = rig
    bar.modifiers.new("rig", "ARMATURE").object = rig
    rig.location = (3, 0, 0)
    rig.rotation_euler = (0, 0, math.radians(90))
    bent = rig.pose.bones["upper"]
    bent.rotation_mode = "XYZ"
    bent.rotation_euler = (0, 0, math.radians(90))
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bar.evaluated_get(graph).to_mesh()
    print("TRUTH", name, [tuple(round(c, 4) for c in bar.matrix_world @ v.co) for v in mesh.vertices][8:])


def export(name, skinned):
    def path(ending):
        return os.path.join(FOLDER, name + "." + ending)

    bpy.ops.export_scene.gltf(filepath=path("glb"), export_format="GLB", export_current_frame=True)
    bpy.ops.export_scene.fbx(filepath=path("fbx"), bake_anim=False, add_leaf_bones=False)
    bpy.ops.wm.collada_export(filepath=path("dae"))
    if skinned:
        return
    bpy.ops.export_scene.gltf(filepath=path("gltf"), export_format="GLTF_SEPARATE")
    bpy.ops.wm.obj_export(filepath=path("obj"))
    bpy.ops.export_scene.x3d(filepath=path("x3d"))
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.export_mesh.stl(filepath=path("stl"))
    bpy.ops.export_mesh.stl(filepath=os.path.join(FOLDER, name + "_ascii.stl"), ascii=True)
    bpy.ops.export_mesh.ply(filepath=path("ply"))
    bpy.ops.export_mesh.ply(filepath=os.path.join(FOLDER, name + "_ascii.ply"), use_ascii=True)


os.makedirs(FOLDER, exist_ok=True)
scene()
export("scene", False)
figure()
export("figure", True)
