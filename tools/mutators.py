"""How tools/mutate changes files: blocks, numbers and words of any file, and the tree of a JSON document.

Every function takes a random.Random, a file's bytes and those of another of the same format, and gives bytes."""
import json
import math
import re
import struct

# what numbers written as text become
NUMBERS = [b"0", b"-0", b"1", b"-1", b"2", b"1e-45", b"1e-12", b"1e12", b"1e15", b"1e19", b"-1e30", b"3.5e38", b"1e300", b"1e308",
           b"1e999", b"-1e999", b"nan", b"-inf", b"255", b"256", b"65535", b"65536", b"1000000", b"2147483647", b"2147483648",
           b"-2147483648", b"4294967295", b"4294967296", b"9223372036854775807", b"18446744073709551616", b"1e", b"0x10",
           b"1.7976931348623157e308", b"0." + b"0" * 400 + b"1", b"9" * 400, b"1_0", b"+5", b"\xd9\xa3"]
# bytes that are no UTF-8, or odd
DAMAGE = [b"\xff", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xe2\x82", b"\xef\xbb\xbf", b"\x00", b"\x1b[2J", b"\x1b]0;x\x07",
          b"\r", b"\x0b", b"\xe2\x80\xae", b"%s%n", b"../../../../etc/passwd", b"/dev/zero", b"\\", b'"', b"<", b"&", b"\x7f"]
ENDS = [0, 1, 2, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0x8000, 0xffff, 0x10000, 0xffffff, 0x7fffffff, 0x80000000, 0xfffffffe, 0xffffffff,
        1 << 32, (1 << 62), (1 << 63) - 1, 1 << 63, (1 << 64) - 1]
FLOATS = [0.0, -0.0, 1e-45, 1e-30, 1.0, -1.0, 1e10, 1e19, -1e30, 3.4e38, float("inf"), float("-inf"), float("nan")]
MOST = 1 << 20  # bytes; copies make files no longer

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_][A-Za-z0-9_.:\-]*")


def whole(value):
    """Of a number, its whole part; 0 of what has none."""
    return int(value) if math.isfinite(value) else 0


def span(rng, data, most=None):
    """Where a block begins and ends: short ones are more likely than long ones."""
    size = min(len(data), int(2 ** rng.uniform(0, max(1.0, (most or len(data) or 1).bit_length()))))
    begin = rng.randrange(len(data) - size + 1)
    return begin, begin + size


# --- blocks

def splice(rng, data, other):
    """The beginning of one file and the end of another, cut at like places or at any."""
    at = rng.randrange(len(data) + 1)
    share = at / max(1, len(data)) if rng.random() < 0.6 else rng.random()
    return data[:at] + other[int(share * len(other)):]


def graft(rng, data, other):
    """A block of the other file, over one of this or between."""
    begin, end = span(rng, other, 4096) if other else (0, 0)
    at = rng.randrange(len(data) + 1)
    return data[:at] + other[begin:end] + data[at + (end - begin if rng.random() < 0.5 else 0):]


def move(rng, data, _):
    begin, end = span(rng, data)
    rest = data[:begin] + data[end:]
    at = rng.randrange(len(rest) + 1)
    return rest[:at] + data[begin:end] + rest[at:]


def repeat(rng, data, _):
    begin, end = span(rng, data, 4096)
    times = rng.choice([1, 1, 2, 3, 16, 300])
    return (data[:end] + data[begin:end] * times + data[end:])[:max(len(data), MOST)]


def drop(rng, data, _):
    begin, end = span(rng, data, 4096)
    return data[:begin] + data[end:]


def truncate(rng, data, _):
    return data[:rng.randrange(len(data) + 1)]


def blank(rng, data, _):
    begin, end = span(rng, data, 1024)
    return data[:begin] + rng.choice([b"\0", b"\xff", b" ", b"\n", b"0"]) * (end - begin) + data[end:]


def append(rng, data, other):
    return data + rng.choice([other, b"\0" * rng.randrange(1, 4096), data[:64], rng.randbytes(rng.randrange(1, 64))])


# --- numbers in binary files

FORMS = [("<H", 2), ("<I", 4), ("<I", 4), ("<Q", 8), (">H", 2), (">I", 4), ("B", 1)]


def count_near(rng, data, _):
    """A whole number that could be a count, length or offset (no more than the file is long) becomes a little more or less."""
    form, size = rng.choice(FORMS)
    for _ in range(64):
        if len(data) < size:
            break
        at = rng.randrange(len(data) - size + 1)
        value = struct.unpack_from(form, data, at)[0]
        if 0 < value <= 2 * len(data):
            change = rng.choice([1, 1, 2, 3, 4, 7, 8, 16, value, -1, -1, -2, -4, -value, value // -2, 255])
            value = (value + change) % (1 << 8 * size)
            return data[:at] + struct.pack(form, value) + data[at + size:]
    return data


def number_end(rng, data, _):
    """A whole number becomes one at the end of a range."""
    form, size = rng.choice(FORMS)
    at = rng.randrange(max(1, len(data) - size + 1))
    if rng.random() < 0.7:
        at -= at % size
    return data[:at] + struct.pack(form, rng.choice(ENDS) % (1 << 8 * size)) + data[at + size:]


def float_end(rng, data, _):
    """A float or double becomes tiny, huge or none."""
    form, size = rng.choice([("<f", 4), ("<f", 4), ("<d", 8), (">f", 4)])
    at = rng.randrange(max(1, len(data) - size + 1))
    at -= at % (4 if rng.random() < 0.8 else 1)
    return data[:at] + struct.pack(form, rng.choice(FLOATS)) + data[at + size:]


# --- texts

def text_number(rng, data, _):
    found = list(NUMBER.finditer(data[:200000]))
    if not found:
        return data
    one = rng.choice(found)
    text = rng.choice(NUMBERS)
    if rng.random() < 0.4:  # near what it was
        try:
            value = float(one.group())
            text = repr(rng.choice([value + 1, value - 1, -value, value * 1e6, value / 1e9, value * 0.999999, whole(value) + 1])).encode()
        except (ValueError, OverflowError):
            pass
    return data[:one.start()] + text + data[one.end():]


def text_word(rng, data, other):
    """A word becomes another one of these files, longer, or odd."""
    found = list(WORD.finditer(data[:200000]))
    words = WORD.findall(other[:200000])
    if not found or not words:
        return data
    one = rng.choice(found)
    new = rng.choice([rng.choice(words), rng.choice(words), one.group()[:-1], one.group() * 2, b"x" * rng.choice([300, 5000, 70000]), b"",
                      rng.choice(DAMAGE) + one.group()])
    if rng.random() < 0.3:  # all of them
        return data.replace(one.group(), new)[:max(len(data), MOST)]
    return data[:one.start()] + new + data[one.end():]


def text_lines(rng, data, other):
    lines = data.split(b"\n")
    theirs = other.split(b"\n")
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    what = rng.randrange(7)
    if what == 0:
        lines[at], lines[to] = lines[to], lines[at]
    elif what == 1:
        lines[at:at] = [lines[to]] * rng.choice([1, 2, 30, 1000])
    elif what == 2:
        del lines[min(at, to):max(at, to)][:50]
        del lines[at]
    elif what == 3:
        lines[at] = rng.choice(theirs)
    elif what == 4:
        lines.insert(at, b" ".join(rng.choice(NUMBERS) for _ in range(rng.randrange(1, 12))))
    elif what == 5:
        words = lines[at].split()
        rng.shuffle(words)
        lines[at] = b" ".join(words[:rng.randrange(len(words) + 1)] if rng.random() < 0.5 else words)
    else:
        lines[at] = (lines[at] + b" ") * rng.choice([2, 3, 50, 2000])
    return b"\n".join(lines)[:max(len(data), MOST)]


def text_damage(rng, data, _):
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(DAMAGE) + data[at:]


def text_ends(rng, data, _):
    return rng.choice([lambda: data.replace(b"\n", b"\r\n"), lambda: data.replace(b"\n", b"\r"), lambda: data.replace(b"\n", b" "),
                       lambda: b"\xef\xbb\xbf" + data, lambda: data.decode("latin-1").encode("utf-16"), lambda: data.replace(b" ", b"\t"),
                       lambda: data.replace(b",", b";"), lambda: data.replace(b".", b",")])()


# --- the tree of a JSON document

def places(value, at=()):
    """The way to every value of a document, its own first."""
    yield at
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], at + (key,))
    elif isinstance(value, list):
        for i in range(len(value)):
            yield from places(value[i], at + (i,))


def reach(value, at):
    for step in at:
        value = value[step]
    return value


def other_value(rng, value, theirs):
    """What a value becomes."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and rng.random() < 0.75:
        near = [value + 1, value - 1, -value, value * 2, value * 1e6, value * 1e-9, whole(value), value + 0.5]
        ends = [0, -1, 1e-45, 1e-12, 1e15, 1.0000001e15, 1e30, -1e308, 65536, 65537, 2147483647, 2147483648, -2147483649, 4294967296,
                9223372036854775807, 10 ** 30, float("nan"), float("inf")]
        return rng.choice(near if rng.random() < 0.4 else ends)
    if isinstance(value, str) and rng.random() < 0.6:
        return rng.choice([value[:-1], value * 2, "", "x" * rng.choice([256, 5000, 70000]), "../" + value, "/" + value, value + "/",
                           value + "\0", "\x1b[31m" + value, "\ud800", "é\u202e" + value, "*", "[", ".", "%s%n", "a\nb", value.upper()])
    deep = []
    for _ in range(rng.choice([1, 5, 100, 2500])):
        deep = [deep] if rng.random() < 0.5 else {"of": [deep]}
    return rng.choice([None, True, False, 0, "", [], {}, [[]], [value], {"of": value}, deep, [value] * rng.choice([2, 65, 3000]),
                       reach(theirs, rng.choice(list(places(theirs))))])


def json_tree(rng, data, other):
    """One to four edits of the tree, and the document written anew. Bytes that are no JSON become another text."""
    try:
        tree, theirs = json.loads(data), json.loads(other)
    except (ValueError, RecursionError):
        return text_word(rng, data, other)
    for _ in range(rng.choice([1, 1, 2, 4])):
        ways = list(places(tree))[1:]
        if not ways:
            break
        at = rng.choice(ways)
        holder, key = reach(tree, at[:-1]), at[-1]
        what = rng.random()
        if what < 0.15:
            del holder[key]
        elif what < 0.3 and isinstance(holder, list):
            holder.insert(rng.randrange(len(holder) + 1), holder[key])
        elif what < 0.4 and isinstance(holder, dict):
            name = rng.choice([key + "_", key.upper(), "", "constructor", "x" * 300, rng.choice(list(holder))])
            holder[name] = holder.pop(key)
        elif what < 0.5:
            way = rng.choice(list(places(theirs)))
            holder[key] = json.loads(json.dumps(reach(theirs, way)))
        else:
            holder[key] = other_value(rng, holder[key], theirs)
        try:
            tree = json.loads(json.dumps(tree))  # nothing stands in two places
        except RecursionError:
            return data
    text = json.dumps(tree, ensure_ascii=rng.random() < 0.7, indent=rng.choice([None, 1]))
    return text.encode("utf-8", "surrogatepass")[:4 * MOST]


BYTES = [splice, splice, graft, move, repeat, drop, truncate, blank, append, count_near, count_near, count_near, number_end, float_end]
TEXTS = [splice, graft, move, repeat, drop, truncate, blank, text_number, text_number, text_number, text_number, text_word, text_word,
         text_lines, text_lines, text_damage, text_ends]
TREES = [json_tree] * 3 * len(TEXTS) + TEXTS
