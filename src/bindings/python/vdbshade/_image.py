"""Image files: planes of floats with names."""
from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, pointer
from ._calls import OUT, Handle, Run, ask, call
from ._grid import Attributes, attributes_of
from ._library import Path, Unpack, ffi, lib, text
from ._structs import Filled, constant, keep, pairs_of, path_of, texts_of

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


def _named(names: Sequence[str], shape: Tuple[int, int], holds: Optional[Mapping[str, str]] = None) -> Filled:
    """``vsh_image`` of channels' names, without planes."""
    kinds = [constant("VSH_CHANNEL_", (holds or {}).get(n, _HOLDS.get(n.split(".")[0], "data")), "holds") for n in names]
    return Filled("vsh_image", width=shape[1], height=shape[0], channel_count=len(names), names=texts_of(list(names), "names"),
                  holds=ffi.new("int32_t[]", kinds or 1))


def image_of(channels: Mapping[str, ArrayLike], holds: Optional[Mapping[str, str]] = None) -> Filled:
    """``vsh_image`` of channels by their names."""
    planes, kinds = _flat(channels)
    kinds.update(holds or {})
    shape: Any = next((plane.shape for plane in planes.values()), (0, 0))
    if len(shape) != 2:
        raise ValueError(f"channel {next(iter(planes))!r}: expected shape (height, width) or (height, width, 3), got {shape}")
    if max(shape) >= 2**31:
        raise ValueError(f"an image of {shape[1]} × {shape[0]}: too large")
    pointers = [pointer(array(plane, numpy.float32, shape, f"channel {name!r}")) for name, plane in planes.items()]
    image = _named(list(planes), shape, kinds)
    image.fill(dict(planes=keep(ffi.new("float *[]", pointers or 1), pointers)))
    return image


class Image(dict):
    """Planes of an image file by their names: arrays of float32 of shape (height, width), row 0 on top, views.

    Attributes
    ----------
    attributes : dict
        lines of text that the file carries
    """

    attributes: Dict[str, str]


def image_read(path: Path, *, run: Optional[Run] = None) -> Image:
    """Reads an image; integers become 0 … 1 as they stand."""
    file = call(lib.vsh_image_read, path_of(path, "path"), OUT, run=run)
    view = lib.vsh_image_view(file)
    image = Image()
    for i in range(view.channel_count):
        image[text(view.names[i])] = borrowed(view.planes[i], (view.height, view.width), numpy.float32, file)
    count = ffi.new("size_t *")
    attributes = lib.vsh_image_attributes(file, count)
    image.attributes = pairs_of(attributes, count[0])
    return image


def _options(options: Any, attributes: Optional[Attributes]) -> Filled:
    return Filled("vsh_image_options", options, attributes=attributes_of(attributes))


def image_write(path: Path, channels: Mapping[str, ArrayLike], *, holds: Optional[Mapping[str, str]] = None,
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
    call(lib.vsh_image_write, path_of(path, "path"), image_of(channels, holds), _options(options, attributes))


def image_check(path: Path, names: Sequence[str], shape: Tuple[int, int], *,
                attributes: Optional[Attributes] = None, **options: "Unpack[types.ImageOptions]") -> int:
    """Whether such an image could be written, without writing; bytes that writing would take at most."""
    given = (path_of(path, "path"), _named(names, shape), _options(options, attributes))
    call(lib.vsh_image_check, *given)
    return ask(lib.vsh_image_writer_bytes, *given)


def image_default_pack(names: Sequence[str]) -> str:
    """The packing that is used where none is given: "R=irradiance.R,…"."""
    packed = ffi.new("char[]", 1024)
    ask(lib.vsh_image_default_pack, _named(names, (1, 1)), packed, 1024)
    return ffi.string(packed).decode()


class ImageWriter(Handle, kind="vsh_image_writer"):
    """An image that is written as its rows come. In a ``with``, which puts the file in place at its end, or leaves the old
    one where something is raised.

    Parameters
    ----------
    names : sequence of str
        its channels
    shape : two ints
        height and width
    """

    def __init__(self, path: Path, names: Sequence[str], shape: Tuple[int, int], *,
                 holds: Optional[Mapping[str, str]] = None, attributes: Optional[Attributes] = None,
                 **options: "Unpack[types.ImageOptions]") -> None:
        super().__init__(call(lib.vsh_image_writer_create, path_of(path, "path"), _named(names, shape, holds),
                              _options(options, attributes), OUT))
        self._names, self._width = list(names), shape[1]

    def add(self, channels: Mapping[str, ArrayLike]) -> None:
        """The next rows from the top: arrays of float32 of shape (rows, width)."""
        if set(channels) != set(self._names):
            raise ValueError(f"channels: expected {', '.join(self._names)}; got {', '.join(channels)}")
        arrays = [array(channels[n], numpy.float32, (None, self._width), f"channel {n!r}") for n in self._names]
        rows = len(arrays[0]) if arrays else 0
        if any(len(a) != rows for a in arrays):
            raise ValueError("channels: expected as many rows of each")
        call(lib.vsh_image_writer_add, self, rows, ffi.new("float *[]", [pointer(a) for a in arrays]))

    @property
    def clipping(self) -> types.ImageClipping:
        """Light that integers cut, of the rows so far."""
        return call(lib.vsh_image_writer_get_clipping, self, OUT)

    def finish(self) -> None:
        """Puts the file in place."""
        writer = self.handle
        self.close()
        ffi.gc(writer, None)  # it is freed by this, also where it fails
        call(lib.vsh_image_writer_finish, writer)

    def abandon(self) -> None:
        """Leaves the old file as it was."""
        if not self.closed:
            ffi.release(self.handle)
            self.close()

    def __exit__(self, kind: Any, *raised: Any) -> None:
        if kind is not None:
            self.abandon()
        elif not self.closed:
            self.finish()


def srgb_to_linear(encoded: float) -> float:
    """Takes the sRGB curve off a value of 0 … 1."""
    return lib.vsh_srgb_to_linear(encoded)
