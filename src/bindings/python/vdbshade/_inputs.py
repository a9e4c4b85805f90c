"""Where outputs come from, and who parses files."""
from __future__ import annotations

import os
from typing import Dict, List, Mapping, Optional, Sequence

from ._library import RUN, Run, call, ffi, lib, make, place, text
from ._structs import Filled, constant, path_of
from ._tables import WORDS
from ._grid import Attributes, attributes_of
from ._scene import Scene


def version() -> str:
    """The library's, "0.2.0"."""
    return ffi.string(lib.vsh_version()).decode()


def isa_available(isa: str) -> bool:
    """Whether this machine has an instruction set: "base", "avx2", "avx512"."""
    return bool(lib.vsh_isa_available(constant("VSH_ISA_", isa, "isa")))


def file_digest(path: "str | os.PathLike[str]", *, run: Optional[Run] = None) -> str:
    """SHA-256 of a file's bytes, 64 hexadecimal digits."""
    digest = ffi.new("char[65]")
    call(lib.vsh_file_digest, path_of(path, "path"), RUN, digest, run=run)
    return ffi.string(digest).decode()


def reader_confinement(*, run: Optional[Run] = None) -> List[str]:
    """How the reader that parses files is confined here: of "limits", "calls", "files"."""
    confined = ffi.new("uint32_t *")
    call(lib.vsh_reader_confinement, RUN, confined, run=run)
    return [name for name, bit in WORDS["VSH_CONFINED_"].items() if confined[0] & bit]


def provenance(scene: Optional[Scene] = None, *, files: Sequence["str | os.PathLike[str]"] = (), command: Optional[str] = None,
               voxel_size: float = 0.0, attributes: Optional[Attributes] = None, has_triangles: bool = False, lightmap: bool = False,
               run: Optional[Run] = None) -> Dict[str, str]:
    """What an output was made of, as lines of text that it carries: version, methods, lights, hashes of inputs."""
    filled = Filled("vsh_provenance_source", dict(command=command, voxel_size=voxel_size, has_triangles=has_triangles, lightmap=lightmap))
    source, lines = filled.pointer, attributes_of(attributes)
    names = ffi.new("char *[]", [filled.text(f, "files") for f in files] or 1)
    source.files, source.file_count = names, len(files)
    source.attributes, source.attribute_count = lines.array, lines.count
    if scene is not None:
        source.scene = scene.struct
    made = make(lib.vsh_provenance_free, lib.vsh_provenance_create, source, RUN, place("vsh_provenance"), run=run)
    count = ffi.new("size_t *")
    found = lib.vsh_provenance_attributes(made, count)
    return {text(found[i].name) or "": text(found[i].value) or "" for i in range(count[0])}


def provenance_max_error(attributes: Mapping[str, str], channel: str) -> float:
    """The standard error that a channel was made to, as a file's attributes say; NaN where they don't."""
    lines = attributes_of(attributes)
    return lib.vsh_provenance_max_error(lines.array, lines.count, channel.encode())


__all__ = ["file_digest", "isa_available", "provenance", "provenance_max_error", "reader_confinement", "version"]
