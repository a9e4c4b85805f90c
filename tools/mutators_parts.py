"""How tools/mutate changes files that are made of parts: they are taken apart, changed, and put together so that lengths and check
sums hold, which leads past a reader's first look. What cannot be taken apart any more is changed as bytes."""
import struct
import zlib

import mutators

CHANGES = [mutators.count_near, mutators.number_end, mutators.float_end, mutators.blank, mutators.drop, mutators.repeat, mutators.graft]


def changed(rng, part, other=b"\0\1\2\3"):
    return rng.choice(CHANGES)(rng, part, other) if part else rng.randbytes(rng.randrange(1, 9))


def shuffled(rng, parts, theirs):
    """A list of parts with one gone, doubled, moved, or put in from another file."""
    parts = list(parts)
    at = rng.randrange(len(parts))
    what = rng.randrange(4)
    if what == 0 and len(parts) > 1:
        del parts[at]
    elif what == 1:
        parts.insert(rng.randrange(len(parts) + 1), parts[at])
    elif what == 2:
        parts.insert(rng.randrange(len(parts)), parts.pop(at))
    elif theirs:
        parts[at] = rng.choice(theirs)
    return parts


def by_parts(take, put):
    """A mutator of files that `take` makes parts of (lists of [name, bytes]) and `put` files."""
    def mutate(rng, data, other):
        try:
            parts, theirs = take(data), take(other)
        except (struct.error, ValueError, IndexError, zlib.error):
            return rng.choice(CHANGES)(rng, data, other)
        if not parts:
            return data
        if rng.random() < 0.3:
            return put(rng, shuffled(rng, parts, theirs))
        at = rng.randrange(len(parts))
        parts = list(parts)
        parts[at] = [parts[at][0], changed(rng, parts[at][1], rng.choice(theirs)[1] if theirs else b"\0")]
        return put(rng, parts)
    return mutate


# --- GLB: chunks of JSON and of bytes

def take_glb(data):
    parts, at = [], 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, at)
        parts.append([kind, data[at + 8:at + 8 + length]])
        at += 8 + length
    return parts


def put_glb(rng, parts):
    body = b""
    for kind, part in parts:
        part += (b" " if kind == 0x4e4f534a else b"\0") * (-len(part) % 4)
        length = len(part) + (rng.choice([-4, 4, 1, -1, 1 << 20]) if rng.random() < 0.05 else 0)
        body += struct.pack("<II", length % (1 << 32), kind) + part
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def glb_tree(rng, data, other):
    """The JSON of a GLB, edited as a tree; its lengths hold."""
    try:
        parts, theirs = take_glb(data), take_glb(other)
    except struct.error:
        return data
    if not parts or not theirs:
        return data
    return put_glb(rng, [[parts[0][0], mutators.json_tree(rng, parts[0][1], theirs[0][1])]] + parts[1:])


# --- PNG: chunks with check sums; pixels are packed anew

def take_png(data):
    parts, at = [], 8
    while at + 12 <= len(data):
        length = struct.unpack_from(">I", data, at)[0]
        name, part = data[at + 4:at + 8], data[at + 8:at + 8 + length]
        parts.append([name, zlib.decompress(part) if name == b"IDAT" else part])
        at += 12 + length
    return parts


def put_png(rng, parts):
    made = b"\x89PNG\r\n\x1a\n"
    for name, part in parts:
        part = zlib.compress(part) if name == b"IDAT" else part
        check = zlib.crc32(name + part) + (rng.random() < 0.03)
        made += struct.pack(">I", len(part)) + name + part + struct.pack(">I", check % (1 << 32))
    return made


# --- EXR: attributes, table of offsets, chunks

def take_exr(data):
    parts, at = [["version", data[4:8]]], 8
    while data[at] != 0:
        name = data[at:data.index(b"\0", at)]
        kind = data[at + len(name) + 1:data.index(b"\0", at + len(name) + 1)]
        head = at + len(name) + len(kind) + 2
        size = struct.unpack_from("<I", data, head)[0]
        parts.append([(name, kind), data[head + 4:head + 4 + size]])
        at = head + 4 + size
    return parts + [["rest", data[at + 1:]]]


def put_exr(rng, parts):
    head, rest = b"\x76\x2f\x31\x01" + next((part for name, part in parts if name == "version"), b"\2\0\0\0"), b""
    for name, part in parts:
        if name == "rest":
            rest = part
        elif name != "version":
            size = len(part) + (rng.choice([1, -1, 4, 1 << 31]) if rng.random() < 0.05 else 0)
            head += name[0] + b"\0" + name[1] + b"\0" + struct.pack("<I", size % (1 << 32)) + part
    return head + b"\0" + rest


def exr_chunks(rng, data, _):
    """Of the pixels: the table of offsets, and what stands before each chunk (its row or tile, its size)."""
    try:
        rest = take_exr(data)[-1][1]
    except (struct.error, ValueError, IndexError):
        return data
    first = len(data) - len(rest)
    if len(rest) < 8:
        return data
    count = max(1, (struct.unpack_from("<Q", rest)[0] - first) // 8)
    at = first + 8 * rng.randrange(min(count, len(rest) // 8))
    if rng.random() < 0.5:
        offset = struct.unpack_from("<Q", data, at)[0] + rng.choice([1, -1, 8, -8, 1 << 40, -first, len(data)])
        return data[:at] + struct.pack("<Q", offset % (1 << 64)) + data[at + 8:]
    chunk = struct.unpack_from("<Q", data, at)[0] + 4 * rng.randrange(3)
    value = rng.choice([-1, 0, 1, 17, 1 << 30, -(1 << 31), (1 << 31) - 1, rng.randrange(256)])
    return data[:chunk] + struct.pack("<i", value) + data[chunk + 4:] if chunk + 4 <= len(data) else data


# --- TIFF: the entries of its directory

def tiff_entry(rng, data, _):
    try:
        order = "<" if data[:2] == b"II" else ">"
        at = struct.unpack_from(order + "I", data, 4)[0]
        count = struct.unpack_from(order + "H", data, at)[0]
        entry = at + 2 + 12 * rng.randrange(count)
        field, form = rng.choice([(0, "H"), (2, "H"), (4, "I"), (8, "I"), (8, "H"), (8, "I")])
        value = struct.unpack_from(order + form, data, entry + field)[0]
    except (struct.error, ValueError, IndexError):
        return data
    new = rng.choice([value + 1, value - 1, 2 * value, rng.choice(mutators.ENDS), rng.randrange(20), 256 + rng.randrange(90)])
    size = struct.calcsize(order + form)
    return data[:entry + field] + struct.pack(order + form, new % (1 << 8 * size)) + data[entry + field + size:]


# --- JPEG: segments

def take_jpeg(data):
    parts, at = [], 2
    while data[at] == 0xff and data[at + 1] != 0xda:
        length = struct.unpack_from(">H", data, at + 2)[0]
        parts.append([data[at + 1], data[at + 4:at + 2 + length]])
        at += 2 + length
    return parts + [["pixels", data[at:]]]


def put_jpeg(rng, parts):
    made = b"\xff\xd8"
    for kind, part in parts:
        if kind != "pixels":
            length = len(part) + 2 + (rng.choice([1, -1, 9]) if rng.random() < 0.05 else 0)
            made += b"\xff" + bytes([kind]) + struct.pack(">H", length % 65536)
        made += part
    return made


# --- FBX: a tree of records, whose arrays are packed

def take_fbx_records(data, at, end):
    records = []
    while at + 13 <= end:
        stop, count, size, name = struct.unpack_from("<IIIB", data, at)
        if stop == 0:
            break
        head = at + 13 + name
        inner = take_fbx_records(data, head + size, stop) if stop > head + size else None
        records.append([data[at + 13:head], count, data[head:head + size], inner])
        at = stop
    return records


def put_fbx_records(rng, records, at):
    made = b""
    for name, count, properties, inner in records:
        head = at + len(made) + 13 + len(name)
        children = b"" if inner is None else put_fbx_records(rng, inner, head + len(properties)) + b"\0" * 13
        stop = head + len(properties) + len(children)
        made += struct.pack("<IIIB", stop, count % (1 << 32), len(properties), len(name)) + name + properties + children
    return made


def fbx_array(rng, properties):
    """An array of numbers, unpacked, changed, packed."""
    count, packed, size = struct.unpack_from("<III", properties, 1)
    values = zlib.decompress(properties[13:13 + size]) if packed else properties[13:13 + size]
    width = {b"d": 8, b"l": 8}.get(properties[:1], 4)
    values = changed(rng, values)
    if rng.random() < 0.7:
        count = len(values) // width
    elif rng.random() < 0.5:
        count = (count + rng.choice([1, -1, 1 << 20, 1 << 29])) % (1 << 32)
    values = zlib.compress(values) if packed else values
    return properties[:1] + struct.pack("<III", count, packed, len(values)) + values


def fbx(rng, data, other):
    try:
        records, theirs = (take_fbx_records(one, 27, len(one)) for one in (data, other))
        group = records
        while True:  # down to any depth
            at = rng.randrange(len(group))
            if not group[at][3] or rng.random() < 0.15:
                break
            group = group[at][3]
        record = group[at]
        if rng.random() < 0.3:
            group[:] = shuffled(rng, group, theirs)
        elif record[2][:1] in b"fdlib" and len(record[2]) > 13 and record[1] == 1:
            record[2] = fbx_array(rng, record[2])
        else:
            record[2] = changed(rng, record[2])
            record[1] += rng.choice([0, 0, 0, 1, -1, 100])
        return data[:27] + put_fbx_records(rng, records, 27) + b"\0" * 13 + data[-160:]
    except (struct.error, ValueError, IndexError, zlib.error, RecursionError, MemoryError):
        return rng.choice(CHANGES)(rng, data, other)


# --- .vdb: texts, each behind its length

NAMES = [b"Tree_float_5_4_3", b"Tree_float_5_4_3_HalfFloat", b"Tree_double_5_4_3", b"Tree_vec3s_5_4_3", b"Tree_bool_5_4_3", b"Tree_mask_5_4_3",
         b"Tree_int32_5_4_3", b"Tree_ptdataidx32_5_4_3_ptdataidx32", b"UniformScaleMap", b"ScaleTranslateMap", b"UniformScaleTranslateMap",
         b"AffineMap", b"TranslationMap", b"UnitaryMap", b"NonlinearFrustumMap", b"level set", b"fog volume", b"staggered", b"class",
         b"string", b"vec3i", b"int64", b"float", b"bool", b"vec3d", b"mat4d", b"file_compression", b"file_delayed_load", b"__delayedload"]


def vdb_texts(data):
    """Where texts behind their 32-bit lengths begin."""
    found = []
    for at in range(29, min(len(data) - 4, 4000)):
        size = struct.unpack_from("<I", data, at)[0]
        text = data[at + 4:at + 4 + size]
        if 0 < size < 100 and len(text) == size and all(32 <= byte < 127 for byte in text):
            found.append(at)
    return found


def vdb_text(rng, data, _):
    """A name, type or map becomes another one, with its length or without; or its length does."""
    found = vdb_texts(data)
    if not found:
        return data
    at = rng.choice(found)
    size = struct.unpack_from("<I", data, at)[0]
    if rng.random() < 0.3:
        return data[:at] + struct.pack("<I", (size + rng.choice([1, -1, 4, -size, 1000, 1 << 24, 1 << 31])) % (1 << 32)) + data[at + 4:]
    text = rng.choice(NAMES)
    length = len(text) if rng.random() < 0.9 else size
    return data[:at] + struct.pack("<I", length) + text + data[at + 4 + size:]


def vdb_head(rng, data, other):
    """The metadata, the map and the tree's topology, which are where a file begins; offsets of the grids."""
    return changed(rng, data[:1500], other[:1500]) + data[1500:]


def vdb_packed(rng, data, _):
    """What stands before a block that zlib (its length) or Blosc (its header: sizes) has packed."""
    found = [at for at in range(900, len(data) - 16) if data[at:at + 2] in (b"x\x9c", b"x\x01", b"x^") or data[at:at + 2] == b"\2\1"]
    if not found:
        return mutators.count_near(rng, data, data)
    at = rng.choice(found) + rng.choice([-8, -8, -4, 0, 1, 2, 3, 4, 4, 8, 8, 12, 12])
    value = struct.unpack_from("<I", data, at)[0]
    value = rng.choice([value + 1, value - 1, value + 16, value * 2, value // 2, 0, 1 << 31, (1 << 32) - 1, 1 << 24, rng.randrange(4096)])
    return data[:at] + struct.pack("<I", value % (1 << 32)) + data[at + 4:]


GLB = by_parts(take_glb, put_glb)
PNG = by_parts(take_png, put_png)
EXR = by_parts(take_exr, put_exr)
JPEG = by_parts(take_jpeg, put_jpeg)
