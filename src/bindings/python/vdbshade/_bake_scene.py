"""Baking a scene: from its files to its lightmaps, in one call or step by step."""
from __future__ import annotations

from typing import Any, List, Mapping, Optional, Sequence

import numpy

from . import types
from ._library import RUN, Handle, Run, call, ffi, lib, make, note, place
from ._structs import Filled, told
from ._lightmap import Planes
from ._parts import words_into
from ._scene import Assets, Scene


class SceneLightmap(Planes):
    """A lightmap of a scene: planes by their channels' names, "shadow.sun", "ao", "irradiance.R", "A": arrays of float32 of
    shape (height, width), row 0 at v = 1.

    Attributes
    ----------
    told : vdbshade.types.JobLightmap
        its receiver, output, page and counts
    """

    told: types.JobLightmap


class _Sink:
    """Takes rows, in the thread that bakes."""

    def __init__(self) -> None:
        self.maps: List[SceneLightmap] = []
        self.row = 0
        self.names: List[str] = []
        self.raised: Optional[BaseException] = None


def _raised(kind: Any, value: Any, traceback: Any) -> None:
    sink = traceback.tb_frame.f_locals.get("sink") if traceback is not None else None
    if isinstance(sink, _Sink):
        sink.raised = sink.raised or value
    else:
        note(kind, value, traceback)


_FAILED = 9  # VSH_ERROR_INTERNAL: what was raised is told in its place


@ffi.callback("vsh_result(void *, vsh_job_lightmap *, vsh_image *, vsh_error *)", error=_FAILED, onerror=_raised)
def _begin(user: Any, lightmap: Any, image: Any, error: Any) -> int:
    sink = ffi.from_handle(user)
    sink.names = [ffi.string(image.names[i]).decode() for i in range(image.channel_count)]
    shape = (lightmap.height, lightmap.width)
    planes = SceneLightmap((name, numpy.empty(shape, numpy.float32)) for name in sink.names)
    planes.told = _told(lightmap[0])
    sink.row = 0
    sink.maps.append(planes)
    return 0


@ffi.callback("vsh_result(void *, int32_t, float **, vsh_error *)", error=_FAILED, onerror=_raised)
def _add(user: Any, rows: int, planes: Any, error: Any) -> int:
    sink = ffi.from_handle(user)
    for i, name in enumerate(sink.names):
        plane = sink.maps[-1][name]
        given = numpy.frombuffer(ffi.buffer(planes[i], 4 * rows * plane.shape[1]), numpy.float32)
        plane[sink.row : sink.row + rows] = given.reshape(rows, -1)
    sink.row += rows
    return 0


@ffi.callback("vsh_result(void *, vsh_result, vsh_error *)", error=_FAILED, onerror=_raised)
def _end(user: Any, result: int, error: Any) -> int:
    return result


def _options(options: Mapping[str, Any], files: Sequence[Any], words: Sequence[str]) -> Filled:
    filled = Filled("vsh_bake_job_options", options)
    names = ffi.new("char *[]", [filled.text(f, "files") for f in files] or 1)
    filled.pointer.files, filled.pointer.file_count = names, len(files)
    filled.keeps.append(names)
    words_into(filled, words)
    return filled


def _told(lightmap: Any) -> types.JobLightmap:
    found = told(lightmap, "vsh_job_lightmap")
    found.meshes = None
    return found


class BakeJob(Handle):
    """The lightmaps of a scene under way. Not for several threads at once.

    Parameters
    ----------
    scene : Scene
    arrays : bool
        bake() gives arrays; False: files are written at the receivers' outputs
    files : sequence of paths, optional
        inputs that outputs name, beside those that the scene does
    words : sequence of str, optional
        kept in a part as they are (part_words())
    **options
        vdbshade.types.BakeJobOptions: per_object, allow_overlap, scratch, invalid_picture, lit_preview,
        shard, shard_count, parts (a part of a bake that machines share), …
    """

    def __init__(self, scene: Scene, *, arrays: bool = False, files: Sequence[Any] = (), words: Sequence[str] = (),
                 run: Optional[Run] = None, **options: Any) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene: expected a vdbshade.Scene, got {type(scene).__name__}")
        filled = _options(options, files, words)
        self._sink: Optional[_Sink] = None
        if arrays:
            self._sink = _Sink()
            handle = ffi.new_handle(self._sink)
            rows = ffi.new("vsh_row_sink *", [ffi.sizeof("vsh_row_sink"), _begin, _add, _end, handle])
            filled.pointer.sink = rows
            filled.keeps += [handle, rows]

        def free(job: Any, keeps: Any = (scene, filled)) -> None:  # what it refers to lives until then
            lib.vsh_bake_job_free(job)

        super().__init__(make(free, lib.vsh_bake_job_create, scene.struct, filled.pointer, RUN, place("vsh_bake_job"), run=run))
        self.scene, self._options = scene, filled

    def measure(self, *, run: Optional[Run] = None) -> None:
        """Counts texels, and warns of what is wrong with UVs."""
        call(lib.vsh_bake_job_measure, self.handle, RUN, run=run)

    def prepare(self, *, run: Optional[Run] = None) -> None:
        """Makes what casts; after measure()."""
        call(lib.vsh_bake_job_prepare, self.handle, RUN, run=run)

    def run(self, *, run: Optional[Run] = None) -> List[SceneLightmap]:
        """Bakes every lightmap; after prepare(). Returns those of arrays, else none."""
        return self._rows(lib.vsh_bake_job_run, run)

    def merge(self, *, run: Optional[Run] = None) -> List[SceneLightmap]:
        """Puts the parts of all shards together that jobs of this scene and these options wrote (`parts`, `shard_count`; 0: as
        many as there are), in place of prepare() and run(): the same bits as of one bake. After measure()."""
        return self._rows(lib.vsh_bake_job_merge, run)

    def _rows(self, function: Any, run: Optional[Run]) -> List[SceneLightmap]:
        if self._sink is None:
            call(function, self.handle, RUN, run=run)
            return []
        self._sink.maps, self._sink.raised = [], None
        try:
            call(function, self.handle, RUN, run=run)
        except Exception:
            if self._sink.raised is not None:
                raise self._sink.raised from None
            raise
        maps, self._sink.maps = self._sink.maps, []
        for planes, counted in zip(maps, self.lightmaps):
            planes.told = counted
        return maps

    def bake(self, *, run: Optional[Run] = None) -> List[SceneLightmap]:
        """measure(), prepare() and run()."""
        self.measure(run=run)
        self.prepare(run=run)
        return self.run(run=run)

    @property
    def lightmaps(self) -> List[types.JobLightmap]:
        """What lightmaps there are, and what is known of them by now."""
        found = ffi.new("vsh_job_lightmap *")
        result = []
        for index in range(lib.vsh_bake_job_count(self.handle)):
            lib.vsh_bake_job_lightmap(self.handle, index, found)
            result.append(_told(found[0]))
        return result

    @property
    def assets(self) -> Optional[Assets]:
        """The files that it loaded."""
        cdata = lib.vsh_bake_job_assets(self.handle)
        if cdata == ffi.NULL:
            return None
        assets, owner = Assets.__new__(Assets), self.handle
        assets.scene = self.scene
        Handle.__init__(assets, ffi.gc(ffi.cast("vsh_assets *", cdata), lambda _, keeps=owner: None))
        return assets

    @property
    def report(self) -> types.BakeReport:
        """What it has done so far; `errors` is a list of vdbshade.types.BakeError: of each light, of AO, of the sky."""
        found = ffi.new("vsh_bake_report *")
        lib.vsh_bake_job_get_report(self.handle, found)
        report = told(found[0], "vsh_bake_report")
        report.errors = [told(found.errors[i], "vsh_bake_error") for i in range(found.error_count)]
        return report

    def forecast(self, *, run: Optional[Run] = None) -> types.BakeForecast:
        """What it will take, of a job that was not measured."""
        forecast = ffi.new("vsh_bake_forecast *")
        call(lib.vsh_bake_job_forecast, self.handle, RUN, forecast, run=run)
        return told(forecast[0], "vsh_bake_forecast")


def bake_scene(scene: Scene, *, files: Sequence[Any] = (), words: Sequence[str] = (), run: Optional[Run] = None,
               **options: Any) -> types.BakeReport:
    """Bakes a scene into files at its receivers' outputs; options of BakeJob."""
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: expected a vdbshade.Scene, got {type(scene).__name__}")
    filled = _options(options, files, words)
    report = ffi.new("vsh_bake_report *")
    call(lib.vsh_bake_scene, scene.struct, filled.pointer, RUN, report, run=run)
    return told(report[0], "vsh_bake_report")


__all__ = ["BakeJob", "SceneLightmap", "bake_scene"]
