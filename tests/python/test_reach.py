"""Python reaches all of the C library, and agrees with the headers: functions, options, words, layouts."""
import functools
import gc
import json
import os
import re
import subprocess
import sys
import unittest

import numpy

import vdbshade
from common import ASSETS, FLOOR, FLOOR_TRIANGLES, FLOOR_UVS, ROOT, Case, box, floor, points_on_floor, sun
from vdbshade import _core, _version, types
from vdbshade._core import ffi, lib

sys.path.insert(0, str(ROOT / "src/bindings/python"))
import generate  # noqa: E402

TEXT = generate.read_headers(ROOT / "include/vdbshade")
ENUMS = re.findall(r"^typedef enum (\w+) \{(.*?)\}", generate.COMMENT.sub(" ", TEXT), re.M | re.S)

# Functions of C that Python has no use for, and why.
LEFT_OUT = {
    "vsh_grid_from_distance": "a function of one position: vsh_grid_from_distances() takes arrays of them",
    "vsh_grid_from_openvdb": "takes a pointer of OpenVDB's C++; .vdb files and arrays go between the two",
    "vsh_grid_to_openvdb": "the same",
    "vsh_volume_to_openvdb": "the same",
    "vsh_reader_serve": "for the main of a program that is its own reader; Run(reader=…) takes such a program's path",
    "vsh_find_name": "words are looked up in tables of the headers' constants",
}


class Reach(Case):
    def test_every_function_is_called_or_left_out_for_a_reason(self):
        """Uses the whole module as a program would, and records the functions of C that it calls."""
        declared = re.findall(r"VSH_API[^;{]*?\b(vsh_\w+)\s*\(", generate.COMMENT.sub(" ", TEXT))
        self.assertGreater(len(set(declared)), 100)
        self.assertEqual(set(declared), set(generate.functions(TEXT)))
        called = set()

        class Recorded:
            def __getattr__(self, name):
                called.add(name)
                return getattr(lib, name)

        modules = [m for n, m in sys.modules.items() if n.startswith("vdbshade._") and hasattr(m, "lib")]
        for module in modules:
            module.lib = Recorded()
        try:
            self.use_all_of_it()
        finally:
            for module in modules:
                module.lib = lib
        gc.collect()
        self.assertEqual(sorted(set(declared) - called - set(LEFT_OUT)), [])
        self.assertEqual(sorted(set(LEFT_OUT) & called), [])
        self.assertEqual(sorted(set(LEFT_OUT) - set(declared)), [])

    def use_all_of_it(self):
        here, v = self.folder, vdbshade
        glb, lamp = ASSETS / "cloister.glb", sun()
        v.version(), v.settings(), v.reader_confinement(), v.file_digest(glb), v.Error("", 1).name
        v.lit_is_output("a.glb"), v.flat_light_name(0), v.shadow_method_traits("cone"), v.ao_method_traits("exact"), repr(lamp)
        # meshes and models
        model = v.Model(glb)
        model.unit, model.uv_sets(0), self.lights()
        model[0].check(), model[0].measure_uvs(64, 64), v.mesh_solidity([box()])
        terrain = numpy.random.default_rng(1).random((8, 8), numpy.float32) * 0.1
        v.Model.from_heights(terrain, what="surface")
        # level sets
        ball = v.Sdf("sphere")
        grid = v.Grid.from_sdf(ball, voxel_size=0.2)
        v.Grid.from_distance(lambda p: numpy.linalg.norm(p, axis=1) - 1, (-1, -1, -1), (1, 1, 1), voxel_size=0.2)
        boxes = v.Grid.from_meshes(box(), voxel_size=0.2)
        v.Grid.unite([grid, (boxes, numpy.eye(4))], voxel_size=0.2).write(here / "a.vdb", attributes={"a": "b"})
        read = v.Grid.read(here / "a.vdb")
        read.info, read.values(), v.vdb_list(here / "a.vdb")
        square = v.Outline.from_polygons([[[0, 0], [1, 0], [1, 1], [0, 1]]])
        v.Grid.from_outline(square, 0.5, voxel_size=0.1)
        # what casts
        occluders = v.Occluders(box(), resolution=32)
        occluders.info, occluders.field.sample([[0, 0, 0]]), occluders.field.info
        v.Occluders.from_grid(grid, reach=2.0)
        self.layers(terrain)
        # points
        positions, normals = points_on_floor(8)
        seen = v.shade_shadow(occluders, positions, normals, lamp)
        v.shade_ao(occluders, positions, normals), v.shade_irradiance(positions, normals, lamp, seen)
        v.Query(occluders, lamp).points(positions, normals)
        # lightmaps
        charts = v.Charts(floor(), width=16, height=16)
        charts.info
        lightmap = v.bake_lightmap(occluders, charts, lamp, ao=True)
        lightmap.write(here / "a.exr")
        v.image_read(here / "a.exr"), v.image_check(here / "b.exr", ["ao"], (2, 2))
        v.image_write(here / "b.exr", {"ao": numpy.zeros((2, 2))})
        # volumes
        for voxels in (v.Voxels.from_grid(boxes), v.Voxels.from_box((0, 0, 0), (1, 1, 1), 0.5), v.Voxels.from_vdb(here / "a.vdb")):
            voxels.info
        volume = v.bake_volume(occluders, v.Voxels.from_grid(boxes), lamp)
        volume.info, volume.grids, volume.values("shadow.sun", (0, 0, 0), (1, 1, 1))
        volume.write(here / "v.vdb", half=True)
        # scenes
        scene = v.Scene(ASSETS / "seeds.json", size=16, resolution=32, ao="auto")
        v.provenance(scene), scene.receiver_check(0)
        scene.check_outputs([here / "none.exr"])
        forecast = v.forecast_scene(scene)
        (baked,) = scene.bake()
        self.assertEqual(baked.told.covered, 256)
        assets = v.Assets(scene)
        self.assertEqual((forecast.texels, forecast.ao_distance), (256, assets.info.ao_distance))
        meshes = assets.receiver(0)
        assets.caster(0), assets.casters()
        scene.receiver_charts(0, meshes), scene.needs_unwrap(0, meshes)
        v.Assets(scene).occluders(voxels=True)
        v.bake_scene(v.Scene(casters=[ball], lights=[lamp], size=16,
                             receivers=[dict(path=ASSETS / "seeds_floor.obj", output=here / "s.exr")]))
        # comparing, unwrapping, assets with their light, pages
        v.compare(lightmap["ao"], lightmap["ao"]), v.compare_accuracy([lightmap["ao"]], [lightmap["ao"]])
        self.assertTrue(v.compare_files(here / "a.exr", here / "a.exr").alike)
        self.assertFalse(v.compare_files(here / "a.exr", here / "b.exr").alike)
        atlas = v.unwrap(model, width=256, height=256)
        atlas.info, atlas.charts, atlas[0].of(model[0])
        v.lit_write(here / "lit.glb", model, [v.LitImage("occlusion", numpy.ones((64, 64)))], path=glb, atlas=atlas)
        v.view_write(here / "lit.html", here / "lit.glb")
        # planes and pictures
        (here / "flat.json").write_text('{"region": [-1, -1, 1, 1], "casters": [{"shape": "box", "half_size": [0.2, 0.2]}], "lights": '
                                        '[{"name": "l", "type": "disc", "position": [0.5, 0.5], "radius": 0.1}]}')
        flat = v.FlatScene(here / "flat.json", size=8)
        self.assertEqual(flat.bake()["A"].shape, flat.shape)
        camera = v.Camera().frame((-1, -1, -1), (1, 1, 1)).frame_points(positions).orbit(0.1)
        v.render([occluders.field], occluders, lamp, camera=camera, width=8, height=8,
                 lit=[v.LitMeshes(floor(), {"shadow.sun": lightmap["shadow.sun"]})]).encode(alpha=True)
        del baked, volume, assets, atlas
        self.hidden(), self.pages(), self.job_parts()

    def lights(self):
        path = self.folder / "lamp.gltf"
        vdbshade.lit_write(path, vdbshade.Model(ASSETS / "seeds_floor.obj"), [])
        document = json.loads(path.read_text())
        document["extensionsUsed"] = ["KHR_lights_punctual"]
        document["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 3.0}]}}
        document["scenes"][0]["nodes"].append(len(document["nodes"]))
        document["nodes"].append({"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}})
        path.write_text(json.dumps(document))
        (lamp,) = vdbshade.lights_read(path, 0.1, 0.2)
        self.assertEqual((lamp.type, lamp.radius, lamp.name, lamp.color), ("sphere", 0.2, "lamp", (3.0, 3.0, 3.0)))
        self.assertEqual(vdbshade.lights_read(ASSETS / "cloister.glb", 0.1, 0.2), [])
        scene = self.folder / "lamp.json"
        scene.write_text(json.dumps({"casters": [{"mesh": "lamp.gltf"}]}))
        read = vdbshade.Scene(scene, lights=[lamp])
        self.assertEqual([repr(light) for light in read.lights], [repr(lamp)])

    def layers(self, terrain):
        vdbshade.image_write(self.folder / "terrain.exr", {"Y": terrain})
        casters = [dict(spheres=[[0, 1, 0, 0.3]], voxelised=1, layer="balls"), dict(type="heightfield", path=self.folder / "terrain.exr",
                                                                                   size=(4, 4), height=1.0, direct=1, layer="ground")]
        layers = [dict(name="balls", softness=0.5, lights=["sun"], combine="min", method="cone"), dict(name="ground", method="classic", ao=0)]
        scene = vdbshade.Scene(casters=casters, lights=[sun()], layers=layers, resolution=32)
        self.assertEqual(scene.layers, ["balls", "ground"])
        occluders = vdbshade.Assets(scene).occluders()
        self.assertEqual(occluders.info.layer_count, 2)
        self.assertLess(occluders.layer_field("balls").sample([[0, 1, 0]])[0], 0)
        self.assertIsNone(occluders.layer_field("ground"))

    def hidden(self):
        """A square that is wholly hidden gets the values of another one in the same place."""
        meshes = [vdbshade.Mesh(FLOOR, FLOOR_TRIANGLES, uvs=FLOOR_UVS * [0.4, 0.8] + [shift, 0.1]) for shift in (0.05, 0.55)]
        charts = vdbshade.Charts(meshes, width=32, height=32)
        ao, coverage = numpy.full((32, 32), 0.5, numpy.float32), vdbshade.bake_lightmap(vdbshade.Occluders(box()), charts)["A"]
        hidden = coverage[:, 16:] > 0
        ao[:, 16:], coverage[:, 16:] = 0, 0
        self.assertEqual(vdbshade.lightmap_fill_hidden(charts, {"ao": ao, "A": coverage}), hidden.sum())
        self.assertTrue((ao[:, 16:][hidden] == 0.5).all())

    def pages(self):
        """Objects get their own pages if the options ask for it; borders between pages are stitched."""
        v, glb = vdbshade, ASSETS / "cloister.glb"
        model = v.Model(glb)
        rule = model[0].name
        density = model.densities({"*": 0.5, rule: 2.0}, str(glb))
        self.assertEqual([2.0 if mesh.name == rule else 0.5 for mesh in model], list(density))
        self.refused(v.InputError, "cloister.*no-such", model.densities, {"no-such": 1.0}, str(glb))
        halves = [v.Mesh(FLOOR + numpy.float32([x, 0, 0]), FLOOR_TRIANGLES, name=f"half{x}") for x in (0, 4)]
        atlas = v.unwrap(halves, density=[1, 2], texels_per_unit=4, width=64, height=64, atlas="objects", fit_pages=True)
        pages = [atlas.page(i) for i in range(atlas.info.pages)]
        self.assertEqual([(p.width, p.first_mesh, p.texels_per_unit) for p in pages], [(32, 0, 4.0), (64, 1, 4.0)])
        self.assertRaises(IndexError, atlas.page, 2)
        charts = [v.Charts([atlas[i].of(halves[i])], width=p.width, height=p.height) for i, p in enumerate(pages)]
        maps = [{"ao": numpy.full(c.shape, value, numpy.float32), "A": numpy.ones(c.shape, numpy.float32)}
                for c, value in zip(charts, (0.50, 0.51))]
        report = v.lightmaps_stitch(list(zip(charts, maps)), max_change=0.1)
        self.assertEqual(report.seams, 1)
        self.assertLess(report.after, 0.1 * report.before)
        self.assertGreater(maps[0]["ao"].max(), 0.5)
        scene = v.Scene(casters=[glb], lights=[sun()], receivers=[dict(
            path=glb, output=self.folder / "o.png", unwrap="always", atlas="objects", texels_per_unit=2.0, max_size=256,
            density={rule: 2.0})])
        self.assertGreater(v.forecast_scene(scene).lightmap_count, 1)
        v.Scene(ASSETS / "seeds.json", resolution=24).view(self.folder / "scene.html", "the seeds")
        self.assertIn("the seeds", (self.folder / "scene.html").read_text())

    def job_parts(self):
        """Two parts make the lightmap of one bake, bit by bit."""
        def scene():
            return vdbshade.Scene(ASSETS / "seeds.json", size=32, resolution=32)
        parts = self.folder / "job"
        for shard in (1, 2):
            baked = vdbshade.bake_scene(scene(), shard=shard, shard_count=2, parts=parts, words=["w"])
            self.assertEqual(baked.lightmaps, [])
        (merged,) = vdbshade.merge_scene(scene(), arrays=True, parts=parts).lightmaps
        (whole,) = scene().bake()
        self.assertEqual(list(merged), list(whole))
        for name in whole:
            self.assertSame(merged[name], whole[name])
        self.assertEqual(vdbshade.part_words(parts, 2), ["w"])

    def test_words_are_the_librarys(self):
        kinds = re.findall(r"\bVSH_NAMES_(\w+) = (\d+)", TEXT)
        self.assertEqual(len(kinds), 17)
        names = {prefix: functools.partial(lib.vsh_get_name, int(kind)) for prefix, kind in kinds if prefix != "FLAT_LIGHT"}
        for prefix, name in names.items():
            for number in range(20):
                word = name(number)
                if word != ffi.NULL:
                    enum = next(name for name, body in ENUMS if re.search(rf"\bVSH_{prefix}_\w+ = 0\b", body))
                    self.assertEqual(_core.constant(enum, ffi.string(word).decode(), prefix), number, prefix)

    def test_a_word_of_another_enum_is_none(self):
        self.assertEqual(list(_core.words("vsh_align")), ["left", "center", "right"])
        self.assertEqual(list(_core.words("vsh_channel_kind")), ["data", "light", "vector"])
        self.refused(ValueError, "align 'mask': expected one of left, center, right", _core.Filled, "vsh_text_options", align="mask")

    def test_options_are_those_of_the_headers_with_their_defaults(self):
        """Each option struct begins with its defaults, and vdbshade.types lists its members."""
        structs = generate.structs(TEXT)
        options = [s for s, members in structs.items() if members[0].name == "struct_size"]
        self.assertGreater(len(options), 25)
        for struct in options:
            if struct == "vsh_limits":  # only in results
                continue
            self.assertEqual(_core.Filled(struct).struct.struct_size, ffi.sizeof(struct), struct)
        for struct, members in structs.items():
            self.assertEqual([m.name for m in members], _core.members(struct), struct)
            kind = getattr(types, "".join(part.capitalize() for part in struct[4:].split("_")))
            shown = {m.name for m in members} - generate.HIDDEN - generate.ARGUMENTS.get(struct, set())
            self.assertEqual({n.rstrip("_") for n in kind.__annotations__}, shown, struct)
        self.assertIn("0 … 4096", types.ShadeOptions.__doc__)

    def test_layouts_are_the_compilers(self):
        """Sizes and places of all members agree with the C compiler."""
        lines, want = [], []
        for struct in generate.structs(TEXT):
            lines.append(f'printf("{struct} %zu\\n", sizeof({struct}));')
            want.append(f"{struct} {ffi.sizeof(struct)}")
            for member in _core.members(struct):
                lines.append(f'printf("{struct}.{member} %zu\\n", offsetof({struct}, {member}));')
                want.append(f"{struct}.{member} {ffi.offsetof(struct, member)}")
        bodies = re.findall(r"^(?:typedef )?enum (?:\w+ )?\{(.*?)\}", generate.COMMENT.sub(" ", TEXT), re.M | re.S)
        constants = [part.partition("=")[0].strip() for body in bodies for part in body.split(",") if part.strip()]
        self.assertGreater(len(constants), 150)
        for name in constants:
            lines.append(f'printf("{name} %lld\\n", (long long){name});')
            want.append(f"{name} {getattr(lib, name)}")
        source = self.folder / "layout.c"
        source.write_text("#include <vdbshade/vdbshade.h>\n#include <stdio.h>\nint main(void) {\n" + "\n".join(lines) + "\nreturn 0; }\n")
        subprocess.run([os.environ.get("CC", "cc"), f"-I{ROOT / 'include'}", "-o", self.folder / "layout", source], check=True)
        told = subprocess.run([self.folder / "layout"], check=True, capture_output=True, text=True).stdout.split("\n")
        self.assertEqual(told[:-1], want)

    def test_all_that_is_public_is_documented(self):
        names = [n for n in vdbshade.__all__ if n != "types"]
        self.assertGreater(len(names), 60)
        for name in names:
            thing = getattr(vdbshade, name)
            self.assertTrue((thing.__doc__ or "").strip(), name)

    def test_another_version_of_the_library_is_refused(self):
        script = ("import sys, vdbshade._version as t; t.VERSION = '0.1'; del sys.modules['vdbshade'], sys.modules['vdbshade._core']\n"
                  "import vdbshade")
        result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        self.assertIn("ImportError: vdbshade: this module is for version 0.1 of the library", result.stderr)
        self.assertIn("'0.2", repr(_version.VERSION))


if __name__ == "__main__":
    unittest.main()
