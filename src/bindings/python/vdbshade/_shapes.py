"""Shapes: procedural signed distance fields, and outlines in a plane."""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, pointer, transform as matrix
from ._calls import OUT, Handle, Run, Several, ask, call
from ._library import Path, Unpack, ffi, lib
from ._structs import Filled, Struct, keep, path_of, structs_of


def distances_at(function: Callable[[Any, Any], float], shape: Any, positions: ArrayLike, axes: int, name: str) -> numpy.ndarray:
    """The values of a C function that takes one point, at points (n, axes)."""
    at = array(positions, numpy.float64, (None, axes), name)
    first = pointer(at)
    return numpy.array([function(shape, first + axes * i) for i in range(len(at))], numpy.float64)


def instances_of(kind: str, given: Sequence[Any], matrix_of: Callable[[Any], Optional[numpy.ndarray]]) -> Any:
    """An array of instances: handles, or pairs of a handle and its transform."""
    member = kind[len("vsh_") : -len("_instance")]
    pairs = [entry if isinstance(entry, tuple) else (entry, None) for entry in given]
    return structs_of(kind, [{member: thing, "transform": matrix_of(moved)} for thing, moved in pairs])


def _turned(q: numpy.ndarray, v: numpy.ndarray) -> numpy.ndarray:
    t = 2.0 * numpy.cross(q[:3], v)
    return v + q[3] * t + numpy.cross(q[:3], t)


def _product(a: numpy.ndarray, b: numpy.ndarray) -> numpy.ndarray:
    return numpy.append(a[3] * b[:3] + b[3] * a[:3] + numpy.cross(a[:3], b[:3]), a[3] * b[3] - a[:3] @ b[:3])


class Sdf(Struct, kind="vsh_sdf"):
    """A tree of shapes; lengths in world units. ``a | b`` is a union, ``a & b`` an intersection, ``a - b`` a without b.

    Parameters
    ----------
    shape : str
        "sphere", "box", "torus", "plane", "capsule", "cylinder", "cone"
    **options
        members of ``vsh_sdf_node`` (vdbshade.types.SdfNode): size, radius, minor_radius, rounding, …

    Examples
    --------
    >>> plate = Sdf("box", size=(2, 0.1, 2)) - Sdf("cylinder", size=(1, 1, 1), radius=0.5)
    >>> ball = Sdf("sphere", radius=0.4).translated(0, 1, 0)
    >>> (plate | ball).distance([[0, 1, 0]])
    array([-0.4])
    """

    def __init__(self, shape: str = "sphere", **options: "Unpack[types.SdfNode]") -> None:
        self._nodes: List[Dict[str, Any]] = [dict(options, shape=shape)]
        if "left" in options or "right" in options:
            raise TypeError("Sdf: operands are combined by |, &, - and smooth_union()")
        self._made()

    def _made(self) -> None:
        nodes = structs_of("vsh_sdf_node", self._nodes)
        self.struct = keep(ffi.new("vsh_sdf *", [nodes, len(self._nodes)]), nodes)
        call(lib.vsh_sdf_check, self)

    @classmethod
    def _of(cls, nodes: List[Dict[str, Any]]) -> "Sdf":
        self = cls.__new__(cls)
        self._nodes = nodes
        self._made()
        return self

    def _combined(self, other: "Sdf", shape: str, **options: Any) -> "Sdf":
        if not isinstance(other, Sdf):
            raise TypeError(f"expected a vdbshade.Sdf, got {type(other).__name__}")
        offset = len(self._nodes)
        moved = [{k: v + offset if k in ("left", "right") else v for k, v in node.items()} for node in other._nodes]
        root = dict(options, shape=shape, left=offset - 1, right=offset + len(moved) - 1)
        return Sdf._of(self._nodes + moved + [root])

    def __or__(self, other: "Sdf") -> "Sdf":
        return self._combined(other, "union")

    def __and__(self, other: "Sdf") -> "Sdf":
        return self._combined(other, "intersection")

    def __sub__(self, other: "Sdf") -> "Sdf":
        return self._combined(other, "subtraction")

    def smooth_union(self, other: "Sdf", smoothing: float) -> "Sdf":
        """A union, blended over a distance."""
        return self._combined(other, "smooth_union", smoothing=smoothing)

    def moved(self, translation: Sequence[float] = (0.0, 0.0, 0.0), rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
              scale: float = 1.0) -> "Sdf":
        """Scaled, then rotated (a quaternion x, y, z, w), then translated."""
        root = dict(self._nodes[-1])
        turn = numpy.asarray(rotation, float)
        if turn.shape != (4,) or not numpy.linalg.norm(turn) > 0.0:
            raise ValueError(f"rotation {rotation}: expected a quaternion x, y, z, w of some length")
        turn = turn / numpy.linalg.norm(turn)
        before = numpy.asarray(root.get("rotation", (0.0, 0.0, 0.0, 1.0)), float)
        place_before = numpy.asarray(root.get("translation", (0.0, 0.0, 0.0)), float)
        if "rotation" in root or tuple(rotation) != (0.0, 0.0, 0.0, 1.0):
            root["rotation"] = tuple(_product(turn, before))
        root["translation"] = tuple(_turned(turn, scale * place_before) + numpy.asarray(translation, float))
        root["scale"] = scale * root.get("scale", 1.0)
        return Sdf._of(self._nodes[:-1] + [root])

    def translated(self, x: float, y: float, z: float) -> "Sdf":
        return self.moved(translation=(x, y, z))

    def scaled(self, scale: float) -> "Sdf":
        return self.moved(scale=scale)

    def rotated(self, axis: Sequence[float], angle: float) -> "Sdf":
        """Turned around an axis through the origin by an angle, radians."""
        unit = numpy.asarray(axis, float) / numpy.linalg.norm(axis)
        return self.moved(rotation=(*(unit * numpy.sin(angle / 2)), numpy.cos(angle / 2)))

    def __len__(self) -> int:
        """How many nodes the tree has."""
        return len(self._nodes)

    def distance(self, positions: ArrayLike) -> numpy.ndarray:
        """Signed distance, negative inside.

        Parameters
        ----------
        positions : array of float64, shape (n, 3)
            world units

        Returns
        -------
        array of float64, shape (n,)
            NaN for positions that are not finite
        """
        return distances_at(lib.vsh_sdf_distance, self.struct, positions, 3, "positions")

    def bounds(self) -> Tuple[Tuple[float, ...], Tuple[float, ...]]:
        """A box around the surface, world units: its least and its greatest corner."""
        return ask(lib.vsh_sdf_bounds, self, Several(3), Several(3))


class Solids(Handle, kind="vsh_solids"):
    """Procedural casters as they are, for trace_shadow() and trace_ao().

    Parameters
    ----------
    sdfs : sequence of Sdf
    transforms : array of float64, shape (n, 3, 4), optional
        of each, local to world, without shear or uneven scale
    """

    def __init__(self, sdfs: Sequence[Sdf], transforms: Optional[ArrayLike] = None) -> None:
        sdfs = [sdfs] if isinstance(sdfs, Sdf) else list(sdfs)
        if not all(isinstance(sdf, Sdf) for sdf in sdfs):
            raise TypeError("sdfs: expected a list of vdbshade.Sdf")
        moved = None
        if transforms is not None:
            moved = numpy.array([matrix(t, "transforms") for t in numpy.asarray(transforms)], numpy.float64)
            moved = array(moved, numpy.float64, (len(sdfs), 3, 4), "transforms")
        super().__init__(call(lib.vsh_solids_create, structs_of("vsh_sdf", sdfs), moved, len(sdfs), OUT))

    def distance(self, positions: ArrayLike) -> numpy.ndarray:
        """Signed distance to the nearest, at positions (n, 3), world units; infinite where there is none."""
        return distances_at(lib.vsh_solids_distance, self.handle, positions, 3, "positions")


class Outline(Handle, kind="vsh_outline"):
    """An area of the xy-plane, bounded by closed contours; world units, y up. Made by its ``from_…`` methods."""

    info: types.OutlineInfo

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("an Outline is made by Outline.from_image(), from_text(), from_polygons() or unite()")

    @classmethod
    def from_image(cls, path: Path, *, run: Optional[Run] = None, **options: "Unpack[types.MaskOptions]") -> "Outline":
        """Where a channel of an image is at least the threshold."""
        return cls._of(call(lib.vsh_outline_from_image, path_of(path, "path"), Filled("vsh_mask_options", options), OUT, run=run))

    @classmethod
    def from_text(cls, text: str, font: Path, *, run: Optional[Run] = None, **options: "Unpack[types.TextOptions]") -> "Outline":
        """The letters of a text, of a font's file."""
        return cls._of(call(lib.vsh_outline_from_text, text, path_of(font, "font"), Filled("vsh_text_options", options), OUT, run=run))

    @classmethod
    def from_polygons(cls, polygons: Sequence[ArrayLike], *, run: Optional[Run] = None) -> "Outline":
        """The area that closed polygons wind around: arrays of float64 of shape (n, 2)."""
        parts = [array(p, numpy.float64, (None, 2), f"polygons[{i}]") for i, p in enumerate(polygons)]
        points = numpy.concatenate(parts) if parts else numpy.zeros((0, 2))
        counts = ffi.new("size_t[]", [len(p) for p in parts] or 1)
        return cls._of(call(lib.vsh_outline_from_polygons, points, counts, len(parts), OUT, run=run))

    @classmethod
    def unite(cls, outlines: "Sequence[Union[Outline, Tuple[Outline, ArrayLike]]]", *, run: Optional[Run] = None) -> "Outline":
        """The union of outlines, or of pairs of an outline and its transform, shape (2, 3)."""
        instances = instances_of("vsh_outline_instance", outlines, lambda moved: None if moved is None else array(
            moved, numpy.float64, (2, 3), "transform"))
        return cls._of(call(lib.vsh_outline_unite, instances, len(outlines), OUT, run=run))

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
        return distances_at(lib.vsh_outline_distance, self.handle, points, 2, "points")
