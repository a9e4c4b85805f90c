"""Shadow and ambient occlusion at points; images; lightmaps, volumes and pictures."""
from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._core import (Array, array, ask, borrowed, call, constant, fail, ffi, Filled, Floats, Handle, keep, lib, OUT, output, pairs_of, Path,
                    path_of, pointer, record_of, Run, run_of, Several, split, Struct, struct_of, structs_of, text, texts_of,
                    Unpack, vector, words_of_bits)
from ._casters import (attribute_structs, Attributes, attributes_of, dense, Field, Grid, Light, lights_of, Meshes, meshes_of, names_of,
                       Occluders)

__all__ = ["Camera", "Charts", "Image", "Lightmap", "LitMeshes", "Picture", "Query", "Stats", "Volume", "Voxels",
           "ao_method_traits", "bake_lightmap", "bake_volume", "image_check", "image_read", "image_write", "lightmap_fill_hidden",
           "lightmaps_stitch", "render", "shade_ao", "shade_irradiance", "shade_shadow", "shadow_method_traits"]

# --- points


class Stats(Struct):
    """Sums up the work of the calls that get it (vdbshade.types.ShadeStats)."""

    KIND = "vsh_shade_stats"

    def __init__(self) -> None:
        self.struct = Filled(self.KIND).struct

    @property
    def told(self) -> types.ShadeStats:
        stats: types.ShadeStats = record_of(self.struct)
        return stats


def _points(positions: ArrayLike, normals: Optional[ArrayLike], texels: Optional[ArrayLike] = None) -> Tuple[Any, int]:
    at = array(positions, numpy.float64, (None, 3), "positions")
    up = None if normals is None else array(normals, numpy.float32, (len(at), 3), "normals")
    numbers = None if texels is None else array(texels, numpy.uint32, (len(at),), "texels")
    pointers = [pointer(at), pointer(up), pointer(numbers)]
    return keep(ffi.new("vsh_points *", [len(at)] + pointers), pointers), len(at)


def _written(out: Optional[Floats], shape: Tuple[int, ...], name: str) -> Optional[Floats]:
    """An array to be written into, checked; None if none was given."""
    return None if out is None else output(out, numpy.float32, shape, name)


def shade_shadow(occluders: Occluders, positions: ArrayLike, normals: Optional[ArrayLike], light: Light, *,
                 texels: Optional[ArrayLike] = None, out: Optional[Floats] = None,
                 error: Optional[Floats] = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
                 **options: "Unpack[types.ShadeOptions]") -> Floats:
    """Fraction of a light that each point sees, 0 dark … 1 lit: before any cosine, colour or falloff.

    Parameters
    ----------
    positions : array of float64, shape (n, 3)
        world units
    normals : array of float32, shape (n, 3), optional
        away from the solid, of any length; None: no horizon
    texels : array of uint32, shape (n,), optional
        column + 65536 row of each in a lightmap
    out, error : array of float32, shape (n,), optional
        arrays to write into: the values, and the standard error left in them
    **options
        vdbshade.types.ShadeOptions: method, max_error, rays, sampler, …

    Returns
    -------
    array of float32, shape (n,)
        NaN for invalid points
    """
    points, count = _points(positions, normals, texels)
    values = output(out, numpy.float32, (count,), "out")
    call(lib.vsh_shade_shadow, occluders, points, light, Filled("vsh_shade_options", options), values,
         _written(error, (count,), "error"), stats, run=run)
    return values


def shade_ao(occluders: Occluders, positions: ArrayLike, normals: ArrayLike, *, texels: Optional[ArrayLike] = None,
             out: Optional[Floats] = None, error: Optional[Floats] = None,
             bent: Optional[Floats] = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
             **options: "Unpack[types.ShadeOptions]") -> Floats:
    """Cosine-weighted fraction of the hemisphere that is free within ``ao_distance`` (world units), 0 … 1 open.

    Arguments as for shade_shadow(); `bent`, an array of float32 of shape (n, 3), receives bent normals: unit, world space.
    """
    points, count = _points(positions, numpy.asarray(normals), texels)
    values = output(out, numpy.float32, (count,), "out")
    call(lib.vsh_shade_ao, occluders, points, Filled("vsh_shade_options", options), values, _written(error, (count,), "error"),
         _written(bent, (count, 3), "bent"), stats, run=run)
    return values


def tint_of(tint: "types.TintType | types.Tint") -> Filled:
    """``vsh_tint`` of "quadratic" or dict(type="power", power=(r, g, b))."""
    return Filled("vsh_tint", dict(type=tint) if isinstance(tint, str) else tint)


def shade_irradiance(positions: ArrayLike, normals: ArrayLike, light: Light, visibility: ArrayLike,
                     out: Optional[Floats] = None) -> Floats:
    """Irradiance of one light, linear RGB, added to `out`, an array of float32 of shape (n, 3) (None: to zeros):
    visibility × colour × falloff × cosine."""
    points, count = _points(positions, numpy.asarray(normals))
    values = array(visibility, numpy.float32, (count,), "visibility")
    rgb = numpy.zeros((count, 3), numpy.float32) if out is None else output(out, numpy.float32, (count, 3), "out")
    call(lib.vsh_light_check, light)
    ask(lib.vsh_shade_irradiance, points, None, light, values, rgb)
    return rgb


_SMALL = 64  # points that vsh_query_points() shades on the calling thread, without progress
_FLOAT32 = numpy.dtype(numpy.float32)


class Query(Handle, kind="vsh_query"):
    """Occluders, lights and options, checked and prepared once for many calls.

    Parameters
    ----------
    occluders : Occluders
    lights : Light or sequence of Light
        none: AO only
    **options
        vdbshade.types.ShadeOptions
    """

    def __init__(self, occluders: Occluders, lights: Union[Light, Sequence[Light]] = (), **options: "Unpack[types.ShadeOptions]") -> None:
        structs, count = lights_of(lights)
        owner = struct_of(occluders, ffi.typeof("vsh_occluders"))
        super().__init__(call(lib.vsh_query_create, owner, structs, count, Filled("vsh_shade_options", options), OUT, keeps=owner))
        self.light_count = count
        self.names: List[str] = names_of(structs, count)

    def points(self, positions: ArrayLike, normals: Optional[ArrayLike] = None, *, shadow: bool = True, ao: bool = False,
               error: bool = False, distance: bool = False, gradient: bool = False, texels: Optional[ArrayLike] = None,
               out: Optional[Dict[str, Floats]] = None, stats: Optional[Stats] = None,
               run: Optional[Run] = None) -> Dict[str, Floats]:
        """Shades points.

        Parameters
        ----------
        positions : array of float64, shape (n, 3)
            world units
        normals : array of float32, shape (n, 3), optional
            needed for AO
        shadow, ao, error, distance, gradient : bool
            wanted values
        texels : array of uint32, shape (n,), optional
        out : dict of arrays, optional
            arrays to write into, as in the result; replaces the five above

        Returns
        -------
        dict
            of arrays of float32: "shadow" (lights, n), "ao" (n,), "distance" (n,), "gradient" (n, 3),
            "shadow_error" (lights, n), "ao_error" (n,)

        Notes
        -----
        Up to 64 points are shaded on the calling thread.
        """
        points, count = _points(positions, normals, texels)
        lights = self.light_count
        shapes = dict(shadow=(lights, count), shadow_error=(lights, count), ao=(count,), ao_error=(count,), distance=(count,),
                      gradient=(count, 3))
        if out is None:
            asked = dict(shadow=shadow and lights, shadow_error=shadow and lights and error, ao=ao, ao_error=ao and error,
                         distance=distance, gradient=gradient)
            out = {name: numpy.empty(shapes[name], _FLOAT32) for name, wanted in asked.items() if wanted}
        else:
            self._check(out, shapes)
        values, keeps = self._output(out, count)
        if count <= _SMALL:
            failure = ffi.new("vsh_error *")
            result = lib.vsh_query_points(self.handle, points, ffi.NULL, run_of(run).struct, values,
                                          ffi.NULL if stats is None else stats.struct, failure)
            if result != 0:
                fail(result, failure)
        else:
            call(lib.vsh_query_points, self, points, None, values, stats, run=run)
        del keeps
        return out

    def _check(self, out: Dict[str, Floats], shapes: Mapping[str, Tuple[int, ...]]) -> None:
        for name, values in out.items():
            if name not in shapes:
                raise ValueError(f"out: no value {name!r}; there are {', '.join(shapes)}")
            if values is None:
                raise TypeError(f"out[{name!r}]: expected an array")
            output(values, _FLOAT32, shapes[name], f"out[{name!r}]")

    def _output(self, out: Dict[str, Floats], count: int) -> Tuple[Any, Any]:
        values = ffi.new("vsh_query_output *")
        values.struct_size = _OUTPUT_SIZE
        keeps = []
        for name, array_of in out.items() if count else ():
            first = ffi.from_buffer("float[]", array_of, require_writable=True)
            keeps.append(first)
            if name not in ("shadow", "shadow_error"):
                setattr(values, name, first)
            elif self.light_count:
                planes = ffi.new("float *[]", [first + i * count for i in range(self.light_count)])
                keeps.append(planes)
                setattr(values, "visibility" if name == "shadow" else "shadow_error", planes)
        return values, keeps


_OUTPUT_SIZE = ffi.sizeof("vsh_query_output")


def shadow_method_traits(method: types.ShadowMethod) -> List[str]:
    """The traits of a shadow method: "rays", "keeps_error", "triangles", "inner"."""
    return words_of_bits("vsh_method_trait", lib.vsh_method_traits(lib.VSH_NAMES_SHADOW, constant("vsh_shadow_method", method, "method")))


def ao_method_traits(method: types.AoMethod) -> List[str]:
    """The traits of an AO method, like shadow_method_traits()."""
    return words_of_bits("vsh_method_trait", lib.vsh_method_traits(lib.VSH_NAMES_AO, constant("vsh_ao_method", method, "method")))


# --- image files: planes of floats with names


_AXES = {"irradiance": "RGB", "tint": "RGB", "bent": "XYZ"}
_HOLDS: Dict[str, types.ChannelKind] = {"irradiance": "light", "tint": "light", "bent": "vector"}


def _flat(channels: Mapping[str, ArrayLike]) -> Tuple[Dict[str, Array], Dict[str, types.ChannelKind]]:
    """Splits planes (height, width, 3) into channels, named as in files; and what channels hold."""
    planes: Dict[str, Array] = {}
    holds: Dict[str, types.ChannelKind] = {}
    for name, values in channels.items():
        found = numpy.asarray(values)
        kind = name.split(".")[0]
        if found.ndim == 3 and found.shape[2] == 3:
            for c, axis in enumerate(_AXES.get(kind, "RGB")):
                planes[f"{name}.{axis}"] = found[:, :, c]
                holds[f"{name}.{axis}"] = _HOLDS.get(kind, "data")
        else:
            planes[name] = found
            holds[name] = _HOLDS.get(kind, "data")
    return planes, holds


def _named(names: Sequence[str], shape: Tuple[int, int], holds: Optional[Mapping[str, types.ChannelKind]] = None) -> Filled:
    """``vsh_image`` of channels' names, without planes."""
    kinds = [constant("vsh_channel_kind", (holds or {}).get(n, _HOLDS.get(n.split(".")[0], "data")), "holds") for n in names]
    return Filled("vsh_image", width=shape[1], height=shape[0], channel_count=len(names), names=texts_of(list(names), "names"),
                  holds=ffi.new("vsh_channel_kind[]", kinds or 1))


def image_of(channels: Mapping[str, ArrayLike], holds: Optional[Mapping[str, types.ChannelKind]] = None) -> Filled:
    """``vsh_image`` of channels by their names."""
    planes, kinds = _flat(channels)
    kinds.update(holds or {})
    shape: Any = next((plane.shape for plane in planes.values()), (0, 0))
    if len(shape) != 2:
        raise ValueError(f"channel {next(iter(planes))!r}: expected shape (height, width) or (height, width, 3), got {shape}")
    if max(shape) >= 2**31:
        raise ValueError(f"an image of {shape[1]} × {shape[0]}: too large")
    pointers = [pointer(array(plane, numpy.float32, shape, f"channel {name!r}")) for name, plane in planes.items()]
    image = _named(list(planes), shape, kinds)
    image.fill(dict(planes=keep(ffi.new("float *[]", pointers or 1), pointers)))
    return image


class Image(Dict[str, Floats]):
    """Planes of an image file by their names: arrays of float32 of shape (height, width), row 0 on top, views.

    Attributes
    ----------
    attributes : dict
        lines of text that the file carries
    """

    attributes: Dict[str, str]


def image_read(path: Path, *, run: Optional[Run] = None) -> Image:
    """Reads an image; integers become 0 … 1 as they stand."""
    file = call(lib.vsh_image_read, path_of(path, "path"), OUT, run=run)
    view = lib.vsh_image_view(file)
    image = Image()
    for i in range(view.channel_count):
        image[text(view.names[i]) or ""] = borrowed(view.planes[i], (view.height, view.width), numpy.float32, file)
    count = ffi.new("size_t *")
    attributes = lib.vsh_image_attributes(file, count)
    image.attributes = pairs_of(attributes, count[0])
    return image


def _options(options: Any, attributes: Optional[Attributes]) -> Filled:
    return Filled("vsh_image_options", options, attributes=attributes_of(attributes))


def image_write(path: Path, channels: Mapping[str, ArrayLike], *, holds: Optional[Mapping[str, types.ChannelKind]] = None,
                attributes: Optional[Attributes] = None, **options: "Unpack[types.ImageOptions]") -> None:
    """Writes an image, whole or not at all; the path's ending is the format (docs/formats.md).

    Parameters
    ----------
    channels : mapping
        arrays of float32 by their names: shape (height, width), row 0 on top; of (height, width, 3) each axis is a
        channel, "irradiance.R"
    holds : mapping, optional
        kinds of channels: "data", "light", "vector"
    attributes : mapping, optional
        lines of text
    **options
        vdbshade.types.ImageOptions: bits, pack, color_space
    """
    call(lib.vsh_image_write, path_of(path, "path"), image_of(channels, holds), _options(options, attributes))


def image_check(path: Path, names: Sequence[str], shape: Tuple[int, int], *,
                attributes: Optional[Attributes] = None, **options: "Unpack[types.ImageOptions]") -> None:
    """Checks whether such an image could be written."""
    call(lib.vsh_image_check, path_of(path, "path"), _named(names, shape), _options(options, attributes))


# --- lightmaps and volumes


def _lightmap_options(options: Mapping[str, Any]) -> Filled:
    own, shade = split(options, "vsh_lightmap_options", "vsh_shade_options")
    return Filled("vsh_lightmap_options", dict(own, shade=shade))


def _handle(charts: Any) -> Any:
    return struct_of(charts, ffi.typeof("vsh_charts"))


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
        vdbshade.types.LightmapOptions and ShadeOptions, the defaults of bakes
    """

    info: types.ChartsInfo

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None, **options: "Unpack[types.ChartsKeywords]") -> None:
        structs, count = meshes_of(meshes)
        reports, charts = call(lib.vsh_charts_create, structs, count, _lightmap_options(options), Several(count), OUT, run=run, keeps=structs)
        self._begin(charts, count)
        #: problems of the UVs of each mesh
        self.uv_reports: List[types.UvReport] = reports

    def _begin(self, cdata: Any, mesh_count: int) -> None:
        Handle.__init__(self, cdata)
        self.shape: Tuple[int, int] = (self.info.height, self.info.width)
        self.mesh_count = mesh_count


class Planes(Dict[str, Floats]):
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
        estimated root mean square error of "shadow.NAME", "ao" and "sky"; NaN where a method knows none
    field_errors : dict
        the part of it that voxels make
    """

    stats: types.BakeStats
    errors: Dict[str, float]
    field_errors: Dict[str, float]


class _Planes(Struct):
    """``vsh_lightmap`` and the arrays that it points to."""

    def __init__(self, shape: Tuple[int, int], names: Sequence[str], out: Optional[Mapping[str, Floats]], *, ao: bool = False,
                 irradiance: bool = False, bent: Optional[types.BentSpace] = None, sky: Optional[types.Up] = None, error: bool = False,
                 invalid: bool = False, tint: "types.TintType | types.Tint | None" = None, ambient: Any = None) -> None:
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
        given["bent_space"] = None if bent is None else constant("vsh_bent_space", bent, "bent")
        given["tint_by"] = None if tint is None else tint_of(tint)
        given["ambient"] = None if ambient is None else vector(ambient, 3, "ambient")
        for member, kind in (("shadow", "shadow"), ("tint", "tint"), ("shadow_error", "error")):
            planes = [pointer(self.arrays[f"{kind}.{n}"]) for n in names if f"{kind}.{n}" in self.arrays]
            given[member] = keep(ffi.new("float *[]", planes), planes) if planes else None
        for member, kind in (("ao", "ao"), ("ao_error", "error.ao"), ("irradiance", "irradiance"), ("coverage", "A"),
                             ("bent", "bent"), ("sky", "sky"), ("invalid", "invalid")):
            given[member] = self.arrays.get(kind)
        self.struct = Filled("vsh_lightmap", given).struct


def _error_of(error: Any) -> Tuple[float, float]:
    """vsh_bake_error_rmse() and vsh_bake_error_field(), which are inline."""
    if not error.values > 0.0:
        return math.nan, math.nan
    rays = error.square_error / error.values
    if not error.compared > 0.0:
        return math.sqrt(rays), math.nan
    measured = error.compared_square_error / error.compared
    return math.sqrt(max(rays, measured)), math.sqrt(max(measured - rays, 0.0))


def bake_lightmap(occluders: Occluders, charts: Charts, lights: Union[Light, Sequence[Light]] = (), *, ao: bool = False,
                  irradiance: bool = False, bent: Optional[types.BentSpace] = None, sky: Optional[types.Up] = None, error: bool = False,
                  invalid: bool = False, tint: "types.TintType | types.Tint | None" = None, ambient: Optional[Sequence[float]] = None,
                  out: Optional[Mapping[str, Floats]] = None, run: Optional[Run] = None,
                  **options: "Unpack[types.ShadeOptions]") -> Lightmap:
    """Shades the texels of charts into planes: "shadow.NAME" of each light, "A" (1 where a texel is valid), and those of the options.

    Parameters
    ----------
    lights : Light or sequence of Light
        no two with the same name
    ao : bool
        AO within ``ao_distance``, world units
    irradiance : bool
        linear RGB; with `ambient` (linear RGB) light from all around
    bent : str, optional
        bent normals in "world" or "tangent" space (charts of ``tangents=True``)
    sky : str, optional
        the visible sky, above this axis: "y", "-z"
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
    names = names_of(structs, count)
    target = _handle(charts)
    planes = _Planes(charts.shape, names, out, ao=ao, irradiance=irradiance, bent=bent, sky=sky, error=error, invalid=invalid,
                     tint=tint, ambient=ambient)
    errors = ffi.new("vsh_bake_error[]", count + 2)
    by_mesh = ffi.new("uint64_t[]", max(charts.mesh_count, 1))
    stats = Filled("vsh_bake_stats", errors=errors, invalid_by_mesh=by_mesh)
    call(lib.vsh_bake_lightmap, occluders, target, structs, count, Filled("vsh_shade_options", options) if options else None, planes, stats,
         run=run)
    lightmap = Lightmap(planes.arrays)
    lightmap.stats = record_of(stats.struct)
    lightmap.stats.errors = None
    lightmap.stats.invalid_by_mesh = list(by_mesh)[: charts.mesh_count]
    kinds = [f"shadow.{n}" for n in names] + ["ao"] + (["sky"] if sky else [])
    found = {n: _error_of(errors[i]) for i, n in enumerate(kinds) if n in lightmap}
    lightmap.errors = {n: both[0] for n, both in found.items()}
    lightmap.field_errors = {n: both[1] for n, both in found.items()}
    return lightmap


def _shadows(lightmap: Mapping[str, Floats]) -> List[str]:
    return [n[len("shadow.") :] for n in lightmap if n.startswith("shadow.")]


def _given(shape: Tuple[int, int], names: List[str], lightmap: Mapping[str, Floats], bent: Optional[types.BentSpace] = None) -> _Planes:
    """The planes of a lightmap whose values are moved; those of `names` in their order."""
    given = {n: p for n, p in lightmap.items() if n.split(".")[0] in ("shadow", "tint", "ao", "irradiance", "sky", "A")}
    if bent is not None:
        given["bent"] = lightmap["bent"]
    tinted = any(n.startswith("tint.") for n in given)
    if "A" not in given:
        raise ValueError("lightmap: expected a plane 'A', its coverage")
    return _Planes(shape, names, given, ao="ao" in given, irradiance="irradiance" in given, bent=bent,
                   sky="y" if "sky" in given else None, tint="quadratic" if tinted else None)


def lightmaps_stitch(pages: Sequence[Tuple[Charts, Mapping[str, Floats]]], *, run: Optional[Run] = None,
                     **options: "Unpack[types.StitchOptions]") -> types.StitchReport:
    """Makes the values on both sides of charts' borders agree, within and between lightmaps of any sizes, such as pages of one atlas.

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
    report: types.StitchReport = call(lib.vsh_lightmaps_stitch, structs, len(pages), len(names), Filled("vsh_stitch_options", options), OUT, run=run)
    return report


def lightmap_fill_hidden(charts: Charts, lightmap: Mapping[str, Floats], *, bent: Optional[types.BentSpace] = None,
                         run: Optional[Run] = None) -> int:
    """Fills invalid texels of charts that have no valid texel near, such as those of faces that touch each other. They get the value
    of the texel that is nearest in the world, and padding. Writes into the lightmap's arrays.

    Parameters
    ----------
    charts : Charts
        charts that the lightmap was baked for
    bent : str, optional
        the space of a plane "bent"; None or "tangent": it is left as it is

    Returns
    -------
    int
        how many texels were filled
    """
    names = _shadows(lightmap)
    return int(call(lib.vsh_lightmap_fill_hidden, _handle(charts), _given(charts.shape, names, lightmap, bent), len(names), OUT, run=run))


class Voxels(Handle, kind="vsh_voxels"):
    """Voxels to shade, and their places. Made by its ``from_…`` methods."""

    info: types.VoxelsInfo

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("Voxels are made by Voxels.from_grid(), from_box() or from_vdb()")

    @classmethod
    def from_grid(cls, grid: Grid, band: float = 0.0, *, run: Optional[Run] = None) -> "Voxels":
        """The voxels of a level set up to `band` voxels on both sides of its surface; 0: its whole narrow band."""
        return cls._of(call(lib.vsh_voxels_from_grid, grid, band, OUT, run=run))

    @classmethod
    def from_box(cls, box_min: Sequence[float], box_max: Sequence[float], voxel_size: float, *, run: Optional[Run] = None) -> "Voxels":
        """Cubes that cover a world box, world units."""
        return cls._of(call(lib.vsh_voxels_from_box, vector(box_min, 3, "box_min"), vector(box_max, 3, "box_max"), voxel_size, OUT, run=run))

    @classmethod
    def from_vdb(cls, path: Path, name: Optional[str] = None, *, run: Optional[Run] = None) -> "Voxels":
        """The active voxels of a grid of numbers in a .vdb file; `name` None: the first such grid."""
        return cls._of(call(lib.vsh_voxels_from_vdb, path_of(path, "path"), name, OUT, run=run))


class Volume(Handle, kind="vsh_volume"):
    """Grids of a bake: "shadow.NAME", "ao", "error.NAME", "error.ao"."""

    info: types.VolumeInfo

    @property
    def grids(self) -> List[types.VolumeGrid]:
        """Names and values of its grids."""
        return [ask(lib.vsh_volume_get_grid, self, i, OUT) for i in range(self.info.grids)]

    def _number(self, grid: Union[int, str]) -> int:
        if isinstance(grid, int):
            return grid if grid >= 0 else 2**32  # no such grid
        names = [g.name for g in self.grids]
        if grid not in names:
            raise KeyError(f"no grid {grid!r}; there are {', '.join(names)}")
        return names.index(grid)

    def values(self, grid: Union[int, str], index_min: Sequence[int], shape: Sequence[int],
               out: Optional[Floats] = None) -> Floats:
        """A dense copy: float32 of shape (depth, height, width) from voxel `index_min` (x, y, z) on; 1 where not active."""
        number = self._number(grid)
        return dense(None, index_min, shape, out, lambda *box: call(lib.vsh_volume_copy, self, number, *box))

    def write(self, path: Path, *, half: bool = False, attributes: Optional[Attributes] = None) -> None:
        """Writes all grids as one .vdb file, whole or not at all."""
        call(lib.vsh_volume_write, self, path_of(path, "path"), half, *attribute_structs(attributes))


def bake_volume(occluders: Occluders, voxels: Voxels, lights: Union[Light, Sequence[Light]] = (), *, stats: Optional[Stats] = None,
                run: Optional[Run] = None, **options: "Unpack[types.VolumeKeywords]") -> Volume:
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


# --- pictures


class Camera(Struct, kind="vsh_camera"):
    """A pinhole camera.

    Parameters
    ----------
    position, target, up : three floats
        world units
    fov : float
        angle over the picture's height, radians
    """

    def __init__(self, **options: "Unpack[types.Camera]") -> None:
        self.struct = Filled("vsh_camera", options).struct
        call(lib.vsh_camera_orbit, self, 0.0)

    def frame(self, bounds_min: ArrayLike, bounds_max: ArrayLike, azimuth: float = 0.5, elevation: float = 0.5,
              aspect: float = 16 / 9) -> "Camera":
        """Moves it so that it sees a whole world box; angles in radians, `aspect` is width over height."""
        call(lib.vsh_camera_frame, self, vector(bounds_min, 3, "bounds_min"), vector(bounds_max, 3, "bounds_max"), azimuth, elevation, aspect)
        return self

    def frame_points(self, points: ArrayLike, azimuth: float = 0.5, elevation: float = 0.5, aspect: float = 16 / 9) -> "Camera":
        """Moves it as near to points (n, 3) as it can while it sees all of them."""
        at = array(points, numpy.float64, (None, 3), "points")
        call(lib.vsh_camera_frame_points, self, len(at), at, azimuth, elevation, aspect)
        return self

    def orbit(self, angle: float) -> "Camera":
        """Turns it around its target, radians."""
        call(lib.vsh_camera_orbit, self, angle)
        return self


class LitMeshes(Struct, kind="vsh_lit_meshes"):
    """Meshes to show.

    Parameters
    ----------
    meshes : Mesh, Model or sequence of Mesh
    lightmap : mapping, optional
        planes of a bake on them; None: each point is shaded
    color : three floats
    ambient : bool
        its irradiance includes the sky's light
    """

    def __init__(self, meshes: Meshes, lightmap: Optional[Mapping[str, ArrayLike]] = None, color: Sequence[float] = (0.7, 0.7, 0.7),
                 ambient: bool = False) -> None:
        structs, count = meshes_of(meshes)
        self.struct = Filled("vsh_lit_meshes", color=color, ambient=ambient, meshes=structs, mesh_count=count,
                             lightmap=None if lightmap is None else image_of(lightmap)).struct


class Picture(Dict[str, Floats]):
    """Planes of float32, row 0 on top: "color" (height, width, 3) linear RGB, "alpha", "depth" (height, width), "normal"
    (height, width, 3)."""

    def encode(self, exposure: float = 0.0, alpha: bool = False) -> Floats:
        """For files of 8 bits: float32 of shape (height, width, 3 or 4), 0 … 1, through the sRGB curve."""
        height, width = self["alpha"].shape
        planes = [numpy.empty((height, width), numpy.float32) for _ in range(4 if alpha else 3)]
        call(lib.vsh_picture_encode, Filled("vsh_picture", {n: self[n] for n in ("color", "alpha", "depth", "normal")}), width, height, exposure,
             ffi.new("float *[3]", [pointer(p) for p in planes[:3]]), planes[3] if alpha else None)
        return numpy.stack(planes, axis=2)


def render(surfaces: "Sequence[Union[Field, Tuple[Field, Sequence[float]]]]", occluders: Occluders,
           lights: Union[Light, Sequence[Light]] = (), *, camera: Optional[Camera] = None, lit: Sequence[LitMeshes] = (),
           tint: "types.TintType | types.Tint | None" = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
           **options: "Unpack[types.RenderKeywords]") -> Picture:
    """Renders a picture.

    Parameters
    ----------
    surfaces : sequence
        fields, or pairs of a field and its colour
    **options
        vdbshade.types.RenderOptions: width, height, samples, sky, background, ao, shafts; and ShadeOptions
    """
    own, shade = split(options, "vsh_render_options", "vsh_shade_options")
    filled = Filled("vsh_render_options", own, shade=shade, camera=camera, lit=lit, tint=None if tint is None else tint_of(tint))
    pairs = [s if isinstance(s, tuple) else (s, (0.7, 0.7, 0.7)) for s in surfaces]
    fields = structs_of("vsh_surface", [dict(field=field, color=color) for field, color in pairs])
    shape = (filled.struct.height, filled.struct.width)
    if not all(0 <= n <= 16384 for n in shape):
        shape = (0, 0)  # refused by the library, which says why
    sizes = dict(color=(*shape, 3), alpha=shape, depth=shape, normal=(*shape, 3))
    picture = Picture({name: numpy.empty(size, numpy.float32) for name, size in sizes.items()})
    call(lib.vsh_render, fields, len(pairs), occluders, *lights_of(lights), filled, Filled("vsh_picture", picture), stats, run=run)
    return picture
