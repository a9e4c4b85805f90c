"""Writes what `import vdbshade` has of the public headers: generate.py INCLUDE_FOLDER OUTPUT_FOLDER

_abi.py: the declarations as cffi keeps them, so that nothing is parsed when the module is imported;
_tables.py: words for constants; types.py: what options there are and what is told of things, with the headers'
comments."""
import contextlib
import keyword
import pathlib
import re
import sys
import textwrap

import cffi
import headers

# Members that are a library's own business, or that arguments of another name stand for.
HIDDEN = {"struct_size", "user", "checked", "sink", "done", "writing", "look"}
# Members that arguments of their own stand for.
ARGUMENTS = {"vsh_light": {"type"}, "vsh_sdf_node": {"shape", "left", "right"}, "vsh_compare_files_options": {"limits"},
             "vsh_unwrap_options": {"density"}, "vsh_image_options": {"attributes", "attribute_count"},
             "vsh_layer": {"field", "heights", "spheres", "triangles", "lights", "light_count"}}
NUMBERS = {"int32_t": "int", "uint32_t": "int", "uint64_t": "int", "size_t": "int", "double": "float", "float": "float"}

# What a member is where its comment does not begin with the constants' name.
MORE_WORDS = {("vsh_lightmap_options", "padding"): "VSH_PADDING_", ("vsh_receiver", "padding"): "VSH_PADDING_",
              ("vsh_planes", "sky"): "VSH_UP_", ("vsh_run", "isa"): "VSH_ISA_", ("vsh_receiver", "seams"): "VSH_SEAMS_",
              ("vsh_receiver", "type"): "VSH_RECEIVER_", ("vsh_receiver", "unwrap"): "VSH_RECEIVER_UNWRAP_",
              ("vsh_lit_image", "purpose"): "VSH_LIT_", ("vsh_unwrap_options", "keep_uvs"): "VSH_UNWRAP_"}
# Words of functions' arguments, and constants that are none.
OTHER_WORDS = ["VSH_ERROR_", "VSH_MEASURE_", "VSH_CONFINED_", "VSH_HEIGHTS_", "VSH_CHANNEL_", "VSH_METHOD_", "VSH_BENT_"]
COUNTS = {"VSH_MEASURE_COUNT", "VSH_LIT_PURPOSES", "VSH_CONFINED_ALL", "VSH_OK"}
# Structs without a size that are filled by keywords.
FILLED = {"vsh_light", "vsh_tint", "vsh_sdf_node", "vsh_mesh", "vsh_receiver", "vsh_caster", "vsh_scene_layer", "vsh_planes",
          "vsh_selection"}


def words_of(text):
    """{(struct, member): prefix} of members that are given as words."""
    found = {**headers.words_of_members(text), **MORE_WORDS}
    del found["vsh_flat_caster", "type"]  # of a file alone; an enum of the same prefix is the methods
    return found


def camel(struct):
    return "".join(word.capitalize() for word in struct[len("vsh_") :].split("_"))


def hint(member, words, known):
    """The type of a member as Python has it."""
    if words:
        return "Union[str, int]"
    if member.type in ("const char *", "char"):
        return "str"
    if member.lengths:
        return "Sequence[float]" if member.type in ("double", "float") else "Sequence[int]"
    if member.type in known:
        return camel(member.type)
    return NUMBERS.get(member.type, "Any")


RECORD = '''"""Made from the public headers when vdbshade is built: what options there are, and what is told of things."""
from __future__ import annotations

import typing
from typing import Any, Sequence, Union


class Record:
    """Values that a call tells; the same names as in C."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __repr__(self) -> str:
        told = ", ".join(f"{name}={value!r}" for name, value in self.__dict__.items() if name[0] != "_")
        return f"{type(self).__name__}({told})"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and repr(self) == repr(other)

    __hash__ = None  # type: ignore[assignment]
'''


def is_options(name, members):
    """Whether a struct is filled by the caller, member by member: it is a dict of keywords then."""
    return (members[0].name == "struct_size" and not name.endswith("_stats")) or name in FILLED


def write_types(path, text):
    found, words = headers.structs(text), words_of(text)
    texts = [RECORD]
    for struct, members in found.items():
        base = "typing.TypedDict, total=False" if is_options(struct, members) else "Record"
        shown = [m for m in members if m.name not in HIDDEN | ARGUMENTS.get(struct, set())]
        hints = [hint(m, words.get((struct, m.name)), found) for m in shown]
        texts += ["", f"class {camel(struct)}({base}):", f'    """``{struct}`` of the headers.', "", "    Attributes", "    ----------"]
        for member, kind in zip(shown, hints):
            texts.append(f"    {member.name} : {kind}")
            comment = member.comment.replace("\\", "\\\\").replace('"""', "'''")
            texts += textwrap.wrap(comment, 108, initial_indent=" " * 8, subsequent_indent=" " * 8)
        texts += ['    """', ""]
        texts += [f"    {m.name}{'_' * keyword.iskeyword(m.name)}: {kind}" for m, kind in zip(shown, hints)] or ["    pass"]
        texts.append("")
    path.write_text("\n".join(texts), encoding="utf-8")


def table(prefix, text):
    """The words of an enum all of whose constants begin so."""
    for block in headers.enumerations(text):
        if all(name.startswith(prefix) or name == "VSH_OK" for name in block):
            return {name[len(prefix) :].lower(): number for name, number in block.items() if name not in COUNTS}
    raise SystemExit(f"generate.py: no enum of constants {prefix}…")


def write_tables(path, text):
    members = {f"{struct}.{member}": prefix for (struct, member), prefix in sorted(words_of(text).items())}
    words = {prefix: table(prefix, text) for prefix in sorted({*members.values(), *OTHER_WORDS})}
    version = ".".join(re.findall(r"#define VSH_VERSION_(?:MAJOR|MINOR) (\d+)", text))
    lines = ['"""Made from the public headers when vdbshade is built: words for constants."""', f"WORDS = {words!r}",
             f"MEMBERS = {members!r}", f"VERSION = {version!r}"]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(include, output):
    text = headers.read(pathlib.Path(include) / "vdbshade")
    output = pathlib.Path(output)
    output.mkdir(parents=True, exist_ok=True)
    ffi = cffi.FFI()
    ffi.cdef(headers.declarations(text))
    ffi.set_source("vdbshade._abi", None)
    with contextlib.redirect_stdout(None):
        ffi.emit_python_code(str(output / "_abi.py"))
    (output / "_abi.py").touch()  # which it leaves alone where nothing has changed
    write_tables(output / "_tables.py", text)
    write_types(output / "types.py", text)


if __name__ == "__main__":
    main(*sys.argv[1:])
