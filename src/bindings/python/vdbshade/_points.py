"""Shadow and ambient occlusion at points."""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, output, pointer
from ._calls import OUT, Handle, Run, ask, call, run_of
from ._library import Unpack, fail, ffi, lib
from ._light import Light, lights_of
from ._occluders import Occluders
from ._structs import Filled, Struct, constant, keep, struct_of, told, word, words_of_bits


class Stats(Struct):
    """Work that was done, added up over the calls that it was given to (vdbshade.types.ShadeStats)."""

    KIND = "vsh_shade_stats"

    def __init__(self) -> None:
        self.struct = Filled(self.KIND).struct

    @property
    def told(self) -> types.ShadeStats:
        return told(self.struct)


def _points(positions: ArrayLike, normals: Optional[ArrayLike], texels: Optional[ArrayLike] = None) -> Tuple[Any, int]:
    at = array(positions, numpy.float64, (None, 3), "positions")
    up = None if normals is None else array(normals, numpy.float32, (len(at), 3), "normals")
    numbers = None if texels is None else array(texels, numpy.uint32, (len(at),), "texels")
    pointers = [pointer(at), pointer(up), pointer(numbers)]
    return keep(ffi.new("vsh_points *", [len(at)] + pointers), pointers), len(at)


def _written(out: Optional[numpy.ndarray], shape: Tuple[int, ...], name: str) -> Optional[numpy.ndarray]:
    """An array to be written into, checked; None if none was given."""
    return None if out is None else output(out, numpy.float32, shape, name)


def shade_shadow(occluders: Occluders, positions: ArrayLike, normals: Optional[ArrayLike], light: Light, *,
                 texels: Optional[ArrayLike] = None, out: Optional[numpy.ndarray] = None,
                 deviation: Optional[numpy.ndarray] = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
                 **options: "Unpack[types.ShadeOptions]") -> numpy.ndarray:
    """Fraction of a light that each point sees, 0 dark … 1 lit: before any cosine, colour or falloff.

    Parameters
    ----------
    positions : array of float64, shape (n, 3)
        world units
    normals : array of float32, shape (n, 3), optional
        away from the solid, of any length; None: no horizon
    texels : array of uint32, shape (n,), optional
        column + 65536 row of each in a lightmap
    out, deviation : array of float32, shape (n,), optional
        to be written into: the values, and the standard error left in them
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
         _written(deviation, (count,), "deviation"), stats, run=run)
    return values


def shade_ao(occluders: Occluders, positions: ArrayLike, normals: ArrayLike, *, texels: Optional[ArrayLike] = None,
             out: Optional[numpy.ndarray] = None, deviation: Optional[numpy.ndarray] = None,
             bent: Optional[numpy.ndarray] = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
             **options: "Unpack[types.ShadeOptions]") -> numpy.ndarray:
    """Cosine-weighted fraction of the hemisphere that is free within ``ao_distance`` (world units), 0 … 1 open.

    Arguments as of shade_shadow(); `bent`, an array of float32 of shape (n, 3), takes bent normals: unit, world space.
    """
    points, count = _points(positions, numpy.asarray(normals), texels)
    values = output(out, numpy.float32, (count,), "out")
    call(lib.vsh_shade_ao, occluders, points, Filled("vsh_shade_options", options), values, _written(deviation, (count,), "deviation"),
         _written(bent, (count, 3), "bent"), stats, run=run)
    return values


def tint_of(tint: "str | dict | types.Tint") -> Filled:
    """``vsh_tint`` of "quadratic" or dict(type="power", power=(r, g, b)), checked."""
    filled = Filled("vsh_tint", dict(type=tint) if isinstance(tint, str) else tint)
    call(lib.vsh_tint_check, filled)
    return filled


def shade_tint(visibility: ArrayLike, tint: "str | types.Tint", out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
    """Tinted visibility, linear RGB: float32 (n,) to float32 (n, 3)."""
    values = array(visibility, numpy.float32, (None,), "visibility")
    rgb = output(out, numpy.float32, (len(values), 3), "out")
    ask(lib.vsh_shade_tint, len(values), values, tint_of(tint), rgb)
    return rgb


def shade_irradiance(positions: ArrayLike, normals: ArrayLike, light: Light, visibility: ArrayLike,
                     out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
    """Irradiance of one light, linear RGB, added to `out`, an array of float32 of shape (n, 3) (None: to zeros):
    visibility × colour × falloff × cosine."""
    points, count = _points(positions, numpy.asarray(normals))
    values = array(visibility, numpy.float32, (count,), "visibility")
    rgb = numpy.zeros((count, 3), numpy.float32) if out is None else output(out, numpy.float32, (count, 3), "out")
    call(lib.vsh_light_check, light)
    ask(lib.vsh_shade_irradiance, points, None, light, values, rgb)
    return rgb


_SMALL = 64  # points that vsh_query_points() shades on the calling thread, without progress
_FLOAT32: numpy.dtype = numpy.dtype(numpy.float32)
_FLOAT64: numpy.dtype = numpy.dtype(numpy.float64)
_UINT32: numpy.dtype = numpy.dtype(numpy.uint32)


def _rows(given: Any, kind: numpy.dtype, columns: int, name: str) -> Tuple[numpy.ndarray, int]:
    """Rows of a query as they are in memory, and how far apart; a copy where they cannot be read so."""
    found = given if isinstance(given, numpy.ndarray) else numpy.asarray(given)
    shape = (None, columns) if columns > 1 else (None,)
    size = kind.itemsize
    if found.dtype == kind and found.ndim == len(shape) and (columns == 1 or found.shape[1] == columns):
        if found.flags.c_contiguous and found.flags.aligned:
            return found, 0
        stride = found.strides[0]
        inner = columns == 1 or found.strides[1] == size
        if len(found) > 1 and inner and stride >= columns * size and stride % size == 0 and found.flags.aligned:
            return found, stride
    return array(found, kind, shape, name), 0


def _at(values: numpy.ndarray, kind: str, stride: int) -> Any:
    if stride == 0:
        return ffi.from_buffer(kind, values)
    return ffi.cast(kind.replace("[]", " *"), values.__array_interface__["data"][0])


class Query(Handle, kind="vsh_query"):
    """Occluders, lights and options, checked and made ready once: for points, asked for again and again.

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
        self.names: List[str] = [ffi.string(structs[i].name).decode() for i in range(count)]

    def points(self, positions: ArrayLike, normals: Optional[ArrayLike] = None, *, shadow: bool = True, ao: bool = False,
               deviation: bool = False, distance: bool = False, gradient: bool = False, texels: Optional[ArrayLike] = None,
               out: Optional[Dict[str, numpy.ndarray]] = None, stats: Optional[Stats] = None,
               run: Optional[Run] = None) -> Dict[str, numpy.ndarray]:
        """Shades points.

        Parameters
        ----------
        positions : array of float64 or float32, shape (n, 3)
            world units. Rows may be apart, as in a structured array: nothing is copied
        normals : array of float32, shape (n, 3), optional
            likewise; needed for AO
        shadow, ao, deviation, distance, gradient : bool
            what is asked for
        texels : array of uint32, shape (n,), optional
        out : dict of arrays, optional
            as is returned: written into, and in place of the five above

        Returns
        -------
        dict
            of arrays of float32: "shadow" (lights, n), "ao" (n,), "distance" (n,), "gradient" (n, 3),
            "shadow_deviation" (lights, n), "ao_deviation" (n,)

        Notes
        -----
        Up to 64 points are shaded on the calling thread.
        """
        at = positions if isinstance(positions, numpy.ndarray) else numpy.asarray(positions)
        single = at.dtype == _FLOAT32
        at, position_stride = _rows(at, _FLOAT32 if single else _FLOAT64, 3, "positions")
        count = len(at)
        layout = ffi.NULL
        points = ffi.new("vsh_points *")
        points.count = count
        first = _at(at, "float[]" if single else "double[]", position_stride)
        normal_stride = texel_stride = 0
        if normals is not None:
            up, normal_stride = _rows(normals, _FLOAT32, 3, "normals")
            if len(up) != count:
                raise ValueError(f"normals: expected an array of shape ({count}, 3), got {up.shape}")
            up_first = _at(up, "float[]", normal_stride)
            points.normals = up_first
        if texels is not None:
            numbers, texel_stride = _rows(texels, _UINT32, 1, "texels")
            if len(numbers) != count:
                raise ValueError(f"texels: expected an array of shape ({count},), got {numbers.shape}")
            texel_first = _at(numbers, "uint32_t[]", texel_stride)
            points.texels = texel_first
        if single or position_stride or normal_stride or texel_stride:
            layout = ffi.new("vsh_point_layout *", [ffi.sizeof("vsh_point_layout"), first if single else ffi.NULL, position_stride,
                                                     normal_stride, texel_stride])
        if not single:
            points.positions = first

        lights = self.light_count
        if out is None:
            out = {}
            if shadow and lights:
                out["shadow"] = numpy.empty((lights, count), _FLOAT32)
                if deviation:
                    out["shadow_deviation"] = numpy.empty((lights, count), _FLOAT32)
            if ao:
                out["ao"] = numpy.empty(count, _FLOAT32)
                if deviation:
                    out["ao_deviation"] = numpy.empty(count, _FLOAT32)
            if distance:
                out["distance"] = numpy.empty(count, _FLOAT32)
            if gradient:
                out["gradient"] = numpy.empty((count, 3), _FLOAT32)
        else:
            self._check(out, count)
        values, keeps = self._output(out, count)
        if count <= _SMALL:
            error = ffi.new("vsh_error *")
            result = lib.vsh_query_points(self.handle, points, layout, run_of(run).struct, values, ffi.NULL if stats is None else stats.struct,
                                          error)
            if result != 0:
                fail(result, error)
        else:
            call(lib.vsh_query_points, self, points, layout, values, stats, run=run)
        del keeps
        return out

    def _check(self, out: Dict[str, numpy.ndarray], count: int) -> None:
        lights = self.light_count
        shapes = dict(shadow=(lights, count), shadow_deviation=(lights, count), ao=(count,), ao_deviation=(count,),
                      distance=(count,), gradient=(count, 3))
        for name, values in out.items():
            if name not in shapes:
                raise ValueError(f"out: no value {name!r}; there are {', '.join(shapes)}")
            if values is None:
                raise TypeError(f"out[{name!r}]: expected an array")
            output(values, _FLOAT32, shapes[name], f"out[{name!r}]")

    def _output(self, out: Dict[str, numpy.ndarray], count: int) -> Tuple[Any, Any]:
        values = ffi.new("vsh_query_output *")
        values.struct_size = _OUTPUT_SIZE
        keeps = []
        for name, array_of in out.items():
            if not count:
                continue
            first = ffi.from_buffer("float[]", array_of, require_writable=True)
            keeps.append(first)
            if name in ("shadow", "shadow_deviation"):
                if self.light_count == 0:
                    continue
                planes = ffi.new("float *[]", [first + i * count for i in range(self.light_count)])
                keeps.append(planes)
                setattr(values, "visibility" if name == "shadow" else "deviation", planes)
            else:
                setattr(values, name, first)
        return values, keeps


_OUTPUT_SIZE = ffi.sizeof("vsh_query_output")


def shadow_method_traits(method: str) -> List[str]:
    """What a shadow method is like: "rays", "keeps_error", "triangles", "inner"."""
    return words_of_bits("VSH_METHOD_", lib.vsh_shadow_method_traits(constant("VSH_SHADOW_", method, "method")))


def ao_method_traits(method: str) -> List[str]:
    """What an AO method is like, likewise."""
    return words_of_bits("VSH_METHOD_", lib.vsh_ao_method_traits(constant("VSH_AO_", method, "method")))


def shadow_method_resolve(method: str, has_triangles: bool) -> str:
    """What "auto" comes to with triangles or without; every other method is itself."""
    return word("VSH_SHADOW_", lib.vsh_shadow_method_resolve(constant("VSH_SHADOW_", method, "method"), has_triangles))


def ao_method_resolve(method: str, has_triangles: bool) -> str:
    """Likewise of AO."""
    return word("VSH_AO_", lib.vsh_ao_method_resolve(constant("VSH_AO_", method, "method"), has_triangles))
