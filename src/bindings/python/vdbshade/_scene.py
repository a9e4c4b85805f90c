"""Scenes: casters, lights and receivers as one description, of a file or of arguments; their settings."""
from __future__ import annotations

import os
from typing import Any, List, Mapping, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, pointer, transform as matrix, vector
from ._library import RUN, Handle, Run, call, ffi, handle_of, lib, make, place
from ._structs import Filled, constant, path_of, told
from ._field import Heights, Spheres, Triangles
from ._grid import Grid
from ._light import Light, lights_of
from ._lightmap import Charts, _freeing
from ._mesh import Mesh, Meshes, Model, density_rules, meshes_of
from ._occluders import Occluders
from ._sdf import Sdf, Solids
from ._unwrap import Atlas


def settings() -> List[types.Setting]:
    """All settings of scenes, of what receives in them and of flat scenes, with their help, range and default."""
    found: List[types.Setting] = []
    setting = ffi.new("vsh_setting *")
    while lib.vsh_setting_get(len(found), setting):
        found.append(told(setting[0], "vsh_setting"))
    return found


def _setting_text(value: Any) -> bytes:
    if isinstance(value, (bool, numpy.bool_)):
        return b"true" if value else b"false"
    if isinstance(value, str):
        return value.encode()
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return b",".join(_setting_text(v) for v in value)
    if isinstance(value, (float, numpy.floating)):
        return repr(float(value)).encode()
    return str(value).encode()


def _option(name: str) -> str:
    return name if "." in name else "--" + name.replace("_", "-")


def _known(name: str, owners: Sequence[str]) -> List[types.Setting]:
    found = [s for s in settings() if s.owner in owners and (s.key == name or "--" + s.option == _option(name))]
    if not found:
        names = ", ".join(s.option.replace("-", "_") for s in settings() if s.owner in owners)
        raise TypeError(f"no setting {name!r}; there are {names}")
    return found


def _selection(filled: Filled, struct: Any, given: Mapping[str, Sequence[str]]) -> None:
    for member, count in (("only", "only_count"), ("except", "except_count")):
        patterns = given.get(member, given.get(member + "_", ()))
        patterns = [patterns] if isinstance(patterns, str) else patterns
        names = ffi.new("char *[]", [filled.text(p, member) for p in patterns] or 1)
        filled.keeps.append(names)
        setattr(struct, member, names)
        setattr(struct, count, len(patterns))


def _rules(filled: Filled, struct: Any, given: Mapping[str, str]) -> None:
    rules = ffi.new("vsh_solidity_rule[]", [
        dict(pattern=filled.text(p, "solidity"), solidity=constant("VSH_SOLIDITY_", s, "solidity")) for p, s in given.items()] or 1)
    filled.keeps.append(rules)
    struct.solidity, struct.solidity_count = rules, len(given)


def _moved(struct: Any, given: Any) -> None:
    moved = matrix(given)
    struct.transform = [1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0] if moved is None else list(moved.flat)


def _caster(given: Any) -> Filled:
    """``vsh_caster`` of a path (.vdb: a level set, else a mesh), an Sdf, or a dict of its members."""
    if isinstance(given, Sdf):
        given = dict(sdf=given)
    elif isinstance(given, (str, bytes, os.PathLike)):
        given = dict(path=given)
    elif not isinstance(given, Mapping):
        raise TypeError(f"casters: expected a path, a vdbshade.Sdf or a dict, got {type(given).__name__}")
    given = dict(given)
    sdf, spheres = given.pop("sdf", None), given.pop("spheres", None)
    objects, rules, moved = given.pop("objects", {}), given.pop("solidity", {}), given.pop("transform", None)
    one_sided = given.pop("one_sided", ())
    vdb = os.fsencode(given.get("path") or "").endswith(b".vdb")
    kind = given.pop("type", "sdf" if sdf is not None else "spheres" if spheres is not None else "vdb" if vdb else "mesh")
    filled = Filled("vsh_caster", dict(type=kind))
    struct = filled.pointer
    for name, value in given.items():
        filled.set(struct, "vsh_caster", name, value)
    _moved(struct, moved)
    if sdf is not None:
        struct.sdf = sdf.struct[0]
        filled.keeps.append(sdf)
    if spheres is not None:
        balls = array(spheres, numpy.float64, (None, 4), "spheres")
        filled.keeps.append(pointer(balls))
        struct.spheres, struct.sphere_count = filled.keeps[-1], len(balls)
    _selection(filled, struct.objects, objects)
    _rules(filled, struct, rules)
    patterns = [one_sided] if isinstance(one_sided, str) else one_sided
    filled.keeps.append(ffi.new("char *[]", [filled.text(p, "one_sided") for p in patterns] or 1))
    struct.one_sided, struct.one_sided_count = filled.keeps[-1], len(patterns)
    return filled


def _receiver(given: Any) -> Filled:
    given = dict(given) if isinstance(given, Mapping) else dict(path=given)
    moved, objects, density = given.pop("transform", None), given.pop("objects", {}), given.pop("density", {})
    filled = Filled("vsh_receiver", given)
    _moved(filled.pointer, moved)
    _selection(filled, filled.pointer.objects, objects)
    rules, keeps = density_rules(density)
    filled.keeps += [rules, keeps]
    filled.pointer.density, filled.pointer.density_count = rules, len(density)
    return filled


class Scene:
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

    def __init__(self, path: "str | os.PathLike[str] | None" = None, *, casters: Optional[Sequence[Any]] = None,
                 receivers: Optional[Sequence[Any]] = None, lights: Optional[Sequence[Light]] = None,
                 solidity: Optional[Mapping[str, str]] = None, run: Optional[Run] = None, **settings: Any) -> None:
        self._filled = Filled("vsh_scene")
        self.struct = self._filled.pointer
        if path is not None:
            self._file = make(lib.vsh_scene_free, lib.vsh_scene_read, path_of(path, "path"), RUN, place("vsh_scene"), run=run)
            self.struct[0] = self._file[0]
        if receivers is not None:
            made = [_receiver(r) for r in receivers]
            self._filled.keeps.append(made)
            self._receivers = ffi.new("vsh_receiver[]", [r.pointer[0] for r in made] or 1)
            self.struct.receiver_count = len(made)
        else:
            self._receivers = ffi.new("vsh_receiver[]", max(self.struct.receiver_count, 1))
            for i in range(self.struct.receiver_count):
                self._receivers[i] = self.struct.receivers[i]
        self.struct.receivers = self._receivers
        if casters is not None:
            parts = [_caster(c) for c in casters]
            self._casters = ffi.new("vsh_caster[]", [c.pointer[0] for c in parts] or 1)
            self._filled.keeps.append(parts)
            self.struct.casters, self.struct.caster_count = self._casters, len(parts)
        if lights is not None:
            self._lights, self.struct.light_count = lights_of(lights)
            self.struct.lights = self._lights
            self.struct.light_file_count = 0  # none of these are a file's
        if solidity is not None:
            _rules(self._filled, self.struct, solidity)
        for name, value in settings.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> None:
        """Sets what a setting's key ("ao.method") or option ("ao_method") says, as settings() lists them; of receivers all."""
        owners = {s.owner for s in _known(name, ("scene", "receiver"))}
        given = self._filled.text(_setting_text(value), name)
        option = _option(name).encode()
        if "scene" in owners:
            call(lib.vsh_scene_set, self.struct, option, given)
            return
        for i in range(self.struct.receiver_count):
            call(lib.vsh_receiver_set, self._receivers + i, option, given)

    @property
    def lights(self) -> List[Light]:
        return [Light._of(self.struct.lights[i]) for i in range(self.struct.light_count)]

    @property
    def light_files(self) -> List[types.LightFile]:
        """Files that its file takes lights from, and which of its lights they are."""
        return [told(self.struct.light_files[i], "vsh_light_file") for i in range(self.struct.light_file_count)]

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
        return bool(lib.vsh_scene_traceable(self.struct, self._layer(layer)))

    def marches(self, layer: Optional[str] = None) -> bool:
        """Whether a method knows its casters by their voxels alone."""
        return bool(lib.vsh_scene_marches(self.struct, self._layer(layer)))

    def check_outputs(self, outputs: "Sequence[str | os.PathLike[str]]", *, run: Optional[Run] = None) -> None:
        """ArgumentError where one of these files is there already and is read with the scene: a texture, say."""
        names = [ffi.new("char[]", path_of(o, "outputs")) for o in outputs]
        call(lib.vsh_scene_check_outputs, self.struct, ffi.new("char *[]", names or 1), len(names), RUN, run=run)

    def receiver_check(self, index: int) -> None:
        """ArgumentError and the like where a receiver's image could not be written as it asks."""
        call(lib.vsh_receiver_check, self.struct, index)

    def receiver_charts(self, index: int, meshes: Meshes, *, run: Optional[Run] = None) -> Charts:
        """The charts of a receiver's meshes, as its bake sorts them."""
        structs, count, keeps = meshes_of(meshes)
        charts = Charts.__new__(Charts)
        charts._begin(make(_freeing(lib.vsh_charts_free, (structs, keeps)), lib.vsh_receiver_charts, self.struct, index, structs, count,
                           RUN, place("vsh_charts"), run=run), count)
        charts.uv_reports = []
        return charts

    def needs_unwrap(self, index: int, meshes: Meshes, *, run: Optional[Run] = None) -> bool:
        """Whether a receiver's meshes get UVs of their own making."""
        if not 0 <= index < self.struct.receiver_count:
            raise IndexError(f"receiver {index}: there are {self.struct.receiver_count}")
        structs, count, _ = meshes_of(meshes)
        needs = ffi.new("int32_t *")
        call(lib.vsh_receiver_needs_unwrap, self._receivers + index, structs, count, RUN, needs, run=run)
        return bool(needs[0])

    def reach(self, grid: Grid, receivers_min: ArrayLike, receivers_max: ArrayLike) -> float:
        """Reach, world units, that a field of `grid` needs for receivers in a world box."""
        return lib.vsh_scene_reach(self.struct, handle_of(grid, Grid, "grid"), vector(receivers_min, 3, "receivers_min"),
                                   vector(receivers_max, 3, "receivers_max"))

    def view(self, path: "str | os.PathLike[str]", name: str = "scene", *, run: Optional[Run] = None) -> None:
        """Writes a page that shows the surface of its casters' voxels, with shadow, AO and light at the vertices
        (docs/view.md). `name` is shown."""
        call(lib.vsh_view_write_scene, path_of(path, "path"), name.encode(), self.struct, RUN, run=run)

    def bake(self, *, run: Optional[Run] = None, **options: Any) -> Any:
        """Bakes its lightmaps into arrays: a list of SceneLightmap; options of bake_scene()."""
        from ._bake_scene import bake_scene
        return bake_scene(self, arrays=True, run=run, **options).lightmaps


class Assets(Handle):
    """What a scene's files hold, each file read once."""

    def __init__(self, scene: Scene, *, run: Optional[Run] = None) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene: expected a vdbshade.Scene, got {type(scene).__name__}")
        self.scene = scene
        super().__init__(make(lib.vsh_assets_free, lib.vsh_assets_load, scene.struct, RUN, place("vsh_assets"), run=run))

    def _views(self, meshes: Any, count: int) -> List[Mesh]:
        return [Mesh._view(meshes[i], self.handle) for i in range(count)]

    def _borrowed(self, kind: Any, cdata: Any) -> Any:
        """A handle that belongs to the assets."""
        if cdata == ffi.NULL:
            return None
        thing = kind.__new__(kind)
        owner = self.handle
        Handle.__init__(thing, ffi.gc(ffi.cast(ffi.typeof(cdata), cdata), lambda _, keeps=owner: None), owner)
        return thing

    def receiver(self, index: int, page: Optional[int] = None) -> List[Mesh]:
        """The meshes of a receiver, of one of its pages; none beyond what there is."""
        count, first = ffi.new("size_t *"), ffi.new("size_t *")
        if page is None:
            return self._views(lib.vsh_assets_receiver(self.handle, index, count), count[0])
        return self._views(lib.vsh_assets_receiver_page(self.handle, index, page, first, count), count[0])

    def caster(self, index: int) -> List[Mesh]:
        """The meshes of a caster; none of one without triangles."""
        count = ffi.new("size_t *")
        return self._views(lib.vsh_assets_caster(self.handle, index, count), count[0])

    def receiver_pages(self, index: int) -> int:
        return lib.vsh_assets_receiver_pages(self.handle, index)

    def receiver_page_info(self, index: int, page: int) -> Optional[types.ReceiverPage]:
        """A page of a receiver: width and height (texels), and the object whose it is, None where it is shared; None beyond
        what there is."""
        found = ffi.new("vsh_receiver_page *")
        if not lib.vsh_assets_receiver_page_info(self.handle, index, page, found):
            return None
        return told(found[0], "vsh_receiver_page")

    def _with_numbers(self, function: Any, kind: type, index: int) -> Any:
        numbers = ffi.new("size_t **")
        found = self._borrowed(kind, function(self.handle, index, numbers))
        if found is None:
            return None
        return found, [numbers[0][i] for i in range(len(self.receiver(index)))]

    def receiver_model(self, index: int) -> Optional[Tuple[Model, List[int]]]:
        """The model of a receiver, and which of its meshes each of receiver() is."""
        return self._with_numbers(lib.vsh_assets_receiver_model, Model, index)

    def receiver_atlas(self, index: int) -> Optional[Tuple[Atlas, List[int]]]:
        """Where it is unwrapped: its atlas, and which of the atlas's meshes each of receiver() is."""
        return self._with_numbers(lib.vsh_assets_receiver_atlas, Atlas, index)

    def heights(self, index: int) -> Optional[Heights]:
        """What a caster casts by that is a direct heightfield."""
        return self._borrowed(Heights, lib.vsh_assets_heights(self.handle, index))

    def spheres(self, index: int) -> Optional[Spheres]:
        """What a caster casts by that is spheres without voxels."""
        return self._borrowed(Spheres, lib.vsh_assets_spheres(self.handle, index))

    # --- what casts

    def casters(self, layer: Optional[str] = None, *, only_layer: bool = False, run: Optional[Run] = None) -> Optional[Grid]:
        """All voxelised casters as one level set; of a layer (or with only_layer of none) those in it, None where there
        are none."""
        grid = Grid.__new__(Grid)
        if layer is None and not only_layer:
            cdata = make(lib.vsh_grid_free, lib.vsh_scene_casters, self.scene.struct, self.handle, RUN, place("vsh_grid"), run=run)
        else:
            cdata = make(lib.vsh_grid_free, lib.vsh_scene_layer_casters, self.scene.struct, self.handle, self.scene._layer(layer), RUN,
                         place("vsh_grid"), run=run)
        if cdata is None:
            return None
        Handle.__init__(grid, cdata)
        return grid

    def triangles(self, layer: Optional[str] = None, *, run: Optional[Run] = None) -> Optional[Triangles]:
        """The triangles of the casters in a layer, or in none."""
        cdata = make(lib.vsh_triangles_free, lib.vsh_scene_triangles, self.scene.struct, self.handle, self.scene._layer(layer), RUN,
                     place("vsh_triangles"), run=run)
        return _wrapped(Triangles, cdata)

    def truth(self, *, run: Optional[Run] = None) -> Tuple[Optional[Triangles], Optional[Solids]]:
        """Its casters as rays meet them."""
        triangles, solids = place("vsh_triangles"), place("vsh_solids")
        found = call(lib.vsh_scene_truth, self.scene.struct, self.handle, RUN, triangles, solids, run=run,
                     made=(lib.vsh_triangles_free, triangles))
        return (_wrapped(Triangles, found),
                _wrapped(Solids, None if solids[0] == ffi.NULL else ffi.gc(solids[0], lib.vsh_solids_free)))

    def resolution(self, points: float, layer: Optional[str] = None) -> int:
        """Voxels along the longest side that are chosen for so many points; -1: those that the scene names, 0: none."""
        return lib.vsh_scene_resolution(self.scene.struct, self.handle, self.scene._layer(layer), points)

    def occluders(self, *, receivers_min: Optional[ArrayLike] = None, receivers_max: Optional[ArrayLike] = None,
                  grid: Optional[Grid] = None, run: Optional[Run] = None, **options: Any) -> Occluders:
        """What casts in the scene; options of vdbshade.types.SceneOccludersOptions: voxels, points, within, truth."""
        filled = Filled("vsh_scene_occluders_options", options)
        keeps: List[Any] = [self.handle, self.scene]
        for name, corner in (("receivers_min", receivers_min), ("receivers_max", receivers_max)):
            if corner is not None:
                filled.keeps.append(vector(corner, 3, name))
                setattr(filled.pointer, name, filled.keeps[-1])
        if grid is not None:
            filled.pointer.grid = handle_of(grid, Grid, "grid")
            keeps.append(grid.handle)
        return Occluders._of(make(_freeing(lib.vsh_occluders_free, keeps), lib.vsh_scene_occluders, self.scene.struct, self.handle,
                                  filled.pointer, RUN, place("vsh_occluders"), run=run))


def _wrapped(kind: Any, cdata: Any) -> Any:
    if cdata is None:
        return None
    thing = kind.__new__(kind)
    Handle.__init__(thing, cdata)
    return thing


__all__ = ["Assets", "Scene", "settings"]
