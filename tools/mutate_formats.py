"""The formats of tools/mutate: from which sound files its inputs are made, how, and what is run with them."""
import glob
import json
import os
import subprocess
import tarfile

import mutators
import mutators_parts as parts

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


B, T, J = mutators.BYTES, mutators.TEXTS, mutators.TREES
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
    Format("ply-binary", "ply", B + [mutators.text_number, mutators.text_word, mutators.text_lines] * 3, MESH,
           lambda sound: sound.read("tests/models/scene.ply") + fuzz_inputs("model", "seed_plyb", "seed_plyl")),
    Format("stl-text", "stl", T, MESH, models("scene_ascii.stl")),
    Format("stl-binary", "stl", B, MESH, lambda sound: sound.read("tests/models/scene.stl") + fuzz_inputs("model", "seed_stlb")),
    Format("glb", "glb", B + [parts.glb_tree] * 12 + [parts.GLB] * 6, MESH, models("scene.glb", "figure.glb")),
    Format("gltf", "gltf", J, MESH, models("scene.gltf"), None, lambda sound: {"scene.bin": sound.read("tests/models/scene.bin")[0]}),
    Format("glb-draco", "glb", B + [parts.glb_tree] * 6 + [parts.GLB] * 14, MESH, models("scene_draco.glb")),
    Format("fbx", "fbx", B + [parts.fbx] * 20, MESH, models("scene.fbx", "figure.fbx")),
    Format("dae", "dae", T, MESH, models("scene.dae")),
    Format("vdb-none", "vdb", B + [parts.vdb_text, parts.vdb_head] * 4, VDB, level_sets("m1.vdb", "m3.vdb", "v.vdb"), None, lambda _: VDB_SCENE),
    Format("vdb-zip", "vdb", B + [parts.vdb_text, parts.vdb_head, parts.vdb_packed] * 4, VDB, level_sets("zip.vdb", "zip_half.vdb"), None, lambda _: VDB_SCENE),
    Format("vdb-blosc", "vdb", B + [parts.vdb_text, parts.vdb_head, parts.vdb_packed] * 4, VDB, level_sets("m2.vdb"), None, lambda _: VDB_SCENE),
    image("exr", B + [parts.EXR] * 12 + [parts.exr_chunks] * 6, [], ["--bits", "16"]),
    image("png", B + [parts.PNG] * 16, [], ["--pack", "R=ao", "--bits", "8"]),
    image("tif", B + [parts.tiff_entry] * 16, [], ["--bits", "32"], ["--bits", "8"]),
    image("jpg", B + [parts.JPEG] * 10),
    image("hdr", B + T), image("webp", B), image("gif", B), image("tga", B), image("bmp", B), image("dpx", B), image("ppm", B + T),
    Format("scene", "json", J, SCENE, scenes, None, assets),
    Format("flat", "json", J, [["flat", "IN", "--size", "8", "--threads", "1", "-o", "out.exr"], ["info", "IN"]], flat_scenes, None, assets),
    Format("regress", "json", J, [["regress", "."], ["regress", ".", "--json"], ["regress", ".", "--update"]],
           lambda _: [text({"cases": [{"scene": "a.json", "options": ["--size", "6"], "output": "b.exr", "name": "b"},
                                      {"scene": "a.json", "command": "volume", "options": ["--band", "1"], "output": "a.vdb"}]})],
           "regress.json", lambda _: {"a.json": GOLDEN}),
    Format("tolerance", "json", J, [["compare", "LIKE", "LIKE", "--tolerances", "IN"]],
           lambda _: [text({"rmse": 0.01, "max": 0.2, "p99": 0.02, "penumbra": 0.05, "shift": 0.1,
                            "lost": 3, "step": 0.2, "reach": 2, "coverage": 0.002, "channels": {"shadow.*": {"penumbra": 0.05}}})]),
    Format("spheres", "csv", T, SPHERES, lambda sound: sound.read("assets/spheres.csv"), None, lambda _: {
        "spheres.json": scene({"spheres": "in.csv"}), "voxels.json": scene({"spheres": "in.csv", "voxelised": True})}),
    Format("points-csv", "csv", T, POINTS, lambda sound: [every(sound)["points.csv"] * 1, b"# a\nx;y;z\n" + b"1;2;3\n" * 20,
                                                        b"x y z nx ny nz id\n" + b"".join(b"%d 2 0.5 0 1 0 a%d\n" % (i, i) for i in range(40))],
           None, lambda _: {"ball.json": BALL}),
    Format("points-ply", "ply", B + [mutators.text_number, mutators.text_word, mutators.text_lines] * 3, POINTS,
           lambda sound: sound.read("tests/models/scene.ply", "tests/models/scene_ascii.ply"), None, lambda _: {"ball.json": BALL}),
    Format("font", "ttf", B + [mutators.count_near, mutators.number_end] * 4, FONT,
           lambda _: [open(FONTS + name, "rb").read() for name in ("DejaVuSansMono.ttf", "DejaVuMathTeXGyre.ttf")
                      if os.path.exists(FONTS + name)], None, lambda _: {
        "text.json": scene({"text": "Ag\n@&", "font": "in.ttf", "height": 1, "thickness": 0.3}),
        "flat_text.json": text({"region": [-2, -2, 2, 2], "casters": [{"text": "ABC\u00e9", "font": "in.ttf", "height": 1}],
                                "lights": [{"name": "l", "type": "disc", "position": [1, 1.5], "radius": 0.1}]})}),
]
VDB_SCENE = {"vdb.json": scene({"vdb": "in.vdb", "transform": {"scale": 0.5}}, {"sdf": {"shape": "sphere", "radius": 0.3}})}
