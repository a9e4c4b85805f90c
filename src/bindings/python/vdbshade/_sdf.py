"""Procedural signed distance fields: shapes at the origin, moved and combined."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from ._arrays import array, pointer, transform as matrix
from ._library import Handle, call, ffi, lib, make, place
from ._structs import Filled

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from . import types


def _turned(q: numpy.ndarray, v: numpy.ndarray) -> numpy.ndarray:
    t = 2.0 * numpy.cross(q[:3], v)
    return v + q[3] * t + numpy.cross(q[:3], t)


def _product(a: numpy.ndarray, b: numpy.ndarray) -> numpy.ndarray:
    return numpy.append(a[3] * b[:3] + b[3] * a[:3] + numpy.cross(a[:3], b[:3]), a[3] * b[3] - a[:3] @ b[:3])


class Sdf:
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
        filled = [Filled("vsh_sdf_node", node) for node in self._nodes]
        self._array = ffi.new("vsh_sdf_node[]", [f.pointer[0] for f in filled])
        self.struct = ffi.new("vsh_sdf *", dict(nodes=self._array, node_count=len(filled)))
        call(lib.vsh_sdf_check, self.struct)

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
        at = array(positions, numpy.float64, (None, 3), "positions")
        first, sdf, distance = pointer(at), self.struct, lib.vsh_sdf_distance
        return numpy.array([distance(sdf, first + 3 * i) for i in range(len(at))], numpy.float64)

    def bounds(self) -> Tuple[Tuple[float, ...], Tuple[float, ...]]:
        """A box around the surface, world units: its least and its greatest corner."""
        low, high = ffi.new("double[3]"), ffi.new("double[3]")
        lib.vsh_sdf_bounds(self.struct, low, high)
        return tuple(low), tuple(high)


class Solids(Handle):
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
        trees = ffi.new("vsh_sdf[]", [sdf.struct[0] for sdf in sdfs] or 1)
        moved = None
        if transforms is not None:
            moved = numpy.array([matrix(t, "transforms") for t in numpy.asarray(transforms)], numpy.float64)
            moved = array(moved, numpy.float64, (len(sdfs), 3, 4), "transforms")
        super().__init__(make(lib.vsh_solids_free, lib.vsh_solids_create, trees, pointer(moved), len(sdfs), place("vsh_solids")))

    def distance(self, positions: ArrayLike) -> numpy.ndarray:
        """Signed distance to the nearest, at positions (n, 3), world units; infinite where there is none."""
        at = array(positions, numpy.float64, (None, 3), "positions")
        first, solids = pointer(at), self.handle
        return numpy.array([lib.vsh_solids_distance(solids, first + 3 * i) for i in range(len(at))], numpy.float64)


__all__ = ["Sdf", "Solids"]
