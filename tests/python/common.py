"""Helpers of the Python module's tests: a box over a floor, the sample asset, folders and programs."""
import os
import pathlib
import tempfile
import unittest
import warnings

import numpy

import vdbshade

ROOT = pathlib.Path(__file__).resolve().parents[2]
ASSETS = ROOT / "assets"
VDBSHADE = os.environ["VDBSHADE"]  # the command line

BOX = numpy.array([[x, y, z] for z in (-0.5, 0.5) for y in (0.25, 1.25) for x in (-0.5, 0.5)], numpy.float32)
BOX_TRIANGLES = numpy.array([[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2],
                             [2, 4, 6], [1, 3, 5], [3, 7, 5]], numpy.uint32)
FLOOR = numpy.array([[-2, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]], numpy.float32)
FLOOR_UVS = numpy.array([[0, 1], [1, 1], [1, 0], [0, 0]], numpy.float32)
FLOOR_TRIANGLES = numpy.array([[0, 2, 1], [0, 3, 2]], numpy.uint32)


def box():
    return vdbshade.Mesh(BOX, BOX_TRIANGLES, name="box")


def floor():
    return vdbshade.Mesh(FLOOR, FLOOR_TRIANGLES, uvs=FLOOR_UVS, name="floor")


def sun(**options):
    return vdbshade.Light("directional", **dict(dict(direction=(0.5, 1, 0), angle=0.1, name="sun"), **options))


def points_on_floor(count, seed=1):
    """Positions float64 and normals float32."""
    random = numpy.random.default_rng(seed)
    positions = random.uniform(-2, 2, (count, 3))
    positions[:, 1] = 0.001
    return positions, numpy.tile(numpy.float32([0, 1, 0]), (count, 1))


class Case(unittest.TestCase):
    """A test in a folder of its own. Warnings of the library do not fail it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        caught = warnings.catch_warnings()
        caught.__enter__()
        self.addCleanup(caught.__exit__, None, None, None)
        warnings.simplefilter("ignore", vdbshade.VdbshadeWarning)

    def refused(self, kind, message, function, *arguments, **options):
        with self.assertRaisesRegex(kind, message) as caught:
            function(*arguments, **options)
        return caught.exception

    def assertSame(self, a, b):
        """The same bits."""
        self.assertEqual((a.shape, a.dtype), (b.shape, b.dtype))
        self.assertEqual(a.tobytes(), b.tobytes())
