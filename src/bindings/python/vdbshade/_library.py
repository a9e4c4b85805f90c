"""The library itself: where it is, its errors as exceptions, and how calls run.

Every call releases the GIL while it is in C."""
from __future__ import annotations

import os
import sys
import threading
import warnings
from typing import Any, Callable, List, Optional

from . import _abi
from ._tables import VERSION, WORDS

ffi = _abi.ffi


def _load() -> Any:
    """The library beside this package as _location.py says, else as the system finds it."""
    try:
        from ._location import LIBRARY
    except ImportError:
        LIBRARY = ""
    beside = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), LIBRARY))
    name = f"libvdbshade.so.{VERSION}"
    # Never unloaded: its pool's threads wait in it when Python ends.
    loaded = ffi.dlopen(beside if LIBRARY and os.path.exists(beside) else name, ffi.RTLD_NOW | ffi.RTLD_NODELETE)
    found = ffi.string(loaded.vsh_version()).decode()
    if ".".join(found.split(".")[:2]) != VERSION:
        raise ImportError(f"vdbshade: this module is for version {VERSION} of the library, but {name} is {found}")
    return loaded


lib = _load()


class Error(Exception):
    """A call failed; the message is the library's, one line that names file, place, value and limit.

    Attributes
    ----------
    code : int
        ``VSH_ERROR_…`` of the headers
    name : str
        the same in words, "VSH_ERROR_INPUT"
    """

    code = 0

    def __init__(self, message: str = "", code: int = 0) -> None:
        super().__init__(message)
        self.message = message
        self.code = code or self.code

    @property
    def name(self) -> str:
        return ffi.string(lib.vsh_result_name(self.code)).decode()

    def __str__(self) -> str:
        return self.message


class ArgumentError(Error, ValueError):
    """A parameter or option is out of its range."""


class InputError(Error, ValueError):
    """The content of a file, mesh, grid or scene is bad."""


class ReadError(Error, OSError):
    """A file could not be read."""


class WriteError(Error, OSError):
    """A file could not be written; the old one is as it was."""


class LimitError(Error):
    """A memory or size limit would be passed; found before memory is taken."""


class OutOfMemoryError(Error, MemoryError):
    """The system refused memory."""


class Cancelled(Error):
    """The progress callback asked to stop."""


class UnsupportedError(Error):
    """Valid input that this build does not handle."""


class InternalError(Error):
    """A defect of the library."""


class VdbshadeWarning(UserWarning):
    """Something bad was worked around (docs/warnings.md)."""


_ERRORS = {WORDS["VSH_ERROR_"][word]: kind for word, kind in {
    "argument": ArgumentError, "input": InputError, "read": ReadError, "write": WriteError, "limit": LimitError,
    "memory": OutOfMemoryError, "cancelled": Cancelled, "unsupported": UnsupportedError, "internal": InternalError}.items()}


def fail(result: int, error: Any) -> None:
    """Raises what a result other than VSH_OK stands for."""
    message = ffi.string(error.message).decode("utf-8", "replace")
    raise _ERRORS.get(result, Error)(message, result)


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
        True: files are parsed in the library's confined reader (docs/SECURITY.md); a path: by that program;
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
                 reader: "bool | str | os.PathLike[str]" = True, reader_seconds: float = 0.0,
                 confined: bool = False, allow_outside: bool = False, memory_held: int = 0, notes: bool = False) -> None:
        from ._structs import Filled
        if not interval >= 0.0:
            raise ValueError(f"interval {interval}: expected seconds, at least 0")
        for what, given in (("progress", progress), ("warning", warning)):
            if given is not None and not callable(given):
                raise TypeError(f"{what}: expected a function, got {type(given).__name__}")
        if reader is True:
            reader = "vdbshade-reader"
        self._filled = Filled("vsh_run", dict(
            threads=threads, memory_limit=memory_limit, isa=isa, reader=reader or None, reader_seconds=reader_seconds,
            confined=confined, allow_outside=allow_outside, memory_held=memory_held, notes=notes))
        self.progress = progress
        self.warning = warning
        self.interval = float(interval)

    @property
    def struct(self) -> Any:
        """``vsh_run *`` without callbacks: for calls that end at once."""
        return self._filled.pointer


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
    """What a callback raised; the call that it was of raises it when it comes back."""
    running = None
    if traceback is not None:
        running = traceback.tb_frame.f_locals.get("running")
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
RUN: Any = object()  # stands for the run in the arguments of call()


def call(function: Any, *arguments: Any, run: Optional[Run] = None, made: Any = None) -> Any:
    """Calls a function that returns a vsh_result, with an error behind `arguments`; RUN among them is a vsh_run
    whose progress, warnings and Ctrl-C work. `made` (a free function, and the handle's place among `arguments`):
    the handle is returned, which is freed when nothing refers to it any more."""
    given = run_of(run)
    error = ffi.new("vsh_error *")
    running = Running(given, getattr(_in_thread, "running", None))
    handle = ffi.new_handle(running)
    filtered = ffi.new("vsh_progress_filter *")
    filtered.struct_size, filtered.user, filtered.seconds = _FILTER_SIZE, handle, given.interval
    filtered.thread = threading.get_ident()
    if given.progress is not None or threading.current_thread() is threading.main_thread():
        filtered.progress = _progress
    struct = ffi.new("vsh_run *", given.struct[0])
    struct.progress, struct.warning, struct.user = _SELDOM, _warning, filtered
    _in_thread.running = running
    try:
        result = function(*[struct if a is RUN else a for a in arguments], error)
    finally:
        _in_thread.running = running.outer
    owned = None
    if made is not None and made[1][0] != ffi.NULL:
        owned = ffi.gc(made[1][0], made[0])
    for message in running.messages:
        warnings.warn(message, VdbshadeWarning, stacklevel=_level_of_caller())
    if running.raised is not None:
        raise running.raised
    if result != 0:
        fail(result, error)
    running.finish()
    return owned


def _level_of_caller() -> int:
    """How far up the first frame is that is not this package's: what a warning is about."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    return level


def text(pointer: Any) -> Optional[str]:
    """A string of the library's; None for NULL."""
    return None if pointer == ffi.NULL else ffi.string(pointer).decode("utf-8", "replace")


def place(kind: str) -> Any:
    """Where a call puts a handle: ``place("vsh_grid")``."""
    return ffi.new(kind + " **")


def make(free: Any, function: Any, *arguments: Any, run: Optional[Run] = None) -> Any:
    """call() of a function that makes a handle, whose place is the last of `arguments`."""
    return call(function, *arguments, run=run, made=(free, arguments[-1]))


class Handle:
    """What the library made: it is freed when nothing refers to it any more, or at the end of a ``with``."""

    _cdata: Any
    _keeps: Any  # what must live as long

    def __init__(self, cdata: Any, keeps: Any = None) -> None:
        self._cdata, self._keeps = cdata, keeps

    @property
    def handle(self) -> Any:
        """The C handle, for calls; ValueError where it was closed."""
        if self._cdata is None:
            raise ValueError(f"{type(self).__name__} is closed")
        return self._cdata

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


def handle_of(thing: Any, kind: type, name: str) -> Any:
    """The C handle of an argument, which has to be of a class."""
    if not isinstance(thing, kind):
        raise TypeError(f"{name}: expected a vdbshade.{kind.__name__}, got {type(thing).__name__}")
    return thing.handle  # type: ignore[attr-defined]
