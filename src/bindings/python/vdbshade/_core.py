"""Calls of the library: loading it, its errors, arrays, structs and handles.

Every call releases the GIL while it is in C."""
from __future__ import annotations

import os
import sys
import threading
import warnings
import weakref
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Type, TypeVar, Union

import numpy
from numpy.typing import NDArray

from . import _abi, types
from ._version import VERSION

__all__ = ["ArgumentError", "Cancelled", "Error", "InputError", "InternalError", "LimitError", "OutOfMemoryError", "ReadError",
           "Run", "UnsupportedError", "VdbshadeWarning", "WriteError"]

# --- the library and its errors

if TYPE_CHECKING:
    from typing_extensions import Unpack as Unpack
else:
    Unpack = Any  # for annotations alone

ffi = _abi.ffi
Path = types.Path
Array = NDArray[Any]
Floats = NDArray[numpy.float32]


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
        return str(ffi.string(lib.vsh_result_name(self.code)).decode())

    def __str__(self) -> str:
        return self.message


class ArgumentError(Error, ValueError):
    """A parameter or option is out of its range."""


class InputError(Error, ValueError):
    """The content of a file, mesh, grid or scene is bad."""


class ReadError(Error, OSError):
    """A file could not be read."""


class WriteError(Error, OSError):
    """A file could not be written; the old one is unchanged."""


class LimitError(Error):
    """A memory or size limit would be exceeded. Checked before allocating."""


class OutOfMemoryError(Error, MemoryError):
    """The system refused memory."""


class Cancelled(Error):
    """The progress callback asked to stop."""


class UnsupportedError(Error):
    """Valid input that this build does not handle."""


class InternalError(Error):
    """A defect of the library."""


class VdbshadeWarning(UserWarning):
    """A problem was worked around (docs/warnings.md)."""


_ERRORS = {getattr(lib, "VSH_ERROR_" + word.upper()): kind for word, kind in {
    "argument": ArgumentError, "input": InputError, "read": ReadError, "write": WriteError, "limit": LimitError,
    "memory": OutOfMemoryError, "cancelled": Cancelled, "unsupported": UnsupportedError, "internal": InternalError}.items()}


def fail(result: int, error: Any) -> None:
    """Raises the exception of a result other than VSH_OK."""
    message = ffi.string(error.message).decode("utf-8", "replace")
    raise _ERRORS.get(result, Error)(message, result)


def text(pointer: Any) -> Optional[str]:
    """A string of the library's; None for NULL."""
    return None if pointer == ffi.NULL else str(ffi.string(pointer).decode("utf-8", "replace"))


# --- numpy arrays for C, without a copy if possible, and views of the library's memory

_NAMES = {"f": "float", "d": "double", "I": "uint32_t", "i": "int32_t", "B": "uint8_t"}


def _shape_text(shape: Sequence[Optional[int]]) -> str:
    return "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"


def array(given: Any, dtype: Any, shape: Sequence[Optional[int]], name: str) -> Array:
    """`given` as a C-contiguous array of `dtype` and `shape` (None: any length). Copied only if needed.

    TypeError for numbers that cannot become `dtype`, ValueError for another shape or a number that does not fit."""
    dtype = numpy.dtype(dtype)
    found = given if type(given) is numpy.ndarray else numpy.asarray(given)
    if found.dtype != dtype:
        if found.size == 0 and found.dtype == numpy.float64:
            found = found.astype(dtype)  # an empty list
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


def output(out: Any, dtype: Any, shape: Tuple[int, ...], name: str) -> Array:
    """`out`, to be written into, or a new array for None."""
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


def pointer(values: Optional[Array]) -> Any:
    """A pointer to its first element, which keeps the array alive. NULL for None."""
    if values is None:
        return ffi.NULL
    kind = _NAMES[values.dtype.char]
    if values.size == 0 or not values.flags.writeable:
        return ffi.from_buffer(kind + "[]", values)
    return ffi.from_buffer(kind + "[]", values, require_writable=True)


class _Borrowed:
    """Memory of the library, and its owner."""

    def __init__(self, address: int, shape: Tuple[int, ...], dtype: numpy.dtype[Any], owner: Any) -> None:
        self.owner = owner
        self.__array_interface__ = {"data": (address, True), "shape": shape, "typestr": dtype.str, "version": 3}


def borrowed(cdata: Any, shape: Tuple[int, ...], dtype: Any, owner: Any) -> Any:
    """A view of the library's memory, read-only, that keeps `owner` alive; None for NULL."""
    if cdata == ffi.NULL:
        return None
    if 0 in shape:
        return numpy.zeros(shape, dtype)
    return numpy.asarray(_Borrowed(int(ffi.cast("uintptr_t", cdata)), shape, numpy.dtype(dtype), owner))


def transform(given: Any, name: str = "transform") -> Optional[Array]:
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
    """`length` numbers as ``double[]``."""
    return pointer(array(given, numpy.float64, (length,), name))


# --- structs from keywords and back: members by their names, constants by words, lengths checked


_words: Dict[str, Dict[str, int]] = {}


def words(enum: str) -> Dict[str, int]:
    """The words of an enum's constants, without what all begin with: ``words("vsh_up")["minus_x"]``. Negative ones last."""
    if enum not in _words:
        constants = ffi.typeof(enum).relements
        begin = os.path.commonprefix(list(constants)).rfind("_") + 1
        _words[enum] = {name[begin:].lower(): constants[name] for name in sorted(constants, key=lambda name: int(constants[name]) & 0xFFFFFFFF)}
    return _words[enum]


def constant(enum: str, given: Any, name: str) -> int:
    """The number of a word: ``constant("vsh_shadow_method", "cone", "method")``."""
    table = words(enum)
    if isinstance(given, str):
        word = given.lower().replace("-", "_")
        if enum == "vsh_up" and word.startswith("_"):
            word = "minus" + word
        if word not in table:
            raise ValueError(f"{name} {given!r}: expected one of {', '.join(table)}")
        return table[word]
    if isinstance(given, (int, numpy.integer)) and not isinstance(given, bool):
        return int(given)
    raise TypeError(f"{name}: expected one of {', '.join(table)}, got {type(given).__name__}")


def word(enum: str, number: int) -> Any:
    """The word of a number, or the number if it has no word."""
    return next((w for w, n in words(enum).items() if n == number), number)


def words_of_bits(enum: str, bits: int) -> List[str]:
    """The words of the single bits that are set."""
    return [name for name, bit in words(enum).items() if bits & bit and bit & (bit - 1) == 0]


def path_of(given: Any, name: str) -> bytes:
    """A path as bytes."""
    try:
        path = os.fsencode(given)
    except TypeError:
        raise TypeError(f"{name}: expected a path, got {type(given).__name__}") from None
    if b"\0" in path:
        raise ValueError(f"{name}: a path with a NUL byte")
    return path


def text_of(value: Any, name: str) -> Any:
    """A string or a path as ``char[]``."""
    encoded = value.encode() if isinstance(value, str) else path_of(value, name)
    if b"\0" in encoded:
        raise ValueError(f"{name}: a text with a NUL character")
    return ffi.new("char[]", encoded)


# Keeps the targets of a struct's pointers alive as long as the struct.
_KEPT: Any = weakref.WeakKeyDictionary()


def keep(struct: Any, keeps: Any) -> Any:
    """Keeps objects alive as long as a struct or an array that ffi.new() made. They must not refer to it."""
    _KEPT[struct] = keeps
    return struct


def texts_of(values: Sequence[Any], name: str) -> Any:
    """Strings or paths as ``char *[]``."""
    texts = [text_of(value, name) for value in values]
    return keep(ffi.new("char *[]", texts or 1), texts)


_fields_known: Dict[str, Dict[str, Any]] = {}
_defaults: Dict[str, Any] = {}
_classes: Dict[Any, Any] = {}  # by types of structs


def _fields(kind: str) -> Dict[str, Any]:
    if kind not in _fields_known:
        _fields_known[kind] = {name: field.type for name, field in (kind and ffi.typeof(kind).fields) or ()}
    return _fields_known[kind]


def members(kind: str) -> List[str]:
    """Names of a struct's members."""
    return list(_fields(kind))


def is_text(ctype: Any) -> bool:
    """Whether a type is a pointer to characters."""
    return ctype.kind == "pointer" and ctype.item.cname in ("char", "char const")


def kind_of(ctype: Any) -> str:
    """The name of a struct or an enum: "vsh_grid"."""
    return str(ctype.cname.split(" ")[1])


class Struct:
    """An object that C sees as a pointer to a struct.

    Attributes
    ----------
    struct : cdata
        the pointer, which keeps the targets of the struct's pointers alive
    """

    KIND = ""
    OPTIONAL = True  # whether None may become NULL
    struct: Any
    _owner: Any

    def __init_subclass__(cls, kind: str = "") -> None:
        if kind:
            cls.KIND, cls.OPTIONAL = kind, False
            _classes[ffi.typeof(kind)] = cls

    def __getattr__(self, name: str) -> Any:
        if name[:1] == "_" or name in ("struct", "struct_size") or name not in _fields(self.KIND):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return member(self.struct, self.KIND, name)


def struct_of(given: Any, ctype: Any, name: Optional[str] = None) -> Any:
    """The C pointer of a struct or a handle; TypeError for an object of another class."""
    if isinstance(given, ffi.CData):
        return given
    expected = _classes.get(ctype, Struct)
    if given is None and expected.OPTIONAL:
        return ffi.NULL
    if not isinstance(given, expected) and not isinstance(given, Filled):
        raise TypeError(f"{name or kind_of(ctype)[4:]}: expected a vdbshade.{expected.__name__}, got {type(given).__name__}")
    return given.struct


def structs_of(kind: str, given: Sequence[Any], name: Optional[str] = None) -> Any:
    """An array of structs, ``vsh_light[]``, of objects or of dicts of members."""
    made = [Filled(kind, one) if isinstance(one, Mapping) else one for one in given]
    pointers = [struct_of(one, ffi.typeof(kind), name) for one in made]
    return keep(ffi.new(kind + "[]", [p[0] for p in pointers] or 1), (made, pointers))


class Filled(Struct):
    """A struct that begins with its defaults.

    Parameters
    ----------
    kind : str
        "vsh_shade_options"
    values : mapping
        members by their names; None leaves the default
    """

    def __init__(self, kind: str, values: Optional[Mapping[str, Any]] = None, /, **more: Any) -> None:
        self.KIND = kind
        self.keeps: List[Any] = []
        if kind not in _defaults:
            _defaults[kind] = ffi.new(kind + " *")
            lib.vshi_struct_init(kind.encode(), _defaults[kind], ffi.sizeof(kind))
        self.struct = keep(ffi.new(kind + " *", _defaults[kind][0]), self.keeps)
        for given in (values, more):
            if given:
                self._fill(self.struct, kind, given)

    def fill(self, values: Mapping[str, Any]) -> None:
        """Sets members."""
        self._fill(self.struct, self.KIND, values)

    def _fill(self, struct: Any, kind: str, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            if value is not None:
                self._set(struct, kind, name, value)

    def _kept(self, cdata: Any) -> Any:
        self.keeps.append(cdata)
        return cdata

    def text(self, value: Any, name: str) -> Any:
        """A string or path that lives as long as the struct."""
        return self._kept(text_of(value, name))

    def _set(self, struct: Any, kind: str, name: str, value: Any) -> None:
        fields = _fields(kind)
        if name not in fields or name == "struct_size":
            raise TypeError(f"{kind[4:]}: no option {name!r}; there are {', '.join(f for f in fields if f not in ('struct_size', 'user'))}")
        field = fields[name]
        try:
            if field.kind in ("primitive", "enum"):
                setattr(struct, name, _number(field, value, name))
            elif field.kind == "struct":
                self._set_struct(getattr(struct, name), kind_of(field), value, name)
            elif field.kind == "array":
                setattr(struct, name, _items(field, value, name))
            elif field.kind == "pointer":
                setattr(struct, name, self._pointer(struct, kind, field, value, name))
            else:
                setattr(struct, name, value)  # a callback
        except OverflowError:
            raise ValueError(f"{name} {value!r}: too {'small' if value < 0 else 'large'} for {field.cname}") from None
        except TypeError as error:
            if str(error).startswith(name):
                raise
            raise TypeError(f"{name}: {error}") from None

    def _set_struct(self, struct: Any, kind: str, value: Any, name: str) -> None:
        """Sets a struct in a struct, of a mapping of its members or of a struct."""
        if isinstance(value, Mapping):
            self._fill(struct, kind, value)
        elif isinstance(value, Struct):
            ffi.addressof(struct)[0] = struct_of(value, ffi.typeof(kind), name)[0]
            self.keeps.append(value)
        else:
            raise TypeError(f"{name}: expected a dict of its members, got {type(value).__name__}")

    def _pointer(self, struct: Any, kind: str, field: Any, value: Any, name: str) -> Any:
        """Makes the pointer of a member: to a text, an array, a struct, a handle, or several. Sets the member behind it that counts them."""
        if isinstance(value, numpy.ndarray):
            return self._kept(pointer(value))
        if isinstance(value, ffi.CData):
            return self._kept(value)
        if is_text(field):
            return self.text(value, name)
        names = members(kind) + [""]
        count = names[names.index(name) + 1]
        if not count.endswith("_count"):
            return self._kept(struct_of(value, field.item, name))
        values = [value] if isinstance(value, (str, bytes, os.PathLike, Struct)) else list(value)
        setattr(struct, count, len(values))
        return self._kept(texts_of(values, name) if field.item.kind == "pointer" else structs_of(kind_of(field.item), values, name))


def _number(field: Any, value: Any, name: str) -> Any:
    if field.kind == "enum":
        return constant(kind_of(field), value, name)
    if name == "padding" and value == "auto":
        return lib.VSH_PADDING_AUTO
    if isinstance(value, str):
        raise TypeError(f"{name}: expected a number, got {value!r}")
    return float(value) if field.cname in ("double", "float") else _whole(value, name)


def _items(field: Any, value: Any, name: str) -> Any:
    """Converts a text or numbers for an array in a struct."""
    if field.item.cname == "char":
        encoded = value.encode()
        if len(encoded) >= field.length or b"\0" in encoded:
            raise ValueError(f"{name} {value!r}: expected at most {field.length - 1} bytes, without NUL")
        return encoded
    numbers = list(value)
    if len(numbers) != field.length:
        raise ValueError(f"{name}: expected {field.length} numbers, got {len(numbers)}")
    if field.item.kind == "enum":
        return [constant(kind_of(field.item), n, name) for n in numbers]
    return [float(n) if field.item.cname in ("double", "float") else int(n) for n in numbers]


def _whole(value: Any, name: str) -> int:
    if isinstance(value, numpy.bool_):
        return int(value)
    if isinstance(value, (float, numpy.floating)):
        if value != int(value):
            raise TypeError(f"{name} {value}: expected a whole number")
        return int(value)
    try:
        return int(value.__index__())
    except AttributeError:
        raise TypeError(f"{name}: expected a whole number, got {type(value).__name__}") from None


def split(options: Mapping[str, Any], *kinds: str) -> List[Dict[str, Any]]:
    """Sorts options by the structs that have them; TypeError for an unknown one."""
    known = [{n for n, f in _fields(kind).items() if n != "struct_size" and f.kind != "struct"} for kind in kinds]
    parts: List[Dict[str, Any]] = [{} for _ in kinds]
    for name, value in options.items():
        found = next((part for part, names in zip(parts, known) if name in names), None)
        if found is None:
            every = (n for kind, names in zip(kinds, known) for n in members(kind) if n in names)
            raise TypeError(f"no option {name!r}; there are {', '.join(every)}")
        found[name] = value
    return parts


def record_of(struct: Any) -> Any:
    """A filled struct as a record of vdbshade.types."""
    ctype = ffi.typeof(struct)
    kind = kind_of(ctype if ctype.kind == "struct" else ctype.item)
    record = getattr(types, "".join(part.capitalize() for part in kind[len("vsh_") :].split("_")))
    if not issubclass(record, types.Record):
        record = types.Record  # of options
    return record(**{name: member(struct, kind, name) for name in members(kind) if name not in ("struct_size", "user")})


def member(struct: Any, kind: str, name: str) -> Any:
    """A member of a struct as a word, a number, a text, a tuple, a record, or a pointer."""
    field, value = _fields(kind)[name], getattr(struct, name)
    if field.kind == "primitive":
        return value
    if field.kind == "enum":
        return word(kind_of(field), value)
    if field.kind == "array":
        if field.item.cname == "char":
            return text(value)
        return tuple(word(kind_of(field.item), v) for v in value) if field.item.kind == "enum" else tuple(value)
    if field.kind == "struct":
        return record_of(value)
    if is_text(field):
        return text(value)
    return None if value == ffi.NULL else value


def pairs_of(found: Any, count: int) -> Dict[str, str]:
    """Attributes of C, ``vsh_attribute[]``, as a dict."""
    return {text(found[i].name) or "": text(found[i].value) or "" for i in range(count)}


# --- calls


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
        fraction 0 … 1; a true result cancels the call, and the call raises what it raises
    interval : float
        least seconds between two calls of `progress`
    warning : callable, optional
        called as ``warning(message)``, by whatever thread; None: ``warnings.warn(message, VdbshadeWarning)``
    notes : bool
        also send notes as warnings that begin with "note: ": they need no action
    isa : str
        instruction set of the marching kernels: "best", "base", "avx2", "avx512"
    reader : bool or str
        True: files are parsed in the library's confined reader (docs/security.md); a path: by that program;
        False: in this process, where a damaged file can crash it
    reader_seconds : float
        seconds that the reader may take for one file; 0: 60, and one more for each MB
    confined : bool
        read nothing if the system refuses one of the reader's confinements
    allow_outside : bool
        a model may name files outside its folder
    memory_held : int
        bytes of memory_limit that the caller holds, without the call's arguments
    """

    def __init__(self, *, threads: int = 0, memory_limit: int = 0,
                 progress: Optional[Callable[[str, float], Any]] = None, interval: float = 0.02,
                 warning: Optional[Callable[[str], Any]] = None, isa: types.Isa = "best",
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
    """A call that is in C: the exception of its callbacks, and its warnings."""

    __slots__ = ("run", "raised", "messages", "outer", "open", "__weakref__")

    def __init__(self, run: Run, outer: "Optional[Running]") -> None:
        self.run, self.outer = run, outer
        self.raised: Optional[BaseException] = None
        self.messages: List[str] = []
        self.open: Optional[str] = None  # the stage whose end was not reported: another thread reached it

    def report(self, stage: str, fraction: float) -> bool:
        """Reports progress; True: stop."""
        progress, before = self.run.progress, self.open
        if progress is None:
            return False
        self.open = stage if fraction < 1.0 else None
        stops = before is not None and before != stage and bool(progress(before, 1.0))
        return bool(progress(stage, fraction)) or stops

    def finish(self) -> None:
        """Reports the end of the last stage."""
        if self.open is not None:
            self.report(self.open, 1.0)


_in_thread = threading.local()


def note(kind: Any, value: Any, traceback: Any) -> None:
    """Keeps a callback's exception in its local variable ``running``; the call raises it when it returns."""
    running = traceback.tb_frame.f_locals.get("running") if traceback is not None else None
    running = running or getattr(_in_thread, "running", None)
    if running is not None and running.raised is None:
        running.raised = value if isinstance(value, BaseException) else kind(value)


# Called by the thread that made the call alone (vshi_progress_filter.thread), which is where Python hands out signals: a
# Ctrl-C is raised in here, and cancels.
@ffi.callback("vsh_progress_fn *", error=1, onerror=note)
def _progress(user: Any, stage: Any, fraction: float) -> int:
    running = ffi.from_handle(user)
    if running.raised is not None:
        return 1
    return 1 if running.report(ffi.string(stage).decode(), fraction) else 0


@ffi.callback("vsh_warning_fn *", onerror=note)
def _warning(user: Any, message: Any) -> None:
    running = ffi.from_handle(ffi.cast("vshi_progress_filter *", user).user)
    text = ffi.string(message).decode("utf-8", "replace")
    if running.run.warning is not None:
        running.run.warning(text)
    else:
        running.messages.append(text)


_SELDOM = ffi.addressof(lib, "vshi_progress_seldom")
_FILTER_SIZE = ffi.sizeof("vshi_progress_filter")
OUT: Any = object()  # an argument that the library fills: its value is returned


class Several:
    """Several values that the library fills: a tuple, or a list of records."""

    def __init__(self, count: int) -> None:
        self.count = count


_FREE = {"vsh_image_file": "vsh_image_free", "vsh_light": "vsh_lights_free"}
_RUN, _ERROR = ffi.typeof("vsh_run *"), ffi.typeof("vsh_error *")  # arguments that callers do not name
_types: Dict[Any, List[Any]] = {}


def _types_of(function: Any) -> List[Any]:
    """For each argument of a function its type, and the struct that it points to, if any."""
    if function not in _types:
        _types[function] = [(kind, kind.item if kind.kind == "pointer" and kind.item.kind == "struct" else None)
                            for kind in ffi.typeof(function).args]
    return _types[function]


def _arguments(function: Any, given: Tuple[Any, ...], run: Any, error: Any) -> Tuple[List[Any], List[Any]]:
    """Arguments for C, with the run and the error if the function has them; and the arguments that it fills."""
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
        return [record_of(place[i]) for i in range(count)] if item.kind == "struct" else tuple(place)[:count]
    if item.kind == "struct":
        return record_of(place[0])
    if item.kind != "pointer" or item.item.kind != "struct":
        return place[0]
    kind = kind_of(item.item)
    free = getattr(lib, _FREE.get(kind, kind + "_free"))
    if place[0] == ffi.NULL:
        return None
    return ffi.gc(place[0], free if keeps is None else lambda cdata, keeps=keeps: free(cdata))


def _values(filled: List[Any], keeps: Any) -> Any:
    values = [_value(place, count, keeps) for place, count in filled]
    return values[0] if len(values) == 1 else tuple(values) if values else None


def ask(function: Any, *given: Any) -> Any:
    """Calls a function that cannot fail. Returns its result, or the arguments that it fills (OUT)."""
    arguments, filled = _arguments(function, given, None, None)
    result = function(*arguments)
    if filled:
        return _values(filled, None)
    kind = ffi.typeof(function).result
    return record_of(result) if kind.kind == "struct" else text(result) if is_text(kind) else result


def call(function: Any, *given: Any, run: Optional[Run] = None, keeps: Any = None, watched: Any = None) -> Any:
    """Calls a function that returns a vsh_result, with run and error. Returns the arguments that it fills (OUT), several in a tuple.

    Parameters
    ----------
    keeps
        an object to which the new handle refers, and which it keeps alive
    watched
        an object whose ``raised`` other callbacks set
    """
    running = Running(run_of(run), getattr(_in_thread, "running", None))
    handle, error = ffi.new_handle(running), ffi.new("vsh_error *")
    filtered = ffi.new("vshi_progress_filter *")
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


Kind = TypeVar("Kind", bound="Handle")


class Handle(Struct):
    """An object of the library. It is freed when nothing refers to it any more, or at the end of a ``with``."""

    _cdata: Any
    _keeps: Any  # lives as long

    def __init__(self, cdata: Any, keeps: Any = None) -> None:
        self._cdata, self._keeps = cdata, keeps

    @classmethod
    def _of(cls: Type[Kind], cdata: Any, keeps: Any = None) -> Kind:
        """An object for a handle."""
        self = cls.__new__(cls)
        Handle.__init__(self, cdata, keeps)
        return self

    @classmethod
    def _borrow(cls: Type[Kind], cdata: Any, owner: Any) -> Optional[Kind]:
        """An object for a handle that belongs to `owner`, which it keeps alive; None for NULL."""
        if cdata == ffi.NULL:
            return None
        return cls._of(ffi.gc(ffi.cast(ffi.typeof(cdata), cdata), lambda _, keeps=owner: None), owner)

    @property
    def handle(self) -> Any:
        """The C handle; ValueError if it was closed."""
        if self._cdata is None:
            raise ValueError(f"{type(self).__name__} is closed")
        return self._cdata

    struct = handle

    @property
    def info(self) -> Any:
        """Its properties, a record of vdbshade.types."""
        return ask(getattr(lib, self.KIND + "_get_info"), self, OUT)

    def close(self) -> None:
        """Frees it early, after calls under way. Closing twice does nothing."""
        self._cdata = None

    @property
    def closed(self) -> bool:
        return self._cdata is None

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError(f"{type(self).__name__} can be neither pickled nor copied: it lives in this process; make it in each")

    def __enter__(self: Kind) -> Kind:
        self.handle
        return self

    def __exit__(self, *raised: Any) -> None:
        self.close()


def index_of(index: int, count: int, kind: str, verb: str = "there are") -> int:
    """Resolves an index that may count from the end; IndexError beyond it."""
    if not -count <= index < count:
        raise IndexError(f"{kind} {index}: {verb} {count}")
    return index % count
