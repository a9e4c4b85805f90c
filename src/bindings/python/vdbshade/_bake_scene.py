"""Baking a scene: from its files to its lightmaps."""
from __future__ import annotations

from typing import Any, List, Mapping, Optional, Sequence

import numpy

from . import types
from ._library import RUN, Run, call, ffi, lib, note
from ._structs import Filled, told
from ._lightmap import Planes
from ._parts import words_into
from ._scene import Scene


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


def _raised(kind: Any, value: Any, traceback: Any) -> None:
    rows = traceback.tb_frame.f_locals.get("rows") if traceback is not None else None
    if isinstance(rows, _Rows):
        rows.raised = rows.raised or value
    else:
        note(kind, value, traceback)


_FAILED = 9  # VSH_ERROR_INTERNAL: bake_scene() raises the exception instead


@ffi.callback("vsh_result(void *, vsh_scene_lightmap *, vsh_image *, int32_t, int32_t, float **, vsh_error *)", error=_FAILED,
              onerror=_raised)
def _add_rows(user: Any, lightmap: Any, image: Any, first: int, count: int, planes: Any, error: Any) -> int:
    rows = ffi.from_handle(user)
    names = [ffi.string(image.names[i]).decode() for i in range(image.channel_count)]
    if first == 0:
        shape = (lightmap.height, lightmap.width)
        rows.maps.append(SceneLightmap((name, numpy.empty(shape, numpy.float32)) for name in names))
        rows.maps[-1].told = told(lightmap[0], "vsh_scene_lightmap")
        rows.maps[-1].told.meshes = None
    for i, name in enumerate(names):
        plane = rows.maps[-1][name]
        given = numpy.frombuffer(ffi.buffer(planes[i], 4 * count * plane.shape[1]), numpy.float32)
        plane[first : first + count] = given.reshape(count, -1)
    return 0


def _options(options: Mapping[str, Any], files: Sequence[Any], words: Sequence[str]) -> Filled:
    filled = Filled("vsh_bake_options", options)
    names = ffi.new("char *[]", [filled.text(f, "files") for f in files] or 1)
    filled.pointer.files, filled.pointer.file_count = names, len(files)
    filled.keeps.append(names)
    words_into(filled, words)
    return filled


def _run_bake(function: Any, scene: Scene, options: Filled, arrays: bool, run: Optional[Run]) -> SceneBake:
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: expected a vdbshade.Scene, got {type(scene).__name__}")
    rows = _Rows()
    handle = ffi.new_handle(rows)
    if arrays:
        options.pointer.rows, options.pointer.user = _add_rows, handle
    errors = ffi.new("vsh_bake_error[]", scene.struct.light_count + 2)
    report = ffi.new("vsh_bake_report *", {"errors": errors})
    try:
        call(function, scene.struct, options.pointer, RUN, report, run=run)
    except Exception:
        if rows.raised is not None:
            raise rows.raised from None
        raise
    made = told(report[0], "vsh_bake_report")
    made.errors = [told(errors[i], "vsh_bake_error") for i in range(len(errors))]
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
    return _run_bake(lib.vsh_bake_scene, scene, _options(options, files, words), arrays, run)


def merge_scene(scene: Scene, *, arrays: bool = False, files: Sequence[Any] = (), run: Optional[Run] = None,
                **options: Any) -> SceneBake:
    """Merges the parts of all shards that bake_scene() wrote for this scene and these options (`parts`, `shard_count`; 0: as
    many as there are). The result has the same bits as one bake."""
    return _run_bake(lib.vsh_merge_scene, scene, _options(options, files, ()), arrays, run)


def forecast_scene(scene: Scene, *, run: Optional[Run] = None, **options: Any) -> types.BakeForecast:
    """Forecasts texels, voxels and memory of bake_scene()."""
    forecast = ffi.new("vsh_bake_forecast *")
    call(lib.vsh_forecast_scene, scene.struct, _options(options, (), ()).pointer, RUN, forecast, run=run)
    return told(forecast[0], "vsh_bake_forecast")


__all__ = ["SceneBake", "SceneLightmap", "bake_scene", "forecast_scene", "merge_scene"]
