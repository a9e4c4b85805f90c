"""Structs of C from keywords and back: members by their names, constants by words, lengths checked."""
from __future__ import annotations

import os
import weakref
from typing import Any, Dict, List, Mapping, Optional, Sequence

import numpy

from . import types
from ._arrays import pointer
from ._library import ffi, lib, text
from ._tables import MEMBERS, WORDS


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
    """The word of a number, or the number if it has no word."""
    return next((w for w, n in WORDS[prefix].items() if n == number), number)


def words_of_bits(prefix: str, bits: int) -> List[str]:
    """The words of the constants whose bits are set."""
    return [name for name, bit in WORDS[prefix].items() if bits & bit]


def path_of(given: Any, name: str) -> bytes:
    """A path as the system takes it."""
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


# What a struct points to lives as long as the struct.
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


def members(kind: str) -> list:
    """Names of a struct's members."""
    return list(_fields(kind))


def is_text(ctype: Any) -> bool:
    """Whether a type is a pointer to characters."""
    return ctype.kind == "pointer" and ctype.item.cname in ("char", "char const")


def kind_of(ctype: Any) -> str:
    """The name of a struct: "vsh_grid"."""
    return ctype.cname[len("struct ") :]


class Struct:
    """An object that C takes as a pointer to a struct.

    Attributes
    ----------
    struct : cdata
        the pointer; what the struct points to lives as long
    """

    KIND = ""
    OPTIONAL = True  # whether C takes NULL for None
    struct: Any

    def __init_subclass__(cls, kind: str = "") -> None:
        if kind:
            cls.KIND, cls.OPTIONAL = kind, False
            _classes[ffi.typeof(kind)] = cls

    def __getattr__(self, name: str) -> Any:
        if name[:1] == "_" or name in ("struct", "struct_size") or name not in _fields(self.KIND):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return member(self.struct, self.KIND, name)


def struct_of(given: Any, ctype: Any, name: Optional[str] = None) -> Any:
    """The C pointer of a struct or of a handle; TypeError if the object is not of the class that stands for it."""
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
        members by their names; None leaves one as it is
    """

    def __init__(self, kind: str, values: Optional[Mapping[str, Any]] = None, /, **more: Any) -> None:
        self.KIND = kind
        self.keeps: list = []
        if kind not in _defaults:
            _defaults[kind] = ffi.new(kind + " *")
            lib.vsh_struct_init(kind.encode(), _defaults[kind], ffi.sizeof(kind))
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
            if field.kind == "primitive":
                setattr(struct, name, _number(field, MEMBERS.get(f"{kind}.{name}"), value, name))
            elif field.kind == "struct":
                self._set_struct(getattr(struct, name), kind_of(field), value, name)
            elif field.kind == "array":
                setattr(struct, name, _items(field, MEMBERS.get(f"{kind}.{name}"), value, name))
            elif field.kind == "pointer":
                setattr(struct, name, self._pointer(struct, kind, field, value, name))
            else:
                setattr(struct, name, value)  # a callback
        except OverflowError:
            raise ValueError(f"{name} {value!r}: too large for {field.cname}") from None
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


def _number(field: Any, prefix: Optional[str], value: Any, name: str) -> Any:
    if prefix is not None:
        return constant(prefix, value, name)
    if isinstance(value, str):
        raise TypeError(f"{name}: expected a number, got {value!r}")
    return float(value) if field.cname in ("double", "float") else _whole(value, name)


def _items(field: Any, prefix: Optional[str], value: Any, name: str) -> Any:
    """Converts a text or numbers for an array in a struct."""
    if field.item.cname == "char":
        encoded = value.encode()
        if len(encoded) >= field.length or b"\0" in encoded:
            raise ValueError(f"{name} {value!r}: expected at most {field.length - 1} bytes, without NUL")
        return encoded
    numbers = list(value)
    if len(numbers) != field.length:
        raise ValueError(f"{name}: expected {field.length} numbers, got {len(numbers)}")
    if prefix is not None:
        return [constant(prefix, n, name) for n in numbers]
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


def split(options: Dict[str, Any], *kinds: str) -> list:
    """Options by the structs that have them, the first one first; TypeError for one that none has."""
    known = [{n for n, f in _fields(kind).items() if n != "struct_size" and f.kind != "struct"} for kind in kinds]
    parts: list = [{} for _ in kinds]
    for name, value in options.items():
        found = next((part for part, names in zip(parts, known) if name in names), None)
        if found is None:
            every = (n for kind, names in zip(kinds, known) for n in members(kind) if n in names)
            raise TypeError(f"no option {name!r}; there are {', '.join(every)}")
        found[name] = value
    return parts


def told(struct: Any) -> Any:
    """A struct that the library filled, as a record of vdbshade.types."""
    ctype = ffi.typeof(struct)
    kind = kind_of(ctype if ctype.kind == "struct" else ctype.item)
    record = getattr(types, "".join(part.capitalize() for part in kind[len("vsh_") :].split("_")))
    if not issubclass(record, types.Record):
        record = types.Record  # of options
    return record(**{name: member(struct, kind, name) for name in members(kind) if name not in ("struct_size", "user")})


def member(struct: Any, kind: str, name: str) -> Any:
    """A member of a struct as Python has it: a word, a number, a text, a tuple, a record, or the pointer."""
    field, prefix, value = _fields(kind)[name], MEMBERS.get(f"{kind}.{name}"), getattr(struct, name)
    if field.kind == "primitive":
        return word(prefix, value) if prefix else value
    if field.kind == "array":
        if field.item.cname == "char":
            return text(value)
        return tuple(word(prefix, v) for v in value) if prefix else tuple(value)
    if field.kind == "struct":
        return told(value)
    if is_text(field):
        return text(value)
    return None if value == ffi.NULL else value


def pairs_of(found: Any, count: int) -> Dict[str, str]:
    """Attributes of C, ``vsh_attribute[]``, as a dict."""
    return {text(found[i].name) or "": text(found[i].value) or "" for i in range(count)}
