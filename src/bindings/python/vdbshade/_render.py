"""Pictures: surfaces seen by a camera, in the light that occluders leave."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from ._arrays import array, output, pointer, vector
from ._library import RUN, Run, call, ffi, handle_of, lib
from ._structs import Filled, split
from ._field import Field
from ._image import _Image
from ._light import Light, lights_of
from ._mesh import Meshes, meshes_of
from ._occluders import Occluders
from ._points import Stats, tint_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from . import types


class Camera:
    """A pinhole.

    Parameters
    ----------
    position, target, up : three floats
        world units
    fov : float
        angle over the picture's height, radians
    """

    def __init__(self, **options: "Unpack[types.Camera]") -> None:
        self._filled = Filled("vsh_camera", options)
        self.struct = self._filled.pointer
        call(lib.vsh_camera_check, self.struct)

    @property
    def position(self) -> Tuple[float, ...]:
        return tuple(self.struct.position)

    @property
    def target(self) -> Tuple[float, ...]:
        return tuple(self.struct.target)

    def frame(self, bounds_min: ArrayLike, bounds_max: ArrayLike, azimuth: float = 0.5, elevation: float = 0.5,
              aspect: float = 16 / 9) -> "Camera":
        """Moves it so that it sees a whole world box; angles in radians, `aspect` is width over height."""
        call(lib.vsh_camera_frame, self.struct, vector(bounds_min, 3, "bounds_min"), vector(bounds_max, 3, "bounds_max"), azimuth,
             elevation, aspect)
        return self

    def frame_points(self, points: ArrayLike, azimuth: float = 0.5, elevation: float = 0.5, aspect: float = 16 / 9) -> "Camera":
        """The same for points (n, 3), as near as they can all be seen."""
        at = array(points, numpy.float64, (None, 3), "points")
        call(lib.vsh_camera_frame_points, self.struct, len(at), pointer(at), azimuth, elevation, aspect)
        return self

    def orbit(self, angle: float) -> "Camera":
        """Turns it around its target, radians."""
        lib.vsh_camera_orbit(self.struct, angle)
        return self


class LitMeshes:
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
        structs, count, keeps = meshes_of(meshes)
        self._filled = Filled("vsh_lit_meshes", dict(color=color, ambient=ambient))
        self.struct = self._filled.pointer
        self._image = None if lightmap is None else _Image(lightmap)
        self._keeps = (structs, keeps)
        self.struct.meshes, self.struct.mesh_count = structs, count
        if self._image is not None:
            self.struct.lightmap = self._image.struct


class Picture(Dict[str, numpy.ndarray]):
    """Planes of float32, row 0 on top: "color" (height, width, 3) linear RGB, "alpha", "depth" (height, width), "normal"
    (height, width, 3)."""

    def encode(self, exposure: float = 0.0, alpha: bool = False) -> numpy.ndarray:
        """For files of 8 bits: float32 of shape (height, width, 3 or 4), 0 … 1, through the sRGB curve."""
        height, width = self["alpha"].shape
        planes = [numpy.empty((height, width), numpy.float32) for _ in range(4 if alpha else 3)]
        given = ffi.new("vsh_picture *", [pointer(self[n]) for n in ("color", "alpha", "depth", "normal")])
        call(lib.vsh_picture_encode, given, width, height, exposure, ffi.new("float *[3]", [pointer(p) for p in planes[:3]]),
             pointer(planes[3]) if alpha else ffi.NULL)
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
    filled = Filled("vsh_render_options", dict(own, shade=shade))
    if camera is not None:
        filled.pointer.camera = camera.struct[0]
    if tint is not None:
        filled.pointer.tint = tint_of(tint).pointer[0]
    shown = ffi.new("vsh_lit_meshes[]", [m.struct[0] for m in lit] or 1)
    filled.pointer.lit, filled.pointer.lit_count = shown, len(lit)
    pairs = [s if isinstance(s, tuple) else (s, (0.7, 0.7, 0.7)) for s in surfaces]
    fields = [(handle_of(field, Field, "surfaces"), [float(c) for c in color]) for field, color in pairs]
    array_of = ffi.new("vsh_surface[]", [dict(field=f, color=c) for f, c in fields] or 1)
    structs, count = lights_of(lights)
    shape = (filled.pointer.height, filled.pointer.width)
    if not all(0 <= n <= 16384 for n in shape):
        shape = (0, 0)  # refused by the library, which says why
    picture = Picture(color=output(None, numpy.float32, (*shape, 3), "color"), alpha=output(None, numpy.float32, shape, "alpha"),
                      depth=output(None, numpy.float32, shape, "depth"), normal=output(None, numpy.float32, (*shape, 3), "normal"))
    target = ffi.new("vsh_picture *", [pointer(picture[n]) for n in ("color", "alpha", "depth", "normal")])
    call(lib.vsh_render, array_of, len(fields), handle_of(occluders, Occluders, "occluders"), structs, count, filled.pointer, RUN, target,
         ffi.NULL if stats is None else stats.struct, run=run)
    return picture


__all__ = ["Camera", "LitMeshes", "Picture", "render"]
