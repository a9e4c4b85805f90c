"""Generates modules for `import vdbshade` from the public headers: generate.py INCLUDE_FOLDER BINDINGS_H OUTPUT_FOLDER

_abi.py: declarations, also those of bindings.h, compiled by cffi, so that importing parses nothing; _version.py; types.py: options and
records, with the headers' comments."""
import contextlib
import keyword
import os
import pathlib
import re
import sys
import textwrap

import cffi

# Members for the library's own use, or replaced by arguments of other names.
HIDDEN = {"struct_size", "user", "checked", "done", "look", "row_texels"}
# Members replaced by arguments of their own.
ARGUMENTS = {"vsh_light": {"type"}, "vsh_sdf_node": {"shape", "left", "right"}, "vsh_compare_files_options": {"limits"},
             "vsh_unwrap_options": {"density"}, "vsh_image_options": {"attributes", "attribute_count"}, "vsh_occluders_options": {"grid"},
             "vsh_lightmap_options": {"shade"}, "vsh_volume_options": {"shade"},
             "vsh_render_options": {"shade", "camera", "lit", "lit_count", "tint"},
             "vsh_bake_options": {"rows", "files", "file_count", "words", "word_count"},
             "vsh_scene_occluders_options": {"receivers_min", "receivers_max", "grid"},
             "vsh_mesh": {"indices16", "position_stride", "normal_stride", "uv_stride"}}
NUMBERS = {"int32_t": "int", "uint32_t": "int", "uint64_t": "int", "size_t": "int", "double": "float", "float": "float"}

# Structs without a size that are filled by keywords.
FILLED = {"vsh_light", "vsh_tint", "vsh_sdf_node", "vsh_mesh", "vsh_receiver", "vsh_caster", "vsh_scene_layer", "vsh_planes",
          "vsh_selection"}
# Keywords of calls that fill two structs.
KEYWORDS = {"OccludersKeywords": ("OccludersOptions", "GridOptions"), "ChartsKeywords": ("LightmapOptions", "ShadeOptions"),
            "VolumeKeywords": ("VolumeOptions", "ShadeOptions"), "RenderKeywords": ("RenderOptions", "ShadeOptions")}

# --- the headers

COMMENT = re.compile(r"/\*.*?\*/", re.S)
OF_CPP = re.compile(r"^#if defined\(__cplusplus\) && .*?^#endif\n", re.S | re.M)


class Member:
    """A member of a struct: its name, its C type without the name, lengths of arrays, and its comment."""

    def __init__(self, name, type, lengths, comment):
        self.name, self.type, self.lengths, self.comment = name, type, lengths, comment


def read_headers(folder):
    """All headers that vdbshade.h includes, in the order in which they may be compiled, as one text without the parts for C++."""
    texts, done = [], set()

    def add(name):
        if name in done:
            return
        done.add(name)
        text = OF_CPP.sub("", (folder / name).read_text(encoding="utf-8"))
        for other in re.findall(r'^#include "(\w+\.h)"', text, re.M):
            add(other)
        texts.append(text)

    add("vdbshade.h")
    return "\n".join(texts)


def _inline_removed(text):
    """Removes functions that are defined in the headers: a loaded library does not have them."""
    result, at = [], 0
    for start in re.finditer(r"^static inline ", text, re.M):
        if start.start() < at:
            continue
        result.append(text[at : start.start()])
        at = text.index("\n}\n", start.start()) + 3
    return "".join(result) + text[at:]


def declarations(text):
    """Declarations for cffi: no comments, no directives, no inline functions."""
    text = COMMENT.sub(" ", text)
    text = re.sub(r"^#.*(?:\\\n.*)*$", "", text, flags=re.M)
    text = re.sub(r"^VSH_(BEGIN|END)_C$", "", text, flags=re.M)
    text = _inline_removed(text).replace("VSH_API ", "").replace("VSHI_SHARED ", "")
    return re.sub(r"\n\s*\n+", "\n", text).strip() + "\n"


def functions(text):
    """Names of the functions that the library exports, in the order of the headers."""
    return list(dict.fromkeys(re.findall(r"VSH_API[^;{]*?\b(vsh_\w+)\(", COMMENT.sub(" ", text))))


def enums(text):
    """{name: [word, …]} of every enum: its constants as Python gives them, see words() of _core.py."""
    found = {}
    for name, body in re.findall(r"^typedef enum (\w+) \{(.*?)\} \1;", COMMENT.sub(" ", text), re.S | re.M):
        constants = re.findall(r"^ *(VSH_\w+)", body.replace(",", "\n"), re.M)
        begin = os.path.commonprefix(constants).rfind("_") + 1
        found[name] = [constant[begin:].lower() for constant in constants]
    found["vsh_up"] += [word.replace("minus_", "-") for word in found["vsh_up"] if word.startswith("minus_")]
    return found


def _words(comment):
    """A comment as one line."""
    return " ".join(re.sub(r"^\s*\* ?", " ", line) for line in comment.strip("/*").split("\n")).split()


def structs(text):
    """{name: [Member, …]} of every struct with declared members."""
    found = {}
    for match in re.finditer(r"^typedef struct (\w+) \{\n(.*?)^\} \1;", text, re.S | re.M):
        members = []
        body = re.sub(r"\(\*(\w+)\)\(.*?\);", r"\1_callback \1;", match[2], flags=re.S)
        above = ""
        for part in re.finditer(r"(?P<declared>[a-z_][^;/]*);|(?P<comment>/\*.*?\*/)", body, re.S):
            if part["comment"]:
                comment = " ".join(_words(part["comment"]))
                if not body[: part.start()].rpartition("\n")[2].strip():
                    above = comment
                elif members and not members[-1].comment:
                    members[-1].comment = comment
                continue
            kind = ""
            for name in part["declared"].split(","):
                first = re.match(r"(.*?)(\w+)((?:\[\w+\])*)$", name.strip(), re.S)
                kind = " ".join(first[1].split()) or kind
                members.append(Member(first[2], kind, re.findall(r"\w+", first[3]), above))
            above = ""
        found[match[1]] = members
    return found


# --- the modules


def camel(struct):
    return "".join(word.capitalize() for word in struct[len("vsh_") :].split("_"))


def hint(member, known, kinds, text):
    """The Python type of a member; `text` is that of a string."""
    kind = member.type.replace("const ", "").rstrip(" *")
    if kind in kinds:
        return f"Sequence[{camel(kind)}]" if member.lengths or "*" in member.type else camel(kind)
    if member.name == "padding":
        return 'Union[Literal["auto"], int]'
    if member.type in ("const char *", "char"):
        return text if member.type != "char" else "str"
    if member.lengths:
        return "Sequence[float]" if member.type in ("double", "float") else "Sequence[int]"
    if member.type in known:
        return camel(member.type)
    return NUMBERS.get(member.type, "Any")


RECORD = '''"""Options, records and words. Made from the public headers when vdbshade is built."""
from __future__ import annotations

import os
import typing
from typing import Any, Literal, Sequence, Union

Path = Union[str, "os.PathLike[str]"]

class Record:
    """Values from a call, by the same names as in C."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in self.__dict__.items() if name[0] != "_")
        return f"{type(self).__name__}({values})"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and repr(self) == repr(other)

    __hash__ = None  # type: ignore[assignment]
'''


def is_options(name, members):
    """Whether the caller fills a struct member by member: it is a dict of keywords then."""
    return (members[0].name == "struct_size" and not name.endswith("_stats")) or name in FILLED


def write_types(path, text):
    found, kinds = structs(text), enums(text)
    texts = [RECORD]
    texts += [f"{camel(name)} = Literal{words}".replace("'", '"') for name, words in kinds.items()] + [""]
    for struct, members in found.items():
        base, string = ("typing.TypedDict, total=False", "Path") if is_options(struct, members) else ("Record", "str")
        shown = [m for m in members if m.name not in HIDDEN | ARGUMENTS.get(struct, set())]
        hints = [hint(m, found, kinds, string) for m in shown]
        texts += ["", f"class {camel(struct)}({base}):", f'    """``{struct}`` of the C headers.', "", "    Attributes", "    ----------"]
        for member, kind in zip(shown, hints):
            texts.append(f"    {member.name} : {kind}")
            comment = member.comment.replace("\\", "\\\\").replace('"""', "'''")
            texts += textwrap.wrap(comment, 108, initial_indent=" " * 8, subsequent_indent=" " * 8)
        texts += ['    """', ""]
        texts += [f"    {m.name}{'_' * keyword.iskeyword(m.name)}: {kind}" for m, kind in zip(shown, hints)] or ["    pass"]
        texts.append("")
    for name, (first, second) in KEYWORDS.items():
        texts += ["", f"class {name}({first}, {second}, total=False):", f'    """:class:`{first}` and :class:`{second}`."""', ""]
    path.write_text("\n".join(texts), encoding="utf-8")


def write_version(path, text):
    version = ".".join(re.findall(r"#define VSH_VERSION_(?:MAJOR|MINOR) (\d+)", text))
    path.write_text(f'"""Made from the public headers when vdbshade is built."""\nVERSION = {version!r}\n', encoding="utf-8")


def main(include, bindings, output):
    text = read_headers(pathlib.Path(include) / "vdbshade")
    output = pathlib.Path(output)
    output.mkdir(parents=True, exist_ok=True)
    ffi = cffi.FFI()
    ffi.cdef(declarations(text + pathlib.Path(bindings).read_text(encoding="utf-8")))
    ffi.set_source("vdbshade._abi", None)
    with contextlib.redirect_stdout(None):
        ffi.emit_python_code(str(output / "_abi.py"))
    (output / "_abi.py").touch()  # which it leaves alone where nothing has changed
    write_version(output / "_version.py", text)
    write_types(output / "types.py", text)


if __name__ == "__main__":
    main(*sys.argv[1:])
