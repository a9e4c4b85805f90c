"""The formats of tools/mutate: the sound files that its inputs are made of, how these are damaged, and what is run with them.

Each function that damages takes a random.Random, a file's bytes and those of another file of the format, and returns bytes."""
import glob
import json
import math
import os
import re
import struct
import subprocess
import tarfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FONTS = "/usr/share/fonts/truetype/dejavu/"
LIGHT = ["--sun", "0.3,1,0.2", "--sun-angle", "5"]
SMALL = ["--resolution", "12", "--threads", "1"]
BAKE = ["bake", "IN", *LIGHT, "--ao", "0.5", "--size", "8", *SMALL, "-o", "out.exr"]
# of what every mesh is put to, more often what is cheap
MESH = [["info", "IN"]] * 4 + [BAKE] * 3 + [
    ["bake", "IN", *LIGHT, "--method", "cone", "--ao", "0.5", "--ao-method", "cones", "--size", "8", *SMALL, "-o", "out.png"],
    ["bake", "IN", *LIGHT, "--uv-set", "0", "--per-object", "--size", "6", *SMALL, "-o", "made/"],
    ["query", "sound.obj", "--caster", "IN", *LIGHT, "--points", "points.csv", "--distance", *SMALL, "-o", "out.csv"],
    ["voxelize", "IN", *SMALL, "-o", "out.vdb"],
    ["render", "IN", *LIGHT, "--size", "8x8", *SMALL, "-o", "out.png"]]
IMAGE = [["info", "IN"]] * 3 + [["compare", "IN", "SOUND"]] * 2 + [
    ["compare", "SOUND", "IN", "--json"],
    ["render", "sound.obj", "--lightmap", "IN", "--size", "8x8", *SMALL, "-o", "out.png"],
    ["bake", "heights.json", "--size", "8", *SMALL, "-o", "out.exr"],
    ["bake", "mask.json", "--size", "8", *SMALL, "-o", "out.exr"],
    ["flat", "flat_mask.json", "--size", "8", "--threads", "1", "-o", "out.exr"]]
VDB = [["info", "IN"]] * 3 + [["compare", "IN", "SOUND"], ["compare", "SOUND", "IN"]] + [
    ["query", "IN", *LIGHT, "--points", "points.csv", "--distance", "--threads", "1", "-o", "out.csv"],
    ["volume", "IN", *LIGHT, "--method", "cone", "--band", "1", "--threads", "1", "-o", "out.vdb"],
    ["bake", "vdb.json", "--size", "8", "--resolution", "12", "--threads", "1", "-o", "out.exr"]]
SCENE = [["info", "IN"]] * 3 + [["bake", "IN", "--size", "6", *SMALL, "--output-folder", "made"]] * 3 + [
    ["bake", "IN", "--size", "6", "--method", "hard", *SMALL, "-o", "out.exr"],
    ["voxelize", "IN", *SMALL, "-o", "out.vdb"],
    ["query", "IN", "--points", "points.csv", "--distance", *SMALL, "-o", "out.csv"],
    ["render", "IN", "--size", "8x8", *SMALL, "-o", "out.png"]]


class Format:
    """One row of the table: a name, what files end with, how they are changed, what is run."""

    def __init__(self, name, ending, ways, runs, seeds, beside=None, given=None):
        self.name, self.ending, self.ways, self.runs = name, ending, ways, runs
        self.seeds = seeds    # a function of Sound: a list of bytes
        self.beside = beside  # the name that the input has, where it is not in.ENDING
        self.given = given    # a function of Sound: files that stand beside it, by name


class Sound:
    """Sound files, of the repository and by the program itself, in a folder."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        os.makedirs(folder, exist_ok=True)

    def read(self, *patterns):
        found = [path for pattern in patterns for path in sorted(glob.glob(os.path.join(ROOT, pattern)))]
        assert found, patterns
        return [open(path, "rb").read() for path in found]

    def path(self, name):
        return os.path.join(self.folder, name)

    def made(self, name, *arguments):
        """A file that the program wrote."""
        if not os.path.exists(self.path(name)):
            subprocess.run([self.program, *arguments, "--quiet", "-o", self.path(name)], check=True, cwd=os.path.join(ROOT, "assets"),
                           stderr=subprocess.DEVNULL)
        with open(self.path(name), "rb") as file:
            return file.read()

    def bake(self, name, *more):
        return self.made(name, "bake", "seeds.json", "--resolution", "24", "--size", "24", "--method", "cone", "--ao-method", "cones", *more)

    def images(self, ending, *packs):
        """Small pictures in a format: as the program writes it, in other depths, and packs."""
        return [self.bake(f"{i}.{ending}", *pack) for i, pack in enumerate(packs or [[], ["--pack", "R=shadow.sun"]])]


def fuzz_inputs(target, *names):
    """Of what a fuzz target is replayed with."""
    with tarfile.open(os.path.join(ROOT, "tests", "fuzz", "corpus", target + ".tar")) as archive:
        return [archive.extractfile(name).read() for name in names]


def level_sets(*names):
    return lambda _: fuzz_inputs("vdb", *("seed_" + name for name in names))


def text(value):
    return json.dumps(value, indent=1).encode()


def scene(*casters, **more):
    return text({"casters": list(casters), "resolution": 12, "ao": {"distance": 0.5},
                 "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2], "angle_deg": 5}],
                 "receivers": [{"mesh": "sound.obj", "size": 8, "output": "out.exr"}], **more})


def scenes(sound):
    """Every block of JSON in docs/scene.md, and those of assets and tests."""
    page = open(os.path.join(ROOT, "docs", "scene.md"), encoding="utf-8").read()
    blocks = [block.split("```")[0].encode() for block in page.split("```json\n")[1:]]
    return blocks + sound.read("assets/*.json", "tests/golden/casters.json", "tests/golden/layers.json", "tests/golden/ring.json")


def flat_scenes(sound):
    page = open(os.path.join(ROOT, "docs", "flat.md"), encoding="utf-8").read()
    return [block.split("```")[0].encode() for block in page.split("```json\n")[1:]] + sound.read("tests/golden/flat.json")


def assets(sound):
    """What scenes name, small."""
    named = ["seeds_floor.obj", "emblem.png", "spheres.csv", "seeds.json"]
    given = {name: sound.read("assets/" + name)[0] for name in named}
    given["terrain.png"] = sound.bake("terrain.png", "--pack", "R=ao")
    given["cloister.glb"] = given["thin.glb"] = sound.read("tests/models/scene.glb")[0]
    given["cloister.obj"] = sound.read("tests/models/scene.obj")[0]
    given["left.vdb"] = given["right.vdb"] = sound.made("a.vdb", "voxelize", "../tests/models/scene.obj", "--resolution", "12")
    return given


def every(sound):
    """What stands beside every input."""
    return {"sound.obj": sound.read("assets/seeds_floor.obj")[0], "scene.mtl": sound.read("tests/models/scene.mtl")[0],
            "points.csv": b"x,y,z,nx,ny,nz\n0,5,0,0,1,0\n1,0.1,2,0,1,0\n1,1,-2,1,0,0\n"}


def image_scenes(ending, _):
    name = "in." + ending
    flat = {"region": [-2, -2, 2, 2], "casters": [{"mask": name, "size": 2}],
            "lights": [{"name": "l", "type": "disc", "position": [1, 1.5], "radius": 0.1}]}
    return {"heights.json": scene({"heightfield": name, "size": [4, 4], "height": 1}), "flat_mask.json": text(flat),
            "mask.json": scene({"mask": name, "size": 2, "thickness": 0.5, "channel": "luminance"})}


def image(ending, ways, *packs):
    return Format(ending, ending, ways, IMAGE, lambda sound: sound.images(ending, *packs), None, lambda sound: image_scenes(ending, sound))


def models(*names):
    return lambda sound: sound.read(*("tests/models/" + name for name in names))


def obj_with(name):
    return lambda sound: {"scene.obj": sound.read("tests/models/scene.obj")[0]} if name == "mtl" else {}


# Numbers written as text become one of these.
NUMBERS = [b"0", b"-0", b"1", b"-1", b"2", b"1e-45", b"1e-12", b"1e12", b"1e15", b"1e19", b"-1e30", b"3.5e38", b"1e300", b"1e308",
           b"1e999", b"-1e999", b"nan", b"-inf", b"255", b"256", b"65535", b"65536", b"1000000", b"2147483647", b"2147483648",
           b"-2147483648", b"4294967295", b"4294967296", b"9223372036854775807", b"18446744073709551616", b"1e", b"0x10",
           b"1.7976931348623157e308", b"0." + b"0" * 400 + b"1", b"9" * 400, b"1_0", b"+5", b"\xd9\xa3"]
# Bytes that are not UTF-8, or odd.
DAMAGE = [b"\xff", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xe2\x82", b"\xef\xbb\xbf", b"\x00", b"\x1b[2J", b"\x1b]0;x\x07",
          b"\r", b"\x0b", b"\xe2\x80\xae", b"%s%n", b"../../../../etc/passwd", b"/dev/zero", b"\\", b'"', b"<", b"&", b"\x7f"]
ENDS = [0, 1, 2, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0x8000, 0xffff, 0x10000, 0xffffff, 0x7fffffff, 0x80000000, 0xfffffffe, 0xffffffff,
        1 << 32, (1 << 62), (1 << 63) - 1, 1 << 63, (1 << 64) - 1]
FLOATS = [0.0, -0.0, 1e-45, 1e-30, 1.0, -1.0, 1e10, 1e19, -1e30, 3.4e38, float("inf"), float("-inf"), float("nan")]
MOST = 1 << 20  # bytes; copies make files no longer

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_][A-Za-z0-9_.:\-]*")


def whole(value):
    """Returns the whole part of a number, or 0 if it is not finite."""
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


BYTES = [splice, splice, graft, move, repeat, drop, truncate, blank, append, count_near, count_near, count_near, number_end, float_end]
TEXTS = [splice, graft, move, repeat, drop, truncate, blank, text_number, text_number, text_number, text_number, text_word, text_word,
         text_lines, text_lines, text_damage, text_ends]

B, T = BYTES, TEXTS
TEXT_AND_BYTES = B + [text_number, text_word, text_lines] * 3
MTL = [[word.replace("IN", "scene.obj") for word in run] for run in MESH[:-3]]
SPHERES = [["bake", "spheres.json", "--size", "8", *SMALL, "-o", "out.exr"], ["info", "spheres.json"],
           ["query", "spheres.json", "--points", "points.csv", *SMALL, "-o", "out.csv"],
           ["voxelize", "voxels.json", *SMALL, "-o", "out.vdb"]]
QUERY = ["query", "ball.json", "--points", "IN", "--threads", "1"]
POINTS = [QUERY + ["-o", "out.csv"], QUERY + ["-o", "out.ply"], QUERY + ["--strict", "-o", "out.csv"], QUERY + ["--answers-only", "-o", "out.csv"],
          QUERY + ["--batch", "2", "-o", "out.csv"]]
BALL = text({"casters": [{"sdf": {"shape": "sphere", "radius": 1}}], "resolution": 10, "method": "cone",
             "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2], "angle_deg": 5}]})
GOLDEN = scene({"sdf": {"shape": "sphere", "radius": 1}}, method="cone")
FONT = [["bake", "text.json", "--size", "8", *SMALL, "-o", "out.exr"], ["flat", "flat_text.json", "--size", "8", "--threads", "1", "-o", "out.exr"],
        ["info", "text.json"]]

FORMATS = [
    Format("obj", "obj", T, MESH, lambda sound: sound.read("tests/models/scene.obj", "assets/seeds_floor.obj") + fuzz_inputs("model", "seed_obj")),
    Format("mtl", "mtl", T, MTL, models("scene.mtl"), "scene.mtl", obj_with("mtl")),
    Format("ply-text", "ply", T, MESH, lambda sound: sound.read("tests/models/scene_ascii.ply") + fuzz_inputs("model", "seed_ply")),
    Format("ply-binary", "ply", TEXT_AND_BYTES, MESH,
           lambda sound: sound.read("tests/models/scene.ply") + fuzz_inputs("model", "seed_plyb", "seed_plyl")),
    Format("stl-text", "stl", T, MESH, models("scene_ascii.stl")),
    Format("stl-binary", "stl", B, MESH, lambda sound: sound.read("tests/models/scene.stl") + fuzz_inputs("model", "seed_stlb")),
    Format("glb", "glb", TEXT_AND_BYTES, MESH, models("scene.glb", "figure.glb")),
    Format("gltf", "gltf", T, MESH, models("scene.gltf"), None, lambda sound: {"scene.bin": sound.read("tests/models/scene.bin")[0]}),
    Format("glb-draco", "glb", TEXT_AND_BYTES, MESH, models("scene_draco.glb")),
    Format("fbx", "fbx", B, MESH, models("scene.fbx", "figure.fbx")),
    Format("dae", "dae", T, MESH, models("scene.dae")),
    Format("vdb-none", "vdb", TEXT_AND_BYTES, VDB, level_sets("m1.vdb", "m3.vdb", "v.vdb"), None, lambda _: VDB_SCENE),
    Format("vdb-zip", "vdb", TEXT_AND_BYTES, VDB, level_sets("zip.vdb", "zip_half.vdb"), None, lambda _: VDB_SCENE),
    Format("vdb-blosc", "vdb", TEXT_AND_BYTES, VDB, level_sets("m2.vdb"), None, lambda _: VDB_SCENE),
    image("exr", TEXT_AND_BYTES, [], ["--bits", "16"]),
    image("png", B, [], ["--pack", "R=ao", "--bits", "8"]),
    image("tif", B, [], ["--bits", "32"], ["--bits", "8"]),
    image("jpg", B), image("hdr", B + T), image("webp", B), image("gif", B), image("tga", B), image("bmp", B), image("dpx", B), image("ppm", B + T),
    Format("scene", "json", T, SCENE, scenes, None, assets),
    Format("flat", "json", T, [["flat", "IN", "--size", "8", "--threads", "1", "-o", "out.exr"], ["info", "IN"]], flat_scenes, None, assets),
    Format("regress", "json", T, [["regress", "."], ["regress", ".", "--json"], ["regress", ".", "--update"]],
           lambda _: [text({"cases": [{"scene": "a.json", "options": ["--size", "6"], "output": "b.exr", "name": "b"},
                                      {"scene": "a.json", "command": "volume", "options": ["--band", "1"], "output": "a.vdb"}]})],
           "regress.json", lambda _: {"a.json": GOLDEN}),
    Format("tolerance", "json", T, [["compare", "LIKE", "LIKE", "--tolerances", "IN"]],
           lambda _: [text({"rmse": 0.01, "max": 0.2, "p99": 0.02, "penumbra": 0.05, "shift": 0.1,
                            "lost": 3, "step": 0.2, "reach": 2, "coverage": 0.002, "channels": {"shadow.*": {"penumbra": 0.05}}})]),
    Format("spheres", "csv", T, SPHERES, lambda sound: sound.read("assets/spheres.csv"), None, lambda _: {
        "spheres.json": scene({"spheres": "in.csv"}), "voxels.json": scene({"spheres": "in.csv", "voxelised": True})}),
    Format("points-csv", "csv", T, POINTS, lambda sound: [every(sound)["points.csv"] * 1, b"# a\nx;y;z\n" + b"1;2;3\n" * 20,
                                                        b"x y z nx ny nz id\n" + b"".join(b"%d 2 0.5 0 1 0 a%d\n" % (i, i) for i in range(40))],
           None, lambda _: {"ball.json": BALL}),
    Format("points-ply", "ply", TEXT_AND_BYTES, POINTS,
           lambda sound: sound.read("tests/models/scene.ply", "tests/models/scene_ascii.ply"), None, lambda _: {"ball.json": BALL}),
    Format("font", "ttf", B, FONT,
           lambda _: [open(FONTS + name, "rb").read() for name in ("DejaVuSansMono.ttf", "DejaVuMathTeXGyre.ttf")
                      if os.path.exists(FONTS + name)], None, lambda _: {
        "text.json": scene({"text": "Ag\n@&", "font": "in.ttf", "height": 1, "thickness": 0.3}),
        "flat_text.json": text({"region": [-2, -2, 2, 2], "casters": [{"text": "ABC\u00e9", "font": "in.ttf", "height": 1}],
                                "lights": [{"name": "l", "type": "disc", "position": [1, 1.5], "radius": 0.1}]})}),
]
VDB_SCENE = {"vdb.json": scene({"vdb": "in.vdb", "transform": {"scale": 0.5}}, {"sdf": {"shape": "sphere", "radius": 0.3}})}
