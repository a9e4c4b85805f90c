"""How calls run: their arguments and results, progress, warnings, Ctrl-C, and the handles that they make.

Every call releases the GIL while it is in C."""
from __future__ import annotations

import sys
import threading
import warnings
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy

from ._arrays import pointer
from ._library import Path, VdbshadeWarning, fail, ffi, lib, text
from ._structs import Filled, Struct, is_text, kind_of, struct_of, told


class Run:
    """How a call runs. No result depends on it.

    Parameters
    ----------
    threads : int
        0 … 1024; 0: all cores
    memory_limit : int
        bytes that one call may hold, with the handles given to it; else LimitError. 0: no limit
    progress : callable, optional
        called as ``progress(stage, fraction)`` from the thread that made the call, with a stage's name and a
        fraction 0 … 1; what it returns cancels where it is true, what it raises is raised by the call
    interval : float
        seconds, at least so many apart
    warning : callable, optional
        called as ``warning(message)``, by whatever thread; None: ``warnings.warn(message, VdbshadeWarning)``
    notes : bool
        notes come as warnings do, and begin with "note: ": they say what was decided, and need no action
    isa : str
        instruction set of the marching kernels: "best", "base", "avx2", "avx512"
    reader : bool or str
        True: files are parsed in the library's confined reader (docs/security.md); a path: by that program;
        False: in this process, where a damaged file can crash it
    reader_seconds : float
        that the reader may take for one file; 0: 60, and one more for each MB
    confined : bool
        nothing is read where the system refuses one of the reader's confinements
    allow_outside : bool
        what a model names may lie outside its folder
    memory_held : int
        bytes of memory_limit that the caller holds beside what it gives to the call
    """

    def __init__(self, *, threads: int = 0, memory_limit: int = 0,
                 progress: Optional[Callable[[str, float], Any]] = None, interval: float = 0.02,
                 warning: Optional[Callable[[str], Any]] = None, isa: str = "best",
                 reader: "bool | Path" = True, reader_seconds: float = 0.0,
                 confined: bool = False, allow_outside: bool = False, memory_held: int = 0, notes: bool = False) -> None:
        if not interval >= 0.0:
            raise ValueError(f"interval {interval}: expected seconds, at least 0")
        for what, given in (("progress", progress), ("warning", warning)):
            if given is not None and not callable(given):
                raise TypeError(f"{what}: expected a function, got {type(given).__name__}")
        if reader is True:
            reader = "vdbshade-reader"
        self._filled = Filled("vsh_run", threads=threads, memory_limit=memory_limit, isa=isa, reader=reader or None,
                              reader_seconds=reader_seconds, confined=confined, allow_outside=allow_outside, memory_held=memory_held,
                              notes=notes)
        self.progress = progress
        self.warning = warning
        self.interval = float(interval)

    @property
    def struct(self) -> Any:
        """``vsh_run *`` without callbacks: for calls that end at once."""
        return self._filled.struct


_default: Optional[Run] = None


def run_of(run: Optional[Run]) -> Run:
    global _default
    if run is None:
        if _default is None:
            _default = Run()
        return _default
    if not isinstance(run, Run):
        raise TypeError(f"run: expected a vdbshade.Run, got {type(run).__name__}")
    return run


class Running:
    """A call that is in C: what its callbacks raised, and the warnings that came."""

    __slots__ = ("run", "raised", "messages", "outer", "open", "__weakref__")

    def __init__(self, run: Run, outer: "Optional[Running]") -> None:
        self.run, self.outer = run, outer
        self.raised: Optional[BaseException] = None
        self.messages: List[str] = []
        self.open: Optional[str] = None  # the stage whose end was not told: another thread came to it

    def tell(self, stage: str, fraction: float) -> bool:
        """Tells how far a stage is; True: it is to stop."""
        progress, before = self.run.progress, self.open
        if progress is None:
            return False
        self.open = stage if fraction < 1.0 else None
        stops = before is not None and before != stage and bool(progress(before, 1.0))
        return bool(progress(stage, fraction)) or stops

    def finish(self) -> None:
        """Tells the end of the last stage of a call that is done; too late to stop."""
        if self.open is not None:
            self.tell(self.open, 1.0)


_in_thread = threading.local()


def note(kind: Any, value: Any, traceback: Any) -> None:
    """Keeps what a callback raised in its local variable ``running``; the call raises it when it returns."""
    running = traceback.tb_frame.f_locals.get("running") if traceback is not None else None
    running = running or getattr(_in_thread, "running", None)
    if running is not None and running.raised is None:
        running.raised = value if isinstance(value, BaseException) else kind(value)


# Called by the thread that made the call alone (vsh_progress_filter.thread), which is where Python hands out signals: a
# Ctrl-C is raised in here, and cancels.
@ffi.callback("vsh_progress_fn *", error=1, onerror=note)
def _progress(user: Any, stage: Any, fraction: float) -> int:
    running = ffi.from_handle(user)
    if running.raised is not None:
        return 1
    return 1 if running.tell(ffi.string(stage).decode(), fraction) else 0


@ffi.callback("vsh_warning_fn *", onerror=note)
def _warning(user: Any, message: Any) -> None:
    running = ffi.from_handle(ffi.cast("vsh_progress_filter *", user).user)
    text = ffi.string(message).decode("utf-8", "replace")
    if running.run.warning is not None:
        running.run.warning(text)
    else:
        running.messages.append(text)


_SELDOM = ffi.addressof(lib, "vsh_progress_seldom")
_FILTER_SIZE = ffi.sizeof("vsh_progress_filter")
OUT: Any = object()  # an argument that the library fills: its value is returned


class Several:
    """So many values that the library fills: a tuple, or a list of records."""

    def __init__(self, count: int) -> None:
        self.count = count


_FREE = {"vsh_image_file": "vsh_image_free", "vsh_image_writer": "vsh_image_writer_abandon", "vsh_light": "vsh_lights_free"}
_RUN, _ERROR = ffi.typeof("vsh_run *"), ffi.typeof("vsh_error *")  # arguments that callers do not name
_types: Dict[Any, list] = {}


def _types_of(function: Any) -> list:
    """For each argument of a function its type, and the struct that it points to, if any."""
    if function not in _types:
        _types[function] = [(kind, kind.item if kind.kind == "pointer" and kind.item.kind == "struct" else None)
                            for kind in ffi.typeof(function).args]
    return _types[function]


def _arguments(function: Any, given: Tuple[Any, ...], run: Any, error: Any) -> Tuple[list, list]:
    """Arguments as C takes them, with the run and the error if the function has them; and what it fills."""
    arguments, filled, rest = [], [], iter(given)
    for kind, struct in _types.get(function) or _types_of(function):
        one = run if kind is _RUN else error if kind is _ERROR else next(rest)
        if one is OUT:
            one = ffi.new(kind)
            filled.append((one, None))
        elif one.__class__ is Several:
            several, one = one, ffi.new(ffi.typeof(kind.item.cname + "[]"), max(one.count, 1))
            filled.append((one, several.count))
        elif struct is not None:
            one = struct_of(one, struct)
        elif one is None:
            one = ffi.NULL
        elif isinstance(one, numpy.ndarray):
            one = pointer(one)
        elif isinstance(one, str):
            one = one.encode()
        arguments.append(one)
    return arguments, filled


def _value(place: Any, count: Optional[int], keeps: Any) -> Any:
    """A result: a number, a record, a pointer, a handle that is freed when nothing refers to it, or several."""
    item = ffi.typeof(place).item
    if count is not None:
        return [told(place[i]) for i in range(count)] if item.kind == "struct" else tuple(place)[:count]
    if item.kind == "struct":
        return told(place[0])
    if item.kind != "pointer" or item.item.kind != "struct":
        return place[0]
    kind = kind_of(item.item)
    free = getattr(lib, _FREE.get(kind, kind + "_free"))
    if place[0] == ffi.NULL:
        return None
    return ffi.gc(place[0], free if keeps is None else lambda cdata, keeps=keeps: free(cdata))


def _values(filled: list, keeps: Any) -> Any:
    values = [_value(place, count, keeps) for place, count in filled]
    return values[0] if len(values) == 1 else tuple(values) if values else None


def ask(function: Any, *given: Any) -> Any:
    """Calls a function that cannot fail: its result, or what it fills (OUT)."""
    arguments, filled = _arguments(function, given, None, None)
    result = function(*arguments)
    if filled:
        return _values(filled, None)
    kind = ffi.typeof(function).result
    return told(result) if kind.kind == "struct" else text(result) if is_text(kind) else result


def call(function: Any, *given: Any, run: Optional[Run] = None, keeps: Any = None, watched: Any = None) -> Any:
    """Calls a function that returns a vsh_result; its run and its error are added. Returns what it fills (OUT), several in a tuple.

    Parameters
    ----------
    keeps
        what a handle that is made refers to: it lives as long
    watched
        an object whose ``raised`` other callbacks set
    """
    running = Running(run_of(run), getattr(_in_thread, "running", None))
    handle, error = ffi.new_handle(running), ffi.new("vsh_error *")
    filtered = ffi.new("vsh_progress_filter *")
    filtered.struct_size, filtered.user, filtered.seconds = _FILTER_SIZE, handle, running.run.interval
    filtered.thread = threading.get_ident()
    if running.run.progress is not None or threading.current_thread() is threading.main_thread():
        filtered.progress = _progress
    struct = ffi.new("vsh_run *", running.run.struct[0])
    struct.progress, struct.warning, struct.user = _SELDOM, _warning, filtered
    arguments, filled = _arguments(function, given, struct, error)
    _in_thread.running = running
    try:
        result = function(*arguments)
    finally:
        _in_thread.running = running.outer
    values = _values(filled, keeps) if filled and result == 0 else None
    for message in running.messages:
        warnings.warn(message, VdbshadeWarning, stacklevel=_level_of_caller())
    raised = running.raised or (watched.raised if watched is not None and result != 0 else None)
    if raised is not None:
        raise raised
    if result != 0:
        fail(result, error)
    running.finish()
    return values


def _level_of_caller() -> int:
    """Counts the frames up to the first one outside this package, which a warning is about."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    return level


class Handle(Struct):
    """An object of the library. It is freed when nothing refers to it any more, or at the end of a ``with``."""

    _cdata: Any
    _keeps: Any  # what must live as long

    def __init__(self, cdata: Any, keeps: Any = None) -> None:
        self._cdata, self._keeps = cdata, keeps

    @classmethod
    def _of(cls, cdata: Any, keeps: Any = None) -> Any:
        """An object for a handle; None for none."""
        if cdata is None or cdata == ffi.NULL:
            return None
        self = cls.__new__(cls)
        Handle.__init__(self, cdata, keeps)
        return self

    @classmethod
    def _borrow(cls, cdata: Any, owner: Any) -> Any:
        """An object for a handle that is another's, which lives as long; None for none."""
        return cls._of(None if cdata == ffi.NULL else ffi.gc(ffi.cast(ffi.typeof(cdata), cdata), lambda _, keeps=owner: None), owner)

    @property
    def handle(self) -> Any:
        """The C handle, for calls; ValueError where it was closed."""
        if self._cdata is None:
            raise ValueError(f"{type(self).__name__} is closed")
        return self._cdata

    struct = handle  # type: ignore[assignment]

    @property
    def info(self) -> Any:
        """Its properties, a record of vdbshade.types."""
        return ask(getattr(lib, self.KIND + "_get_info"), self, OUT)

    def close(self) -> None:
        """Lets it go before its time; calls under way end first. To close it twice does nothing."""
        self._cdata = None

    @property
    def closed(self) -> bool:
        return self._cdata is None

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError(f"{type(self).__name__} can be neither pickled nor copied: it lives in this process; make it in each")

    def __enter__(self) -> Any:
        self.handle
        return self

    def __exit__(self, *raised: Any) -> None:
        self.close()


def index_of(index: int, count: int, what: str, told: str = "there are") -> int:
    """An index from 0, of one that may count from the end; IndexError where there is none."""
    if not -count <= index < count:
        raise IndexError(f"{what} {index}: {told} {count}")
    return index % count
