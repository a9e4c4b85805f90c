"""Flat scenes: light maps of a plane, for 2D games."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import output, pointer
from ._calls import OUT, Run, ask, call
from ._library import Path, Unpack, ffi, lib
from ._light import Light, lights_of
from ._occluders import optional
from ._scene import SceneFile, known_settings, option_of, setting_text
from ._shapes import Outline, distances_at
from ._structs import Filled, path_of, struct_of


def flat_bake(casters: Optional[Outline], lights: Union[Light, Sequence[Light]] = (), *, irradiance: bool = False,
              out: Optional[Mapping[str, numpy.ndarray]] = None, run: Optional[Run] = None,
              **options: "Unpack[types.FlatOptions]") -> Dict[str, numpy.ndarray]:
    """Bakes a light map of a plane.

    Parameters
    ----------
    casters : Outline, optional
        None: an empty plane
    lights : Light or sequence of Light
        third components are ignored
    irradiance : bool
        "irradiance.R", ".G", ".B" too
    **options
        vdbshade.types.FlatOptions: width, height, region_min, region_max, method, supersample, padding

    Returns
    -------
    dict
        arrays of float32 of shape (height, width), row 0 on top: "shadow.NAME" of each light, "A" (coverage)
    """
    return _bake(casters, *lights_of(lights), Filled("vsh_flat_options", options).struct, irradiance, out, run)


def _bake(casters: Optional[Outline], structs: Any, count: int, options: Any, irradiance: bool,
          out: Optional[Mapping[str, numpy.ndarray]], run: Optional[Run]) -> Dict[str, numpy.ndarray]:
    names = [f"shadow.{ffi.string(structs[i].name).decode()}" for i in range(count)]
    wanted = names + ["A"] + ([f"irradiance.{c}" for c in "RGB"] if irradiance else [])
    unknown = set(out or {}) - set(wanted)
    if unknown or len(set(names)) != len(names):
        raise ValueError(f"out {sorted(unknown)}: there are {', '.join(wanted)}" if unknown else "lights: two of one name")
    shape = (max(options.height, 0), max(options.width, 0))
    if max(shape) > 65536:
        shape = (0, 0)  # refused by the library, which says why
    planes = {n: output((out or {}).get(n), numpy.float32, shape, f"out[{n!r}]") for n in wanted}
    shadow = ffi.new("float *[]", [pointer(planes[n]) for n in names] or 1)
    colour = ffi.new("float *[3]", [pointer(planes[f"irradiance.{c}"]) for c in "RGB"]) if irradiance else ffi.NULL
    target = ffi.new("vsh_flat_map *", [shadow, colour, pointer(planes["A"])])
    call(lib.vsh_flat_bake, optional(casters, "vsh_outline", "casters"), structs, count, options, target, run=run)
    return planes


def flat_visibility(casters: Optional[Outline], light: Light, points: ArrayLike) -> numpy.ndarray:
    """The share of a light that points (n, 2) see, exactly: float64 of shape (n,)."""
    outline, struct = optional(casters, "vsh_outline", "casters"), struct_of(light, ffi.typeof("vsh_light"))
    return distances_at(lambda shape, at: lib.vsh_flat_visibility(shape, struct, at), outline, points, 2, "points")


def flat_light_name(type: int) -> Optional[str]:
    """What a light of a type's number is in a plane: "directional", "disc", "spot"; None where there is none."""
    return ask(lib.vsh_get_name, lib.VSH_NAMES_FLAT_LIGHT, type)


class FlatScene(SceneFile, kind="vsh_flat_scene"):
    """A flat scene's file (docs/flat.md); settings by the names of `vdbshade flat`'s options."""

    def __init__(self, path: Path, *, run: Optional[Run] = None, **settings: Any) -> None:
        self._read(lib.vsh_flat_scene_read, path_of(path, "path"), run)
        for name, value in settings.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> None:
        """Sets what a setting's key or option says."""
        known_settings(name, ("flat",))
        call(lib.vsh_flat_scene_set, self, option_of(name), self._filled.text(setting_text(value), name))

    @property
    def shape(self) -> Tuple[int, int]:
        return self.struct.options.height, self.struct.options.width

    def casters(self, *, run: Optional[Run] = None) -> Optional[Outline]:
        """The union of its casters; None where it has none."""
        return Outline._of(call(lib.vsh_flat_scene_casters, self, OUT, run=run))

    def bake(self, *, irradiance: bool = True, run: Optional[Run] = None) -> Dict[str, numpy.ndarray]:
        """As flat_bake()."""
        return _bake(self.casters(run=run), self.struct.lights, self.struct.light_count, ffi.addressof(self.struct, "options"),
                     irradiance, None, run)
