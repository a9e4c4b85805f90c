"""The library itself: where it is, and its errors as exceptions."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _abi
from ._tables import VERSION, WORDS

if TYPE_CHECKING:
    from typing_extensions import Unpack as Unpack
else:
    Unpack = Any  # for annotations alone

ffi = _abi.ffi
Path = Union[str, "os.PathLike[str]"]


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


def text(pointer: Any) -> Optional[str]:
    """A string of the library's; None for NULL."""
    return None if pointer == ffi.NULL else ffi.string(pointer).decode("utf-8", "replace")
