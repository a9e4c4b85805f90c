"""Occluders, and their parts that marches and rays meet: fields, triangles, heights, spheres."""
from __future__ import annotations

from typing import Any, List, Optional, Sequence

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, output, pointer, transform as matrix
from ._calls import OUT, Handle, Run, Several, ask, call
from ._grid import Grid
from ._library import Path, Unpack, ffi, lib
from ._light import Light
from ._mesh import Meshes, heights_source, meshes_of
from ._shapes import Solids
from ._structs import Filled, Struct, path_of, split, struct_of


class Triangles(Handle, kind="vsh_triangles"):
    """Triangles of meshes in a tree for rays; the meshes need not outlive it."""

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None) -> None:
        super().__init__(call(lib.vsh_triangles_create, *meshes_of(meshes), OUT, run=run))

    @property
    def bytes(self) -> int:
        """In memory."""
        return ask(lib.vsh_triangles_bytes, self)


class Field(Handle, kind="vsh_field"):
    """The pyramid of narrow bands that shadow marching samples, of a grid.

    Parameters
    ----------
    grid : Grid
    reach : float
        largest distance that must be told apart, world units; 0: four times the diagonal of the solid's box
    surface : bool
        extract the surface, for rays
    """

    info: types.FieldInfo

    def __init__(self, grid: Grid, *, run: Optional[Run] = None, **options: "Unpack[types.FieldOptions]") -> None:
        super().__init__(call(lib.vsh_field_create, grid, Filled("vsh_field_options", options), OUT, run=run))

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

    def find_lost(self, meshes: Meshes, triangles: Optional[Triangles] = None) -> List[types.Lost]:
        """Finds the parts of its meshes that it does not hold: a record for each mesh."""
        structs, count = meshes_of(meshes)
        return call(lib.vsh_field_find_lost, self, structs, count, optional(triangles, "vsh_triangles"), Several(count))


class Heights(Handle, kind="vsh_heights"):
    """A heightfield that casts as it is, without voxels; arguments as of Model.from_heights()."""

    info: types.HeightsInfo

    def __init__(self, values: ArrayLike, *, size: Sequence[float] = (1.0, 1.0), height: float = 1.0, base: float = 0.0,
                 transform: Optional[ArrayLike] = None, name: str = "heights", run: Optional[Run] = None) -> None:
        super().__init__(call(lib.vsh_heights_create, heights_source(values, size, height, base, transform, name), OUT, run=run))


class Spheres(Handle, kind="vsh_spheres"):
    """Spheres that cast as they are, without voxels.

    Parameters
    ----------
    spheres : array of float64, shape (n, 4)
        x, y, z, radius, world units
    transform : array of float64, shape (3, 4), optional
    """

    info: types.SpheresInfo

    def __init__(self, spheres: ArrayLike, transform: Optional[ArrayLike] = None, *, run: Optional[Run] = None) -> None:
        balls = array(spheres, numpy.float64, (None, 4), "spheres")
        super().__init__(call(lib.vsh_spheres_create, balls, len(balls), matrix(transform), OUT, run=run))


def spheres_read(path: Path, *, run: Optional[Run] = None) -> numpy.ndarray:
    """Spheres of a CSV file: an array of float64 of shape (n, 4), x, y, z and radius."""
    spheres, count = call(lib.vsh_spheres_read, path_of(path, "path"), OUT, OUT, run=run)
    owned = ffi.gc(spheres, lib.vsh_spheres_list_free)
    return numpy.frombuffer(ffi.buffer(owned, 32 * count), numpy.float64).reshape(-1, 4).copy()


def optional(given: Any, kind: str, name: Optional[str] = None) -> Any:
    """The C pointer of an argument that may be None."""
    return ffi.NULL if given is None else struct_of(given, ffi.typeof(kind), name)


def _trace(function: Any, triangles: Optional[Triangles], solids: Optional[Solids], positions: ArrayLike, normals: Optional[ArrayLike],
           out: Optional[numpy.ndarray], run: Optional[Run], *how: Any) -> numpy.ndarray:
    at = array(positions, numpy.float64, (None, 3), "positions")
    up = None if normals is None else array(normals, numpy.float32, (len(at), 3), "normals")
    values = output(out, numpy.float32, (len(at),), "out")
    call(function, optional(triangles, "vsh_triangles"), optional(solids, "vsh_solids"), len(at), at, up, *how, values, run=run)
    return values


def trace_shadow(positions: ArrayLike, normals: Optional[ArrayLike], light: Light, *, triangles: Optional[Triangles] = None,
                 solids: Optional[Solids] = None, lift: float = 0.0, rays: int = 256, out: Optional[numpy.ndarray] = None,
                 run: Optional[Run] = None) -> numpy.ndarray:
    """Fraction of a light that points see, by rays: the truth for other methods.

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
    return _trace(lib.vsh_trace_shadow, triangles, solids, positions, normals, out, run, lift, light, rays)


def trace_ao(positions: ArrayLike, normals: ArrayLike, distance: float, *, triangles: Optional[Triangles] = None,
             solids: Optional[Solids] = None, lift: float = 0.0, rays: int = 256, out: Optional[numpy.ndarray] = None,
             run: Optional[Run] = None) -> numpy.ndarray:
    """Cosine-weighted fraction of the hemisphere that is free within a distance, world units; else as trace_shadow()."""
    return _trace(lib.vsh_trace_ao, triangles, solids, positions, numpy.asarray(normals), out, run, lift, distance, rays)


class Layer(Struct, kind="vsh_layer"):
    """Casters that are shaded in a way of their own: a part of Occluders.from_parts().

    Parameters
    ----------
    casters : Field, Heights or Spheres
    triangles : Triangles, optional
        of a field's casters, for exact methods
    lights : sequence of str, optional
        names of the lights it casts for; None: all
    **options
        members of ``vsh_layer`` (vdbshade.types.Layer): method, combine, softness, remap, start_offset, ao, name
    """

    def __init__(self, casters: Any, *, triangles: Optional[Triangles] = None, lights: Optional[Sequence[str]] = None,
                 **options: "Unpack[types.Layer]") -> None:
        if not isinstance(casters, (Field, Heights, Spheres)):
            raise TypeError(f"casters: expected a Field, Heights or Spheres, got {type(casters).__name__}")
        self.struct = Filled("vsh_layer", options, triangles=triangles, lights=lights, **{casters.KIND[len("vsh_") :]: casters}).struct


class Occluders(Handle, kind="vsh_occluders"):
    """What casts: points, lightmaps, volumes, pictures and distances are asked of it.

    Parameters
    ----------
    meshes : Mesh, Model or sequence of Mesh
        their triangles are kept, and where voxels are asked for, a level set is made of them
    **options
        ``reach``, ``triangles`` (False: voxels alone) of vdbshade.types.OccludersOptions; ``voxel_size``,
        ``resolution``, ``half_width``, ``shell_thickness`` of vdbshade.types.GridOptions. Without a resolution or a
        voxel size there are no voxels, and only the methods auto and exact
    """

    info: types.OccludersInfo

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None, **options: Any) -> None:
        mine, grid = split(options, "vsh_occluders_options", "vsh_grid_options")
        super().__init__(call(lib.vsh_occluders_create, *meshes_of(meshes), Filled("vsh_occluders_options", mine, grid=grid), OUT, run=run))

    @classmethod
    def from_grid(cls, grid: Grid, *, run: Optional[Run] = None, **options: "Unpack[types.FieldOptions]") -> "Occluders":
        """A level set as what casts: of a .vdb file, a function, a procedural tree."""
        return cls._of(call(lib.vsh_occluders_from_grid, grid, Filled("vsh_field_options", options), OUT, run=run))

    @classmethod
    def from_parts(cls, field: Optional[Field] = None, *, triangles: Optional[Triangles] = None, layers: Sequence[Layer] = (),
                   true_triangles: Optional[Triangles] = None, true_solids: Optional[Solids] = None,
                   voxel_size: float = 0.0) -> "Occluders":
        """Of a field, triangles, layers, and what errors are measured against."""
        parts = Filled("vsh_occluder_parts", field=field, triangles=triangles, layers=layers, true_triangles=true_triangles,
                       true_solids=true_solids, voxel_size=voxel_size)
        return cls._of(call(lib.vsh_occluders_from_parts, parts, OUT, keeps=parts.keeps))

    @property
    def field(self) -> Field:
        """Its field, which lives as long as anything that refers to either."""
        return Field._borrow(ask(lib.vsh_occluders_get_parts, self, OUT).field, self.handle)
