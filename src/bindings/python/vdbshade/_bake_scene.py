"""Baking a scene, from its files to its lightmaps, in one process or in parts; where outputs come from, and who parses files."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence

import numpy

from . import types
from ._calls import OUT, Run, ask, call, note
from ._grid import Attributes, attributes_of
from ._library import Path, ffi, lib, text
from ._lightmap import Planes
from ._scene import Scene
from ._structs import Filled, constant, pairs_of, path_of, structs_of, told, words_of_bits


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
        running.maps[-1].told = told(lightmap)
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
    made = told(report)
    made.errors = [told(errors[i]) for i in range(len(errors))]
    return SceneBake(made, rows.maps)


def bake_scene(scene: Scene, *, arrays: bool = False, files: Sequence[Any] = (), words: Sequence[str] = (),
               run: Optional[Run] = None, **options: Any) -> SceneBake:
    """Bakes a scene.

    Parameters
    ----------
    scene : Scene
    arrays : bool
        return the lightmaps as arrays; False: write files at the receivers' outputs
    files : sequence of paths, optional
        inputs that outputs name, beside those of the scene
    words : sequence of str, optional
        stored in a part (part_words())
    **options
        vdbshade.types.BakeOptions: scratch, invalid_picture, lit_preview, shard, shard_count, parts (a part of a
        bake that machines share), …
    """
    if isinstance(words, str):
        raise TypeError("words: expected a list of str, got str")
    return _bake(lib.vsh_bake_scene, scene, arrays, run, options, files=files, words=words)


def merge_scene(scene: Scene, *, arrays: bool = False, files: Sequence[Any] = (), run: Optional[Run] = None,
                **options: Any) -> SceneBake:
    """Merges the parts of all shards that bake_scene() wrote for this scene and these options (`parts`, `shard_count`; 0: as
    many as there are). The result has the same bits as one bake."""
    return _bake(lib.vsh_merge_scene, scene, arrays, run, options, files=files)


def forecast_scene(scene: Scene, *, run: Optional[Run] = None, **options: Any) -> types.BakeForecast:
    """Forecasts texels, voxels and memory of bake_scene()."""
    return call(lib.vsh_forecast_scene, scene, Filled("vsh_bake_options", options), OUT, run=run)


def part_words(parts: Path, shard_count: int = 0, *, run: Optional[Run] = None) -> List[str]:
    """The words that were kept in the first part that is there, of `shard_count` shards (0: as many as there are). A part is
    whatever somebody has put there: words are text that its writer chose."""
    words, count = call(lib.vsh_part_words, path_of(parts, "parts"), shard_count, OUT, OUT, run=run)
    owned = ffi.gc(words, lib.vsh_part_words_free)
    return [text(owned[i]) or "" for i in range(count)]


def version() -> str:
    """The library's, "0.2.0"."""
    return ask(lib.vsh_version)


def isa_available(isa: str) -> bool:
    """Whether this machine has an instruction set: "base", "avx2", "avx512"."""
    return bool(lib.vsh_isa_available(constant("VSH_ISA_", isa, "isa")))


def file_digest(path: Path, *, run: Optional[Run] = None) -> str:
    """SHA-256 of a file's bytes, 64 hexadecimal digits."""
    digest = ffi.new("char[65]")
    call(lib.vsh_file_digest, path_of(path, "path"), digest, run=run)
    return ffi.string(digest).decode()


def reader_confinement(*, run: Optional[Run] = None) -> List[str]:
    """How the reader that parses files is confined here: of "limits", "calls", "files"."""
    return words_of_bits("VSH_CONFINED_", call(lib.vsh_reader_confinement, OUT, run=run))


def provenance(scene: Optional[Scene] = None, *, files: Sequence[Path] = (), command: Optional[str] = None,
               voxel_size: float = 0.0, attributes: Optional[Attributes] = None, has_triangles: bool = False, lightmap: bool = False,
               run: Optional[Run] = None) -> Dict[str, str]:
    """Describes how an output was made, as lines of text that it carries: version, methods, lights, hashes of inputs."""
    source = Filled("vsh_provenance_source", command=command, voxel_size=voxel_size, has_triangles=has_triangles, lightmap=lightmap,
                    files=files, attributes=attributes_of(attributes), scene=scene)
    made = call(lib.vsh_provenance_create, source, OUT, run=run)
    count = ffi.new("size_t *")
    return pairs_of(lib.vsh_provenance_attributes(made, count), count[0])


def provenance_max_error(attributes: Mapping[str, str], channel: str) -> float:
    """The standard error that a channel was made to, as a file's attributes say; NaN where they don't."""
    lines = attributes_of(attributes)
    return ask(lib.vsh_provenance_max_error, structs_of("vsh_attribute", lines), len(lines), channel)
