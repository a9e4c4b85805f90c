"""Narrow-band level sets: of meshes, procedural shapes, functions, outlines and .vdb files."""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import output, transform as matrix
from ._calls import OUT, Handle, Run, call, note
from ._library import Path, Unpack, ffi, lib
from ._mesh import Meshes, meshes_of
from ._shapes import Outline, Sdf, instances_of
from ._structs import Filled, path_of, structs_of, told

Attributes = Mapping[str, str]


def attributes_of(given: Optional[Attributes]) -> List[Dict[str, str]]:
    """Lines of text that a file carries, as members of ``vsh_attribute``."""
    return [dict(name=name, value=value) for name, value in (given or {}).items()]


class _Distance:
    """A function of the caller's while a grid is made of it."""

    def __init__(self, function: Callable[[numpy.ndarray], Any]) -> None:
        self.function = function
        self.raised: Optional[BaseException] = None


# Called by several threads, which hold the GIL here in turn.
@ffi.callback("vsh_distances_fn *", onerror=note)
def _distances(user: Any, count: int, positions: Any, distances: Any) -> None:
    running = ffi.from_handle(user)
    result = numpy.frombuffer(ffi.buffer(distances, 8 * count), numpy.float64)
    result[:] = numpy.nan  # what ends the call, where the function raises
    if running.raised is None:
        # a copy: C's own are gone when the function returns, whoever keeps them
        at = numpy.array(numpy.frombuffer(ffi.buffer(positions, 24 * count), numpy.float64)).reshape(count, 3)
        at.flags.writeable = False
        found = numpy.asarray(running.function(at), numpy.float64)
        if found.shape != (count,):
            raise ValueError(f"distance function: expected {count} distances for {count} positions, got shape {found.shape}")
        result[:] = found


class Grid(Handle, kind="vsh_grid"):
    """A level set: OpenVDB's grid of floats. Made by its ``from_…`` methods and ``read``.

    Voxels are given by `voxel_size` (world units) or `resolution` (voxels along the longest side, 256), the band's
    `half_width` and sheets' `shell_thickness` in voxels (vdbshade.types.GridOptions).
    """

    info: types.GridInfo

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("a Grid is made by Grid.from_meshes(), from_sdf(), from_distance(), from_outline(), unite() or read()")

    @classmethod
    def from_meshes(cls, meshes: Meshes, *, run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """The union of what meshes are taken for: solids, rooms, walls, sheets."""
        return cls._of(call(lib.vsh_grid_from_meshes, *meshes_of(meshes), Filled("vsh_grid_options", options), OUT, run=run))

    @classmethod
    def from_sdf(cls, sdf: Sdf, *, run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """A procedural tree, voxelised where its surface is."""
        return cls._of(call(lib.vsh_grid_from_sdf, sdf, Filled("vsh_grid_options", options), OUT, run=run))

    @classmethod
    def from_distance(cls, distance: Callable[[numpy.ndarray], ArrayLike], bounds_min: Sequence[float],
                      bounds_max: Sequence[float], *, lipschitz: float = 1.0, exact: bool = True,
                      run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """A field that a Python function gives, voxelised where its surface is.

        Parameters
        ----------
        distance : callable
            called with positions, an array of float64 of shape (n, 3) that it may not keep (n is 64, 8 or 1); returns
            signed distances, shape (n,), world units, negative inside. It is called from several threads, one at a
            time, and has to give the same value for the same position. What it raises, this raises.
        bounds_min, bounds_max : three floats
            a world box that holds the whole surface
        lipschitz : float
            bound on how much distances differ over how far positions do; 1 for true distances
        exact : bool
            True: a true distance near the surface; False: it is measured anew, for which single positions are asked
            for, too: ten times as long
        """
        if not callable(distance):
            raise TypeError(f"distance: expected a function, got {type(distance).__name__}")
        given = _Distance(distance)
        filled = Filled("vsh_distance", lipschitz=lipschitz, exact=exact, bounds_min=bounds_min, bounds_max=bounds_max,
                        user=ffi.new_handle(given))
        return cls._of(call(lib.vsh_grid_from_distances, filled, _distances, Filled("vsh_grid_options", options), OUT, run=run,
                            watched=given))

    @classmethod
    def from_outline(cls, outline: Outline, thickness: float, *, transform: Optional[ArrayLike] = None,
                     run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """An outline extruded along z by a thickness, local units; `transform` (3, 4) as of unite()."""
        return cls._of(call(lib.vsh_grid_from_outline, outline, thickness, matrix(transform), Filled("vsh_grid_options", options), OUT,
                            run=run))

    @classmethod
    def read(cls, path: Path, name: Optional[str] = None, *, run: Optional[Run] = None) -> "Grid":
        """A level set of a .vdb file; `name` None: its first."""
        return cls._of(call(lib.vsh_grid_read, path_of(path, "path"), name, OUT, run=run))

    @classmethod
    def unite(cls, grids: "Sequence[Union[Grid, Tuple[Grid, ArrayLike]]]", *, run: Optional[Run] = None,
              **options: "Unpack[types.GridOptions]") -> "Grid":
        """The union of grids, or of pairs of a grid and its transform, shape (3, 4): rotation, translation, mirroring
        and one scale."""
        instances = instances_of("vsh_grid_instance", grids, matrix)
        return cls._of(call(lib.vsh_grid_unite, instances, len(grids), Filled("vsh_grid_options", options), OUT, run=run))

    def write(self, path: Path, name: Optional[str] = None, attributes: Optional[Attributes] = None) -> None:
        """Writes a .vdb file, whole or not at all; `name` None: "surface"."""
        lines = attributes_of(attributes)
        call(lib.vsh_grid_write, self, path_of(path, "path"), name, structs_of("vsh_attribute", lines), len(lines))

    def values(self, index_min: Optional[Sequence[int]] = None, shape: Optional[Sequence[int]] = None,
               out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
        """A dense copy of its distances.

        Parameters
        ----------
        index_min : three ints, optional
            the first voxel: x, y, z; None: the first of the band
        shape : three ints, optional
            depth, height, width: voxels along z, y, x; None: to the last of the band
        out : array of float32, shape (depth, height, width), optional
            to be written into

        Returns
        -------
        array of float32, shape (depth, height, width)
            world units, negative inside; beyond the band ± its half width
        """
        return dense(self.info, index_min, shape, out, lambda *box: call(lib.vsh_grid_copy, self, *box))


def dense(box: Any, index_min: Optional[Sequence[int]], shape: Optional[Sequence[int]], out: Optional[numpy.ndarray],
          copy: Callable[[Any, Any, Any], Any]) -> numpy.ndarray:
    """Fills a dense array of voxels; `box` has index_min and index_max."""
    low = [int(i) for i in (box.index_min if index_min is None else index_min)]
    if shape is None:
        shape = out.shape if out is not None else [box.index_max[2 - i] + 1 - low[2 - i] for i in range(3)]
    if len(low) != 3 or len(shape) != 3 or not all(1 <= n < 2**31 for n in shape) or not all(abs(i) < 2**31 for i in low):
        raise ValueError(f"index_min {tuple(low)}, shape {tuple(shape)}: expected three indices, and sizes of at least 1")
    values = output(out, numpy.float32, tuple(int(n) for n in shape), "out")
    copy(ffi.new("int32_t[3]", low), ffi.new("int32_t[3]", [int(n) for n in reversed(shape)]), values)
    return values


def vdb_list(path: Path, *, run: Optional[Run] = None) -> List[types.VdbEntry]:
    """What grids a .vdb file has, of any kind."""
    count, capacity = ffi.new("size_t *"), 16
    while True:
        entries = ffi.new("vsh_vdb_entry[]", capacity)
        call(lib.vsh_vdb_list, path_of(path, "path"), entries, capacity, count, run=run)
        if count[0] <= capacity:
            return [told(entries[i]) for i in range(count[0])]
        capacity = count[0]


def vdb_copy(path: Path, index_min: Sequence[int], shape: Sequence[int], name: Optional[str] = None, *,
             run: Optional[Run] = None) -> Tuple[numpy.ndarray, numpy.ndarray]:
    """Values of a grid of numbers of a .vdb file, and where it is active: two arrays of float32 (depth, height, width),
    from the voxel `index_min` (x, y, z) on; `name` None: the first such grid."""
    active = numpy.empty(tuple(int(n) for n in shape), numpy.float32)
    values = dense(None, index_min, shape, None, lambda *box: call(lib.vsh_vdb_copy, path_of(path, "path"), name, *box, active, run=run))
    return values, active
