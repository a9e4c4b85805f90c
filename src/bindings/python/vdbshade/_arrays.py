"""numpy arrays as C takes them, without a copy where they already are so; and views of the library's own memory."""
from __future__ import annotations

from typing import Any, Optional, Sequence, Tuple

import numpy

from ._library import ffi

_NAMES = {"f": "float", "d": "double", "I": "uint32_t", "i": "int32_t", "B": "uint8_t"}


def _shape_text(shape: Sequence[Optional[int]]) -> str:
    return "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"


def array(given: Any, dtype: Any, shape: Sequence[Optional[int]], name: str) -> numpy.ndarray:
    """`given` as a C-contiguous array of `dtype` and `shape` (None: any length): itself where it is one, else a copy.

    TypeError where its numbers are of a kind that does not become `dtype`, ValueError where its shape is another, or
    a number does not fit."""
    dtype = numpy.dtype(dtype)
    found = given if type(given) is numpy.ndarray else numpy.asarray(given)
    if found.dtype != dtype:
        if found.size == 0 and found.dtype == numpy.float64:
            found = found.astype(dtype)  # what an empty list is
        elif dtype.kind == "f" and found.dtype.kind in "fiu":
            found = found.astype(dtype)
        elif dtype.kind in "iu" and found.dtype.kind in "iu":
            limits = numpy.iinfo(dtype)
            if found.size and (int(found.min()) < limits.min or int(found.max()) > limits.max):
                wrong = found[(found < limits.min) | (found > limits.max)].flat[0]
                raise ValueError(f"{name}: {wrong} does not fit {dtype.name}")
            found = found.astype(dtype)
        elif dtype == numpy.uint8 and found.dtype.kind == "b":
            found = found.view(numpy.uint8) if found.flags.c_contiguous else found.astype(numpy.uint8)
        else:
            raise TypeError(f"{name}: expected {dtype.name}, got {found.dtype}")
    if found.size == 0 and found.ndim == 1 and len(shape) > 1 and not shape[0]:
        found = found.reshape([0] + [n or 0 for n in shape[1:]])
    if len(found.shape) != len(shape) or [n for n, m in zip(shape, found.shape) if n != m and n is not None]:
        raise ValueError(f"{name}: expected an array of shape {_shape_text(shape)}, got {found.shape}")
    flags = found.flags
    return found if flags.c_contiguous and flags.aligned else numpy.require(found, requirements=["C", "A"])


def output(out: Any, dtype: Any, shape: Tuple[int, ...], name: str) -> numpy.ndarray:
    """`out`, which values are written into, or where it is None an array for them."""
    if out is None:
        return numpy.empty(shape, dtype)
    if not isinstance(out, numpy.ndarray):
        raise TypeError(f"{name}: expected a numpy array to write into, got {type(out).__name__}")
    if out.dtype != numpy.dtype(dtype):
        raise TypeError(f"{name}: expected {numpy.dtype(dtype).name} to write into, got {out.dtype}")
    if out.shape != shape:
        raise ValueError(f"{name}: expected an array of shape {shape} to write into, got {out.shape}")
    if not out.flags.c_contiguous or not out.flags.writeable or not out.flags.aligned:
        raise ValueError(f"{name}: expected an array to write into that is C-contiguous, aligned and writeable")
    return out


def pointer(values: Optional[numpy.ndarray]) -> Any:
    """Its first element, for C; the array lives as long as the pointer. NULL for None."""
    if values is None:
        return ffi.NULL
    kind = _NAMES[values.dtype.char]
    if values.size == 0 or not values.flags.writeable:
        return ffi.from_buffer(kind + "[]", values)
    return ffi.from_buffer(kind + "[]", values, require_writable=True)


class _Borrowed:
    """Memory of the library's, and what owns it."""

    def __init__(self, address: int, shape: Tuple[int, ...], dtype: numpy.dtype, owner: Any) -> None:
        self.owner = owner
        self.__array_interface__ = {"data": (address, True), "shape": shape, "typestr": dtype.str, "version": 3}


def borrowed(cdata: Any, shape: Tuple[int, ...], dtype: Any, owner: Any) -> Any:
    """A view of the library's memory, read-only, that keeps `owner` alive; None for NULL."""
    if cdata == ffi.NULL:
        return None
    if 0 in shape:
        return numpy.zeros(shape, dtype)
    return numpy.asarray(_Borrowed(int(ffi.cast("uintptr_t", cdata)), shape, numpy.dtype(dtype), owner))


def transform(given: Any, name: str = "transform") -> Optional[numpy.ndarray]:
    """A local-to-world matrix of 3 × 4 or 4 × 4 (whose last row is 0, 0, 0, 1) as twelve doubles; None: None."""
    if given is None:
        return None
    matrix = numpy.asarray(given, numpy.float64)
    if matrix.shape == (4, 4):
        if not numpy.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
            raise ValueError(f"{name}: expected a last row of 0, 0, 0, 1, got {matrix[3]}")
        matrix = matrix[:3]
    if matrix.shape == (12,):
        matrix = matrix.reshape(3, 4)
    return array(matrix, numpy.float64, (3, 4), name)


def vector(given: Any, length: int, name: str) -> Any:
    """So many doubles, for C."""
    return pointer(array(given, numpy.float64, (length,), name))
