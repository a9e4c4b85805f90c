"""Images of tools/memory-bombs: small files that say they are large."""
import struct
import zlib


def png_chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def zeros(size, level=9):
    """That many zeros, packed, without having them at once."""
    packer, made, block = zlib.compressobj(level), b"", bytes(1 << 20)
    while size > 0:
        made += packer.compress(block[:size])
        size -= len(block)
    return made + packer.flush()


def png(width, height, depth=8, kind=0, interlaced=0, pixels=None, more=b""):
    """kind: 0 grey, 2 RGB, 6 RGBA. Pixels are black, all of them, or as given (packed rows)."""
    row = 1 + (width * depth * {0: 1, 2: 3, 6: 4}[kind] + 7) // 8
    packed = pixels if pixels is not None else zeros(min(row * height, 200 << 20))
    return (b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, interlaced)) + more +
            png_chunk(b"IDAT", packed) + png_chunk(b"IEND", b""))


def checkerboard(size):
    """As many edges as an image can have."""
    packer, made = zlib.compressobj(9), b""
    rows = [b"\0" + b"\xaa" * (size // 8), b"\0" + b"\x55" * (size // 8)]
    for y in range(size):
        made += packer.compress(rows[y % 2])
    return png(size, size, 1, pixels=made + packer.flush())


def attribute(name, kind, data, size=None):
    return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data) if size is None else size) + data


def channels(names):
    return b"".join(name + b"\0" + struct.pack("<iIii", 2, 0, 1, 1) for name in names) + b"\0"


def exr(width, height, names=(b"Y",), packing=3, tiles=None, flags=0, more=b"", window=None, kind=None, body=None, constant=None):
    """Header and table of offsets; of the chunks only what body or constant gives. packing 3: zip of 16 rows."""
    box = struct.pack("<iiii", *(window or (0, 0, width - 1, height - 1)))
    head = b"\x76\x2f\x31\x01" + struct.pack("<I", 2 | flags | (0x200 if tiles and not flags else 0))
    head += attribute(b"channels", b"chlist", channels(names)) + attribute(b"compression", b"compression", bytes([packing]))
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8)) + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))
    if tiles:
        head += attribute(b"tiles", b"tiledesc", struct.pack("<IIB", *tiles))
    if kind:
        head += attribute(b"type", b"string", kind)
    head += more + b"\0"
    if constant is None:
        return head + (body if body is not None else struct.pack("<Q", len(head) + 8) * 16)
    rows = 16  # every chunk is the same rows
    row_bytes = width * 4 * len(names)
    part = zeros(row_bytes * rows)
    count = (height + rows - 1) // rows
    table, data, at = b"", b"", len(head) + 8 * count
    for i in range(count):
        last = part if (i + 1) * rows <= height else zeros(row_bytes * (height - i * rows))
        table += struct.pack("<Q", at + len(data))
        data += struct.pack("<iI", i * rows, len(last)) + last
    return head + table + data


def tiff(width, height, bits=8, samples=1, packing=8, strips=None, tile=None, more=(), planar=1, data=None):
    """One directory. packing 1: none, 5: LZW, 8: deflate, 32773: PackBits."""
    data = data if data is not None else zeros(min(width * height * samples * bits // 8, 64 << 20))
    entries = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, bits), (259, 3, 1, packing), (262, 3, 1, 1 if samples == 1 else 2),
               (277, 3, 1, samples), (284, 3, 1, planar)]
    if tile:
        entries += [(322, 4, 1, tile), (323, 4, 1, tile), (324, 4, 1, 8), (325, 4, 1, len(data))]
    else:
        entries += [(273, 4, 1, 8), (278, 4, 1, strips or height), (279, 4, 1, len(data))]
    entries = sorted(entries + list(more))
    at = 8 + len(data) + len(data) % 2
    directory = struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", *entry) for entry in entries) + bytes(4)
    return b"II*\0" + struct.pack("<I", at) + data + b"\0" * (len(data) % 2) + directory


def patched(data, at, form, *values):
    return data[:at] + struct.pack(form, *values) + data[at + struct.calcsize(form):]


def patched_jpeg(data, height, width):
    for marker in (b"\xff\xc0", b"\xff\xc1", b"\xff\xc2"):
        if marker in data:
            return patched(data, data.index(marker) + 5, ">HH", height, width)
    return data


def images(sound):
    """Names and files. `sound` makes a small picture in a format."""
    far = 1 << 30
    many = [b"c%05d" % i for i in range(20000)]
    yield "grey.png", png(30000, 30000)
    yield "bits.png", png(60000, 60000, 1)
    yield "rgba16.png", png(16000, 16000, 16, 6)
    yield "wide.png", png(1 << 24, 64)
    yield "tall.png", png(1, 1 << 24)
    yield "most.png", png((1 << 31) - 1, (1 << 31) - 1, pixels=zeros(1000))
    yield "interlaced.png", png(20000, 20000, 8, 2, 1)
    yield "middle.png", png(7000, 7000, 8, 6)
    yield "text.png", png(8, 8, more=png_chunk(b"zTXt", b"a\0\0" + zeros(150 << 20)))
    yield "profile.png", png(8, 8, more=png_chunk(b"iCCP", b"a\0\0" + zeros(150 << 20)))
    yield "texts.png", png(8, 8, more=png_chunk(b"tEXt", b"k\0" + b"x" * 60) * 100000)
    yield "checks.png", checkerboard(8192)
    yield "few_checks.png", checkerboard(2048)
    yield "large.exr", exr(60000, 60000)
    yield "constant.exr", exr(6000, 6000, constant=0)
    yield "planes.exr", exr(3000, 3000, (b"A", b"R", b"ao", b"shadow.sun"), constant=0)
    yield "channels.exr", exr(64, 64, many)
    yield "tile.exr", exr(20000, 20000, tiles=(20000, 20000, 0))
    yield "tiles.exr", exr(30000, 30000, tiles=(1, 1, 0))
    yield "mips.exr", exr(30000, 30000, tiles=(16, 16, 1))
    yield "rips.exr", exr(30000, 30000, tiles=(16, 16, 2))
    yield "far.exr", exr(0, 0, window=(-far, -far, far, far))
    yield "corner.exr", exr(0, 0, window=(far, far, far + 9000, far + 9000))
    yield "row.exr", exr(200000000, 1)
    yield "column.exr", exr(1, 200000000)
    yield "piz.exr", exr(20000, 20000, packing=4)
    yield "dwab.exr", exr(20000, 20000, packing=9)
    yield "deep.exr", exr(20000, 20000, flags=0x800, kind=b"deepscanline", more=attribute(b"version", b"int", b"\1\0\0\0"))
    yield "attribute.exr", exr(8, 8, more=attribute(b"note", b"string", b"x" * 50, 2000000000))
    yield "attributes.exr", exr(8, 8, more=b"".join(attribute(b"n%d" % i, b"string", b"x") for i in range(200000)))
    yield "preview.exr", exr(8, 8, more=attribute(b"preview", b"preview", struct.pack("<II", 65535, 65535) + bytes(64)))
    yield "grey.tif", tiff(60000, 60000)
    yield "rgba16.tif", tiff(16000, 16000, 16, 4)
    yield "lzw.tif", tiff(40000, 40000, packing=5, data=bytes(4000))
    yield "packbits.tif", tiff(40000, 40000, packing=32773, data=b"\x81\0" * 4000)
    yield "tile.tif", tiff(60000, 60000, tile=60000 // 16 * 16)
    yield "planes.tif", tiff(20000, 20000, samples=4, planar=2)
    yield "samples.tif", tiff(2000, 2000, samples=60000)
    yield "profile.tif", tiff(8, 8, more=[(34675, 7, 2000000000, 8)])
    yield "raw.tif", tiff(20000, 20000, packing=1, data=bytes(1000))
    yield "large.bmp", patched(sound("bmp"), 18, "<ii", 30000, 30000)
    yield "large.tga", patched(sound("tga"), 12, "<HH", 65535, 65535)
    yield "large.ppm", b"P6\n50000 50000\n255\n" + bytes(1000)
    yield "large.pgm", b"P5\n100000 100000\n65535\n" + bytes(1000)
    yield "large.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n" + bytes(1000)
    yield "large.jpg", patched_jpeg(sound("jpg"), 65500, 65500)
    yield "middle.jpg", patched_jpeg(sound("jpg"), 8000, 8000)
    yield "large.gif", patched(sound("gif"), 6, "<HH", 65535, 65535)
    jp2 = sound("jp2")
    if b"\xff\x51" in jp2:
        yield "large.jp2", patched(jp2, jp2.index(b"\xff\x51") + 6, ">II", 60000, 60000)
        yield "one_tile.jp2", patched(patched(jp2, jp2.index(b"\xff\x51") + 6, ">II", 30000, 30000), jp2.index(b"\xff\x51") + 22, ">II",
                                      30000, 30000)
    webp = sound("webp")
    if b"VP8L" in webp:
        yield "large.webp", patched(webp, webp.index(b"VP8L") + 9, "<I", 0x0fffffff)
    elif b"VP8 " in webp:
        yield "large.webp", patched(webp, webp.index(b"VP8 ") + 14, "<HH", 16383, 16383)
    yield "large.dpx", patched(sound("dpx"), 772, ">II", 60000, 60000)
    yield "user.dpx", patched(sound("dpx"), 20, ">I", 4000000000)
