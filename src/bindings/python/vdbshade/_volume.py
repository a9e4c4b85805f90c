"""Volumes: shadow and ambient occlusion on voxels, as sparse grids."""
from __future__ import annotations

import os
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, output, pointer, vector
from ._library import RUN, Handle, Run, call, ffi, handle_of, lib, make, place
from ._structs import Filled, info, path_of, split, told
from ._grid import Attributes, Grid, attributes_of, dense
from ._light import Light, lights_of
from ._occluders import Occluders
from ._points import Stats


class Voxels(Handle):
    """Voxels that are to be shaded, and where they lie. Made by its ``from_…`` methods."""

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("Voxels are made by Voxels.from_grid(), from_box() or from_vdb()")

    @classmethod
    def _made(cls, function: Any, *arguments: Any, run: Optional[Run]) -> "Voxels":
        self = cls.__new__(cls)
        Handle.__init__(self, make(lib.vsh_voxels_free, function, *arguments, RUN, place("vsh_voxels"), run=run))
        return self

    @classmethod
    def from_grid(cls, grid: Grid, band: float = 0.0, *, run: Optional[Run] = None) -> "Voxels":
        """A level set's own narrow band, `band` voxels to both sides; 0: all of it."""
        return cls._made(lib.vsh_voxels_from_grid, handle_of(grid, Grid, "grid"), band, run=run)

    @classmethod
    def from_box(cls, box_min: Sequence[float], box_max: Sequence[float], voxel_size: float, *, run: Optional[Run] = None) -> "Voxels":
        """Cubes that cover a world box, world units."""
        return cls._made(lib.vsh_voxels_from_box, vector(box_min, 3, "box_min"), vector(box_max, 3, "box_max"), voxel_size, run=run)

    @classmethod
    def from_vdb(cls, path: "str | os.PathLike[str]", name: Optional[str] = None, *, run: Optional[Run] = None) -> "Voxels":
        """The active voxels of a grid of numbers in a .vdb file; `name` None: the first such grid."""
        return cls._made(lib.vsh_voxels_from_vdb, path_of(path, "path"), ffi.NULL if name is None else name.encode(), run=run)

    @property
    def info(self) -> types.VoxelsInfo:
        return info(lib.vsh_voxels_get_info, "vsh_voxels_info", self.handle)

    def centre(self, x: int, y: int, z: int) -> Tuple[float, ...]:
        """World position of a voxel's centre."""
        centre = ffi.new("double[3]")
        lib.vsh_voxels_centre(self.handle, ffi.new("int32_t[3]", [x, y, z]), centre)
        return tuple(centre)


class Volume(Handle):
    """Grids of a bake: "shadow.NAME", "ao", "error.NAME", "error.ao"."""

    @property
    def info(self) -> types.VolumeInfo:
        return info(lib.vsh_volume_get_info, "vsh_volume_info", self.handle)

    @property
    def grids(self) -> List[types.VolumeGrid]:
        """What grids there are."""
        return [info(lib.vsh_volume_get_grid, "vsh_volume_grid", self.handle, i) for i in range(self.info.grids)]

    def _number(self, grid: Union[int, str]) -> int:
        if isinstance(grid, int):
            return grid if grid >= 0 else 2**32  # which is none
        names = [g.name for g in self.grids]
        if grid not in names:
            raise KeyError(f"no grid {grid!r}; there are {', '.join(names)}")
        return names.index(grid)

    def sample(self, grid: Union[int, str], positions: ArrayLike, out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
        """Values at positions (n, 3), world units, interpolated: an array of float32 of shape (n,)."""
        at = array(positions, numpy.float64, (None, 3), "positions")
        values = output(out, numpy.float32, (len(at),), "out")
        call(lib.vsh_volume_sample, self.handle, self._number(grid), len(at), pointer(at), pointer(values))
        return values

    def values(self, grid: Union[int, str], index_min: Sequence[int], shape: Sequence[int],
               out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
        """A dense copy: float32 of shape (depth, height, width) from voxel `index_min` (x, y, z) on; 1 where not active."""
        number = self._number(grid)
        return dense(None, index_min, shape, out,
                     lambda low, size, values: call(lib.vsh_volume_copy, self.handle, number, low, size, values))

    def write(self, path: "str | os.PathLike[str]", *, half: bool = False, attributes: Optional[Attributes] = None) -> None:
        """Writes all grids as one .vdb file, whole or not at all."""
        lines = attributes_of(attributes)
        call(lib.vsh_volume_write, self.handle, path_of(path, "path"), half, lines.array, lines.count)


def bake_volume(occluders: Occluders, voxels: Voxels, lights: Union[Light, Sequence[Light]] = (), *, stats: Optional[Stats] = None,
                run: Optional[Run] = None, **options: Any) -> Volume:
    """Shades voxels.

    Parameters
    ----------
    occluders : Occluders
        with voxels of their own
    **options
        ``ao``, ``error`` (bool), ``inside`` ("nearest", "off") of vdbshade.types.VolumeOptions, and vdbshade.types.ShadeOptions
    """
    structs, count = lights_of(lights)
    own, shade = split(options, "vsh_volume_options", "vsh_shade_options")
    volume = place("vsh_volume")
    return Volume(call(lib.vsh_bake_volume, handle_of(occluders, Occluders, "occluders"), handle_of(voxels, Voxels, "voxels"), structs,
                       count, Filled("vsh_volume_options", dict(own, shade=shade)).pointer, RUN, volume,
                       ffi.NULL if stats is None else stats.struct, run=run, made=(lib.vsh_volume_free, volume)))


__all__ = ["Volume", "Voxels", "bake_volume"]
