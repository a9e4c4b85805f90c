"""Lightmaps: the texels of a receiver's charts, shaded into arrays."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy

from . import types
from ._arrays import borrowed, output, pointer, vector
from ._library import RUN, Handle, Run, call, ffi, handle_of, lib, make, place
from ._structs import Filled, constant, info, split, told
from ._image import image_write
from ._light import Light, lights_of
from ._mesh import Meshes, meshes_of
from ._occluders import Occluders
from ._points import tint_of

if TYPE_CHECKING:
    from typing_extensions import Unpack


def _lightmap_options(options: Dict[str, Any]) -> Filled:
    own, shade = split(options, "vsh_lightmap_options", "vsh_shade_options")
    return Filled("vsh_lightmap_options", dict(own, shade=shade))


def charts_closeness(meshes: Meshes, width: int, height: int, *, run: Optional[Run] = None) -> types.Closeness:
    """How close to each other the charts of a lightmap of this size (texels) lie."""
    structs, count, _ = meshes_of(meshes)
    found = ffi.new("vsh_closeness *")
    call(lib.vsh_charts_closeness, structs, count, width, height, RUN, found, run=run)
    return told(found[0], "vsh_closeness")


class Texels(Handle):
    """Where each texel of a lightmap lies in the world, by Charts.texels()."""

    @property
    def samples(self) -> Dict[str, numpy.ndarray]:
        """The samples, tile by tile, as views: "positions" float64 (n, 3), "normals" and "geometric_normals" float32 (n, 3),
        "texels" uint32 (n,)."""
        found = ffi.new("vsh_texel_samples *")
        found[0] = lib.vsh_texels_samples(self.handle)
        n, owner = found.count, self.handle
        return dict(positions=borrowed(found.positions, (n, 3), numpy.float64, owner),
                    normals=borrowed(found.normals, (n, 3), numpy.float32, owner),
                    geometric_normals=borrowed(found.geometric_normals, (n, 3), numpy.float32, owner),
                    texels=borrowed(found.texels, (n,), numpy.uint32, owner))


class Charts(Handle):
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

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None, **options: Any) -> None:
        structs, count, keeps = meshes_of(meshes)
        reports = ffi.new("vsh_uv_report[]", max(count, 1))
        self._begin(make(_freeing(lib.vsh_charts_free, (structs, keeps)), lib.vsh_charts_create, structs, count,
                         _lightmap_options(options).pointer, RUN, reports, place("vsh_charts"), run=run),
                    count)
        #: what is wrong with the UVs, mesh by mesh
        self.uv_reports: List[types.UvReport] = [told(reports[i], "vsh_uv_report") for i in range(count)]

    def _begin(self, cdata: Any, mesh_count: int) -> None:
        Handle.__init__(self, cdata)
        self.shape: Tuple[int, int] = (self.info.height, self.info.width)
        self.mesh_count = mesh_count

    @property
    def info(self) -> types.ChartsInfo:
        return info(lib.vsh_charts_get_info, "vsh_charts_info", self.handle)

    def texels(self, *, run: Optional[Run] = None) -> Texels:
        """Where each texel lies in the world."""
        return Texels(make(lib.vsh_texels_free, lib.vsh_texels_create, self.handle, RUN, place("vsh_texels"), run=run))


def _freeing(free: Any, keeps: Any) -> Any:
    def freed(cdata: Any, keeps: Any = keeps) -> None:  # what it refers to lives until then
        free(cdata)
    return freed


class Planes(Dict[str, numpy.ndarray]):
    """Planes of an image by their channels' names."""

    def write(self, path: "str | os.PathLike[str]", **options: Any) -> None:
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


class _Planes:
    """``vsh_lightmap`` and the arrays that it points to."""

    def __init__(self, shape: Tuple[int, int], names: Sequence[str], out: Optional[Mapping[str, numpy.ndarray]], *, ao: bool = False,
                 irradiance: bool = False, bent: Optional[str] = None, sky: Optional[str] = None, error: bool = False,
                 invalid: bool = False, tint: Any = None, ambient: Any = None, shadow: bool = True) -> None:
        wanted: Dict[str, Tuple[int, ...]] = {}
        threes = (*shape, 3)
        lights = [n for n in names if shadow]
        wanted.update({f"shadow.{n}": shape for n in lights})
        wanted.update({f"tint.{n}": threes for n in lights if tint is not None})
        wanted.update({f"error.{n}": shape for n in lights if error})
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
        self.keeps: list = []
        struct = self.struct = ffi.new("vsh_lightmap *")
        for member, kind in (("shadow", "shadow"), ("tint", "tint"), ("shadow_error", "error")):
            planes = [pointer(self.arrays[f"{kind}.{n}"]) for n in names if f"{kind}.{n}" in self.arrays]
            if planes:
                self.keeps.append(ffi.new("float *[]", planes))
                setattr(struct, member, self.keeps[-1])
        for member, kind in (("ao", "ao"), ("ao_error", "error.ao"), ("irradiance", "irradiance"), ("coverage", "A"),
                             ("bent", "bent"), ("sky", "sky"), ("invalid", "invalid")):
            if kind in self.arrays:
                setattr(struct, member, pointer(self.arrays[kind]))
        if tint is not None:
            struct.tint_by = tint_of(tint).pointer[0]
        if ambient is not None:
            self.keeps.append(vector(ambient, 3, "ambient"))
            struct.ambient = self.keeps[-1]
        if bent is not None:
            struct.bent_space = constant("VSH_BENT_", bent, "bent")
        struct.asked.invalid = bool(invalid)
        if sky is not None:
            struct.asked.sky = constant("VSH_UP_", sky, "sky")


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
    target = handle_of(charts, Charts, "charts")
    planes = _Planes(charts.shape, names, out, ao=ao, irradiance=irradiance, bent=bent, sky=sky, error=error, invalid=invalid,
                     tint=tint, ambient=ambient)
    stats = Filled("vsh_bake_stats")
    errors = ffi.new("vsh_bake_error[]", count + 2)
    by_mesh = ffi.new("uint64_t[]", max(charts.mesh_count, 1))
    stats.pointer.errors, stats.pointer.invalid_by_mesh = errors, by_mesh
    shade = Filled("vsh_shade_options", options).pointer if options else ffi.NULL
    call(lib.vsh_bake_lightmap, handle_of(occluders, Occluders, "occluders"), target, structs, count, shade, RUN, planes.struct,
         stats.pointer, run=run)
    lightmap = Lightmap(planes.arrays)
    lightmap.stats = told(stats.pointer[0], "vsh_bake_stats")
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
    names = _shadows(lightmap)
    planes = _given(charts.shape, names, lightmap)
    report = ffi.new("vsh_stitch_report *")
    call(lib.vsh_lightmap_stitch, handle_of(charts, Charts, "charts"), planes.struct, len(names),
         Filled("vsh_stitch_options", options).pointer, RUN, report, run=run)
    return told(report[0], "vsh_stitch_report")


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
    structs = ffi.new("vsh_stitch_page[]", max(len(pages), 1))
    names = _shadows(pages[0][1]) if pages else []
    keeps: list = []
    for i, (charts, lightmap) in enumerate(pages):
        if set(lightmap) != set(pages[0][1]):
            raise ValueError(f"pages: number {i} has planes {', '.join(sorted(lightmap))}, the first {', '.join(sorted(pages[0][1]))}")
        keeps += [handle_of(charts, Charts, "charts"), _given(charts.shape, names, lightmap)]
        structs[i].charts, structs[i].lightmap = keeps[-2], keeps[-1].struct
    report = ffi.new("vsh_stitch_report *")
    call(lib.vsh_lightmaps_stitch, structs, len(pages), len(names), Filled("vsh_stitch_options", options).pointer, RUN, report, run=run)
    return told(report[0], "vsh_stitch_report")


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
    target = handle_of(charts, Charts, "charts")
    planes = _given(charts.shape, names, lightmap, bent)
    filled = ffi.new("uint64_t *")
    call(lib.vsh_lightmap_fill_hidden, target, planes.struct, len(names), RUN, filled, run=run)
    return filled[0]


__all__ = ["Charts", "Lightmap", "Texels", "bake_lightmap", "charts_closeness", "lightmap_fill_hidden", "lightmap_stitch",
           "lightmaps_stitch"]
