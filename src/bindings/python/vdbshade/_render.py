"""Pictures: surfaces seen by a camera, in the light that occluders leave."""
from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, pointer, vector
from ._calls import Run, ask, call
from ._image import image_of
from ._library import Unpack, ffi, lib
from ._light import Light, lights_of
from ._mesh import Meshes, meshes_of
from ._occluders import Field, Occluders
from ._points import Stats, tint_of
from ._structs import Filled, Struct, split, structs_of


class Camera(Struct, kind="vsh_camera"):
    """A pinhole.

    Parameters
    ----------
    position, target, up : three floats
        world units
    fov : float
        angle over the picture's height, radians
    """

    def __init__(self, **options: "Unpack[types.Camera]") -> None:
        self.struct = Filled("vsh_camera", options).struct
        call(lib.vsh_camera_check, self)

    def frame(self, bounds_min: ArrayLike, bounds_max: ArrayLike, azimuth: float = 0.5, elevation: float = 0.5,
              aspect: float = 16 / 9) -> "Camera":
        """Moves it so that it sees a whole world box; angles in radians, `aspect` is width over height."""
        call(lib.vsh_camera_frame, self, vector(bounds_min, 3, "bounds_min"), vector(bounds_max, 3, "bounds_max"), azimuth, elevation, aspect)
        return self

    def frame_points(self, points: ArrayLike, azimuth: float = 0.5, elevation: float = 0.5, aspect: float = 16 / 9) -> "Camera":
        """The same for points (n, 3), as near as they can all be seen."""
        at = array(points, numpy.float64, (None, 3), "points")
        call(lib.vsh_camera_frame_points, self, len(at), at, azimuth, elevation, aspect)
        return self

    def orbit(self, angle: float) -> "Camera":
        """Turns it around its target, radians."""
        ask(lib.vsh_camera_orbit, self, angle)
        return self


class LitMeshes(Struct, kind="vsh_lit_meshes"):
    """Meshes that are shown themselves.

    Parameters
    ----------
    meshes : Mesh, Model or sequence of Mesh
    lightmap : mapping, optional
        planes of a bake on them; None: light is asked for at each point
    color : three floats
    ambient : bool
        its irradiance has the sky's light in it
    """

    def __init__(self, meshes: Meshes, lightmap: Optional[Mapping[str, ArrayLike]] = None, color: Sequence[float] = (0.7, 0.7, 0.7),
                 ambient: bool = False) -> None:
        structs, count = meshes_of(meshes)
        self.struct = Filled("vsh_lit_meshes", color=color, ambient=ambient, meshes=structs, mesh_count=count,
                             lightmap=None if lightmap is None else image_of(lightmap)).struct


class Picture(Dict[str, numpy.ndarray]):
    """Planes of float32, row 0 on top: "color" (height, width, 3) linear RGB, "alpha", "depth" (height, width), "normal"
    (height, width, 3)."""

    def encode(self, exposure: float = 0.0, alpha: bool = False) -> numpy.ndarray:
        """For files of 8 bits: float32 of shape (height, width, 3 or 4), 0 … 1, through the sRGB curve."""
        height, width = self["alpha"].shape
        planes = [numpy.empty((height, width), numpy.float32) for _ in range(4 if alpha else 3)]
        call(lib.vsh_picture_encode, Filled("vsh_picture", {n: self[n] for n in ("color", "alpha", "depth", "normal")}), width, height, exposure,
             ffi.new("float *[3]", [pointer(p) for p in planes[:3]]), planes[3] if alpha else None)
        return numpy.stack(planes, axis=2)


def render(surfaces: "Sequence[Union[Field, Tuple[Field, Sequence[float]]]]", occluders: Occluders,
           lights: Union[Light, Sequence[Light]] = (), *, camera: Optional[Camera] = None, lit: Sequence[LitMeshes] = (),
           tint: Any = None, stats: Optional[Stats] = None, run: Optional[Run] = None, **options: Any) -> Picture:
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
