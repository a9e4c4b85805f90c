"""Comparing baked values with golden ones."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array
from ._calls import OUT, Handle, Run, ask, call
from ._library import Path, Unpack, ffi, lib
from ._structs import Filled, constant, path_of, structs_of, told
from ._tables import WORDS

MEASURES = tuple(WORDS["VSH_MEASURE_"])


class Measures(types.Measures):
    """Differences of values from golden ones. `value` is a dict of "nonfinite", "shift", "penumbra", "lost", "gained", "rmse",
    "p99" and "max"; NaN if a measure does not apply."""

    value: Dict[str, float]  # type: ignore[assignment]
    _struct: Any


def _measures(struct: Any) -> Measures:
    found = Measures(**told(struct).__dict__)
    found.value = dict(zip(MEASURES, struct.value))
    found._struct = ffi.new("vsh_measures *", struct)
    return found


def _failed(bits: int) -> List[str]:
    return [name for i, name in enumerate(MEASURES) if bits >> i & 1]


def _compared(golden: ArrayLike, values: ArrayLike, mask: Optional[ArrayLike]) -> Filled:
    shape = numpy.shape(golden)
    if len(shape) not in (2, 3):
        raise ValueError(f"golden: expected shape (height, width) or (depth, height, width), got {shape}")
    if max(shape, default=0) >= 2**31:
        raise ValueError(f"golden: {shape}: too large")
    return Filled("vsh_compared", size=list(reversed(shape)) + [1] * (3 - len(shape)), golden=array(golden, numpy.float32, shape, "golden"),
                  values=array(values, numpy.float32, shape, "values"),
                  mask=None if mask is None else array(mask, numpy.uint8, shape, "mask"))


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
    measures = ffi.new("vsh_measures *")
    call(lib.vsh_compare, _compared(golden, values, mask), Filled("vsh_compare_options", options), measures, run=run)
    return _measures(measures[0])


def compare_coverage(golden: Optional[ArrayLike], values: Optional[ArrayLike]) -> Tuple[types.Coverage, numpy.ndarray]:
    """Compares two planes of coverage (covered above 1/2; None: everywhere), and where both are covered: uint8 of their shape."""
    planes = [None if p is None else numpy.asarray(p) for p in (golden, values)]
    shape = next((p.shape for p in planes if p is not None), None)
    if shape is None:
        raise TypeError("golden, values: expected an array for one of them")
    given = [None if p is None else array(p, numpy.float32, shape, "coverage") for p in planes]
    mask = numpy.empty(shape, numpy.uint8)
    return ask(lib.vsh_compare_coverage, mask.size, *given, mask, OUT), mask


def compare_accuracy(truths: Sequence[ArrayLike], values: Sequence[ArrayLike], masks: Optional[Sequence[ArrayLike]] = None, *,
                     run: Optional[Run] = None) -> types.Accuracy:
    """How far planes of values, 0 … 1, are from their truths, together."""
    if len(truths) != len(values) or (masks is not None and len(masks) != len(values)):
        raise ValueError(f"expected as many truths as values and masks, got {len(truths)} and {len(values)}")
    parts = [_compared(t, v, None if masks is None else masks[i]) for i, (t, v) in enumerate(zip(truths, values))]
    return call(lib.vsh_compare_accuracy, structs_of("vsh_compared", parts), len(parts), OUT, run=run)


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
    return _failed(ask(lib.vsh_compare_judge, measures._struct, (limits or Limits()).struct))


class Tolerances(Handle, kind="vsh_tolerances"):
    """Limits from a JSON file (docs/regression.md)."""

    def __init__(self, path: Path) -> None:
        super().__init__(call(lib.vsh_tolerances_read, path_of(path, "path"), OUT))

    def limits(self, channel: str) -> Tuple[Limits, float]:
        """What it says of a channel, and the share of covered texels that may differ (NaN: nothing)."""
        limits, coverage = Limits(), ffi.new("double *", float("nan"))
        ask(lib.vsh_tolerances_apply, self, channel, limits.struct, coverage)
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
            channel = told(struct)
            channel.measures, channel.failed = _measures(struct.measures), _failed(struct.failed)
            self.channels.append(channel)
        while True:
            problem = ask(lib.vsh_comparison_problem, cdata, len(self.problems))
            if problem is None:
                break
            self.problems.append(problem)

    def __bool__(self) -> bool:
        return self.alike

    def __repr__(self) -> str:
        return f"<vdbshade.Comparison: {'alike' if self.alike else 'not alike'}, {len(self.channels)} channels, problems {self.problems}>"


def compare_files(golden: Path, fresh: Path, *, limits: Optional[Mapping[str, float]] = None,
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
        filled.struct.limits[constant("VSH_MEASURE_", name, "limits")] = value
    return Comparison(call(lib.vsh_compare_files, path_of(golden, "golden"), path_of(fresh, "fresh"), filled, OUT, run=run))
