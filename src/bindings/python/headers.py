"""What the public headers declare: functions, structs with their members' comments, enumerations."""
import re

COMMENT = re.compile(r"/\*.*?\*/", re.S)


class Member:
    """A member of a struct: its name, its C type without the name, lengths of arrays, and its comment."""

    def __init__(self, name, type, lengths, comment):
        self.name, self.type, self.lengths, self.comment = name, type, lengths, comment


def read(folder):
    """All headers that vdbshade.h includes, in the order in which they may be compiled, as one text."""
    texts, done = [], set()

    def add(name):
        if name in done:
            return
        done.add(name)
        text = (folder / name).read_text(encoding="utf-8")
        for other in re.findall(r'^#include "(\w+\.h)"', text, re.M):
            add(other)
        texts.append(text)

    add("vdbshade.h")
    return "\n".join(texts)


def _inline_removed(text):
    """`text` without functions that are defined in it: a library that is loaded does not have them."""
    result, at = [], 0
    for start in re.finditer(r"^static inline ", text, re.M):
        if start.start() < at:
            continue
        result.append(text[at : start.start()])
        at = text.index("\n}\n", start.start()) + 3
    return "".join(result) + text[at:]


def declarations(text):
    """What cffi takes: no comments, no directives, no inline functions."""
    text = COMMENT.sub(" ", text)
    text = re.sub(r"^#.*(?:\\\n.*)*$", "", text, flags=re.M)
    text = re.sub(r'extern "C" \{', "", text)
    text = _inline_removed(text).replace("VSH_API ", "")
    text = re.sub(r"^\}\s*$", "", text, flags=re.M)  # of extern "C"
    return re.sub(r"\n\s*\n+", "\n", text).strip() + "\n"


def functions(text):
    """Names of the functions that the library exports, in the order of the headers."""
    return list(dict.fromkeys(re.findall(r"VSH_API[^;{]*?\b(vsh_\w+)\(", COMMENT.sub(" ", text))))


def enumerations(text):
    """Each enum of the headers: its constants by their names, and the numbers that they stand for."""
    constants, blocks = {}, []
    for body in re.findall(r"^enum \{(.*?)\};", COMMENT.sub(" ", text), re.S | re.M):
        number, block = -1, {}
        for entry in filter(None, (part.strip() for part in body.split(","))):
            name, _, given = entry.partition("=")
            number = eval(given.strip(), {}, constants) if given.strip() else number + 1  # our own headers' numbers
            block[name.strip()] = number
            constants.update(block)
        blocks.append(block)
    return blocks


def _words(comment):
    """A comment as one line."""
    return " ".join(re.sub(r"^\s*\* ?", " ", line) for line in comment.strip("/*").split("\n")).split()


def structs(text):
    """{name: [Member, …]} of every struct whose members are declared."""
    found = {}
    for match in re.finditer(r"^typedef struct (\w+) \{\n(.*?)^\} \1;", text, re.S | re.M):
        members = []
        body = re.sub(r"\(\*(\w+)\)\(.*?\);", r"\1_callback \1;", match[2], flags=re.S)
        for part in re.finditer(r"(?P<declared>[a-z_][^;/]*);|(?P<comment>/\*.*?\*/)", body, re.S):
            if part["comment"]:
                if members and not members[-1].comment:
                    members[-1].comment = " ".join(_words(part["comment"]))
                continue
            kind = ""
            for name in part["declared"].split(","):
                first = re.match(r"(.*?)(\w+)((?:\[\w+\])*)$", name.strip(), re.S)
                kind = " ".join(first[1].split()) or kind
                members.append(Member(first[2], kind, re.findall(r"\w+", first[3]), ""))
        found[match[1]] = members
    return found


def words_of_members(text):
    """{(struct, member): prefix}: members that hold one of the constants VSH_PREFIX_…, as their comments say."""
    prefixes = {}
    for struct, members in structs(text).items():
        for member in members:
            match = re.search(r"(VSH_[A-Z_]+_)…(?! \+)", member.comment)
            if match and member.type == "int32_t" and "bits" not in member.comment:
                prefixes[struct, member.name] = match[1]
    return prefixes
