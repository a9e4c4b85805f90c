"""Outlines: areas of a plane, of images, text and polygons."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from ._arrays import array, borrowed, pointer
from ._library import RUN, Handle, Run, ffi, handle_of, lib, make, place
from ._structs import Filled, info, path_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from . import types


class Outline(Handle):
    """An area of the xy-plane, bounded by closed contours; world units, y up. Made by its ``from_…`` methods."""

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("an Outline is made by Outline.from_image(), from_text(), from_polygons() or unite()")

    @classmethod
    def _made(cls, function: Any, *arguments: Any, run: Optional[Run]) -> "Outline":
        self = cls.__new__(cls)
        Handle.__init__(self, make(lib.vsh_outline_free, function, *arguments, RUN, place("vsh_outline"), run=run))
        return self

    @classmethod
    def from_image(cls, path: "str | os.PathLike[str]", *, run: Optional[Run] = None, **options: "Unpack[types.MaskOptions]") -> "Outline":
        """Where a channel of an image is at least the threshold."""
        return cls._made(lib.vsh_outline_from_image, path_of(path, "path"), Filled("vsh_mask_options", options).pointer, run=run)

    @classmethod
    def from_text(cls, text: str, font: "str | os.PathLike[str]", *, run: Optional[Run] = None,
                  **options: "Unpack[types.TextOptions]") -> "Outline":
        """The letters of a text, of a font's file."""
        return cls._made(lib.vsh_outline_from_text, text.encode(), path_of(font, "font"),
                         Filled("vsh_text_options", options).pointer, run=run)

    @classmethod
    def from_polygons(cls, polygons: Sequence[ArrayLike], *, run: Optional[Run] = None) -> "Outline":
        """What closed polygons wind around: arrays of float64 of shape (n, 2)."""
        parts = [array(p, numpy.float64, (None, 2), f"polygons[{i}]") for i, p in enumerate(polygons)]
        points = numpy.concatenate(parts) if parts else numpy.zeros((0, 2))
        counts = ffi.new("size_t[]", [len(p) for p in parts] or 1)
        return cls._made(lib.vsh_outline_from_polygons, pointer(points), counts, len(parts), run=run)

    @classmethod
    def unite(cls, outlines: "Sequence[Union[Outline, Tuple[Outline, ArrayLike]]]", *, run: Optional[Run] = None) -> "Outline":
        """The union of outlines, or of pairs of an outline and its transform, shape (2, 3)."""
        keeps = []
        for entry in outlines:
            outline, moved = entry if isinstance(entry, tuple) else (entry, None)
            matrix = None if moved is None else array(moved, numpy.float64, (2, 3), "transform")
            keeps.append((handle_of(outline, Outline, "outlines"), pointer(matrix)))
        instances = ffi.new("vsh_outline_instance[]", [dict(outline=o, transform=t) for o, t in keeps] or 1)
        return cls._made(lib.vsh_outline_unite, instances, len(keeps), run=run)

    @property
    def info(self) -> "types.OutlineInfo":
        return info(lib.vsh_outline_get_info, "vsh_outline_info", self.handle)

    @property
    def contours(self) -> List[numpy.ndarray]:
        """Each contour's points, arrays of float64 of shape (n, 2), views; the area lies to their left."""
        found, count = [], ffi.new("size_t *")
        for index in range(self.info.contours):
            points = lib.vsh_outline_contour(self.handle, index, count)
            found.append(borrowed(points, (count[0], 2), numpy.float64, self.handle))
        return found

    def distance(self, points: ArrayLike) -> numpy.ndarray:
        """Signed distance at points (n, 2), world units, negative inside."""
        at = array(points, numpy.float64, (None, 2), "points")
        first, outline = pointer(at), self.handle
        return numpy.array([lib.vsh_outline_distance(outline, first + 2 * i) for i in range(len(at))], numpy.float64)


__all__ = ["Outline"]
