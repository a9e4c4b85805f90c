"""Values are those of the command line and of C, bit by bit, whatever the arrays' layouts."""
import json
import subprocess
import threading
import unittest

import numpy

import vdbshade
from common import ASSETS, BOX, BOX_TRIANGLES, FLOOR, FLOOR_TRIANGLES, FLOOR_UVS, VDBSHADE, Case, box, floor, points_on_floor, sun

LIT = dict(direction=(0.6, 0.75, 0.5), angle=numpy.radians(3.0))


class Values(Case):
    def cli(self, *arguments):
        subprocess.run([VDBSHADE, *map(str, arguments), "--quiet"], check=True, cwd=self.folder)

    def test_a_lightmap_of_arrays_has_the_bits_of_the_command_lines(self):
        model = ASSETS / "cloister.glb"
        self.cli("bake", model, "--sun", "0.6,0.75,0.5", "--sun-angle", 3, "--ao", 0.6, "--size", 128, "--pack", "channels", "-o", "cli.exr")
        baked = vdbshade.image_read(self.folder / "cli.exr")
        meshes = vdbshade.Model(model)
        lightmap = vdbshade.bake_lightmap(vdbshade.Occluders(meshes), vdbshade.Charts(meshes, width=128, height=128),
                                          sun(**LIT), ao=True, ao_distance=0.6)
        self.assertEqual(set(lightmap), set(baked))
        for name in baked:
            self.assertSame(lightmap[name], numpy.array(baked[name]))

    def test_a_scene_has_the_bits_of_the_command_lines(self):
        self.cli("bake", ASSETS / "seeds.json", "--size", 96, "--pack", "channels", "-o", "cli.exr")
        baked = vdbshade.image_read(self.folder / "cli.exr")
        (lightmap,) = vdbshade.Scene(ASSETS / "seeds.json", size=96).bake()
        self.assertEqual(set(lightmap), set(baked))
        for name in baked:
            self.assertSame(lightmap[name], numpy.array(baked[name]))

    def test_files_of_a_scene_are_those_of_the_command_line(self):
        arguments = dict(casters=[ASSETS / "cloister.glb"], lights=[sun(**LIT)], size=64, ao=0.6)
        report = vdbshade.bake_scene(vdbshade.Scene(receivers=[dict(path=ASSETS / "cloister.glb", output=self.folder / "py.exr")], **arguments)).report
        self.cli("bake", ASSETS / "cloister.glb", "--sun", "0.6,0.75,0.5", "--sun-angle", 3, "--size", 64, "--ao", 0.6, "-o", "cli.exr")
        self.assertEqual(report.texels, 4096)
        self.assertTrue(vdbshade.compare_files(self.folder / "cli.exr", self.folder / "py.exr", limits=dict(max=0.0)))
        lit = vdbshade.image_read(self.folder / "py.exr")
        self.assertIn("shadow.sun", lit)
        self.assertIn("vdbshade_input_0", lit.attributes)

    def test_vertex_colours_fit_the_surface_better_than_values_at_its_vertices(self):
        side = 9  # with a vertex in the box
        ground = numpy.array([[x / 2 - 2, 0, z / 2 - 2] for x in range(side) for z in range(side)])
        cells = numpy.array([side * x + z for x in range(side - 1) for z in range(side - 1)])
        triangles = numpy.concatenate([cells[:, None] + [0, side + 1, side], cells[:, None] + [0, 1, side + 1]])
        meshes = {"ground": (ground, triangles), "box": (BOX - [0, 0.5, 0], BOX_TRIANGLES)}
        for name, (places, corners) in meshes.items():
            lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in places] + [f"f {a} {b} {c}" for a, b, c in corners + 1]
            (self.folder / f"{name}.obj").write_text("\n".join(lines))

        def bake(receiver="ground.obj", output="lit", threads=1, far=0.0):
            moved = dict(transform=numpy.array([[1, 0, 0, far], [0, 1, 0, 0], [0, 0, 1, 0.0]]))
            casters = [dict(path=self.folder / f"{name}.obj", **moved) for name in meshes]
            lit = dict(path=self.folder / receiver, output=self.folder / f"{output}.gltf", vertex_colors="ao", **moved)
            vdbshade.bake_scene(vdbshade.Scene(casters=casters, ao=1.0, receivers=[lit]), run=vdbshade.Run(threads=threads))
            root, bits = json.loads((self.folder / f"{output}.gltf").read_text()), (self.folder / f"{output}.bin").read_bytes()

            def read(name, kind, size):
                accessor = root["accessors"][root["meshes"][0]["primitives"][0]["attributes"][name]]
                offset = root["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
                return numpy.frombuffer(bits, kind, accessor["count"] * size, offset).reshape(-1, size)
            return root, read("POSITION", "<f4", 3), read("COLOR_0", "<u2", 4)
        root, places, colors = bake()
        self.assertSame(colors, bake(threads=2)[2])
        self.assertSame(colors, bake(output="far", far=2.0 ** 24)[2])
        del root["accessors"][root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]["name"]
        (self.folder / "own.gltf").write_text(json.dumps(root))
        for receiver, output in (("own.gltf", "first"), ("first.gltf", "second")):  # the first keeps the own colours
            product = bake(receiver, output)[2]
            numpy.testing.assert_allclose(product / 65535, (colors / 65535) ** 2, atol=2e-4)
        fitted, (x, _, z) = numpy.zeros((side, side)), (2 * places.T + 4).astype(int)
        fitted[x, z] = colors[:, 0] / 65535
        occluders = vdbshade.Occluders([vdbshade.Mesh(numpy.float32(places), numpy.uint32(corners)) for places, corners in meshes.values()])
        ao = lambda places: vdbshade.shade_ao(occluders, places, numpy.tile(numpy.float32([0, 1, 0]), (len(places), 1)), ao_distance=1.0)
        at = points_on_floor(4000)[0]
        at = at[numpy.abs(at[:, ::2]).max(axis=1) > 0.5]
        (i, j), (u, v) = (2 * at[:, ::2].T + 4).astype(int), (2 * at[:, ::2].T + 4) % 1

        def error(values):
            first, last = values[i, j], values[i + 1, j + 1]
            beyond, before = values[i + 1, j], values[i, j + 1]
            shown = numpy.where(u > v, first + u * (beyond - first) + v * (last - beyond), first + v * (before - first) + u * (last - before))
            return numpy.sqrt(numpy.mean((shown - ao(at)) ** 2))
        self.assertLess(error(fitted), 0.3 * error(ao(ground).reshape(side, side)))

    def test_light_comes_through_what_is_cut_out_or_seen_from_its_back(self):
        sheet, up = FLOOR + numpy.float32([0, 1, 0]), sun(direction=(0, 1, 0), angle=0.01)
        positions, normals = points_on_floor(200)
        positions *= [0.9, 1, 0.9]  # none under the sheet's rim, nor of its mask's
        positions = positions[numpy.abs(positions[:, 0]) > 0.3]
        normals = normals[: len(positions)]

        def seen(triangles=FLOOR_TRIANGLES, **members):
            mesh = vdbshade.Mesh(sheet, triangles, **members)
            return vdbshade.shade_shadow(vdbshade.Occluders(mesh), positions, normals, up, method="exact")
        backs = FLOOR_TRIANGLES[:, ::-1]
        self.assertFalse(seen().any() or seen(backs).any() or seen(one_sided=True).any())
        self.assertTrue((seen(backs, one_sided=True) == 1).all())
        alpha = numpy.zeros((8, 8), numpy.uint8)
        alpha[:, 4:] = 255
        mask = vdbshade.AlphaMask(alpha, wrap=("clamp", "repeat"))
        self.assertSame(seen(mask=mask, mask_uvs=FLOOR_UVS), (positions[:, 0] < 0).astype(numpy.float32))
        mirrored = vdbshade.AlphaMask(alpha, wrap=("mirror", "clamp"), uv_transform=[[1, 0, 1], [0, 1, 0]])
        self.assertSame(seen(mask=mirrored, mask_uvs=FLOOR_UVS), (positions[:, 0] > 0).astype(numpy.float32))
        half = vdbshade.AlphaMask(alpha, base_alpha=0.25)
        self.assertTrue((seen(mask=half, mask_uvs=FLOOR_UVS) == 1).all())
        mesh = vdbshade.Mesh(sheet, FLOOR_TRIANGLES, mask=mask, mask_uvs=FLOOR_UVS, one_sided=True, material_name="leaf", uvs=FLOOR_UVS)
        laid = vdbshade.unwrap(mesh, width=32, height=32)[0]
        same = laid.of(mesh)
        self.assertEqual((same.mask, same.one_sided, same.material_name), (mask, True, "leaf"))
        self.assertSame(same.mask_uvs, FLOOR_UVS[laid.sources])
        self.refused(ValueError, "expected both, or none", vdbshade.Mesh, sheet, FLOOR_TRIANGLES, mask=mask)
        self.refused(TypeError, "vdbshade.AlphaMask, got ndarray", vdbshade.Mesh, sheet, FLOOR_TRIANGLES, mask=alpha, mask_uvs=FLOOR_UVS)

    def test_what_a_file_says_of_masks_and_sides_is_read(self):
        path = self.folder / "leaf.gltf"
        vdbshade.lit_write(path, vdbshade.Model(ASSETS / "seeds_floor.obj"), [])
        alpha = numpy.zeros((4, 4), numpy.float32)
        alpha[0, 2:] = 1
        vdbshade.image_write(self.folder / "leaf.png", dict(R=alpha, G=alpha, B=alpha, A=alpha), color_space="linear")
        document = json.loads(path.read_text())
        document.update(images=[dict(uri="leaf.png")], textures=[dict(source=0, sampler=0)], samplers=[dict(wrapS=33071)],
                        materials=[dict(name="leaf", alphaMode="MASK", alphaCutoff=0.25,
                                        pbrMetallicRoughness=dict(baseColorTexture=dict(index=0)))])
        for primitive in document["meshes"][0]["primitives"]:
            primitive["material"] = 0
        path.write_text(json.dumps(document))
        scene = vdbshade.Scene(casters=[dict(path=path, one_sided="leaf")], lights=[sun()])
        (mesh,) = vdbshade.Assets(scene).caster(0)
        self.assertEqual((mesh.one_sided, mesh.material_name, mesh.alpha), (True, "leaf", "masked"))
        self.assertEqual((mesh.mask.wrap, mesh.mask.alpha_cutoff, mesh.mask.base_alpha), (("clamp", "repeat"), 0.25, 1.0))
        self.assertTrue(numpy.array_equal(mesh.mask.alpha, alpha * 255))
        self.assertEqual((mesh.mask_uvs.shape, mesh.mask.uv_transform.tolist()), ((len(mesh.positions), 2), [[1, 0, 0], [0, 1, 0]]))
        self.assertFalse(vdbshade.Model(path)[0].one_sided)

    def test_points_have_the_bits_of_the_command_line(self):
        positions, normals = points_on_floor(40000)
        rows = numpy.hstack([positions, normals]).astype(numpy.float32)
        rows.tofile(self.folder / "points.raw")
        scene = vdbshade.Scene(casters=[ASSETS / "cloister.glb"], lights=[sun(**LIT)], ao=0.6, resolution=64)
        occluders = vdbshade.Assets(scene).occluders(voxels=True)
        for method in ("adaptive", "cone"):
            self.cli("query", ASSETS / "cloister.glb", "--sun", "0.6,0.75,0.5", "--sun-angle", 3, "--ao", 0.6, "--resolution", 64,
                     "--method", method, "--ao-method", "taps", "--points", "points.raw", "--normals", "yes", "--distance", "--gradient",
                     "--answers-only", "-o", "answers.raw")
            answers = numpy.fromfile(self.folder / "answers.raw", numpy.float32).reshape(-1, 6)
            options = dict(method=method, ao_method="taps", ao_distance=0.6)
            query = vdbshade.Query(occluders, sun(**LIT), **options)
            found = query.points(rows[:, :3], rows[:, 3:], ao=True, distance=True, gradient=True)
            self.assertSame(numpy.column_stack([found["shadow"][0], found["ao"], found["distance"], found["gradient"]]), answers)
        self.assertSame(vdbshade.shade_shadow(occluders, rows[:, :3], rows[:, 3:], sun(**LIT), **options), found["shadow"][0])
        self.assertSame(vdbshade.shade_ao(occluders, rows[:, :3], rows[:, 3:], **options), found["ao"])
        self.assertSame(occluders.field.sample(rows[:, :3]), found["distance"])

    def test_layouts_change_no_bit(self):
        query = vdbshade.Query(vdbshade.Occluders(box(), resolution=64), sun(), method="cone", ao_method="cones")
        positions, normals = points_on_floor(1000)
        positions = positions.astype(numpy.float32).astype(numpy.float64)
        want = query.points(positions, normals, ao=True, gradient=True)
        vertices = numpy.zeros(1000, [("color", "u1", 4), ("position", "f4", 3), ("normal", "f4", 3), ("texel", "u4")])
        vertices["position"], vertices["normal"], vertices["texel"] = positions, normals, numpy.arange(1000)
        wide = numpy.zeros((1000, 5))
        wide[:, 1:4] = positions
        for given in (positions.astype(numpy.float32), vertices["position"], wide[:, 1:4], positions.tolist(),
                      numpy.asfortranarray(positions), positions.astype(">f8")):
            for up in (normals, vertices["normal"]):
                found = query.points(given, up, ao=True, gradient=True)
                for name in want:
                    self.assertSame(found[name], want[name])
        found = query.points(vertices["position"], vertices["normal"], texels=vertices["texel"], ao=True)
        self.assertSame(found["ao"], want["ao"])
        backwards = query.points(positions[::-1], normals[::-1])["shadow"]
        self.assertSame(numpy.ascontiguousarray(backwards[:, ::-1]), want["shadow"])

    def test_threads_that_call_at_once_get_the_same(self):
        query = vdbshade.Query(vdbshade.Occluders(box(), resolution=64), sun(), method="cone")
        positions, normals = points_on_floor(20000)
        want, found = query.points(positions, normals)["shadow"], [None] * 6

        def ask(i):
            found[i] = query.points(positions, normals)["shadow"]

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for values in found:
            self.assertSame(values, want)

    def test_a_python_function_gives_the_level_set_of_the_shape(self):
        """A sphere as a tree, as a function of arrays, and as a function whose distances are measured anew."""
        options = dict(voxel_size=0.05)
        tree = vdbshade.Grid.from_sdf(vdbshade.Sdf("sphere", radius=1.0), **options)
        sizes = set()

        def sphere(positions):
            sizes.add(len(positions))
            self.assertFalse(positions.flags.writeable)
            return numpy.sqrt(positions[:, 0] ** 2 + positions[:, 1] ** 2 + positions[:, 2] ** 2) - 1.0

        exact = vdbshade.Grid.from_distance(sphere, (-1, -1, -1), (1, 1, 1), **options)
        # which rounds as the tree's distance does not, here and there
        self.assertEqual(exact.info.active_voxels, tree.info.active_voxels)
        self.assertTrue(numpy.allclose(exact.values(), tree.values(), atol=1e-6))
        self.assertTrue({8, 64} <= sizes <= {1, 8, 64})
        twice = vdbshade.Grid.from_distance(lambda p: 2 * sphere(p), (-1, -1, -1), (1, 1, 1), lipschitz=2, exact=False, **options)
        at = numpy.random.default_rng(2).uniform(-1, 1, (1000, 3))
        at *= (1.0 + numpy.random.default_rng(3).uniform(-0.05, 0.05, (1000, 1))) / numpy.linalg.norm(at, axis=1, keepdims=True)
        distance = numpy.linalg.norm(at, axis=1) - 1
        self.assertLess(numpy.abs(vdbshade.Occluders.from_grid(twice).field.sample(at) - distance).max(), 0.005)

    def test_moved_shapes_are_where_they_were_moved(self):
        shape = vdbshade.Sdf("box", size=(1, 0.2, 0.3)) | vdbshade.Sdf("sphere", radius=0.5).translated(0, 1, 0)
        moved = shape.scaled(2).rotated((0, 0, 1), 0.7).translated(1, 2, 3).rotated((1, 2, 0.5), -0.4).translated(0, 0, 1)
        field_of = lambda sdf, voxel: vdbshade.Occluders.from_grid(vdbshade.Grid.from_sdf(sdf, voxel_size=voxel)).field
        at = numpy.random.default_rng(1).uniform(-1.6, 1.6, (100000, 3))
        distance = field_of(shape, 0.02).sample(at)
        near = numpy.abs(distance) < 0.04  # within the band
        at, distance = at[near], distance[near]
        self.assertGreater(len(at), 1000)
        axis = numpy.array([1, 2, 0.5]) / numpy.linalg.norm([1, 2, 0.5])

        def turn(v, axis, angle):
            return v * numpy.cos(angle) + numpy.cross(axis, v) * numpy.sin(angle) + axis * (v @ axis)[:, None] * (1 - numpy.cos(angle))

        there = turn(turn(2 * at, numpy.array([0, 0, 1.0]), 0.7) + [1, 2, 3], axis, -0.4) + [0, 0, 1]
        self.assertLess(numpy.abs(field_of(moved, 0.04).sample(there) - 2 * distance).max(), 0.04)  # a voxel
        hollow = field_of(vdbshade.Sdf("sphere") - vdbshade.Sdf("sphere", radius=0.5), 0.05)
        self.assertEqual(numpy.sign(hollow.sample([[0, 0, 0], [0.75, 0, 0], [1.1, 0, 0]])).tolist(), [1, -1, 1])
        both = field_of(vdbshade.Sdf("sphere") & vdbshade.Sdf("sphere").translated(1, 0, 0), 0.05)
        self.assertEqual(numpy.sign(both.sample([[-0.1, 0, 0], [0.5, 0, 0], [1.1, 0, 0]])).tolist(), [1, -1, 1])


if __name__ == "__main__":
    unittest.main()
