"""What marches and rays meet: fields, triangles, heights, spheres."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, List, Optional, Sequence

import numpy
from numpy.typing import ArrayLike

from ._arrays import array, output, pointer, transform as matrix
from ._library import RUN, Handle, Run, call, ffi, handle_of, lib, make, place
from ._structs import Filled, info, path_of, told
from ._grid import Grid
from ._light import Light
from ._mesh import Meshes, heights_source, meshes_of
from ._sdf import Solids

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from . import types


class Triangles(Handle):
    """Triangles of meshes in a tree for rays; the meshes need not outlive it."""

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None) -> None:
        structs, count, _ = meshes_of(meshes)
        super().__init__(make(lib.vsh_triangles_free, lib.vsh_triangles_create, structs, count, RUN, place("vsh_triangles"), run=run))

    @property
    def bytes(self) -> int:
        """In memory."""
        return lib.vsh_triangles_bytes(self.handle)


class Field(Handle):
    """The pyramid of narrow bands that shadow marching samples, of a grid.

    Parameters
    ----------
    grid : Grid
    reach : float
        largest distance that must be told apart, world units; 0: four times the diagonal of the solid's box
    surface : bool
        extract the surface, for rays
    """

    def __init__(self, grid: Grid, *, run: Optional[Run] = None, **options: "Unpack[types.FieldOptions]") -> None:
        super().__init__(make(lib.vsh_field_free, lib.vsh_field_create, handle_of(grid, Grid, "grid"),
                              Filled("vsh_field_options", options).pointer, RUN, place("vsh_field"), run=run))

    def sample(self, positions: ArrayLike, out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
        """Signed distance.

        Parameters
        ----------
        positions : array of float64, shape (n, 3)
            world units
        out : array of float32, shape (n,), optional

        Returns
        -------
        array of float32, shape (n,)
            world units, negative inside; NaN for positions that are not finite
        """
        at = array(positions, numpy.float64, (None, 3), "positions")
        distances = output(out, numpy.float32, (len(at),), "out")
        lib.vsh_field_sample(self.handle, len(at), pointer(at), pointer(distances))
        return distances

    @property
    def info(self) -> "types.FieldInfo":
        return info(lib.vsh_field_get_info, "vsh_field_info", self.handle)

    def find_lost(self, meshes: Meshes, triangles: Optional[Triangles] = None) -> "List[types.Lost]":
        """What of the meshes that it was made of it does not hold: a record for each."""
        structs, count, _ = meshes_of(meshes)
        lost = ffi.new("vsh_lost[]", max(count, 1))
        rays = ffi.NULL if triangles is None else handle_of(triangles, Triangles, "triangles")
        call(lib.vsh_field_find_lost, self.handle, structs, count, rays, lost)
        return [told(lost[i], "vsh_lost") for i in range(count)]


class Heights(Handle):
    """A heightfield that casts as it is, without voxels; arguments as of Model.from_heights()."""

    def __init__(self, values: ArrayLike, *, size: Sequence[float] = (1.0, 1.0), height: float = 1.0, base: float = 0.0,
                 transform: Optional[ArrayLike] = None, name: str = "heights", run: Optional[Run] = None) -> None:
        source, keeps = heights_source(values, size, height, base, transform, name)
        super().__init__(make(lib.vsh_heights_free, lib.vsh_heights_create, source, RUN, place("vsh_heights"), run=run))
        del keeps

    @property
    def info(self) -> "types.HeightsInfo":
        return info(lib.vsh_heights_get_info, "vsh_heights_info", self.handle)


class Spheres(Handle):
    """Spheres that cast as they are, without voxels.

    Parameters
    ----------
    spheres : array of float64, shape (n, 4)
        x, y, z, radius, world units
    transform : array of float64, shape (3, 4), optional
    """

    def __init__(self, spheres: ArrayLike, transform: Optional[ArrayLike] = None, *, run: Optional[Run] = None) -> None:
        balls = array(spheres, numpy.float64, (None, 4), "spheres")
        super().__init__(make(lib.vsh_spheres_free, lib.vsh_spheres_create, pointer(balls), len(balls), pointer(matrix(transform)),
                              RUN, place("vsh_spheres"), run=run))

    @property
    def info(self) -> "types.SpheresInfo":
        return info(lib.vsh_spheres_get_info, "vsh_spheres_info", self.handle)


def spheres_read(path: "str | os.PathLike[str]", *, run: Optional[Run] = None) -> numpy.ndarray:
    """Spheres of a CSV file: an array of float64 of shape (n, 4), x, y, z and radius."""
    spheres, count = ffi.new("double **"), ffi.new("size_t *")
    call(lib.vsh_spheres_read, path_of(path, "path"), RUN, spheres, count, run=run)
    owned = ffi.gc(spheres[0], lib.vsh_spheres_list_free)
    return numpy.frombuffer(ffi.buffer(owned, 32 * count[0]), numpy.float64).reshape(-1, 4).copy()


def _traced(triangles: Optional[Triangles], solids: Optional[Solids]) -> tuple:
    return (ffi.NULL if triangles is None else handle_of(triangles, Triangles, "triangles"),
            ffi.NULL if solids is None else handle_of(solids, Solids, "solids"))


def trace_shadow(positions: ArrayLike, normals: Optional[ArrayLike], light: Light, *, triangles: Optional[Triangles] = None,
                 solids: Optional[Solids] = None, lift: float = 0.0, rays: int = 256, out: Optional[numpy.ndarray] = None,
                 run: Optional[Run] = None) -> numpy.ndarray:
    """Fraction of a light that points see, by rays: the truth that others are held against.

    Parameters
    ----------
    positions : array of float64, shape (n, 3)
        world units
    normals : array of float32, shape (n, 3), optional
        unit; None: no horizon
    lift : float
        world units above the point, where rays begin
    rays : int
        a point, 1 … 65536

    Returns
    -------
    array of float32, shape (n,)
    """
    at = array(positions, numpy.float64, (None, 3), "positions")
    up = None if normals is None else array(normals, numpy.float32, (len(at), 3), "normals")
    values = output(out, numpy.float32, (len(at),), "out")
    if not isinstance(light, Light):
        raise TypeError(f"light: expected a vdbshade.Light, got {type(light).__name__}")
    call(lib.vsh_trace_shadow, *_traced(triangles, solids), len(at), pointer(at), pointer(up), lift, light.struct, rays, RUN,
         pointer(values), run=run)
    return values


def trace_ao(positions: ArrayLike, normals: ArrayLike, distance: float, *, triangles: Optional[Triangles] = None,
             solids: Optional[Solids] = None, lift: float = 0.0, rays: int = 256, out: Optional[numpy.ndarray] = None,
             run: Optional[Run] = None) -> numpy.ndarray:
    """Cosine-weighted fraction of the hemisphere that is free within a distance, world units; else as trace_shadow()."""
    at = array(positions, numpy.float64, (None, 3), "positions")
    up = array(normals, numpy.float32, (len(at), 3), "normals")
    values = output(out, numpy.float32, (len(at),), "out")
    call(lib.vsh_trace_ao, *_traced(triangles, solids), len(at), pointer(at), pointer(up), lift, distance, rays, RUN,
         pointer(values), run=run)
    return values


__all__ = ["Field", "Heights", "Spheres", "Triangles", "spheres_read", "trace_ao", "trace_shadow"]
