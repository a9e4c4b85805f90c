"""Files of fields: made once, and mapped into memory by whoever shades with them."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, Iterator, Optional, Sequence

from ._library import RUN, Handle, Run, call, ffi, handle_of, lib, make, place, text
from ._structs import Filled, path_of
from ._field import Field
from ._grid import Attributes, attributes_of
from ._volume import Voxels

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from . import types


class KeptField:
    """A field of a file, or one that is to be written there.

    Parameters
    ----------
    field : Field
        with all of its levels; of a file it holds no surface
    name : str
        at most 255 bytes, without control characters; no two of a file are alike
    half_width : float
        of the level set that it was made from, voxels
    grid_bytes : int
        of that level set in memory; 0: not known
    origin : mapping, optional
        lines of text: what shaped it, in words of whoever writes the file
    band : Voxels, optional
        all of that level set's band, Voxels.from_grid(grid); of a file: FieldFile.band()

    ``band_bytes``: what a file keeps of the band, 0: nothing.
    """

    def __init__(self, field: Field, name: str = "", *, half_width: float = 3.0, grid_bytes: int = 0,
                 origin: Optional[Attributes] = None, band: Optional[Voxels] = None) -> None:
        handle_of(field, Field, "field")
        if band is not None:
            handle_of(band, Voxels, "band")
        self.band = band
        self.band_bytes = 0
        self.field = field
        self.name = name
        self.half_width = half_width
        self.grid_bytes = grid_bytes
        self.origin: Dict[str, str] = dict(origin or {})

    def __repr__(self) -> str:
        return f"<vdbshade.KeptField {self.name!r}>"


class FieldFile(Handle):
    """A file of fields that is open and has passed all checks; processes share its values. Nobody may write into the file
    meanwhile, or cut it; who makes it anew replaces it. A sequence of KeptField, as views.

    Parameters
    ----------
    path : path
        of a file that Scene.save_field(), field_file_write() or `vdbshade field` wrote with this version of the library
    """

    def __init__(self, path: "str | os.PathLike[str]", *, run: Optional[Run] = None) -> None:
        super().__init__(make(lib.vsh_field_file_close, lib.vsh_field_file_open, path_of(path, "path"), RUN, place("vsh_field_file"),
                              run=run))

    def __len__(self) -> int:
        return lib.vsh_field_file_count(self.handle)

    def _index(self, index: int) -> int:
        if not -len(self) <= index < len(self):
            raise IndexError(f"field {index}: the file has {len(self)}")
        return index % len(self)

    def __getitem__(self, index: int) -> KeptField:
        view, owner = ffi.new("vsh_kept_field *"), self.handle
        lib.vsh_field_file_get_sized(owner, self._index(index), view, ffi.sizeof("vsh_kept_field"))
        field = Field.__new__(Field)
        Handle.__init__(field, ffi.gc(ffi.cast("vsh_field *", view.field), lambda _, keeps=owner: None), owner)
        kept = KeptField(field, text(view.name) or "", half_width=view.half_width, grid_bytes=view.grid_bytes,
                         origin=_lines(view.origin, view.origin_count))
        kept.band_bytes = view.band_bytes
        return kept

    def __iter__(self) -> Iterator[KeptField]:
        return (self[i] for i in range(len(self)))

    @property
    def path(self) -> str:
        """As it was opened."""
        return os.fsdecode(ffi.string(lib.vsh_field_file_path(self.handle)))

    @property
    def bytes(self) -> int:
        """Of the file."""
        return lib.vsh_field_file_bytes(self.handle)

    @property
    def attributes(self) -> Dict[str, str]:
        """Lines of text that it carries for people."""
        count = ffi.new("size_t *")
        lines = lib.vsh_field_file_attributes(self.handle, count)
        return _lines(lines, count[0])

    def field(self, index: int, *, run: Optional[Run] = None, **options: "Unpack[types.FieldOptions]") -> Field:
        """A field as Field() makes it with these options of the level set that it was made from, bit by bit; InputError for
        a reach (world units) that is farther than its levels go."""
        owner = self.handle

        def free(made: Any, keeps: Any = owner) -> None:  # its values are the file's
            lib.vsh_field_free(made)

        field = Field.__new__(Field)
        Handle.__init__(field, make(free, lib.vsh_field_file_field, owner, self._index(index), Filled("vsh_field_options", options).pointer,
                                    RUN, place("vsh_field"), run=run))
        return field


    def band(self, index: int, band: float = 0.0, *, run: Optional[Run] = None) -> Voxels:
        """The band of the level set that a field was made from, as Voxels.from_grid() makes it of that, bit by bit: all of it.
        InputError for a narrower one, and where it was not kept."""
        return Voxels._made(lib.vsh_field_file_band, self.handle, self._index(index), band, run=run)


def _lines(lines: Any, count: int) -> Dict[str, str]:
    return {text(lines[i].name) or "": text(lines[i].value) or "" for i in range(count)}


def field_file_write(path: "str | os.PathLike[str]", fields: Sequence[KeptField], *, attributes: Optional[Attributes] = None,
                     run: Optional[Run] = None) -> None:
    """Writes fields to a file, whole or not at all; the same fields give the same bytes.

    Parameters
    ----------
    fields : sequence of KeptField
        1 … 1024, no two of one name
    attributes : mapping, optional
        lines of text for people
    """
    if not all(isinstance(kept, KeptField) for kept in fields):
        raise TypeError("fields: expected a list of vdbshade.KeptField")
    structs = ffi.new("vsh_kept_field[]", max(len(fields), 1))
    keeps: list = []
    for i, kept in enumerate(fields):
        origin, field = attributes_of(kept.origin), handle_of(kept.field, Field, "field")
        filled = Filled("vsh_kept_field", dict(name=kept.name, half_width=kept.half_width, grid_bytes=kept.grid_bytes))
        filled.pointer.field = field
        if kept.band is not None:
            filled.pointer.band = handle_of(kept.band, Voxels, "band")
        filled.pointer.origin, filled.pointer.origin_count = origin.array, origin.count
        structs[i] = filled.pointer[0]
        keeps += [filled, origin, field]
    lines = attributes_of(attributes)
    call(lib.vsh_field_file_write, path_of(path, "path"), structs, len(fields), lines.array, lines.count, RUN, run=run)
    del keeps


def field_file_is(path: "str | os.PathLike[str]") -> bool:
    """Whether a file begins as one of fields does, whatever its name."""
    return bool(lib.vsh_field_file_is(path_of(path, "path")))


__all__ = ["FieldFile", "KeptField", "field_file_is", "field_file_write"]
