"""Image files: planes of floats with names."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, pointer
from ._library import RUN, Run, call, ffi, lib, make, place, text
from ._structs import Filled, constant, keep, path_of, told
from ._grid import Attributes, attributes_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

_AXES = {"irradiance": "RGB", "tint": "RGB", "bent": "XYZ"}
_HOLDS = {"irradiance": "light", "tint": "light", "bent": "vector"}


def _flat(channels: Mapping[str, ArrayLike]) -> "Tuple[Dict[str, numpy.ndarray], Dict[str, str]]":
    """Channels of one plane each, and what they hold: of a plane (height, width, 3) its axes, as files name them."""
    planes, holds = {}, {}
    for name, values in channels.items():
        found = numpy.asarray(values)
        kind = name.split(".")[0]
        if found.ndim == 3 and found.shape[2] == 3:
            for c, axis in enumerate(_AXES.get(kind, "RGB")):
                planes[f"{name}.{axis}"] = found[:, :, c]
                holds[f"{name}.{axis}"] = _HOLDS.get(kind, "data")
        else:
            planes[name] = found
            holds[name] = _HOLDS.get(kind, "data")
    return planes, holds


class _Image:
    """``vsh_image`` of channels by their names."""

    def __init__(self, channels: Mapping[str, ArrayLike], holds: Optional[Mapping[str, str]] = None,
                 shape: Optional[Tuple[int, int]] = None) -> None:
        planes, kinds = _flat(channels)
        kinds.update(holds or {})
        arrays: List[numpy.ndarray] = []
        for name, values in planes.items():
            if shape is None:
                if values.ndim != 2:
                    raise ValueError(f"channel {name!r}: expected shape (height, width) or (height, width, 3), got {values.shape}")
                shape = values.shape  # type: ignore[assignment]
            arrays.append(array(values, numpy.float32, shape or (), f"channel {name!r}"))
        height, width = shape or (0, 0)
        if max(height, width) >= 2**31:
            raise ValueError(f"an image of {width} × {height}: too large")
        texts = [ffi.new("char[]", name.encode()) for name in planes]
        count = len(planes)
        names = ffi.new("char *[]", texts or 1)
        pointers = ffi.new("float *[]", [pointer(a) for a in arrays] or 1)
        held = ffi.new("int32_t[]", [constant("VSH_CHANNEL_", kinds[n], "holds") for n in planes] or 1)
        self.struct = ffi.new("vsh_image *", [width, height, count, names, pointers, held])
        keep(self.struct, [texts, arrays, names, pointers, held])


class Image(dict):
    """Planes of an image file by their names: arrays of float32 of shape (height, width), row 0 on top, views.

    Attributes
    ----------
    attributes : dict
        lines of text that the file carries
    """

    attributes: Dict[str, str]


def image_read(path: "str | os.PathLike[str]", *, run: Optional[Run] = None) -> Image:
    """Reads an image; integers become 0 … 1 as they stand."""
    file = make(lib.vsh_image_free, lib.vsh_image_read, path_of(path, "path"), RUN, place("vsh_image_file"), run=run)
    view = lib.vsh_image_view(file)
    image = Image()
    for i in range(view.channel_count):
        image[text(view.names[i])] = borrowed(view.planes[i], (view.height, view.width), numpy.float32, file)
    count = ffi.new("size_t *")
    attributes = lib.vsh_image_attributes(file, count)
    image.attributes = {text(attributes[i].name): text(attributes[i].value) for i in range(count[0])}  # type: ignore[misc]
    return image


def _options(options: Any, attributes: Optional[Attributes]) -> Filled:
    filled = Filled("vsh_image_options", options)
    lines = attributes_of(attributes)
    filled.keeps.append(lines)
    filled.pointer.attributes, filled.pointer.attribute_count = lines.array, lines.count
    return filled


def image_write(path: "str | os.PathLike[str]", channels: Mapping[str, ArrayLike], *, holds: Optional[Mapping[str, str]] = None,
                attributes: Optional[Attributes] = None, **options: "Unpack[types.ImageOptions]") -> None:
    """Writes an image, whole or not at all; the path's ending is the format (docs/formats.md).

    Parameters
    ----------
    channels : mapping
        arrays of float32 by their names: shape (height, width), row 0 on top; of (height, width, 3) each axis is a
        channel, "irradiance.R"
    holds : mapping, optional
        what channels hold: "data", "light", "vector"
    attributes : mapping, optional
        lines of text
    **options
        vdbshade.types.ImageOptions: bits, pack, color_space
    """
    image = _Image(channels, holds)
    call(lib.vsh_image_write, path_of(path, "path"), image.struct, _options(options, attributes).pointer)


def image_check(path: "str | os.PathLike[str]", names: Sequence[str], shape: Tuple[int, int], *,
                attributes: Optional[Attributes] = None, **options: "Unpack[types.ImageOptions]") -> int:
    """Whether such an image could be written, without writing; bytes that writing would take at most."""
    image = _named(names, shape)
    given = _options(options, attributes)
    call(lib.vsh_image_check, path_of(path, "path"), image, given.pointer)
    return lib.vsh_image_writer_bytes(path_of(path, "path"), image, given.pointer)


def _named(names: Sequence[str], shape: Tuple[int, int], holds: Optional[Mapping[str, str]] = None) -> Any:
    """``vsh_image`` of channels' names, without planes."""
    texts = [ffi.new("char[]", name.encode()) for name in names]
    listed = ffi.new("char *[]", texts or 1)
    kinds = [(holds or {}).get(n, _HOLDS.get(n.split(".")[0], "data")) for n in names]
    held = ffi.new("int32_t[]", [constant("VSH_CHANNEL_", k, "holds") for k in kinds] or 1)
    struct = ffi.new("vsh_image *", [shape[1], shape[0], len(names), listed, ffi.NULL, held])
    keep(struct, [texts, listed, held])
    return struct


def image_default_pack(names: Sequence[str]) -> str:
    """The packing that is used where none is given: "R=irradiance.R,…"."""
    packed = ffi.new("char[]", 1024)
    lib.vsh_image_default_pack(_named(names, (1, 1)), packed, 1024)
    return ffi.string(packed).decode()


class ImageWriter:
    """An image that is written as its rows come. In a ``with``, which puts the file in place at its end, or leaves the old
    one where something is raised.

    Parameters
    ----------
    names : sequence of str
        its channels
    shape : two ints
        height and width
    """

    def __init__(self, path: "str | os.PathLike[str]", names: Sequence[str], shape: Tuple[int, int], *,
                 holds: Optional[Mapping[str, str]] = None, attributes: Optional[Attributes] = None,
                 **options: "Unpack[types.ImageOptions]") -> None:
        self._names, self._width = list(names), shape[1]
        self._writer = make(lib.vsh_image_writer_abandon, lib.vsh_image_writer_create, path_of(path, "path"),
                            _named(names, shape, holds), _options(options, attributes).pointer, place("vsh_image_writer"))

    def _open(self) -> Any:
        if self._writer is None:
            raise ValueError("ImageWriter is closed")
        return self._writer

    def add(self, channels: Mapping[str, ArrayLike]) -> None:
        """The next rows from the top: arrays of float32 of shape (rows, width)."""
        if set(channels) != set(self._names):
            raise ValueError(f"channels: expected {', '.join(self._names)}; got {', '.join(channels)}")
        arrays = [array(channels[n], numpy.float32, (None, self._width), f"channel {n!r}") for n in self._names]
        rows = len(arrays[0]) if arrays else 0
        if any(len(a) != rows for a in arrays):
            raise ValueError("channels: expected as many rows of each")
        call(lib.vsh_image_writer_add, self._open(), rows, ffi.new("float *[]", [pointer(a) for a in arrays]))

    @property
    def clipping(self) -> types.ImageClipping:
        """Light that integers cut, of the rows so far."""
        found = ffi.new("vsh_image_clipping *")
        call(lib.vsh_image_writer_get_clipping, self._open(), found)
        return told(found[0], "vsh_image_clipping")

    def finish(self) -> None:
        """Puts the file in place."""
        writer, self._writer = self._open(), None
        ffi.gc(writer, None)  # it is freed by this, also where it fails
        call(lib.vsh_image_writer_finish, writer)

    def abandon(self) -> None:
        """Leaves the old file as it was."""
        if self._writer is not None:
            ffi.release(self._writer)
            self._writer = None

    def __enter__(self) -> "ImageWriter":
        return self

    def __exit__(self, kind: Any, *raised: Any) -> None:
        if kind is not None:
            self.abandon()
        elif self._writer is not None:
            self.finish()


def srgb_to_linear(encoded: float) -> float:
    """Takes the sRGB curve off a value of 0 … 1."""
    return lib.vsh_srgb_to_linear(encoded)


__all__ = ["Image", "ImageWriter", "image_check", "image_default_pack", "image_read", "image_write", "srgb_to_linear"]
