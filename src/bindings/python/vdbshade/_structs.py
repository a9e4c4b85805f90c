"""Structs of C from keywords and back: members by their names, constants by words, lengths checked."""
from __future__ import annotations

import os
import weakref
from typing import Any, Dict, Mapping, Optional

import numpy

from . import types
from ._library import ffi, lib
from ._tables import MEMBERS, WORDS

_NUMBER = "primitive"


def constant(prefix: str, given: Any, name: str) -> int:
    """The number of a word: ``constant("VSH_SHADOW_", "cone", "method")``."""
    if isinstance(given, str):
        word = given.lower().replace("-", "_")
        if prefix == "VSH_UP_" and word.startswith("_"):
            word = "minus" + word
        table = WORDS[prefix]
        if word not in table:
            raise ValueError(f"{name} {given!r}: expected one of {', '.join(table)}")
        return table[word]
    if isinstance(given, (int, numpy.integer)) and not isinstance(given, bool):
        return int(given)
    raise TypeError(f"{name}: expected one of {', '.join(WORDS[prefix])}, got {type(given).__name__}")


def word(prefix: str, number: int) -> Any:
    """And back; a number for which there is no word stays."""
    return next((w for w, n in WORDS[prefix].items() if n == number), number)


def path_of(given: Any, name: str) -> bytes:
    """A path as the system takes it."""
    try:
        path = os.fsencode(given)
    except TypeError:
        raise TypeError(f"{name}: expected a path, got {type(given).__name__}") from None
    if b"\0" in path:
        raise ValueError(f"{name}: a path with a NUL byte")
    return path


# What a struct points to lives as long as the struct.
_KEPT: Any = weakref.WeakKeyDictionary()


def keep(struct: Any, keeps: list) -> None:
    """`keeps` live as long as a struct that ffi.new() made; they must not refer to it."""
    _KEPT[struct] = keeps


class Filled:
    """A struct of C, begun by its defaults, with what it points to.

    Parameters
    ----------
    kind : str
        "vsh_shade_options"
    values : mapping
        members by their names; None leaves one as it is
    """

    def __init__(self, kind: str, values: Optional[Mapping[str, Any]] = None) -> None:
        self.kind = kind
        self.keeps: list = []
        default = _DEFAULTS.get(kind)
        if default is None:
            default = ffi.new(kind + " *")
            lib.vsh_struct_init(kind.encode(), default, ffi.sizeof(kind))
            _DEFAULTS[kind] = default
        self.pointer = ffi.new(kind + " *", default[0])
        keep(self.pointer, self.keeps)
        for name, value in (values or {}).items():
            if value is not None:
                self.set(self.pointer, kind, name, value)

    def text(self, value: Any, name: str) -> Any:
        """A string or path that lives as long as this."""
        encoded = value.encode() if isinstance(value, str) else path_of(value, name)
        if b"\0" in encoded:
            raise ValueError(f"{name}: a text with a NUL character")
        self.keeps.append(ffi.new("char[]", encoded))
        return self.keeps[-1]

    def set(self, struct: Any, kind: str, name: str, value: Any) -> None:
        """Sets one member."""
        fields = _fields(kind)
        if name not in fields or name == "struct_size":
            known = ", ".join(f for f in fields if f not in ("struct_size", "user"))
            raise TypeError(f"{kind[4:]}: no option {name!r}; there are {known}")
        field = fields[name]
        prefix = MEMBERS.get(f"{kind}.{name}")
        try:
            if prefix is not None and field.kind == _NUMBER:
                setattr(struct, name, constant(prefix, value, name))
            elif field.kind == _NUMBER:
                if isinstance(value, str):
                    raise TypeError(f"{name}: expected a number, got {value!r}")
                setattr(struct, name, float(value) if field.cname in ("double", "float") else _whole(value, name))
            elif field.kind == "struct":
                self.set_struct(getattr(struct, name), field.cname.replace("struct ", ""), value, name)
            elif field.kind == "array" and field.item.cname == "char":
                encoded = value.encode()
                if len(encoded) >= field.length or b"\0" in encoded:
                    raise ValueError(f"{name} {value!r}: expected at most {field.length - 1} bytes, without NUL")
                setattr(struct, name, encoded)
            elif field.kind == "array":
                numbers = list(value)
                if len(numbers) != field.length:
                    raise ValueError(f"{name}: expected {field.length} numbers, got {len(numbers)}")
                setattr(struct, name, [float(n) if field.item.cname in ("double", "float") else int(n) for n in numbers])
            elif field.cname == "char *" or field.cname == "char const *":
                setattr(struct, name, self.text(value, name))
            else:
                setattr(struct, name, value)  # a pointer of the binding's own
        except OverflowError:
            raise ValueError(f"{name} {value!r}: too large for {field.cname}") from None
        except TypeError as error:
            if str(error).startswith(name):
                raise
            raise TypeError(f"{name}: {error}") from None

    def set_struct(self, struct: Any, kind: str, value: Any, name: str) -> None:
        """Sets a struct in a struct from a mapping of its members, or from a struct."""
        if isinstance(value, Filled):
            struct_to = ffi.addressof(struct)
            struct_to[0] = value.pointer[0]
            self.keeps.append(value)
        elif isinstance(value, Mapping):
            for member, given in value.items():
                if given is not None:
                    self.set(struct, kind, member, given)
        else:
            raise TypeError(f"{name}: expected a dict of its members, got {type(value).__name__}")


_known: Dict[str, Dict[str, Any]] = {}
_DEFAULTS: Dict[str, Any] = {}


def _fields(kind: str) -> Dict[str, Any]:
    if kind not in _known:
        _known[kind] = {name: field.type for name, field in ffi.typeof(kind).fields}
    return _known[kind]


def members(kind: str) -> list:
    """Names of a struct's members."""
    return list(_fields(kind))


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


def split(options: Dict[str, Any], *kinds: str) -> list:
    """Options by the structs that have them, the first one first; TypeError for one that none has."""
    parts: list = [{} for _ in kinds]
    for name, value in options.items():
        for part, kind in zip(parts, kinds):
            if name in _fields(kind) and name != "struct_size" and _fields(kind)[name].kind != "struct":
                part[name] = value
                break
        else:
            known = ", ".join(n for kind in kinds for n, f in _fields(kind).items() if n != "struct_size" and f.kind != "struct")
            raise TypeError(f"no option {name!r}; there are {known}")
    return parts


def told(struct: Any, kind: str) -> Any:
    """A struct that the library filled, as a record of vdbshade.types."""
    name = "".join(part.capitalize() for part in kind[len("vsh_") :].split("_"))
    record = getattr(types, name)
    if not issubclass(record, types.Record):
        record = types.Record  # of options
    values = {member: _value(getattr(struct, member), field, MEMBERS.get(f"{kind}.{member}"))
              for member, field in _fields(kind).items() if member not in ("struct_size", "user")}
    return record(**values)


def _value(value: Any, field: Any, prefix: Optional[str]) -> Any:
    if field.kind == _NUMBER:
        return word(prefix, value) if prefix else value
    if field.kind == "array":
        if field.item.cname == "char":
            return ffi.string(value).decode("utf-8", "replace")
        return tuple(word(prefix, v) for v in value) if prefix else tuple(value)
    if field.kind == "struct":
        return told(value, field.cname.replace("struct ", ""))
    if field.kind == "pointer" and field.item.cname in ("char", "char const"):
        return None if value == ffi.NULL else ffi.string(value).decode("utf-8", "replace")
    return None if value == ffi.NULL else value


def info(function: Any, kind: str, *arguments: Any) -> Any:
    """The struct that a …_get_…() function returns or fills: ``info(lib.vsh_grid_get_info, "vsh_grid_info", grid)``."""
    if ffi.typeof(function).result.kind == "struct":
        return told(function(*arguments), kind)
    struct = ffi.new(kind + " *")
    function(*arguments, struct)
    return told(struct[0], kind)
