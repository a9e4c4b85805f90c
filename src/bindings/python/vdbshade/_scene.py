"""Scenes and their bakes, flat scenes; lightmap UVs, lit assets and pages that show them; comparing bakes."""
from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._core import (array, ask, borrowed, call, constant, ffi, Filled, Floats, Handle, index_of, keep, lib, note, OUT, output, pairs_of,
                    Path, path_of, pointer, record_of, Run, Struct, structs_of, text, texts_of, transform as matrix,
                    Unpack, vector, words, words_of_bits)
from ._casters import (Attributes, attributes_of, Grid, Light, lights_of, Mesh, Meshes, meshes_of, Model, names_of, Occluders, rules_of, Sdf)
from ._shading import Charts, Planes

__all__ = ["Assets", "Atlas", "AtlasMesh", "Comparison", "FlatScene", "LitImage", "Measures", "Scene", "SceneBake",
           "SceneLightmap", "bake_scene", "compare", "compare_accuracy", "compare_files", "file_digest", "flat_light_name",
           "forecast_scene", "lit_is_output", "lit_write", "merge_scene", "part_words", "provenance", "reader_confinement",
           "settings", "unwrap", "version", "view_write"]

# --- lightmap UVs, assets with their light, and pages that show them


class AtlasMesh:
    """One mesh in the atlas; arrays are views.

    Attributes
    ----------
    uvs : array of float32, shape (vertices, 2)
        0 … 1 of the chart's page, v up
    sources : array of uint32, shape (vertices,)
        the vertex of the mesh that each is a copy of
    indices : array of uint32, shape (triangles, 3)
        the mesh's triangles in their order
    charts : array of uint32, shape (triangles,)
        2^32 - 1 for a triangle without area
    """

    def __init__(self, struct: Any, owner: Any) -> None:
        self.struct = struct
        n, m = struct.vertex_count, struct.triangle_count
        self.uvs = borrowed(struct.uvs, (n, 2), numpy.float32, owner)
        self.sources = borrowed(struct.sources, (n,), numpy.uint32, owner)
        self.indices = borrowed(struct.indices, (m, 3), numpy.uint32, owner)
        self.charts = borrowed(struct.charts, (m,), numpy.uint32, owner)

    def of(self, mesh: Mesh) -> Mesh:
        """The mesh that it was made from, with the atlas's vertices and UVs."""
        normals = None if mesh.normals is None else mesh.normals[self.sources]
        return Mesh(mesh.positions[self.sources], self.indices, normals=normals, uvs=self.uvs, transform=mesh.transform,
                    name=mesh.name or "mesh", object_name=mesh.object_name, object=mesh.object, solidity=mesh.solidity, alpha=mesh.alpha,
                    one_sided=mesh.one_sided, material_name=mesh.material_name, mask=mesh.mask,
                    mask_uvs=None if mesh.mask_uvs is None else mesh.mask_uvs[self.sources])


class Atlas(Handle, kind="vsh_atlas"):
    """Charts of meshes, packed into ``info.pages`` pages. A sequence of AtlasMesh."""

    info: types.AtlasInfo

    def page(self, index: int) -> types.AtlasPage:
        """A page's size in texels, its texels_per_unit, the covered share and its first mesh."""
        page: types.AtlasPage = ask(lib.vsh_atlas_page_view, self, index_of(index, self.info.pages, "page", "the atlas has"))
        return page

    @property
    def charts(self) -> List[types.AtlasChart]:
        """All charts: page, mesh, stretch, area and the texels that each touches."""
        charts = lib.vsh_atlas_charts(self.handle)
        return [record_of(charts[i]) for i in range(self.info.charts)]

    def __len__(self) -> int:
        return self.info.meshes

    def __getitem__(self, index: int) -> AtlasMesh:
        view = lib.vsh_atlas_mesh_view(self.handle, index_of(index, len(self), "mesh", "the atlas has"))
        return AtlasMesh(ffi.new("vsh_atlas_mesh *", view), self.handle)


def unwrap(meshes: Meshes, *, density: Optional[ArrayLike] = None, run: Optional[Run] = None,
           **options: "Unpack[types.UnwrapOptions]") -> Atlas:
    """Cuts meshes into charts, lays them out flat, and packs them into pages.

    Parameters
    ----------
    density : array of float64, shape (meshes,), optional
        factors of texels_per_unit
    **options
        vdbshade.types.UnwrapOptions: width, height (texels of a page), max_pages, padding, texels_per_unit (0: the most
        that fit), max_stretch, keep_uvs ("always" lays out anew, "keep" keeps UVs that can serve), atlas
        ("shared", or "objects": each has a page of its own), fit_pages (pages no larger than they need be)
    """
    structs, count = meshes_of(meshes)
    factors = None if density is None else array(density, numpy.float64, (count,), "density")
    return Atlas(call(lib.vsh_unwrap, structs, count, Filled("vsh_unwrap_options", options, density=factors), OUT, run=run))


class LitImage(Struct, kind="vsh_lit_image"):
    """An image of one page for one purpose.

    Parameters
    ----------
    purpose : str
        "occlusion", "lightmap" or "preview"
    image : bytes or array of float32, shape (height, width) or (height, width, 3)
        a PNG file's bytes, or linear planes, row 0 on top
    page : int
    **options
        vdbshade.types.LitImage: bits, intensity
    """

    def __init__(self, purpose: types.LitPurpose, image: Union[bytes, ArrayLike], page: int = 0, *, bits: int = 0, intensity: float = 0.0) -> None:
        filled = Filled("vsh_lit_image", purpose=purpose, page=page, bits=bits, intensity=intensity)
        self.struct = filled.struct
        if isinstance(image, bytes):
            filled.fill(dict(png=ffi.from_buffer(image), png_size=len(image)))
            return
        planes = numpy.asarray(image)
        if planes.ndim == 2:
            planes = planes[:, :, None]
        if planes.ndim != 3 or planes.shape[2] not in (1, 3):
            raise ValueError(f"image: expected shape (height, width) or (height, width, 3), got {planes.shape}")
        pointers = [pointer(array(planes[:, :, c], numpy.float32, planes.shape[:2], "image")) for c in range(planes.shape[2])]
        filled.fill(dict(height=planes.shape[0], width=planes.shape[1], channel_count=len(pointers),
                         channels=keep(ffi.new("float *[]", pointers), pointers)))


def lit_write(output: Path, model: Model, images: Sequence[LitImage], *, path: Optional[Path] = None,
              atlas: Optional[Atlas] = None, uv_sets: Optional[Sequence[int]] = None, run: Optional[Run] = None) -> None:
    """Writes a .glb or .gltf with its light (docs/lit.md).

    Parameters
    ----------
    model : Model
        the model in `path`
    images : sequence of LitImage
    path : path, optional
        the model's file: a glTF is kept whole; None: a document is made of the model
    atlas : Atlas, optional
        new UVs of the model's meshes; None: they have their lightmap in a set of their own
    uv_sets : sequence of int, optional
        without an atlas: the set of each mesh; -1: it stays unlit; None: as Model.mesh() chooses
    """
    if not isinstance(model, Model):
        raise TypeError(f"model: expected a vdbshade.Model, got {type(model).__name__}")
    options = Filled("vsh_lit_options", images=images)
    meshes = None
    if atlas is not None:
        if len(atlas) != len(model):
            raise ValueError(f"atlas: of {len(atlas)} meshes, the model has {len(model)}")
        charts = atlas.charts
        options.fill(dict(chart_pages=ffi.new("uint32_t[]", [chart.page for chart in charts] or 1), chart_count=len(charts)))
        meshes = [{name: getattr(atlas[i].struct, name) for name in ("uvs", "sources", "indices", "charts", "vertex_count", "triangle_count")}
                  for i in range(len(model))]
    elif uv_sets is not None:
        if len(uv_sets) != len(model):
            raise ValueError(f"uv_sets: {len(uv_sets)} of {len(model)} meshes")
        meshes = [dict(sources=numpy.arange(len(mesh.positions), dtype=numpy.uint32), vertex_count=len(mesh.positions),
                       indices=mesh.indices, triangle_count=len(mesh.indices), uv_set=uv_set) for mesh, uv_set in zip(model, uv_sets)]
    call(lib.vsh_lit_write, None if path is None else path_of(path, "path"), model,
         None if meshes is None else structs_of("vsh_lit_mesh", meshes), options, path_of(output, "output"), run=run)


def lit_is_output(path: Path) -> bool:
    """Whether a path has the ending of a file that lit_write() can write."""
    return bool(ask(lib.vsh_lit_is_output, path_of(path, "path")))


def view_write(path: Path, model: Path, planes: Any = (), *, uv_set: int = -1,
               name: Optional[str] = None, other: "Optional[types.ViewBake]" = None, run: Optional[Run] = None) -> None:
    """Writes one HTML page that shows a baked mesh in a browser (docs/view.md).

    Parameters
    ----------
    model : path
        the mesh's file
    planes : path or sequence of paths
        image files of its bake, one a page; none: its light is in its materials
    other : dict, optional
        a second bake beside it: model, planes, uv_set, name
    """
    first = Filled("vsh_view_bake", model=model, planes=planes, uv_set=uv_set, name=name)
    second = None if other is None else Filled("vsh_view_bake", other)
    call(lib.vsh_view_write, path_of(path, "path"), first, second, run=run)


# --- scenes and their settings


def settings() -> List[types.Setting]:
    """All settings of scenes, receivers and flat scenes, with their help, range and default."""
    found: List[types.Setting] = []
    setting = ffi.new("vsh_setting *")
    while lib.vsh_setting_get(len(found), setting):
        found.append(record_of(setting))
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


def _placed(given: Mapping[str, Any]) -> Dict[str, Any]:
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
    """A scene from a file (docs/scene.md) or from arguments.

    Parameters
    ----------
    path : path, optional
        a scene's JSON file; other arguments override it
    casters : sequence, optional
        each a path (.vdb or a mesh), an Sdf, or a dict of members of ``vsh_caster`` (vdbshade.types.Caster);
        `solidity` a mapping as below, `one_sided` patterns
    receivers : sequence, optional
        each a mesh's path, or a dict of members of ``vsh_receiver`` (vdbshade.types.Receiver): path, output, width, …;
        `density` a mapping of patterns to factors of texels_per_unit, {"wall*": 2.0}
    lights : sequence of Light, optional
    layers : sequence of dict, optional
        members of ``vsh_scene_layer`` (vdbshade.types.SceneLayer): name, softness, method, …; casters name their `layer`
    solidity : mapping, optional
        how meshes cast, by patterns: {"wall*": "shell"}
    **settings
        by the names of the command line's options (settings()): max_error=0.01, ao="auto", size=512. Those of
        receivers are of all of them

    Examples
    --------
    >>> scene = Scene(casters=["cloister.glb"], receivers=["cloister.glb"], lights=[Light(angle=0.05)], width=256, height=256)
    >>> lightmap, = scene.bake()
    """

    def __init__(self, path: Optional[Path] = None, *, casters: Optional[Sequence[Any]] = None,
                 receivers: Optional[Sequence[Any]] = None, lights: Optional[Sequence[Light]] = None,
                 layers: "Optional[Sequence[types.SceneLayer]]" = None, solidity: Optional[Mapping[str, types.Solidity]] = None,
                 run: Optional[Run] = None, **settings: Any) -> None:
        self._read(lib.vsh_scene_read, path, run)
        given: Dict[str, Any] = {}
        given["receivers"] = [self.struct.receivers + i for i in range(self.struct.receiver_count)] if receivers is None else [
            _receiver_of(r) for r in receivers]
        given["casters"] = None if casters is None else [_caster_of(c) for c in casters]
        if lights is not None:
            given["lights"], given["light_count"] = lights_of(lights)
        given["layers"] = layers
        given["solidity"] = None if solidity is None else rules_of(solidity, "solidity")
        self._filled.fill(given)
        for name, value in settings.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> None:
        """Sets a setting by its key ("ao.method") or option ("ao_method"), as settings() lists them, for all receivers."""
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
    def layers(self) -> List[str]:
        """Names of its layers."""
        return [ffi.string(self.struct.layers[i].name).decode() for i in range(self.struct.layer_count)]

    # --- queries

    def check_outputs(self, outputs: Sequence[Path], *, run: Optional[Run] = None) -> None:
        """ArgumentError if one of these files exists and is an input of the scene, such as a texture."""
        paths = list(outputs)
        call(lib.vsh_scene_check_outputs, self, texts_of(paths, "outputs"), len(paths), run=run)

    def receiver_check(self, index: int) -> None:
        """Raises an error if a receiver's image could not be written by its settings."""
        call(lib.vsh_receiver_check, self, index)

    def receiver_charts(self, index: int, meshes: Meshes, *, run: Optional[Run] = None) -> Charts:
        """The charts of a receiver's meshes, as its bake makes them."""
        structs, count = meshes_of(meshes)
        charts = Charts.__new__(Charts)
        charts._begin(call(lib.vsh_receiver_charts, self, index, structs, count, OUT, run=run, keeps=structs), count)
        charts.uv_reports = []
        return charts

    def needs_unwrap(self, index: int, meshes: Meshes, *, run: Optional[Run] = None) -> bool:
        """Whether a receiver's meshes get new UVs."""
        if not 0 <= index < self.struct.receiver_count:
            raise IndexError(f"receiver {index}: there are {self.struct.receiver_count}")
        return bool(call(lib.vsh_receiver_needs_unwrap, self._receiver(index), *meshes_of(meshes), OUT, run=run))

    def view(self, path: Path, name: str = "scene", *, run: Optional[Run] = None) -> None:
        """Writes a page that shows the surface of its casters' voxels, with shadow, AO and light at the vertices
        (docs/view.md). `name` is shown."""
        call(lib.vsh_view_write_scene, path_of(path, "path"), name, self, run=run)

    def bake(self, *, run: Optional[Run] = None, **options: "Unpack[types.BakeOptions]") -> "List[SceneLightmap]":
        """Bakes its lightmaps into arrays; options of bake_scene()."""
        return bake_scene(self, arrays=True, run=run, **options).lightmaps


class Assets(Handle, kind="vsh_assets"):
    """The contents of a scene's files, each file read once."""

    info: types.AssetsInfo

    def __init__(self, scene: Scene, *, run: Optional[Run] = None) -> None:
        super().__init__(call(lib.vsh_assets_load, scene, OUT, run=run))
        self.scene = scene

    def _meshes(self, function: Any, *which: Any) -> List[Mesh]:
        count = ffi.new("size_t *")
        meshes = ask(function, self, *which, count)
        return [Mesh._view(meshes[i], self.handle) for i in range(count[0])]

    def receiver(self, index: int) -> List[Mesh]:
        """The meshes of a receiver; empty beyond the last."""
        return self._meshes(lib.vsh_assets_receiver, index)

    def caster(self, index: int) -> List[Mesh]:
        """The meshes of a caster; none for a caster without triangles."""
        return self._meshes(lib.vsh_assets_caster, index)

    def casters(self, *, run: Optional[Run] = None) -> Grid:
        """All voxelised casters, in all layers, as one level set."""
        return Grid._of(call(lib.vsh_scene_casters, self.scene, self, OUT, run=run))

    def occluders(self, *, receivers_min: Optional[ArrayLike] = None, receivers_max: Optional[ArrayLike] = None,
                  grid: Optional[Grid] = None, run: Optional[Run] = None,
                  **options: "Unpack[types.SceneOccludersOptions]") -> Occluders:
        """The scene's casters; options of vdbshade.types.SceneOccludersOptions: voxels, points, within, truth."""
        filled = Filled("vsh_scene_occluders_options", options, grid=grid)
        for name, corner in (("receivers_min", receivers_min), ("receivers_max", receivers_max)):
            filled.fill({name: None if corner is None else vector(corner, 3, name)})
        return Occluders._of(call(lib.vsh_scene_occluders, self.scene, self, filled, OUT, run=run,
                                  keeps=(self.handle, self.scene, filled.keeps)))


# --- baking a scene, whole or in parts; where outputs come from, and who parses files


class SceneLightmap(Planes):
    """A lightmap of a scene: planes by their channels' names, "shadow.sun", "ao", "irradiance.R", "A": arrays of float32 of
    shape (height, width), row 0 at v = 1.

    Attributes
    ----------
    told : vdbshade.types.SceneLightmap
        its receiver, output, page and counts
    """

    told: types.SceneLightmap


class SceneBake:
    """A bake's results.

    Attributes
    ----------
    report : vdbshade.types.BakeReport
        times, texels, rays; `errors` is a list of vdbshade.types.BakeError: of each light, of AO, of the sky
    lightmaps : list of SceneLightmap
        empty if files were written
    """

    def __init__(self, report: types.BakeReport, lightmaps: List[SceneLightmap]) -> None:
        self.report, self.lightmaps = report, lightmaps


class _Rows:
    """Receives rows, in the thread that bakes."""

    def __init__(self) -> None:
        self.maps: List[SceneLightmap] = []
        self.raised: Optional[BaseException] = None


_FAILED = 9  # VSH_ERROR_INTERNAL: bake_scene() raises the exception instead


@ffi.callback("vsh_result(void *, vsh_scene_lightmap *, vsh_image *, int32_t, int32_t, float **, vsh_error *)", error=_FAILED,
              onerror=note)
def _add_rows(user: Any, lightmap: Any, image: Any, first: int, count: int, planes: Any, error: Any) -> int:
    running = ffi.from_handle(user)
    names = [ffi.string(image.names[i]).decode() for i in range(image.channel_count)]
    if first == 0:
        shape = (lightmap.height, lightmap.width)
        running.maps.append(SceneLightmap((name, numpy.empty(shape, numpy.float32)) for name in names))
        running.maps[-1].told = record_of(lightmap)
        running.maps[-1].told.meshes = None
    for i, name in enumerate(names):
        plane = running.maps[-1][name]
        given = numpy.frombuffer(ffi.buffer(planes[i], 4 * count * plane.shape[1]), numpy.float32)
        plane[first : first + count] = given.reshape(count, -1)
    return 0


def _bake(function: Any, scene: Scene, arrays: bool, run: Optional[Run], options: Mapping[str, Any], **more: Any) -> SceneBake:
    rows = _Rows()
    filled = Filled("vsh_bake_options", options, **more)
    if arrays:
        filled.fill(dict(rows=_add_rows, user=ffi.new_handle(rows)))
    errors = ffi.new("vsh_bake_error[]", scene.struct.light_count + 2 if isinstance(scene, Scene) else 2)
    report = ffi.new("vsh_bake_report *", {"errors": errors})
    call(function, scene, filled, report, run=run, watched=rows)
    made = record_of(report)
    made.errors = [record_of(errors[i]) for i in range(len(errors))]
    return SceneBake(made, rows.maps)


def bake_scene(scene: Scene, *, arrays: bool = False, files: Sequence[Any] = (), words: Sequence[str] = (),
               run: Optional[Run] = None, **options: "Unpack[types.BakeOptions]") -> SceneBake:
    """Bakes a scene.

    Parameters
    ----------
    scene : Scene
    arrays : bool
        return the lightmaps as arrays; False: write files at the receivers' outputs
    files : sequence of paths, optional
        inputs that outputs name, in addition to those of the scene
    words : sequence of str, optional
        stored in a part (part_words())
    **options
        vdbshade.types.BakeOptions: scratch, invalid_picture, lit_preview, …; shard, shard_count and parts share a
        bake between machines
    """
    if isinstance(words, str):
        raise TypeError("words: expected a list of str, got str")
    return _bake(lib.vsh_bake_scene, scene, arrays, run, options, files=files, words=words)


def merge_scene(scene: Scene, *, arrays: bool = False, files: Sequence[Any] = (), run: Optional[Run] = None,
                **options: "Unpack[types.BakeOptions]") -> SceneBake:
    """Merges the parts of all shards that bake_scene() wrote for this scene and these options (`parts`, `shard_count`; 0: as
    many as there are). The result has the same bits as one bake."""
    return _bake(lib.vsh_merge_scene, scene, arrays, run, options, files=files)


def forecast_scene(scene: Scene, *, run: Optional[Run] = None, **options: "Unpack[types.BakeOptions]") -> types.BakeForecast:
    """Forecasts texels, voxels and memory of bake_scene()."""
    forecast: types.BakeForecast = call(lib.vsh_forecast_scene, scene, Filled("vsh_bake_options", options), OUT, run=run)
    return forecast


def part_words(parts: Path, shard_count: int = 0, *, run: Optional[Run] = None) -> List[str]:
    """The words stored in the first of `shard_count` parts (0: as many as there are), all of which must exist. Do not trust them:
    anybody may have written the part."""
    words, count = call(lib.vsh_part_words, path_of(parts, "parts"), shard_count, OUT, OUT, run=run)
    owned = ffi.gc(words, lib.vsh_part_words_free)
    return [text(owned[i]) or "" for i in range(count)]


def version() -> str:
    """The library's version, "0.2.0"."""
    return str(ask(lib.vsh_version))


def file_digest(path: Path, *, run: Optional[Run] = None) -> str:
    """SHA-256 of a file's bytes, 64 hexadecimal digits."""
    digest = ffi.new("char[65]")
    call(lib.vsh_file_digest, path_of(path, "path"), digest, run=run)
    return str(ffi.string(digest).decode())


def reader_confinement(*, run: Optional[Run] = None) -> List[str]:
    """How the reader that parses files is confined on this system: some of "limits", "calls", "files"."""
    return words_of_bits("vsh_confinement", call(lib.vsh_reader_confinement, OUT, run=run))


def provenance(scene: Optional[Scene] = None, *, files: Sequence[Path] = (), command: Optional[str] = None,
               voxel_size: float = 0.0, attributes: Optional[Attributes] = None, has_triangles: bool = False, lightmap: bool = False,
               run: Optional[Run] = None) -> Dict[str, str]:
    """Describes how an output was made, as lines of text that it carries: version, methods, lights, hashes of inputs."""
    source = Filled("vsh_provenance_source", command=command, voxel_size=voxel_size, has_triangles=has_triangles, lightmap=lightmap,
                    files=files, attributes=attributes_of(attributes), scene=scene)
    made = call(lib.vsh_provenance_create, source, OUT, run=run)
    count = ffi.new("size_t *")
    return pairs_of(lib.vsh_provenance_attributes(made, count), count[0])


# --- flat scenes: light maps of a plane


def flat_light_name(type: int) -> Optional[str]:
    """The name of a type of light in a plane: "directional", "disc" or "spot". None if no type has this number."""
    name: Optional[str] = ask(lib.vsh_get_name, lib.VSH_NAMES_FLAT_LIGHT, type)
    return name


class FlatScene(SceneFile, kind="vsh_flat_scene"):
    """A flat scene's file (docs/flat.md); settings by the names of `vdbshade flat`'s options."""

    def __init__(self, path: Path, *, run: Optional[Run] = None, **settings: Any) -> None:
        self._read(lib.vsh_flat_scene_read, path, run)
        for name, value in settings.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> None:
        """Sets a setting by its key or option."""
        known_settings(name, ("flat",))
        call(lib.vsh_flat_scene_set, self, option_of(name), self._filled.text(setting_text(value), name))

    @property
    def shape(self) -> Tuple[int, int]:
        return self.struct.options.height, self.struct.options.width

    def bake(self, *, irradiance: bool = True, out: Optional[Mapping[str, Floats]] = None,
             run: Optional[Run] = None) -> Dict[str, Floats]:
        """Bakes its light map.

        Parameters
        ----------
        irradiance : bool
            "irradiance.R", ".G", ".B" too
        out : mapping, optional
            arrays of float32, of `shape`, that planes are written into, by their names

        Returns
        -------
        dict
            arrays of float32 of shape (height, width), row 0 on top: "shadow.NAME" of each light, "A" (coverage)
        """
        names = [f"shadow.{name}" for name in names_of(self.struct.lights, self.struct.light_count)]
        wanted = names + ["A"] + ([f"irradiance.{c}" for c in "RGB"] if irradiance else [])
        unknown = set(out or {}) - set(wanted)
        if unknown:
            raise ValueError(f"out {sorted(unknown)}: there are {', '.join(wanted)}")
        planes = {n: output((out or {}).get(n), numpy.float32, self.shape, f"out[{n!r}]") for n in wanted}
        shadow = ffi.new("float *[]", [pointer(planes[n]) for n in names] or 1)
        colour = ffi.new("float *[3]", [pointer(planes[f"irradiance.{c}"]) for c in "RGB"]) if irradiance else ffi.NULL
        call(lib.vsh_flat_bake, self, ffi.new("vsh_flat_map *", [shadow, colour, pointer(planes["A"])]), run=run)
        return planes


# --- comparing baked values with golden ones


MEASURES = tuple(words("vsh_measure"))


class Measures(types.Measures):
    """Differences of values from golden ones. `value` is a dict of "nonfinite", "shift", "penumbra", "lost", "gained", "rmse",
    "p99" and "max"; NaN if a measure does not apply."""

    value: Dict[str, float]  # type: ignore[assignment]


def _measures(struct: Any) -> Measures:
    found = Measures(**record_of(struct).__dict__)
    found.value = dict(zip(MEASURES, struct.value))
    return found


def _failed(bits: int) -> List[str]:
    return [name for i, name in enumerate(MEASURES) if bits >> i & 1]


def _compared(golden: ArrayLike, values: ArrayLike, mask: Optional[ArrayLike]) -> Filled:
    shape = numpy.shape(golden)
    if len(shape) not in (2, 3):
        raise ValueError(f"golden: expected shape (height, width) or (depth, height, width), got {shape}")
    if max(shape, default=0) >= 2**31:
        raise ValueError(f"golden: {shape}: too large")
    return Filled("vsh_compared", size=list(reversed(shape)) + [1] * (3 - len(shape)), golden=array(golden, numpy.float32, shape, "golden"),
                  values=array(values, numpy.float32, shape, "values"),
                  mask=None if mask is None else array(mask, numpy.uint8, shape, "mask"))


def compare(golden: ArrayLike, values: ArrayLike, mask: Optional[ArrayLike] = None, *, run: Optional[Run] = None,
            **options: "Unpack[types.CompareOptions]") -> Measures:
    """Measures how far values are from golden ones.

    Parameters
    ----------
    golden, values : array of float32, shape (height, width) or (depth, height, width)
    mask : array of bool or uint8, of that shape, optional
        compares only nonzero texels
    **options
        vdbshade.types.CompareOptions
    """
    measures = ffi.new("vsh_measures *")
    call(lib.vsh_compare, _compared(golden, values, mask), Filled("vsh_compare_options", options), measures, run=run)
    return _measures(measures[0])


def compare_accuracy(truths: Sequence[ArrayLike], values: Sequence[ArrayLike], masks: Optional[Sequence[ArrayLike]] = None, *,
                     run: Optional[Run] = None) -> types.Accuracy:
    """The error of planes of values (0 … 1) against their truths, over all planes."""
    if len(truths) != len(values) or (masks is not None and len(masks) != len(values)):
        raise ValueError(f"expected as many truths as values and masks, got {len(truths)} and {len(values)}")
    parts = [_compared(t, v, None if masks is None else masks[i]) for i, (t, v) in enumerate(zip(truths, values))]
    accuracy: types.Accuracy = call(lib.vsh_compare_accuracy, structs_of("vsh_compared", parts), len(parts), OUT, run=run)
    return accuracy


class Comparison:
    """The result of comparing two files.

    Attributes
    ----------
    alike : bool
    channels : list of vdbshade.types.ChannelComparison
        `failed` are names of measures
    problems : list of str
    """

    def __init__(self, cdata: Any) -> None:
        self.channels: List[types.ChannelComparison] = []
        self.problems: List[str] = []
        while lib.vsh_comparison_channel(cdata, len(self.channels)) != ffi.NULL:
            struct = lib.vsh_comparison_channel(cdata, len(self.channels))[0]
            channel = record_of(struct)
            channel.measures, channel.failed = _measures(struct.measures), _failed(struct.failed)
            self.channels.append(channel)
        while True:
            problem = ask(lib.vsh_comparison_problem, cdata, len(self.problems))
            if problem is None:
                break
            self.problems.append(problem)
        self.alike: bool = not self.problems and all(channel.alike for channel in self.channels)

    def __bool__(self) -> bool:
        return self.alike

    def __repr__(self) -> str:
        return f"<vdbshade.Comparison: {'alike' if self.alike else 'not alike'}, {len(self.channels)} channels, problems {self.problems}>"


def compare_files(golden: Path, fresh: Path, *, limits: Optional[Mapping[types.Measure, float]] = None,
                  run: Optional[Run] = None, **options: "Unpack[types.CompareFilesOptions]") -> Comparison:
    """Compares two images channel by channel, or two .vdb files grid by grid.

    Parameters
    ----------
    limits : mapping, optional
        by measures' names, of all channels
    **options
        vdbshade.types.CompareFilesOptions: tolerances, coverage, noise, padding, …
    """
    filled = Filled("vsh_compare_files_options", options)
    for name, value in (limits or {}).items():
        filled.struct.limits[constant("vsh_measure", name, "limits")] = value
    return Comparison(call(lib.vsh_compare_files, path_of(golden, "golden"), path_of(fresh, "fresh"), filled, OUT, run=run))
