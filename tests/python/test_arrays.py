"""Arrays: used without a copy if their layout fits, else converted if that is safe, else refused with a clear message."""
import unittest

import numpy

import vdbshade
from common import BOX, BOX_TRIANGLES, FLOOR_UVS, Case, box, floor, points_on_floor, sun
from vdbshade._core import ffi


def address(array):
    return array.__array_interface__["data"][0]


def at(cdata):
    return int(ffi.cast("uintptr_t", cdata))


class NoCopy(Case):
    def test_meshes_are_the_callers_arrays(self):
        normals = numpy.zeros_like(BOX)
        uvs = numpy.zeros((8, 2), numpy.float32)
        moved = numpy.eye(4)[:3]
        mesh = vdbshade.Mesh(BOX, BOX_TRIANGLES, normals=normals, uvs=uvs, transform=moved)
        for mine, its, pointer in ((BOX, mesh.positions, mesh.struct.positions), (BOX_TRIANGLES, mesh.indices, mesh.struct.indices),
                                   (normals, mesh.normals, mesh.struct.normals), (uvs, mesh.uvs, mesh.struct.uvs),
                                   (moved, mesh.transform, mesh.struct.transform)):
            self.assertEqual({address(mine), address(its)}, {at(pointer)})

    def test_a_copy_of_a_mesh_is_not_looked_at_again(self):
        """Float64 positions are copied at once, so later changes have no effect."""
        positions = BOX.astype(numpy.float64)
        mesh = vdbshade.Mesh(positions, BOX_TRIANGLES)
        positions[:] = numpy.nan
        self.assertAlmostEqual(mesh.check().area, 6.0, places=5)

    def test_points_are_read_where_they_lie(self):
        """C gets the addresses of the caller's arrays; arrays with gaps are copied."""
        query = vdbshade.Query(vdbshade.Occluders(box(), resolution=32), sun(), method="cone")
        given = {}

        class Seen:
            def __getattr__(self, name):
                return getattr(real, name)

            def vsh_query_points(self, query, points, layout, run, output, stats, error):
                given.update(points=points[0], layout=None if layout == ffi.NULL else layout[0], output=output[0],
                             shadow=at(output.visibility[0]))
                return real.vsh_query_points(query, points, layout, run, output, stats, error)

        real, vdbshade._shading.lib = vdbshade._shading.lib, Seen()
        try:
            positions, normals = points_on_floor(50)
            out = dict(shadow=numpy.empty((1, 50), numpy.float32))
            self.assertIs(query.points(positions, normals, out=out), out)
            self.assertEqual((at(given["points"].positions), at(given["points"].normals)), (address(positions), address(normals)))
            self.assertEqual((given["layout"], given["shadow"]), (None, address(out["shadow"])))
            vertices = numpy.zeros(100, [("normal", "f4", 3), ("position", "f4", 3)])[::2]
            vertices["normal"], vertices["position"] = normals, positions
            self.assertSame(query.points(vertices["position"], vertices["normal"])["shadow"],
                            query.points(positions.astype(numpy.float32), normals)["shadow"])
            self.assertEqual(given["layout"], None)
        finally:
            vdbshade._shading.lib = real

    def test_values_are_written_into_the_callers_arrays(self):
        charts, occluders = vdbshade.Charts(floor(), width=32, height=16), vdbshade.Occluders(box())
        mine = {"shadow.sun": numpy.full((16, 32), 7, numpy.float32), "irradiance": numpy.full((16, 32, 3), 7, numpy.float32)}
        lightmap = vdbshade.bake_lightmap(occluders, charts, sun(), irradiance=True, out=mine)
        for name, plane in mine.items():
            self.assertIs(lightmap[name], plane)
            self.assertLessEqual(plane.max(), 1.0)
        positions, normals = points_on_floor(10)
        out = numpy.empty(10, numpy.float32)
        self.assertIs(vdbshade.shade_shadow(occluders, positions, normals, sun(), out=out), out)
        grid = vdbshade.Grid.from_meshes(box(), resolution=16)
        values = numpy.empty((2, 3, 4), numpy.float32)
        self.assertIs(grid.values((0, 0, 0), out=values), values)
        self.assertSame(values, grid.values((0, 0, 0), (2, 3, 4)))

    def test_what_the_library_has_is_viewed_and_not_to_be_written(self):
        model = vdbshade.Model.from_heights(numpy.zeros((4, 4), numpy.float32), what="surface")
        positions = model[0].positions
        self.assertEqual(positions.shape, (16, 3))
        self.assertEqual(address(positions), address(model[0].positions))
        with self.assertRaises(ValueError):
            positions[0] = 0

    def test_a_grid_is_depth_height_width(self):
        flat = vdbshade.Grid.from_sdf(vdbshade.Sdf("box", size=(2, 0.5, 1)), voxel_size=0.125)
        values, low = flat.values(), flat.info.index_min
        depth, height, width = values.shape
        self.assertGreater(width, depth)
        self.assertGreater(depth, height)
        middle = [-i for i in low]
        self.assertAlmostEqual(float(flat.values((0, 4, 0), (1, 1, 1))[0, 0, 0]), float(values[middle[2], middle[1] + 4, middle[0]]))


class Refused(Case):
    def test_other_kinds_of_numbers(self):
        same = vdbshade.Mesh(BOX.tolist(), BOX_TRIANGLES.astype(numpy.int64))
        self.assertSame(same.positions, BOX)
        self.assertSame(same.indices, BOX_TRIANGLES)
        self.assertSame(vdbshade.Mesh(BOX.astype(">f4"), BOX_TRIANGLES).positions, BOX)
        self.assertSame(vdbshade.Mesh(numpy.asfortranarray(BOX), BOX_TRIANGLES).positions, BOX)
        self.refused(TypeError, "positions: expected float32, got complex64", vdbshade.Mesh, BOX * 1j, BOX_TRIANGLES)
        self.refused(TypeError, "positions: expected float32, got <U1", vdbshade.Mesh, [["a", "b", "c"]], BOX_TRIANGLES)
        self.refused(TypeError, "positions: expected float32, got object", vdbshade.Mesh, [[None, 1, 2]], BOX_TRIANGLES)
        self.refused(TypeError, "indices: expected uint32, got float64", vdbshade.Mesh, BOX, BOX_TRIANGLES * 1.0)
        self.refused(ValueError, "indices: -1 does not fit uint32", vdbshade.Mesh, BOX, BOX_TRIANGLES.astype(int) - 1)
        self.refused(ValueError, "indices: 4294967296 does not fit uint32", vdbshade.Mesh, BOX, BOX_TRIANGLES.astype(int) + 2**32)

    def test_other_shapes(self):
        self.refused(ValueError, r"positions: expected an array of shape \(n, 3\), got \(3, 8\)", vdbshade.Mesh, BOX.T, BOX_TRIANGLES)
        self.refused(ValueError, r"positions: expected an array of shape \(n, 3\), got \(24,\)", vdbshade.Mesh, BOX.ravel(), BOX_TRIANGLES)
        self.refused(ValueError, r"uvs: expected an array of shape \(8, 2\), got \(4, 2\)", vdbshade.Mesh, BOX, BOX_TRIANGLES, uvs=FLOOR_UVS)
        self.refused(ValueError, r"transform: expected an array of shape \(3, 4\), got \(3, 3\)", vdbshade.Mesh, BOX, BOX_TRIANGLES,
                     transform=numpy.eye(3))
        self.refused(ValueError, "last row", vdbshade.Mesh, BOX, BOX_TRIANGLES, transform=numpy.ones((4, 4)))
        query = vdbshade.Query(vdbshade.Occluders(box()), sun())
        positions, normals = points_on_floor(100)
        self.refused(ValueError, r"normals: expected an array of shape \(100, 3\), got \(99, 3\)", query.points, positions, normals[1:])
        self.refused(ValueError, r"positions: expected an array of shape \(n, 3\), got \(3,\)", query.points, positions[0])
        self.refused(ValueError, r"texels: expected an array of shape \(100,\)", query.points, positions, normals, texels=[1, 2])

    def test_arrays_to_write_into(self):
        occluders = vdbshade.Occluders(box())
        positions, normals = points_on_floor(10)
        shade = lambda out: vdbshade.shade_shadow(occluders, positions, normals, sun(), out=out)
        self.refused(TypeError, "out: expected float32 to write into, got float64", shade, numpy.empty(10))
        self.refused(TypeError, "out: expected a numpy array", shade, [0.0] * 10)
        self.refused(ValueError, r"out: expected an array of shape \(10,\) to write into, got \(9,\)", shade, numpy.empty(9, numpy.float32))
        self.refused(ValueError, "C-contiguous", shade, numpy.empty(20, numpy.float32)[::2])
        locked = numpy.empty(10, numpy.float32)
        locked.flags.writeable = False
        self.refused(ValueError, "writeable", shade, locked)
        query = vdbshade.Query(occluders, sun())
        self.refused(ValueError, "no value 'shadows'", query.points, positions, out=dict(shadows=locked))
        self.refused(ValueError, "writeable", query.points, positions, normals, out=dict(ao=locked))
        charts = vdbshade.Charts(floor(), width=8, height=8)
        self.refused(ValueError, "out: ao: not asked for", vdbshade.bake_lightmap, occluders, charts, sun(), out=dict(ao=numpy.zeros((8, 8))))
        self.refused(ValueError, "two of one name", vdbshade.bake_lightmap, occluders, charts, [sun(), sun()])
        self.refused(ValueError, "shape", vdbshade.Grid.from_meshes(box(), resolution=8).values, (0, 0, 0), (1, 1, 1),
                     numpy.empty((2, 2, 2), numpy.float32))

    def test_numbers_that_are_not_finite(self):
        bad = BOX.copy()
        bad[3, 1] = numpy.nan
        self.refused(vdbshade.InputError, "'box'.*vertex 3", vdbshade.Mesh(bad, BOX_TRIANGLES, name="box").check)
        self.refused(vdbshade.InputError, "vertex 3", vdbshade.Occluders, vdbshade.Mesh(bad, BOX_TRIANGLES))
        query = vdbshade.Query(vdbshade.Occluders(box(), resolution=32), sun(), method="cone")
        found = query.points([[numpy.nan, 0, 0], [0, 0.001, 0]], [[0, 1, 0], [0, 0, 0]], distance=True)
        self.assertTrue(numpy.isnan(found["shadow"]).all())
        self.assertEqual(numpy.isnan(found["distance"]).tolist(), [True, False])
        self.refused(vdbshade.ArgumentError, "direction", sun, direction=(0, numpy.inf, 0))

    def test_nothing_at_all(self):
        nothing = numpy.zeros((0, 3), numpy.float32)
        query = vdbshade.Query(vdbshade.Occluders(box(), resolution=16), sun())
        for empty in (nothing, [], nothing.astype(float)):
            found = query.points(empty, nothing, ao=True, gradient=True)
            self.assertEqual((found["shadow"].shape, found["ao"].shape, found["gradient"].shape), ((1, 0), (0,), (0, 3)))
        self.assertEqual(vdbshade.shade_ao(vdbshade.Occluders(box()), [], []).shape, (0,))
        self.assertEqual(vdbshade.Occluders(box(), resolution=16).field.sample([]).shape, (0,))
        self.refused(vdbshade.InputError, "without a triangle", vdbshade.Grid.from_meshes, vdbshade.Mesh([], []))
        self.refused(vdbshade.ArgumentError, "no meshes", vdbshade.Occluders, [])
        self.refused(TypeError, "meshes: expected a vdbshade.Mesh", vdbshade.Occluders, [BOX])
        self.refused(vdbshade.ArgumentError, "width", vdbshade.Charts, floor(), width=0, height=8)

    def test_huge_sizes_are_refused_before_memory_is_taken(self):
        wide = numpy.broadcast_to(numpy.float32(0.5), (70000, 70000))
        self.refused(ValueError, "at most 65536 rows and columns", vdbshade.Model.from_heights, wide)
        run = vdbshade.Run(memory_limit=2**16)
        self.refused(vdbshade.LimitError, "memory", vdbshade.Charts, floor(), width=8192, height=8192, run=run)
        self.refused(vdbshade.ArgumentError, "width|65536", vdbshade.Charts, floor(), width=2**31 - 1, height=2**31 - 1)
        self.refused(ValueError, "width .*: too large", vdbshade.Charts, floor(), width=2**31, height=8)
        self.refused(vdbshade.LimitError, "memory|voxel", vdbshade.Grid.from_meshes, box(), voxel_size=1e-9)
        grid = vdbshade.Grid.from_meshes(box(), resolution=8)
        self.refused(ValueError, "sizes", grid.values, (0, 0, 0), (2**40, 1, 1))
        self.refused(vdbshade.ArgumentError, "width", vdbshade.render, [], vdbshade.Occluders(box()), width=10**9)

    def test_indices_out_of_range(self):
        wrong = vdbshade.Mesh(BOX, [[0, 1, 8]])
        self.refused(vdbshade.InputError, "8", wrong.check)
        model = vdbshade.Model.from_heights(numpy.zeros((2, 2), numpy.float32))
        self.refused(IndexError, "mesh 1: there are 1", model.mesh, 1)
        self.refused(ValueError, "uv_set 9", model.mesh, 0, 9)
        self.assertSame(model[-1].positions, model[0].positions)
        self.assertEqual(len(list(model)), 1)
        self.refused(IndexError, "the atlas has 1", vdbshade.unwrap(box(), width=64, height=64).__getitem__, 1)


class Compared(Case):
    def test_planes_are_compared_over_their_mask(self):
        golden = numpy.zeros((8, 8), numpy.float32)
        values = golden.copy()
        values[0, 0] = 0.5
        mask = golden == 0
        self.assertEqual(vdbshade.compare(golden, values, mask).value["max"], 0.5)
        mask[0, 0] = False
        self.assertEqual(vdbshade.compare(golden, values, mask).value["max"], 0.0)
        accuracy = vdbshade.compare_accuracy([golden], [values])
        self.assertAlmostEqual(accuracy.rmse, 0.0625)

    def test_images_come_back_as_they_were_written(self):
        random = numpy.random.default_rng(1)
        planes = {"ao": random.random((5, 7), numpy.float32), "bent": random.random((5, 7, 3), numpy.float32)}
        vdbshade.image_write(self.folder / "a.exr", planes, attributes={"made_by": "a test"}, pack="channels")
        image = vdbshade.image_read(self.folder / "a.exr")
        self.assertEqual(sorted(image), ["ao", "bent.X", "bent.Y", "bent.Z"])
        self.assertSame(numpy.array(image["ao"]), planes["ao"])
        self.assertSame(numpy.array(image["bent.Y"]), numpy.ascontiguousarray(planes["bent"][:, :, 1]))
        self.assertEqual(image.attributes["made_by"], "a test")
        self.assertEqual([f.name for f in self.folder.iterdir()], ["a.exr"])


if __name__ == "__main__":
    unittest.main()
