"""Bakes a glTF asset's shadow and ambient occlusion with Cycles on the processor, for bench/cycles.py.

Run by Blender:
    blender -b --factory-startup -P bench/cycles_bake.py -- ASSET OUT SIZE SAMPLES THREADS X,Y,Z DEGREES DISTANCE
X, Y, Z: towards the sun, in the asset's axes; DEGREES: its diameter; DISTANCE: of AO. Writes OUT-shadow.exr and
OUT-ao.exr, 32-bit floats, row 0 at v = 1.

Cycles' shadow pass is the share of the samples of the light that nothing hides, over samples of the disc: the visible
fraction itself, without cosine or colour. Its AO pass is the cosine-weighted open share of the hemisphere."""
import math
import sys

import bpy
import numpy
from mathutils import Vector


def bake(scene, kind, image, path):
    scene.cycles.bake_type = kind
    bpy.ops.object.bake(type=kind, margin=4, use_clear=True)
    image.filepath_raw = path
    image.file_format = "OPEN_EXR"
    image.save()


def main():
    asset, out, size, samples, threads, direction, degrees, distance = sys.argv[sys.argv.index("--") + 1:]
    if not hasattr(numpy, "bool"):
        numpy.bool = bool  # Blender 3.4's importer asks for a name that NumPy has dropped
    x, y, z = (float(value) for value in direction.split(","))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=asset)
    scene = bpy.context.scene

    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = int(samples)
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.threads_mode = "FIXED"
    scene.render.threads = int(threads)

    # No light but the sun, or samples go to the world.
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = False
    scene.world.color = (0.0, 0.0, 0.0)
    scene.world.light_settings.distance = float(distance)
    sun = bpy.data.lights.new("sun", "SUN")
    sun.angle = math.radians(float(degrees))
    sun.energy = 1.0
    lamp = bpy.data.objects.new("sun", sun)
    scene.collection.objects.link(lamp)
    lamp.rotation_mode = "QUATERNION"
    # The importer turns y up into z up; a sun shines along its own -z.
    lamp.rotation_quaternion = Vector((x, -z, y)).to_track_quat("Z", "Y")

    image = bpy.data.images.new("lightmap", int(size), int(size), alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    material = bpy.data.materials.new("white")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node

    # One object, so that each bake goes over the lightmap once. Its lightmap is the second set of UVs.
    meshes = [o for o in scene.objects if o.type == "MESH"]
    bpy.ops.object.select_all(action="DESELECT")
    for o in meshes:
        o.select_set(True)
        if o.data.users > 1:
            o.data = o.data.copy()
        o.data.materials.clear()
        o.data.materials.append(material)
    bpy.context.view_layer.objects.active = meshes[0]
    if len(meshes) > 1:
        bpy.ops.object.join()
    layers = bpy.context.view_layer.objects.active.data.uv_layers
    lightmap = layers[min(1, len(layers) - 1)]
    layers.active = lightmap
    lightmap.active_render = True

    bake(scene, "SHADOW", image, out + "-shadow.exr")
    bake(scene, "AO", image, out + "-ao.exr")


main()
