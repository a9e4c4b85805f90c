"""Comparing baked values with golden ones."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, pointer
from ._library import RUN, Handle, Run, call, ffi, lib, make, place, text
from ._structs import Filled, constant, path_of, told
from ._tables import WORDS

if TYPE_CHECKING:
    from typing_extensions import Unpack

MEASURES = tuple(WORDS["VSH_MEASURE_"])


class Measures(types.Measures):
    """Differences of values from golden ones. `value` is a dict of "nonfinite", "shift", "penumbra", "lost", "gained", "rmse",
    "p99" and "max"; NaN if a measure does not apply."""

    value: Dict[str, float]  # type: ignore[assignment]
    _struct: Any


def _measures(struct: Any) -> Measures:
    found = Measures(**told(struct, "vsh_measures").__dict__)
    found.value = dict(zip(MEASURES, struct.value))
    found._struct = ffi.new("vsh_measures *", struct)
    return found


def _compared(golden: ArrayLike, values: ArrayLike, mask: Optional[ArrayLike]) -> Tuple[Any, Any]:
    first = numpy.asarray(golden)
    if first.ndim not in (2, 3):
        raise ValueError(f"golden: expected shape (height, width) or (depth, height, width), got {first.shape}")
    if max(first.shape, default=0) >= 2**31:
        raise ValueError(f"golden: {first.shape}: too large")
    planes = [array(golden, numpy.float32, first.shape, "golden"), array(values, numpy.float32, first.shape, "values")]
    over = None if mask is None else array(mask, numpy.uint8, first.shape, "mask")
    keeps = [pointer(planes[0]), pointer(planes[1]), pointer(over)]
    size = list(reversed(first.shape)) + [1] * (3 - first.ndim)
    return ffi.new("vsh_compared *", [size] + keeps), (keeps, planes, over)


def compare(golden: ArrayLike, values: ArrayLike, mask: Optional[ArrayLike] = None, *, run: Optional[Run] = None,
            **options: "Unpack[types.CompareOptions]") -> Measures:
    """Measures how far values are from golden ones.

    Parameters
    ----------
    golden, values : array of float32, shape (height, width) or (depth, height, width)
    mask : array of bool or uint8, of that shape, optional
        compared where it is not 0
    **options
        vdbshade.types.CompareOptions
    """
    compared, keeps = _compared(golden, values, mask)
    measures = ffi.new("vsh_measures *")
    call(lib.vsh_compare, compared, Filled("vsh_compare_options", options).pointer, RUN, measures, run=run)
    del keeps
    return _measures(measures[0])


def compare_coverage(golden: Optional[ArrayLike], values: Optional[ArrayLike]) -> Tuple[types.Coverage, numpy.ndarray]:
    """Compares two planes of coverage (covered above 1/2; None: everywhere), and where both are covered: uint8 of their shape."""
    planes = [None if p is None else numpy.asarray(p) for p in (golden, values)]
    shape = next((p.shape for p in planes if p is not None), None)
    if shape is None:
        raise TypeError("golden, values: expected an array for one of them")
    given = [None if p is None else array(p, numpy.float32, shape, "coverage") for p in planes]
    mask, found = numpy.empty(shape, numpy.uint8), ffi.new("vsh_coverage *")
    lib.vsh_compare_coverage(mask.size, pointer(given[0]), pointer(given[1]), pointer(mask), found)
    return told(found[0], "vsh_coverage"), mask


def compare_accuracy(truths: Sequence[ArrayLike], values: Sequence[ArrayLike], masks: Optional[Sequence[ArrayLike]] = None, *,
                     run: Optional[Run] = None) -> types.Accuracy:
    """How far planes of values, 0 … 1, are from their truths, together."""
    if len(truths) != len(values) or (masks is not None and len(masks) != len(values)):
        raise ValueError(f"expected as many truths as values and masks, got {len(truths)} and {len(values)}")
    parts = [_compared(t, v, None if masks is None else masks[i]) for i, (t, v) in enumerate(zip(truths, values))]
    planes = ffi.new("vsh_compared[]", [p[0][0] for p in parts] or 1)
    found = ffi.new("vsh_accuracy *")
    call(lib.vsh_compare_accuracy, planes, len(parts), RUN, found, run=run)
    return told(found[0], "vsh_accuracy")


class Limits:
    """What a channel is allowed: `value` is a dict by measures' names; members of `options` as of compare().

    Parameters
    ----------
    noise : float
        standard error that the differences may have by sampling, in units of the range
    **values
        limits: rmse=0.01, shift=0.2, …
    """

    def __init__(self, *, noise: float = 0.0, **values: float) -> None:
        self.struct = ffi.new("vsh_limits *")
        self.struct[0] = lib.vsh_limits_default()
        if noise:
            lib.vsh_limits_allow_noise(self.struct, noise)
        for name, value in values.items():
            self.struct.value[constant("VSH_MEASURE_", name, "measure")] = value

    @property
    def value(self) -> Dict[str, float]:
        return dict(zip(MEASURES, self.struct.value))


def compare_judge(measures: Measures, limits: Optional[Limits] = None) -> List[str]:
    """Names of the measures that do not hold; none: they are alike."""
    failed = lib.vsh_compare_judge(measures._struct, (limits or Limits()).struct)
    return [name for i, name in enumerate(MEASURES) if failed >> i & 1]


class Tolerances(Handle):
    """Limits from a JSON file (docs/regression.md)."""

    def __init__(self, path: "str | os.PathLike[str]") -> None:
        super().__init__(make(lib.vsh_tolerances_free, lib.vsh_tolerances_read, path_of(path, "path"), place("vsh_tolerances")))

    def limits(self, channel: str) -> Tuple[Limits, float]:
        """What it says of a channel, and the share of covered texels that may differ (NaN: nothing)."""
        limits, coverage = Limits(), ffi.new("double *", float("nan"))
        lib.vsh_tolerances_apply(self.handle, channel.encode(), limits.struct, coverage)
        return limits, coverage[0]


class Comparison:
    """What came of comparing two files.

    Attributes
    ----------
    alike : bool
    channels : list of vdbshade.types.ChannelComparison
        `failed` are names of measures
    problems : list of str
    """

    def __init__(self, cdata: Any) -> None:
        self.alike = bool(lib.vsh_comparison_alike(cdata))
        self.channels: List[types.ChannelComparison] = []
        self.problems: List[str] = []
        while lib.vsh_comparison_channel(cdata, len(self.channels)) != ffi.NULL:
            struct = lib.vsh_comparison_channel(cdata, len(self.channels))[0]
            channel = told(struct, "vsh_channel_comparison")
            channel.measures = _measures(struct.measures)
            channel.failed = [name for i, name in enumerate(MEASURES) if struct.failed >> i & 1]
            self.channels.append(channel)
        while lib.vsh_comparison_problem(cdata, len(self.problems)) != ffi.NULL:
            self.problems.append(text(lib.vsh_comparison_problem(cdata, len(self.problems))) or "")

    def __bool__(self) -> bool:
        return self.alike

    def __repr__(self) -> str:
        return f"<vdbshade.Comparison: {'alike' if self.alike else 'not alike'}, {len(self.channels)} channels, problems {self.problems}>"


def compare_files(golden: "str | os.PathLike[str]", fresh: "str | os.PathLike[str]", *, limits: Optional[Mapping[str, float]] = None,
                  run: Optional[Run] = None, **options: "Unpack[types.CompareFilesOptions]") -> Comparison:
    """Compares two images channel by channel, or two .vdb files grid by grid.

    Parameters
    ----------
    limits : mapping, optional
        by measures' names, of all channels
    **options
        vdbshade.types.CompareFilesOptions: tolerances, coverage, noise, padding, …
    """
    filled = Filled("vsh_compare_files_options", options)
    for name, value in (limits or {}).items():
        filled.pointer.limits[constant("VSH_MEASURE_", name, "limits")] = value
    return Comparison(make(lib.vsh_comparison_free, lib.vsh_compare_files, path_of(golden, "golden"), path_of(fresh, "fresh"),
                           filled.pointer, RUN, place("vsh_comparison"), run=run))


__all__ = ["Comparison", "Limits", "Measures", "Tolerances", "compare", "compare_accuracy", "compare_coverage", "compare_files",
           "compare_judge"]
