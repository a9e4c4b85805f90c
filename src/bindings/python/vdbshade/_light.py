"""Lights: directional with an angular diameter, sphere, spot, rectangle."""
from __future__ import annotations

from typing import Any, List, Optional, Sequence, Tuple, Union

from . import types
from ._calls import OUT, Run, call
from ._library import Path, Unpack, ffi, lib
from ._structs import Filled, Struct, path_of, structs_of, told


class Light(Struct, kind="vsh_light"):
    """A light. What a type does not name is ignored; a size of 0 is a hard light.

    Parameters
    ----------
    type : str
        "directional" (direction, angle), "sphere" (position, radius), "spot" (position, radius, axis, inner_angle,
        outer_angle) or "rectangle" (position, edge_u, edge_v, two_sided)
    **options
        members of ``vsh_light`` (vdbshade.types.Light): lengths in world units, angles in radians. `direction` points
        towards the light, `angle` is its angular diameter; `color` is linear RGB times intensity.

    Examples
    --------
    >>> Light("directional", direction=(0.4, 0.8, 0.3), angle=0.03, name="sun")
    <vdbshade.Light sun: directional …>
    """

    def __init__(self, type: str = "directional", **options: "Unpack[types.Light]") -> None:
        self.struct = Filled("vsh_light", options, type=type).struct
        call(lib.vsh_light_check, self)

    @classmethod
    def _of(cls, struct: Any) -> "Light":
        self = cls.__new__(cls)
        self.struct = ffi.new("vsh_light *", struct)
        return self

    def __repr__(self) -> str:
        text = ffi.new("char[]", 256)
        lib.vsh_light_text(self.struct, text, 256)
        return f"<vdbshade.Light {self.name}: {ffi.string(text).decode()}>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Light) and told(self.struct) == told(other.struct)

    __hash__ = None  # type: ignore[assignment]


def lights_of(given: Union[Light, Sequence[Light]], name: str = "lights") -> Tuple[Any, int]:
    """Lights as C takes them: ``vsh_light[]`` and how many."""
    lights = [given] if isinstance(given, Light) else list(given)
    if not all(isinstance(light, Light) for light in lights):
        raise TypeError(f"{name}: expected a vdbshade.Light, or several in a list")
    return structs_of("vsh_light", lights), len(lights)


def lights_read(path: Path, angle: float, radius: float, unit: float = 0.0, *, run: Optional[Run] = None) -> List[Light]:
    """The lights of a glTF's file as those of a scene, which have sizes.

    Parameters
    ----------
    angle : float
        of directional ones, angular diameter, radians
    radius : float
        of points, which become spheres, and spots, world units
    unit : float
        of the file's numbers, metres; 0: as it says itself
    """
    lights, count = call(lib.vsh_lights_read, path_of(path, "path"), angle, radius, unit, OUT, OUT, run=run)
    return [Light._of(lights[i]) for i in range(count)]
