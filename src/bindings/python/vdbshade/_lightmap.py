"""Lightmaps and volumes: a receiver's charts shaded into arrays, and voxels shaded into sparse grids."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, output, pointer, vector
from ._calls import OUT, Handle, Run, Several, ask, call
from ._grid import Attributes, Grid, attributes_of, dense
from ._image import image_write
from ._library import Path, Unpack, ffi, lib
from ._light import Light, lights_of
from ._mesh import Meshes, meshes_of
from ._occluders import Occluders
from ._points import Stats, tint_of
from ._structs import Filled, Struct, constant, keep, path_of, split, struct_of, structs_of, told


def _lightmap_options(options: Dict[str, Any]) -> Filled:
    own, shade = split(options, "vsh_lightmap_options", "vsh_shade_options")
    return Filled("vsh_lightmap_options", dict(own, shade=shade))


def _handle(charts: Any) -> Any:
    return struct_of(charts, ffi.typeof("vsh_charts"))


def charts_closeness(meshes: Meshes, width: int, height: int, *, run: Optional[Run] = None) -> types.Closeness:
    """How close to each other the charts of a lightmap of this size (texels) lie."""
    return call(lib.vsh_charts_closeness, *meshes_of(meshes), width, height, OUT, run=run)


class Texels(Handle, kind="vsh_texels"):
    """Where each texel of a lightmap lies in the world, by Charts.texels()."""

    @property
    def samples(self) -> Dict[str, numpy.ndarray]:
        """The samples, tile by tile, as views: "positions" float64 (n, 3), "normals" and "geometric_normals" float32 (n, 3),
        "texels" uint32 (n,)."""
        found = lib.vsh_texels_samples(self.handle)
        n, owner = found.count, self.handle
        return dict(positions=borrowed(found.positions, (n, 3), numpy.float64, owner),
                    normals=borrowed(found.normals, (n, 3), numpy.float32, owner),
                    geometric_normals=borrowed(found.geometric_normals, (n, 3), numpy.float32, owner),
                    texels=borrowed(found.texels, (n,), numpy.uint32, owner))


class Charts(Handle, kind="vsh_charts"):
    """The charts of a receiver at one size of lightmap. They keep the meshes' arrays.

    Parameters
    ----------
    meshes : Mesh, Model or sequence of Mesh
        with lightmap UVs
    width, height : int
        texels (1024)
    supersample : int
        N × N samples a texel
    padding : int or "auto"
        texels that charts are grown by
    **options
        vdbshade.types.LightmapOptions and ShadeOptions: what a bake is made by that is given no other
    """

    info: types.ChartsInfo

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None, **options: Any) -> None:
        structs, count = meshes_of(meshes)
        reports, charts = call(lib.vsh_charts_create, structs, count, _lightmap_options(options), Several(count), OUT, run=run, keeps=structs)
        self._begin(charts, count)
        #: what is wrong with the UVs, mesh by mesh
        self.uv_reports: List[types.UvReport] = reports

    def _begin(self, cdata: Any, mesh_count: int) -> None:
        Handle.__init__(self, cdata)
        self.shape: Tuple[int, int] = (self.info.height, self.info.width)
        self.mesh_count = mesh_count

    def texels(self, *, run: Optional[Run] = None) -> Texels:
        """Where each texel lies in the world."""
        return Texels(call(lib.vsh_texels_create, self, OUT, run=run))


class Planes(Dict[str, numpy.ndarray]):
    """Planes of an image by their channels' names."""

    def write(self, path: Path, **options: Any) -> None:
        """Writes them as an image; options of image_write()."""
        image_write(path, self, **options)


class Lightmap(Planes):
    """Planes of a lightmap by their names, as files name channels: arrays of float32 of shape (height, width), row 0 at
    v = 1; of "irradiance", "bent" and "tint.NAME" (height, width, 3).

    Attributes
    ----------
    stats : vdbshade.types.BakeStats
        counts of texels and of work
    errors : dict
        root mean square error that is estimated of "shadow.NAME", "ao" and "sky"; NaN where a method knows none
    field_errors : dict
        what of it rays don't account for: the voxels'
    """

    stats: types.BakeStats
    errors: Dict[str, float]
    field_errors: Dict[str, float]


class _Planes(Struct):
    """``vsh_lightmap`` and the arrays that it points to."""

    def __init__(self, shape: Tuple[int, int], names: Sequence[str], out: Optional[Mapping[str, numpy.ndarray]], *, ao: bool = False,
                 irradiance: bool = False, bent: Optional[str] = None, sky: Optional[str] = None, error: bool = False,
                 invalid: bool = False, tint: Any = None, ambient: Any = None) -> None:
        wanted: Dict[str, Tuple[int, ...]] = {}
        threes = (*shape, 3)
        wanted.update({f"shadow.{n}": shape for n in names})
        wanted.update({f"tint.{n}": threes for n in names if tint is not None})
        wanted.update({f"error.{n}": shape for n in names if error})
        for name, asked, size in (("ao", ao, shape), ("error.ao", ao and error, shape), ("irradiance", irradiance, threes),
                                  ("bent", bent, threes), ("sky", sky, shape), ("invalid", invalid, shape), ("A", True, shape)):
            if asked:
                wanted[name] = size
        if len(set(names)) != len(names):
            raise ValueError(f"lights: two of one name ({', '.join(names)})")
        unknown = set(out or {}) - set(wanted)
        if unknown:
            raise ValueError(f"out: {', '.join(sorted(unknown))}: not asked for; there are {', '.join(wanted)}")
        self.arrays = {n: output((out or {}).get(n), numpy.float32, size, f"out[{n!r}]") for n, size in wanted.items()}
        given: Dict[str, Any] = dict(asked=dict(invalid=bool(invalid), sky=sky))
        given["bent_space"] = None if bent is None else constant("VSH_BENT_", bent, "bent")
        given["tint_by"] = None if tint is None else tint_of(tint)
        given["ambient"] = None if ambient is None else vector(ambient, 3, "ambient")
        for member, kind in (("shadow", "shadow"), ("tint", "tint"), ("shadow_error", "error")):
            planes = [pointer(self.arrays[f"{kind}.{n}"]) for n in names if f"{kind}.{n}" in self.arrays]
            given[member] = keep(ffi.new("float *[]", planes), planes) if planes else None
        for member, kind in (("ao", "ao"), ("ao_error", "error.ao"), ("irradiance", "irradiance"), ("coverage", "A"),
                             ("bent", "bent"), ("sky", "sky"), ("invalid", "invalid")):
            given[member] = self.arrays.get(kind)
        self.struct = Filled("vsh_lightmap", given).struct


def _names(structs: Any, count: int) -> List[str]:
    return [ffi.string(structs[i].name).decode() for i in range(count)]


def bake_lightmap(occluders: Occluders, charts: Charts, lights: Union[Light, Sequence[Light]] = (), *, ao: bool = False,
                  irradiance: bool = False, bent: Optional[str] = None, sky: Optional[str] = None, error: bool = False,
                  invalid: bool = False, tint: "str | types.Tint | None" = None, ambient: Optional[Sequence[float]] = None,
                  out: Optional[Mapping[str, numpy.ndarray]] = None, run: Optional[Run] = None,
                  **options: "Unpack[types.ShadeOptions]") -> Lightmap:
    """Shades the texels of charts into planes: "shadow.NAME" of each light, "A" (1 where a texel is valid), and what is asked for.

    Parameters
    ----------
    lights : Light or sequence of Light
        no two of one name
    ao : bool
        AO within ``ao_distance``, world units
    irradiance : bool
        linear RGB; with `ambient` (linear RGB) light from all around
    bent : str, optional
        bent normals in "world" or "tangent" space (charts of ``tangents=True``)
    sky : str, optional
        the sky that is seen, of one that is up: "y", "-z"
    error : bool
        the standard error left in each shadow and AO value
    invalid : bool
        where texels are invalid
    tint : str or dict, optional
        "quadratic", or dict(type="power", power=(r, g, b))
    out : mapping, optional
        arrays of float32 that planes are written into, by their names; (height, width) or (height, width, 3)
    **options
        vdbshade.types.ShadeOptions; none: those that the charts were made with

    Returns
    -------
    Lightmap
    """
    structs, count = lights_of(lights)
    names = _names(structs, count)
    target = _handle(charts)
    planes = _Planes(charts.shape, names, out, ao=ao, irradiance=irradiance, bent=bent, sky=sky, error=error, invalid=invalid,
                     tint=tint, ambient=ambient)
    errors = ffi.new("vsh_bake_error[]", count + 2)
    by_mesh = ffi.new("uint64_t[]", max(charts.mesh_count, 1))
    stats = Filled("vsh_bake_stats", errors=errors, invalid_by_mesh=by_mesh)
    call(lib.vsh_bake_lightmap, occluders, target, structs, count, Filled("vsh_shade_options", options) if options else None, planes, stats,
         run=run)
    lightmap = Lightmap(planes.arrays)
    lightmap.stats = told(stats.struct)
    lightmap.stats.errors = None
    lightmap.stats.invalid_by_mesh = list(by_mesh)[: charts.mesh_count]
    kinds = [f"shadow.{n}" for n in names] + ["ao"] + (["sky"] if sky else [])
    lightmap.errors = {n: lib.vsh_bake_error_rmse(errors + i) for i, n in enumerate(kinds) if n in lightmap}
    lightmap.field_errors = {n: lib.vsh_bake_error_field(errors + i) for i, n in enumerate(kinds) if n in lightmap}
    return lightmap


def _shadows(lightmap: Mapping[str, numpy.ndarray]) -> List[str]:
    return [n[len("shadow.") :] for n in lightmap if n.startswith("shadow.")]


def _given(shape: Tuple[int, int], names: List[str], lightmap: Mapping[str, numpy.ndarray], bent: Optional[str] = None) -> _Planes:
    """The planes of a lightmap whose values are moved; those of `names` in their order."""
    given = {n: p for n, p in lightmap.items() if n.split(".")[0] in ("shadow", "tint", "ao", "irradiance", "sky", "A")}
    if bent is not None:
        given["bent"] = lightmap["bent"]
    tinted = any(n.startswith("tint.") for n in given)
    if "A" not in given:
        raise ValueError("lightmap: expected a plane 'A', its coverage")
    return _Planes(shape, names, given, ao="ao" in given, irradiance="irradiance" in given, bent=bent,
                   sky="y" if "sky" in given else None, tint="quadratic" if tinted else None)


def lightmap_stitch(charts: Charts, lightmap: Mapping[str, numpy.ndarray], *, run: Optional[Run] = None,
                    **options: "Unpack[types.StitchOptions]") -> types.StitchReport:
    """Makes the values on both sides of charts' borders agree, in a whole lightmap that was baked of these charts. Its arrays
    are written into."""
    return lightmaps_stitch([(charts, lightmap)], run=run, **options)


def lightmaps_stitch(pages: Sequence[Tuple[Charts, Mapping[str, numpy.ndarray]]], *, run: Optional[Run] = None,
                     **options: "Unpack[types.StitchOptions]") -> types.StitchReport:
    """As lightmap_stitch() of several lightmaps of any sizes, such as pages of one atlas: borders between them, too.

    Parameters
    ----------
    pages : sequence of (Charts, Lightmap)
        all of the same planes, whose arrays are written into
    **options
        vdbshade.types.StitchOptions
    """
    pages = list(pages)
    names = _shadows(pages[0][1]) if pages else []
    for i, (_, lightmap) in enumerate(pages):
        if set(lightmap) != set(pages[0][1]):
            raise ValueError(f"pages: number {i} has planes {', '.join(sorted(lightmap))}, the first {', '.join(sorted(pages[0][1]))}")
    structs = structs_of("vsh_stitch_page", [dict(charts=_handle(c), lightmap=_given(c.shape, names, lightmap)) for c, lightmap in pages])
    return call(lib.vsh_lightmaps_stitch, structs, len(pages), len(names), Filled("vsh_stitch_options", options), OUT, run=run)


def lightmap_fill_hidden(charts: Charts, lightmap: Mapping[str, numpy.ndarray], *, bent: Optional[str] = None,
                         run: Optional[Run] = None) -> int:
    """Gives texels that are not valid and that no valid one of their chart filled, as those of faces that touch each other, the
    values of the texel that is nearest in the world, and pads around them. The lightmap's arrays are written into.

    Parameters
    ----------
    charts : Charts
        that the lightmap was baked of
    bent : str, optional
        the space of a plane "bent"; None: it is left, as one in "tangent" space is

    Returns
    -------
    int
        how many texels were filled
    """
    names = _shadows(lightmap)
    return call(lib.vsh_lightmap_fill_hidden, _handle(charts), _given(charts.shape, names, lightmap, bent), len(names), OUT, run=run)


class Voxels(Handle, kind="vsh_voxels"):
    """Voxels that are to be shaded, and where they lie. Made by its ``from_…`` methods."""

    info: types.VoxelsInfo

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("Voxels are made by Voxels.from_grid(), from_box() or from_vdb()")

    @classmethod
    def from_grid(cls, grid: Grid, band: float = 0.0, *, run: Optional[Run] = None) -> "Voxels":
        """A level set's own narrow band, `band` voxels to both sides; 0: all of it."""
        return cls._of(call(lib.vsh_voxels_from_grid, grid, band, OUT, run=run))

    @classmethod
    def from_box(cls, box_min: Sequence[float], box_max: Sequence[float], voxel_size: float, *, run: Optional[Run] = None) -> "Voxels":
        """Cubes that cover a world box, world units."""
        return cls._of(call(lib.vsh_voxels_from_box, vector(box_min, 3, "box_min"), vector(box_max, 3, "box_max"), voxel_size, OUT, run=run))

    @classmethod
    def from_vdb(cls, path: Path, name: Optional[str] = None, *, run: Optional[Run] = None) -> "Voxels":
        """The active voxels of a grid of numbers in a .vdb file; `name` None: the first such grid."""
        return cls._of(call(lib.vsh_voxels_from_vdb, path_of(path, "path"), name, OUT, run=run))

    def centre(self, x: int, y: int, z: int) -> Tuple[float, ...]:
        """World position of a voxel's centre."""
        return ask(lib.vsh_voxels_centre, self, ffi.new("int32_t[3]", [x, y, z]), Several(3))


class Volume(Handle, kind="vsh_volume"):
    """Grids of a bake: "shadow.NAME", "ao", "error.NAME", "error.ao"."""

    info: types.VolumeInfo

    @property
    def grids(self) -> List[types.VolumeGrid]:
        """Names and values of its grids."""
        return [ask(lib.vsh_volume_get_grid, self, i, OUT) for i in range(self.info.grids)]

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
        call(lib.vsh_volume_sample, self, self._number(grid), len(at), at, values)
        return values

    def values(self, grid: Union[int, str], index_min: Sequence[int], shape: Sequence[int],
               out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
        """A dense copy: float32 of shape (depth, height, width) from voxel `index_min` (x, y, z) on; 1 where not active."""
        number = self._number(grid)
        return dense(None, index_min, shape, out, lambda *box: call(lib.vsh_volume_copy, self, number, *box))

    def write(self, path: Path, *, half: bool = False, attributes: Optional[Attributes] = None) -> None:
        """Writes all grids as one .vdb file, whole or not at all."""
        lines = attributes_of(attributes)
        call(lib.vsh_volume_write, self, path_of(path, "path"), half, structs_of("vsh_attribute", lines), len(lines))


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
    filled = Filled("vsh_volume_options", own, shade=shade)
    return Volume(call(lib.vsh_bake_volume, occluders, voxels, structs, count, filled, OUT, stats, run=run))
