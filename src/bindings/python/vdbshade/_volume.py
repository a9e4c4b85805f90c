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
from ._parts import part_options
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
        return info(lib.vsh_voxels_get_info_sized, "vsh_voxels_info", self.handle)

    def centre(self, x: int, y: int, z: int) -> Tuple[float, ...]:
        """World position of a voxel's centre."""
        centre = ffi.new("double[3]")
        lib.vsh_voxels_centre(self.handle, ffi.new("int32_t[3]", [x, y, z]), centre)
        return tuple(centre)


class Volume(Handle):
    """Grids of a bake: "shadow.NAME", "ao", "error.NAME", "error.ao"."""

    @property
    def info(self) -> types.VolumeInfo:
        return info(lib.vsh_volume_get_info_sized, "vsh_volume_info", self.handle)

    @property
    def grids(self) -> List[types.VolumeGrid]:
        """What grids there are."""
        return [info(lib.vsh_volume_get_grid_sized, "vsh_volume_grid", self.handle, i) for i in range(self.info.grids)]

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
    filled = _options(options)
    return Volume(_baked(occluders, voxels, structs, count, filled, stats, run))


def _options(options: Dict[str, Any]) -> Filled:
    own, shade = split(options, "vsh_volume_options", "vsh_shade_options")
    return Filled("vsh_volume_options", dict(own, shade=shade))


def _baked(occluders: Occluders, voxels: Voxels, structs: Any, count: int, filled: Filled, stats: Optional[Stats],
           run: Optional[Run]) -> Any:
    volume = place("vsh_volume")
    return call(lib.vsh_bake_volume, handle_of(occluders, Occluders, "occluders"), handle_of(voxels, Voxels, "voxels"), structs,
                count, filled.pointer, RUN, volume, ffi.NULL if stats is None else stats.struct, run=run,
                made=(lib.vsh_volume_free, volume))


def bake_volume_forecast(occluders: Occluders, voxels: Voxels, lights: Union[Light, Sequence[Light]] = (), *, run: Optional[Run] = None,
                         **options: Any) -> types.VolumeForecast:
    """What bake_volume() would take, of the same arguments: some of the blocks are shaded, from all over."""
    structs, count = lights_of(lights)
    found = ffi.new("vsh_volume_forecast *")
    call(lib.vsh_bake_volume_forecast_sized, handle_of(occluders, Occluders, "occluders"), handle_of(voxels, Voxels, "voxels"), structs,
         count, _options(options).pointer, RUN, found, ffi.sizeof("vsh_volume_forecast"), run=run)
    return told(found[0], "vsh_volume_forecast")


def volume_shards(voxels: float, light_count: int, least: float, shard_count: int, **options: Any) -> int:
    """How many of `shard_count` shards should have voxels (`working` of bake_volume_part()): as many, 1 at least, as have `least`
    seconds of one thread's work each, as far as the number of voxels, lights, AO and max_error tell. 0 or less: all.

    Parameters
    ----------
    **options
        as of bake_volume()
    """
    return int(lib.vsh_volume_shards(voxels, light_count, _options(options).pointer, least, shard_count))


def bake_volume_part(occluders: Optional[Occluders], voxels: Optional[Voxels], lights: Union[Light, Sequence[Light]] = (), *,
                     parts: "str | os.PathLike[str]", shard: int, shard_count: int, working: int = 0,
                     attributes: Optional[Attributes] = None, words: Sequence[str] = (), stats: Optional[Stats] = None,
                     run: Optional[Run] = None, **options: Any) -> None:
    """Shades a part of voxels, as much work as any other, and writes it to the file PARTS.SHARD-of-COUNT.part, whole or not
    at all: for volume_merge(), on whatever machine.

    Parameters
    ----------
    parts : path
        what the names of the parts' files begin with
    shard, shard_count : int
        which part, 1 … shard_count, of how many, 1 … 10000
    working : int
        how many of them, the first ones, have voxels (volume_shards()), the same for all parts; 0: all. A shard behind these takes
        None for occluders and voxels, too
    attributes : mapping, optional
        lines of text that the output will carry: the same for all parts, and for their merge
    words : sequence of str, optional
        kept as they are (part_words())
    **options
        as of bake_volume()
    """
    structs, count = lights_of(lights)
    part = part_options(parts, shard, shard_count, attributes, words, working)
    casters = ffi.NULL if occluders is None else handle_of(occluders, Occluders, "occluders")
    shaded = ffi.NULL if voxels is None else handle_of(voxels, Voxels, "voxels")
    call(lib.vsh_bake_volume_part, casters, shaded, structs, count,
         _options(options).pointer, part.pointer, RUN, ffi.NULL if stats is None else stats.struct, run=run)


def volume_merge(voxels: Voxels, lights: Union[Light, Sequence[Light]] = (), *, parts: "str | os.PathLike[str]", shard_count: int = 0,
                 attributes: Optional[Attributes] = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
                 **options: Any) -> Volume:
    """Puts the parts of all shards together, which were baked of these voxels, lights, attributes and options: the same volume
    as bake_volume() makes, bit by bit. `shard_count` 0: as many as there are beside `parts`."""
    structs, count = lights_of(lights)
    part, volume = part_options(parts, 0, shard_count, attributes), place("vsh_volume")
    return Volume(call(lib.vsh_volume_merge, handle_of(voxels, Voxels, "voxels"), structs, count, _options(options).pointer, part.pointer,
                       RUN, volume, ffi.NULL if stats is None else stats.struct, run=run, made=(lib.vsh_volume_free, volume)))


def volume_part_casters(parts: "str | os.PathLike[str]", shard_count: int = 0, *, run: Optional[Run] = None) -> types.OccludersInfo:
    """What cast in the first part that is there, of `shard_count` shards (0: as many as there are)."""
    found = ffi.new("vsh_occluders_info *")
    call(lib.vsh_volume_part_casters_sized, path_of(parts, "parts"), shard_count, RUN, found, ffi.sizeof("vsh_occluders_info"), run=run)
    return told(found[0], "vsh_occluders_info")


__all__ = ["Volume", "Voxels", "bake_volume", "bake_volume_forecast", "bake_volume_part", "volume_merge", "volume_part_casters", "volume_shards"]
