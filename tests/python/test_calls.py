"""How calls run: errors, progress, Ctrl-C, other threads meanwhile, what is freed and when."""
import copy
import functools
import gc
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
import unittest
import warnings

import numpy

import vdbshade
from common import ASSETS, Case, box, floor, points_on_floor, sun


def resident():
    """Bytes of this process in memory."""
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


class Errors(Case):
    def test_each_code_has_its_exception(self):
        error = self.refused(vdbshade.ReadError, "none.vdb: cannot be read", vdbshade.Grid.read, "none.vdb")
        self.assertEqual((error.code, error.name), (3, "VSH_ERROR_READ"))
        self.assertIsInstance(error, OSError)
        (self.folder / "bad.json").write_text("{")
        self.assertIsInstance(self.refused(ValueError, "bad.json", vdbshade.Scene, self.folder / "bad.json"), vdbshade.InputError)
        self.refused(vdbshade.ArgumentError, "rays 5000 is out of range 0 … 4096", vdbshade.Query, vdbshade.Occluders(box()), sun(), rays=5000)
        limit = vdbshade.Run(memory_limit=1000)
        self.refused(vdbshade.LimitError, "memory", vdbshade.Grid.from_meshes, box(), resolution=256, run=limit)
        self.refused(vdbshade.WriteError, "no/grid.vdb", vdbshade.Grid.from_meshes(box(), resolution=16).write, "no/grid.vdb")
        (self.folder / "a.gltf").write_text('{"asset": {"version": "2.0"}, "extensionsRequired": ["NO_such"], "extensionsUsed": ["NO_such"]}')
        self.refused(vdbshade.UnsupportedError, "extension", vdbshade.Model, self.folder / "a.gltf")

    def test_damaged_files_are_read_apart(self):
        """The confined reader reads files, unless the caller turns it off."""
        vdbshade.Grid.from_meshes(box(), resolution=32).write(self.folder / "cut.vdb")
        whole = (self.folder / "cut.vdb").read_bytes()
        (self.folder / "cut.vdb").write_bytes(whole[: len(whole) // 2])
        self.refused(vdbshade.ReadError, "cut.vdb", vdbshade.Grid.read, self.folder / "cut.vdb")
        self.refused(vdbshade.Error, "no-such-reader", vdbshade.Model, ASSETS / "cloister.glb", run=vdbshade.Run(reader="no-such-reader"))
        self.assertEqual(len(vdbshade.Model(ASSETS / "cloister.glb", run=vdbshade.Run(reader=False))), 12)

    def test_options_are_named(self):
        query = functools.partial(vdbshade.Query, vdbshade.Occluders(box()), sun())
        self.refused(TypeError, "no option 'ray'; there are method, ao_method", query, ray=5)
        self.refused(TypeError, "no setting 'sise'; there are .*size", vdbshade.Scene, ASSETS / "seeds.json", sise=5)
        self.refused(ValueError, "method 'cones': expected one of hard, classic", query, method="cones")
        self.refused(TypeError, "rays 1.5: expected a whole number", query, rays=1.5)
        self.refused(ValueError, "rays .*: too large", query, rays=2**40)
        self.refused(ValueError, "direction: expected 3 numbers, got 2", sun, direction=(1, 2))
        self.refused(TypeError, "^direction: ", sun, direction=1)
        self.refused(TypeError, "^direction: ", sun, direction=[None] * 3)
        self.refused(TypeError, "^angle: ", sun, angle=[1])
        self.assertEqual(sun(two_sided=numpy.bool_(True)).two_sided, 1)
        self.refused(vdbshade.ArgumentError, "angle", sun, angle=4.0)
        self.refused(ValueError, "name .*: expected at most 63 bytes", sun, name="x" * 64)
        model = vdbshade.Model(ASSETS / "cloister.glb")
        self.refused(TypeError, "occluders: expected a vdbshade.Occluders, got Model", vdbshade.Query, model)
        self.refused(TypeError, "run: expected a vdbshade.Run, got int", vdbshade.Model, ASSETS / "cloister.glb", run=3)
        self.refused(ValueError, "NUL", vdbshade.Model, "a\0b")

    def test_what_a_distance_function_raises_is_raised(self):
        calls = []

        def fails(positions):
            calls.append(1)
            raise KeyError("no distance here")

        self.refused(KeyError, "no distance here", vdbshade.Grid.from_distance, fails, (-1, -1, -1), (1, 1, 1), voxel_size=0.1)
        self.assertEqual(len(calls), 1)
        with self.assertRaisesRegex(ValueError, "expected [0-9]+ distances for [0-9]+ positions, got shape"):
            vdbshade.Grid.from_distance(lambda p: p, (-1, -1, -1), (1, 1, 1), voxel_size=0.1)
        with self.assertRaisesRegex(vdbshade.InputError, "nan at"):
            vdbshade.Grid.from_distance(lambda p: p[:, 0] * numpy.nan, (-1, -1, -1), (1, 1, 1), voxel_size=0.1)

    def test_what_a_distance_function_keeps_of_its_positions_stays(self):
        kept = []

        def ball(positions):
            kept.append((positions, positions.copy()))
            return numpy.linalg.norm(positions, axis=1) - 0.5

        vdbshade.Grid.from_distance(ball, (-1, -1, -1), (1, 1, 1), voxel_size=0.1)
        self.assertTrue(all(numpy.array_equal(at, copy) for at, copy in kept))


class Running(Case):
    def test_progress_comes_to_its_end_in_the_thread_that_called(self):
        seen = []
        run = vdbshade.Run(progress=lambda stage, fraction: seen.append((stage, fraction, threading.get_ident())) and None, interval=0)
        vdbshade.Occluders(box(), resolution=128, run=run)
        stages = [stage for stage, _, _ in seen]
        self.assertIn("voxelize", stages)
        self.assertIn("field", stages)
        self.assertEqual({thread for _, _, thread in seen}, {threading.get_ident()})
        for stage in ("voxelize", "field"):
            fractions = [f for s, f, _ in seen if s == stage]
            self.assertEqual((min(fractions), max(fractions)), (0.0, 1.0))
        every = len(seen)
        seen.clear()
        run.interval = 1000.0
        vdbshade.Occluders(box(), resolution=128, run=run)
        self.assertLess(len(seen), every)
        self.assertIn(1.0, [f for _, f, _ in seen])

    def test_the_end_of_every_stage_is_told_whichever_thread_came_to_it(self):
        for _ in range(20):
            seen = []
            run = vdbshade.Run(threads=4, progress=lambda stage, fraction: seen.append((stage, fraction)), interval=1000.0)
            vdbshade.Charts(floor(), width=256, height=256, run=run)
            self.assertEqual({s for s, _ in seen}, {s for s, f in seen if f == 1.0})
            self.assertEqual(seen[-1][1], 1.0)

    def test_progress_cancels_and_what_it_raises_is_raised(self):
        with self.assertRaisesRegex(vdbshade.Cancelled, "cancelled"):
            vdbshade.Occluders(box(), resolution=128, run=vdbshade.Run(progress=lambda stage, fraction: True))

        def fails(stage, fraction):
            raise LookupError(stage)

        with self.assertRaises(LookupError):
            vdbshade.Occluders(box(), resolution=128, run=vdbshade.Run(progress=fails))
        vdbshade.Occluders(box(), resolution=32)  # and it all goes on

    def test_warnings_are_pythons_or_go_to_the_function(self):
        sheet = vdbshade.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], name="sail")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            vdbshade.Grid.from_meshes(sheet, resolution=16, run=vdbshade.Run(notes=True))
        self.assertEqual([w.category for w in caught], [vdbshade.VdbshadeWarning])
        self.assertIn("'sail'", str(caught[0].message))
        self.assertEqual(caught[0].filename, __file__)
        told = []
        with warnings.catch_warnings(record=True) as caught:
            vdbshade.Grid.from_meshes(sheet, resolution=16, run=vdbshade.Run(warning=told.append, notes=True))
        self.assertEqual(([w for w in told if "'sail'" in w], caught), (told, []))
        self.assertEqual(len(told), 1)
        vdbshade.Grid.from_meshes(sheet, resolution=16, run=vdbshade.Run(warning=told.append))
        self.assertEqual(len(told), 1)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(vdbshade.VdbshadeWarning):
                vdbshade.Grid.from_meshes(sheet, resolution=16, run=vdbshade.Run(notes=True))

    def test_other_threads_run_meanwhile(self):
        """A call without progress, in a thread other than the main one, has no callbacks, in which other threads could run."""
        query = vdbshade.Query(vdbshade.Occluders(box()), max_error=1e-4, rays=4096)
        positions, normals = points_on_floor(4000)
        done = []
        thread = threading.Thread(target=lambda: done.append(query.points(positions, normals, ao=True, run=vdbshade.Run(threads=1))))
        begin, longest, last = time.perf_counter(), 0.0, time.perf_counter()
        thread.start()
        while not done and thread.is_alive():
            time.sleep(0.001)
            now = time.perf_counter()
            longest, last = max(longest, now - last), now
        thread.join()
        taken = time.perf_counter() - begin
        self.assertGreater(taken, 0.2, "too short to tell")
        self.assertLess(longest, 0.5 * taken)

    def interrupted(self, body):
        """Runs a program that gets SIGINT in a long call. Returns its exit code and output."""
        begin = """
            import faulthandler, sys, threading, time, numpy, vdbshade
            sys.path.insert(0, FOLDER)
            from common import *
            query = vdbshade.Query(vdbshade.Occluders(box()), max_error=1e-4, rays=4096)
            positions, normals = points_on_floor(1000000)
            def long(**options):
                print("begins", flush=True)
                query.points(positions, normals, ao=True, run=vdbshade.Run(**options))
                print("ended", flush=True)
        """
        script = textwrap.dedent(begin).replace("FOLDER", repr(str(pathlib.Path(__file__).parent))) + textwrap.dedent(body)
        process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            self.assertEqual(process.stdout.readline(), "begins\n", msg="" if process.poll() is None else process.stderr.read())
            time.sleep(0.3)
            begin = time.perf_counter()
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
            process.wait()
        self.assertLess(time.perf_counter() - begin, 10.0)
        return process.returncode, out, err

    def test_ctrl_c_ends_a_long_call(self):
        code, out, err = self.interrupted("long()")
        self.assertIn("KeyboardInterrupt", err)
        self.assertEqual((code, out), (-signal.SIGINT, ""))

    def test_ctrl_c_can_be_caught_and_calls_go_on(self):
        code, out, err = self.interrupted("""
            try:
                long(progress=lambda stage, fraction: None, threads=2)
            except KeyboardInterrupt:
                print("caught", flush=True)
            print(query.points(positions[:1], normals[:1], ao=True)["ao"].shape)
        """)
        self.assertEqual((code, out, err), (0, "caught\n(1,)\n", ""))

    def test_ctrl_c_ends_a_distance_function(self):
        code, out, err = self.interrupted("""
            def slow(p):
                time.sleep(0.01)
                return numpy.linalg.norm(p, axis=1) - 1
            print("begins", flush=True)
            vdbshade.Grid.from_distance(slow, (-1, -1, -1), (1, 1, 1), voxel_size=0.01)
        """)
        self.assertIn("KeyboardInterrupt", err)
        self.assertEqual((code, out), (-signal.SIGINT, ""))


class Memory(Case):
    def test_handles_are_neither_pickled_nor_copied(self):
        grid = vdbshade.Grid.from_meshes(box(), resolution=16)
        for way in (pickle.dumps, copy.copy, copy.deepcopy):
            self.refused(TypeError, "Grid can be neither pickled nor copied: it lives in this process", way, grid)

    def test_with_closes_and_closed_handles_are_refused(self):
        with vdbshade.Grid.from_meshes(box(), resolution=16) as grid:
            self.assertFalse(grid.closed)
        self.assertTrue(grid.closed)
        with self.assertRaisesRegex(ValueError, "Grid is closed"):
            grid.info
        self.refused(ValueError, "Grid is closed", vdbshade.Occluders.from_grid, grid)
        grid.close()

    def test_what_a_handle_needs_lives_as_long(self):
        scene = vdbshade.Scene(casters=[dict(spheres=numpy.random.default_rng(1).random((32, 4)) * [4, 1, 4, 0.2] - [2, 0, 2, 0])])
        assets = vdbshade.Assets(scene)
        occluders = assets.occluders()
        query = vdbshade.Query(occluders, sun())
        positions, _ = points_on_floor(200)
        want = query.points(positions)["shadow"]
        field = vdbshade.Occluders(box(), resolution=32).field
        model = vdbshade.Model(ASSETS / "cloister.glb")
        mesh, positions_of_mesh = model[0], model[0].positions
        copy = numpy.array(positions_of_mesh)
        handle = query.handle
        assets.close(), occluders.close(), model.close(), query.close()
        del scene, assets, occluders, model
        gc.collect()
        filler = [numpy.random.random(100000) for _ in range(20)]
        query._cdata = handle
        self.assertSame(query.points(positions)["shadow"], want)
        self.assertSame(numpy.array(positions_of_mesh), copy)
        self.assertEqual(mesh.name, "floor")
        depth = -float(field.sample([[0, 0.75, 0]])[0])  # a lower bound, so deep inside
        self.assertTrue(0.4 < depth <= 0.5, depth)
        del filler

    def grows(self, function, times):
        """Bytes by which the process grows over calls, once it has warmed up."""
        for _ in range(times // 4):
            function()
        gc.collect()
        before = resident()
        for _ in range(times):
            function()
        gc.collect()
        return resident() - before

    def test_many_calls_leave_nothing(self):
        occluders = vdbshade.Occluders(box(), resolution=32)
        query = vdbshade.Query(occluders, sun(), method="cone")
        positions, normals = points_on_floor(100)
        lamp = sun()

        def fails():
            try:
                vdbshade.Query(occluders, lamp, rays=5000)
            except vdbshade.ArgumentError:
                pass

        def cancels():
            try:
                vdbshade.shade_ao(occluders, positions, normals, run=vdbshade.Run(progress=lambda s, f: True))
            except vdbshade.Cancelled:
                pass

        kib = 1024
        self.assertLess(self.grows(lambda: query.points(positions, normals, gradient=True), 20000), 500 * kib)
        self.assertLess(self.grows(fails, 5000), 500 * kib)
        self.assertLess(self.grows(cancels, 3000), 500 * kib)
        self.assertLess(self.grows(lambda: vdbshade.Query(occluders, [lamp, sun(name="b")]).points(positions), 3000), 500 * kib)
        self.assertLess(self.grows(lambda: vdbshade.Grid.from_meshes(box(), resolution=16).info, 300), 2000 * kib)

    def test_large_things_are_freed_when_nothing_refers_to_them(self):
        charts = vdbshade.Charts(floor(), width=256, height=256)
        occluders = vdbshade.Occluders(box())
        megabyte = 1 << 20
        self.assertLess(self.grows(lambda: vdbshade.bake_lightmap(occluders, charts, sun()), 20), 4 * megabyte)
        self.assertLess(self.grows(lambda: vdbshade.Model(ASSETS / "cloister.glb")[0].positions.sum(), 20), 2 * megabyte)
        self.assertLess(self.grows(lambda: vdbshade.image_read(ASSETS / "terrain.png"), 20), 4 * megabyte)


if __name__ == "__main__":
    unittest.main()
