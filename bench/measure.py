"""The parts of `tools/bench` that need only the Python module. Usage: measure.py PART FILE.csv

Seconds are processor seconds of one thread, so other work on the machine matters little."""
import csv
import ctypes
import math
import multiprocessing
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy

import vdbshade as v

ROOT = pathlib.Path(__file__).resolve().parents[1]
BUILD = pathlib.Path(v.__file__).resolve().parents[2]
ASSETS = ROOT / "assets"
ONE = v.Run(threads=1)
SUN, SUN_ANGLE, AO_DISTANCE = (-0.5, 0.8, -0.6), math.radians(5), 0.6


def sun(name="sun", turn=0.0, angle=SUN_ANGLE):
    """A sun, turned around the y axis."""
    x, y, z = SUN
    c, s = math.cos(turn), math.sin(turn)
    return v.Light(direction=(x * c - z * s, y, x * s + z * c), angle=angle, name=name)


def timed(function, *arguments, clock=time.process_time, **options):
    """Seconds, and what the function returned."""
    begin = clock()
    result = function(*arguments, **options)
    return clock() - begin, result


def median(function, *arguments, runs=5, **options):
    """Median seconds of several runs, and what the last one returned. One run suffices if it takes two seconds."""
    seconds = []
    while len(seconds) < runs:
        second, result = timed(function, *arguments, **options)
        seconds.append(second)
        if second > 2.0:
            break
    return statistics.median(seconds), result


# --- features: the cost of each feature of a bake. Options of disabled features must cost nothing. The cloister at 512² and
# 256 voxels, each row in a new process.

ADAPTIVE, EXACT = dict(method="adaptive", max_error=0.02), dict(method="exact", max_error=0.02)
IDLE = dict(ao_method="rays", ao_cones=256, rays=4096, max_error=1e-4, ao_distance=1000.0)
FEATURES = {
    "baseline: one sun, cone": {}, "same, options of all that is off": IDLE, "nothing asked for": dict(lights=[]),
    "+ second sun": dict(lights=[sun("a"), sun("b", 2.0)]),
    "a lamp instead": dict(lights=[v.Light("sphere", position=numpy.multiply(SUN, 8.944), radius=0.44, name="lamp")]),
    "+ AO, 16 cones": dict(ao=True), "+ error plane": dict(error=True), "+ irradiance": dict(irradiance=True),
    "+ padding 16": dict(padding=16), "+ supersample 2": dict(supersample=2), "adaptive 0.02 instead": ADAPTIVE,
    "exact 0.02 instead": EXACT, "exact 0.02, error plane": dict(EXACT, error=True)}


def status_bytes(key):
    text = pathlib.Path("/proc/self/status").read_text()
    return 1024 * int(text.split(key + ":")[1].split()[0])


def feature(name):
    """One row, measured in a new process."""
    options = dict(dict(lights=[sun()], method="cone", ao_distance=AO_DISTANCE, run=ONE), **FEATURES[name])
    charts_options = {key: options.pop(key) for key in ("padding", "supersample") if key in options}
    meshes = v.Model(ASSETS / "cloister.glb")
    occluders = v.Occluders(meshes, resolution=256, triangles=options["method"] == "exact", run=ONE)
    tree = occluders.info.triangles_s
    pathlib.Path("/proc/self/clear_refs").write_text("5")  # forgets the peak so far
    before = status_bytes("VmRSS")
    texels, charts = timed(v.Charts, meshes, width=512, height=512, run=ONE, **charts_options)
    seconds, peaks = [], []
    for _ in range(5):
        second, lightmap = timed(v.bake_lightmap, occluders, charts, **options)
        seconds.append(second)
        peaks.append(status_bytes("VmHWM") - before)
    work = lightmap.stats.shade
    return [name, tree, texels, statistics.median(seconds), peaks[0], work.marches, work.samples, work.rays]


def features():
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        rows = pool.map(feature, FEATURES, chunksize=1)
    yield ["what", "tree_s", "texels_s", "bake_s", "bake_to_baseline", "peak_bytes", "marches", "samples", "rays"]
    for name, tree, texels, bake, *rest in rows:
        yield [name, f"{tree:.5f}", f"{texels:.5f}", f"{bake:.5f}", f"{bake / rows[0][3]:.3f}", *rest]


# --- scaling: seconds of the stages over texels, lights, voxels, triangles and threads, and the exponents of fitted power laws

STAGES = dict(voxelize="#8a5a00", field="#c28f2c", tree="#888888", texels="#5b8c5a", shadow="#1f5fa8", ao="#a83279", exact="#d1495b")


def ring(edge):
    """A lobed ring of 2 edge² triangles in the upper half of the lightmap, over a plate in the lower half."""
    v_, u = numpy.meshgrid(numpy.arange(edge + 1) / edge, numpy.arange(edge + 1) / edge, indexing="ij")
    a, b = 2 * numpy.pi * (u % 1.0), 2 * numpy.pi * (v_ % 1.0)  # the seam's two sides lie at the very same place
    tube = 0.35 + 0.08 * numpy.cos(7 * a) * numpy.cos(3 * b)
    radius = 1.2 + tube * numpy.cos(b)
    positions = numpy.stack([radius * numpy.cos(a), tube * numpy.sin(b), radius * numpy.sin(a)], axis=2).reshape(-1, 3)
    uvs = numpy.stack([0.02 + 0.96 * u, 0.52 + 0.46 * v_], axis=2).reshape(-1, 2)
    first = (numpy.arange(edge)[:, None] * (edge + 1) + numpy.arange(edge)).reshape(-1, 1)
    indices = (first + [0, edge + 1, 1, 1, edge + 1, edge + 2]).reshape(-1, 3)
    plate = v.Mesh([[-2, -0.9, -2], [2, -0.9, -2], [2, -0.9, 2], [-2, -0.9, 2]], [[0, 2, 1], [0, 3, 2]], name="plate",
                   uvs=[[0.02, 0.02], [0.02, 0.48], [0.98, 0.48], [0.98, 0.02]])
    return [v.Mesh(positions, indices, uvs=uvs, name="ring"), plate]


def stages(meshes, resolution=256, size=512, lights=1, threads=1, clock=time.process_time):
    """Seconds of each stage (those of occluders by the wall clock), and the field's bytes."""
    run = v.Run(threads=threads)
    marched, traced = (v.Occluders(meshes, resolution=resolution, triangles=kept, run=run) for kept in (False, True))
    made = traced.info
    texels, charts = timed(v.Charts, meshes, width=size, height=size, run=run, clock=clock)
    suns = [sun(f"sun{i}", 2 * math.pi * i / 8) for i in range(lights)]
    bakes = [(marched, suns, dict(method="cone")), (marched, [], dict(ao=True, ao_method="cones", ao_distance=AO_DISTANCE)),
             (traced, suns, dict(method="exact", max_error=0.05))]
    baked = [median(v.bake_lightmap, o, charts, lit, runs=3, run=run, clock=clock, **more)[0] for o, lit, more in bakes]
    return [made.voxelize_s, made.field_s, made.triangles_s, texels, *baked, made.field_bytes]


def scaling():
    model, cores = v.Model(ASSETS / "cloister.glb"), multiprocessing.cpu_count()
    axes = dict(texels=[(n * n, dict(size=n)) for n in (256, 512, 1024, 2048)], lights=[(n, dict(lights=n)) for n in (1, 2, 4, 8)],
                voxels=[(n, dict(resolution=n)) for n in (64, 128, 256, 512)],
                triangles=[(2 * n * n + 2, dict(meshes=ring(n))) for n in (22, 71, 224, 707)],
                threads=[(n, dict(size=1024, threads=n, clock=time.monotonic)) for n in (1, 2, 4, 8, 16) if n <= max(cores, 2)])
    yield ["axis", "value", *(f"{name}_s" for name in STAGES), "field_bytes"]
    for axis, steps in axes.items():
        costs = [stages(**dict(dict(meshes=model), **options)) for _, options in steps]
        for (value, _), cost in zip(steps, costs):
            yield [axis, value, *(f"{c:.5f}" for c in cost[:-1]), cost[-1]]
        slopes = numpy.polyfit(numpy.log([value for value, _ in steps]), numpy.log(numpy.maximum(costs, 1e-9)), 1)[0]
        yield [axis, "exponent", *(f"{slope:.3f}" for slope in slopes)]


def plot_scaling(path):
    """Draws the seconds over each axis, both logarithmic, with Matplotlib."""
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    with open(path, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["value"] != "exponent"]
    titles = dict(texels="texels of the lightmap's square", lights="lights", voxels="voxels along the longest side", triangles="triangles")
    figure, panels = pyplot.subplots(2, 2, figsize=(9, 7), sharey=True)
    for panel, (axis, title) in zip(panels.flat, titles.items()):
        found = [row for row in rows if row["axis"] == axis]
        for stage, color in STAGES.items():
            panel.loglog([float(row["value"]) for row in found], [float(row[stage + "_s"]) for row in found], "o-", color=color, ms=3, label=stage)
        panel.set(xlabel=title, ylabel="seconds")
    panels[0, 0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path.removesuffix(".csv") + ".svg")


# --- read: files parsed in a reader and in the process itself, and meshes of a million triangles by Assimp

def processor():
    """Seconds of this process and of its children."""
    return sum(used.ru_utime + used.ru_stime for used in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


def sheet(rows=708):
    """A wavy sheet of a million triangles: positions, normals, UVs, indices."""
    i, k = numpy.divmod(numpy.arange((rows + 1) ** 2), rows + 1)
    slope = numpy.stack([-0.6 * numpy.cos(0.02 * i) * numpy.cos(0.03 * k), 1 + 0 * i, 0.9 * numpy.sin(0.02 * i) * numpy.sin(0.03 * k)], axis=1)
    positions = numpy.stack([1e-2 * i, 0.3 * numpy.sin(0.02 * i) * numpy.cos(0.03 * k), 1e-2 * k], axis=1)
    first = (numpy.arange(rows)[:, None] * (rows + 1) + numpy.arange(rows)).reshape(-1, 1)
    indices = (first + [0, 1, rows + 2, 0, rows + 2, rows + 1]).reshape(-1, 3)
    return positions, slope / numpy.linalg.norm(slope, axis=1, keepdims=True), numpy.stack([i, k], axis=1) / rows, indices


def write_obj(path, positions, normals, uvs, indices):
    with open(path, "w", encoding="ascii") as file:
        numpy.savetxt(file, positions, "v %.6f %.6f %.6f")
        if normals is not None:
            numpy.savetxt(file, uvs, "vt %.6f %.6f")
            numpy.savetxt(file, normals, "vn %.6f %.6f %.6f")
        corner = "%d" if normals is None else "%d/%d/%d"
        numpy.savetxt(file, numpy.repeat(indices + 1, 1 if normals is None else 3, axis=1), " ".join(["f", *3 * [corner]]))


def write_ply(path, positions, normals, uvs, indices, ascii):
    vertices, corners = numpy.concatenate([positions, normals, uvs], axis=1).astype("<f4"), numpy.empty(len(indices), "u1,3<u4")
    corners["f0"], corners["f1"] = 3, indices
    head = (f"ply\nformat {'ascii' if ascii else 'binary_little_endian'} 1.0\nelement vertex {len(vertices)}\n" +
            "".join(f"property float {name}\n" for name in "x y z nx ny nz s t".split()) +
            f"element face {len(indices)}\nproperty list uchar uint vertex_indices\nend_header\n")
    with open(path, "wb") as file:
        file.write(head.encode())
        if ascii:
            numpy.savetxt(file, vertices, "%.6f")
            numpy.savetxt(file, indices, "3 %d %d %d")
        else:
            file.write(vertices.tobytes() + corners.tobytes())


def read_by_assimp(path):
    assimp = ctypes.CDLL("libassimp.so.5")
    assimp.aiImportFile.restype = ctypes.c_void_p
    scene = assimp.aiImportFile(str(path).encode(), 0)
    if not scene:
        raise OSError(f"{path}: Assimp cannot read it")
    assimp.aiReleaseImport(ctypes.c_void_p(scene))


def read():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, voxel in (("small.vdb", 0.1), ("large.vdb", 0.005)):
            v.Grid.from_sdf(v.Sdf("sphere"), voxel_size=voxel).write(folder / file)
        positions, normals, uvs, indices = sheet()
        write_obj(folder / "large.obj", positions, None, None, indices)
        write_obj(folder / "full.obj", positions, normals, uvs, indices)
        write_ply(folder / "ascii.ply", positions, normals, uvs, indices, True)
        write_ply(folder / "large.ply", positions, normals, uvs, indices, False)
        v.lit_write(folder / "large.glb", v.Model(folder / "large.ply"), [])
        plane = numpy.sin(1e-3 * numpy.outer(numpy.arange(4096), numpy.arange(4096)) / 4096).astype(numpy.float32)
        v.image_write(folder / "large.exr", dict(ao=plane, A=plane))
        yield ["file", "bytes", "here_ms", "reader_ms", "ratio", "here_wall_ms", "reader_wall_ms", "assimp_ms", "reader_to_assimp"]
        for what, path, function, million in [
                ("a ball of 20 voxels", folder / "small.vdb", v.Grid.read, False), ("a ball of 400 voxels", folder / "large.vdb", v.Grid.read, False),
                ("thin.glb", ASSETS / "thin.glb", v.Model, False), ("a million triangles", folder / "large.obj", v.Model, True),
                ("with UVs and normals", folder / "full.obj", v.Model, True), ("the same as ASCII PLY", folder / "ascii.ply", v.Model, True),
                ("the same as PLY", folder / "large.ply", v.Model, True), ("the same as GLB", folder / "large.glb", v.Model, True),
                ("terrain.png", ASSETS / "terrain.png", v.image_read, False), ("EXR of 4096², 2 planes", folder / "large.exr", v.image_read, False)]:
            ways = [lambda: function(path, run=v.Run(threads=1, reader=False)),
                    lambda: function(path, run=v.Run(threads=1, reader=BUILD / "vdbshade-reader"))]
            ways += [lambda: read_by_assimp(path)] if million else []
            rounds = [[(timed(way, clock=processor)[0], timed(way, clock=time.monotonic)[0]) for way in ways] for _ in range(6)]
            (here, here_wall), (reader, reader_wall), *assimp = 1e3 * numpy.median(rounds[1:], axis=0)  # the first one loads libraries
            yield [what, path.stat().st_size, f"{here:.2f}", f"{reader:.2f}", f"{reader / here:.2f}", f"{here_wall:.2f}", f"{reader_wall:.2f}",
                   *([f"{assimp[0][0]:.2f}", f"{reader / assimp[0][0]:.2f}"] if million else ["", ""])]


# --- proofs: points whose light a cone proved fully lit or dark, checked by rays against the triangles. Points where a wider light is
# not proved get more rays, because wrong proofs are most likely there.

POINTS, RAYS, MORE_RAYS, WIDER, LIFT = 80000, 256, 4096, 1.3, 1e-5
LIGHTS = {"sun 5": ((-0.5, 0.8, -0.6), 5.0), "narrow 0.5": ((0.3, 0.7, 0.45), 0.5), "wide 30": ((0.2, 0.9, -0.3), 30.0),
          "overhead 2": ((0, 1, 0), 2.0), "grazing 0.5": ((0.9, 0.13, 0.43), 0.5), "grazing 10": ((-0.7, 0.2, 0.68), 10.0),
          "lamp": ((0.13, 0.3, 0.08), 0.02), "large lamp": ((-0.3, 0.7, 0.5), 0.12)}  # degrees; lamps: shares of the scene's size


def light_of(name, info, wider):
    direction, size = LIGHTS[name]
    if "lamp" not in name:
        return v.Light(direction=direction, angle=math.radians(wider * size))
    low, high = numpy.array(info.bounds_min), numpy.array(info.bounds_max)
    extent = (high - low).max()
    return v.Light("sphere", position=(low + high) / 2 + numpy.multiply(direction, extent), radius=wider * size * extent)


def corners_of(mesh):
    """Corners of triangles, world units: (n, 3, 3)."""
    m = numpy.eye(3, 4) if mesh.transform is None else mesh.transform
    return (mesh.positions @ m[:, :3].T + m[:, 3])[mesh.indices]


def truth_of(meshes):
    """Shadow and AO at points by rays against the triangles."""
    occluders = v.Occluders(meshes)
    many = dict(max_error=1e-4, frame=1)
    return (lambda at, up, light, rays: v.shade_shadow(occluders, at, up, light, method="exact", rays=rays, **many),
            lambda at, up, distance, rays: v.shade_ao(occluders, at, up, ao_method="exact", ao_distance=distance, rays=rays, **many))


def points_on(meshes, field, seed):
    """Positions and normals on triangles, in groups of 64 neighbours, outside solids."""
    corners, random = numpy.concatenate([corners_of(mesh) for mesh in meshes]), numpy.random.default_rng(seed)
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = numpy.linalg.norm(normals, axis=1)
    chosen = random.choice(len(corners), POINTS // 64, p=area / area.sum())
    weights = 0.9 * random.dirichlet((1, 1, 1), (len(chosen), 1)) + 0.1 * random.dirichlet((1, 1, 1), (len(chosen), 64))
    at = numpy.einsum("rpc,rcx->rpx", weights, corners[chosen]).reshape(-1, 3)
    up = numpy.repeat(normals[chosen] / area[chosen, None], 64, axis=0).astype(numpy.float32)
    voxel = field.info.voxel_size
    valid = field.sample(at + voxel * up) >= 0.25 * voxel
    return at[valid], up[valid]


def over_horizon(light, at, up):
    """Whether a part of the light is above the points' horizon. Other points are dark without a proof."""
    directional = light.type == "directional"
    to = numpy.broadcast_to(light.direction, at.shape) if directional else numpy.array(light.position) - at
    length = numpy.linalg.norm(to, axis=1)
    sine = math.sin(light.angle / 2) if directional else light.radius / length
    return (to * up).sum(axis=1) / (length * numpy.linalg.norm(up, axis=1)) > -sine


def proved(occluders, at, up, light):
    """Values, and which of them are proved: those without a remaining error."""
    error = numpy.empty(len(at), numpy.float32)
    values = v.shade_shadow(occluders, at, up, light, error=error, method="exact", rays=8, max_error=1.0)
    return values, (error == 0) & over_horizon(light, at, up)


def proofs():
    yield ["scene", "voxels", "light", "valid", "proved", "free", "near", "wrong"]
    for scene in ("cloister", "smooth", "thin"):
        meshes = v.Model(ASSETS / f"{scene}.glb")
        trace_shadow, _ = truth_of(meshes)
        for seed, resolution in enumerate((512, 128, 64, 32)):
            occluders = v.Occluders(meshes, resolution=resolution)
            field = occluders.field
            at, up = points_on(meshes, field, 77 + seed)
            for name in LIGHTS:
                light = light_of(name, field.info, 1.0)
                values, sure = proved(occluders, at, up, light)
                near = sure & ~proved(occluders, at, up, light_of(name, field.info, WIDER))[1]
                wrong = 0
                for chosen, rays in ((sure & ~near, RAYS), (near, MORE_RAYS)):
                    truth = trace_shadow(at[chosen] + LIFT * up[chosen], up[chosen], light, rays)
                    wrong += (truth != values[chosen]).sum()
                yield [scene, resolution, name, len(at), sure.sum(), (values[sure] == 1).sum(), near.sum(), wrong]


# --- cancel: processor time from the cancelling callback to the call's return, in every stage of every long call, at four fractions

FRACTIONS = (0.0, 0.1, 0.5, 0.99)


class Watch:
    """Cancels at a fraction of the Nth stage."""

    def __init__(self, stage=-1, fraction=0.0):
        self.wanted, self.fraction = stage, fraction
        self.stages, self.last, self.stopped = [], 0.0, None

    def __call__(self, stage, fraction):
        if not self.stages or self.stages[-1] != stage or fraction < self.last:
            self.stages.append(stage)
        self.last = fraction
        if self.stopped is None and len(self.stages) - 1 == self.wanted and self.fraction <= fraction < 1:
            self.stopped = time.process_time()
        return self.stopped is not None


def long_calls():
    """Calls by name; casters at 256 voxels, lightmaps and pictures of 512²."""
    meshes, voxels = v.Model(ASSETS / "cloister.glb"), dict(resolution=256)
    grid = v.Grid.from_meshes(meshes, **voxels)
    size, marched, traced = dict(width=512, height=512), v.Occluders.from_grid(grid, reach=2.0), v.Occluders(meshes, reach=2.0, **voxels)
    charts, box, lamp = v.Charts(meshes, **size), v.Voxels.from_grid(grid), sun(angle=0.2)
    turns = numpy.linspace(0, 2 * numpy.pi, 20000, endpoint=False)
    star = (1 + 0.3 * numpy.cos(9 * turns))[:, None] * numpy.stack([numpy.cos(turns), numpy.sin(turns)], axis=1)
    outline = v.Outline.from_polygons([star])
    at, up = points_on(meshes, marched.field, 1)
    query = v.Query(marched, lamp)
    camera = v.Camera().frame(grid.info.bounds_min, grid.info.bounds_max, 0.5, 0.5, 1.0)
    flat = v.FlatScene(ROOT / "tests/golden/flat.json", size=512)

    def bake(shadow, ao):
        return lambda run: v.bake_lightmap(traced, charts, lamp, ao=True, method=shadow, ao_method=ao, max_error=0.1, run=run)

    return {
        "model_read glb": lambda run: v.Model(ASSETS / "smooth.glb", run=run),
        "model_read obj": lambda run: v.Model(ASSETS / "cloister.obj", run=run),
        "grid_from_meshes": lambda run: v.Grid.from_meshes(meshes, run=run, **voxels),
        "grid_from_sdf": lambda run: v.Grid.from_sdf(v.Sdf("sphere"), run=run, **voxels),
        "grid_unite": lambda run: v.Grid.unite([grid, (grid, [[1, 0, 0, 0.123], [0, 1, 0, 0.3], [0, 0, 1, 0]])], run=run, **voxels),
        "outline_from_polygons": lambda run: v.Outline.from_polygons([star], run=run),
        "grid_from_outline": lambda run: v.Grid.from_outline(outline, 1.0, run=run, **voxels),
        "occluders_from_grid": lambda run: v.Occluders.from_grid(grid, reach=2.0, run=run),
        "charts_create": lambda run: v.Charts(meshes, run=run, **size),
        "occluders_create": lambda run: v.Occluders(meshes, run=run),
        "bake cones": bake("cone", "cones"), "bake adaptive": bake("adaptive", "adaptive"), "bake exact": bake("exact", "exact"),
        "voxels_from_grid": lambda run: v.Voxels.from_grid(grid, run=run),
        "bake_volume": lambda run: v.bake_volume(marched, box, lamp, ao=True, run=run),
        "render": lambda run: v.render([marched.field], marched, lamp, camera=camera, ao=True, shafts=0.5, run=run, **size),
        "flat_bake": lambda run: flat.bake(run=run),
        "query_points": lambda run: query.points(at, up, ao=True, run=run)}


def cancel():
    yield ["call", "stage", *(f"at_{fraction:g}_ms" for fraction in FRACTIONS)]
    for name, function in long_calls().items():
        whole = Watch()
        function(v.Run(progress=whole, interval=0.0))
        for stage, title in enumerate(whole.stages):
            row = []
            for fraction in FRACTIONS:
                watch = Watch(stage, fraction)
                try:
                    function(v.Run(progress=watch, interval=0.0))
                except v.Cancelled:
                    pass
                row.append("" if watch.stopped is None else f"{1e3 * (time.process_time() - watch.stopped):.1f}")
            yield [name, title, *row]


# --- seams: differences of bilinear lookups on both sides of chart borders on smooth surfaces (docs/unwrap.md). Lightmaps have many
# rays, with and without stitching. "off" is the error of the lookups against rays from the same places.

def edges_of(mesh):
    """Edges of triangles, the lower end first, world units: (3 n, 2 ends, x y z | normal | uv)."""
    m = numpy.eye(3, 4) if mesh.transform is None else mesh.transform
    at = corners_of(mesh)
    flat = numpy.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])[:, None] + 0 * at
    normal = flat if mesh.normals is None else (mesh.normals @ m[:, :3].T)[mesh.indices]
    normal = normal / numpy.maximum(numpy.linalg.norm(normal, axis=2, keepdims=True), 1e-30)
    corner = numpy.concatenate([at, normal, mesh.uvs[mesh.indices]], axis=2)
    ends = numpy.stack([corner, numpy.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2, 8)
    order = numpy.array([tuple(a[:3]) <= tuple(b[:3]) for a, b in ends])
    return numpy.where(order[:, None, None], ends, ends[:, ::-1])


def seam_places(meshes, size, step=0.25):
    """Places along smooth edges of two triangles that are apart in the lightmap: (n, 2 sides, x y z | normal | uv)."""
    edges = numpy.concatenate([edges_of(mesh) for mesh in meshes])
    _, edge, counts = numpy.unique(edges[:, :, :3].reshape(-1, 6), axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    paired = numpy.flatnonzero(counts[edge] == 2)
    pairs = edges[paired[numpy.argsort(edge[paired], kind="stable")]].reshape(-1, 2, 2, 8)
    smooth = ((pairs[:, 0, :, 3:6] * pairs[:, 1, :, 3:6]).sum(axis=2) >= math.cos(math.radians(5))).all(axis=1)
    apart = (abs(pairs[:, 0, :, 6:] - pairs[:, 1, :, 6:]) * size >= 1e-3).any(axis=(1, 2))
    places = []
    for pair in pairs[smooth & apart]:
        count = 1 + int(numpy.linalg.norm((pair[:, 1, 6:] - pair[:, 0, 6:]) * size, axis=1).max() / step)
        t = ((numpy.arange(count) + 0.37) / count)[:, None, None]  # nobody else looks at 0.37
        places.append(pair[:, 0] + t * (pair[:, 1] - pair[:, 0]))
    return numpy.concatenate(places)


def look_up(plane, uv):
    """Bilinear lookups; row 0 is at v = 1."""
    height, width = plane.shape
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    i, k = numpy.floor(x).astype(int), numpy.floor(y).astype(int)
    left, right, top, low = (numpy.clip(n, 0, most - 1) for n, most in ((i, width), (i + 1, width), (k, height), (k + 1, height)))
    s, t = x - i, y - k
    return (1 - t) * ((1 - s) * plane[top, left] + s * plane[top, right]) + t * ((1 - s) * plane[low, left] + s * plane[low, right])


def seams(truth_rays=1024):
    yield ["asset", "size", "channel", "what", "places", "rms", "p50", "p99", "max", "off", "cpu_s"]
    light = ["--sun", ",".join(map(str, SUN)), "--sun-angle", "5", "--ao", str(AO_DISTANCE), "--threads", "1"]
    with tempfile.TemporaryDirectory() as folder:
        for asset in ("cloister", "smooth"):
            model = ASSETS / f"{asset}.glb"
            meshes = v.Model(model)
            trace_shadow, trace_ao = truth_of(meshes)
            for size in (256, 1024):
                places, path = seam_places(meshes, size), pathlib.Path(folder) / "out.exr"
                truths = []
                for side in (0, 1):
                    up = places[:, side, 3:6] / numpy.linalg.norm(places[:, side, 3:6], axis=1, keepdims=True)
                    at, up = places[:, side, :3] + 1e-5 * up, up.astype(numpy.float32)
                    truths.append({"shadow.sun": trace_shadow(at, up, sun(), 1024), "ao": trace_ao(at, up, AO_DISTANCE, 1024)})
                subprocess.run([BUILD / "bench/vsh_embree_bake", model, "-o", path, "--size", str(size), *light, "--rays", str(truth_rays),
                                "--frame", "7"], check=True)
                found = {"truth": (v.image_read(path), 0.0)}
                seconds = timed(subprocess.run, [BUILD / "vdbshade", "bake", model, "-o", path, "--size", str(size), *light, "--quiet"],
                                check=True, clock=processor)[0]
                found["keep"] = (v.image_read(path), seconds)
                stitched = {name: numpy.array(found["keep"][0][name]) for name in ("shadow.sun", "ao", "A")}
                charts = v.Charts(meshes, width=size, height=size)
                found["fix"] = (stitched, timed(v.lightmaps_stitch, [(charts, stitched)], max_change=0.02, run=ONE)[0])
                for what, (planes, seconds) in found.items():
                    for channel in ("shadow.sun", "ao"):
                        sides = [look_up(planes[channel], places[:, side, 6:]) for side in (0, 1)]
                        apart = abs(sides[0] - sides[1])
                        off = numpy.mean([(values - truth[channel]) ** 2 for values, truth in zip(sides, truths)]) ** 0.5
                        ranks = [math.sqrt(numpy.mean(apart**2)), *numpy.percentile(apart, [50, 99, 100], method="lower"), off]
                        yield [asset, size, channel, what, len(places), *(f"{rank:.6f}" for rank in ranks), f"{seconds:.3f}"]


# --- calls: time of a call from Python and of the same call from C (points.c)

def nanoseconds(function, calls=20000):
    """Median seconds of one call over five runs."""
    return statistics.median(timed(lambda: [function() for _ in range(calls)])[0] for _ in range(5)) / calls * 1e9


def calls(rounds=7, million=1000000):
    model = ASSETS / "cloister.glb"
    positions = numpy.random.default_rng(1).uniform([-3, 0, -2.2], [3, 2.6, 2.2], (million, 3))
    normals = numpy.tile(numpy.float32([0, 1, 0]), (million, 1))
    occluders, lamp = v.Occluders(v.Model(model), resolution=128), v.Light(direction=(0.5, 1, 0), angle=0.1)
    query, field = v.Query(occluders, lamp, method="cone", ao_method="cones"), occluders.field
    of_c, of_python = [], []
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "points"
        path.write_bytes(positions.tobytes() + normals.tobytes())
        for _ in range(rounds):
            told = subprocess.run([BUILD / "bench/vsh_points", model, path, "2"], check=True, capture_output=True, text=True).stdout
            of_c.append([float(t) for t in told.split()[1:]])  # the first one is not measured, of either
            query.points(positions, normals, run=ONE)
            of_python.append(timed(query.points, positions, normals, run=ONE)[0])
    in_c = numpy.median(of_c, axis=0)
    one, up = positions[:1].copy(), normals[:1].copy()
    into, out = dict(shadow=numpy.empty((1, 1), numpy.float32)), numpy.empty(1, numpy.float32)
    yield ["what", "python_ns", "c_ns", "python_less_c_ns", "python_over_c"]
    for what, function, c in [
            ("Query.points, one point", lambda: query.points(one, up), in_c[1]),
            ("Query.points, one point, into an array", lambda: query.points(one, up, out=into), in_c[1]),
            ("Field.sample, one point", lambda: field.sample(one), in_c[2]),
            ("Field.sample, one point, into an array", lambda: field.sample(one, out), in_c[2]),
            ("shade_shadow, one point", lambda: v.shade_shadow(occluders, one, up, lamp, run=ONE, method="cone"), in_c[3])]:
        python = nanoseconds(function)
        yield [what, f"{python:.0f}", f"{c:.0f}", f"{python - c:.0f}", ""]
    python, c = numpy.median(of_python) / million * 1e9, in_c[0] / million * 1e9
    ratio = numpy.median([p / q[0] for p, q in zip(of_python, of_c)])
    yield ["Query.points, a million points, each", f"{python:.1f}", f"{c:.1f}", f"{python - c:.1f}", f"{ratio:.4f}"]


PARTS = dict(features=features, scaling=scaling, read=read, proofs=proofs, cancel=cancel, seams=seams, calls=calls)


def main(part, path):
    with open(path, "w", newline="", encoding="utf-8") as file:
        for row in PARTS[part]():
            csv.writer(file, lineterminator="\n").writerow(row)
            file.flush()
            print(*row, sep="  ", flush=True)
    if part == "scaling":
        plot_scaling(path)


if __name__ == "__main__":
    main(*sys.argv[1:])
