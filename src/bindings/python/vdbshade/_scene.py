"""Scenes: casters, lights and receivers as one description, of a file or of arguments; their settings."""
from __future__ import annotations

import os
from typing import Any, List, Mapping, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, transform as matrix, vector
from ._calls import OUT, Handle, Run, ask, call
from ._grid import Grid
from ._library import Path, ffi, lib
from ._light import Light, lights_of
from ._lightmap import Charts
from ._mesh import Mesh, Meshes, Model, meshes_of, rules_of
from ._occluders import Heights, Occluders, Spheres, Triangles
from ._shapes import Sdf, Solids
from ._structs import Filled, Struct, path_of, texts_of, told
from ._unwrap import Atlas


def settings() -> List[types.Setting]:
    """All settings of scenes, of what receives in them and of flat scenes, with their help, range and default."""
    found: List[types.Setting] = []
    setting = ffi.new("vsh_setting *")
    while lib.vsh_setting_get(len(found), setting):
        found.append(told(setting))
    return found


def setting_text(value: Any) -> bytes:
    if isinstance(value, (bool, numpy.bool_)):
        return b"true" if value else b"false"
    if isinstance(value, str):
        return value.encode()
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return b",".join(setting_text(v) for v in value)
    if isinstance(value, (float, numpy.floating)):
        return repr(float(value)).encode()
    return str(value).encode()


def option_of(name: str) -> str:
    return name if "." in name else "--" + name.replace("_", "-")


def known_settings(name: str, owners: Sequence[str]) -> List[types.Setting]:
    found = [s for s in settings() if s.owner in owners and (s.key == name or "--" + s.option == option_of(name))]
    if not found:
        names = ", ".join(s.option.replace("-", "_") for s in settings() if s.owner in owners)
        raise TypeError(f"no setting {name!r}; there are {names}")
    return found


def _placed(given: Mapping[str, Any]) -> dict:
    """Members of a caster or a receiver: its objects as patterns, its transform as twelve numbers."""
    members, moved = dict(given), matrix(given.get("transform"))
    members["transform"] = (numpy.eye(3, 4) if moved is None else moved).flat
    members["objects"] = {name.rstrip("_"): patterns for name, patterns in given.get("objects", {}).items()}
    return members


def _caster_of(given: Any) -> Filled:
    """``vsh_caster`` of a path (.vdb: a level set, else a mesh), an Sdf, or a dict of its members."""
    if isinstance(given, Sdf):
        given = dict(sdf=given)
    elif isinstance(given, (str, bytes, os.PathLike)):
        given = dict(path=given)
    elif not isinstance(given, Mapping):
        raise TypeError(f"casters: expected a path, a vdbshade.Sdf or a dict, got {type(given).__name__}")
    members = _placed(given)
    vdb = os.fsencode(members.get("path") or "").endswith(b".vdb")
    shape = next((name for name in ("sdf", "spheres") if members.get(name) is not None), "vdb" if vdb else "mesh")
    members.setdefault("type", shape)
    members["solidity"] = rules_of(members.get("solidity", {}), "solidity")
    if members.get("spheres") is not None:
        members["spheres"] = array(members["spheres"], numpy.float64, (None, 4), "spheres")
        members["sphere_count"] = len(members["spheres"])
    return Filled("vsh_caster", members)


def _receiver_of(given: Any) -> Filled:
    members = _placed(given if isinstance(given, Mapping) else dict(path=given))
    members["density"] = rules_of(members.get("density", {}), "factor")
    return Filled("vsh_receiver", members)


class SceneFile(Struct):
    """The content of a scene's file, and the settings that change it."""

    def _read(self, function: Any, path: Optional[Path], run: Optional[Run]) -> None:
        self._filled = Filled(self.KIND)
        self.struct = self._filled.struct
        if path is not None:
            self._file = call(function, path_of(path, "path"), OUT, run=run)
            self.struct[0] = self._file[0]

    @property
    def lights(self) -> List[Light]:
        return [Light._of(self.struct.lights[i]) for i in range(self.struct.light_count)]


class Scene(SceneFile, kind="vsh_scene"):
    """A scene, of a file (docs/scene.md) or of arguments.

    Parameters
    ----------
    path : path, optional
        a scene's JSON file; what else is given is put over it
    casters : sequence, optional
        each a path (.vdb or a mesh), an Sdf, or a dict of members of ``vsh_caster`` (vdbshade.types.Caster);
        `solidity` a mapping as below, `one_sided` patterns
    receivers : sequence, optional
        each a mesh's path, or a dict of members of ``vsh_receiver`` (vdbshade.types.Receiver): path, output, width, …;
        `density` a mapping of patterns to factors of texels_per_unit, {"wall*": 2.0}
    lights : sequence of Light, optional
    solidity : mapping, optional
        what meshes are taken for, by patterns: {"wall*": "shell"}
    **settings
        by the names of the command line's options (settings()): max_error=0.01, ao_distance=1, width=512. Those of
        receivers are of all of them

    Examples
    --------
    >>> scene = Scene(casters=["cloister.glb"], receivers=["cloister.glb"], lights=[Light(angle=0.05)], width=256, height=256)
    >>> lightmap, = scene.bake()
    """

    def __init__(self, path: Optional[Path] = None, *, casters: Optional[Sequence[Any]] = None,
                 receivers: Optional[Sequence[Any]] = None, lights: Optional[Sequence[Light]] = None,
                 solidity: Optional[Mapping[str, str]] = None, run: Optional[Run] = None, **settings: Any) -> None:
        self._read(lib.vsh_scene_read, path, run)
        given: dict = {}
        given["receivers"] = [self.struct.receivers + i for i in range(self.struct.receiver_count)] if receivers is None else [
            _receiver_of(r) for r in receivers]
        given["casters"] = None if casters is None else [_caster_of(c) for c in casters]
        if lights is not None:
            given["lights"], given["light_count"] = lights_of(lights)
            given["light_file_count"] = 0  # none of these are a file's
        given["solidity"] = None if solidity is None else rules_of(solidity, "solidity")
        self._filled.fill(given)
        for name, value in settings.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> None:
        """Sets what a setting's key ("ao.method") or option ("ao_method") says, as settings() lists them; of receivers all."""
        owners = {s.owner for s in known_settings(name, ("scene", "receiver"))}
        given = self._filled.text(setting_text(value), name)
        if "scene" in owners:
            call(lib.vsh_scene_set, self, option_of(name), given)
            return
        for i in range(self.struct.receiver_count):
            call(lib.vsh_receiver_set, self._receiver(i), option_of(name), given)

    def _receiver(self, index: int) -> Any:
        return self.struct.receivers + index

    @property
    def light_files(self) -> List[types.LightFile]:
        """Files that its file takes lights from, and which of its lights they are."""
        return [told(self.struct.light_files[i]) for i in range(self.struct.light_file_count)]

    @property
    def layers(self) -> List[str]:
        """Names of its layers."""
        return [ffi.string(self.struct.layers[i].name).decode() for i in range(self.struct.layer_count)]

    def _layer(self, name: Optional[str]) -> Any:
        if name is None:
            return ffi.NULL
        if name not in self.layers:
            raise KeyError(f"no layer {name!r}; there are {', '.join(self.layers)}")
        return self.struct.layers + self.layers.index(name)

    # --- what is asked of it

    def traceable(self, layer: Optional[str] = None) -> bool:
        """Whether the casters in a layer, or in none, are all triangles."""
        return bool(ask(lib.vsh_scene_traceable, self, self._layer(layer)))

    def marches(self, layer: Optional[str] = None) -> bool:
        """Whether a method knows its casters by their voxels alone."""
        return bool(ask(lib.vsh_scene_marches, self, self._layer(layer)))

    def check_outputs(self, outputs: Sequence[Path], *, run: Optional[Run] = None) -> None:
        """ArgumentError where one of these files is there already and is read with the scene: a texture, say."""
        paths = list(outputs)
        call(lib.vsh_scene_check_outputs, self, texts_of(paths, "outputs"), len(paths), run=run)

    def receiver_check(self, index: int) -> None:
        """ArgumentError and the like where a receiver's image could not be written as it asks."""
        call(lib.vsh_receiver_check, self, index)

    def receiver_charts(self, index: int, meshes: Meshes, *, run: Optional[Run] = None) -> Charts:
        """The charts of a receiver's meshes, as its bake sorts them."""
        structs, count = meshes_of(meshes)
        charts = Charts.__new__(Charts)
        charts._begin(call(lib.vsh_receiver_charts, self, index, structs, count, OUT, run=run, keeps=structs), count)
        charts.uv_reports = []
        return charts

    def needs_unwrap(self, index: int, meshes: Meshes, *, run: Optional[Run] = None) -> bool:
        """Whether a receiver's meshes get UVs of their own making."""
        if not 0 <= index < self.struct.receiver_count:
            raise IndexError(f"receiver {index}: there are {self.struct.receiver_count}")
        return bool(call(lib.vsh_receiver_needs_unwrap, self._receiver(index), *meshes_of(meshes), OUT, run=run))

    def reach(self, grid: Grid, receivers_min: ArrayLike, receivers_max: ArrayLike) -> float:
        """Reach, world units, that a field of `grid` needs for receivers in a world box."""
        return ask(lib.vsh_scene_reach, self, grid, vector(receivers_min, 3, "receivers_min"), vector(receivers_max, 3, "receivers_max"))

    def view(self, path: Path, name: str = "scene", *, run: Optional[Run] = None) -> None:
        """Writes a page that shows the surface of its casters' voxels, with shadow, AO and light at the vertices
        (docs/view.md). `name` is shown."""
        call(lib.vsh_view_write_scene, path_of(path, "path"), name, self, run=run)

    def bake(self, *, run: Optional[Run] = None, **options: Any) -> Any:
        """Bakes its lightmaps into arrays: a list of SceneLightmap; options of bake_scene()."""
        from ._bake_scene import bake_scene
        return bake_scene(self, arrays=True, run=run, **options).lightmaps


class Assets(Handle, kind="vsh_assets"):
    """What a scene's files hold, each file read once."""

    def __init__(self, scene: Scene, *, run: Optional[Run] = None) -> None:
        super().__init__(call(lib.vsh_assets_load, scene, OUT, run=run))
        self.scene = scene

    def _meshes(self, function: Any, *which: Any) -> List[Mesh]:
        count = ffi.new("size_t *")
        meshes = ask(function, self, *which, count)
        return [Mesh._view(meshes[i], self.handle) for i in range(count[0])]

    def receiver(self, index: int, page: Optional[int] = None) -> List[Mesh]:
        """The meshes of a receiver, of one of its pages; none beyond what there is."""
        if page is None:
            return self._meshes(lib.vsh_assets_receiver, index)
        return self._meshes(lib.vsh_assets_receiver_page, index, page, ffi.new("size_t *"))

    def caster(self, index: int) -> List[Mesh]:
        """The meshes of a caster; none of one without triangles."""
        return self._meshes(lib.vsh_assets_caster, index)

    def receiver_pages(self, index: int) -> int:
        return ask(lib.vsh_assets_receiver_pages, self, index)

    def receiver_page_info(self, index: int, page: int) -> Optional[types.ReceiverPage]:
        """A page of a receiver: width and height (texels), and the object whose it is, None where it is shared; None beyond
        what there is."""
        found = ffi.new("vsh_receiver_page *")
        return told(found) if ask(lib.vsh_assets_receiver_page_info, self, index, page, found) else None

    def _with_numbers(self, function: Any, kind: Any, index: int) -> Any:
        numbers = ffi.new("size_t **")
        found = kind._borrow(ask(function, self, index, numbers), self.handle)
        return None if found is None else (found, [numbers[0][i] for i in range(len(self.receiver(index)))])

    def receiver_model(self, index: int) -> Optional[Tuple[Model, List[int]]]:
        """The model of a receiver, and which of its meshes each of receiver() is."""
        return self._with_numbers(lib.vsh_assets_receiver_model, Model, index)

    def receiver_atlas(self, index: int) -> Optional[Tuple[Atlas, List[int]]]:
        """Where it is unwrapped: its atlas, and which of the atlas's meshes each of receiver() is."""
        return self._with_numbers(lib.vsh_assets_receiver_atlas, Atlas, index)

    def heights(self, index: int) -> Optional[Heights]:
        """What a caster casts by that is a direct heightfield."""
        return Heights._borrow(ask(lib.vsh_assets_heights, self, index), self.handle)

    def spheres(self, index: int) -> Optional[Spheres]:
        """What a caster casts by that is spheres without voxels."""
        return Spheres._borrow(ask(lib.vsh_assets_spheres, self, index), self.handle)

    # --- what casts

    def casters(self, layer: Optional[str] = None, *, only_layer: bool = False, run: Optional[Run] = None) -> Optional[Grid]:
        """All voxelised casters as one level set; of a layer (or with only_layer of none) those in it, None where there
        are none."""
        if layer is None and not only_layer:
            return Grid._of(call(lib.vsh_scene_casters, self.scene, self, OUT, run=run))
        return Grid._of(call(lib.vsh_scene_layer_casters, self.scene, self, self.scene._layer(layer), OUT, run=run))

    def triangles(self, layer: Optional[str] = None, *, run: Optional[Run] = None) -> Optional[Triangles]:
        """The triangles of the casters in a layer, or in none."""
        return Triangles._of(call(lib.vsh_scene_triangles, self.scene, self, self.scene._layer(layer), OUT, run=run))

    def truth(self, *, run: Optional[Run] = None) -> Tuple[Optional[Triangles], Optional[Solids]]:
        """Its casters as rays meet them."""
        triangles, solids = call(lib.vsh_scene_truth, self.scene, self, OUT, OUT, run=run)
        return Triangles._of(triangles), Solids._of(solids)

    def resolution(self, points: float, layer: Optional[str] = None) -> int:
        """Voxels along the longest side that are chosen for so many points; -1: those that the scene names, 0: none."""
        return ask(lib.vsh_scene_resolution, self.scene, self, self.scene._layer(layer), points)

    def occluders(self, *, receivers_min: Optional[ArrayLike] = None, receivers_max: Optional[ArrayLike] = None,
                  grid: Optional[Grid] = None, run: Optional[Run] = None, **options: Any) -> Occluders:
        """What casts in the scene; options of vdbshade.types.SceneOccludersOptions: voxels, points, within, truth."""
        filled = Filled("vsh_scene_occluders_options", options, grid=grid)
        for name, corner in (("receivers_min", receivers_min), ("receivers_max", receivers_max)):
            filled.fill({name: None if corner is None else vector(corner, 3, name)})
        return Occluders._of(call(lib.vsh_scene_occluders, self.scene, self, filled, OUT, run=run,
                                  keeps=(self.handle, self.scene, filled.keeps)))
