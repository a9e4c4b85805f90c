"""The add-on in Blender, without a window: the scene goes out, the image comes back into the materials.

blender -b --factory-startup --python tests/blender/test_bake.py -- ADDON VDBSHADE FOLDER"""
import importlib.util
import math
import os
import subprocess
import sys
import traceback

import bpy
import numpy

ADDON, PROGRAM, FOLDER = sys.argv[sys.argv.index("--") + 1:]


def load_addon():
    """Loads the add-on as Blender does: a module, its preferences, its classes."""
    name = "vdbshade_bake"
    spec = importlib.util.spec_from_file_location(name, os.path.join(ADDON, "__init__.py"), submodule_search_locations=[ADDON])
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    bpy.context.preferences.addons.new().module = name
    module.register()
    bpy.context.preferences.addons[name].preferences.program = PROGRAM
    return module


def quad(name, corners, uv_maps):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [range(len(corners))])
    for uv_name, uvs in uv_maps:
        layer = mesh.uv_layers.new(name=uv_name)
        for loop, uv in zip(layer.data, uvs):
            loop.uv = uv
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
FLOOR = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def start(sun=(0.0, math.radians(45.0), 0.0), lightmap=True):
    """A floor of 2 × 2 and a roof 1 over its half x > 0, under a sun that stands towards +x and up."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    load = bpy.context.preferences.addons.get("vdbshade_bake")
    if load is None:
        globals()["addon"] = load_addon()
    else:
        load.preferences.program = PROGRAM
    maps = [("UVMap", [(0, 0)] * 4)] + ([("Baked", SQUARE)] if lightmap else [])
    floor = quad("floor", FLOOR, maps)
    roof = quad("roof", [(0, -1, 1), (1, -1, 1), (1, 1, 1), (0, 1, 1)], [])
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.angle = math.radians(1.0)
    light = bpy.data.objects.new("sun", lamp)
    light.rotation_euler = sun
    bpy.context.collection.objects.link(light)
    bpy.context.view_layer.update()
    select(floor)
    settings = bpy.context.scene.vdbshade
    settings.size = 64
    settings.max_error = 0.05
    settings.what = "SHADOW"
    return floor, roof, settings


def select(*objects):
    for obj in bpy.context.scene.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def bake():
    result = bpy.ops.vdbshade.bake()
    assert result == {"FINISHED"}, result
    return bpy.data.images["vdbshade"]


def error_of(call):
    try:
        call()
    except RuntimeError as error:
        return str(error)
    raise AssertionError("nothing was refused")


def value(image, u, v):
    """R of the texel at (u, v), v up."""
    width, height = image.size
    return image.pixels[4 * (int(v * height) * width + int(u * width))]


def test_the_sun_shadows_what_the_roof_hides():
    # towards the sun is (1, 0, 1): the roof over 0 < x < 1 at height 1 hides -1 < x < 0
    start()
    image = bake()
    assert tuple(image.size) == (64, 64), tuple(image.size)
    assert value(image, 0.25, 0.5) < 0.02, value(image, 0.25, 0.5)
    assert value(image, 0.75, 0.5) > 0.98, value(image, 0.75, 0.5)
    assert image.colorspace_settings.name == "Non-Color"


def test_the_angle_of_the_sun_softens_the_shadow():
    widths = []
    for degrees in (1.0, 40.0):
        start(sun=(0.0, 0.0, 0.0))
        bpy.data.lights["sun"].angle = math.radians(degrees)
        image = bake()
        widths.append(sum(0.05 < value(image, (i + 0.5) / 64, 0.5) < 0.95 for i in range(64)))
    assert widths[0] <= 2 and widths[1] > 12, widths  # a penumbra of 2 tan(20 degrees) = 0.73 of 2


def test_ao_and_its_distance():
    _, _, settings = start()
    settings.what = "AO"
    settings.ao_distance = 4.0
    far = value(bake(), 0.75, 0.5)
    settings.ao_distance = 0.5
    near = value(bake(), 0.75, 0.5)
    assert far < 0.8 and near == 1.0, (far, near)


def test_light_is_the_sun_by_its_angle_and_ambient_by_ao():
    _, _, settings = start()
    settings.property_unset("what")  # what a user gets
    settings.ao_distance = 0.1
    image = bake()
    lit, dark = value(image, 0.9, 0.5), value(image, 0.25, 0.5)
    assert abs(lit - math.cos(math.radians(45.0)) - settings.ambient) < 0.02, lit
    assert settings.ambient > 0.1 and abs(dark - settings.ambient) < 0.02, dark
    assert image.colorspace_settings.name.startswith("Linear")
    settings.ao_distance = 10.0
    under = value(bake(), 0.75, 0.5)  # the roof hides some of the sky, and none of the sun
    assert lit - settings.ambient < under < lit - 0.02, under


def test_image_and_uv_map_stand_in_the_material():
    floor, _, settings = start()
    material = bpy.data.materials.new("stone")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.4, 0.2, 1.0)
    floor.data.materials.append(material)
    image = bake()
    tree = floor.material_slots[0].material.node_tree
    assert floor.material_slots[0].material == material, "a copy that nobody needs"
    assert tree.nodes["vdbshade image"].image == image
    assert tree.nodes["vdbshade UV"].uv_map == "Baked"
    assert tree.nodes["vdbshade image"].inputs["Vector"].links[0].from_node == tree.nodes["vdbshade UV"]
    mix = tree.nodes["Principled BSDF"].inputs["Base Color"].links[0].from_node
    assert mix.blend_type == "MULTIPLY" and mix.inputs["Color2"].links[0].from_node.image == image
    assert abs(mix.inputs["Color1"].default_value[1] - 0.4) < 1e-6
    count = len(tree.nodes)
    assert bake() == image and len(tree.nodes) == count and len(bpy.data.images) == 1, "a second bake adds something"


def test_a_material_that_others_have_is_copied():
    floor, roof, settings = start()
    material = bpy.data.materials.new("stone")
    for obj in (floor, roof):
        obj.data.materials.append(material)
    bake()
    assert floor.material_slots[0].material != material and roof.material_slots[0].material == material
    assert material.node_tree is None or "vdbshade image" not in material.node_tree.nodes


def test_without_links_the_image_node_stands_alone():
    floor, _, settings = start()
    settings.link = "NONE"
    bake()
    tree = floor.material_slots[0].material.node_tree
    assert not tree.nodes["vdbshade image"].outputs["Color"].links
    assert tree.nodes.active == tree.nodes["vdbshade image"]


def test_unlit_shows_the_image_as_emission():
    floor, _, settings = start()
    settings.link = "EMISSION"
    image = bake()
    shader = floor.material_slots[0].material.node_tree.nodes["Principled BSDF"]
    glow = shader.inputs.get("Emission Color") or shader.inputs["Emission"]
    assert glow.links[0].from_node.inputs["Color2"].links[0].from_node.image == image
    assert not shader.inputs["Base Color"].links


def test_objects_without_lightmap_uvs_get_a_map_that_does_not_overlap():
    floor, roof, settings = start(lightmap=False)
    roof.location.z = 3.0
    select(floor, roof)
    bake()
    squares = []
    for obj in (floor, roof):
        assert obj.data.uv_layers["Lightmap"] is not None
        uvs = [loop.uv for loop in obj.data.uv_layers["Lightmap"].data]
        squares.append([(min(uv[k] for uv in uvs), max(uv[k] for uv in uvs)) for k in range(2)])
        assert all(0.0 <= low < high <= 1.0 for low, high in squares[-1]), squares
    apart = any(squares[0][k][1] < squares[1][k][0] or squares[1][k][1] < squares[0][k][0] for k in range(2))
    assert apart, squares
    assert floor.data.uv_layers.active.name == "UVMap", "another UV map is the active one now"
    assert set(bpy.context.selected_objects) == {floor, roof}


def at(obj, image, x, y):
    """R of the image where a point of a quad of 2 × 2 around the origin has its UVs."""
    uvs = [loop.uv for loop in obj.data.uv_layers["Lightmap"].data]
    s, t = (x + 1.0) / 2.0, (y + 1.0) / 2.0
    u, v = ((1 - t) * ((1 - s) * uvs[0][k] + s * uvs[1][k]) + t * (s * uvs[2][k] + (1 - s) * uvs[3][k]) for k in range(2))
    return value(image, u, v)


def test_objects_that_share_a_mesh_have_a_place_each():
    floor, roof, _ = start(lightmap=False)
    other = bpy.data.objects.new("other", floor.data)
    other.location.x = 2.0  # beside it, under no roof: lit where x > 0
    bpy.context.collection.objects.link(other)
    bpy.context.view_layer.update()
    select(floor, other)
    image = bake()
    assert floor.data != other.data
    assert at(floor, image, -0.5, 0.0) < 0.02 and at(other, image, -0.5, 0.0) > 0.98


def test_uvs_that_serve_are_kept_as_charts():
    floor, roof, _ = start()
    own = [(0, 0), (1, 0), (1, 0.25), (0, 0.25)]
    for loop, uv in zip(floor.data.uv_layers["Baked"].data, own):
        loop.uv = uv
    roof.location.z = 3.0
    select(floor, roof)
    bake()
    # the roof had none, so the floor's own are packed with it, four times as long as high
    assert [tuple(loop.uv) for loop in floor.data.uv_layers["Baked"].data] == own
    uvs = [loop.uv for loop in floor.data.uv_layers["Lightmap"].data]
    assert 3.0 < (uvs[1] - uvs[0]).length / (uvs[2] - uvs[1]).length < 5.0, uvs


def test_what_collections_show_of_others_casts():
    floor, roof, _ = start()
    hidden = bpy.data.collections.new("shown elsewhere")
    bpy.context.collection.objects.unlink(roof)
    hidden.objects.link(roof)
    bpy.context.view_layer.update()
    assert value(bake(), 0.25, 0.5) == 1.0
    empty = bpy.data.objects.new("copy", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", hidden
    empty.rotation_euler = (0.0, 0.0, math.pi)  # the roof over x < 0
    empty.location.z = 1.0  # 2 above the floor: it hides -3 < x < -2
    bpy.context.collection.objects.link(empty)
    bpy.context.view_layer.update()
    assert value(bake(), 0.25, 0.5) == 1.0
    empty.rotation_euler, empty.location.z = (0.0, 0.0, 0.0), 0.0
    bpy.context.view_layer.update()
    image = bake()
    assert value(image, 0.25, 0.5) < 0.02 and value(image, 0.75, 0.5) > 0.98
    empty.hide_render = True
    bpy.context.view_layer.update()
    assert value(bake(), 0.25, 0.5) == 1.0


def uv_scales(obj):
    """Returns the area of each triangle in the lightmap by its area in the world, relative to the median."""
    mesh, scales = obj.data, []
    mesh.calc_loop_triangles()
    for triangle in mesh.loop_triangles:
        a, b, c = (mesh.uv_layers["Lightmap"].data[loop].uv for loop in triangle.loops)
        scales.append(0.5 * (b - a).cross(c - a) / triangle.area)
    median = sorted(scales)[len(scales) // 2]
    return [scale / median for scale in scales]


def test_suzanne_is_laid_out_without_stretch_and_keeps_her_faces():
    for levels in (0, 1, 2):
        _, _, settings = start()
        bpy.ops.mesh.primitive_monkey_add()
        suzanne = bpy.context.object
        if levels > 0:
            suzanne.modifiers.new("fine", "SUBSURF").levels = levels
            bpy.ops.object.modifier_apply(modifier="fine")
        select(suzanne)
        faces = len(suzanne.data.polygons)
        bake()
        scales = uv_scales(suzanne)
        assert len(suzanne.data.polygons) == faces
        assert 0.25 < min(scales) and max(scales) < 4.0, (levels, min(scales), max(scales))


def crown():
    """A cylinder whose caps bend so much that one chart cannot hold a cap."""
    start(lightmap=False)
    bpy.ops.mesh.primitive_cylinder_add(vertices=9, calc_uvs=False)
    obj = bpy.context.object
    for i, vertex in enumerate(obj.data.vertices):
        vertex.co.z += 0.8 * math.sin(5.0 * i)
    select(obj)
    return obj


def test_bent_faces_that_the_lightmap_parts_become_triangles():
    obj = crown()
    before = len(obj.data.polygons), sum(len(face.vertices) - 2 for face in obj.data.polygons)
    bake()
    after = len(obj.data.polygons), sum(len(face.vertices) - 2 for face in obj.data.polygons)
    assert after[0] > before[0] and after[1] == before[1], (before, after)
    scales = uv_scales(obj)
    assert 0.25 < min(scales) and max(scales) < 4.0, (min(scales), max(scales))


def test_a_bake_that_fails_gives_bent_faces_back():
    obj = crown()
    before = [tuple(face.vertices) for face in obj.data.polygons]
    bpy.data.objects.remove(bpy.data.objects["sun"])  # the add-on needs it after the layout
    assert "no sun" in error_of(bpy.ops.vdbshade.bake)
    assert [tuple(face.vertices) for face in obj.data.polygons] == before
    assert not obj.data.uv_layers


def test_modifiers_carry_the_uvs_that_were_made():
    floor, roof, _ = start(lightmap=False)
    floor.modifiers.new("fine", "SUBSURF").subdivision_type = "SIMPLE"
    bpy.context.view_layer.update()
    select(floor)
    image = bake()
    assert len(floor.data.polygons) == 1 and len(floor.data.uv_layers["Lightmap"].data) == 4
    assert at(floor, image, -0.5, 0.0) < 0.02 and at(floor, image, 0.5, 0.0) > 0.98


def test_uvs_fit_the_form_that_modifiers_give():
    floor, roof, settings = start(lightmap=False)
    bpy.data.objects.remove(roof)
    stretch = floor.modifiers.new("cast", "SIMPLE_DEFORM")
    stretch.deform_method, stretch.factor, stretch.deform_axis = "STRETCH", 3.0, "X"
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    size = floor.evaluated_get(depsgraph).dimensions
    assert size.x > 2.0 * size.y, tuple(size)
    bake()
    uvs = [loop.uv for loop in floor.data.uv_layers["Lightmap"].data]
    wide, high = (uvs[1] - uvs[0]).length, (uvs[2] - uvs[1]).length
    assert abs(wide / high / (size.x / size.y) - 1.0) < 0.3, (wide, high, tuple(size))


def test_each_of_several_materials_shows_the_image_by_the_same_uvs():
    floor, roof, _ = start(lightmap=False)
    mesh = bpy.data.meshes.new("two")
    mesh.from_pydata(FLOOR + [(1, -1, 1), (1, 1, 1)], [], [(0, 1, 2, 3), (1, 4, 5, 2)])
    two = bpy.data.objects.new("two", mesh)
    bpy.context.collection.objects.link(two)
    for name in ("stone", "wood"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons[1].material_index = 1
    bpy.context.view_layer.update()
    select(two)
    image = bake()
    for slot in two.material_slots:
        nodes = slot.material.node_tree.nodes
        assert nodes["vdbshade image"].image == image and nodes["vdbshade UV"].uv_map == "Lightmap", slot.name
    assert [slot.material.name for slot in two.material_slots] == ["stone", "wood"]


def test_uvs_are_made_only_where_that_is_allowed():
    floor, roof, settings = start(lightmap=False)
    settings.unwrap = "NEVER"
    assert "'floor': has no UV map for a lightmap" in error_of(bpy.ops.vdbshade.bake)
    floor, roof, settings = start()
    bake()
    assert "Lightmap" not in floor.data.uv_layers, "UVs where none were needed"
    settings.unwrap = "ALWAYS"
    bake()
    assert "Lightmap" in floor.data.uv_layers


def test_a_bake_that_fails_takes_its_uvs_back():
    floor, roof, settings = start(lightmap=False)
    other = bpy.data.objects.new("other", floor.data)
    other.location.x = 2.0
    bpy.context.collection.objects.link(other)
    bpy.data.objects.remove(bpy.data.objects["sun"])  # the add-on needs it after the layout
    bpy.context.view_layer.update()
    select(floor, other)
    assert "no sun" in error_of(bpy.ops.vdbshade.bake)
    assert floor.data == other.data and len(bpy.data.meshes) == 2, list(bpy.data.meshes)
    assert [layer.name for layer in floor.data.uv_layers] == ["UVMap"]


def test_transforms_modifiers_and_visibility_count():
    floor, roof, settings = start(sun=(0.0, 0.0, 0.0))
    roof.scale = (-1.0, 1.0, 1.0)  # mirrored: over x < 0 now
    floor.modifiers.new("thick", "SOLIDIFY").thickness = 0.1
    bpy.context.view_layer.update()
    image = bake()
    assert value(image, 0.25, 0.5) < 0.02 and value(image, 0.75, 0.5) > 0.98
    roof.hide_render = True
    assert value(bake(), 0.25, 0.5) == 1.0


def test_names_are_no_patterns():
    floor, roof, settings = start()
    floor.name = "floor [1]*?\\"
    other = quad("floor 1xx", [(5, 5, 0), (6, 5, 0), (6, 6, 0)], [("a", SQUARE[:3]), ("b", SQUARE[:3])])
    select(floor)
    assert value(bake(), 0.25, 0.5) < 0.02
    assert not other.data.materials


def test_a_saved_file_keeps_the_image_beside_it():
    floor, _, settings = start()
    path = os.path.join(FOLDER, "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    image = bake()
    assert os.path.exists(os.path.join(FOLDER, "vdbshade.exr")), os.listdir(FOLDER)
    assert image.filepath == "//vdbshade.exr" and image.packed_file is None, image.filepath
    start()
    assert bake().packed_file is not None, "an image of a file that was never saved is lost"


def test_errors_are_told():
    floor, _, settings = start()
    bpy.context.preferences.addons["vdbshade_bake"].preferences.program = "/nowhere/vdbshade"
    assert "no such program" in error_of(bpy.ops.vdbshade.bake)
    bpy.context.preferences.addons["vdbshade_bake"].preferences.program = PROGRAM
    for obj in bpy.context.scene.objects:
        obj.select_set(False)
    assert "select the mesh objects" in error_of(bpy.ops.vdbshade.bake)
    select(floor)
    bpy.data.objects.remove(bpy.data.objects["sun"])
    assert "no sun" in error_of(bpy.ops.vdbshade.bake)
    floor.data.uv_layers["Baked"].data[2].uv = (float("nan"), 0.0)
    settings.what = "AO"
    told = error_of(bpy.ops.vdbshade.bake)
    assert "floor" in told, told  # the program's own line
    assert "vdbshade" not in bpy.data.images


def test_a_bake_that_is_stopped_leaves_nothing():
    floor, _, settings = start()
    settings.size = 8192
    settings.max_error = 0.001
    job = addon.Bake(bpy.context)
    job.begin(bpy.context)
    folder, process = job.folder, job.process
    assert job.poll() is None
    job.stop()
    assert process.poll() is not None and not os.path.exists(folder)
    assert "vdbshade" not in bpy.data.images


def test_the_light_of_a_lit_glb_is_shown_as_it_was_baked():
    floor, roof, _ = start()
    glb, lit, baked, drawn = (os.path.join(FOLDER, name) for name in ("in.glb", "lit.glb", "baked.exr", "drawn.exr"))
    sys.modules["vdbshade_bake.scene"].write_glb(glb, [floor, roof], bpy.context.evaluated_depsgraph_get(), {"floor": "Baked"})
    command = [PROGRAM, "bake", glb, "--receive", "floor", "--sun", "0,0,1", "--sun-angle", "30", "--ao", "3", "--size", "64", "--unwrap", "never"]
    subprocess.run(command + ["-o", baked, "--pack", "R=shadow.sun,G=ao"], check=True)
    subprocess.run(command + ["--ambient", "0.5,0.5,0.5", "-o", lit], check=True)
    start()
    bpy.data.batch_remove(bpy.data.objects)
    assert bpy.ops.vdbshade.import_light(filepath=lit) == {"FINISHED"}
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("white")
    scene.world.color = (1.0, 1.0, 1.0)  # which adds nothing
    # the importer takes the file's y for up, and this one has z
    bpy.ops.object.camera_add(location=(0.0, -0.5, 0.0), rotation=(math.pi / 2.0, 0.0, 0.0))
    scene.camera, camera = bpy.context.object, bpy.context.object.data
    camera.type, camera.ortho_scale, camera.clip_start = "ORTHO", 2.0, 0.01
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.pixel_filter_type, scene.cycles.filter_width = 1, False, "BOX", 0.01
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", 64, 64
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", drawn
    bpy.ops.render.render(write_still=True)
    baked, drawn = (numpy.reshape(bpy.data.images.load(path).pixels, (-1, 4)) for path in (baked, drawn))
    wanted = (baked[:, :1] + 0.5) * baked[:, 1:2]
    difference = drawn[:, :3] - wanted
    print("largest difference %.2f of 255, RMS %.2f" % (255.0 * abs(difference).max(), 255.0 * math.sqrt((difference ** 2).mean())))
    assert wanted.min() < 0.4 and wanted.max() > 1.4 and abs(difference).max() < 2.0 / 255.0
    assert bpy.ops.vdbshade.import_light(filepath=glb) == {"FINISHED"}  # without light, with a warning


def test_progress_is_read():
    start()
    job = addon.Bake(bpy.context)
    job.begin(bpy.context)
    job.process.wait()
    assert job.poll() == 0
    assert 0.0 <= job.progress[0] <= 1.0 and "write" in job.progress[1], job.progress
    job.stop()


def main():
    failed = 0
    tests = [(name, test) for name, test in sorted(globals().items()) if name.startswith("test_")]
    for name, test in tests:
        try:
            test()
            print("ok", name)
        except Exception:
            failed += 1
            print("not ok", name)
            traceback.print_exc(file=sys.stdout)
    print("%d passed, %d failed" % (len(tests) - failed, failed))
    sys.stdout.flush()
    os._exit(1 if failed else 0)


main()
