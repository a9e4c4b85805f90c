"""Shadow and ambient occlusion at points."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, output, pointer
from ._library import RUN, Handle, Run, call, fail, ffi, handle_of, lib, make, place, run_of
from ._structs import Filled, constant, told, word
from ._tables import WORDS
from ._light import Light, lights_of
from ._occluders import Occluders

if TYPE_CHECKING:
    from typing_extensions import Unpack


class Stats:
    """Work that was done, added up over the calls that it was given to (vdbshade.types.ShadeStats)."""

    def __init__(self) -> None:
        self._filled = Filled("vsh_shade_stats")
        self.struct = self._filled.pointer

    @property
    def told(self) -> types.ShadeStats:
        return told(self.struct[0], "vsh_shade_stats")


def _points(positions: ArrayLike, normals: Optional[ArrayLike], texels: Optional[ArrayLike]) -> Tuple[Any, int, Any]:
    at = array(positions, numpy.float64, (None, 3), "positions")
    up = None if normals is None else array(normals, numpy.float32, (len(at), 3), "normals")
    numbers = None if texels is None else array(texels, numpy.uint32, (len(at),), "texels")
    keeps = [pointer(at), pointer(up), pointer(numbers)]
    return ffi.new("vsh_points *", [len(at)] + keeps), len(at), (keeps, at, up)


def _stats(stats: Optional[Stats]) -> Any:
    return ffi.NULL if stats is None else stats.struct


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
    points, count, keeps = _points(positions, normals, texels)
    values = output(out, numpy.float32, (count,), "out")
    left = None if deviation is None else output(deviation, numpy.float32, (count,), "deviation")
    if not isinstance(light, Light):
        raise TypeError(f"light: expected a vdbshade.Light, got {type(light).__name__}")
    call(lib.vsh_shade_shadow, handle_of(occluders, Occluders, "occluders"), points, light.struct,
         Filled("vsh_shade_options", options).pointer, RUN, pointer(values), pointer(left), _stats(stats), run=run)
    del keeps
    return values


def shade_ao(occluders: Occluders, positions: ArrayLike, normals: ArrayLike, *, texels: Optional[ArrayLike] = None,
             out: Optional[numpy.ndarray] = None, deviation: Optional[numpy.ndarray] = None,
             bent: Optional[numpy.ndarray] = None, stats: Optional[Stats] = None, run: Optional[Run] = None,
             **options: "Unpack[types.ShadeOptions]") -> numpy.ndarray:
    """Cosine-weighted fraction of the hemisphere that is free within ``ao_distance`` (world units), 0 … 1 open.

    Arguments as of shade_shadow(); `bent`, an array of float32 of shape (n, 3), takes bent normals: unit, world space.
    """
    points, count, keeps = _points(positions, normals, texels)
    values = output(out, numpy.float32, (count,), "out")
    left = None if deviation is None else output(deviation, numpy.float32, (count,), "deviation")
    directions = None if bent is None else output(bent, numpy.float32, (count, 3), "bent")
    call(lib.vsh_shade_ao, handle_of(occluders, Occluders, "occluders"), points, Filled("vsh_shade_options", options).pointer,
         RUN, pointer(values), pointer(left), pointer(directions), _stats(stats), run=run)
    del keeps
    return values


def tint_of(tint: "str | dict | types.Tint") -> Filled:
    """``vsh_tint`` of "quadratic" or dict(type="power", power=(r, g, b)), checked."""
    filled = Filled("vsh_tint", dict(type=tint) if isinstance(tint, str) else tint)
    call(lib.vsh_tint_check, filled.pointer)
    return filled


def shade_tint(visibility: ArrayLike, tint: "str | types.Tint", out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
    """Tinted visibility, linear RGB: float32 (n,) to float32 (n, 3)."""
    values = array(visibility, numpy.float32, (None,), "visibility")
    rgb = output(out, numpy.float32, (len(values), 3), "out")
    lib.vsh_shade_tint(len(values), pointer(values), tint_of(tint).pointer, pointer(rgb))
    return rgb


def shade_irradiance(positions: ArrayLike, normals: ArrayLike, light: Light, visibility: ArrayLike,
                     out: Optional[numpy.ndarray] = None) -> numpy.ndarray:
    """Irradiance of one light, linear RGB, added to `out`, an array of float32 of shape (n, 3) (None: to zeros):
    visibility × colour × falloff × cosine."""
    points, count, keeps = _points(positions, normals, None)
    values = array(visibility, numpy.float32, (count,), "visibility")
    rgb = numpy.zeros((count, 3), numpy.float32) if out is None else output(out, numpy.float32, (count, 3), "out")
    call(lib.vsh_light_check, light.struct)
    lib.vsh_shade_irradiance(points, ffi.NULL, light.struct, pointer(values), pointer(rgb))
    del keeps
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


class Query(Handle):
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
        owner = handle_of(occluders, Occluders, "occluders")

        def free(query: Any, keeps: Any = owner) -> None:  # the occluders live until then
            lib.vsh_query_free(query)

        super().__init__(make(free, lib.vsh_query_create, owner, structs, count, Filled("vsh_shade_options", options).pointer,
                              place("vsh_query")))
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
            result = lib.vsh_query_points(self.handle, points, layout, run_of(run).struct, values, _stats(stats), error)
            if result != 0:
                fail(result, error)
        else:
            call(lib.vsh_query_points, self.handle, points, layout, RUN, values, _stats(stats), run=run)
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
    return _traits(lib.vsh_shadow_method_traits(constant("VSH_SHADOW_", method, "method")))


def ao_method_traits(method: str) -> List[str]:
    """What an AO method is like, likewise."""
    return _traits(lib.vsh_ao_method_traits(constant("VSH_AO_", method, "method")))


def shadow_method_resolve(method: str, has_triangles: bool) -> str:
    """What "auto" comes to with triangles or without; every other method is itself."""
    return word("VSH_SHADOW_", lib.vsh_shadow_method_resolve(constant("VSH_SHADOW_", method, "method"), has_triangles))


def ao_method_resolve(method: str, has_triangles: bool) -> str:
    """Likewise of AO."""
    return word("VSH_AO_", lib.vsh_ao_method_resolve(constant("VSH_AO_", method, "method"), has_triangles))


def _traits(bits: int) -> List[str]:
    return [name for name, bit in WORDS["VSH_METHOD_"].items() if bits & bit]


__all__ = ["Query", "Stats", "ao_method_resolve", "ao_method_traits", "shadow_method_resolve",
           "shade_ao", "shade_irradiance", "shade_shadow", "shade_tint", "shadow_method_traits"]
